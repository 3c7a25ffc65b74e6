//! Duties of a path to its shaft, checked from outside: through [`Reference`] only.

use super::*;
use proptest::prelude::*;
use std::vec::Vec;

const MS: Micros = Micros(1000);
/// One unit of a fixed-point position, counts.
const UNIT: f64 = 1.0 / 65_536.0;
/// No target rests on more than this many roundings to a unit.
const ROUNDINGS: f64 = 20.0;

fn rad_per_count() -> f64 {
    Encoder::PAPER.radians_per_count()
}

fn path<'a, T: Real>(p: &ReferenceParams<'a, T>) -> Reference<'a, T> {
    Reference::new(p, FixedCounts(0), Encoder::PAPER, MS).unwrap()
}

/// Counts at a tick.
fn counts<T: Real>(r: &Reference<'_, T>, tick: u64) -> f64 {
    r.at(tick).position.minus(FixedCounts(0))
}

/// The angle at a tick, rad.
fn angle(r: &Reference<'_, f64>, tick: u64) -> f64 {
    counts(r, tick) * rad_per_count()
}

fn trapezoid(distance: f64, speed: f64, acceleration: f64) -> ReferenceParams<'static> {
    ReferenceParams::Trapezoid(Trapezoid { distance, speed, acceleration })
}

fn jerk_limited(distance: f64, speed: f64, acceleration: f64, jerk: f64) -> ReferenceParams<'static> {
    ReferenceParams::JerkLimited(JerkLimited { distance, speed, acceleration, jerk })
}

fn minimum_jerk(distance: f64, duration: f64) -> ReferenceParams<'static> {
    ReferenceParams::MinimumJerk(MinimumJerk { distance, duration })
}

const SINE: Sine = Sine { rate: 0.05, amplitude: 0.1, frequency: 1.0, phase: -0.25 };
const CHIRP: Chirp = Chirp { rate: 0.05, amplitude: 0.05, from: 0.5, to: 8.0, duration: 20.0, phase: 0.125 };

fn knot(time_us: u64, counts: i64) -> Knot {
    Knot { time_us, position: FixedCounts::from_counts(counts) }
}

fn table(knots: &[Knot], interpolation: Interpolation) -> ReferenceParams<'_> {
    ReferenceParams::Table(Table { knots, interpolation })
}

/// A table that rises, rests, rises and falls.
fn hill() -> [Knot; 6] {
    [
        knot(0, 0),
        knot(100_000, 40),
        knot(250_000, 300),
        knot(400_000, 300),
        knot(500_000, 900),
        knot(800_500, 100),
    ]
}

/// The first tick from which a rest-to-rest path rests for good.
fn first_tick_at_rest(r: &Reference<'_, f64>) -> u64 {
    let end = r.at(u64::MAX);
    let (mut moving, mut resting) = (0, 1 << 40);
    while resting - moving > 1 {
        let middle = (moving + resting) / 2;
        if r.at(middle) == end { resting = middle } else { moving = middle }
    }
    resting
}

/// Velocity and acceleration are the central differences of position and velocity.
///
/// By Taylor's theorem the difference of the position over two periods is off by at most half a
/// period times the oscillation of the acceleration between them, whatever the acceleration
/// does; and the difference of the velocity lies between the least and the largest
/// acceleration. The samples see the oscillation but for `jerk` · period.
fn derivatives_agree(r: &Reference<'_, f64>, ticks: impl Iterator<Item = u64>, jerk: f64) {
    let t = 1e-3;
    for k in ticks {
        let (before, now, after) = (r.at(k - 1), r.at(k), r.at(k + 1));
        let all = [before, now, after].map(|p| p.acceleration);
        let least = all.into_iter().fold(f64::INFINITY, f64::min) - jerk * t;
        let most = all.into_iter().fold(f64::NEG_INFINITY, f64::max) + jerk * t;
        let velocity = (angle(r, k + 1) - angle(r, k - 1)) / (2.0 * t);
        let rounding = ROUNDINGS * UNIT * rad_per_count() / (2.0 * t);
        let off = (velocity - now.velocity).abs();
        assert!(off <= 0.5 * t * (most - least) + rounding, "tick {k}: velocity off by {off} rad/s");
        let acceleration = (after.velocity - before.velocity) / (2.0 * t);
        let rounding = 1e-9 * (1.0 + now.velocity.abs()) / t;
        assert!(
            acceleration >= least - rounding && acceleration <= most + rounding,
            "tick {k}: {acceleration} rad/s², not {least} to {most}"
        );
    }
}

