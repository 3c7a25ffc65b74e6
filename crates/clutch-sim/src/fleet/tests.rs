//! Fleets in lanes against fleets alone, and these against servo and rig.

use super::*;
use crate::lane::vector::levels;
use crate::lanes::tests::built_in;
use crate::progress::UNWATCHED;
use crate::run::Keep;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn scenario(name: &str, set: &[(&str, &str)]) -> Scenario {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    built_in(name, &set)
}

/// All that is reported of a fleet, as bits; shaft by shaft within a quantity.
fn told(fleet: &Fleet) -> Vec<u64> {
    let mut numbers = Vec::new();
    (0..Fleet::QUANTITIES.len()).for_each(|quantity| fleet.tell(quantity, &mut numbers));
    numbers.into_iter().map(f64::to_bits).collect()
}

fn row(fleet: &Fleet, quantity: Quantity) -> Vec<f64> {
    let mut numbers = Vec::new();
    fleet.tell(quantity as usize, &mut numbers);
    numbers
}

/// Shafts that move in lanes now.
fn in_lanes(fleet: &Fleet) -> usize {
    fleet.blocks.iter().flat_map(|block| &block.shafts).filter(|shaft| shaft.alone.is_none()).count()
}

/// A period of agents that mostly do what the law does, with noise; some let go, some brake; now and then a shaft begins
/// anew.
fn play(fleet: &mut Fleet, rng: &mut Pcg64) {
    let mut volts = row(fleet, Quantity::LawVoltage);
    for (i, volts) in volts.iter_mut().enumerate() {
        let chance = rng.random::<f64>();
        *volts = match i % 4 {
            0 => *volts,
            1 => *volts + 0.3 * (chance - 0.5),
            2 if chance < 0.3 => 0.0,
            3 if chance < 0.3 => 12.0 * chance,
            _ => *volts,
        };
        let seed = rng.random_range(1..1000);
        if rng.random::<f64>() < 0.01 {
            fleet.reset(i, seed).unwrap();
        }
    }
    fleet.step(&volts).unwrap();
}

/// Fleets of a scenario at every level, step by step against the same fleet alone; how many shafts end in lanes, and whether
/// their laws do.
fn same_bits(scenario: &Scenario, shafts: u64, steps: usize) -> (usize, bool) {
    let seeds: Vec<u64> = (1..=shafts).collect();
    let mut went = (0, false);
    for (_, level) in levels() {
        let mut alone = Fleet::by(None, scenario, &seeds).unwrap();
        let mut together = Fleet::by(Some(level), scenario, &seeds).unwrap();
        assert_eq!((alone.len(), in_lanes(&alone)), (seeds.len(), 0));
        assert_eq!(told(&together), told(&alone), "{level:?} at the beginning");
        let mut dice = [Pcg64::seed_from_u64(5), Pcg64::seed_from_u64(5)];
        for k in 0..steps {
            play(&mut alone, &mut dice[0]);
            play(&mut together, &mut dice[1]);
            assert_eq!(told(&together), told(&alone), "{level:?} after step {k}");
        }
        went = (in_lanes(&together), together.blocks[0].laws);
    }
    went
}

/// A built-in scenario, and values of some of its keys.
type Case<'a> = (&'a str, &'a [(&'a str, &'a str)]);

