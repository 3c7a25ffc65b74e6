//! Shafts that are integrated here, in small steps and by other means than anywhere else, inside bounds and outside of
//! them.

use super::*;
use crate::law::{LawParams, PdParams};
use crate::supervisor::{LimitParams, SpeedLimit, SupervisorParams, limits::Limits};
use crate::{ActuatorParams, BothActuator, BrakeActuator, MotorActuator, PlantParams, SafeState, Tolerances};
use crate::{Encoder, ServoParams};
use proptest::prelude::*;
use std::vec::Vec;

const PERIOD: f64 = 1e-3;

/// A shaft with friction that falls from rest to motion, in steps of a fiftieth of a period.
#[derive(Clone, Copy, Debug)]
struct Shaft {
    inertia: f64,
    drive: f64,
    damping: f64,
    rest: f64,
    sliding: f64,
    actuator: ActuatorParams,
    x: f64,
    v: f64,
}

impl Shaft {
    fn torques(&self, volts: f64) -> (f64, f64) {
        match self.actuator {
            ActuatorParams::Brake(b) => (0.0, b.preload + b.gain * volts.max(0.0)),
            ActuatorParams::Motor(m) => (m.gain * volts, m.preload + m.load_share * (m.gain * volts).abs()),
            ActuatorParams::Both(b) => {
                (b.motor_gain * (-volts).max(0.0), b.preload + b.brake_gain * volts.max(0.0))
            }
            ActuatorParams::Geometry(_) => unreachable!("none is drawn"),
        }
    }

    fn step(&mut self, volts: f64, seconds: f64) {
        let (torque, normal) = self.torques(volts);
        let driving = self.drive + torque;
        let way = if self.v != 0.0 {
            self.v.signum()
        } else if driving.abs() <= self.rest * normal {
            return;
        } else {
            driving.signum()
        };
        let mu = self.sliding + (self.rest - self.sliding) * (-self.v.abs() / 0.02).exp();
        let a = (driving - way * mu * normal - self.damping * self.v) / self.inertia;
        let after = self.v + a * seconds;
        // It stops where it would turn.
        let after = if after * way < 0.0 { 0.0 } else { after };
        self.x += 0.5 * (self.v + after) * seconds;
        self.v = after;
    }

    fn counts(&self) -> i32 {
        (self.x * 20_000.0 / core::f64::consts::TAU).floor() as i32
    }
}

/// The place of each value of a shaft between its bounds, from 0 to 1; the volts of each period, and the time in it at
/// which they come.
#[derive(Clone, Debug)]
struct Drawn {
    kind: u8,
    at: [f64; 6],
    speed: f64,
    volts: Vec<(f64, f64)>,
    /// Periods from a code to its effect.
    delay: u8,
    /// Bits of the periods whose sample is lost, and of those whose code is, on a line that loses some.
    lost: [u64; 2],
}

fn drawn() -> impl Strategy<Value = Drawn> {
    // Volts that a law could send: levels that stay for a while.
    let level = (-1.0..1.0_f64, 1..40_usize, 0.02..0.9_f64);
    let volts = prop::collection::vec(level, 4..24).prop_map(|levels| {
        levels.into_iter().flat_map(|(u, n, late)| (0..n).map(move |_| (u, late))).collect()
    });
    let losses = prop_oneof![Just([0; 2]), any::<[u64; 2]>()];
    (0..3_u8, prop::array::uniform6(0.0..=1.0_f64), -1.0..1.0_f64, volts, 0..5_u8, losses)
        .prop_map(|(kind, at, speed, volts, delay, lost)| Drawn { kind, at, speed, volts, delay, lost })
}

