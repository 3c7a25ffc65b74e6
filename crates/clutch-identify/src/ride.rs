//! Mean friction, its ripple along the disc, and C/J, from rides at even rates.
//!
//! A shaft that moves evenly at `v` says `1 = (h + r) u + (c/g) v` with `h = μ_d K/T`, `g` = T/J and `c = C_d/J`, so that a
//! ride gives `1/h_v = (1/h) (1 − (c/g) v)`: a straight line over the rates, whose value at 0 is `v_hold = 1/h` and whose slope
//! gives C/J.

use crate::confidence::FALL;
use crate::filter::{Belief, Passed, Shaft, Spread, smooth};
use crate::profile::spaced;
use crate::recording::Recording;

/// Longest silence in a ride, times the median time between edges.
const LONGEST_SILENCE: f64 = 6.0;

/// Conditions of a ride.
struct Conditions {
    /// Time behind its first edge at which the even part begins, and what that takes at least, s.
    settling_s: f64,
    shortest_s: f64,
    /// Way of the even part at least, rad.
    shortest_rad: f64,
    /// Way of its first half over that of its second.
    halves: (f64, f64),
}

const RIDE: Conditions =
    Conditions { settling_s: 0.5, shortest_s: 1.0, shortest_rad: 0.17, halves: (0.9, 1.1) };
/// The same of a motor, which goes to and fro: its passes are short, and its law is stiff.
const PASS: Conditions =
    Conditions { settling_s: 0.15, shortest_s: 0.1, shortest_rad: 0.05, halves: (0.9, 1.1) };
/// Motion between two sticks, uneven as it is.
const STRETCH: Conditions =
    Conditions { settling_s: 0.1, shortest_s: 0.2, shortest_rad: 0.02, halves: (0.5, 2.0) };
/// Waves per turn that a ripple is taken to have where rides do not show them: those that the law glide believes.
pub(crate) const WAVES_PER_TURN: f64 = 340.0;
/// Waves that are looked for: the fewest, the counts that one has at least, and how many to a factor of two.
const FEWEST_WAVES: f64 = 12.0;
const COUNTS_PER_WAVE: f64 = 12.0;
const TO_THE_OCTAVE: f64 = 4.0;
/// Sizes with which they are looked for, as a share.
const SHARES: [f64; 4] = [0.02, 0.05, 0.1, 0.17];
/// Damping of the waves: a wide band, as the law glide believes.
pub const WAVE_DAMPING: f64 = 0.25;
/// Wander of the velocity that no friction explains, rad/s/√s.
pub const WALK: f64 = 0.01;
/// The same two for a map, whose places are found one by one and not in the mean.
const MAP_WAVE_DAMPING: f64 = 0.2;
const MAP_WALK: f64 = 0.02;
/// Time at the beginning of a ride, with its break-away, that a map leaves out, s.
const MAP_SETTLING_S: f64 = 0.25;
/// Times that the ripple's size is estimated, and what it is taken to be before.
const ROUNDS: usize = 8;
const FIRST_SHARE: f64 = 0.15;
/// The rest of a ripple in the mean over a way, as a multiple of its size over the wave's radians of that way.
const LEFT_OVER: f64 = 2.0;
/// Part of the unseen ripple that the volts go with.
const UNSEEN: f64 = 0.5;
/// Points of a map per turn: of the waves of a disc, each has fifteen.
const PER_TURN: f64 = 5000.0;
/// Sections of a turn, of which each has some ten waves of a ripple and more.
const SECTIONS: f64 = 12.0;
/// Share by which the mean of a ride is off for other reasons: delay and T/J as known, steps of the converter.
const CLOCKWORK: f64 = 3e-4;

/// A ride at an even rate.
#[derive(Clone, Debug)]
pub struct Ride<'a> {
    pub(crate) recording: &'a Recording,
    /// First and last tick of the even part, of the recording.
    pub(crate) ticks: (usize, usize),
    /// Tick at which a map begins.
    first: usize,
    /// Rate, rad/s.
    pub rate: f64,
}

