//! Friction with bristles: limits between the models, what each of them is for, and the engine that integrates them.
//!
//! The values are those of Canudas de Wit et al. (1995): 1 kg on 1 N of friction, 1.5 N at break-away, bristles of 10⁵ N/m
//! with a damping of √10⁵ N s/m, a Stribeck velocity of 1 mm/s, 0.4 N s/m of viscous friction. A metre is a radian here.

use clutch_core::friction::{
    Bend, CoulombParams, DahlParams, ELEMENTS, ElastoPlasticParams, FrictionModel, FrictionParams,
    LugreParams, MaxwellParams, StribeckParams,
};
use clutch_core::{ActuatorParams, Bristles, Friction, Plant, PlantParams};
use clutch_sim::drive::{Drive, DriveParams, RampDrive, SineDrive};
use clutch_sim::engine::{Bristle, DormandPrince, Engine, Event, EventKind, Input, Model, Shaft, Volts};

fn lugre() -> LugreParams {
    LugreParams {
        mu_static: 1.5,
        mu_dynamic: 1.0,
        stribeck_velocity: 0.001,
        stribeck_exponent: 2.0,
        stiffness: 1e5,
        damping: 1e5_f64.sqrt(),
    }
}

fn elasto_plastic() -> ElastoPlasticParams {
    let LugreParams { mu_static, mu_dynamic, stribeck_velocity, stribeck_exponent, stiffness, damping } =
        lugre();
    let elastic = 0.9;
    ElastoPlasticParams {
        mu_static,
        mu_dynamic,
        stribeck_velocity,
        stribeck_exponent,
        stiffness,
        damping,
        elastic,
    }
}

/// Four springs that give way after 6.25, 12.5, 25 and 50 µm at one coefficient.
fn maxwell() -> MaxwellParams {
    let LugreParams { mu_static, mu_dynamic, stribeck_velocity, stribeck_exponent, .. } = lugre();
    let [stiffness_a, stiffness_b, stiffness_c, stiffness_d] = [4e4, 2e4, 1e4, 5e3];
    let (share_a, share_b, share_c) = (0.25, 0.25, 0.25);
    MaxwellParams {
        mu_static,
        mu_dynamic,
        stribeck_velocity,
        stribeck_exponent,
        stiffness_a,
        stiffness_b,
        stiffness_c,
        stiffness_d,
        share_a,
        share_b,
        share_c,
        attraction: 50.0,
        damping: 100.0,
        ..MaxwellParams::default()
    }
}

/// Each of these four springs as two, half as stiff, which bear half.
fn maxwell_in_eight() -> MaxwellParams {
    let p = maxwell();
    let [a, b, c, d] = [p.stiffness_a, p.stiffness_b, p.stiffness_c, p.stiffness_d].map(|k| 0.5 * k);
    of_eight([a, b, c, d, a, b, c, d])
}

/// Eight springs, each with an eighth of the friction.
fn of_eight(stiffness: [f64; 8]) -> MaxwellParams {
    let [
        stiffness_a,
        stiffness_b,
        stiffness_c,
        stiffness_d,
        stiffness_e,
        stiffness_f,
        stiffness_g,
        stiffness_h,
    ] = stiffness;
    MaxwellParams {
        stiffness_a,
        stiffness_b,
        stiffness_c,
        stiffness_d,
        stiffness_e,
        stiffness_f,
        stiffness_g,
        stiffness_h,
        share_a: 0.125,
        share_b: 0.125,
        share_c: 0.125,
        share_e: 0.125,
        share_f: 0.125,
        share_g: 0.125,
        share_h: 0.125,
        ..maxwell()
    }
}

/// Bristles after a time at these rates.
fn moved(bend: &Bend<f64>, rates: &[f64; ELEMENTS], dt: f64) -> Bend<f64> {
    let mut moved = *bend;
    moved.each.iter_mut().zip(rates).for_each(|(z, rate)| *z += dt * rate);
    moved
}