fn model(kind: u8) -> PlantParams<f64> {
    let actuator = match kind {
        0 => ActuatorParams::Brake(BrakeActuator { gain: 0.14, preload: 0.02 }),
        1 => ActuatorParams::Motor(MotorActuator { gain: 0.05, preload: 0.1, load_share: 0.3 }),
        _ => ActuatorParams::Both(BothActuator { brake_gain: 0.14, motor_gain: 0.02, preload: 0.02 }),
    };
    let drive_torque = if kind == 1 { 0.01 } else { 0.047 };
    PlantParams { actuator, drive_torque, ..PlantParams::default() }
}

/// Tolerances of the bounds, each of a parameter of [`shaft`].
fn tolerances() -> Tolerances<f64> {
    Tolerances {
        inertia: 0.2,
        drive_torque: 0.5,
        viscous_damping: 0.5,
        brake_gain: 0.1,
        motor_gain: 0.1,
        friction: 0.4,
    }
}

/// The shaft of a draw, inside the bounds.
fn shaft(d: &Drawn) -> Shaft {
    let (t, m) = (tolerances(), model(d.kind));
    let around = |x: f64, share: f64, at: f64| x * (1.0 + share * (2.0 * at - 1.0));
    let [inertia, drive, damping, brake, motor, friction] = d.at;
    let gains = (t.brake_gain, t.motor_gain);
    let actuator = match m.actuator {
        ActuatorParams::Brake(b) => BrakeActuator { gain: around(b.gain, gains.0, brake), ..b }.into(),
        ActuatorParams::Motor(b) => MotorActuator { gain: around(b.gain, gains.1, motor), ..b }.into(),
        ActuatorParams::Both(b) => BothActuator {
            brake_gain: around(b.brake_gain, gains.0, brake),
            motor_gain: around(b.motor_gain, gains.1, motor),
            ..b
        }
        .into(),
        other @ ActuatorParams::Geometry(_) => other,
    };
    Shaft {
        inertia: around(m.inertia, t.inertia, inertia),
        drive: around(m.drive_torque, t.drive_torque, drive),
        damping: around(m.viscous_damping, t.viscous_damping, damping),
        rest: around(0.2, t.friction, friction),
        sliding: around(0.15, t.friction, friction),
        actuator,
        x: 3.0 * d.at[0],
        v: if d.kind == 1 { d.speed } else { d.speed.abs() },
    }
}

fn envelope<T: Real>(kind: u8, limits: &LimitParams<T>) -> Envelope<T> {
    let bounds = Bounds::around(&model(kind), &tolerances()).unwrap();
    limits_of(&bounds.cast(), limits).envelope
}

fn limits_of<T: Real>(bounds: &Bounds<T>, limits: &LimitParams<T>) -> Limits<T> {
    let p = SupervisorParams {
        on_fault: SafeState::hold(T::from_i32(5)),
        speed: SpeedLimit::default(),
        limits: *limits,
    };
    let servo = ServoParams::paper(LawParams::Pd(PdParams::default()));
    Limits::new(&p, &servo, Dac::new(&servo.dac).unwrap(), bounds).unwrap()
}

/// No margins: the bounds alone.
fn bare<T: Real>() -> LimitParams<T> {
    LimitParams {
        friction_margin: T::ONE,
        grip_margin: T::ONE,
        // Single precision and small steps round as much.
        edge_counts: T::from_f64(0.01),
        ..LimitParams::default()
    }
}

/// The code next to the volts.
fn code<T: Real>(envelope: &Envelope<T>, volts: f64) -> DacCode {
    envelope.dac.code(T::from_f64(volts))
}