/// A place of the disc and its friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Angle, rad, from the encoder's zero.
    pub angle: f64,
    /// Friction there, over its mean.
    pub factor: f64,
}

/// Findings of a ride.
#[derive(Clone, Debug)]
pub struct Told {
    /// Rate, rad/s.
    pub rate: f64,
    /// `1/h_v` of a brake, friction of a motor, V, and its standard deviation.
    pub hold: (f64, f64),
    /// Root mean square of the ripple, as a share of friction, and its standard deviation.
    pub ripple: (f64, f64),
    /// Waves of the ripple per turn, as known, and if rides show them.
    pub waves: Waves,
    /// Friction along the way, but for its very beginning.
    pub map: Vec<Place>,
    /// Mean friction of each whole section of a turn, one behind the other, 1/V or V.
    pub sections: Vec<f64>,
    /// Its lowest velocity, as a share of its rate; of a motor's pass that of its end, where the law brakes.
    pub slowest: f64,
    /// The most that friction departs from its mean, as a share, while the ride is even.
    pub uneven: f64,
    /// Recording, tick and normalised innovation of the edge that fits worst.
    pub worst: (String, u64, f64),
}

/// The share that a ripple leaves in the mean over a stretch, which does not hold whole waves; radians of the wave.
pub(crate) fn left_over(ripple: f64, radians: f64) -> f64 {
    LEFT_OVER * ripple / radians.max(1.0)
}

/// The same of a section.
pub(crate) fn section_rest(ripple: f64, waves: f64) -> f64 {
    left_over(ripple, waves * core::f64::consts::TAU / SECTIONS)
}

/// Waves of a ripple.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waves {
    /// Waves per turn.
    pub per_turn: f64,
    /// `true` if rides show them; else they are those that are taken unseen.
    pub seen: bool,
}

/// Waves per turn of the ripple that makes the edges of rides likeliest; those that are taken unseen where no others are
/// clearly likelier. For T/J (rad/s², of a motor K/J) and delay (s) as known.
#[must_use]
pub(crate) fn waves(rides: &[&Ride<'_>], pull: f64, delay: f64) -> Waves {
    let Some(first) = rides.first() else { return Waves { per_turn: WAVES_PER_TURN, seen: false } };
    let density = |waves: f64| -> f64 {
        let with = |share: f64| -> f64 {
            let each = rides.iter().map(|ride| {
                let friction = ride.rough();
                let shaft = shaft(ride.recording, pull, 0.0, share * friction, waves);
                ride.density(&shaft, delay, friction, 0.0)
            });
            each.sum()
        };
        SHARES.map(with).into_iter().fold(f64::NEG_INFINITY, f64::max)
    };
    let most = f64::from(first.recording.counts_per_rev) / COUNTS_PER_WAVE;
    let unseen = WAVES_PER_TURN.min(most);
    let number = (TO_THE_OCTAVE * (most / FEWEST_WAVES).log2()).ceil().max(0.0) as usize + 2;
    let best = spaced(FEWEST_WAVES, most.max(2.0 * FEWEST_WAVES), number)
        .map(|per_turn| (Waves { per_turn, seen: true }, density(per_turn)))
        .fold((Waves { per_turn: unseen, seen: false }, density(unseen) + FALL), |best, next| {
            if next.1 > best.1 { next } else { best }
        });
    best.0
}

/// The rides in a recording.
#[must_use]
pub fn rides(recording: &Recording) -> Vec<Ride<'_>> {
    stretches(recording, if recording.motor { &PASS } else { &RIDE })
}

/// Stretches of motion without a stick, even or not.
pub(crate) fn uneven(recording: &Recording) -> Vec<Ride<'_>> {
    stretches(recording, &STRETCH)
}

