//! Properties of every model, and of bristles that bend.

use super::*;
use crate::params::{Choice, Params};
use std::vec::Vec;

/// Parameters of four elements.
fn four<V: Copy + Default>(each: [V; 4]) -> [V; ELEMENTS] {
    core::array::from_fn(|i| each.get(i).copied().unwrap_or_default())
}

/// The four frictions with bristles.
fn bristled() -> Vec<Bristles<f64>> {
    FrictionParams::all().iter().filter_map(|p| Friction::build(p).unwrap().bristles()).collect()
}

#[test]
fn every_model_lies_in_its_envelope_and_ends_at_its_sliding_level() {
    for (place, p) in FrictionParams::<f64>::all().iter().enumerate() {
        let f = Friction::<f64>::build(p).unwrap();
        assert_eq!((&f.params(), p.chosen()), (p, place));
        assert_eq!((f.sliding(), f.level(100.0)), (0.15, 0.15), "{}", p.name());
        let at_rest = if p.name() == "dahl" { 0.15 } else { 0.2 };
        assert_eq!(f.at_rest(), at_rest, "{}", p.name());
        let Interval { low, high } = f.envelope();
        assert_eq!((low, high), (0.15, at_rest), "{}", p.name());
        for n in -40..=40 {
            let v = 1e-3 * f64::from(n) / 8.0;
            let level = f.level(v);
            assert!(low <= level && level <= high, "{}: {level} at {v} rad/s", p.name());
            assert_eq!(f.coefficient(v), level * v.sgn(), "{}", p.name());
            // The curve that a model names is its curve.
            if let Some(curve) = f.curve() {
                assert_eq!(curve.level(v), level, "{}", p.name());
            }
            if let Some(e) = f.exponential() {
                let curve = e.sliding + (e.at_rest - e.sliding) * (-v.abs() / e.velocity).exp();
                assert!((curve - level).abs() < 1e-15, "{}", p.name());
            }
            if let Some(Fall { velocity, exponent }) = f.falls() {
                // At once: at rest alone it is another.
                let share = if velocity > 0.0 { (-(v.abs() / velocity).powf(exponent)).exp() } else { 0.0 };
                let curve = f.sliding() + (f.at_rest() - f.sliding()) * share;
                assert!((curve - level).abs() < 1e-15, "{}", p.name());
            }
        }
        assert!(f.check_divisor().is_ok());
        assert_eq!(p.cast::<f32>().cast::<f32>(), p.cast::<f32>());
    }
    let named = |p: fn(&Friction<f64>) -> bool| -> Vec<&str> {
        FrictionParams::all().iter().filter(|q| p(&Friction::build(q).unwrap())).map(Choice::name).collect()
    };
    assert_eq!(named(|f| f.curve().is_some()), ["stribeck", "lugre", "dahl", "elasto_plastic", "maxwell"]);
    assert_eq!(named(|f| f.curve().is_some_and(|curve| curve.is_quick())), ["stribeck", "dahl"]);
    assert_eq!(named(|f| f.exponential().is_some()), ["stribeck", "coulomb"]);
    assert_eq!(named(|f| f.falls().is_some()), ["stribeck", "coulomb"]);
    assert_eq!(named(|f| f.bristles().is_some()), ["lugre", "dahl", "elasto_plastic", "maxwell"]);
}

#[test]
fn a_level_of_zero_is_a_friction_and_no_divisor() {
    let coulomb = CoulombParams { mu_static: 0.1, mu_dynamic: 0.0 };
    let e = Coulomb::<f64>::build(&coulomb).unwrap().check_divisor().unwrap_err();
    assert_eq!(e.field(), "mu_dynamic");
    for (mu_static, mu_dynamic, field) in [(0.0, 0.1, "mu_static"), (0.1, 0.0, "mu_dynamic")] {
        let p = StribeckParams { mu_static, mu_dynamic, ..StribeckParams::default() };
        assert_eq!(Stribeck::<f64>::build(&p).unwrap().check_divisor().unwrap_err().field(), field);
    }
}

