//! Before a run: who is on the line, and does it fit.

use crate::board_clock::{BoardClock, Expected, Look, Wrong};
use crate::build_error::BuildError;
use crate::cause_words::why;
use crate::port::{Port, PortError};
use crate::realtime::{Readiness, WaitMode, monotonic_ns, wait_readable};
use crate::station::{HostStation, Station, StationNotice};
use clutch_node::{Notice, Outbox};
use clutch_settings::Settings;
use clutch_sim::number;
use clutch_wire::{Hello, Refusal, Refused};
use rustix::fd::AsFd;
use std::time::Duration;

/// Looks at a board's clock, at least.
const LOOKS: usize = 8;
/// The longest time for which a board's clock is looked at, ns.
const LONGEST_LOOK_NS: u64 = 2_000_000_000;
/// Time between two looks that judge it.
const BETWEEN_LOOKS: Duration = Duration::from_millis(5);

/// A run could not begin.
#[derive(Debug, thiserror::Error)]
pub enum PreflightError {
    /// The port.
    #[error(transparent)]
    Port(#[from] PortError),
    /// The scenario.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// Nobody answers.
    #[error(
        "{address}: nothing answers. Is this the board's port, is the board powered, and does it speak at this baud \
         rate? `clutch daq SCENARIO` starts a simulated board to try with"
    )]
    Silent {
        /// The port.
        address: String,
    },
    /// Somebody talks, but not this protocol.
    #[error(
        "{address}: {bytes} bytes came, and not one frame among them. Another device is on this port, or it runs at \
         another baud rate; a clutch board answers with frames as docs/wire.md has them"
    )]
    Foreign {
        /// The port.
        address: String,
        /// Bytes heard.
        bytes: u64,
    },
    /// Our own words come back.
    #[error(
        "{address}: what is sent comes back. The port echoes: a loop-back plug, a terminal with echo, or a cable that \
         joins transmit and receive; a board answers instead"
    )]
    Echo {
        /// The port.
        address: String,
    },
    /// The board speaks another version.
    #[error(
        "{address}: the board speaks version {board} of the protocol, this program version {}. Flash a firmware of \
         this release, or use the release that fits the board",
        clutch_wire::VERSION
    )]
    Version {
        /// The port.
        address: String,
        /// The board's version.
        board: u32,
    },
    /// The same version with other messages.
    #[error(
        "{address}: the board's message table differs (its hash ends with {board:08x}, this program's with {:08x}). \
         Flash a firmware of this release, or use the release that fits the board",
        clutch_wire::SCHEMA as u32
    )]
    Schema {
        /// The port.
        address: String,
        /// Low half of the board's hash.
        board: u32,
    },
    /// The board does not fit the scenario.
    #[error("{address}: the board does not fit the scenario:\n  {}\nCorrect the scenario, or connect the board that it describes", .lines.join("\n  "))]
    Misfit {
        /// The port.
        address: String,
        /// The differences.
        lines: Vec<String>,
    },
    /// The board said no.
    #[error("{address}: the board refused to be {what}: {why}")]
    Refused {
        /// The port.
        address: String,
        /// The state that was asked for: "known", "set up" or "configured".
        what: &'static str,
        /// The board's reason.
        why: String,
    },
    /// The board closes the loop itself, and was to be a mere board.
    #[error(
        "{address}: this board is a controller, it closes the loop itself; use --board instead of --port"
    )]
    IsController {
        /// The port.
        address: String,
    },
    /// The board is a mere board, and was to close the loop itself.
    #[error("{address}: this board does not close the loop itself; use --port instead of --board")]
    IsNoController {
        /// The port.
        address: String,
    },
    /// A controller without encoder and converter.
    #[error(
        "{address}: the controller answers, but finds no encoder and converter. Is the board on its other line \
         powered and connected?"
    )]
    NoBoard {
        /// The port.
        address: String,
    },
    /// A controller whose settings mean something else.
    #[error(
        "{address}: the controller's table of settings differs (its hash is {board:016x}, this program's {:016x}). \
         Flash a firmware of this release, or use the release that fits the board",
        clutch_settings::SETTINGS_HASH
    )]
    Settings {
        /// The port.
        address: String,
        /// The board's hash.
        board: u64,
    },
    /// The board is of another power-up than the one that said who it is.
    #[error(
        "{address}: the board was reset since it said who it is (its power-up is number {now:08x} now); start again"
    )]
    Reset {
        /// The port.
        address: String,
        /// The number of its power-up, as `Configured` has it.
        now: u32,
    },
    /// The board samples at another rate than the scenario's.
    #[error(
        "{address}: the board takes {seen} samples a second by this machine's clock, expected {expected} \
         (sampling.period_us = {period}). Every velocity would be wrong by as much: correct the board's crystal, prescaler or timer"
    )]
    SampleRate {
        /// The port.
        address: String,
        /// Samples a second.
        seen: String,
        /// Those that are right for the scenario, in words.
        expected: String,
        /// The scenario's period, µs.
        period: u32,
    },
    /// The board's time passes at another rate than ours.
    #[error(
        "{address}: the board's time_us passes {seen} times as fast as this machine's clock, expected {expected}. Correct the \
         board's crystal or prescaler"
    )]
    TimeRate {
        /// The port.
        address: String,
        /// The rate.
        seen: String,
        /// The rates that are right, in words.
        expected: String,
    },
    /// The board stopped answering.
    #[error(
        "{address}: the board answered at first and then no more, when it was to be {what}. Unplugged, or reset?"
    )]
    Lost {
        /// The port.
        address: String,
        /// The request, in words.
        what: &'static str,
    },
}

