//! What the `clutch` command is made of: drawing, reports, and the verbs.

pub mod plot;
pub mod report;