/// The volts of a period: `late` of it is the code before still in force. Gives the envelope's verdict at its end.
fn follow<T: Real>(
    envelope: &Envelope<T>,
    shaft: &mut Shaft,
    d: &Drawn,
    mut see: impl FnMut(usize, i32) -> i32,
) -> Option<(usize, Cause)> {
    let highest = if d.kind == 0 { 10.0 } else { 6.0 };
    let volts = |u: f64| {
        let asked = if d.kind == 0 { highest * u.abs() } else { highest * u };
        envelope.dac.volts(code(envelope, asked)).to_f64()
    };
    let first = volts(d.volts[0].0);
    let mut s = envelope.start(code(envelope, first));
    let lossy = d.lost != [0; 2];
    let lost = |k: usize, which: usize, one_in: u64| lossy && (d.lost[which] >> (k % 61)) & one_in == one_in;
    // The voltage that the board took last, and those on their way to the pad.
    let (mut taken, mut missed, mut way) = (first, 0, std::collections::VecDeque::new());
    way.resize(usize::from(d.delay) + 1, first);
    let (mut seen, mut elapsed) = (see(0, shaft.counts()), 0);
    for (k, (u, late)) in d.volts.iter().enumerate() {
        // A sample that is lost is not answered; a code may be lost as well, as long as the watchdog waits.
        let answered = elapsed == 0;
        if answered {
            s.sends(code(envelope, volts(*u)));
        }
        (taken, missed) =
            if !answered || missed < 2 && lost(k, 1, 3) { (taken, missed + 1) } else { (volts(*u), 0) };
        way.push_front(taken);
        let (now, before) = (way[usize::from(d.delay)], way[usize::from(d.delay) + 1]);
        way.truncate(usize::from(d.delay) + 1);
        for part in 0..50 {
            shaft.step(if f64::from(part) < late * 50.0 { before } else { now }, PERIOD / 50.0);
        }
        elapsed += 1;
        if missed < 2 && lost(k, 0, 7) {
            continue;
        }
        let counts = see(k + 1, shaft.counts());
        // The work done before the sample came changes nothing, be it for the one that came, for another, or missing.
        let mut late = s;
        if k % 3 > 0 {
            envelope.expect(&mut s, lossy == (k % 3 == 1));
        }
        let ended = envelope.judge(&mut s, lossy, counts.wrapping_sub(seen), elapsed);
        assert_eq!(envelope.judge(&mut late, lossy, counts.wrapping_sub(seen), elapsed), ended);
        assert_eq!(s.sides[usize::from(s.swapped)], late.sides[usize::from(late.swapped)]);
        let remembered = |s: &EnvelopeState<T>| {
            let mut s = *s;
            s.catch_up();
            (s.sent, s.last, s.turns, s.still, s.run)
        };
        assert_eq!(remembered(&s), remembered(&late));
        if let Some((cause, off)) = ended {
            assert!(off > T::ZERO);
            return Some((k, cause));
        }
        (seen, elapsed) = (counts, 0);
    }
    None
}

fn stays_inside<T: Real>(d: &Drawn) -> Result<(), TestCaseError> {
    let limits = LimitParams { delay_cycles: d.delay.into(), ..bare() };
    let ended = follow(&envelope::<T>(d.kind, &limits), &mut shaft(d), d, |_, counts| counts);
    prop_assert!(ended.is_none(), "{:?}: {:?}", shaft(d), ended);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// The envelope has the torques of the bounds in counts: the same at one voltage, and at several no less than at any of them.
    #[test]
    fn accelerations_are_those_of_the_torques_that_the_bounds_give(kind in 0..3_u8, volts in prop::array::uniform2(-6.0..6.0_f64)) {
        let bounds = Bounds::around(&model(kind), &tolerances()).unwrap();
        let envelope = limits_of(&bounds, &bare()).envelope;
        let scale = 20_000.0 / core::f64::consts::TAU * PERIOD * PERIOD;
        let rate = |torque: f64| {
            torque * scale / if torque > 0.0 { bounds.inertia.low } else { bounds.inertia.high }
        };
        let drive = bounds.drive_torque;
        let volts = if kind == 0 { volts.map(f64::abs) } else { volts };
        let several = [volts[0].min(volts[1]), volts[0].max(volts[1])];
        for [low, high] in [[volts[0]; 2], several] {
            let [up, down] = envelope.rates([low, high], [0.0; 2]);
            let [forwards, back] = [true, false].map(|forwards| bounds.possible(forwards, low, high));
            for (has, torque) in [
                (up.onward, drive.high + forwards.high),
                (up.back, drive.high + back.high),
                (down.onward, -(drive.low + back.low)),
                (down.back, -(drive.low + forwards.low)),
            ] {
                let over = has - rate(torque);
                prop_assert!(over > -1e-9, "{has} {}", rate(torque));
                prop_assert!(low < high || over < 1e-9, "{has} {}", rate(torque));
            }
        }
    }

    #[test]
    fn no_shaft_of_the_bounds_leaves_the_envelope(d in drawn()) {
        stays_inside::<f64>(&d)?;
        stays_inside::<f32>(&d)?;
    }
}

