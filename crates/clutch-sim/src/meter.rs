//! The meter of stick-slip: between which bounds counts and voltage leave the cycles of a shaft.
//!
//! A shaft that sticks once in each count crosses its edges as evenly as one that slides: the edges alone do not
//! distinguish them. But the voltage is known. A shaft that slides answers it with its velocity, and one that sticks
//! breaks away only after the voltage has fallen by as much as friction at rest is above that in motion. Between two
//! edges, where the shaft went one count, the meter therefore asks twice, for all frictions `h` that there may be:
//!
//! * Can it have slid all the way? If not, it has stuck: a *sure* stick.
//! * Can it have stopped and broken away? If not, it has slid.
//!
//! A gap to which both answers are yes says nothing. Sure sticks are the least that there were, gaps that can hold a
//! stick the most. A stick makes no edge, so that each lies within one gap, from its beginning to its end.
//!
//! ```text
//! θ̈ = γ (p(t) − h l(t)) ± s,   p = (T_u + T(u))/J,  l = μ_d N(u)/J,  h constant over a count
//! ```
//!
//! `docs/meter.md` has formulas, what is assumed, and how often the bounds hold the truth.

use clutch_core::friction::FrictionModel;
use clutch_core::law::LawParams;
use clutch_core::{Counts, Encoder, Micros, Plant, VelocityParams};

/// Friction as a multiple of the model's: from one over this to this.
pub const FRICTION_RANGE: f64 = 3.0;
/// Drive over inertia, of which the model's is believed to this share more and less.
pub const GAIN_DOUBT: f64 = 0.2;
/// Share of the model's rise of friction at rest over that in motion, of which a shaft that breaks away has at least
/// this much.
pub const RISE_BELIEVED: f64 = 0.5;
/// Share by which friction changes along the disc, 1/rad: a ripple of 15 % with 340 waves per turn, as
/// the defaults of the edge-timed filter have it.
pub const ROUGHNESS: f64 = 0.15 * 340.0;
/// Periods from a voltage to its effect: from 0 to this, or to the delay of a filter if that is more.
const DELAY: u32 = 1;
/// Points of a gap that are kept; of a longer one, every second, fourth and so on.
const POINTS: usize = 256;
/// Room for them, for one that halves them, and for the end of the gap.
const ROOM: usize = POINTS + 2;
/// Frictions that are tried: 6 % from one to the next.
const FRICTIONS: usize = 40;
/// Steps of a search by golden section: friction to a millionth.
const SEARCH: usize = 30;
/// Counts, and counts per period, that no rounding makes: a bound that decides by more decides as the search does.
const ROUNDING: f64 = 1e-9;

/// A gap between two edges, judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Sample at which the count was entered, from 0.
    pub begin: u64,
    /// Sample at which it had been left.
    pub end: u64,
    /// The shaft cannot have slid all the way: it has stuck.
    pub sure: bool,
    /// The shaft can have stuck.
    pub possible: bool,
}

/// Sticks so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Gaps in which the shaft has stuck.
    pub least: u64,
    /// Gaps in which it can have.
    pub most: u64,
}

impl Tally {
    /// Takes a gap. `from`: the first sample that counts; a gap that began before may hold a stick after it.
    pub fn take(&mut self, gap: &Gap, from: u64) {
        self.least += u64::from(gap.sure && gap.begin >= from);
        self.most += u64::from(gap.possible && gap.end >= from);
    }
}

/// The meter, with its memory. It allocates when it is made, and never later.
#[derive(Clone, Debug)]
pub struct Meter {
    plant: Plant<f64>,
    /// Acceleration of a torque, counts per period² and N m.
    per_torque: f64,
    /// The model's friction in motion, as μ.
    sliding: f64,
    /// Least ratio of friction at rest to that in motion.
    ratio: f64,
    /// Acceleration of a friction that changes within the count, counts per period².
    slack: f64,
    frictions: [f64; FRICTIONS],
    /// One for each delay.
    tracks: Vec<Track>,
    /// For [`Meter::stops`]: ways from rest at a point to the end of a gap.
    scratch: Vec<Onwards>,
    last: Option<Counts>,
    /// Counts by which the gap was entered; 0 before the first edge.
    entered: i32,
    begin: u64,
    /// The number of the next sample, if none is lost.
    next: u64,
    /// A sample of the gap is lost.
    broken: bool,
}