#[test]
fn frictions_of_different_models_are_not_one() {
    let [one, other] = [0, 1].map(|i| Friction::<f64>::build(FrictionParams::all().get(i).unwrap()).unwrap());
    assert!(Friction::<f64>::in_lanes::<f64>(&|get| get(&one)).is_some_and(|f| f == one));
    for p in FrictionParams::<f64>::all() {
        let f = Friction::<f64>::build(&p).unwrap();
        assert_eq!(Friction::<f64>::in_lanes::<f64>(&|get| get(&f)), Some(f), "{}", p.name());
    }
    // Half of it is the one and half the other.
    let mixed = Friction::<f64>::in_lanes::<f64>(&|get| 0.5 * (get(&one) + get(&other)));
    assert_eq!(mixed, None);
}

#[test]
fn each_bad_parameter_of_bristles_is_named() {
    let elastic = ElastoPlasticParams { elastic: 0.15, ..ElastoPlasticParams::default() };
    assert_eq!(ElastoPlastic::<f64>::build(&elastic).unwrap_err().field(), "elastic");
    let shares = MaxwellParams { share_a: 0.6, ..MaxwellParams::default() };
    assert_eq!(Maxwell::<f64>::build(&shares).unwrap_err().field(), "share_c");
    let shares = MaxwellParams { share_h: 0.26, ..MaxwellParams::default() };
    assert_eq!(Maxwell::<f64>::build(&shares).unwrap_err().field(), "share_c");
    let beyond = MaxwellParams { share_f: 1.5, ..MaxwellParams::default() };
    assert_eq!(Maxwell::<f64>::build(&beyond).unwrap_err().field(), "share_f");
    let whole = MaxwellParams { share_a: 0.5, ..MaxwellParams::default() };
    assert!(Maxwell::<f64>::build(&whole).is_ok(), "the fourth may bear nothing");
    let stiff = DahlParams { stiffness: 0.0, ..DahlParams::default() };
    assert_eq!(Params::check(&FrictionParams::<f64>::from(stiff)).unwrap_err().field(), "stiffness");
}

#[test]
fn bristles_begin_as_a_spring_that_bends_with_the_shaft() {
    let names = [(1, 2000.0, true), (1, 2000.0, false), (1, 2000.0, true), (4, 3000.0, true)];
    for (bristles, (count, stiffness, damps)) in bristled().iter().zip(names) {
        assert_eq!((bristles.count(), bristles.stiffness(), bristles.damps()), (count, stiffness, damps));
        let none = Bend::none();
        let rate = bristles.rate(&none, 0.01);
        assert!(rate.iter().take(count).all(|r| *r == 0.01), "{rate:?}");
        // A µrad on the way it bears the stiffness times that, and the damping of the way.
        let mut bend = none;
        bend.each = bend.each.map(|_| 1e-6);
        let still = [0.0; ELEMENTS];
        let mu = bristles.coefficient(&bend, &still);
        assert!((mu - 1e-6 * stiffness).abs() < 1e-15, "{mu}");
        let damped = bristles.coefficient(&bend, &rate) - mu;
        assert!((damped > 0.0) == damps, "{damped}");
    }
}

#[test]
fn damping_is_that_of_bending_and_of_held_elements_by_their_shares() {
    let all = bristled();
    let (lugre, maxwell) = (all.first().unwrap(), all.last().unwrap());
    let none = Bend::none();
    assert!((lugre.coefficient(&none, &four([0.01, 0.0, 0.0, 0.0])) - 5.0 * 0.01).abs() < 1e-15);
    let mut bend = none;
    assert!((maxwell.coefficient(&bend, &[0.01; ELEMENTS]) - 0.01).abs() < 1e-15);
    // One that slides is not damped.
    bend.slides[1] = true;
    assert!((maxwell.coefficient(&bend, &[0.01; ELEMENTS]) - 0.0075).abs() < 1e-15);
}

#[test]
fn in_steady_sliding_bristles_bend_no_more_and_carry_the_curve() {
    for bristles in bristled() {
        for v in [-0.02, -1e-4, 3e-4, 0.5] {
            let bend = bristles.steady(v);
            let rate = bristles.rate(&bend, v);
            assert!(rate.iter().all(|r| r.abs() < 1e-12 * v.abs().max(1e-3)), "{rate:?} at {v} rad/s");
            let mu = bristles.coefficient(&bend, &[0.0; ELEMENTS]);
            assert!((mu - bristles.curve.coefficient(v)).abs() < 1e-12, "{mu} at {v} rad/s");
            assert!((bristles.bent(&bend, v) - 1.0).abs() < 1e-12);
            assert_eq!(bristles.settled(&bend, v), bend, "it goes on");
        }
        let rest = bristles.steady(0.0);
        assert_eq!(rest, Bend::none());
        assert_eq!(bristles.bent(&rest, 0.0), 0.0);
        assert!(bristles.stribeck_velocity() > 0.0);
    }
}

