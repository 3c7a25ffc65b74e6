//! Frames that a view draws, made of the records of a run.

use crate::view::{Frame, Note, Opening, View};
use clutch_core::supervisor::Cause;
use clutch_core::{ActuatorKind, Counts, Encoder};
use clutch_log::{
    ChangeRecord, CommandRecord, CommandSource, EventKind, EventRecord, Header, LinkRecord, Record,
    SampleRecord, names,
};
use clutch_loop::cause_words::cause_text;
use clutch_loop::drift::label;
use clutch_loop::live_gains::LiveGains;
use clutch_sim::detected::Detector;
use clutch_sim::{Keep, Scenario, number};
use rtrb::Consumer;
use std::collections::VecDeque;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Time between two frames.
const FRAME: Duration = Duration::from_millis(33);
/// Time of a point of the curves, s: more samples than one within it become a span.
const POINT: f64 = 1e-3;
/// Time over which cycles are counted, s.
const LATELY: f64 = 2.0;

/// Starts the thread that makes frames of what comes through a ring, until that is abandoned; none if the system gives no
/// thread.
pub(crate) fn start(
    header: &Header,
    scenario: &Scenario,
    gains: Option<Arc<dyn LiveGains>>,
    mut records: Consumer<Record>,
    views: Vec<Arc<dyn View>>,
) -> Option<JoinHandle<()>> {
    let mut feed = Feed::new(header, scenario)?;
    let opening = Opening::new(header, scenario, gains);
    views.iter().for_each(|view| view.begin(header, &opening));
    let make = move || {
        loop {
            // Asked before the ring is emptied: what was pushed before the end is seen.
            let last = records.is_abandoned();
            while let Ok(record) = records.pop() {
                views.iter().for_each(|view| view.record(&record));
                if let Some(note) = feed.take(&record) {
                    views.iter().for_each(|view| view.note(&note));
                }
            }
            if let Some(frame) = feed.frame() {
                views.iter().for_each(|view| view.frame(&frame));
            }
            if last {
                return;
            }
            std::thread::sleep(FRAME);
        }
    };
    std::thread::Builder::new().name("clutch-feed".into()).spawn(make).ok()
}

/// The state of the feed.
struct Feed {
    /// Keys of the run's parameters.
    keys: Vec<String>,
    actuator: ActuatorKind,
    encoder: Encoder,
    detector: Detector,
    /// The sampling period, s: time is the run's, which a board's clock that waits does not tear.
    period: f64,
    settle: f64,
    /// Samples of a point.
    per_point: u64,
    /// The position so far, and the counts that were its last.
    position: Option<(i64, i32)>,
    sample: Option<SampleRecord>,
    taken: u64,
    lately: VecDeque<f64>,
    /// The state of the last frame.
    told: &'static str,
    all: Frame,
}

impl Feed {
    fn new(header: &Header, scenario: &Scenario) -> Option<Feed> {
        let spec = scenario.spec();
        // A checked scenario has all of these.
        let encoder = Encoder::new::<f64>(spec.rig.encoder.sensor.counts_per_rev).ok()?;
        let detector = Detector::new(&spec, Keep::Figures).ok()?;
        let period = spec.period.seconds::<f64>();
        let per_point = ((POINT / period).round() as u64).max(1);
        let keys = header.parameters.iter().map(|(key, _)| key.clone()).collect();
        let all = Frame { state: "Ready", ..Frame::default() };
        let (settle, lately) = (spec.run.settle, VecDeque::new());
        Some(Feed {
            keys,
            actuator: spec.model.actuator.kind(),
            encoder,
            detector,
            period,
            settle,
            per_point,
            position: None,
            sample: None,
            taken: 0,
            lately,
            told: "Ready",
            all,
        })
    }

    /// A record; something has happened if it says so.
    fn take(&mut self, record: &Record) -> Option<Note> {
        match record {
            Record::Sample(sample) => self.sample = Some(*sample),
            Record::Command(command) => self.command(command),
            Record::Link(LinkRecord { lost, deadline_misses, .. }) => {
                (self.all.lost, self.all.deadline_misses) = (*lost, *deadline_misses);
            }
            Record::Event(event) => return Some(self.event(event)),
            Record::Change(change) => return Some(self.change(change)),
            Record::Truth(_) => {}
        }
        None
    }