/// A line with a station at its end, spoken to step by step.
pub struct Talk<'a, S> {
    port: &'a mut Port,
    station: &'a mut S,
    out: Outbox,
    bytes: u64,
    echo: bool,
    /// Those that were sent, for words of what the board refuses.
    settings: Option<Settings>,
}

/// A board's clock against ours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClockOffset {
    /// Ours minus the board's, µs.
    pub offset_us: i64,
    /// Round trip of the request that gave it, µs.
    pub round_trip_us: u64,
}

impl<'a, S: Station> Talk<'a, S> {
    /// On an open port.
    pub fn new(port: &'a mut Port, station: &'a mut S) -> Self {
        Talk { port, station, out: Outbox::default(), bytes: 0, echo: false, settings: None }
    }

    fn address(&self) -> String {
        self.port.address().to_string()
    }

    /// Sends what `ask` puts out, again every 100 ms, until `answer` gives something.
    fn exchange<R>(
        &mut self,
        patience: Duration,
        ask: impl Fn(&mut S, &mut Outbox),
        mut answer: impl FnMut(&StationNotice<S>) -> Option<R>,
    ) -> Result<Option<R>, PreflightError> {
        let until = monotonic_ns() + patience.as_nanos() as u64;
        let mut again = 0;
        let mut buffer = [0; 1024];
        let mut found = None;
        loop {
            let now = monotonic_ns();
            if now >= until {
                return Ok(None);
            }
            if now >= again {
                again = now + 100_000_000;
                ask(self.station, &mut self.out);
            }
            if !self.out.as_bytes().is_empty() {
                self.port.write(self.out.as_bytes()).map_err(|e| self.port.explain(&e))?;
                self.out.clear();
            }
            if wait_readable(self.port.as_fd(), again.min(until), WaitMode::Sleep) == Readiness::Timeout {
                continue;
            }
            let count = self.port.read(&mut buffer).map_err(|e| self.port.explain(&e))?;
            self.bytes += count as u64;
            let echo = &mut self.echo;
            let bytes = buffer.get(..count).unwrap_or(&[]);
            self.station.receive(monotonic_ns(), bytes, &mut self.out, &mut |n| {
                *echo |= matches!(n, Notice::Echo);
                if found.is_none() {
                    found = answer(&n);
                }
            });
            if found.is_some() {
                return Ok(found);
            }
        }
    }