/// Periods after which a lie about the paper's shaft at 20 °/s is seen, where the brake balances the weight until then;
/// from then on the law sends the first of two volts, and the pad has the second.
fn seen_after<T: Real>(then: (f64, f64), lie: impl Fn(i32, i32) -> i32) -> Option<(usize, Cause)> {
    let bounds = Bounds::around(&PlantParams::<f64>::default(), &Tolerances::default()).unwrap().cast();
    let envelope = limits_of::<T>(&bounds, &LimitParams::default()).envelope;
    let p = PlantParams::<f64>::default();
    let brake = BrakeActuator { gain: 0.14, preload: 0.0 };
    let mut shaft = Shaft {
        inertia: p.inertia,
        drive: p.drive_torque,
        damping: p.viscous_damping,
        rest: 0.2,
        sliding: 0.15,
        actuator: brake.into(),
        x: 0.0,
        v: 20.0_f64.to_radians(),
    };
    let (mut s, mut seen, mut since) = (envelope.start(code(&envelope, BALANCES)), 0, 0);
    for k in 0..200_usize {
        let broken = k >= 60;
        let (volts, at_pad) = if broken { then } else { (BALANCES, BALANCES) };
        (0..50).for_each(|_| shaft.step(at_pad, PERIOD / 50.0));
        let true_counts = shaft.counts();
        if !broken {
            since = true_counts;
        }
        let counts = if broken { since + lie(true_counts - since, k as i32) } else { true_counts };
        s.sends(code(&envelope, volts));
        if let Some((cause, _)) = envelope.judge(&mut s, false, counts - seen, 1) {
            return Some((k + 1 - 60, cause));
        }
        seen = counts;
    }
    None
}

/// Voltage that balances the sliding shaft, less the drag at 20 °/s, V.
const BALANCES: f64 = 2.2257;

fn each_lie_is_seen_in_time<T: Real>() {
    let same = (BALANCES, BALANCES);
    // A law lets go where counts stay behind; until it does the brake may have stopped the shaft.
    let lets_go = (0.0, 0.0);
    let within = |what: &str, seen: Option<(usize, Cause)>, ms: usize, causes: &[Cause]| {
        let (after, named) = seen.unwrap_or_else(|| panic!("{what}: not seen"));
        assert!(
            after <= ms && causes.contains(&named),
            "{what}: {named:?} after {after} ms, not {causes:?} within {ms} ms"
        );
    };
    assert_eq!(seen_after::<T>(same, |n, _| n), None);
    within("frozen", seen_after::<T>(lets_go, |_, _| 0), 5, &[Cause::StandStill]);
    // Channel A dead at a count where B is low: edges of B count to and fro.
    within("channel", seen_after::<T>(lets_go, |n, _| (n >> 1) & 1), 5, &[Cause::Channel]);
    within("dither", seen_after::<T>(lets_go, |_, k| k & 1), 5, &[Cause::Channel]);
    // The first count back may be a channel's as well.
    let back = [Cause::Channel, Cause::Reversed];
    within("reversed", seen_after::<T>(same, |n, _| -n), 3, &back);
    within("doubled", seen_after::<T>(same, |n, _| 2 * n), 5, &[Cause::TooFast]);
    within("brake open", seen_after::<T>((BALANCES, 0.0), |n, _| n), 12, &[Cause::TooFast]);
    within("brake open, law brakes", seen_after::<T>((4.0, 0.0), |n, _| n), 8, &[Cause::TooFast]);
    within("brake stuck, law lets go", seen_after::<T>((0.0, 10.0), |n, _| n), 6, &[Cause::StandStill]);
}

