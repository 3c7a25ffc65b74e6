//! The loop: control thread, log thread, and the messages between them.
//!
//! ```text
//!   port ◄──► control thread ──ring──► log thread ──► file
//!                  │  ▲
//!          atomics │  │ stop
//!                  ▼  │
//!             whoever watches
//! ```
//!
//! Between its first and its last cycle the control thread allocates nothing, takes no lock, and
//! makes no system call but the wait for the next sample, the read and the write.

use crate::drift::{Drift, DriftReport};
use crate::live_gains::Changes;
use crate::log_thread::Ring;
use crate::port::Port;
use crate::preflight::ClockOffset;
use crate::realtime::{
    CycleStats, CycleSummary, Readiness, RealtimeOptions, SampleWake, WaitMode, enter, monotonic_ns,
    sleep_until, wait_readable,
};
use crate::station::{Station, StationNotice};
use crate::to_log;
use crate::watch::Watch;
use clutch_core::supervisor::{Cause, State};
use clutch_core::{Arithmetic, Micros, Real};
use clutch_log::{ChangeRecord, CommandRecord, EventKind, EventRecord, LinkRecord, Record, SampleRecord};
use clutch_node::{CycleNotice, Ending, LinkCounts, Notice, Outbox, Standing};
use clutch_sim::Metrics;
use clutch_sim::detected::Detector;
use clutch_sim::meter::Gap;
use clutch_sim::metrics::{Detected, MetricsBuilder, MetricsSample};
use clutch_wire::{BoardState, Refused, STATUS_STATE, StopReason};
use rustix::fd::AsFd;
use std::sync::atomic::Ordering;
use std::time::Duration;

clutch_core::words! {
    /// The event that starts a cycle.
    pub enum Pace {
        /// The board's sample: one clock, the board's.
        Sample = "sample" default,
        /// The machine's clock: two clocks, so that now and then a cycle finds no sample or two.
        Clock = "clock",
    }
}

clutch_core::words! {
    /// The effect of a drift out of the bounds.
    pub enum OnDrift {
        /// It is reported and logged, and the run goes on.
        Report = "report" default,
        /// It ends the run in the safe state, as an operator would.
        Stop = "stop",
    }
}

/// Options of the loop.
#[derive(Clone, Copy, Debug)]
pub struct LoopOptions {
    /// Priority, memory, core, wait.
    pub realtime: RealtimeOptions,
    /// The event that starts a cycle.
    pub pace: Pace,
    /// Time left out of the figures, s.
    pub settle: f64,
    /// The effect of a drift out of the bounds.
    pub on_drift: OnDrift,
    /// Called on the control thread when its cycles begin and when they have ended.
    pub hooks: (fn(), fn()),
}

/// The report of a run.
#[derive(Clone, Debug)]
pub struct LoopReport {
    /// The state in which control ended.
    pub state: State,
    /// The cause of the end.
    pub cause: Cause,
    /// The value seen by the check that ended control.
    pub value: f64,
    /// Ticks in which the law was asked.
    pub ticks: u64,
    /// Tracking figures from the encoder, sticking as its silences show it; no torque.
    pub metrics: Metrics,
    /// Stick-slip from counts and voltages.
    pub detected: Detected,
    /// Friction over load, and whether it left the bounds.
    pub drift: DriftReport,
    /// True if that ended the run.
    pub ended_by_drift: bool,
    /// Counts of what the line carried.
    pub link: LinkCounts,
    /// Samples lost.
    pub lost: u64,
    /// Samples that were not believed.
    pub implausible: u64,
    /// Answers later than the deadline.
    pub deadline_misses: u64,
    /// Time from a sample's arrival to its answer, ns.
    pub response: CycleSummary,
    /// Time between two answers, ns.
    pub interval: CycleSummary,
    /// Lateness of the wake-ups, ns: after the deadline of a cycle that this machine's clock starts, as `cyclictest` has
    /// it; of one that a sample starts, by how much longer the sample took to wake this thread than the quickest one.
    /// None of a board whose clock waits for this machine, or that closes the loop itself.
    pub wake: CycleSummary,
    /// Frequency of the clock whose cycles the board counts, Hz; 0 if it counts none.
    pub clock_hz: u32,
    /// Clock cycles of a tick, where the board counts them.
    pub tick_cycles: CycleSummary,
    /// Telemetry of the board that did not come.
    pub untold: u64,
    /// Changes of gains while it ran.
    pub changed: u64,
    /// Those of them that have no certificate.
    pub changed_uncertified: u64,
    /// The requests that the system refused.
    pub notes: Vec<String>,
    /// Records that did not fit into the ring.
    pub log_dropped: u64,
    /// Writes that the line took only in part: its buffer was full.
    pub cut_writes: u64,
    /// True if control began.
    pub begun: bool,
    /// True if the board is the controller, and ends control by itself when it misses this machine.
    pub on_the_board: bool,
    /// True if the board said that it is in its safe state.
    pub board_safe: bool,
    /// The reason why the board did not take consent, if it did not.
    pub refused: Option<Refused>,
    /// The port's error, if it ended the run.
    pub port_error: Option<String>,
}