impl Meter {
    /// A meter that believes `plant`. Delays are tried from 0 to one period, or to the delay of law and velocity source.
    #[must_use]
    pub fn new(
        plant: Plant<f64>,
        (law, velocity): (&LawParams, &VelocityParams),
        encoder: Encoder,
        period: Micros,
    ) -> Self {
        let seconds: f64 = period.seconds();
        let count: f64 = encoder.radians_per_count();
        let per_torque = seconds * seconds / (plant.params().inertia * count);
        let sliding = plant.friction().sliding();
        let rise = plant.friction().at_rest() / sliding - 1.0;
        // The load that friction carries when the shaft slides: the drive, and the drag of a disc or a gear.
        let carried = plant.params().drive_torque.abs().max(sliding * plant.actuator().normal(0.0));
        let source = if let VelocityParams::EdgeTimed(filter) = velocity { Some(filter) } else { None };
        let told = law.filter().or(source).map_or(0, |filter| filter.delay);
        let step = 2.0 * libm::log(FRICTION_RANGE) / (FRICTIONS - 1) as f64;
        Meter {
            plant,
            per_torque,
            sliding,
            ratio: 1.0 + RISE_BELIEVED * rise.max(0.0),
            slack: (ROUGHNESS * count).min(1.0) * carried * per_torque,
            frictions: std::array::from_fn(|i| libm::exp(step * i as f64) / FRICTION_RANGE),
            tracks: (0..=told.max(DELAY)).map(Track::new).collect(),
            scratch: vec![Onwards::default(); ROOM],
            last: None,
            entered: 0,
            begin: 0,
            next: 0,
            broken: false,
        }
    }

    /// Sample number `tick`: its counts, and the voltage that was given in answer to it, V. A gap that it ends is judged.
    ///
    /// A gap with a lost sample says nothing: it can hold a stick, and need not.
    pub fn sample(&mut self, tick: u64, counts: Counts, volts: f64) -> Option<Gap> {
        self.broken |= tick != self.next;
        let moved = self.last.map(|last| counts.since(last));
        let actuator = self.plant.actuator();
        let pull = (self.plant.params().drive_torque + actuator.torque(volts)) * self.per_torque;
        let given = (pull, self.sliding * actuator.normal(volts) * self.per_torque);
        if moved.is_none() {
            self.tracks.iter_mut().for_each(|track| track.line = [given; 4]);
        }
        self.last = Some(counts);
        let mut judged = None;
        if moved != Some(0) {
            let left = moved.unwrap_or(0);
            if self.entered != 0 {
                judged = Some(self.judge(left, tick));
            }
            (self.entered, self.begin, self.broken) = (left, tick, false);
            self.tracks.iter_mut().for_each(Track::enter);
        }
        for track in &mut self.tracks {
            let (pull, load) = track.arrive(given);
            track.advance(pull, load);
        }
        self.next = tick + 1;
        judged
    }

    /// The gap that ends now, with so many counts.
    fn judge(&mut self, left: i32, end: u64) -> Gap {
        let gap = Gap { begin: self.begin, end, sure: false, possible: true };
        // A shaft that turned round was at rest, for a moment at least.
        if self.broken || left.signum() != self.entered.signum() {
            return gap;
        }
        let sign = f64::from(left.signum());
        self.tracks.iter_mut().for_each(Track::leave);
        // A shaft that can have been turned round within a count, and back, need not have stuck.
        let turned = self.tracks.iter().any(|track| track.turns[usize::from(sign < 0.0)]);
        let sure = !turned && self.tracks.iter().all(|track| !self.slides(track, sign));
        // Apart from what it reads: filled anew for each friction, and cleared for none.
        let mut after = std::mem::take(&mut self.scratch);
        let possible = sure || self.tracks.iter().any(|track| self.stops(track, sign, &mut after));
        self.scratch = after;
        Gap { sure, possible, ..gap }
    }

