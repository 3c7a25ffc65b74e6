//! The threads that runs are spread over. A process that was forked has none of its parent's, and gets its own.

use rayon::ThreadPool;
use std::sync::{Arc, Mutex, PoisonError};

/// The threads, and the process that they are in.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// This process's number; a web page has one process, which is not forked, and no number.
fn process() -> u32 {
    if cfg!(target_family = "wasm") { 0 } else { std::process::id() }
}

/// The threads of this process; none where the system gives none.
fn pool() -> Option<Arc<ThreadPool>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, there)) = &*pool
        && *of == process()
    {
        return Some(there.clone());
    }
    let made = Arc::new(rayon::ThreadPoolBuilder::new().build().ok()?);
    if let Some((_, parents)) = pool.replace((process(), made.clone())) {
        // Its threads are not here: nobody would hear that they are to end.
        std::mem::forget(parents);
    }
    Some(made)
}

/// Does work whose parallel parts go to the threads of this process; without threads on this one.
pub fn install<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    match pool() {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// The number of threads.
#[must_use]
pub fn threads() -> usize {
    pool().map_or(1, |pool| pool.current_num_threads())
}