    fn command(&mut self, command: &CommandRecord) {
        // A view that missed the sample leaves the command out.
        let Some(sample) = self.sample.take().filter(|s| s.tick == command.tick) else { return };
        let counts = sample.counts;
        let (at, last) = self.position.unwrap_or((i64::from(counts), counts));
        let at = at + i64::from(counts.wrapping_sub(last));
        self.position = Some((at, counts));
        let time = command.tick as f64 * self.period;
        let new = self.taken.is_multiple_of(self.per_point) || self.all.time_s.is_empty();
        self.taken += 1;
        let all = &mut self.all;
        if new {
            all.time_s.push(rounded(time, 1e5));
            all.target_deg.push(rounded(command.target_position.to_degrees(), 1e6));
        }
        let degrees = at as f64 * self.encoder.radians_per_count::<f64>().to_degrees();
        all.position_deg.take(rounded(degrees, 1e6), new);
        let by_law = command.source == CommandSource::Law as u8;
        let error = if by_law { command.error.to_degrees() } else { f64::NAN };
        all.error_deg.take(rounded(error, 1e6), new);
        all.volts.take(rounded(command.voltage, 1e4), new);
        all.tick = command.tick;
        all.state = names::name_of(names::STATES, command.state);
        if sample.lateness_us > 0 {
            all.answers.take(sample.lateness_us);
        }
        if sample.wake_us > 0 {
            all.wake_ups.take(sample.wake_us);
        }
        if !by_law {
            return;
        }
        if time >= self.settle {
            all.largest_error_deg = all.largest_error_deg.max(error.abs());
        }
        let velocity = command.target_velocity;
        if self.detector.sample(command.tick, Counts(counts), velocity, command.voltage).begins {
            all.cycles += 1;
            all.sticks_s.push(rounded(time, 1e5));
            self.lately.push_back(time);
        }
        while self.lately.front().is_some_and(|t| *t < time - LATELY) {
            self.lately.pop_front();
        }
        all.cycles_per_s = self.lately.len() as f64 / LATELY.min(time.max(0.1));
    }

    fn change(&self, change: &ChangeRecord) -> Note {
        let key = self.keys.get(usize::from(change.parameter)).cloned().unwrap_or_default();
        let text = format!("{key} = {}", number(change.value));
        let time_s = rounded(change.tick as f64 * self.period, 1e3);
        let (bad, bound) = match change.error_bound {
            bound if bound.is_nan() => (true, "UNCERTIFIED".to_owned()),
            bound => (false, format!("|e| certified below {} °", number(bound.to_degrees()))),
        };
        Note { time_s, text: format!("{text}: {bound}"), bad, gain: Some((key, change.value)) }
    }

    fn event(&mut self, event: &EventRecord) -> Note {
        let (from, to) = (names::name_of(names::STATES, event.from), names::name_of(names::STATES, event.to));
        self.all.state = to;
        let cause = Cause::from_u8(event.cause).unwrap_or(Cause::None);
        let why = || cause_text(cause, event.value, false, true);
        let at_rest = matches!(cause, Cause::None | Cause::Done | Cause::Operator);
        let (text, bad) = match EventKind::from_number(event.kind) {
            Some(EventKind::StateChange | EventKind::Ended) if cause == Cause::None => {
                (format!("{} → {}", from.to_lowercase(), to.to_lowercase()), false)
            }
            Some(EventKind::StateChange | EventKind::Ended) => {
                (format!("{} → {}: {}", from.to_lowercase(), to.to_lowercase(), why()), !at_rest)
            }
            Some(EventKind::LogDropped) => (format!("the log has lost {} records", event.value), true),
            Some(EventKind::PortLost) => ("the port is gone".to_owned(), true),
            Some(EventKind::Drift) => {
                let seen = number(event.value);
                (format!("{} is {seen} times the model's: outside of [bounds]", label(self.actuator)), true)
            }
            None => (format!("event {}", event.kind), true),
        };
        Note { time_s: rounded(event.tick as f64 * self.period, 1e3), text, bad, gain: None }
    }

    /// The frame since the last one; none if nothing has come.
    fn frame(&mut self) -> Option<Frame> {
        // A change of state is reported also where no sample follows it.
        if self.all.time_s.is_empty() && self.all.state == self.told {
            return None;
        }
        self.told = self.all.state;
        let all = &self.all;
        let next = Frame {
            tick: all.tick,
            state: all.state,
            cycles: all.cycles,
            cycles_per_s: all.cycles_per_s,
            largest_error_deg: all.largest_error_deg,
            lost: all.lost,
            deadline_misses: all.deadline_misses,
            answers: all.answers,
            wake_ups: all.wake_ups,
            ..Frame::default()
        };
        Some(std::mem::replace(&mut self.all, next))
    }
}