#[test]
fn a_held_load_is_carried_up_to_break_away_and_no_farther() {
    for bristles in bristled() {
        let most = bristles.curve.at_rest();
        for n in -12..=12 {
            let mu = f64::from(n) / 50.0;
            let carried = bristles.coefficient(&bristles.holding(mu), &[0.0; ELEMENTS]);
            assert!((carried - mu.clamp(-most, most)).abs() < 1e-12, "{carried} of {mu}");
        }
        let bend = bristles.holding(most);
        let farthest = bend.each.iter().fold(0.0_f64, |a, z| a.max(*z));
        assert!((bristles.deflection() - farthest).abs() < 1e-15 && farthest > 0.0);
    }
    // The stiffest element gives way first: 0.05/1600 rad, the softest last: 0.05/200 rad.
    let maxwell = bristled().pop().unwrap();
    let first = maxwell.holding(0.05).each;
    assert!((first[0] - 0.05 / 3000.0).abs() < 1e-15 && first[0] == first[3], "all as one: {first:?}");
    let later = maxwell.holding(0.15).each;
    assert!((later[0] - 0.05 / 1600.0).abs() < 1e-15 && later[3] > later[0], "{later:?}");
    assert!((maxwell.deflection() - 0.05 / 200.0).abs() < 1e-15);
}

#[test]
fn as_many_elements_are_used_as_bear_something_and_never_below_four() {
    let of = |p: MaxwellParams<f64>| Maxwell::build(&p).unwrap().bristles().unwrap();
    let shares =
        MaxwellParams { share_a: 0.1, share_b: 0.2, share_c: 0.1, share_e: 0.1, ..MaxwellParams::default() };
    let five = of(shares);
    assert_eq!((five.count(), five.stiffness()), (5, 3100.0));
    let eight = of(MaxwellParams { share_h: 0.25, share_g: 0.05, ..shares });
    assert_eq!((eight.count(), eight.stiffness()), (8, 3187.5));
    assert_eq!(
        of(MaxwellParams { share_a: 1.0, share_b: 0.0, share_c: 0.0, ..MaxwellParams::default() }).count(),
        4
    );
    // Each bears its share of steady sliding; the fourth what the others leave, and the sixth nothing.
    let bend = eight.steady(1.0);
    let mu = |i: usize, k: f64| bend.each.get(i).unwrap() * k / 0.15;
    for (i, k, share) in [(0, 1600.0, 0.1), (3, 200.0, 0.2), (4, 100.0, 0.1), (5, 50.0, 0.0), (7, 12.5, 0.25)]
    {
        assert!((mu(i, k) - share).abs() < 1e-12, "{i}");
    }
    // The softest gives way last: 0.25 · 0.2/12.5 rad.
    assert!((eight.deflection() - 0.25 * 0.2 / 12.5).abs() < 1e-15);
}

#[test]
fn elements_slide_beyond_their_share_and_hold_once_the_shaft_turns_round() {
    let maxwell = bristled().pop().unwrap();
    let (v, mut bend) = (1e-9, Bend::none());
    bend.each = four([0.06 / 1600.0, 0.04 / 800.0, 0.0, -0.06 / 200.0]);
    let slides = maxwell.settled(&bend, v).slides;
    assert_eq!(slides, four([true, false, false, false]), "the last is bent the other way");
    bend.slides = four([true; 4]);
    assert_eq!(maxwell.settled(&bend, v).slides, four([true, true, true, false]));
    assert_eq!(maxwell.settled(&bend, -v).slides, four([false, false, true, true]));
    // A sliding element comes to its share at the rate C, and not faster than the shaft.
    bend.each = four([0.0, 0.045 / 800.0, 0.0, 0.0]);
    let rate = maxwell.rate(&bend, 1e-3);
    assert_eq!(rate[0], 1e-3, "as fast as the shaft");
    let share = 0.25 - 0.045 / maxwell.curve.level(1e-3);
    assert!((rate[1] - 50.0 * share / 800.0).abs() < 1e-12, "{rate:?}");
}