    /// True if there are a friction and a velocity with which the shaft slid all the way.
    fn slides(&self, track: &Track, sign: f64) -> bool {
        let end = track.now;
        if end.time < 2.0 {
            return true; // two samples fix no velocity
        }
        let (mut low, mut high) = (1.0 / FRICTION_RANGE, FRICTION_RANGE);
        // Velocities at the beginning have to be at or above one bound and below another: the former less the latter is
        // convex in friction.
        for _ in 0..SEARCH {
            let span = 0.381_966 * (high - low);
            let (left, right) = (low + span, high - span);
            let missing = [left, right].map(|h| self.missing(track, sign, h));
            if missing[0].value <= 0.0 || missing[1].value <= 0.0 {
                return true;
            }
            if least_of(missing, [low, high]) > ROUNDING {
                return false;
            }
            if missing[0].value < missing[1].value { high = right } else { low = left }
        }
        false
    }

    /// The least velocity at the beginning that has the shaft go on to the edge, less the most that does not bring it
    /// there too early, counts per period.
    fn missing(&self, track: &Track, sign: f64, friction: f64) -> Tangent {
        let gain = 1.0 - GAIN_DOUBT;
        let (end, slack) = (&track.now, self.slack);
        let (mut least, mut slope) = (0.0_f64, 0.0_f64);
        for x in track.points() {
            let asked = -gain * x.speed(sign, friction) - slack * x.time;
            if asked > least {
                (least, slope) = (asked, gain * x.loaded);
            }
        }
        // Over one count from the sample before the first to the last.
        let (pull, load) = track.before;
        let whole = end.time + 1.0;
        let outside = gain * (end.way(sign, friction) - 0.5 * (sign * pull - friction * load));
        let asked = (1.0 - outside - 0.5 * slack * whole * whole) / whole;
        if asked > least {
            (least, slope) = (asked, gain * (end.loaded_far - 0.5 * load) / whole);
        }
        // Below one count from the first sample in it to the last.
        let inner = &track.inner;
        let inside = gain * inner.way(sign, friction);
        Tangent {
            at: friction,
            value: least - (1.0 - inside + 0.5 * slack * inner.time * inner.time) / inner.time,
            slope: slope - gain * inner.loaded_far / inner.time,
        }
    }

    /// True if there is a friction with which the shaft came to rest and broke away, one count further in all.
    fn stops(&self, track: &Track, sign: f64, after: &mut [Onwards]) -> bool {
        let slack = self.slack;
        // Friction has to be so high that it slows the shaft somewhere, and so low that it lets it go somewhere.
        let (pull, load) = track.before;
        let (mut low, mut high) = (lesser((sign * pull - slack) / load, f64::INFINITY), 0.0_f64);
        for x in track.points() {
            low = lesser((sign * x.pull - slack) / x.load, low);
            high = greater((sign * x.pull + slack) / (self.ratio * x.load), high);
        }
        if low > high {
            return false;
        }
        // A way to a rest and on from it is at most what the largest acceleration makes of the whole time; that is convex
        // in friction. Most gaps of a shaft that runs end here.
        let (gain, whole) = (1.0 + GAIN_DOUBT, track.now.time + 1.0);
        let comes_so_far = |h: f64| {
            let of = |pull: f64, load: f64| (sign * pull - h * load).abs();
            let most =
                track.points().iter().fold(of(pull, load), |most, x| greater(of(x.pull, x.load), most));
            0.5 * (gain * most + slack) * whole * whole > 1.0 - ROUNDING
        };
        let ends = [greater(low, 1.0 / FRICTION_RANGE), lesser(high, FRICTION_RANGE)];
        if !ends.into_iter().any(comes_so_far) {
            return false;
        }
        let tried =
            self.frictions.partition_point(|h| *h < low)..self.frictions.partition_point(|h| *h <= high);
        let Some(frictions) = self.frictions.get(tried) else { return false };
        // The least and the highest allow the longest ways: inwards from either end, until ways are too short.
        let mut left = frictions.iter();
        for from_above in [false, true] {
            while let Some(h) = if from_above { left.next_back() } else { left.next() } {
                let (stops, longest) = self.stops_with(*h, track, sign, after);
                if stops {
                    return true;
                }
                if longest < 1.0 - ROUNDING {
                    break;
                }
            }
        }
        false
    }

