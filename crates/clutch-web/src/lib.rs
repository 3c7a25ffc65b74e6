//! The simulator for a page in a browser: a question in a line of text, an answer in JSON.
//!
//! A page asks for runs of built-in scenarios, with the keys of `clutch sim --set`; a run is the one of `clutch sim`, bit for
//! bit. `cargo xtask playground` builds the module and puts it into the page.
//!
//! | file | what |
//! |---|---|
//! | `question` | questions, and who answers them |
//! | `drawn` | runs as a page draws them |
//! | `json` | JSON, written |
//! | `bits` | the hash of a run |
//! | `module` | the functions that a page calls |
//! | `declared` | parameters and figures as declared, for the page itself |

mod bits;
pub mod declared;
mod drawn;
mod json;
mod module;
mod question;

pub use question::Answerer;