/// 1 kg, 0.4 N s/m, 1 N of normal force.
fn model(friction: impl Into<FrictionParams>) -> Model {
    let plant = PlantParams {
        inertia: 1.0,
        viscous_damping: 0.4,
        drive_torque: 0.0,
        actuator: ActuatorParams::brake(1.0),
        friction: friction.into(),
    };
    Model { plant: Plant::new(&plant).unwrap(), ripple: None }
}

/// The motion from rest under a drive, sampled each `period` until `end`, and what happened.
fn motion(model: &Model, drive: &Drive, period: f64, end: f64) -> (Vec<Shaft>, Vec<Event>) {
    motion_by(&mut Bristle::default(), model, drive, period, end)
}

/// The same by an engine.
fn motion_by(
    engine: &mut dyn Engine,
    model: &Model,
    drive: &Drive,
    period: f64,
    end: f64,
) -> (Vec<Shaft>, Vec<Event>) {
    let (mut shaft, mut events) = (Shaft::new(0.0, 0.0), Vec::new());
    let steps = (end / period).round() as u32;
    let shafts = (0..steps).map(|k| {
        let time = f64::from(k) * period;
        let input = Input { time, duration: period, origin: 0.0, volts: Volts::Held(1.0), drive, noise: 0.0 };
        engine.advance(model, &input, &mut shaft, &mut events).unwrap();
        shaft
    });
    (shafts.collect(), events)
}

fn sine(mean: f64, amplitude: f64, frequency: f64) -> Drive {
    Drive::new(&DriveParams::Sine(SineDrive { mean, amplitude, frequency, phase_turns: 0.0 }), 0).unwrap()
}

fn ramp(rate: f64) -> Drive {
    Drive::new(&DriveParams::Ramp(RampDrive { from: 0.0, rate }), 0).unwrap()
}

#[test]
fn a_small_force_bends_the_bristles_and_lets_them_come_back() {
    // Up to 0.7 N and back: the spring of the bristles, with a little hysteresis.
    let (shafts, _) = motion(&model(lugre()), &sine(0.0, 0.7, 0.5), 1e-3, 2.0);
    let most = shafts.iter().fold(0.0_f64, |most, s| most.max(s.position));
    assert!((most / (0.7 / 1e5) - 1.0).abs() < 0.5, "{most} m instead of about {} m", 0.7 / 1e5);
    let end = shafts[shafts.len() - 1];
    assert!(end.position.abs() < 0.2 * most, "{} m after the force is gone", end.position);
}

#[test]
fn the_force_of_break_away_falls_with_the_rate_at_which_it_grows() {
    let mut last = f64::INFINITY;
    for rate in [0.2, 1.0, 5.0, 20.0] {
        let (_, events) = motion(&model(lugre()), &ramp(rate), 1e-3, 2.0 / rate);
        let away = events.iter().find(|e| e.kind == EventKind::BreakAway).expect("it breaks away");
        assert!(
            away.torque < last && away.torque > 1.0 && away.torque < 1.55,
            "{rate} N/s: {} N",
            away.torque
        );
        last = away.torque;
    }
}

#[test]
fn friction_lags_behind_the_velocity() {
    // Sliding between 0.3 and 1.7 mm/s: friction is higher on the way up than on the way down.
    let friction = Friction::build(&lugre().into()).unwrap();
    let bristles = friction.bristles().unwrap();
    let (mut bend, dt) = (bristles.steady(0.001), 1e-6);
    let (mut rising, mut falling) = (0.0, 0.0);
    for k in 0..300_000 {
        let phase = f64::from(k) * dt * 10.0 * std::f64::consts::TAU;
        let velocity = 0.001 + 0.0007 * phase.sin();
        let rate = bristles.rate(&bend, velocity);
        if k >= 200_000 && phase.sin().abs() < 1e-3 {
            let mu = bristles.coefficient(&bend, &rate);
            *(if phase.cos() > 0.0 { &mut rising } else { &mut falling }) = mu;
        }
        bend = moved(&bend, &rate, dt);
    }
    assert!(rising > falling + 0.01, "{rising} on the way up, {falling} on the way down");
}