/// Time for which the control thread waits for the board to say that it is safe.
const FAREWELL: Duration = Duration::from_millis(300);

/// Everything that a run needs, after the pre-flight: the board is configured.
pub struct ConfiguredRun<'a, S: Station> {
    /// This machine's station.
    pub station: &'a mut S,
    /// The open port.
    pub port: &'a mut Port,
    /// The ring into which records go, if they go anywhere.
    pub ring: Option<Ring>,
    /// The ring of one that looks on.
    pub shown: Option<Ring>,
    /// Changes of gains, if there may be any.
    pub changes: Option<Changes<S::Servo>>,
    /// The values that a watcher sees.
    pub watch: &'a Watch,
    /// Ticks of the run; a board that is the controller has the number, and ends it by itself.
    pub ticks: u64,
    /// The board's clock.
    pub clock: ClockOffset,
    /// The detector that sees stick-slip in counts and voltages.
    pub detector: Detector,
    /// The watch over friction and load.
    pub drift: Drift,
    /// The board is simulated and its clock waits for this machine: a stall is then no late answer.
    pub patient: bool,
}

/// Gives consent and runs the cycles until the path's end, a stop, or a fault, on the calling thread.
pub fn run<S: Station>(configured: ConfiguredRun<'_, S>, options: &LoopOptions) -> LoopReport {
    let notes = enter(&options.realtime);
    let mut control = Control::new(configured, options);
    (options.hooks.0)();
    let lost = control.cycles(options).err();
    (options.hooks.1)();
    let port_error = lost.map(|error| control.port_lost(&error));
    control.report(notes, port_error)
}

/// Times at which the work is due that no sample brings, by this machine's clock, ns.
struct Due {
    /// The next cycle, if this machine's clock starts them.
    cycle: u64,
    /// The next look at link and clock.
    second: u64,
    /// Consent is asked for again; 0 if it never was.
    consent: u64,
    /// Consent that has not come until then is given up.
    give_up: u64,
    /// Until then the board may say that it is safe; none before the end.
    farewell: Option<u64>,
}

impl Due {
    fn new(period_ns: u64, patient: bool) -> Due {
        let now = monotonic_ns();
        // A simulated board on a busy machine may be behind with its samples.
        let patience = if patient { 10_000_000_000 } else { 1_000_000_000 };
        Due {
            cycle: now + period_ns,
            second: now + 1_000_000_000,
            consent: 0,
            give_up: now + patience,
            farewell: None,
        }
    }

    /// True if the board has had its time to say that it is safe.
    fn farewell_over(&mut self, now: u64) -> bool {
        now >= *self.farewell.get_or_insert(now + FAREWELL.as_nanos() as u64)
    }
}

struct Control<'a, S: Station> {
    station: &'a mut S,
    port: &'a mut Port,
    ring: Option<Ring>,
    shown: Option<Ring>,
    changes: Option<Changes<S::Servo>>,
    changed: u64,
    uncertified: u64,
    watch: &'a Watch,
    out: Outbox,
    ticks: u64,
    start_ns: u64,
    radians: f64,
    dac: clutch_core::Dac<S::Scalar>,
    period: f64,
    clock: ClockOffset,
    ping_sent: Option<(u32, u64)>,
    pings: u32,
    figures: MetricsBuilder,
    detector: Detector,
    drift: Drift,
    on_drift: OnDrift,
    ended_by_drift: bool,
    answers: u64,
    response: CycleStats,
    interval: CycleStats,
    wake: CycleStats,
    sample_wake: SampleWake,
    /// Lateness of the wake-up under way, if this machine's clock caused it, ns.
    clock_wake: Option<u64>,
    last_answer_ns: Option<u64>,
    last_arrival_ns: Option<u64>,
    last_sample_us: Option<u32>,
    tick_cycles: CycleStats,
    period_ns: u64,
    patient: bool,
    dropped: u64,
    dropped_told: u64,
    untold: u64,
    begun: bool,
    board_safe: bool,
    refused: Option<Refused>,
    cut: u64,
}