/// A rest-to-rest path keeps its bounds, never turns back and arrives; `jerk` is infinite where
/// the acceleration may jump.
fn keeps_its_bounds(p: &ReferenceParams<'_>, distance: f64, speed: f64, acceleration: f64, jerk: f64) {
    let r = path(p);
    let (t, end) = (1e-3, first_tick_at_rest(&r));
    let goal = FixedCounts::from_real(distance / rad_per_count());
    assert_eq!(r.at(0).position, FixedCounts(0));
    for tick in [end, end + 1, u64::MAX] {
        let there = Target { position: r.at(tick).position, velocity: 0.0, acceleration: 0.0 };
        assert_eq!(r.at(tick), there);
        let off = r.at(tick).position.0 - goal.0;
        assert!(off.abs() <= 1, "off the distance by {off} units"); // rad to counts and back
    }
    let way = distance.signum();
    let step = (end / 3000).max(1);
    for k in (1..end).step_by(step as usize).chain(end.saturating_sub(5).max(1)..end + 2) {
        let (before, now) = (r.at(k - 1), r.at(k));
        assert!(now.velocity * way >= -1e-9 * speed, "tick {k}: back at {} rad/s", now.velocity);
        assert!(now.velocity.abs() <= speed * (1.0 + 1e-9), "tick {k}: {} rad/s", now.velocity);
        assert!(
            now.acceleration.abs() <= acceleration * (1.0 + 1e-9),
            "tick {k}: {} rad/s²",
            now.acceleration
        );
        let moved = (angle(&r, k) - angle(&r, k - 1)) * way;
        // The rate is a multiple of 2⁻⁴⁰ counts per tick; the last step makes up for the rest.
        let rounding = (ROUNDINGS * UNIT + end as f64 * 2.0_f64.powi(-41)) * rad_per_count();
        assert!(moved >= -rounding && moved <= speed * t + rounding, "tick {k}: moved {moved} rad");
        let change = (now.acceleration - before.acceleration).abs();
        assert!(change <= jerk * t * (1.0 + 1e-9) + 1e-9 * acceleration, "tick {k}: jerk {}", change / t);
    }
}

/// Time and distance to a peak speed and back to rest: the definition of the shortest move.
fn there_and_back(peak: f64, a: f64, j: f64) -> (f64, f64) {
    let rise = if peak >= a * a / j { peak / a + a / j } else { 2.0 * (peak / j).sqrt() };
    (2.0 * rise, peak * rise)
}

/// The shortest time of a jerk-limited move, by bisection for the peak speed.
fn shortest_time(length: f64, v: f64, a: f64, j: f64) -> f64 {
    let (mut low, mut high) = (0.0, v);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if there_and_back(middle, a, j).1 <= length { low = middle } else { high = middle }
    }
    let (time, covered) = there_and_back(low, a, j);
    time + (length - covered) / low
}

#[test]
fn every_path_begins_at_its_start() {
    let knots = hill();
    let start = FixedCounts::from_counts(123_456_789);
    for p in [
        ReferenceParams::Hold,
        ReferenceParams::ramp(-0.3),
        trapezoid(-1.0, 0.5, 2.0),
        jerk_limited(1.0, 0.5, 2.0, 20.0),
        minimum_jerk(1.0, 2.0),
        ReferenceParams::Sine(SINE),
        ReferenceParams::Chirp(CHIRP),
        table(&knots, Interpolation::Linear),
        table(&knots, Interpolation::Cubic),
    ] {
        let r = Reference::new(&p, start, Encoder::PAPER, MS).unwrap();
        assert_eq!(r.at(0).position, start, "{p:?}");
    }
    assert_eq!(path(&ReferenceParams::<f64>::Hold).at(u64::MAX), Target::default());
}

#[test]
fn velocity_and_acceleration_are_the_derivatives_of_the_position() {
    let knots = hill();
    for (p, ticks, jerk) in [
        (ReferenceParams::ramp(0.3), 5000, 0.0),
        (trapezoid(-1.0, 0.5, 2.0), 2400, 0.0),
        (jerk_limited(1.0, 0.5, 2.0, 20.0), 2700, 0.0),
        (minimum_jerk(-1.0, 2.0), 2100, 30.0),
        (ReferenceParams::Sine(SINE), 5000, 0.1 * 6.3 * 6.3 * 6.3),
        // Past the end of the sweep too. (2π 8)³ · 0.05 rad.
        (ReferenceParams::Chirp(CHIRP), 25_000, 6400.0),
        (table(&knots, Interpolation::Linear), 900, 0.0),
        (table(&knots, Interpolation::Cubic), 900, 0.0),
    ] {
        let r = path(&p);
        // The velocity of straight lines jumps at their knots, one of which lies between ticks.
        let corner = |k: &u64| {
            matches!(p, ReferenceParams::Table(Table { interpolation: Interpolation::Linear, .. }))
                && knots.iter().any(|n| n.time_us.abs_diff(k * 1000) <= 1000)
        };
        derivatives_agree(&r, (1..ticks).filter(|k| !corner(k)), jerk);
    }
}

