//! The loop: control thread, log thread, and what they tell each other.
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

use crate::end::{End, Tells};
use crate::port::{Port, PortError};
use crate::preflight::ClockOffset;
use crate::realtime::{
    CycleStats, CycleSummary, Readiness, RealtimeOptions, WaitMode, enter, monotonic_ns, sleep_until,
    wait_readable,
};
use crate::records;
use clutch_core::supervisor::{Cause, State};
use clutch_core::{Micros, Real, StickSlip, StickSlipState};
use clutch_log::{EventKind, EventRecord, Header, LogError, LogWriter, Record};
use clutch_node::{CycleNotice, Ending, LinkCounts, Notice, Outbox, Told};
use clutch_sim::Metrics;
use clutch_sim::metrics::{MetricsBuilder, MetricsSample};
use clutch_wire::{Refused, StopReason};
use rustix::fd::AsFd;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU8, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// What starts a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// The board's sample: one clock, the board's.
    #[default]
    Sample,
    /// The machine's clock: two clocks, so that now and then a cycle finds no sample or two.
    Clock,
}

/// How the loop runs.
#[derive(Clone, Copy, Debug)]
pub struct LoopOptions {
    /// Priority, memory, core, wait.
    pub realtime: RealtimeOptions,
    /// What starts a cycle.
    pub pace: Pace,
    /// Time left out of the figures, s.
    pub settle: f64,
    /// Called on the control thread when its cycles begin and when they have ended.
    pub hooks: (fn(), fn()),
}

/// What a watcher sees while the loop runs.
#[derive(Debug, Default)]
pub struct Watch {
    /// Set to end the run in the safe state.
    pub stop: Arc<AtomicBool>,
    /// [`State`] as a number.
    pub state: AtomicU8,
    /// Ticks so far.
    pub tick: AtomicU64,
    /// Error, 1e-9 rad.
    pub error_nrad: AtomicI64,
    /// Brake voltage, mV.
    pub millivolts: AtomicI64,
    /// Samples lost.
    pub lost: AtomicU64,
    /// Answers later than the deadline.
    pub late_answers: AtomicU64,
    /// Records that did not fit into the ring.
    pub log_dropped: AtomicU64,
    /// Set by the log thread when it could not go on.
    pub log_ended: AtomicBool,
}

/// How it went.
#[derive(Clone, Debug)]
pub struct LoopReport {
    /// Where control ended.
    pub state: State,
    /// Why.
    pub cause: Cause,
    /// What the check that ended it saw.
    pub value: f64,
    /// Ticks in which the law was asked.
    pub ticks: u64,
    /// Tracking figures from the encoder, sticking as [`StickSlip`] sees it; no torque.
    pub metrics: Metrics,
    /// What the line carried.
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
    /// What the board's clock cycles count, Hz; 0 if it counts none.
    pub clock_hz: u32,
    /// Clock cycles of a tick, where the board counts them.
    pub tick_cycles: CycleSummary,
    /// Telemetry of the board that did not come.
    pub untold: u64,
    /// What the system refused.
    pub notes: Vec<String>,
    /// Records that did not fit into the ring.
    pub log_dropped: u64,
    /// Writes that the line took only in part: its buffer was full.
    pub cut_writes: u64,
    /// Whether control began.
    pub begun: bool,
    /// Whether the board is the controller, and ends control by itself when it misses this machine.
    pub on_the_board: bool,
    /// Whether the board said that it is in its safe state.
    pub board_safe: bool,
    /// Why the board did not take consent, if it did not.
    pub refused: Option<Refused>,
    /// The port's error, if it ended the run.
    pub port_error: Option<String>,
}

/// The way of records to their thread.
pub type Ring = rtrb::Producer<Record>;

/// Records of a log that wait for their thread.
const RING: usize = 1 << 15;
/// How often a chunk of the log goes to the file. With the ring's 20 ms this leaves a busy machine
/// 20 ms of the 100 ms that a crash may cost.
const LOG_FLUSH: Duration = Duration::from_millis(60);
/// How long the control thread waits for the board to say that it is safe.
const FAREWELL: Duration = Duration::from_millis(300);

