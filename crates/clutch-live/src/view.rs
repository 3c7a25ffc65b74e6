//! The side of a view that the feed sees.

use crate::feed::{Frame, Note, Opening};
use clutch_log::{Header, Record};
use std::fmt::Debug;
use std::time::Duration;

/// A view of the runs that a feed tells of. The feed's thread calls it: nothing in it waits for anybody who looks.
pub(crate) trait View: Debug + Send + Sync {
    /// A run begins.
    fn begin(&self, header: &Header, run: &Opening<'_>);
    /// A record, each one.
    fn record(&self, _: &Record) {}
    /// Something has happened.
    fn note(&self, _: &Note) {}
    /// The figures since the last frame.
    fn frame(&self, _: &Frame) {}
    /// Those who look on.
    fn readers(&self) -> usize;
    /// Nothing more comes. Waits until those who look on know, but not for long.
    fn close(&self, at_most: Duration);
}