/// A number with as many digits as a picture needs.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feed(period_us: &str) -> Feed {
        let set = [("sampling.period_us".to_owned(), period_us.to_owned())];
        let scenario = Scenario::load("board_smc_2".as_ref(), &set).unwrap();
        let header = Header { parameters: vec![("law.smc.kp_v".into(), "3".into())], ..Header::default() };
        Feed::new(&header, &scenario).unwrap()
    }

    fn tick(feed: &mut Feed, tick: u64, counts: i32, source: CommandSource) {
        let sample = SampleRecord { tick, counts, lateness_us: 7, ..SampleRecord::default() };
        assert_eq!(feed.take(&Record::Sample(sample)), None);
        let error = 1e-3 * tick as f64;
        let command =
            CommandRecord { tick, source: source as u8, error, voltage: 2.0, ..CommandRecord::default() };
        assert_eq!(feed.take(&Record::Command(command)), None);
    }

    #[test]
    fn a_fast_loops_samples_become_spans_of_a_millisecond() {
        let mut feed = feed("250");
        (0..9).for_each(|i| tick(&mut feed, i, i as i32, CommandSource::Law));
        let frame = feed.frame().unwrap();
        assert_eq!(frame.time_s, [0.0, 0.001, 0.002]);
        assert_eq!(frame.position_deg.low, [0.0, 0.072, 0.144]);
        assert_eq!(frame.position_deg.high, [0.054, 0.126, 0.144]);
        // The point under way goes on in the next frame as one of its own.
        tick(&mut feed, 9, 9, CommandSource::Law);
        assert_eq!(feed.frame().unwrap().time_s, [0.00225]);
        assert!(feed.frame().is_none());
    }

    #[test]
    fn a_tick_without_the_law_has_no_error_and_counts_wrap() {
        let mut feed = feed("1000");
        tick(&mut feed, 0, i32::MAX, CommandSource::Law);
        tick(&mut feed, 1, i32::MIN, CommandSource::Safe);
        let frame = feed.frame().unwrap();
        let moved = frame.position_deg.low[1] - frame.position_deg.low[0];
        assert!((moved - 0.018).abs() < 1e-5, "{moved}");
        let told: serde_json::Value = serde_json::to_value(&frame).unwrap();
        assert_eq!(told["error_deg"]["low"][0], 0.0);
        assert!(told["error_deg"]["low"][1].is_null());
        assert_eq!(told["answers"][3], 2, "7 µs are from 5 to 10");
    }

    #[test]
    fn a_command_whose_sample_was_missed_is_left_out() {
        let mut feed = feed("1000");
        let alone = CommandRecord { tick: 5, ..CommandRecord::default() };
        assert_eq!(feed.take(&Record::Command(alone)), None);
        let other = SampleRecord { tick: 6, ..SampleRecord::default() };
        assert_eq!(feed.take(&Record::Sample(other)), None);
        assert_eq!(feed.take(&Record::Command(CommandRecord { tick: 7, ..CommandRecord::default() })), None);
        assert!(feed.frame().is_none());
    }

    #[test]
    fn what_happens_is_told_in_words_and_faults_are_marked() {
        let mut feed = feed("1000");
        let mut told = |kind: EventKind, to: u8, cause: Cause| {
            let (kind, cause) = (kind as u8, cause as u8);
            let event =
                EventRecord { tick: 2500, kind, from: 3, to, cause, value: 2.0, ..EventRecord::default() };
            let note = feed.take(&Record::Event(event)).unwrap();
            (note.time_s, note.text, note.bad)
        };
        let done = "running → holding: the path is done".to_owned();
        assert_eq!(told(EventKind::Ended, 4, Cause::Done), (2.5, done, false));
        let lost = "running → faulted: 2 samples lost within 128 periods".to_owned();
        assert_eq!(told(EventKind::StateChange, 6, Cause::Lost), (2.5, lost, true));
        assert!(told(EventKind::Drift, 3, Cause::None).2);
        let change = ChangeRecord {
            tick: 3000,
            parameter: 0,
            value: 4.0,
            error_bound: 1e-3,
            ..ChangeRecord::default()
        };
        let note = feed.take(&Record::Change(change)).unwrap();
        assert_eq!(
            (note.time_s, note.text.as_str()),
            (3.0, "law.smc.kp_v = 4: |e| certified below 0.057296 °")
        );
        assert_eq!(note.gain, Some(("law.smc.kp_v".to_owned(), 4.0)));
    }
}