#[test]
fn phases_shorter_than_a_tick_do_no_harm() {
    // An acceleration or a jerk that somebody set beyond measure to be rid of its phase.
    for a in [1e3, 1e6, 1e12, 1e24, 1e100] {
        keeps_its_bounds(&trapezoid(1.0, 0.5, a), 1.0, 0.5, a, f64::INFINITY);
        keeps_its_bounds(&jerk_limited(-1.0, 0.5, 2.0, a), -1.0, 0.5, 2.0, f64::INFINITY);
        keeps_its_bounds(&jerk_limited(1.0, 0.5, a, a), 1.0, 0.5, a, f64::INFINITY);
        let r = path(&trapezoid(1.0, 0.5, a));
        let expected = 0.5 * 0.7 - if a < 1e4 { 0.5 * 0.5 * 0.5 / a } else { 0.0 };
        assert!((angle(&r, 700) - expected).abs() < 2e-7, "{a}: {} rad", angle(&r, 700));
        let single = Trapezoid { distance: 1.0_f32, speed: 0.5, acceleration: a as f32 };
        if single.acceleration.is_finite() {
            let off = counts(&path(&ReferenceParams::Trapezoid(single)), 700) - counts(&r, 700);
            assert!(off.abs() < 0.01, "{a}: f32 is off by {off} counts");
        }
    }
    // A whole move between two ticks.
    keeps_its_bounds(&jerk_limited(1e-4, 1.0, 1e4, 1e8), 1e-4, 1.0, 1e4, f64::INFINITY);
    // No move at all.
    keeps_its_bounds(&jerk_limited(0.0, 1.0, 1.0, 1.0), 0.0, 1.0, 1.0, 1.0);
    keeps_its_bounds(&trapezoid(0.0, 1.0, 1.0), 0.0, 1.0, 1.0, f64::INFINITY);
}

#[test]
fn a_minimum_jerk_path_is_the_polynomial_of_flash_and_hogan() {
    let r = path(&minimum_jerk(-2.0, 3.0));
    for k in 0..=3000_u64 {
        let s = k as f64 / 3000.0;
        let expected = -2.0 * s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
        assert!((angle(&r, k) - expected).abs() < 2.0 * UNIT * rad_per_count() + 1e-14, "tick {k}");
    }
    assert_eq!(first_tick_at_rest(&r), 3000);
    // The middle is the fastest, with 15/8 of the mean rate.
    assert!((r.at(1500).velocity + 1.875 * 2.0 / 3.0).abs() < 1e-12);
}

#[test]
fn a_ramp_is_exact_after_30_days() {
    // 2 °/s are a ninth of a count per millisecond.
    let r = path(&ReferenceParams::ramp(2.0_f64.to_radians()));
    let days_30 = 30 * 86_400_000_u64;
    // The fixed-point rate, read off where it cannot hide: after 2⁴⁰ ticks.
    let rate = i128::from(r.at(1 << 40).position.0) >> 16; // 2⁻⁴⁰ counts per tick
    for tick in [0, 1, 8, 9, 1000, 86_400_000, days_30 - 1, days_30, days_30 + 9] {
        let exact = (rate * i128::from(tick)) >> 24;
        assert_eq!(i128::from(r.at(tick).position.0), exact, "tick {tick}");
    }
    // The rate itself is rounded to 2⁻⁴⁰ counts per tick.
    assert_eq!(rate, ((1_i128 << 40) + 4) / 9);
    let off = r.at(days_30).position.0 - FixedCounts::from_counts(288_000_000).0;
    assert!((off as f64 * UNIT).abs() < 0.0012, "off by {off} units");
}

