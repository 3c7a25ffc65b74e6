//! How far long work is.

/// A report of progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pieces of work in all.
    pub total: u64,
    /// Pieces finished since the last report.
    pub finished: u64,
}

/// What is told of progress.
pub type Report<'a> = &'a (dyn Fn(Progress) + Sync);

/// For work whose progress nobody watches.
pub const UNWATCHED: Report<'static> = &|_| {};
