//! A run as a picture shows it: closely around one stick, and the whole as an envelope.
//!
//! Ten seconds of a shaft that sticks twenty times a second are a solid band if they are drawn as a line. A [`Window`] is
//! short enough to distinguish one stair from the next; an [`Envelope`] shows how far the whole goes, and its mean.

use crate::engine::{Event, EventKind};
use crate::run::{Run, Trace};
use crate::scenario::Scenario;
use std::ops::Range;

/// Counts of the encoder by which the path goes on in a window.
const STAIRS: f64 = 24.0;
/// Length of a window in lengths of the stick in it, at least.
const STICKS: f64 = 4.0;
/// Samples in a window, at least.
const SAMPLES: usize = 40;
/// Parts of an envelope, few enough that the cycles of a stick-slip are in one and leave the mean even.
pub const PARTS: usize = 120;

/// A time at rest, from a stick to its break-away; one at either end of the run begins or ends with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stick {
    /// Its begin, s.
    pub from: f64,
    /// Its end, s.
    pub to: f64,
}

/// The sticks of a run of that length (s), in order.
#[must_use]
pub fn sticks(events: &[Event], duration: f64) -> Vec<Stick> {
    let mut sticks: Vec<Stick> = Vec::new();
    let mut begin = Some(0.0);
    for event in events {
        match event.kind {
            EventKind::Stick => begin = Some(event.time),
            EventKind::BreakAway => sticks.extend(begin.take().map(|from| Stick { from, to: event.time })),
        }
    }
    // A run without an event is one without a stick: it begins in motion, or never moves.
    let last = begin.filter(|_| !events.is_empty());
    sticks.extend(last.map(|from| Stick { from, to: duration }));
    sticks
}

/// The event in the middle of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Around {
    /// A stick.
    Stick(Stick),
    /// The largest error, at that time (s): the shaft does not stick.
    LargestError(f64),
}

/// The curves by which a window is chosen, at samples in order; those that are not of one length end with the shortest.
#[derive(Clone, Copy, Debug)]
pub struct Curves<'a> {
    /// Time of each sample, s.
    pub time: &'a [f64],
    /// Target position, rad.
    pub target: &'a [f64],
    /// Target velocity, rad/s.
    pub target_velocity: &'a [f64],
    /// Error, rad.
    pub error: &'a [f64],
    /// Angle of a count of the encoder, rad.
    pub count: f64,
    /// Time from which on a stick counts, s.
    pub settled: f64,
    /// End of the run, s.
    pub end: f64,
}

/// A stretch of a run that shows single stairs of the encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its begin, s.
    pub from: f64,
    /// Its end, s.
    pub to: f64,
    /// The event in its middle.
    pub around: Around,
}

impl Window {
    /// The window of a run whose samples were kept. None for a run without samples.
    #[must_use]
    pub fn of(scenario: &Scenario, run: &Run) -> Option<Window> {
        let (spec, trace) = (scenario.spec(), &run.trace);
        let curves = Curves {
            time: &trace.time,
            target: &trace.target_position,
            target_velocity: &trace.target_velocity,
            error: &trace.error,
            count: std::f64::consts::TAU / f64::from(spec.rig.encoder.sensor.counts_per_rev),
            settled: spec.run.settle,
            end: spec.run.duration,
        };
        Window::chosen(&curves, sticks(&run.events, spec.run.duration))
    }