    /// Asks who is there.
    ///
    /// # Errors
    /// Silence, noise, an echo, another version; each says what to do.
    pub fn discover(&mut self, patience: Duration) -> Result<Hello, PreflightError> {
        enum Said {
            Hello(Box<Hello>),
            No(Refused),
        }
        let mut controller = None;
        let nonce = (monotonic_ns() / 1000) as u32;
        let said = self.exchange(
            patience,
            |station, out| station.discover(nonce, out),
            |n| match n {
                Notice::ControllerHello(m) if m.nonce == nonce => {
                    controller = Some(*m);
                    None
                }
                Notice::Hello(m) if m.nonce == nonce => Some(Said::Hello(Box::new(*m))),
                Notice::Refused(m) if m.request == clutch_wire::Discover::KIND => Some(Said::No(*m)),
                _ => None,
            },
        )?;
        let address = self.address();
        match said {
            // A board should have refused; one that did not is not understood either.
            Some(Said::Hello(hello)) if hello.version != clutch_wire::VERSION => {
                Err(PreflightError::Version { address, board: hello.version.into() })
            }
            Some(Said::Hello(hello)) if hello.schema != clutch_wire::SCHEMA => {
                Err(PreflightError::Schema { address, board: hello.schema as u32 })
            }
            Some(Said::Hello(hello)) => match (controller, S::LOOKS_ON) {
                (Some(_), false) => Err(PreflightError::IsController { address }),
                (None, true) => Err(PreflightError::IsNoController { address }),
                (Some(m), true) if m.settings != clutch_settings::SETTINGS_HASH => {
                    Err(PreflightError::Settings { address, board: m.settings })
                }
                _ => Ok(*hello),
            },
            Some(Said::No(m)) if m.reason == Refusal::Version as u8 => {
                Err(PreflightError::Version { address, board: m.value })
            }
            Some(Said::No(m)) if m.reason == Refusal::Schema as u8 => {
                Err(PreflightError::Schema { address, board: m.value })
            }
            Some(Said::No(m)) => Err(PreflightError::Refused { address, what: "known", why: why(&m, None) }),
            None if controller.is_some() => Err(PreflightError::NoBoard { address }),
            None if self.echo => Err(PreflightError::Echo { address }),
            None if self.bytes > 0 => Err(PreflightError::Foreign { address, bytes: self.bytes }),
            None => Err(PreflightError::Silent { address }),
        }
    }

    /// Sends the run to the board.
    ///
    /// # Errors
    /// The board refuses, or is silent.
    pub fn configure(&mut self, present: clutch_core::DacCode) -> Result<(), PreflightError> {
        let mut other = None;
        let said = self.exchange(
            Duration::from_secs(1),
            |station, out| station.configure(present, out),
            |n| match n {
                Notice::Configured => Some(None),
                Notice::OtherBoot(m) => {
                    other = Some(m.boot);
                    Some(None)
                }
                Notice::Refused(m) if m.request == clutch_wire::Configure::KIND => Some(Some(*m)),
                _ => None,
            },
        )?;
        if let Some(now) = other {
            return Err(PreflightError::Reset { address: self.address(), now });
        }
        self.verdict(said, "configured")
    }

    fn verdict(&self, said: Option<Option<Refused>>, what: &'static str) -> Result<(), PreflightError> {
        let address = self.address();
        match said {
            Some(None) => Ok(()),
            Some(Some(m)) => {
                Err(PreflightError::Refused { address, what, why: why(&m, self.settings.as_ref()) })
            }
            None => Err(PreflightError::Lost { address, what }),
        }
    }

