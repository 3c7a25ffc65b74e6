//! `clutch daq`.

use crate::args::ScenarioArgs;
use crate::output::{Exit, print, tell};
use crate::signals::stop_flag;
use clap::Args;
use clutch_loop::faults::Fault;
use clutch_loop::port::{Address, AddressError, ClientEvent, Endpoint, Listener, PseudoTerminal};
use clutch_loop::realtime::WaitMode;
use clutch_loop::sim_board_server::{self, ServeNotice, ServeOptions};
use std::path::PathBuf;

/// Simulates a board in real time: a pseudo-terminal or a TCP address to drive with `clutch loop`.
///
/// Prints the path to connect to, then reports clients and its state until it is interrupted.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  clutch daq board_smc_2\n  clutch daq board_smc_2 --listen tcp://127.0.0.1:5000\n  \
    clutch daq board_smc_2 --fault freeze:at=2 --fault drop:p=0.01,way=up\n\n\
    Faults: drop, duplicate, corrupt, reorder, silence, delay (ms), jitter (ms), freeze, jump (counts), channel \
    (dead = a or b), scale (factor), loss, dac-stuck (volts = a number or last), dac-scale, contact (factor), \
    lever, clock, prescaler, crystal (factor), reset; each with at (s after arming), for (s), p (probability), way (up, down, both)."
)]
pub(crate) struct Daq {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Listens on a UNIX socket or a TCP address of this machine instead of a pseudo-terminal. `unix` alone makes a
    /// socket that only this user may open.
    #[arg(long, value_name = "unix|unix:///PATH|tcp://HOST:PORT", value_parser = listening)]
    listen: Option<Address>,
    /// Injects a fault; may be given several times.
    #[arg(long, value_name = "KIND:KEY=VALUE,…")]
    fault: Vec<Fault>,
    /// Seed of the random faults.
    #[arg(long, default_value_t = 1)]
    fault_seed: u64,
    /// Lets the board's clock wait, up to five seconds, for a controller that a busy machine holds
    /// up. Without it, the board goes to its safe state when the controller is silent for the
    /// watchdog's time, as on hardware.
    #[arg(long)]
    patient: bool,
}

/// A socket's file of this process, in the user's own folder if the system has one.
fn own_socket() -> PathBuf {
    let folder = std::env::var_os("XDG_RUNTIME_DIR").map_or_else(std::env::temp_dir, PathBuf::from);
    folder.join(format!("clutch-{}.sock", std::process::id()))
}

fn listening(text: &str) -> Result<Address, AddressError> {
    if text == "unix" { Ok(Address::Unix(own_socket())) } else { text.parse() }
}

impl Daq {
    pub(crate) fn run(self) -> anyhow::Result<Exit> {
        let scenario = self.scenario.load()?;
        scenario.safety()?;
        if self.patient && self.fault.iter().any(|f| f.kind.silences()) {
            anyhow::bail!(
                "--patient and --fault: a board that waits for its controller would hide the fault; give one of them"
            );
        }
        let stop = stop_flag()?;
        let mut endpoint: Box<dyn Endpoint> = match &self.listen {
            None => match PseudoTerminal::open() {
                Ok((terminal, _)) => Box::new(terminal),
                // If the system has none: a socket that, too, is open to this user alone.
                Err(_) => Box::new(Listener::bind_unix(&own_socket())?),
            },
            Some(Address::Tcp(address)) => Box::new(Listener::bind(*address)?),
            Some(Address::Unix(path)) => Box::new(Listener::bind_unix(path)?),
            Some(other) => {
                anyhow::bail!(
                    "--listen {other}: expected unix, unix:///PATH or an address as tcp://127.0.0.1:5000"
                )
            }
        };
        let address = endpoint.address();
        let path = match &address {
            Address::Serial { path, .. } => path.display().to_string(),
            Address::Tcp(_) | Address::Unix(_) => address.to_string(),
        };
        let mut text = format!(
            "{path}\n{}: simulated board; connect with: clutch loop {} --port {path}{}\n",
            scenario.name(),
            self.scenario.scenario.display(),
            if self.patient { " --patient" } else { "" }
        );
        for fault in &self.fault {
            text += &format!("fault: {fault} (seconds after arming; seed {})\n", self.fault_seed);
        }
        print(&text)?;
        let options = ServeOptions {
            faults: self.fault,
            seed: self.fault_seed,
            patient: self.patient,
            wait: WaitMode::Sleep,
            passed: std::sync::Arc::default(),
        };
        let report = sim_board_server::serve(&scenario, &options, endpoint.as_mut(), &stop, |notice| {
            // A terminal that has gone away does not stop a board.
            let _ = tell(&match notice {
                ServeNotice::Client(ClientEvent::Connected) => "client connected\n".to_owned(),
                ServeNotice::Client(ClientEvent::Left) => "client left\n".to_owned(),
                ServeNotice::Dismissed(reason) => format!("client sent away: {reason}\n"),
                ServeNotice::State(state, time) => format!("{time:10.6} s  {state:?}\n"),
                ServeNotice::Faulted(silent) => {
                    format!("              {:.3} ms after the last code that was applied\n", silent * 1e3)
                }
            });
        })?;
        let mut text = format!("stopped after {} samples", report.samples);
        if report.waits > 0 {
            text += &format!(
                "; the board's clock waited {} times for the controller, {:.3} s in all",
                report.waits, report.waited
            );
        }
        tell(&(text + "\n"))?;
        Ok(Exit::Done)
    }
}