struct Control<'a, E: End> {
    end: &'a mut E,
    port: &'a mut Port,
    ring: Option<Ring>,
    watch: &'a Watch,
    out: Outbox,
    ticks: u64,
    start_ns: u64,
    radians: f64,
    dac: clutch_core::Dac<E::Scalar>,
    period: f64,
    settle: f64,
    clock: ClockOffset,
    ping_sent: Option<(u32, u64)>,
    pings: u32,
    figures: MetricsBuilder,
    detector: StickSlip<f64>,
    sticks: StickSlipState<f64>,
    /// Cycles and ticks stuck before the figures begin.
    sticks_before: (u64, u64),
    answers: u64,
    response: CycleStats,
    interval: CycleStats,
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

/// What one call of the node brought, gathered for use after it.
#[derive(Clone, Copy)]
struct Batch<T, X> {
    cycles: [Option<CycleNotice<T, X>>; 32],
    used: usize,
    ended: Option<Ending<T>>,
    pong: Option<(u32, u32)>,
    stopped: bool,
    refused: Option<Refused>,
}

impl<E: End> Control<'_, E> {
    fn push(&mut self, records: &[Record]) {
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

    /// One wake-up: read, decide, write. Whether the line is still there.
    fn cycle(&mut self, arrived_ns: u64, buffer: &mut [u8]) -> Result<(), std::io::Error> {
        let count = self.port.read(buffer)?;
        let bytes = buffer.get(..count).unwrap_or(&[]);
        if !E::IS_CONTROLLER {
            return self.hear(arrived_ns, bytes);
        }
        for frame in bytes.split_inclusive(|byte| *byte == 0) {
            self.hear(arrived_ns, frame)?;
        }
        if bytes.is_empty() { self.hear(arrived_ns, bytes) } else { Ok(()) }
    }

    fn hear(&mut self, arrived_ns: u64, bytes: &[u8]) -> Result<(), std::io::Error> {
        let now = monotonic_ns();
        let mut batch = Batch::<E::Scalar, E::Terms> {
            cycles: [const { None }; 32],
            used: 0,
            ended: None,
            pong: None,
            stopped: false,
            refused: None,
        };
        let mut lost_records = 0;
        {
            let mut notices = |n: Tells<E>| match n {
                Notice::Cycle(n) => match batch.cycles.get_mut(batch.used) {
                    Some(slot) => {
                        *slot = Some(n);
                        batch.used += 1;
                    }
                    // What came before consent is not logged.
                    None => lost_records += if n.cycle.from == State::Ready { 0 } else { 2 },
                },
                Notice::Ended(ending) => batch.ended = Some(ending),
                Notice::Pong(nonce, time_us) => batch.pong = Some((nonce, time_us)),
                Notice::Stopped(_) => batch.stopped = true,
                Notice::Refused(m) => batch.refused = Some(m),
                _ => {}
            };
            self.end.receive(now, bytes, &mut self.out, &mut notices);
            self.end.poll(now, &mut self.out, &mut notices);
        }
        // A cycle that the board did not tell of is missing like one that the log did not take.
        let untold = self.end.told().untold;
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
            self.end.answered(Micros(u32::try_from(late / 1000).unwrap_or(u32::MAX)));
            let answered = batch.cycles.iter().take(batch.used).flatten().any(|n| n.cycle.answer.is_some());
            if answered && !E::IS_CONTROLLER {
                self.response.record(took);
                if let Some(last) = self.last_answer_ns {
                    self.interval.record(done.saturating_sub(last));
                }
                self.last_answer_ns = Some(done);
                self.last_arrival_ns = Some(arrived_ns);
            }
        }
        self.after(now, &batch);
        Ok(())
    }

    /// Writes what is to be written. What the line does not take is lost, and counted: its frame
    /// fails its check, and the next answer is worth more.
    fn send(&mut self) -> Result<(), std::io::Error> {
        let bytes = self.out.as_bytes();
        if !bytes.is_empty() {
            let written = self.port.write(bytes)?;
            self.cut += u64::from(written < bytes.len());
            self.out.clear();
        }
        Ok(())
    }

    /// What need not be done before the answer is on its way: log, figures, watcher.
    fn after(&mut self, now: u64, batch: &Batch<E::Scalar, E::Terms>) {
        let time_ns = now.saturating_sub(self.start_ns);
        self.refused = self.refused.or(batch.refused);
        // What came before consent is not of the run.
        let of_run = |n: &&CycleNotice<E::Scalar, E::Terms>| n.cycle.from != State::Ready;
        for n in batch.cycles.iter().take(batch.used).flatten().filter(of_run) {
            let age = self.clock.age_us(n.sample.time_us, now);
            let mut records = [Record::Sample(records::sample(time_ns, age, n)); 3];
            records[1] = Record::Command(records::command(time_ns, &n.cycle, &self.dac, self.radians));
            let change = records::change(time_ns, &n.cycle);
            let used = if let Some(change) = change {
                records[2] = change;
                3
            } else {
                2
            };
            self.push(&records[..used]);
            self.board_safe |= matches!(n.sample.status & 0x07, 4 | 5);
            if E::IS_CONTROLLER {
                self.on_the_board(n);
            }
            if let Some(out) = &n.cycle.output {
                let time = n.cycle.tick as f64 * self.period;
                let error = out.tick.error.to_f64();
                let velocity = out.tick.velocity().to_f64();
                let voltage = out.voltage.to_f64();
                self.answers += 1;
                self.figures.sample(time, MetricsSample { error, velocity, voltage });
                let counts = clutch_core::Counts(n.sample.counts);
                self.detector.update(&mut self.sticks, counts, n.cycle.target.velocity.to_f64());
                if time < self.settle {
                    self.sticks_before = (self.sticks.cycles(), self.sticks.stuck_ticks());
                }
                self.watch.error_nrad.store((error * 1e9) as i64, Ordering::Relaxed);
                self.watch.millivolts.store((voltage * 1e3) as i64, Ordering::Relaxed);
            }
        }
        self.board_safe |= batch.stopped;
        if let Some(ending) = batch.ended.filter(|e| e.from != State::Ready) {
            self.push(&[records::ended(time_ns, &ending)]);
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
        let state = self.end.told();
        let w = self.watch;
        w.state.store(state.state as u8, Ordering::Relaxed);
        w.tick.store(state.tick, Ordering::Relaxed);
        w.lost.store(state.lost, Ordering::Relaxed);
        w.late_answers.store(state.deadline_misses, Ordering::Relaxed);
    }

    /// What the board tells of its own times: those of its answers, its samples, its ticks.
    fn on_the_board(&mut self, n: &CycleNotice<E::Scalar, E::Terms>) {
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
        let state = self.end.told();
        let others = (state.lost, state.rejected, state.deadline_misses, self.dropped);
        let link = records::link(now.saturating_sub(self.start_ns), state.tick, self.end.counts(), others);
        self.push(&[Record::Link(link)]);
        self.pings = self.pings.wrapping_add(1);
        self.end.ping(self.pings, &mut self.out);
        self.ping_sent = Some((self.pings, now));
    }

    fn stop(&mut self, reason: StopReason) {
        let from = self.end.told().state;
        self.end.stop(reason, &mut self.out);
        if E::IS_CONTROLLER {
            return; // the board says when it has ended
        }
        let Told { state, cause, value, tick, .. } = self.end.told();
        if from != State::Ready {
            let now = monotonic_ns().saturating_sub(self.start_ns);
            self.push(&[records::ended(now, &Ending { from, state, cause, value, tick })]);
        }
    }
}