/// The notices of one call of the node, gathered for use after it.
#[derive(Clone, Copy)]
struct Batch<T: Arithmetic, X> {
    cycles: [Option<CycleNotice<T, X>>; 32],
    used: usize,
    ended: Option<Ending<T>>,
    pong: Option<(u32, u32)>,
    stopped: bool,
    refused: Option<Refused>,
}

impl<'a, S: Station> Control<'a, S> {
    fn new(configured: ConfiguredRun<'a, S>, options: &LoopOptions) -> Self {
        let (encoder, period) = (configured.station.encoder(), configured.station.period());
        let seconds: f64 = period.seconds();
        Control {
            ring: configured.ring,
            shown: configured.shown,
            changes: configured.changes,
            changed: 0,
            uncertified: 0,
            watch: configured.watch,
            out: Outbox::default(),
            ticks: configured.ticks,
            start_ns: monotonic_ns(),
            radians: encoder.radians_per_count(),
            dac: *configured.station.dac(),
            period: seconds,
            clock: configured.clock,
            ping_sent: None,
            pings: 0,
            figures: MetricsBuilder::new(seconds, options.settle),
            detector: configured.detector,
            drift: configured.drift,
            on_drift: options.on_drift,
            ended_by_drift: false,
            answers: 0,
            response: CycleStats::new(),
            interval: CycleStats::new(),
            wake: CycleStats::new(),
            sample_wake: SampleWake::default(),
            clock_wake: None,
            last_answer_ns: None,
            last_arrival_ns: None,
            last_sample_us: None,
            tick_cycles: CycleStats::new(),
            period_ns: u64::from(period.0) * 1000,
            patient: configured.patient,
            dropped: 0,
            dropped_told: 0,
            untold: 0,
            begun: false,
            board_safe: false,
            refused: None,
            cut: 0,
            station: configured.station,
            port: configured.port,
        }
    }

    fn push(&mut self, records: &[Record]) {
        if let Some(shown) = &mut self.shown {
            // One that does not fit is not seen.
            for record in records {
                let _ = shown.push(*record);
            }
        }
        let Some(ring) = &mut self.ring else { return };
        // A sample and its command together or not at all; after a gap its event comes first.
        let gap = self.dropped - self.dropped_told;
        if ring.slots() < records.len() + usize::from(gap > 0) {
            self.dropped += records.len() as u64;
            self.watch.log_dropped.store(self.dropped, Ordering::Relaxed);
            return;
        }
        if gap > 0
            && let Some(first) = records.first()
        {
            self.dropped_told = self.dropped;
            let _ = ring.push(Record::Event(EventRecord {
                tick: first.tick(),
                time_ns: first.time_ns(),
                kind: EventKind::LogDropped as u8,
                value: gap as f64,
                ..EventRecord::default()
            }));
        }
        for record in records {
            let _ = ring.push(*record);
        }
    }

    /// One wake-up: read, decide, write. An error if the line is gone.
    fn cycle(&mut self, arrived_ns: u64, buffer: &mut [u8]) -> Result<(), std::io::Error> {
        let count = self.port.read(buffer)?;
        let bytes = buffer.get(..count).unwrap_or(&[]);
        if !S::LOOKS_ON {
            return self.hear(arrived_ns, bytes);
        }
        for frame in bytes.split_inclusive(|byte| *byte == 0) {
            self.hear(arrived_ns, frame)?;
        }
        if bytes.is_empty() { self.hear(arrived_ns, bytes) } else { Ok(()) }
    }