#[test]
fn a_chirp_ends_at_its_frequency_with_a_continuous_phase() {
    let down = Chirp { from: 8.0, to: 0.5, ..CHIRP };
    for p in [CHIRP, down, Chirp { duration: 0.3, ..CHIRP }, Chirp { to: 0.5, ..CHIRP }] {
        let r = path(&ReferenceParams::Chirp(p));
        let rise = (p.to - p.from) / p.duration;
        let at_end = p.from * p.duration + 0.5 * rise * p.duration * p.duration;
        for k in 0..40_000_u64 {
            let t = k as f64 * 1e-3;
            let (turns, frequency) = if t < p.duration {
                (p.from * t + 0.5 * rise * t * t, p.from + rise * t)
            } else {
                (at_end + p.to * (t - p.duration), p.to)
            };
            let (phase, tau) = (turns + p.phase, core::f64::consts::TAU);
            let wave = libm::sin(tau * phase) - libm::sin(tau * p.phase);
            let off = angle(&r, k) - (p.rate * t + p.amplitude * wave);
            assert!(off.abs() < 3.0 * UNIT * rad_per_count() + 1e-11, "tick {k}: off by {off} rad");
            let velocity = p.rate + p.amplitude * tau * frequency * libm::cos(tau * phase);
            assert!((r.at(k).velocity - velocity).abs() < 1e-9, "tick {k}");
        }
    }
}

#[test]
fn a_sine_does_not_drift_in_a_billion_ticks() {
    let p = Sine { rate: 0.0, amplitude: 0.1, frequency: 1.0, phase: 0.0 };
    let r = path(&ReferenceParams::Sine(p));
    for tick in [0, 125, 250, 333, 999] {
        let (early, late) = (r.at(tick), r.at(1_000_000_000 + tick));
        let exact = 0.1 * libm::sin(core::f64::consts::TAU * tick as f64 / 1000.0);
        // A million turns of a frequency with 53 bits: 1e-9 rad of phase.
        assert!((early.position.0 - late.position.0).abs() <= 1, "tick {tick}");
        assert!((angle(&r, 1_000_000_000 + tick) - exact).abs() < 2.0 * UNIT * rad_per_count());
        assert!((late.velocity - early.velocity).abs() < 1e-8);
    }
}

#[test]
fn a_table_passes_through_its_points_and_rests_before_and_after() {
    let knots = [knot(5000, 7), knot(6000, 8), knot(10_000, -20), knot(20_000, 3_000_000_000)];
    for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
        let r = path(&table(&knots, interpolation));
        for k in knots {
            assert_eq!(r.at(k.time_us / 1000).position, k.position);
        }
        let resting = |p: FixedCounts| Target { position: p, velocity: 0.0, acceleration: 0.0 };
        assert_eq!(r.at(0), resting(knots[0].position));
        assert_eq!(r.at(4), resting(knots[0].position));
        assert_eq!(r.at(20), resting(knots[3].position));
        assert_eq!(r.at(u64::MAX), resting(knots[3].position));
    }
    // A single point is a place to stay.
    let r = path(&table(&knots[..1], Interpolation::Cubic));
    assert_eq!((r.at(0).position, r.at(9).position), (knots[0].position, knots[0].position));
}

#[test]
fn a_cubic_table_has_the_slopes_of_fritsch_and_butland() {
    // Brodlie's weights, as in PCHIM of SLATEC: between slopes of 1000 and 4000 counts/s over
    // 10 and 30 ms: (70 + 50)/(70/1000 + 50/4000) counts/s; at an extremum 0.
    let knots = [knot(0, 0), knot(10_000, 10), knot(40_000, 130), knot(50_000, 100)];
    let r = path(&table(&knots, Interpolation::Cubic));
    let expected = 120.0 / (0.07 + 0.0125) * rad_per_count();
    assert!((r.at(10).velocity - expected).abs() < 1e-12, "{}", r.at(10).velocity);
    assert_eq!(r.at(40).velocity, 0.0);
    assert_eq!(r.at(0).velocity, 0.0);
}

#[test]
fn f32_agrees_with_f64() {
    let knots = hill();
    let long = [knot(0, 0), knot(1_000_000_000, 20_000_000)]; // 1000 turns in 1000 s
    // Tolerance: 2e-6 of the way. Measured: 1e-7 for ramps and profiles, 1e-6 for minimum jerk,
    // waves and cubics, 0 for straight lines.
    let check = |p: &ReferenceParams<'_>, ticks: u64| {
        let (d, s) = (path(p), path(&p.cast::<f32>()));
        for k in (0..ticks).step_by((ticks / 2000).max(1) as usize).chain([ticks]) {
            let (a, b) = (d.at(k), s.at(k));
            let off = a.position.minus::<f64>(b.position).abs();
            let way = a.position.minus::<f64>(FixedCounts(0)).abs().max(counts(&d, ticks).abs());
            assert!(off < 2.0 * UNIT + 2e-6 * way, "tick {k} of {p:?}: {off} counts of {way}");
            let (va, vb) = (a.velocity, f64::from(b.velocity));
            assert!((va - vb).abs() < 1e-4 * va.abs().max(1.0), "tick {k} of {p:?}: {va} and {vb} rad/s");
        }
    };
    for distance in [1.0_f64, -0.01, 30.0, 5000.0] {
        let t = (distance.abs() as u64 + 2) * 2000;
        check(&trapezoid(distance, 0.5, 2.0), t + 500);
        check(&jerk_limited(distance, 0.5, 2.0, 8.0), t + 500);
        check(&minimum_jerk(distance, t as f64 * 1e-3), t + 500);
    }
    check(&ReferenceParams::Hold, 1000);
    check(&ReferenceParams::ramp(0.5), 10_000_000);
    check(&ReferenceParams::Sine(SINE), 100_000);
    check(&ReferenceParams::Chirp(CHIRP), 30_000);
    for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
        for knots in [&knots[..], &long[..]] {
            let last = knots[knots.len() - 1].time_us / 1000;
            check(&table(knots, interpolation), last + 10);
        }
    }
}