    /// True if the shaft can have come to rest and broken away with a friction, one count further in all. With it the
    /// longest way to a point and on from one, as if it were at rest there: a convex function of friction, that no way with
    /// a rest exceeds.
    fn stops_with(&self, h: f64, track: &Track, sign: f64, after: &mut [Onwards]) -> (bool, f64) {
        let (slack, gain, end) = (self.slack, 1.0 + GAIN_DOUBT, &track.now);
        let bowed = |time: f64| 0.5 * slack * time * time;
        // From rest at a point to the end: it goes on if nowhere later the velocity is lower.
        let (mut lowest, mut longest) = (f64::INFINITY, f64::NEG_INFINITY);
        let all = end.way(sign, h);
        for (x, onwards) in track.points().iter().zip(after.iter_mut()).rev() {
            let (speed, left) = (gain * x.speed(sign, h), end.time - x.time);
            let goes_on = speed <= lowest + slack * left;
            lowest = lesser(speed, lowest);
            let lets_go = self.ratio * h * x.load <= sign * x.pull + slack;
            let far = gain * (all - x.way(sign, h)) - speed * left + bowed(left);
            longest = greater(far, longest);
            *onwards = Onwards { way: if goes_on && lets_go { far } else { f64::NEG_INFINITY }, longest };
        }
        // From the edge to rest at a point: it came so far if nowhere earlier the velocity was lower.
        let (pull, load) = track.before;
        let (mut lowest, mut farthest, mut longest) = (f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY);
        let first = sign * pull - h * load;
        let (mut slows, first) = (first <= slack, 0.5 * gain * first);
        let stops = track.points().iter().zip(after.iter()).any(|(x, onwards)| {
            let speed = gain * x.speed(sign, h);
            let far = gain * x.way(sign, h) - speed * x.time + bowed(x.time);
            let far = far + greater(-speed - first, 0.0);
            longest = greater(far + onwards.longest, longest);
            if slows && speed <= lowest + slack * x.time {
                farthest = greater(far, farthest);
            }
            lowest = lesser(speed, lowest);
            slows |= sign * x.pull - h * x.load <= slack;
            farthest + onwards.way >= 1.0
        });
        (stops, longest)
    }
}

/// Ways from rest at a point of a gap to its end, counts.
#[derive(Clone, Copy, Debug, Default)]
struct Onwards {
    /// Where the shaft can break away, and goes on; else none at all.
    way: f64,
    /// The longest of those from this point and the later ones, whether it can or not.
    longest: f64,
}

/// The greater of a number and one that it knows; one instruction, where [`f64::max`] minds what is no number. That leaves
/// `known`.
fn greater(new: f64, known: f64) -> f64 {
    if new > known { new } else { known }
}

/// The lesser, likewise.
fn lesser(new: f64, known: f64) -> f64 {
    if new < known { new } else { known }
}

/// A convex function of friction at a friction, and its slope there.
#[derive(Clone, Copy, Debug)]
struct Tangent {
    at: f64,
    value: f64,
    slope: f64,
}

/// A value below which a convex function does not fall between two frictions: its tangents there, at two others.
fn least_of(tangents: [Tangent; 2], [low, high]: [f64; 2]) -> f64 {
    let [a, b] = tangents;
    let above = |h: f64| {
        let [a, b] = tangents.map(|t| t.value + t.slope * (h - t.at));
        a.max(b)
    };
    let crossing = (b.value - a.value + a.slope * a.at - b.slope * b.at) / (a.slope - b.slope);
    let between = if crossing > low && crossing < high { above(crossing) } else { f64::INFINITY };
    above(low).min(above(high)).min(between)
}

/// True if a pull could turn a shaft round that goes forwards, backwards.
fn could_turn((pull, load): (f64, f64)) -> [bool; 2] {
    let least = load / FRICTION_RANGE;
    [-pull > least, pull > least]
}

/// A gap, as it was with one delay.
#[derive(Clone, Debug)]
struct Track {
    /// Pulls and loads of voltages on their way, the newest first.
    line: [(f64, f64); 4],
    delay: usize,
    /// Points of the gap, of which so many are used.
    kept: Box<[Point; ROOM]>,
    used: usize,
    /// Periods from one point to the next, and until the next.
    stride: u64,
    until: u64,
    /// The last sample, and the one before.
    now: Point,
    inner: Point,
    /// Pull and load of the period that entered the count.
    before: (f64, f64),
    acts: (f64, f64),
    /// True if something could turn a shaft round that went forwards, backwards: it pulls harder the other way than the
    /// least friction holds.
    turns: [bool; 2],
}

/// A sample within a gap: what has come together since the gap began, and what acts from here on.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    /// Periods since the beginning.
    time: f64,
    /// Integrals of pull and load, and their integrals.
    pulled: f64,
    loaded: f64,
    pulled_far: f64,
    loaded_far: f64,
    pull: f64,
    load: f64,
}

