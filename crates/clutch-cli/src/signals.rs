//! The effect of Ctrl-C and its like.

use anyhow::Context;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A file that may not grow any more fails a write, and does not end the program: the loop goes on without its log, other verbs name
/// the file.
pub(crate) fn outlive_full_files() -> anyhow::Result<()> {
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)))
        .context("signals could not be caught")?;
    Ok(())
}

/// Set by Ctrl-C and SIGTERM.
pub(crate) fn stop_flag() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let signals = [
        signal_hook::consts::SIGINT,
        signal_hook::consts::SIGTERM,
        #[cfg(unix)]
        signal_hook::consts::SIGHUP,
    ];
    for signal in signals {
        signal_hook::flag::register(signal, stop.clone()).context("signals could not be caught")?;
    }
    Ok(stop)
}
