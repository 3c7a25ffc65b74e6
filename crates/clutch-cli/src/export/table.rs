//! A table that is being written, whatever its file.

use clutch_log::Value;
use std::io;

/// A table that is being written.
pub(super) trait Table {
    /// The time of a record, s, and the values of its fields.
    fn row(&mut self, time: f64, values: &mut dyn Iterator<Item = Value>) -> io::Result<()>;
    /// All rows are there.
    fn end(self: Box<Self>) -> io::Result<()>;
}