impl Point {
    /// Velocity gained since the beginning, counts per period.
    fn speed(&self, sign: f64, friction: f64) -> f64 {
        sign * self.pulled - friction * self.loaded
    }

    /// Way that this makes, counts.
    fn way(&self, sign: f64, friction: f64) -> f64 {
        sign * self.pulled_far - friction * self.loaded_far
    }
}

impl Track {
    fn new(delay: u32) -> Self {
        Track {
            line: [(0.0, 0.0); 4],
            delay: (delay as usize).min(3),
            kept: Box::new([Point::default(); ROOM]),
            used: 0,
            stride: 1,
            until: 0,
            now: Point::default(),
            inner: Point::default(),
            before: (0.0, 0.0),
            acts: (0.0, 0.0),
            turns: [false; 2],
        }
    }

    /// Pull and load of the voltage that takes effect now.
    fn arrive(&mut self, given: (f64, f64)) -> (f64, f64) {
        self.line.rotate_right(1);
        self.line[0] = given;
        self.line[self.delay]
    }

    /// The shaft has entered a count.
    fn enter(&mut self) {
        (self.used, self.stride, self.until) = (0, 1, 0);
        self.before = self.acts;
        self.turns = could_turn(self.acts);
        self.now = Point::default();
        self.inner = Point::default();
    }

    /// A period passes.
    fn advance(&mut self, pull: f64, load: f64) {
        self.acts = (pull, load);
        let [forwards, backwards] = could_turn(self.acts);
        self.turns = [self.turns[0] | forwards, self.turns[1] | backwards];
        let x = &mut self.now;
        (x.pull, x.load) = (pull, load);
        self.inner = *x;
        if self.until == 0 {
            self.kept[self.used] = *x;
            self.used += 1;
            if self.used > POINTS {
                for i in 0..self.used.div_ceil(2) {
                    self.kept[i] = self.kept[2 * i];
                }
                self.used = self.used.div_ceil(2);
                self.stride *= 2;
            }
            self.until = self.stride;
        }
        self.until -= 1;
        x.pulled_far += x.pulled + 0.5 * pull;
        x.loaded_far += x.loaded + 0.5 * load;
        x.pulled += pull;
        x.loaded += load;
        x.time += 1.0;
    }

    /// The shaft has left it.
    fn leave(&mut self) {
        self.kept[self.used] = self.now;
        self.used += 1;
    }