fn stretches<'a>(recording: &'a Recording, conditions: &Conditions) -> Vec<Ride<'a>> {
    let ticks = &recording.ticks;
    let edges: Vec<usize> = (1..ticks.len()).filter(|&i| ticks[i].counts > ticks[i - 1].counts).collect();
    if edges.len() < 20 {
        return Vec::new();
    }
    let mut gaps: Vec<usize> = edges.windows(2).map(|w| w[1] - w[0]).collect();
    gaps.sort_unstable();
    let longest = LONGEST_SILENCE * gaps[gaps.len() / 2] as f64;
    let Conditions { settling_s: settling, shortest_s, shortest_rad, halves: (least, most) } = *conditions;
    let mut found = Vec::new();
    let mut first = 0;
    for k in 1..=edges.len() {
        if k < edges.len() && ((edges[k] - edges[k - 1]) as f64) <= longest {
            continue;
        }
        let mapped_from = edges[first] + (MAP_SETTLING_S.min(settling) / recording.period) as usize;
        let begin = edges[first] + (settling / recording.period) as usize;
        let begin = edges[first..k].iter().copied().find(|&e| e >= begin);
        let end = edges[k - 1];
        first = k;
        let Some(begin) = begin else { continue };
        let seconds = end.saturating_sub(begin) as f64 * recording.period;
        let way =
            |a: usize, b: usize| (ticks[b].counts - ticks[a].counts) as f64 * recording.radians_per_count();
        if seconds < shortest_s || way(begin, end) < shortest_rad {
            continue;
        }
        let middle = begin.midpoint(end);
        let halves = way(begin, middle) / way(middle, end).max(1e-9);
        if (least..most).contains(&halves) {
            let rate = way(begin, end) / seconds;
            found.push(Ride { recording, ticks: (begin, end), first: mapped_from, rate });
        }
    }
    found
}

/// The shaft in counts and periods; `damping` in 1/s, `ripple` in 1/V, `waves` of it per turn.
#[must_use]
pub fn shaft(recording: &Recording, pull: f64, damping: f64, ripple: f64, waves: f64) -> Shaft {
    shaft_with(recording, pull, damping, (ripple, waves), (WAVE_DAMPING, WALK))
}

fn shaft_with(
    recording: &Recording,
    pull: f64,
    damping: f64,
    (ripple, waves): (f64, f64),
    (wave_damping, walk): (f64, f64),
) -> Shaft {
    let walk = walk * recording.period.sqrt() * recording.period / recording.radians_per_count();
    Shaft {
        pull: pull * recording.per_rad_s2(),
        motor: recording.motor,
        damping: damping * recording.period,
        wave: waves * recording.radians_per_count(),
        wave_damping,
        ripple,
        walk: walk * walk,
    }
}