#[test]
fn each_lie_is_seen_in_time_and_named() {
    each_lie_is_seen_in_time::<f32>();
    each_lie_is_seen_in_time::<f64>();
}

/// From rest, with the brake open, the drive alone has moved the shaft by ½ T/J t²: two edges of a count must have passed.
#[test]
fn a_frozen_encoder_of_a_resting_shaft_is_found_as_soon_as_the_brake_has_been_open_for_long_enough() {
    let bounds = Bounds::around(&PlantParams::<f64>::default(), &Tolerances::default()).unwrap();
    for edge in [0.0, 0.2, 1.0, 3.0] {
        let limits = LimitParams { edge_counts: edge, ..LimitParams::default() };
        let envelope = limits_of::<f64>(&bounds, &limits).envelope;
        let mut s = envelope.start(code(&envelope, 0.0));
        let seen = (1..).find(|_| envelope.judge(&mut s, false, 0, 1).is_some()).unwrap();
        let count = Encoder::PAPER.radians_per_count::<f64>();
        let p = PlantParams::<f64>::default();
        let must = (2.0 * (1.0 + 2.0 * edge) * count * p.inertia / p.drive_torque).sqrt() / PERIOD;
        // Nothing is known of the first sample's velocity, so that drag may take all of it.
        let seen = f64::from(seen);
        assert!(seen <= must + 2.0 && seen > 0.6 * must, "edge {edge}: {seen} ms, {must:.2} ms computed");
    }
}

#[test]
fn a_motor_axis_that_runs_against_its_voltage_is_too_fast_whichever_way_it_goes() {
    for way in [1, -1] {
        let envelope = envelope::<f64>(1, &LimitParams::default());
        let mut s = envelope.start(code(&envelope, 0.0));
        let ended = (1..100).find_map(|k| {
            s.sends(code(&envelope, 6.0 * f64::from(way)));
            envelope.judge(&mut s, false, -way * k, 1)
        });
        assert_eq!(ended.map(|(cause, _)| cause), Some(Cause::TooFast), "{way}");
    }
}

#[test]
fn a_shaft_that_nothing_drives_may_stand_for_ever() {
    let envelope = envelope::<f32>(1, &LimitParams::default());
    let mut s = envelope.start(code(&envelope, 0.0));
    for _ in 0..100_000 {
        assert_eq!(envelope.judge(&mut s, false, 0, 1), None);
    }
}

#[test]
fn counts_that_dither_about_an_edge_at_rest_are_an_edge() {
    let envelope = envelope::<f32>(0, &LimitParams::default());
    let mut s = envelope.start(code(&envelope, 9.0));
    for k in 0..10_000 {
        assert_eq!(envelope.judge(&mut s, false, if k % 2 == 0 { 1 } else { -1 }, 1), None);
    }
}

#[test]
fn volts_in_force_are_the_last_two_and_more_with_a_delay_or_losses() {
    let in_force = |delay_cycles, silence_cycles, losses| {
        let limits = LimitParams { delay_cycles, silence_cycles, ..LimitParams::default() };
        let envelope = envelope::<f64>(0, &limits);
        let mut s = envelope.start(DacCode(4000));
        // Ever lower, so that the highest is the oldest.
        (0..20).for_each(|k| s.keep(DacCode(3900 - 50 * k)));
        let [low, high] = envelope.in_force(&s, losses);
        assert_eq!(low, envelope.dac.volts(DacCode(2950)), "the newest");
        high
    };
    // 12 bit over ±10 V.
    let back = |codes: u32| f64::from(2950 + 50 * codes) * 20.0 / 4096.0 - 10.0;
    for silence in [2, 3, 8] {
        for delay in [0, 1, 2, 5] {
            assert_eq!(in_force(delay, silence, false), back(1 + delay));
            assert_eq!(in_force(delay, silence, true), back(silence + delay));
        }
    }
    assert_eq!((in_force(14, 3, false), in_force(12, 3, true)), (back(15), back(15)));
    // A line that loses more codes in a row than are kept.
    assert_eq!((in_force(13, 3, true), in_force(0, 1000, true)), (back(15), back(15)));
}

