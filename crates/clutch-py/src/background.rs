//! Work that takes long, on a thread of its own, while Python's looks out for signals: Rayon's threads cannot.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Does the work; a signal's exception sets the flag that it is given, and is raised once it has ended. `each` is called now and
/// then meanwhile.
pub(crate) fn in_background<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
    mut each: impl FnMut() -> PyResult<()>,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().spawn_scoped(scope, || work(&stop)).map_err(no_thread)?;
        while !thread.is_finished() {
            py.detach(|| std::thread::sleep(Duration::from_millis(5)));
            if let Err(e) = py.check_signals().and_then(|()| each()) {
                stop.store(true, Ordering::Relaxed);
                let _ = py.detach(|| thread.join());
                return Err(e);
            }
        }
        each()?;
        thread.join().map_err(|_| PyRuntimeError::new_err("a thread of the work broke"))
    })
}

pub(crate) fn no_thread(e: std::io::Error) -> PyErr {
    PyRuntimeError::new_err(format!("no thread for the work: {e}"))
}