    /// The window around the stick of middle length of those after settling during which the path goes on, by half a count
    /// if there are such; where there is none, around the largest error. None without samples.
    #[must_use]
    pub fn chosen(curves: &Curves<'_>, sticks: Vec<Stick>) -> Option<Window> {
        let Curves { time, target, target_velocity, error, count, settled, end } = *curves;
        let n = [time, target, target_velocity, error].map(<[f64]>::len).into_iter().min().unwrap_or(0);
        let index = |at: f64| time[..n].partition_point(|t| *t < at).min(n - 1);
        let begin = *time[..n].first()?;
        // A shaft at rest is where it should be while the path rests.
        let goes_on = |s: &Stick| target_velocity[index(s.to)] != 0.0;
        let shows = |s: &Stick| (target[index(s.to)] - target[index(s.from)]).abs() >= 0.5 * count;
        let mut those = sticks;
        those.retain(|s| s.from >= settled && goes_on(s));
        // The shortest hardly show in a picture: they are taken only if there are no others.
        if those.iter().any(shows) {
            those.retain(shows);
        }
        those.sort_by(|a, b| (a.to - a.from).total_cmp(&(b.to - b.from)));
        let (around, middle, least) = match those.get(those.len() / 2) {
            Some(s) => (Around::Stick(*s), 0.5 * (s.from + s.to), STICKS * (s.to - s.from)),
            None => {
                let at = (index(settled)..n)
                    .max_by(|a, b| error[*a].abs().total_cmp(&error[*b].abs()))
                    .map_or(begin, |i| time[i]);
                (Around::LargestError(at), at, 0.0)
            }
        };
        let (first, last) = stretch(&target[..n], index(middle), STAIRS * count);
        let length = (time[last] - time[first]).max(least).min(end - begin);
        // Within the run, also where its middle is near an end.
        let from = (middle - 0.5 * length).min(end - length).max(begin);
        Some(Window { from, to: from + length, around })
    }

    /// The window that several runs are shown in together: of the first that sticks, else of the first. None without samples.
    #[must_use]
    pub fn shared<'a>(runs: impl Iterator<Item = (&'a Scenario, &'a Run)>) -> Option<Window> {
        let mut windows = runs.filter_map(|(scenario, run)| Window::of(scenario, run));
        let first = windows.next()?;
        let sticks = |w: &Window| matches!(w.around, Around::Stick(_));
        Some(if sticks(&first) { first } else { windows.find(sticks).unwrap_or(first) })
    }

    /// The samples within it.
    #[must_use]
    pub fn samples(&self, trace: &Trace) -> Range<usize> {
        let place = |t: f64| trace.time.partition_point(|x| *x < t);
        place(self.from)..place(self.to)
    }

    /// The sticks of a run of that length (s) within it, cut at its ends.
    #[must_use]
    pub fn sticks(&self, events: &[Event], duration: f64) -> Vec<Stick> {
        let cut = |s: Stick| Stick { from: s.from.max(self.from), to: s.to.min(self.to) };
        sticks(events, duration).into_iter().map(cut).filter(|s| s.from < s.to).collect()
    }

    /// The path and the encoder in it, in counts from the one that the path is on at its begin.
    #[must_use]
    pub fn staircase(&self, trace: &Trace) -> [Vec<f64>; 2] {
        let path = |i: usize| trace.target_fixed[i].0 as f64 / 65536.0;
        let samples = self.samples(trace);
        let origin = if samples.start < trace.time.len() { path(samples.start).floor() } else { 0.0 };
        [
            samples.clone().map(|i| path(i) - origin).collect(),
            samples.map(|i| f64::from(trace.counts[i]) - origin).collect(),
        ]
    }

    /// The event in its middle, in words.
    #[must_use]
    pub fn words(&self) -> String {
        match self.around {
            Around::Stick(Stick { from, to }) => {
                format!("around the stick at {from:.3} s, {:.1} ms long", 1e3 * (to - from))
            }
            Around::LargestError(at) => format!("around the largest error, at {at:.3} s"),
        }
    }
}

/// The shortest stretch around a sample in which the path goes so far (rad), both ways counted: its first and last sample.
fn stretch(target: &[f64], middle: usize, way: f64) -> (usize, usize) {
    let (mut first, mut last, mut gone) = (middle, middle, 0.0);
    while (gone < way || last - first < SAMPLES) && (first > 0 || last + 1 < target.len()) {
        if first > 0 {
            first -= 1;
            gone += (target[first + 1] - target[first]).abs();
        }
        if last + 1 < target.len() {
            last += 1;
            gone += (target[last] - target[last - 1]).abs();
        }
    }
    (first, last)
}

