//! The table that an error speaks of.

use super::TableInfo;
use core::fmt;

/// A table, by its number; on a host also by what is known of it.
///
/// A board reports a number: were the words within its reach, they would take a fifth of its flash.
#[derive(Clone, Copy)]
pub struct TableRef {
    pub(super) id: u32,
    #[cfg(not(target_os = "none"))]
    pub(super) info: &'static TableInfo,
}

impl TableRef {
    /// [`TableInfo::id`].
    #[must_use]
    pub const fn id(self) -> u32 {
        self.id
    }

    /// Its declaration; nothing on a board.
    #[must_use]
    pub const fn info(self) -> Option<&'static TableInfo> {
        #[cfg(not(target_os = "none"))]
        return Some(self.info);
        #[cfg(target_os = "none")]
        None
    }
}

impl PartialEq for TableRef {
    fn eq(&self, other: &TableRef) -> bool {
        self.id == other.id
    }
}

impl Eq for TableRef {}

impl fmt::Debug for TableRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.info() {
            Some(info) => f.write_str(info.name),
            None => write!(f, "table {:#010x}", self.id),
        }
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for TableRef {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "table {=u32:#010x}", self.id);
    }
}