    fn points(&self) -> &[Point] {
        &self.kept[..self.used]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_core::PlantParams;
    use clutch_core::law::PdParams;

    /// Samples per count.
    const EVEN: u64 = 36;

    fn meter() -> Meter {
        let plant = Plant::new(&PlantParams::default()).unwrap();
        let law = LawParams::Pd(PdParams::default());
        Meter::new(plant, (&law, &VelocityParams::default()), Encoder::PAPER, Micros(1000))
    }

    /// Gaps of counts that come evenly, 0.5 °/s, with the voltage a function of the period within a count.
    fn even(volts: impl Fn(u64) -> f64) -> Vec<Gap> {
        let mut meter = meter();
        (0..20 * EVEN).filter_map(|k| meter.sample(k, Counts((k / EVEN) as i32), volts(k % EVEN))).collect()
    }

    #[test]
    fn even_edges_under_an_even_voltage_are_a_shaft_that_slides() {
        let hold = Plant::<f64>::new(&PlantParams::default()).unwrap().holding_voltage_sliding();
        for share in [0.5, 1.0, 1.5] {
            let gaps = even(|_| share * hold);
            assert_eq!(gaps.len(), 18);
            assert!(gaps.iter().all(|gap| !gap.sure && !gap.possible), "{share}: {gaps:?}");
        }
    }

    #[test]
    fn even_edges_under_a_voltage_that_swings_are_a_shaft_that_sticks() {
        // A half of the count with a third more, the other with a third less: sliding it would go 20 counts to and fro.
        let hold = Plant::<f64>::new(&PlantParams::default()).unwrap().holding_voltage_sliding();
        let gaps = even(|k| hold * if k < EVEN / 2 { 4.0 / 3.0 } else { 2.0 / 3.0 });
        assert_eq!(gaps.len(), 18);
        assert!(gaps.iter().all(|gap| gap.sure && gap.possible), "{gaps:?}");
    }

    /// [`Meter::slides`] without tangents: all steps of the search.
    fn slides_by_search(meter: &Meter, track: &Track, sign: f64) -> bool {
        let (mut low, mut high) = (1.0 / FRICTION_RANGE, FRICTION_RANGE);
        (0..SEARCH).any(|_| {
            let span = 0.381_966 * (high - low);
            let (left, right) = (low + span, high - span);
            let missing = [left, right].map(|h| meter.missing(track, sign, h).value);
            if missing[0] < missing[1] {
                high = right
            } else {
                low = left
            }
            missing[0] <= 0.0 || missing[1] <= 0.0
        })
    }

    /// [`Meter::stops`] with each friction that there is.
    fn stops_by_search(meter: &Meter, track: &Track, sign: f64) -> bool {
        let mut after = vec![Onwards::default(); ROOM];
        meter.frictions.iter().any(|h| meter.stops_with(*h, track, sign, &mut after).0)
    }

    #[test]
    fn bounds_decide_as_the_whole_search_does() {
        let hold = Plant::<f64>::new(&PlantParams::default()).unwrap().holding_voltage_sliding();
        let mut seed = 3_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut slid, mut stopped) = ([0, 0], [0, 0]);
        for _ in 0..4000 {
            let mut meter = meter();
            meter.sample(0, Counts(0), hold);
            meter.sample(1, Counts(1), hold);
            // Braked, then let go, with a little noise: some such shafts slid, some stuck.
            let (periods, swing) = (2 + (40.0 * random()) as u64, random());
            let turn = 2 + (periods as f64 * random()) as u64;
            for k in 2..2 + periods {
                let share = if k < turn { swing } else { -swing } + 0.1 * random();
                meter.sample(k, Counts(1), hold * (1.0 + share));
            }
            meter.tracks.iter_mut().for_each(Track::leave);
            let mut after = std::mem::take(&mut meter.scratch);
            for track in &meter.tracks {
                let (slides, stops) = (meter.slides(track, 1.0), meter.stops(track, 1.0, &mut after));
                assert_eq!(slides, slides_by_search(&meter, track, 1.0), "{track:?}");
                assert_eq!(stops, stops_by_search(&meter, track, 1.0), "{track:?}");
                slid[usize::from(slides)] += 1;
                stopped[usize::from(stops)] += 1;
            }
        }
        assert!(slid[0] > 400 && slid[1] > 400, "{slid:?}");
        assert!(stopped[0] > 400 && stopped[1] > 400, "{stopped:?}");
    }

    #[test]
    fn a_gap_with_a_lost_sample_or_a_turn_can_hold_a_stick_and_need_not() {
        let mut meter = meter();
        let ticks = (0..3 * EVEN).filter(|k| *k != EVEN + 5);
        let gaps: Vec<Gap> = ticks.filter_map(|k| meter.sample(k, Counts((k / EVEN) as i32), 2.24)).collect();
        assert_eq!(gaps, [Gap { begin: EVEN, end: 2 * EVEN, sure: false, possible: true }]);

        let turned = meter.sample(3 * EVEN, Counts(1), 2.24);
        assert_eq!(turned, Some(Gap { begin: 2 * EVEN, end: 3 * EVEN, sure: false, possible: true }));
    }

    #[test]
    fn a_long_gap_keeps_some_of_its_points_and_is_judged_alike() {
        let mut meter = meter();
        let mut gaps = Vec::new();
        for k in 0..40_000_u64 {
            // A count in 10 s; the voltage swings once in it.
            let volts = if k % 10_000 < 5_000 { 3.0 } else { 1.5 };
            gaps.extend(meter.sample(k, Counts((k / 10_000) as i32), volts));
        }
        assert_eq!(gaps.len(), 2);
        assert!(gaps.iter().all(|gap| gap.sure), "{gaps:?}");
    }

    #[test]
    fn what_began_before_the_first_sample_that_counts_is_not_sure_to_be_after_it() {
        let gap = Gap { begin: 5, end: 20, sure: true, possible: true };
        let mut tally = Tally::default();
        for from in [5, 6, 21] {
            tally.take(&gap, from);
        }
        assert_eq!(tally, Tally { least: 1, most: 2 });
    }
}