    fn hear(&mut self, arrived_ns: u64, bytes: &[u8]) -> Result<(), std::io::Error> {
        let now = monotonic_ns();
        let mut batch = Batch::<S::Scalar, S::Terms> {
            cycles: [const { None }; 32],
            used: 0,
            ended: None,
            pong: None,
            stopped: false,
            refused: None,
        };
        let mut lost_records = 0;
        {
            let mut notices = |n: StationNotice<S>| match n {
                Notice::Cycle(n) => match batch.cycles.get_mut(batch.used) {
                    Some(slot) => {
                        *slot = Some(n);
                        batch.used += 1;
                    }
                    // Cycles before consent are not logged.
                    None => lost_records += if n.cycle.from == State::Ready { 0 } else { 2 },
                },
                Notice::Ended(ending) => batch.ended = Some(ending),
                Notice::Pong(nonce, time_us) => batch.pong = Some((nonce, time_us)),
                Notice::Stopped(_) => batch.stopped = true,
                Notice::Refused(m) => batch.refused = Some(m),
                _ => {}
            };
            self.station.receive(now, bytes, &mut self.out, &mut notices);
            self.station.poll(now, &mut self.out, &mut notices);
        }
        if self.is_last_tick() {
            // With its answer, in one write: a board that has the answer and not the end would take one more sample.
            batch.ended = self.end(StopReason::Done);
            self.begun = true;
        }
        // A cycle that the board did not report is missing like one that the log did not take.
        let untold = self.station.standing().untold;
        lost_records += 2 * untold.saturating_sub(self.untold);
        self.untold = untold;
        self.dropped += if self.ring.is_some() { lost_records } else { 0 };
        if !self.out.is_empty() {
            self.send()?;
            let done = monotonic_ns();
            let took = done.saturating_sub(arrived_ns);
            // Judged from when the sample was due: a thread that slept through it was late, too. The
            // clock of a patient board waits for a stalled machine, so that it says nothing of that.
            let due = self.last_arrival_ns.filter(|_| !self.patient).map(|t| t + self.period_ns);
            let late = done.saturating_sub(due.unwrap_or(arrived_ns).min(arrived_ns));
            self.station.answered(Micros(u32::try_from(late / 1000).unwrap_or(u32::MAX)));
            let answered = batch.cycles.iter().take(batch.used).flatten().any(|n| n.cycle.answer.is_some());
            if answered && !S::LOOKS_ON {
                self.response.record(took);
                if let Some(last) = self.last_answer_ns {
                    self.interval.record(done.saturating_sub(last));
                }
                self.last_answer_ns = Some(done);
                self.last_arrival_ns = Some(arrived_ns);
            }
        }
        self.after((arrived_ns, now), &batch);
        Ok(())
    }

    /// Writes what is to be written. The part that the line does not take is lost, and counted: its
    /// frame fails its check, and the next answer is worth more.
    fn send(&mut self) -> Result<(), std::io::Error> {
        let bytes = self.out.as_bytes();
        if !bytes.is_empty() {
            let written = self.port.write(bytes)?;
            self.cut += u64::from(written < bytes.len());
            self.out.clear();
        }
        Ok(())
    }