    /// The board's clock against ours: the request with the shortest round trip of some. Where `judged` is given, the
    /// board's time and its samples have to pass as is expected there, as far as that can be known within two seconds:
    /// [`BoardClock`].
    ///
    /// # Errors
    /// The board is silent, or its clock is wrong.
    pub fn clock(&mut self, judged: Option<Expected>) -> Result<ClockOffset, PreflightError> {
        let mut best: Option<ClockOffset> = None;
        let mut clock = judged.map(|expected| BoardClock::new(expected, !S::LOOKS_ON));
        let mut sent = Vec::new();
        let (mut newest, mut agrees) = (None, judged.is_none());
        let until = monotonic_ns() + LONGEST_LOOK_NS;
        // A board that does not answer is not asked for ever.
        while sent.len() < LOOKS || !agrees && best.is_some() && monotonic_ns() < until {
            let nonce = sent.len() as u32;
            sent.push(monotonic_ns());
            let answer = self.exchange(
                Duration::from_millis(90),
                |station, out| station.ping(nonce, out),
                |n| match n {
                    // On a slow line the answer to an earlier one.
                    Notice::Pong(n, time_us) => Some((*sent.get(*n as usize)?, *time_us, monotonic_ns())),
                    Notice::Cycle(n) => {
                        newest = Some(n.sample.sequence);
                        None
                    }
                    _ => None,
                },
            )?;
            let Some((sent, board_us, received)) = answer else { continue };
            let offset = ClockOffset::new(sent, received, board_us);
            if best.is_none_or(|b| offset.round_trip_us < b.round_trip_us) {
                best = Some(offset);
            }
            if let Some((clock, expected)) = clock.as_mut().zip(judged) {
                let look = Look { asked_ns: (sent, received), board_us, sample: newest };
                agrees = clock.look(look).map_err(|wrong| self.wrong_clock(wrong, expected))?;
                std::thread::sleep(BETWEEN_LOOKS);
            }
        }
        best.ok_or_else(|| PreflightError::Lost { address: self.address(), what: "asked for its time" })
    }

    fn wrong_clock(&self, wrong: Wrong, of: Expected) -> PreflightError {
        let (address, period) = (self.address(), of.period.0);
        let rounded = |x: f64| number((x * 1e3).round() / 1e3);
        match wrong {
            Wrong::Time(rate) => {
                PreflightError::TimeRate { address, seen: rounded(rate), expected: of.words(1.0) }
            }
            Wrong::Samples(rate) => {
                let right = 1e6 / f64::from(period);
                let seen = rounded(rate * right);
                PreflightError::SampleRate { address, seen, expected: of.words(right), period }
            }
        }
    }
}

impl<P: clutch_core::Planned<f32>> Talk<'_, HostStation<P>> {
    /// Sends a run's settings, each until the board has said that it has it.
    ///
    /// # Errors
    /// The board refuses one, or is silent.
    pub fn upload(&mut self, settings: &Settings) -> Result<(), PreflightError> {
        let mut all = Vec::new();
        settings.each(|key, value| all.push((key, value)));
        self.settings = Some(settings.clone());
        for (key, value) in all {
            let said = self.exchange(
                Duration::from_secs(1),
                |station, out| station.node.set(key, value, out),
                |n| match n {
                    Notice::Taken(m) if (m.key, m.value) == (key, value) => Some(None),
                    Notice::Refused(m) if m.request == clutch_wire::Set::KIND => Some(Some(*m)),
                    _ => None,
                },
            )?;
            self.verdict(said, "set up")?;
        }
        Ok(())
    }
}

impl ClockOffset {
    /// From one request: sent and answered at these times of ours (ns), and the board's clock (µs).
    #[must_use]
    pub fn new(sent_ns: u64, received_ns: u64, board_us: u32) -> Self {
        let middle_us = (sent_ns / 2 + received_ns / 2) / 1000;
        ClockOffset {
            offset_us: middle_us as i64 - i64::from(board_us),
            round_trip_us: received_ns.saturating_sub(sent_ns) / 1000,
        }
    }

    /// The age of a sample of the board's clock at a time of ours (ns), µs.
    #[must_use]
    pub fn age_us(&self, board_us: u32, now_ns: u64) -> u32 {
        // The board's clock wraps after 71 minutes: the difference is taken in its 32 bits.
        let now = (now_ns / 1000) as i64 - self.offset_us;
        let age = (now as u32).wrapping_sub(board_us);
        // A clock that runs a little ahead gives samples of the future.
        if age > u32::MAX / 2 { 0 } else { age }
    }
}