impl Ride<'_> {
    /// Friction as the mean voltage has it, V or 1/V.
    fn rough(&self) -> f64 {
        let (begin, end) = self.ticks;
        let ticks = &self.recording.ticks[begin..end];
        let volts = ticks.iter().map(|tick| tick.volts).sum::<f64>() / (end - begin) as f64;
        if self.recording.motor { volts.max(1e-6) } else { 1.0 / volts.max(1e-6) }
    }

    /// Root mean square by which its volts depart from their mean, as a share.
    fn volts_vary(&self) -> f64 {
        let ticks = &self.recording.ticks[self.ticks.0..self.ticks.1];
        let n = ticks.len() as f64;
        let mean = ticks.iter().map(|tick| tick.volts).sum::<f64>() / n;
        let square = ticks.iter().map(|tick| (tick.volts - mean).powi(2)).sum::<f64>() / n;
        square.sqrt() / mean.abs().max(1e-6)
    }

    /// Friction along the way, for T/J (rad/s²), delay (s) and the waves of the ripple as known. Damping is left in friction: see
    /// the head of this file. `share`: the ripple's size as a share of friction, or none, if this ride is to find it.
    #[must_use]
    pub fn told(&self, pull: f64, delay: f64, waves: Waves, share: Option<f64>) -> Told {
        let r = self.recording;
        let begin = self.ticks.0;
        let motor = r.motor;
        let mut friction = self.rough();
        let mut size = share.unwrap_or(FIRST_SHARE);
        let rounds = if share.is_some() { 1 } else { ROUNDS };
        let mut worst = (begin, 0.0);
        let mut beliefs = Vec::new();
        for round in 0..rounds {
            let shaft = shaft(r, pull, 0.0, size * friction, waves.per_turn);
            let (passed, surprise) = self.pass(begin, &shaft, delay / r.period, friction);
            beliefs = smooth(&passed);
            worst = surprise;
            friction = beliefs[beliefs.len() - 1].mean[2];
            if round + 1 < rounds {
                // Expectation of r² along the way: what is seen of it, and what is not.
                let sums = beliefs.iter().fold((0.0, 0.0), |(way, square), b| {
                    let v = b.mean[1].max(0.0);
                    (way + v, square + v * (b.mean[3] * b.mean[3] + b.spread[(3, 3)]))
                });
                size = (sums.1 / sums.0).clamp(1e-6, 1.0).sqrt() / friction;
            }
        }
        // Mean over the way of what friction was.
        let sums = beliefs.iter().fold((0.0, 0.0), |(way, sum), b| {
            let v = b.mean[1].max(0.0);
            (way + v, sum + v * (b.mean[2] + b.mean[3]))
        });
        let hold = if motor { sums.1 / sums.0 } else { sums.0 / sums.1 };
        let radians = waves.per_turn * self.way();
        let uneven = left_over(size, radians);
        // `h ū + (mean of r u)` is 1: what the filter does not see of a ripple that the volts follow is taken for friction. A
        // motor's friction does not act through the volts.
        let unseen_square = beliefs.iter().fold(0.0, |sum, b| sum + b.mean[1].max(0.0) * b.spread[(3, 3)]);
        let follow = if motor { 0.0 } else { UNSEEN * self.volts_vary() };
        let unseen = follow * unseen_square / (sums.0 * size * friction * friction);
        let slowest = beliefs.iter().map(|b| b.mean[1]).fold(f64::INFINITY, f64::min);
        Told {
            rate: self.rate,
            slowest: slowest * r.radians_per_count() / (r.period * self.rate),
            sections: self.sections(&beliefs),
            hold: (hold, hold * (uneven * uneven + unseen * unseen + CLOCKWORK * CLOCKWORK).sqrt()),
            // Independent places: one for two radians of the wave.
            ripple: (size, size / (0.5 * radians).max(1.0).sqrt()),
            waves,
            uneven: beliefs.iter().map(|b| (b.mean[3] / b.mean[2]).abs()).fold(0.0, f64::max),
            map: self.map(
                &shaft_with(r, pull, 0.0, (size * friction, waves.per_turn), (MAP_WAVE_DAMPING, MAP_WALK)),
                delay / r.period,
                friction,
            ),
            worst: (r.name.clone(), r.first_tick + worst.0 as u64, worst.1),
        }
    }

    /// Way of the even part, rad.
    pub(crate) fn way(&self) -> f64 {
        let (begin, end) = self.ticks;
        (self.recording.ticks[end].counts - self.recording.ticks[begin].counts) as f64
            * self.recording.radians_per_count()
    }

    /// Mean friction of each whole section of the way.
    fn sections(&self, beliefs: &[Belief]) -> Vec<f64> {
        let length = f64::from(self.recording.counts_per_rev) / SECTIONS;
        let mut means = Vec::new();
        let (mut begun, mut sums) = (beliefs[0].mean[0], (0.0, 0.0));
        for belief in beliefs {
            let way = belief.mean[1].max(0.0);
            sums = (sums.0 + way, sums.1 + way * (belief.mean[2] + belief.mean[3]));
            if belief.mean[0] - begun >= length {
                means.push(sums.1 / sums.0);
                (begun, sums) = (belief.mean[0], (0.0, 0.0));
            }
        }
        means
    }

    /// The filter along the ride: as [`smooth`] takes it, and the tick with the largest normalised innovation.
    fn pass(&self, begin: usize, shaft: &Shaft, delay: f64, friction: f64) -> (Vec<Passed>, (usize, f64)) {
        let r = self.recording;
        let end = self.ticks.1;
        let origin = r.ticks[begin].counts;
        let rate = self.rate * r.period / r.radians_per_count();
        let mut belief = Belief::new(shaft, 0.5, (rate, rate), (friction, 0.5 * friction));
        let mut out = vec![(belief, belief, Spread::identity())];
        let mut worst = (begin, 0.0);
        for i in begin..end {
            let f = belief.advance(shaft, r.at_pad(i, (0.0, 1.0), delay), 1.0);
            let predicted = belief;
            let (before, now) = (r.ticks[i].counts, r.ticks[i + 1].counts);
            if now > before {
                let surprise = belief.cross((now - origin) as f64, 0.5 * rate).square;
                // The first edges show where it is.
                if i > begin + 100 && surprise > worst.1 {
                    worst = (i + 1, surprise);
                }
            }
            out.push((belief, predicted, f));
        }
        (out, (worst.0, f64::sqrt(worst.1)))
    }

    /// Logarithm of the density of the edges, with friction known within a half, where a voltage takes effect over a way, rad.
    #[must_use]
    pub fn density(&self, shaft: &Shaft, delay: f64, friction: f64, over: f64) -> f64 {
        let r = self.recording;
        let (begin, end) = self.ticks;
        let origin = r.ticks[begin].counts;
        let rate = self.rate * r.period / r.radians_per_count();
        let mut belief = Belief::new(shaft, 0.5, (rate, rate), (friction, 0.5 * friction));
        let mut acts = r.ticks[begin].volts;
        let mut log = 0.0;
        for i in begin..end {
            let volts = r.at_pad(i, (0.0, 1.0), delay / r.period);
            let way = belief.mean[1].max(0.0) * r.radians_per_count();
            let left = if over > 0.0 { libm::exp(-way / over) } else { 0.0 };
            acts = volts + (acts - volts) * left;
            belief.advance(shaft, acts, 1.0);
            let (before, now) = (r.ticks[i].counts, r.ticks[i + 1].counts);
            if now > before {
                log += belief.cross((now - origin) as f64, 0.5 * rate).density;
            }
        }
        log
    }

    /// Friction each [`PER_TURN`]th of a turn, where the shaft has been.
    fn map(&self, shaft: &Shaft, delay: f64, friction: f64) -> Vec<Place> {
        let r = self.recording;
        let origin = r.ticks[self.first].counts as f64;
        let (passed, _) = self.pass(self.first, shaft, delay, friction);
        let beliefs = smooth(&passed);
        let counts = |belief: &Belief| origin + belief.mean[0];
        let factor = |belief: &Belief| 1.0 + belief.mean[3] / belief.mean[2];
        let step = (f64::from(r.counts_per_rev) / PER_TURN).round().max(1.0);
        let mut map = Vec::new();
        let mut next = (counts(&beliefs[0]) / step).ceil() * step;
        for pair in beliefs.windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            // Between two samples, of which a fast shaft makes several points.
            while counts(b) >= next {
                let way = counts(b) - counts(a);
                let share = if way > 0.0 { ((next - counts(a)) / way).clamp(0.0, 1.0) } else { 1.0 };
                let factor = factor(a) + share * (factor(b) - factor(a));
                map.push(Place { angle: next * r.radians_per_count(), factor });
                next += step;
            }
        }
        map
    }
}