    /// The work that need not be done before the answer is on its way: log, figures, watcher.
    fn after(&mut self, (woke, now): (u64, u64), batch: &Batch<S::Scalar, S::Terms>) {
        let time_ns = now.saturating_sub(self.start_ns);
        self.refused = self.refused.or(batch.refused);
        // Cycles before consent are not of the run.
        let of_run = |n: &&CycleNotice<S::Scalar, S::Terms>| n.cycle.from != State::Ready;
        let late = self.wake_lateness(woke, batch.cycles.iter().take(batch.used).flatten().find(of_run));
        for n in batch.cycles.iter().take(batch.used).flatten().filter(of_run) {
            let age = self.clock.age_us(n.sample.time_us, now);
            let wake_us = u32::try_from(late / 1000).unwrap_or(u32::MAX);
            let sample = SampleRecord::of(n, time_ns, age, wake_us, self.radians);
            let mut records = [Record::Sample(sample); 3];
            let command = CommandRecord::of(&n.cycle, time_ns, &self.dac, self.radians);
            records[1] = Record::Command(command);
            let change = to_log::change(time_ns, &n.cycle);
            let used = if let Some(change) = change {
                records[2] = change;
                3
            } else {
                2
            };
            self.push(&records[..used]);
            let board = BoardState::from_u8(n.sample.status & STATUS_STATE);
            self.board_safe |= matches!(board, Some(BoardState::Stopped | BoardState::Faulted));
            // Until the next sample: numbers come again.
            let passed = if n.cycle.answer.is_none() { u32::from(n.sample.sequence) + 1 } else { 0 };
            self.watch.passed.store(passed, Ordering::Relaxed);
            if S::LOOKS_ON {
                self.on_the_board(n);
            }
            if let Some(out) = &n.cycle.output {
                let time = n.cycle.tick as f64 * self.period;
                let error = out.tick.error.to_f64();
                let velocity = out.tick.velocity().to_f64();
                let voltage = self.dac.volts(out.code).to_f64();
                self.answers += 1;
                self.figures.sample(time, MetricsSample { error, velocity, voltage });
                let counts = clutch_core::Counts(n.sample.counts);
                let path_velocity = n.cycle.target.velocity.to_f64();
                let noticed = self.detector.sample(n.cycle.tick, counts, path_velocity, voltage);
                // The watch is given what the log has, so that a replay sees the same.
                self.look_for_drift(&sample, &command, noticed.gap);
                self.watch.error_nrad.store((error * 1e9) as i64, Ordering::Relaxed);
                self.watch.millivolts.store((voltage * 1e3) as i64, Ordering::Relaxed);
            }
        }
        self.board_safe |= batch.stopped;
        if let Some(ending) = batch.ended.filter(|e| e.from != State::Ready) {
            self.push(&[to_log::ended(time_ns, &ending)]);
        }
        if let (Some((nonce, time_us)), Some((sent, sent_ns))) = (batch.pong, self.ping_sent)
            && nonce == sent
        {
            let offset = ClockOffset::new(sent_ns, now, time_us);
            // A slow answer says little of the board's clock.
            if offset.round_trip_us <= self.clock.round_trip_us + 200 {
                self.clock = ClockOffset { round_trip_us: self.clock.round_trip_us, ..offset };
            }
            self.ping_sent = None;
        }
        let state = self.station.standing();
        let w = self.watch;
        w.state.store(state.state as u8, Ordering::Relaxed);
        w.tick.store(state.tick, Ordering::Relaxed);
        w.lost.store(state.lost, Ordering::Relaxed);
        w.late_answers.store(state.deadline_misses, Ordering::Relaxed);
    }

    /// Watches friction and load, with a sample that the law has answered.
    fn look_for_drift(&mut self, sample: &SampleRecord, command: &CommandRecord, gap: Option<Gap>) {
        let Some(alarm) = self.drift.record(sample, command, gap.as_ref()) else { return };
        self.push(&[to_log::drift(sample.time_ns, self.station.standing().state, &alarm)]);
        if self.on_drift == OnDrift::Stop {
            self.ended_by_drift |= !self.watch.stop.swap(true, Ordering::Relaxed);
        }
        self.watch.drift.show(&alarm);
    }

    /// The lateness of the wake-up, ns, with the oldest sample that it found; 0 where it is not known.
    fn wake_lateness(&mut self, woke: u64, oldest: Option<&CycleNotice<S::Scalar, S::Terms>>) -> u64 {
        let by_sample = if S::LOOKS_ON || self.patient { None } else { oldest };
        let late = match (self.clock_wake.take(), by_sample) {
            (Some(late), _) => Some(late),
            (None, Some(n)) => self.sample_wake.woke(n.sample.time_us, woke),
            (None, None) => None,
        };
        if let Some(late) = late {
            self.wake.record(late);
        }
        late.unwrap_or(0)
    }

    /// Records the times that the board reports of its own: those of its answers, its samples, its ticks.
    fn on_the_board(&mut self, n: &CycleNotice<S::Scalar, S::Terms>) {
        if n.cycle.answer.is_none() {
            return;
        }
        self.response.record(u64::from(n.lateness.0) * 1000);
        if let Some(last) = self.last_sample_us.replace(n.sample.time_us) {
            self.interval.record(u64::from(n.sample.time_us.wrapping_sub(last)) * 1000);
        }
        if n.cycles > 0 {
            self.tick_cycles.record(n.cycles.into());
        }
    }