/// A curve over time in parts of equal length: the lowest, the highest and the mean of each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Envelope {
    /// Middle of each part, s.
    pub time: Vec<f64>,
    /// Lowest value of each.
    pub low: Vec<f64>,
    /// Highest value of each.
    pub high: Vec<f64>,
    /// Mean of each.
    pub mean: Vec<f64>,
}

impl Envelope {
    /// The envelope of values at times that rise evenly, in at most so many parts. Values that are no numbers do not count;
    /// a part without a number is left out.
    #[must_use]
    pub fn new(time: &[f64], values: &[f64], parts: usize) -> Envelope {
        let n = time.len().min(values.len());
        let parts = parts.clamp(1, n.max(1));
        let mut envelope = Envelope::default();
        for part in 0..parts {
            let (from, to) = (part * n / parts, (part + 1) * n / parts);
            let numbers = || values[from..to].iter().copied().filter(|x| !x.is_nan());
            let count = numbers().count();
            if count == 0 {
                continue;
            }
            envelope.time.push(0.5 * (time[from] + time[to - 1]));
            envelope.low.push(numbers().fold(f64::INFINITY, f64::min));
            envelope.high.push(numbers().fold(f64::NEG_INFINITY, f64::max));
            envelope.mean.push(numbers().sum::<f64>() / count as f64);
        }
        envelope
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::UNWATCHED;
    use crate::run::{Keep, Trace};

    fn run_of(name: &str, set: &[(&str, &str)]) -> (Scenario, Run) {
        let set: Vec<(String, String)> = set.iter().map(|(k, v)| ((*k).into(), (*v).into())).collect();
        let scenario = Scenario::load(std::path::Path::new(name), &set).expect("it is built in");
        let run = scenario.run(Keep::Trace, UNWATCHED).expect("it runs");
        (scenario, run)
    }

    #[test]
    fn the_window_of_a_shaft_that_sticks_holds_a_stick_and_its_stairs() {
        for name in ["pd_2", "smc_2", "bench_pd_2", "bench_smc_2", "motor_pid"] {
            let (scenario, run) = run_of(name, &[]);
            let window = Window::of(&scenario, &run).expect("samples");
            let Around::Stick(Stick { from, to }) = window.around else { panic!("{name}: {window:?}") };
            assert!(window.from <= from && to <= window.to, "{name}: {window:?}");
            assert!(run.events.iter().any(|e| e.kind == EventKind::Stick && e.time == from));
            // One stair is some twentieth of it.
            let counts = |t: f64| run.trace.counts[run.trace.time.partition_point(|x| *x < t) - 1];
            let stairs = counts(window.to).abs_diff(counts(window.from));
            assert!((10..200).contains(&stairs), "{name}: {stairs} counts in {window:?}");
        }
    }

    #[test]
    fn the_window_of_a_shaft_that_never_sticks_holds_its_largest_error() {
        let (scenario, run) = run_of("bench_glide_2", &[]);
        let window = Window::of(&scenario, &run).expect("samples");
        let Around::LargestError(at) = window.around else { panic!("{window:?}") };
        assert!(window.from <= at && at <= window.to);
        let i = run.trace.time.iter().position(|t| *t == at).expect("a sample's time");
        assert_eq!(run.trace.error[i].abs(), run.metrics.max_error_rad);
    }

    #[test]
    fn runs_share_the_window_of_the_first_that_sticks_and_are_all_within_it() {
        let [glide, pd] = ["bench_glide_2", "bench_pd_2"].map(|name| run_of(name, &[]));
        let shared = |runs: &[&(Scenario, Run)]| Window::shared(runs.iter().map(|(s, r)| (s, r)));
        let window = shared(&[&glide, &pd]).expect("samples");
        assert_eq!(Some(window), Window::of(&pd.0, &pd.1));
        assert_eq!(shared(&[&glide]), Window::of(&glide.0, &glide.1));
        assert_eq!(shared(&[]), None);
        for (scenario, run) in [&glide, &pd] {
            let [path, counts] = window.staircase(&run.trace);
            assert_eq!(path.len(), window.samples(&run.trace).len());
            assert!((0.0..1.0).contains(&path[0]), "it begins on a count: {}", path[0]);
            // By the error of the run, which is smaller than twenty counts.
            assert!(path.iter().zip(&counts).all(|(p, c)| (p - c).abs() < 20.0));
            let rests = window.sticks(&run.events, scenario.spec().run.duration);
            assert!(rests.iter().all(|s| window.from <= s.from && s.from < s.to && s.to <= window.to));
            assert_eq!(rests.is_empty(), run.metrics.stick_slip_cycles_per_s == 0.0);
        }
    }

    #[test]
    fn a_shaft_that_stops_where_its_path_rests_does_not_stick_in_a_picture() {
        let (scenario, run) = run_of("minimum_jerk", &[]);
        let window = Window::of(&scenario, &run).expect("samples");
        let Around::Stick(stick) = window.around else { panic!("{window:?}") };
        assert!(stick.to < 6.0, "it ends on the way, not with the run: {window:?}");
        // The run with the last of its sticks alone, at the path's end.
        let stop = run.events.iter().rev().find(|e| e.kind == EventKind::Stick).copied();
        let stopped = Run { events: stop.into_iter().collect(), ..run };
        assert_eq!(sticks(&stopped.events, 8.0).len(), 1);
        let window = Window::of(&scenario, &stopped).expect("samples");
        assert!(matches!(window.around, Around::LargestError(_)), "{window:?}");
    }

    #[test]
    fn a_run_of_a_few_samples_has_a_window_and_one_without_has_none() {
        let short = [("run.duration_s", "0.02"), ("run.settle_s", "0.01")];
        let (scenario, run) = run_of("pd_2", &short);
        let window = Window::of(&scenario, &run).expect("samples");
        assert!(window.from >= 0.0 && window.to <= 0.02, "{window:?}");
        assert_eq!(Window::of(&scenario, &Run { trace: Trace::default(), ..run }), None);
    }

    #[test]
    fn sticks_end_where_the_shaft_breaks_away_or_the_run_ends() {
        let event = |time, kind| Event { time, kind, position: 0.0, torque: 0.0 };
        let (stick, away) = (EventKind::Stick, EventKind::BreakAway);
        let of = |events: &[Event]| sticks(events, 5.0).iter().map(|s| (s.from, s.to)).collect::<Vec<_>>();
        assert_eq!(of(&[]), []);
        assert_eq!(of(&[event(1.0, stick), event(2.0, away), event(4.0, stick)]), [(1.0, 2.0), (4.0, 5.0)]);
        assert_eq!(of(&[event(0.5, away)]), [(0.0, 0.5)]);
    }

    #[test]
    fn an_envelope_loses_no_peak_and_keeps_the_mean() {
        let time: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        let mut values: Vec<f64> = (0..1000).map(|i| f64::from(i % 7) - 3.0).collect();
        (values[137], values[600]) = (40.0, f64::NAN);
        let e = Envelope::new(&time, &values, 100);
        assert_eq!((e.time.len(), e.high[13], e.low[13]), (100, 40.0, -3.0));
        assert!((e.time[13] - 0.1345).abs() < 1e-12);
        assert!(e.mean.iter().zip(&e.low).zip(&e.high).all(|((m, l), h)| l <= m && m <= h));
        assert_eq!(Envelope::new(&time[..3], &values[..3], 100).mean, values[..3]);
        assert_eq!(Envelope::new(&[], &[], 100), Envelope::default());
        assert_eq!(Envelope::new(&time[..2], &[f64::NAN; 2], 1), Envelope::default());
    }
}