#[test]
fn without_damping_and_with_one_coefficient_lugre_is_dahl() {
    let (mu, stiffness) = (1.0, 1e5);
    let dahl = model(DahlParams { mu_dynamic: mu, stiffness });
    let same = model(LugreParams { mu_static: mu, mu_dynamic: mu, damping: 0.0, stiffness, ..lugre() });
    let drive = sine(0.2, 1.1, 3.0);
    let (a, b) = (motion(&dahl, &drive, 1e-3, 1.0).0, motion(&same, &drive, 1e-3, 1.0).0);
    for (a, b) in a.iter().zip(&b) {
        assert!((a.position - b.position).abs() < 1e-9 && (a.velocity - b.velocity).abs() < 1e-7);
    }
    assert!(a[999].position.abs() > 1e-4, "it moved");
}

/// A force that swings breaks the mass away, slides it, stops it, and turns it round. The distance falls with the root of the
/// stiffness, as the damping that belongs to it grows.
#[test]
fn stiff_bristles_move_as_coulombs_friction_does() {
    let drive = sine(0.1, 2.0, 1.0);
    let rigid = model(CoulombParams { mu_static: 1.0, mu_dynamic: 1.0 });
    let exact = motion_by(&mut DormandPrince::default(), &rigid, &drive, 1e-3, 1.5).0;
    let way = exact.iter().fold(0.0_f64, |most, s| most.max(s.position.abs()));
    assert!(way > 0.05, "{way} m");
    let mut last = f64::INFINITY;
    for stiffness in [1e4_f64, 1e5, 1e6, 1e7, 1e8] {
        let damping = stiffness.sqrt();
        let p = LugreParams { mu_static: 1.0, stribeck_velocity: 0.05, stiffness, damping, ..lugre() };
        let bent = motion(&model(p), &drive, 1e-3, 1.5).0;
        let apart = exact.iter().zip(&bent).map(|(a, b)| (a.position - b.position).abs()).fold(0.0, f64::max);
        assert!(apart < 0.5 / stiffness.sqrt() && apart < last / 3.0, "{stiffness} 1/m: {apart} m");
        last = apart;
    }
}

/// The range in which elasto-plastic bristles only bend is what holds a trembling load. As it goes to nothing they drift, and
/// come to a limit that is not LuGre's friction: between `μ_e` and sliding they still give way by degrees.
#[test]
fn elasto_plastic_bristles_without_an_elastic_range_drift_and_less_than_lugres() {
    let drive = sine(0.6, 0.2, 20.0);
    let drift = |friction: FrictionParams| {
        let shafts = motion(&model(friction), &drive, 1e-3, 10.0).0;
        shafts[9_999].position - shafts[4_999].position
    };
    let drifts = [0.9, 0.7, 0.5, 0.3, 0.1, 1e-3, 1e-6]
        .map(|elastic| drift(ElastoPlasticParams { elastic, ..elasto_plastic() }.into()));
    assert!(drifts.is_sorted(), "{drifts:?}");
    let [.., before, limit] = drifts;
    assert!((limit / before - 1.0).abs() < 0.01, "{drifts:?}");
    let most = drift(lugre().into());
    assert!(limit > 0.1 * most && limit < 0.3 * most, "{limit} m, LuGre's {most} m");
}

#[test]
fn under_a_load_that_trembles_lugre_drifts_and_elasto_plastic_friction_holds() {
    // 0.6 ± 0.2 N, below the 0.9 N up to which the elasto-plastic bristles only bend.
    let drive = sine(0.6, 0.2, 20.0);
    let drift = |model: &Model| {
        let shafts = motion(model, &drive, 1e-3, 20.0).0;
        shafts[19_999].position - shafts[9_999].position
    };
    let (lugre, held) = (drift(&model(lugre())), drift(&model(elasto_plastic())));
    assert!(lugre > 1e-7, "{lugre} m");
    assert!(held.abs() < 1e-12, "{held} m");
}