/// A log that is written beside the loop.
pub struct LogThread {
    path: std::path::PathBuf,
    thread: std::thread::JoinHandle<Result<clutch_log::Summary, LogError>>,
}

impl LogThread {
    /// Starts a thread that writes what comes through the ring.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn start(path: &Path, header: &Header, watch: Arc<Watch>) -> Result<(LogThread, Ring), LogError> {
        let mut writer = LogWriter::create(path, header)?;
        let (producer, mut consumer) = rtrb::RingBuffer::<Record>::new(RING);
        let thread = std::thread::spawn(move || {
            let mut failed = None;
            let mut flushed = Instant::now();
            loop {
                // Asked before the ring is emptied: what was pushed before the end is seen.
                let last = consumer.is_abandoned();
                while let Ok(record) = consumer.pop() {
                    if failed.is_none()
                        && let Err(error) = writer.write(&record)
                    {
                        watch.log_ended.store(true, Ordering::Relaxed);
                        failed = Some(error);
                    }
                }
                if last {
                    break;
                }
                // Sooner than the writer would: what waits in the ring is lost with the chunk.
                if failed.is_none() && flushed.elapsed() >= LOG_FLUSH {
                    flushed = Instant::now();
                    if let Err(error) = writer.flush() {
                        watch.log_ended.store(true, Ordering::Relaxed);
                        failed = Some(error);
                    }
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            match failed {
                Some(error) => Err(error),
                None => writer.finish(),
            }
        });
        Ok((LogThread { path: path.to_owned(), thread }, producer))
    }

    /// Waits until everything is in the file.
    ///
    /// # Errors
    /// The file could not be written to its end.
    pub fn finish(self) -> Result<clutch_log::Summary, LogError> {
        let LogThread { path, thread } = self;
        thread.join().unwrap_or(Err(LogError::Closed { path, written: 0 }))
    }
}

/// Everything that a run needs, after the pre-flight: the board is configured.
pub struct Configured<'a, E> {
    /// The controller's end.
    pub end: &'a mut E,
    /// The open port.
    pub port: &'a mut Port,
    /// Where records go, if anywhere.
    pub ring: Option<Ring>,
    /// What a watcher sees.
    pub watch: &'a Watch,
    /// Ticks of the run; a board that is the controller has been told, and ends it by itself.
    pub ticks: u64,
    /// The board's clock.
    pub clock: ClockOffset,
    /// What sees stick-slip in the counts.
    pub detector: StickSlip<f64>,
    /// The board is simulated and its clock waits for this machine: a stall is then no late answer.
    pub patient: bool,
}