#[test]
fn each_bad_parameter_is_named() {
    let field = |p: ReferenceParams<'_>| {
        Reference::new(&p, FixedCounts(0), Encoder::PAPER, MS).map_or_else(|e| e.field(), |_| "none")
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        assert_eq!(field(ReferenceParams::ramp(bad)), "rate", "{bad}");
        assert_eq!(field(trapezoid(bad, 1.0, 1.0)), "distance", "{bad}");
        assert_eq!(field(trapezoid(1.0, bad, 1.0)), "speed", "{bad}");
        assert_eq!(field(jerk_limited(bad, 1.0, 1.0, 1.0)), "distance", "{bad}");
        assert_eq!(field(jerk_limited(1.0, bad, 1.0, 1.0)), "speed", "{bad}");
        assert_eq!(field(minimum_jerk(bad, 1.0)), "distance", "{bad}");
        assert_eq!(field(minimum_jerk(1.0, bad)), "duration", "{bad}");
        assert_eq!(field(ReferenceParams::Sine(Sine { rate: bad, ..SINE })), "rate", "{bad}");
        assert_eq!(field(ReferenceParams::Sine(Sine { amplitude: bad, ..SINE })), "amplitude", "{bad}");
        assert_eq!(field(ReferenceParams::Sine(Sine { frequency: bad, ..SINE })), "frequency", "{bad}");
        assert_eq!(field(ReferenceParams::Sine(Sine { phase: bad, ..SINE })), "phase", "{bad}");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { rate: bad, ..CHIRP })), "rate", "{bad}");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { amplitude: bad, ..CHIRP })), "amplitude", "{bad}");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { from: bad, ..CHIRP })), "from", "{bad}");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { to: bad, ..CHIRP })), "to", "{bad}");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { duration: bad, ..CHIRP })), "duration", "{bad}");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { phase: bad, ..CHIRP })), "phase", "{bad}");
    }
    // So slow that it never ends, or not a bound at all.
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0, 5e-324, 1e-40] {
        assert_eq!(field(trapezoid(1.0, bad, 1.0)), "speed", "{bad}");
        assert_eq!(field(trapezoid(1.0, 1.0, bad)), "acceleration", "{bad}");
        assert_eq!(field(jerk_limited(1.0, bad, 1.0, 1.0)), "speed", "{bad}");
        assert_eq!(field(jerk_limited(1.0, 1.0, bad, 1.0)), "acceleration", "{bad}");
        assert_eq!(field(jerk_limited(1.0, 1.0, 1.0, bad)), "jerk", "{bad}");
    }
    for bad in [0.0, -1.0, 0.000_999, 1_000_001.0] {
        assert_eq!(field(minimum_jerk(1.0, bad)), "duration", "{bad}");
    }
    assert_eq!(field(minimum_jerk(1e6, 1e-3)), "duration"); // 1.9e9 rad/s at its middle
    assert_eq!(field(ReferenceParams::Chirp(Chirp { duration: 0.0, ..CHIRP })), "duration");
    assert_eq!(field(ReferenceParams::Chirp(Chirp { duration: 4e-4, ..CHIRP })), "duration"); // no period
    for nyquist in [-0.1, 500.0] {
        assert_eq!(field(ReferenceParams::Sine(Sine { frequency: nyquist, ..SINE })), "frequency");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { from: nyquist, ..CHIRP })), "from");
        assert_eq!(field(ReferenceParams::Chirp(Chirp { to: nyquist, ..CHIRP })), "to");
    }
    let bad_table = |knots: &[Knot]| {
        let p = table(knots, Interpolation::Cubic);
        let e = Reference::new(&p, FixedCounts(0), Encoder::PAPER, MS).unwrap_err();
        assert_eq!(e.field(), "knots");
        e.value
    };
    assert_eq!(bad_table(&[]), 0.0);
    assert_eq!(bad_table(&[knot(0, 0), knot(10, 0), knot(10, 1)]), 2.0);
    assert_eq!(bad_table(&[knot(5, 0), knot(4, 0), knot(9, 1)]), 1.0);
    assert_eq!(bad_table(&[knot(0, 0), Knot { time_us: 1, position: FixedCounts(i64::MIN) }]), 1.0);
    let bad_period = Reference::new(&ReferenceParams::<f64>::Hold, FixedCounts(0), Encoder::PAPER, Micros(0));
    assert_eq!(bad_period.unwrap_err().field(), "period");
}