#[test]
fn a_run_does_not_depend_on_the_periods_in_which_it_is_asked_for() {
    for friction in [FrictionParams::from(lugre()), elasto_plastic().into(), maxwell().into()] {
        let model = model(friction);
        // Break-away, sliding, a reversal.
        let drive = sine(0.0, 2.0, 1.0);
        let at = |period: f64| {
            let shafts = motion(&model, &drive, period, 1.0).0;
            let last = shafts[shafts.len() - 1];
            [last.position, last.velocity, shafts[shafts.len() / 2 - 1].position]
        };
        let finest = at(1e-5);
        for period in [1e-3, 1e-4] {
            for (a, b) in at(period).iter().zip(finest) {
                assert!((a - b).abs() < 1e-6 * b.abs().max(0.01), "{a} and {b} with {period} s");
            }
        }
    }
}

/// Numbers from 0 to 1.
fn numbers() -> impl FnMut() -> f64 {
    let mut seed = 1_u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Of a friction of the velocity alone the coefficient goes the way of the velocity: it takes energy at each instant.
#[test]
fn over_many_random_programs_of_velocity_a_curve_takes_energy_and_never_gives_it() {
    let mut random = numbers();
    for _ in 0..10_000 {
        let (dynamic, exponent) = (random(), 0.1 + 3.0 * random());
        let stribeck = StribeckParams {
            mu_static: 2.0 * random(),
            mu_dynamic: dynamic,
            stribeck_velocity: 10.0_f64.powf(-5.0 * random()),
            stribeck_exponent: exponent,
        };
        let coulomb = CoulombParams { mu_static: dynamic + random(), mu_dynamic: dynamic };
        for params in [FrictionParams::from(stribeck), coulomb.into()] {
            let friction = Friction::build(&params).unwrap();
            let mut work = 0.0;
            for _ in 0..20 {
                let velocity = (random() - 0.5) * 10.0_f64.powf(-4.0 * random());
                let done = velocity * friction.coefficient(velocity) * random();
                assert!(done >= 0.0, "{params:?} at {velocity} rad/s");
                work += done;
            }
            assert!(work > 0.0, "{params:?}");
        }
    }
}

#[test]
fn over_many_random_programs_of_velocity_friction_takes_energy_and_never_gives_it() {
    let mut random = numbers();
    let all = [
        FrictionParams::from(lugre()),
        elasto_plastic().into(),
        DahlParams::default().into(),
        maxwell().into(),
    ];
    for params in all {
        let bristles = Friction::build(&params).unwrap().bristles().unwrap();
        // With the viscous friction that makes it passive.
        let viscous = bristles.passive_from();
        let mut least = f64::INFINITY;
        for _ in 0..10_000 {
            let (mut bend, mut work) = (Bend::none(), 0.0);
            for _ in 0..20 {
                let velocity = (random() - 0.5) * 10.0_f64.powf(-4.0 * random());
                // Short beside the bristles' bending, and beside the time in which elements come to their shares.
                let dt = (0.02 / bristles.stiffness() / velocity.abs()).min(0.002);
                for _ in 0..40 {
                    // An element turns round, or gives way, at the begin of a step.
                    bend = bristles.settled(&bend, velocity);
                    let middle = moved(&bend, &bristles.rate(&bend, velocity), 0.5 * dt);
                    let rate = bristles.rate(&middle, velocity);
                    work += dt * velocity * (bristles.coefficient(&middle, &rate) + viscous * velocity);
                    bend = moved(&bend, &rate, dt);
                }
                least = least.min(work);
            }
        }
        assert!(least >= 0.0, "{params:?}: {least}");
    }
}

/// The coefficient after a way, each stretch to the next element that gives way.
fn go(bristles: &Bristles<f64>, bend: &mut Bend<f64>, way: f64, limits: &[f64; ELEMENTS]) -> f64 {
    // One coefficient: the velocity shows in nothing.
    let (velocity, mut left) = (1e-3_f64.copysign(way), way.abs());
    *bend = bristles.settled(bend, velocity);
    while left > 0.0 {
        // As far as the nearest element goes that holds.
        let room = |i: usize| limits[i] - bend.each[i] * velocity.signum();
        let next = (0..bristles.count()).filter(|i| !bend.slides[*i]).map(room).fold(left, f64::min).max(0.0);
        let rates = bristles.rate(bend, velocity);
        // A hair further, so that it gives way.
        let step = (next * (1.0 + 1e-15) + 1e-20).min(left);
        *bend = bristles.settled(&moved(bend, &rates, step / velocity.abs()), velocity);
        left -= step;
    }
    bristles.coefficient(bend, &bristles.rate(bend, velocity))
}

/// Break-away, sliding and a reversal: of a spring and of its halves side by side the motion is the same, though the engine
/// has other equations for more than four.
#[test]
fn a_spring_in_two_halves_is_the_spring() {
    let drive = sine(0.1, 2.0, 1.0);
    let [four, eight] = [maxwell(), maxwell_in_eight()].map(|p| motion(&model(p), &drive, 1e-3, 1.5).0);
    let way = four.iter().fold(0.0_f64, |most, s| most.max(s.position.abs()));
    assert!(way > 0.05, "{way} m");
    for (a, b) in four.iter().zip(&eight) {
        assert!((a.position - b.position).abs() < 1e-7 * way, "{} and {} m", a.position, b.position);
    }
}

#[test]
fn maxwell_slip_remembers_each_point_where_the_motion_turned_round() {
    let four = [6.25e-6, 12.5e-6, 25e-6, 50e-6];
    remembers(maxwell(), std::array::from_fn(|i| four[i % 4]));
    // Eight that differ, and bear an eighth of 1 N each.
    let stiffness = [4e4, 2e4, 1e4, 5e3, 8e4, 3e4, 1.5e4, 7e3];
    remembers(of_eight(stiffness), stiffness.map(|k| 0.125 / k));
}

fn remembers(params: MaxwellParams, limits: [f64; ELEMENTS]) {
    // One coefficient: the way alone decides.
    let params = MaxwellParams { mu_static: 1.0, mu_dynamic: 1.0, damping: 0.0, ..params };
    let bristles = Friction::build(&params.into()).unwrap().bristles().unwrap();
    let mut seed = 3_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..1000 {
        let mut bend = Bend::none();
        go(&bristles, &mut bend, 40e-6 * random(), &limits);
        // Loops in loops: back by less each time, and out again in the reverse order.
        let mut ways = vec![];
        let mut at = vec![];
        let mut way = 60e-6;
        for k in 0..6 {
            way *= 0.2 + 0.75 * random();
            at.push(bend);
            ways.push(way);
            go(&bristles, &mut bend, if k % 2 == 0 { -way } else { way }, &limits);
        }
        for k in (1..6).rev() {
            // To where loop k began; then on with the larger loop, as if the small one had not been.
            go(&bristles, &mut bend, if k % 2 == 0 { ways[k] } else { -ways[k] }, &limits);
            let mu = |bend: &Bend<f64>| bristles.coefficient(bend, &[0.0; ELEMENTS]);
            assert!((mu(&bend) - mu(&at[k])).abs() < 1e-12, "{} and {}", mu(&bend), mu(&at[k]));
        }
    }
}

#[test]
fn one_element_of_maxwells_is_a_spring_and_then_coulombs_friction() {
    let params = MaxwellParams {
        mu_static: 1.0,
        mu_dynamic: 1.0,
        share_a: 1.0,
        share_b: 0.0,
        share_c: 0.0,
        damping: 0.0,
        ..maxwell()
    };
    // 0.9 N bend it by 22.5 µm and no more; 1.2 N accelerate the mass by 0.2 m/s² less what is viscous.
    let m = model(params);
    let (shafts, _) = motion(&m, &ramp_to(0.9, 10.0), 1e-2, 12.0);
    assert!((shafts[1199].position / 22.5e-6 - 1.0).abs() < 1e-3, "{}", shafts[1199].position);
    let (shafts, _) = motion(&m, &ramp_to(1.2, 0.01), 1e-3, 1.0);
    let expected = 0.2 / 0.4 * (1.0 - (-0.4_f64).exp());
    assert!((shafts[999].velocity / expected - 1.0).abs() < 0.02, "{} m/s", shafts[999].velocity);
}

/// A force that rises to a value within a time, and stays.
fn ramp_to(force: f64, end: f64) -> Drive {
    Drive::Table(vec![(0.0, 0.0), (end, force)])
}
