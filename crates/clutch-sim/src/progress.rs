//! Progress of long work, and the decision whether it goes on.

use std::ops::ControlFlow;

/// A report of progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pieces of work in all.
    pub total: u64,
    /// Pieces finished since the last report.
    pub finished: u64,
}

/// The listener that gets the progress; its answer `Break` ends the work with [`crate::RunError::Stopped`].
pub type Report<'a> = &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync);

/// For work whose progress nobody watches.
pub const UNWATCHED: Report<'static> = &|_| ControlFlow::Continue(());