/// A bound of any size a clutch might see: logarithmic.
fn bound(decades: core::ops::Range<f64>) -> impl Strategy<Value = f64> {
    decades.prop_map(|e| libm::pow(10.0, e))
}

/// A distance of either sign, from a hundredth of a count to 160 turns.
fn distance() -> impl Strategy<Value = f64> {
    (bound(-5.5..3.0), any::<bool>()).prop_map(|(d, back)| if back { -d } else { d })
}

/// Points with rising times.
fn points(rise: core::ops::Range<i64>) -> impl Strategy<Value = Vec<Knot>> {
    proptest::collection::vec((1_u64..3_000_000, rise), 1..12).prop_map(|steps| {
        let (mut time_us, mut position) = (0, 0);
        steps
            .into_iter()
            .map(|(dt, rise)| {
                time_us += dt;
                position += rise;
                Knot { time_us, position: FixedCounts(position) }
            })
            .collect()
    })
}

/// Any parameters of any kind, sensible or not.
fn anything(kind: u8, bits: [u64; 6], knots: &[Knot]) -> ReferenceParams<'_> {
    let [a, b, c, d, e, f] = bits.map(|x| {
        // Half of them any float; half of moderate size, so that constructors let some through.
        if x & 1 == 0 { f64::from_bits(x) } else { libm::pow(10.0, x as f64 * 1e-18 - 9.0) }
    });
    match kind % 8 {
        0 => ReferenceParams::ramp(a),
        1 => trapezoid(a, b, c),
        2 => jerk_limited(a, b, c, d),
        3 => minimum_jerk(a, b),
        4 => ReferenceParams::Sine(Sine { rate: a, amplitude: b, frequency: c, phase: d }),
        5 => ReferenceParams::Chirp(Chirp { rate: a, amplitude: b, from: c, to: d, duration: e, phase: f }),
        6 => table(knots, Interpolation::Linear),
        _ => table(knots, Interpolation::Cubic),
    }
}

proptest! {
    #[test]
    fn the_preparation_of_a_table_changes_no_bit_of_it(
        times in prop::array::uniform4(1_u64..1 << 62), short in 0_u32..60, positions in prop::array::uniform4(any::<i64>()),
        part in 0.0..1.0_f64, period in 1_u32..1_000_000,
    ) {
        let mut time_us = 0;
        let knots = [0, 1, 2, 3].map(|k| {
            time_us += (times[k] >> 2 >> short).max(1);
            Knot { time_us, position: FixedCounts(positions[k] >> 2 >> short) }
        });
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let table = Table { knots: &knots, interpolation };
            let steepness = [0, 1, 2, 3].map(|k| table.steepness(k));
            let slopes = [0, 1, 2, 3].map(|k| table.slope::<f32>(k));
            let prepared = Prepared { steepness: &steepness, slopes: &slopes };
            let last = (part * time_us as f64) as u64 / u64::from(period);
            for tick in [last, last + 1, last / 2, 0] {
                let (encoder, period) = (Encoder::PAPER, Micros(period));
                let ours = table.at_with::<f32>(prepared, tick, encoder, period);
                prop_assert_eq!(ours, table.at::<f32>(tick, encoder, period));
            }
        }
    }
}

#[test]
fn where_a_line_meets_a_unit_exactly_a_prepared_table_meets_it_too() {
    // A third of a unit for each millisecond: rounded down, its steepness falls short of the unit by a hair.
    for rise in [2, -2, 2_000_000, -2_000_000] {
        let knots = [
            Knot { time_us: 0, position: FixedCounts(0) },
            Knot { time_us: 6000, position: FixedCounts(rise) },
        ];
        let table = Table { knots: &knots, interpolation: Interpolation::Linear };
        let (steepness, slopes) = ([0, 1].map(|k| table.steepness(k)), [0, 1].map(|k| table.slope::<f64>(k)));
        let prepared = Prepared { steepness: &steepness, slopes: &slopes };
        let at = |tick| table.at_with::<f64>(prepared, tick, Encoder::PAPER, Micros(1000)).position;
        assert_eq!(at(3), FixedCounts(rise / 2));
        for tick in 0..8 {
            assert_eq!(at(tick), table.at::<f64>(tick, Encoder::PAPER, Micros(1000)).position, "tick {tick}");
        }
    }
}

