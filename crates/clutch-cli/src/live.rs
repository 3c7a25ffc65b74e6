//! `--live`: the view of a run in a browser.

use crate::output::shown;
use anyhow::Context;
use clap::Args;
use clutch_live::Live;
use clutch_loop::onlooker::Looking;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

#[derive(Args)]
pub(crate) struct LiveArg {
    /// Shows the run in a browser while it goes on, at an address of this machine that is printed: PORT, or a free one
    /// (docs/live.md).
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    live: Option<u16>,
}

impl LiveArg {
    pub(crate) fn asked_for(&self) -> bool {
        self.live.is_some()
    }

    /// Serves the view, if it was asked for, and prints its address; the page's button sets `stop`.
    pub(crate) fn start(&self, stop: &Arc<AtomicBool>) -> anyhow::Result<Option<Arc<Live>>> {
        let Some(port) = self.live else { return Ok(None) };
        let live = Live::start(port, stop.clone())
            .with_context(|| format!("--live={port}: no view can be served at this port of 127.0.0.1"))?;
        let text = format!("live view: {}\n", live.address());
        let _ = std::io::stderr().write_all(shown(&text).as_bytes()); // a terminal that has gone away
        Ok(Some(Arc::new(live)))
    }

    /// The same for runs in computed time.
    pub(crate) fn looking(&self, stop: &Arc<AtomicBool>) -> anyhow::Result<Option<Looking>> {
        let live = self.start(stop)?;
        Ok(live.map(|onlooker| Looking { onlooker, stop: stop.clone() }))
    }
}