#[test]
fn volts_older_than_those_kept_may_be_any_of_the_output_or_what_was_there() {
    let in_force = |delay_cycles, applied, losses| {
        let envelope = envelope::<f64>(0, &LimitParams { delay_cycles, ..LimitParams::default() });
        let mut s = envelope.start(DacCode(applied));
        s.keep(DacCode(2560));
        envelope.in_force(&s, losses)
    };
    // Before the first that was sent was what is there.
    assert_eq!(in_force(14, 3072, false), [2.5, 5.0]);
    assert_eq!(in_force(15, 3072, false), [0.0, 10.0]);
    assert_eq!(in_force(15, 3072, true), [0.0, 10.0]);
    assert_eq!(in_force(1000, 1024, true), [-5.0, 10.0]);
}

/// The tolerances of these bounds: damping half as much again, inertia a fifth less.
#[test]
fn drag_slows_the_lightest_shaft_with_the_most_damping_and_only_the_one_that_comes_back() {
    let envelope = envelope::<f64>(0, &bare());
    let at = |speeds| envelope.rates([2.0, 3.0], speeds);
    let [up, down] = at([0.0; 2]);
    let [fast, slow] = at([3.0, 5.0]);
    // C/J over a period of 1 ms, of the velocity of the other side, whose way back this is.
    let drag = 1.5 * 0.001 / (0.8 * 0.0017) * PERIOD;
    for (has, rest, speed) in [(&fast, &up, 5.0), (&slow, &down, 3.0)] {
        assert_eq!(has.onward, rest.onward);
        assert!((has.back - rest.back - drag * speed).abs() < 1e-12, "{} {}", has.back, rest.back);
    }
    let [fast, slow] = at([-3.0, -5.0]);
    assert_eq!((fast.back, slow.back), (up.back, down.back), "one that goes the other way drives no drag");
}

#[test]
fn of_the_first_sample_a_count_is_known_and_no_velocity_below_the_fastest() {
    let bounds = Bounds::around(&model(1), &tolerances()).unwrap();
    for (speed, fastest) in [(10.0, 1000.0), (700.0, 1400.0)] {
        let limits = LimitParams { edge_counts: 0.25, ..bare() };
        let servo = ServoParams::<f64>::paper(LawParams::Pd(PdParams::default()));
        let dac = Dac::new(&servo.dac).unwrap();
        let envelope = Envelope::new(&limits, dac, &servo.output, &bounds, 1.0, PERIOD, speed);
        let s = envelope.start(DacCode(2048));
        for [up, down] in s.sides {
            // Somewhere in the count, whose edges may be off: from −1/4 to 5/4, and as seen from the other way.
            assert_eq!((up.position, down.position), (1.25, 0.25));
            for (side, from) in [(up, -0.25), (down, -1.25)] {
                assert_eq!((side.old.from, side.young.from, side.old.age), (from, from, 0.0));
                assert_eq!(side.velocity, fastest);
            }
        }
    }
}

