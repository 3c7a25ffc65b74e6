//! Tables of a file and the parameters that they stand for.
//!
//! Parameters are declared once, with [`clutch_core::params!`]; what a table of a file may hold, what is filled in,
//! what is wrong with it and what was probably meant follow from the declarations here.

mod check;
mod complete;
mod leaves;
mod read;
mod set;
mod suggest;
mod write;

pub(crate) use check::check;
pub(crate) use complete::{
    checked, complete, complete_table, default_of, default_value, find, lookup, numbers, pair, shown,
    with_todays_keys,
};
pub use leaves::{Points, Text};
pub(crate) use read::{read, read_known};
pub(crate) use set::Place;
pub use suggest::{expected, nearest};
pub use write::written;