#[test]
fn elasto_plastic_bristles_slide_only_beyond_their_elastic_part_and_when_they_bend_on() {
    let bristles = bristled().remove(2);
    let at = |mu: f64, v: f64| {
        let mut bend = Bend::none();
        bend.each[0] = mu / 2000.0;
        bristles.rate(&bend, v)[0] / v
    };
    let (v, level) = (1e-3, bristles.curve.level(1e-3));
    // The share of the motion that bends: all of it up to 0.12, none at steady sliding, half of the way between a half.
    assert_eq!((at(0.119, v), at(-0.119, -v)), (1.0, 1.0));
    assert_eq!(at(0.15, -v), 1.0, "it unbends");
    let half = (0.12 + level) / 2.0;
    assert!((at(half, v) - (1.0 - 0.5 * half / level)).abs() < 1e-9);
    assert!(at(level, v).abs() < 1e-12 && at(1.01 * level, v) < 0.0);
    // A quarter of the way: half a wave of a sine from 0 to 1.
    let quarter = 0.12 + 0.25 * (level - 0.12);
    let share = 0.5 - 0.5 * core::f64::consts::FRAC_PI_4.sin();
    assert!((at(quarter, v) - (1.0 - share * quarter / level)).abs() < 1e-9);
}

#[test]
fn damped_bristles_with_a_falling_curve_need_viscous_damping_to_be_passive() {
    let from: Vec<f64> = bristled().iter().map(Bristles::passive_from).collect();
    // σ_1 (μ_s − μ_d)/μ_d = 5 · 0.05/0.15 s/rad.
    assert!((from[0] - 5.0 / 3.0).abs() < 1e-12 && from[0] == from[2], "{from:?}");
    assert_eq!((from[1], from[3]), (0.0, 0.0));
}

/// docs/friction.md, "Numbers to begin with": each set that a model is published with can be written down, and is stiff and
/// strong as its source says.
#[test]
fn published_sets_of_bristles_are_in_range() {
    let curve = |mu_static, mu_dynamic, stribeck_velocity| LugreParams {
        mu_static,
        mu_dynamic,
        stribeck_velocity,
        ..LugreParams::default()
    };
    // For 1 kg, 1000 N, 1 N and 1000 N.
    let lugre = LugreParams { stiffness: 1e5, damping: 1e5_f64.sqrt(), ..curve(1.5, 1.0, 1e-3) };
    let dahl = DahlParams { mu_dynamic: 0.8, stiffness: 1e5 / 1000.0 };
    let elasto_plastic = ElastoPlasticParams {
        mu_static: 0.8,
        mu_dynamic: 0.2,
        stribeck_velocity: 0.1,
        stribeck_exponent: 2.0,
        stiffness: 1000.0,
        damping: 10.0,
        elastic: 0.02,
    };
    let maxwell = MaxwellParams {
        mu_static: 0.8,
        mu_dynamic: 0.4,
        stribeck_velocity: 0.5,
        stiffness_a: 12e6 / 1000.0,
        stiffness_b: 2.5e6 / 1000.0,
        stiffness_c: 0.71e6 / 1000.0,
        stiffness_d: 0.79e6 / 1000.0,
        share_a: 0.067,
        share_b: 0.056,
        share_c: 0.047,
        ..MaxwellParams::default()
    };
    let sets: [(FrictionParams<f64>, [f64; 3]); 4] = [
        (lugre.into(), [1.5, 1.0, 1e5]),
        (dahl.into(), [0.8, 0.8, 100.0]),
        (elasto_plastic.into(), [0.8, 0.2, 1000.0]),
        (maxwell.into(), [0.8, 0.4, 16_000.0]),
    ];
    for (params, [at_rest, sliding, stiffness]) in sets {
        let friction = Friction::<f64>::build(&params).unwrap();
        let bristles = friction.bristles().unwrap();
        assert_eq!((friction.at_rest(), friction.sliding()), (at_rest, sliding), "{}", params.name());
        assert!((bristles.stiffness() - stiffness).abs() < 1e-9, "{}", params.name());
        // Far beyond all bends each bears its share of the friction in motion.
        let bend = bristles.steady(1e3);
        let borne = bristles.coefficient(&bend, &bristles.rate(&bend, 1e3));
        assert!((borne - sliding).abs() < 1e-9, "{}: {borne}", params.name());
    }
}
