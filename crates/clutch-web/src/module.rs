//! The functions of the WebAssembly module. A text goes over in its memory, as UTF-8: `room`, write, `answer`, read.

use crate::Answerer;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The text that goes over, and what is kept between questions.
static MODULE: Mutex<(Vec<u8>, Answerer)> = Mutex::new((Vec::new(), Answerer::new()));

fn module() -> MutexGuard<'static, (Vec<u8>, Answerer)> {
    MODULE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The place for a question of so many bytes.
// SAFETY: nothing else has this name.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn room(bytes: usize) -> *mut u8 {
    let text = &mut module().0;
    text.clear();
    text.resize(bytes, 0);
    text.as_mut_ptr()
}

/// Answers the question that was written; gives the number of the answer's bytes, which stand at [`text`].
// SAFETY: nothing else has this name.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn answer() -> usize {
    let (text, answerer) = &mut *module();
    let answer = answerer.answer(&String::from_utf8_lossy(text));
    *text = answer.into_bytes();
    text.len()
}

/// The place of the answer.
// SAFETY: nothing else has this name.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn text() -> *const u8 {
    module().0.as_ptr()
}