    /// Once a second: the link's counters, the board's clock.
    fn housekeeping(&mut self, now: u64) {
        let state = self.station.standing();
        let time_ns = now.saturating_sub(self.start_ns);
        let link = LinkRecord::of(self.station.counts(), &state, time_ns, self.dropped);
        self.push(&[Record::Link(link)]);
        self.pings = self.pings.wrapping_add(1);
        self.station.ping(self.pings, &mut self.out);
        self.ping_sent = Some((self.pings, now));
    }

    /// Takes over the gains that somebody has changed, before the sample that has come.
    fn tune(&mut self) {
        let Standing { state, tick, .. } = self.station.standing();
        // A change that comes later has no effect any more.
        if !matches!(state, State::Armed | State::Running) {
            return;
        }
        while let Some(change) = self.changes.as_mut().and_then(|changes| changes.pop().ok()) {
            self.station.tune(change.servo);
            self.changed += 1;
            self.uncertified += u64::from(change.error_bound.is_none());
            let tick = if state == State::Running { tick + 1 } else { tick };
            let time_ns = monotonic_ns().saturating_sub(self.start_ns);
            let (parameter, value) = (change.parameter, change.value);
            let error_bound = change.error_bound.unwrap_or(f64::NAN);
            self.push(&[Record::Change(ChangeRecord { tick, time_ns, parameter, value, error_bound })]);
        }
    }

    /// True if this machine closes the loop, and has heard the path's last tick.
    fn is_last_tick(&self) -> bool {
        let Standing { state, tick, .. } = self.station.standing();
        !S::LOOKS_ON && state == State::Running && tick + 1 >= self.ticks
    }

    /// Ends control. None where the board says when it has ended.
    fn end(&mut self, reason: StopReason) -> Option<Ending<S::Scalar>> {
        let from = self.station.standing().state;
        self.station.stop(reason, &mut self.out);
        let Standing { state, cause, value, tick, .. } = self.station.standing();
        (!S::LOOKS_ON).then_some(Ending { from, state, cause, value, tick })
    }

    /// Ends control between two wake-ups, and logs it.
    fn stop(&mut self, reason: StopReason) {
        if let Some(ending) = self.end(reason).filter(|e| e.from != State::Ready) {
            let now = monotonic_ns().saturating_sub(self.start_ns);
            self.push(&[to_log::ended(now, &ending)]);
        }
    }

    /// Consent, once this thread is what it is going to be: the board's watchdog starts with it. Then cycles until
    /// control has ended.
    ///
    /// # Errors
    /// The line is gone.
    fn cycles(&mut self, options: &LoopOptions) -> Result<(), std::io::Error> {
        let mut buffer = [0_u8; 2048];
        let mut due = Due::new(self.period_ns, self.patient);
        loop {
            let arrived = match options.pace {
                _ if self.station.standing().state == State::Ready => match self.ask_for_consent(&mut due)? {
                    Some(arrived) => arrived,
                    None => return Ok(()),
                },
                Pace::Sample => self.wait_for_sample(options.realtime.wait)?,
                Pace::Clock => self.wait_for_clock(&mut due, options.realtime.wait),
            };
            self.tune();
            self.cycle(arrived, &mut buffer)?;
            if self.is_over(&mut due) {
                return Ok(());
            }
            self.send()?;
        }
    }

    /// Before consent: asks for it, again each 100 ms. Gives the time at which there was something to hear; none if
    /// there will be no run.
    fn ask_for_consent(&mut self, due: &mut Due) -> Result<Option<u64>, std::io::Error> {
        let now = monotonic_ns();
        let leave = now >= due.give_up || self.watch.stop.load(Ordering::Relaxed);
        if self.refused.is_some() || leave && due.consent == 0 {
            return Ok(None);
        }
        if leave {
            // The board may have received `Arm` although its reply was lost.
            self.stop(StopReason::Operator);
            if due.farewell_over(now) || self.board_safe {
                return Ok(None);
            }
        } else if now >= due.consent {
            due.consent = now + 100_000_000;
            self.station.arm(&mut self.out);
        }
        self.send()?;
        let _ = wait_readable(self.port.as_fd(), now + 10_000_000, WaitMode::Sleep);
        Ok(Some(monotonic_ns()))
    }