#[test]
fn shafts_in_lanes_have_the_bits_of_shafts_alone() {
    let bench = ("rig.base", "\"bench\"");
    let lags = ("rig.actuator_time_constant_s", "0.002");
    let runout = ("rig.runout", "{ amplitude = 0.05, waves_per_turn = 2, phase_deg = 30.0 }");
    let bumpless = ("output.bumpless_time_s", "0.1");
    let jerk = ("reference", "{ minimum_jerk = { distance_deg = 8.0, duration_s = 0.4 } }");
    let cases: [Case<'_>; 21] = [
        ("pd_2", &[]),
        ("pd_2", &[("rig.delay_ticks", "1"), bumpless]),
        ("pd_2", &[("rig.delay_ticks", "7"), jerk]),
        ("pd_2", &[("rig.encoder.quantised", "false"), ("rig.dac.quantised", "false")]),
        ("pd_2", &[("run.start", "rest"), ("rig.friction", "{ coulomb = { mu_static = 0.2 } }")]),
        ("pd_2", &[("rig.friction.stribeck.stribeck_velocity_rad_s", "1e-5")]),
        ("pd_2", &[("law", "{ voltage = { start_v = 1.0, end_v = 3.0, rate_v_s = 9.0 } }"), bumpless]),
        ("pd_2", &[("law", "{ hold = {} }")]),
        ("smc_2", &[]),
        ("smc_2", &[("law", "{ smc_sign = {} }"), ("rig.base", "\"paper\"")]),
        ("smc_2", &[("law", "{ super_twisting = {} }"), bumpless]),
        ("smc_2", &[("law", "{ smc_integral = {} }"), bench]),
        ("smc_2", &[("law", "{ dob = {} }"), ("rig.delay_ticks", "1")]),
        ("ctc_2", &[]),
        ("bench_pid_2", &[("rig.base", "\"paper\""), ("law.pid.derivative_time_s", "0.002"), bumpless]),
        ("motor_pid", &[]),
        ("motor_pid", &[("rig.actuator_time_constant_s", "0.003")]),
        ("bench_smc_2", &[]),
        ("bench_pd_2", &[runout, lags, ("rig.delay_ticks", "2")]),
        ("pd_2", &[lags]),
        ("pd_2", &[bench, ("run.start", "rest"), ("run.engine", "dormand_prince")]),
    ];
    for (name, set) in cases {
        assert_eq!(same_bits(&scenario(name, set), 11, 300), (11, true), "{name} {set:?}");
    }
}

#[test]
fn shafts_in_lanes_whose_laws_have_none_have_the_bits_of_shafts_alone() {
    let shell = ("shell.boundary_rad_s", "0.1");
    for (name, set) in [("f32_smc_2", &[][..]), ("bench_glide_2", &[]), ("pd_2", &[shell])] {
        assert_eq!(same_bits(&scenario(name, set), 9, 300), (9, false), "{name} {set:?}");
    }
}

#[test]
fn rigs_that_are_not_for_lanes_go_alone() {
    for set in [
        ("rig.torque_noise_nm", "0.001"),
        ("rig.friction", "{ dahl = {} }"),
        ("rig.drive", "{ sine = { mean_nm = 0.05, amplitude_nm = 0.01, frequency_hz = 1.0 } }"),
    ] {
        assert_eq!(same_bits(&scenario("pd_2", &[set]), 5, 100).0, 0, "{set:?}");
    }
}

#[test]
fn any_number_of_shafts_goes_in_lanes_but_for_few() {
    for (shafts, in_lanes) in [(1, 0), (2, 0), (3, 3), (8, 8), (17, 17), (2 * TOGETHER as u64 + 3, 67)] {
        assert_eq!(same_bits(&scenario("smc_2", &[]), shafts, 120).0, in_lanes, "{shafts}");
    }
}

#[test]
fn agents_that_play_the_law_have_the_samples_of_runs() {
    let noise = ("rig.torque_noise_nm", "0.001");
    for (name, more) in [
        ("smc_2", &[][..]),
        ("bench_smc_2", &[]),
        ("bench_glide_2", &[]),
        ("f32_smc_2", &[]),
        ("observer_smc_2", &[]),
        ("minimum_jerk", &[]),
        ("smc_2", &[noise, ("rig.delay_ticks", "3")]),
    ] {
        let set: Vec<_> = more.iter().copied().chain([("run.duration_s", "1.2")]).collect();
        let (scenario, seeds) = (scenario(name, &set), [4, 1, 9, 2]);
        let mut fleet = Fleet::new(&scenario, &seeds).unwrap();
        let runs: Vec<_> = seeds
            .iter()
            .map(|seed| {
                let seeded = scenario.changed(&[("run.seed".into(), (*seed as i64).into())]).unwrap();
                seeded.run(Keep::Trace, UNWATCHED).unwrap().trace
            })
            .collect();
        for k in 0..runs[0].time.len() {
            for (i, run) in runs.iter().enumerate() {
                let of = |quantity| row(&fleet, quantity)[i].to_bits();
                let what = format!("{name} {more:?}: shaft {i} at tick {k}");
                assert_eq!(of(Quantity::Time), run.time[k].to_bits(), "{what}");
                assert_eq!(of(Quantity::Position), run.position[k].to_bits(), "{what}");
                assert_eq!(of(Quantity::Velocity), run.velocity[k].to_bits(), "{what}");
                assert_eq!(of(Quantity::ErrorRate), run.error_rate[k].to_bits(), "{what}");
                assert_eq!(of(Quantity::TargetVelocity), run.target_velocity[k].to_bits(), "{what}");
                assert_eq!(of(Quantity::LawVoltage), run.voltage[k].to_bits(), "{what}");
            }
            let law = row(&fleet, Quantity::LawVoltage);
            fleet.step(&law).unwrap();
        }
    }
}