#[test]
fn a_brake_goes_one_way_only_where_some_drive_is_certain() {
    let one_way = |kind, low| {
        let bounds = Bounds::around(&model(kind), &tolerances()).unwrap();
        let drive_torque = crate::Interval { low, high: 0.1 };
        limits_of(&Bounds { drive_torque, ..bounds }, &bare()).envelope.one_way
    };
    assert_eq!([1e-3, 0.0, -1e-3].map(|low| one_way(0, low)), [true, false, false]);
    assert_eq!([1e-3, 0.0].map(|low| one_way(1, low)), [false; 2], "a motor turns a shaft back");
    assert_eq!([1e-3, 0.0].map(|low| one_way(2, low)), [true, false]);
}

#[test]
fn a_shaft_whose_edges_are_off_by_as_much_as_allowed_stays_inside() {
    // At 100 °/s a brake balances the weight; edges wander by three counts, a wave of them in a few periods to many.
    let bounds = Bounds::around(&PlantParams::<f64>::default(), &Tolerances::default()).unwrap();
    let limits = LimitParams { edge_counts: 3.0, ..bare() };
    let envelope = limits_of::<f64>(&bounds, &limits).envelope;
    let pace = 100.0 / 360.0 * 20_000.0 * PERIOD;
    for wave in [3.0, 5.0, 8.0, 13.0, 21.0, 34.0, 55.0] {
        let volts = (0.047088 - 0.001 * 100.0_f64.to_radians()) / (0.15 * 0.14);
        let (mut s, mut seen) = (envelope.start(code(&envelope, volts)), 0);
        for k in 1..2000 {
            let time = f64::from(k);
            let off = 2.99 * libm::sin(core::f64::consts::TAU * time / wave);
            let counts = libm::floor(pace * time + off) as i32;
            s.sends(code(&envelope, volts));
            assert_eq!(envelope.judge(&mut s, false, counts - seen, 1), None, "{wave}: after {k} ms");
            seen = counts;
        }
    }
}

/// A side that has such a velocity, with windows of an age of four periods and of one.
fn side(velocity: f64) -> Side<f64> {
    let old = Window { from: -0.5, age: 4.0, moment: 0.5 };
    let young = Window { from: 0.25, age: 1.0, moment: 0.0 };
    Side { position: 1.5, velocity, way: 0.0, old, young }
}

#[test]
fn the_fastest_shaft_goes_by_the_laws_of_free_fall_and_stops_or_turns_where_it_has_to() {
    for (velocity, onward, back, after, way) in [
        // On and on; until it stands; from rest; and held at rest.
        (2.0, 0.125, 9.0, 2.5, 9.0),
        (0.25, -0.125, 9.0, 0.0, 0.5),
        (0.0, 0.125, 9.0, 0.5, 1.0),
        (0.0, -0.125, -0.25, -1.0, -2.0),
        // It comes back; to rest; and beyond, as if it had turned at once.
        (-2.0, 0.125, 0.25, -1.0, -6.0),
        (-1.0, 0.125, 0.25, 0.0, -2.0),
        (-0.5, 0.125, 0.5, 0.5, 2.0),
        (-0.5, 0.125, 0.25, 0.5, 2.0),
        (-0.5, -0.125, 0.25, 0.0, 0.0),
    ] {
        let next = side(velocity).after(&Rates { onward, back }, 0.25, 4.0);
        assert_eq!(
            (next.velocity, next.way, next.position),
            (after, way, 1.5),
            "{velocity}, {onward}, {back}"
        );
        // ∫ (t − t₀) a dt of 1/4 from 4 to 8 and from 1 to 5 periods, beside what there was.
        assert_eq!((next.old.age, next.old.moment, next.old.from), (8.0, 0.5 + 0.125 * (64.0 - 16.0), -0.5));
        assert_eq!((next.young.age, next.young.moment, next.young.from), (5.0, 0.125 * (25.0 - 1.0), 0.25));
    }
}

#[test]
fn counts_take_the_way_of_the_shaft_and_the_begin_of_its_windows_back() {
    let mut s = Side { way: 0.75, ..side(1.0) };
    s.arrive(2.0);
    assert_eq!((s.position, s.old.from, s.young.from), (0.25, -2.5, -1.75));
}