#[test]
fn an_interval_of_half_a_million_years_is_prepared_to_the_last_bit() {
    // Beyond 2⁶³ µs the rest of the division does not fit into a word that it is doubled in.
    let knots = [
        Knot { time_us: 0, position: FixedCounts(0) },
        Knot { time_us: 3 << 62, position: FixedCounts(i64::MAX) },
    ];
    let table = Table { knots: &knots, interpolation: Interpolation::Linear };
    let (steepness, slopes) = ([0, 1].map(|k| table.steepness(k)), [0, 1].map(|k| table.slope::<f64>(k)));
    let prepared = Prepared { steepness: &steepness, slopes: &slopes };
    let period = Micros(1_000_000);
    for tick in [1, 1 << 20, (1 << 43) - 1, 12_345_678_901_234] {
        let ours = table.at_with::<f64>(prepared, tick, Encoder::PAPER, period);
        assert_eq!(ours, table.at::<f64>(tick, Encoder::PAPER, period), "tick {tick}");
        let exact = i128::from(i64::MAX) * i128::from(tick) * 1_000_000 / (3 << 62);
        assert_eq!(i128::from(ours.position.0), exact, "tick {tick}");
    }
}

proptest! {
    #[test]
    fn a_trapezoid_keeps_its_bounds_and_arrives(d in distance(), v in bound(-3.0..2.0), a in bound(-2.0..4.0)) {
        keeps_its_bounds(&trapezoid(d, v, a), d, v, a, f64::INFINITY);
    }

    #[test]
    fn a_jerk_limited_move_keeps_its_bounds_and_arrives(
        d in distance(), v in bound(-3.0..2.0), a in bound(-2.0..4.0), j in bound(-2.0..6.0)
    ) {
        keeps_its_bounds(&jerk_limited(d, v, a, j), d, v, a, j);
    }

    #[test]
    fn a_minimum_jerk_move_arrives(d in distance(), duration in bound(-2.0..4.0)) {
        // Its peaks: 15/8 D/T, 10/√3 D/T², 60 D/T³.
        let (v, a) = (1.875 * d.abs() / duration, 5.7736 * d.abs() / (duration * duration));
        keeps_its_bounds(&minimum_jerk(d, duration), d, v, a, 60.0 * d.abs() / duration.powi(3));
    }

    #[test]
    fn a_jerk_limited_move_takes_the_shortest_time(
        d in distance(), v in bound(-2.0..1.0), a in bound(-1.0..3.0), j in bound(0.0..5.0)
    ) {
        let r = path(&jerk_limited(d, v, a, j));
        let ticks = shortest_time(d.abs(), v, a, j) / 1e-3;
        let end = first_tick_at_rest(&r) as f64;
        // Near its end it may already be within a unit of the goal, moving and slowing down at
        // less than any digit shown: only an early end is excused, and only by the last units.
        prop_assert!(end <= ticks.ceil() + 1.0, "{} ticks instead of {}", end, ticks);
        prop_assert!(end >= ticks.floor() - 1.0, "{} ticks instead of {}", end, ticks);
    }

    #[test]
    fn a_profile_has_the_right_derivatives(
        d in bound(-1.0..2.0), v in bound(-2.0..1.0), rise in bound(-2.2..1.0), j in bound(-1.0..2.5), seed in any::<u64>()
    ) {
        // A rise of many ticks: a window of three sees at most one border.
        let a = v / rise;
        for (p, jerk) in [(trapezoid(d, v, a), 0.0), (jerk_limited(-d, v, a, j), j)] {
            let r = path(&p);
            let end = first_tick_at_rest(&r);
            let ticks = (0..200_u64).map(|k| 1 + seed.wrapping_mul(2 * k + 1) % (end + 2));
            derivatives_agree(&r, ticks, jerk);
        }
    }

    #[test]
    fn a_rising_table_never_runs_backwards(knots in points(0..1_000_000_000)) {
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let r = path(&table(&knots, interpolation));
            let last = knots[knots.len() - 1].time_us / 1000 + 2;
            let mut before = r.at(0);
            for k in (0..last).step_by((last / 2000).max(1) as usize) {
                let now = r.at(k);
                // Two roundings down.
                prop_assert!(now.position.0 >= before.position.0 - 2, "tick {}: {:?} after {:?}", k, now, before);
                prop_assert!(now.velocity >= -1e-9 * (1.0 + before.velocity.abs()));
                prop_assert!(now.position.0 <= knots[knots.len() - 1].position.0.max(0) + 2);
                before = now;
            }
        }
    }

    #[test]
    fn straight_lines_are_exact(knots in points(-1_000_000_000_000..1_000_000_000_000), tick in 0_u64..36_000) {
        let (double, single) =
            (path(&table(&knots, Interpolation::Linear)), path(&table(&knots, Interpolation::Linear).cast::<f32>()));
        let time = i128::from(tick) * 1000;
        let expected = knots.windows(2).find_map(|w| {
            let (from, to) = (i128::from(w[0].time_us), i128::from(w[1].time_us));
            let (a, b) = (i128::from(w[0].position.0), i128::from(w[1].position.0));
            (from..to).contains(&time).then(|| a + ((b - a) * (time - from)).div_euclid(to - from))
        });
        if let Some(expected) = expected {
            prop_assert_eq!(i128::from(double.at(tick).position.0), expected);
            prop_assert_eq!(single.at(tick).position, double.at(tick).position);
        }
    }

    #[test]
    fn straight_lines_are_exact_however_long_they_are(
        length in 1_u64..1_000_000_000_000_000_000,
        rise in -(1_i64 << 61)..1 << 61,
        at in 0.0..1.0_f64,
    ) {
        let knots = [Knot { time_us: 0, position: FixedCounts(0) }, Knot { time_us: length, position: FixedCounts(rise) }];
        let tick = ((length as f64 * at) as u64).min(length - 1) / 1000;
        let expected = (i128::from(rise) * i128::from(tick * 1000)).div_euclid(i128::from(length));
        let line = Table { knots: &knots, interpolation: Interpolation::Linear };
        let target: Target<f64> = line.at(tick, Encoder::PAPER, Micros(1000));
        prop_assert_eq!(i128::from(target.position.0), expected);
    }

    #[test]
    fn a_cubic_table_passes_through_its_points(knots in points(-1_000_000_000_000..1_000_000_000_000)) {
        let whole: Vec<_> = knots.iter().map(|k| Knot { time_us: k.time_us * 1000, ..*k }).collect();
        let (double, single) =
            (path(&table(&whole, Interpolation::Cubic)), path(&table(&whole, Interpolation::Cubic).cast::<f32>()));
        for k in &whole {
            prop_assert_eq!(double.at(k.time_us / 1000).position, k.position);
            prop_assert_eq!(single.at(k.time_us / 1000).position, k.position);
        }
    }

    #[test]
    fn no_parameters_and_no_tick_panic_or_give_nan(
        kind in any::<u8>(),
        bits in any::<[u64; 6]>(),
        times in proptest::collection::vec((any::<u64>(), any::<i64>()), 0..5),
        sorted in any::<bool>(),
        period in prop_oneof![Just(1000_u32), 1_u32..1_000_000, any::<u32>()],
        start in any::<i64>(),
        ticks in proptest::collection::vec(any::<u64>(), 10),
    ) {
        let mut knots: Vec<_> =
            times.into_iter().map(|(time_us, p)| Knot { time_us, position: FixedCounts(p) }).collect();
        if sorted {
            knots.sort_by_key(|k| k.time_us);
        }
        let p = anything(kind, bits, &knots);
        let start = FixedCounts(start);
        let some = ticks.iter().enumerate().map(|(i, t)| t >> (6 * i)).chain([0, 1, 2, u64::MAX - 1, u64::MAX]);
        let some: Vec<_> = some.collect();
        if let Ok(r) = Reference::new(&p, start, Encoder::PAPER, Micros(period)) {
            for &tick in &some {
                let t = r.at(tick);
                prop_assert!(t.velocity.is_finite() && t.acceleration.is_finite(), "{:?} at {}: {:?}", p, tick, t);
            }
        }
        let p = p.cast::<f32>();
        if let Ok(r) = Reference::new(&p, start, Encoder::PAPER, Micros(period)) {
            for &tick in &some {
                let t = r.at(tick);
                prop_assert!(t.velocity.is_finite() && t.acceleration.is_finite(), "{:?} at {}: {:?}", p, tick, t);
            }
        }
    }
}

#[test]
fn a_target_in_single_precision_keeps_its_position_whole() {
    let target = Target { position: FixedCounts((1 << 40) + 1), velocity: 0.1_f64, acceleration: -1e-3 };
    let single: Target<f32> = target.cast();
    assert_eq!((single.position, single.velocity, single.acceleration), (target.position, 0.1, -1e-3));
}