/// Gives consent and runs the cycles until the path's end, a stop, or a fault, on the calling thread.
pub fn run<E: End>(configured: Configured<'_, E>, options: &LoopOptions) -> LoopReport {
    let (encoder, period) = (configured.end.encoder(), configured.end.period());
    let dac = *configured.end.dac();
    let seconds: f64 = period.seconds();
    let period_ns = u64::from(period.0) * 1000;
    let mut buffer = [0_u8; 2048];
    let notes = enter(&options.realtime);
    let mut c = Control {
        ring: configured.ring,
        watch: configured.watch,
        out: Outbox::default(),
        ticks: configured.ticks,
        start_ns: monotonic_ns(),
        radians: encoder.radians_per_count(),
        dac,
        period: seconds,
        settle: options.settle,
        clock: configured.clock,
        ping_sent: None,
        pings: 0,
        figures: MetricsBuilder::new(seconds, options.settle),
        detector: configured.detector,
        sticks: StickSlipState::default(),
        sticks_before: (0, 0),
        answers: 0,
        response: CycleStats::new(),
        interval: CycleStats::new(),
        last_answer_ns: None,
        last_arrival_ns: None,
        last_sample_us: None,
        tick_cycles: CycleStats::new(),
        period_ns,
        patient: configured.patient,
        dropped: 0,
        dropped_told: 0,
        untold: 0,
        begun: false,
        board_safe: false,
        refused: None,
        cut: 0,
        end: configured.end,
        port: configured.port,
    };
    (options.hooks.0)();
    let mut port_error = None;
    let mut next_clock = monotonic_ns() + period_ns;
    let mut next_second = monotonic_ns() + 1_000_000_000;
    let mut farewell: Option<u64> = None;
    let mode = options.realtime.wait;
    // Consent, once this thread is what it is going to be: the board's watchdog starts with it.
    // A simulated board on a busy machine may be behind with its samples.
    let patience = if c.patient { 10_000_000_000 } else { 1_000_000_000 };
    let (mut ask_again, give_up) = (0, monotonic_ns() + patience);
    loop {
        // Wait.
        let arrived = match options.pace {
            _ if c.end.told().state == State::Ready => {
                let now = monotonic_ns();
                let unasked = ask_again == 0;
                let leave = now >= give_up || c.watch.stop.load(Ordering::Relaxed);
                if c.refused.is_some() || leave && unasked {
                    break;
                }
                if leave {
                    // The board may have received `Arm` although its reply was lost.
                    c.stop(StopReason::Operator);
                    if now >= *farewell.get_or_insert(now + FAREWELL.as_nanos() as u64) || c.board_safe {
                        break;
                    }
                } else if now >= ask_again {
                    ask_again = now + 100_000_000;
                    c.end.arm(&mut c.out);
                }
                if let Err(error) = c.send() {
                    port_error = Some(error);
                    break;
                }
                let _ = wait_readable(c.port.as_fd(), now + 10_000_000, WaitMode::Sleep);
                monotonic_ns()
            }
            Pace::Sample => {
                let until = c.end.poll_at().unwrap_or_else(|| monotonic_ns() + 20_000_000);
                // Spinning is for the moment at which the sample is due; one that is overdue is slept for.
                let (until, mode) = match (mode, c.last_answer_ns) {
                    (WaitMode::SleepSpin { spin_us }, Some(last)) => {
                        let window = last + period_ns + u64::from(spin_us) * 500;
                        if monotonic_ns() < window {
                            (until.min(window), mode)
                        } else {
                            (until, WaitMode::Sleep)
                        }
                    }
                    _ => (until, WaitMode::Sleep),
                };
                match wait_readable(c.port.as_fd(), until, mode) {
                    Readiness::HungUp => {
                        port_error = Some(std::io::Error::from(std::io::ErrorKind::BrokenPipe));
                        break;
                    }
                    Readiness::Readable | Readiness::Timeout => {}
                }
                monotonic_ns()
            }
            Pace::Clock => {
                sleep_until(next_clock, mode);
                let woke = monotonic_ns();
                let due = next_clock;
                // Cycles that were missed stay missed.
                while next_clock <= woke {
                    next_clock += period_ns;
                }
                if c.patient { woke } else { due }
            }
        };
        // Read, decide, write.
        if let Err(error) = c.cycle(arrived, &mut buffer) {
            port_error = Some(error);
            break;
        }
        // Ends.
        let now = monotonic_ns();
        match c.end.told().state {
            State::Ready => {}
            State::Running | State::Armed => {
                c.begun = true;
                if c.watch.stop.load(Ordering::Relaxed) {
                    c.stop(StopReason::Operator);
                } else if !E::IS_CONTROLLER
                    && c.end.told().state == State::Running
                    && c.end.told().tick + 1 >= c.ticks
                {
                    c.stop(StopReason::Done);
                } else if now >= next_second {
                    next_second += 1_000_000_000;
                    c.housekeeping(now);
                }
            }
            _ => {
                let until = *farewell.get_or_insert(now + FAREWELL.as_nanos() as u64);
                if c.board_safe || now >= until {
                    break;
                }
            }
        }
        if let Err(error) = c.send() {
            port_error = Some(error);
            break;
        }
    }
    (options.hooks.1)();
    let port_error = port_error.map(|e| {
        let from = c.end.told().state;
        c.end.disconnect();
        let state = c.end.told();
        let now = monotonic_ns().saturating_sub(c.start_ns);
        let record = EventRecord {
            tick: state.tick,
            time_ns: now,
            kind: EventKind::PortLost as u8,
            from: from as u8,
            to: state.state as u8,
            cause: state.cause as u8,
            value: 0.0,
        };
        c.push(&[Record::Event(record)]);
        let explained: PortError = c.port.explain(&e);
        explained.to_string()
    });
    let now = monotonic_ns();
    c.housekeeping(now);
    c.out.clear();
    let state = c.end.told();
    let mut metrics = c.figures.finish();
    let measured = metrics.measured_s.max(seconds);
    // On hardware the encoder's silence is all that is seen of sticking.
    metrics.stick_slip_cycles_per_s = (c.sticks.cycles() - c.sticks_before.0) as f64 / measured;
    metrics.stick_time_fraction = (c.sticks.stuck_ticks() - c.sticks_before.1) as f64 * seconds / measured;
    metrics.stair_height_rad = f64::from(c.sticks.stair()) * c.radians;
    let _ = c.watch.log_dropped.fetch_max(c.dropped, Ordering::Relaxed);
    LoopReport {
        state: state.state,
        cause: state.cause,
        value: state.value.to_f64(),
        ticks: c.answers,
        metrics,
        link: *c.end.counts(),
        lost: state.lost,
        implausible: state.rejected,
        deadline_misses: state.deadline_misses,
        response: c.response.summary(),
        interval: c.interval.summary(),
        clock_hz: 0,
        tick_cycles: c.tick_cycles.summary(),
        untold: state.untold,
        notes,
        log_dropped: c.dropped.saturating_sub(2 * c.untold),
        cut_writes: c.cut,
        begun: c.begun,
        on_the_board: E::IS_CONTROLLER,
        board_safe: c.board_safe,
        refused: c.refused,
        port_error,
    }
}
