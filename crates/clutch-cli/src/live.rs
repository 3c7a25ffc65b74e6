//! `--live`, `--foxglove`, `--scope`: views of a run while it goes on.

use crate::output::shown;
use anyhow::Context;
use clap::Args;
use clutch_live::Live;
use clutch_loop::onlooker::Looking;
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

#[derive(Args)]
pub(crate) struct LiveArg {
    /// Shows the run in a browser while it goes on, at an address of this machine that is printed: PORT, or a free one
    /// (docs/live.md).
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0",
        value_parser = port)]
    live: Option<u16>,
    /// Serves the run's records to Foxglove while it goes on, at an address of this machine that is printed: PORT, 0 for a
    /// free one (docs/foxglove.md).
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "8765",
        value_parser = port, hide = cfg!(not(feature = "foxglove")))]
    foxglove: Option<u16>,
    /// Draws the run in the terminal while it goes on; q or Esc ends it as Ctrl-C does.
    #[arg(long, hide = cfg!(not(feature = "scope")))]
    scope: bool,
}

/// The port of Foxglove is the one that it proposes.
#[cfg(feature = "foxglove")]
const _: () = assert!(clutch_live::foxglove::PORT == 8765);

fn port(text: &str) -> Result<u16, String> {
    text.parse().map_err(|_| "expected a port from 1 to 65535, or 0 for a free one".to_owned())
}

impl LiveArg {
    pub(crate) fn asked_for(&self) -> bool {
        self.live.is_some() || self.foxglove.is_some() || self.scope
    }

    /// Refuses a view that this build of the command has not: before a long run, not after.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        let without = |view: &str, asked_for: bool, built: bool| {
            anyhow::ensure!(
                built || !asked_for,
                "--{view}: this command is built without it; the released command has it, or build it: `cargo build \
                 --release -p clutch-cli --features {view}` (docs/foxglove.md). --live shows a run in a browser"
            );
            Ok(())
        };
        without("foxglove", self.foxglove.is_some(), cfg!(feature = "foxglove"))?;
        without("scope", self.scope, cfg!(feature = "scope"))
    }

    /// True if the terminal is the scope's while a run goes on.
    #[cfg(target_os = "linux")]
    pub(crate) fn has_terminal(&self) -> bool {
        self.scope
    }

    /// Serves the views that were asked for, if any, and prints their addresses; the page's button sets `stop`.
    pub(crate) fn start(&self, stop: &Arc<AtomicBool>) -> anyhow::Result<Option<Arc<Live>>> {
        let mut live = Live::default();
        if let Some(port) = self.live {
            tell("live view", "live", port, live.page(port, stop.clone()))?;
        }
        #[cfg(feature = "foxglove")]
        if let Some(port) = self.foxglove {
            tell("Foxglove", "foxglove", port, live.foxglove(port))?;
        }
        #[cfg(feature = "scope")]
        if self.scope {
            let instead = "--live shows the run in a browser";
            live.scope(stop.clone()).with_context(|| format!("--scope: no terminal; {instead}"))?;
        }
        Ok(self.asked_for().then(|| Arc::new(live)))
    }

    /// The same for runs in computed time.
    pub(crate) fn looking(&self, stop: &Arc<AtomicBool>) -> anyhow::Result<Option<Looking>> {
        let live = self.start(stop)?;
        Ok(live.map(|onlooker| Looking { onlooker, stop: stop.clone() }))
    }
}

/// Prints the address of a view.
fn tell(view: &str, option: &str, port: u16, address: io::Result<String>) -> anyhow::Result<()> {
    let address = address
        .with_context(|| format!("--{option}={port}: no view can be served at this port of 127.0.0.1"))?;
    let _ = io::stderr().write_all(shown(&format!("{view}: {address}\n")).as_bytes()); // a terminal that has gone away
    Ok(())
}