#[test]
fn a_shaft_that_lanes_lose_goes_on_alone_until_it_begins_anew() {
    // Light, fast, and with as many counts as there are: let go, it is beyond what lanes count after 0.4 s.
    let far = [
        ("rig.encoder.counts_per_rev", "16777216"),
        ("rig.inertia_kg_m2", "1e-5"),
        ("rig.viscous_damping_nm_s_rad", "0"),
    ];
    let scenario = scenario("pd_2", &far);
    for (_, level) in levels() {
        let seeds = [1, 2, 3, 4, 5];
        let mut alone = Fleet::by(None, &scenario, &seeds).unwrap();
        let mut together = Fleet::by(Some(level), &scenario, &seeds).unwrap();
        let mut fewest = seeds.len();
        for k in 0..600 {
            for fleet in [&mut alone, &mut together] {
                let mut volts = row(fleet, Quantity::LawVoltage);
                (volts[1], volts[4]) = (0.0, 0.0);
                if k == 550 {
                    fleet.reset(4, 9).unwrap();
                }
                fleet.step(&volts).unwrap();
            }
            fewest = fewest.min(in_lanes(&together));
            assert_eq!(told(&together), told(&alone), "{level:?} after step {k}");
        }
        assert_eq!((fewest, in_lanes(&together)), (3, 4));
    }
}

#[test]
fn a_motion_that_cannot_be_followed_is_told_until_its_shaft_begins_anew() {
    // A motor turns with whatever it is given; with a lag in steps, without by the exact flow.
    for lag in [&[][..], &[("rig.actuator_time_constant_s", "0.003")]] {
        let set: Vec<_> = lag.iter().copied().chain([("rig.dac.quantised", "false")]).collect();
        let scenario = scenario("motor_pid", &set);
        for level in [None].into_iter().chain(levels().into_iter().map(|(_, level)| Some(level))) {
            let mut fleet = Fleet::by(level, &scenario, &[1, 2, 3, 4]).unwrap();
            let mut volts = row(&fleet, Quantity::LawVoltage);
            fleet.step(&volts).unwrap();
            volts[2] = f64::MAX;
            let broken = fleet.step(&volts).unwrap_err();
            assert_eq!(broken, EngineError::NotFinite { time: 1e-3 }, "{level:?}");
            assert_eq!(row(&fleet, Quantity::Time), [2e-3, 2e-3, 1e-3, 2e-3]);
            volts[2] = 2.0;
            assert_eq!(fleet.step(&volts), Err(broken));
            fleet.reset(2, 7).unwrap();
            fleet.step(&volts).unwrap();
            assert_eq!(row(&fleet, Quantity::Time), [4e-3, 4e-3, 0.0, 4e-3]);
        }
    }
}

#[test]
fn a_seed_out_of_range_is_refused_and_changes_nothing() {
    let scenario = scenario("smc_2", &[]);
    let mut fleet = Fleet::new(&scenario, &[1, 2, 3]).unwrap();
    assert_eq!(fleet.reset(1, u64::MAX).unwrap_err().key, "run.seed");
    let law = row(&fleet, Quantity::LawVoltage);
    fleet.step(&law).unwrap();
    assert_eq!(row(&fleet, Quantity::Time), [1e-3; 3]);
    assert!(Fleet::new(&scenario, &[u64::MAX]).is_err());
    assert!(Fleet::new(&scenario, &[]).unwrap().is_empty());
}