    /// Waits for the board's next sample, or until the station has to look at the clock.
    fn wait_for_sample(&self, mode: WaitMode) -> Result<u64, std::io::Error> {
        let until = self.station.poll_at().unwrap_or_else(|| monotonic_ns() + 20_000_000);
        // Spinning is for the moment at which the sample is due; one that is overdue is slept for.
        let (until, mode) = match (mode, self.last_answer_ns) {
            (WaitMode::SleepSpin { spin_us }, Some(last)) => {
                let window = last + self.period_ns + u64::from(spin_us) * 500;
                if monotonic_ns() < window { (until.min(window), mode) } else { (until, WaitMode::Sleep) }
            }
            _ => (until, WaitMode::Sleep),
        };
        match wait_readable(self.port.as_fd(), until, mode) {
            Readiness::HungUp => Err(std::io::Error::from(std::io::ErrorKind::BrokenPipe)),
            Readiness::Readable | Readiness::Timeout => Ok(monotonic_ns()),
        }
    }

    /// Waits for this machine's next cycle. Cycles that were missed stay missed.
    fn wait_for_clock(&mut self, due: &mut Due, mode: WaitMode) -> u64 {
        sleep_until(due.cycle, mode);
        let (woke, meant) = (monotonic_ns(), due.cycle);
        self.clock_wake = Some(woke.saturating_sub(meant));
        while due.cycle <= woke {
            due.cycle += self.period_ns;
        }
        if self.patient { woke } else { meant }
    }

    /// After a cycle: ends control that is to end, and looks after the link. True if all is over.
    fn is_over(&mut self, due: &mut Due) -> bool {
        let now = monotonic_ns();
        let standing = self.station.standing();
        match standing.state {
            State::Ready => {}
            State::Running | State::Armed => {
                self.begun = true;
                if self.watch.stop.load(Ordering::Relaxed) {
                    self.stop(StopReason::Operator);
                } else if now >= due.second {
                    due.second += 1_000_000_000;
                    self.housekeeping(now);
                }
            }
            _ => return due.farewell_over(now) || self.board_safe,
        }
        false
    }

    /// The line is gone: reports it to the station and the log. Gives the reason in words.
    fn port_lost(&mut self, error: &std::io::Error) -> String {
        let from = self.station.standing().state;
        self.station.disconnect();
        let standing = self.station.standing();
        let record = EventRecord {
            tick: standing.tick,
            time_ns: monotonic_ns().saturating_sub(self.start_ns),
            kind: EventKind::PortLost as u8,
            from: from as u8,
            to: standing.state as u8,
            cause: standing.cause as u8,
            value: 0.0,
        };
        self.push(&[Record::Event(record)]);
        self.port.explain(error).to_string()
    }

    /// The report of a run.
    fn report(mut self, notes: Vec<String>, port_error: Option<String>) -> LoopReport {
        self.housekeeping(monotonic_ns());
        let standing = self.station.standing();
        let mut metrics = self.figures.finish();
        // On hardware the encoder's silence is all that is seen of sticking.
        let detected = self.detector.finish(metrics.measured_s);
        metrics.stick_slip_cycles_per_s = detected.stick_slip_cycles_per_s;
        metrics.stick_time_fraction = detected.stick_time_fraction;
        metrics.longest_stick_s = None;
        metrics.stair_height_rad = f64::from(self.detector.stair()) * self.radians;
        let _ = self.watch.log_dropped.fetch_max(self.dropped, Ordering::Relaxed);
        LoopReport {
            state: standing.state,
            cause: standing.cause,
            value: standing.value.to_f64(),
            ticks: self.answers,
            metrics,
            detected,
            drift: *self.drift.report(),
            ended_by_drift: self.ended_by_drift,
            link: *self.station.counts(),
            lost: standing.lost,
            implausible: standing.rejected,
            deadline_misses: standing.deadline_misses,
            response: self.response.summary(),
            interval: self.interval.summary(),
            wake: self.wake.summary(),
            clock_hz: 0,
            tick_cycles: self.tick_cycles.summary(),
            untold: standing.untold,
            changed: self.changed,
            changed_uncertified: self.uncertified,
            notes,
            log_dropped: self.dropped.saturating_sub(2 * self.untold),
            cut_writes: self.cut,
            begun: self.begun,
            on_the_board: S::LOOKS_ON,
            board_safe: self.board_safe,
            refused: self.refused,
            port_error,
        }
    }
}