#[test]
fn a_window_has_the_mean_velocity_of_its_way_and_what_a_later_acceleration_may_have_added() {
    // 1.5 + 0.5 counts in four periods, and half a count.
    for (velocity, seen) in [(1.0, 0.625), (0.5, 0.5)] {
        let mut s = side(velocity);
        s.look_back(-0.75, true);
        assert_eq!(s.velocity, seen);
        assert_eq!((s.old, s.young), (side(0.0).old, side(0.0).young), "both windows are young enough");
    }
    // A shaft that does not turn is no slower than at rest.
    for (turns, seen) in [(true, -0.375), (false, 0.0)] {
        let mut s = Side { position: -2.5, ..side(1.0) };
        s.look_back(-0.75, turns);
        assert_eq!(s.velocity, seen);
    }
    // A younger one takes its place when it is blurred by 0.4 of a count, or sixteen periods old.
    for (age, moment, replaced) in
        [(15.0, 0.39, false), (16.0, 0.0, true), (17.0, 0.0, true), (2.0, 0.41, true)]
    {
        let young = Window { from: 0.25, age, moment };
        let mut s = Side { young, ..side(1.0) };
        s.look_back(-0.75, true);
        let begins = Window { from: -0.75, age: 0.0, moment: 0.0 };
        let expected = if replaced { (young, begins) } else { (side(0.0).old, young) };
        assert_eq!((s.old, s.young), expected, "{age}, {moment}");
    }
}

#[test]
fn a_window_begins_where_the_shaft_is_at_least_on_either_side() {
    let envelope = envelope::<f64>(1, &LimitParams { edge_counts: 0.25, ..bare() });
    // It balances friction and drag at that pace: 0.05 u + 0.01 = 0.15 (0.1 + 0.015 u) + 0.0005 N m.
    let (mut s, mut begun) = (envelope.start(code(&envelope, 0.115)), 0);
    for k in 0..200_i32 {
        // Three counts in two periods.
        assert_eq!(envelope.judge(&mut s, false, 1 + k % 2, 1), None);
        let [up, down] = s.sides[usize::from(s.swapped)];
        // The shaft is between −down and up, the axis turned round between −up and down.
        for (side, least) in [(up, -down.position), (down, -up.position)] {
            if side.young.age == 0.0 {
                assert_eq!(side.young.from, least, "{k}");
                begun += 1;
            }
        }
    }
    assert!(begun > 20, "{begun} windows");
}

#[test]
fn where_the_fastest_is_slower_than_the_slowest_the_window_that_took_more_of_a_velocity_names_the_suspect() {
    let envelope = envelope::<f64>(1, &LimitParams { edge_counts: 0.25, ..bare() });
    // A velocity before, and the one of a window of four periods that ends at the position.
    let side = |position: f64, velocity: f64, seen: f64| {
        let old = Window { from: position - 4.0 * seen, age: 4.0, moment: 0.0 };
        Side { position, velocity, way: 0.0, old, young: Window { age: 2.0, ..Window::default() } }
    };
    let judged = |up: [f64; 2], down: [f64; 2]| {
        let mut s = envelope.start(code(&envelope, 0.0));
        envelope.expect(&mut s, false);
        s.sides[1] = [side(1.0, up[0], up[1]), side(0.25, down[0], down[1])];
        envelope.judge(&mut s, false, 0, 1)
    };
    // The counts take 5/4 of the one and 1 of the other: behind the slowest, or ahead of the fastest.
    assert_eq!(judged([1.0, -0.25], [1.125, 0.125]), Some((Cause::TooSlow, 0.125)));
    assert_eq!(judged([1.125, 0.125], [1.0, -0.25]), Some((Cause::TooFast, 0.125)));
    assert_eq!(judged([1.125, 0.25], [1.0, -0.25]), None, "one shaft can have both velocities");
}
