//! The referee's cases: every one within its tolerance, on every engine that takes it.

use clutch_sim::referee::{BUILT_IN, Case, ENGINES, RefereeEngine, RefereeError, run};

fn cases() -> Vec<Case> {
    BUILT_IN.iter().map(|(name, text)| Case::parse(name, text).unwrap_or_else(|e| panic!("{e}"))).collect()
}

/// Runs it on an engine, if that takes it.
fn takes(case: &Case, engine: RefereeEngine) -> Option<clutch_sim::referee::Trajectory> {
    match run(case, engine, None) {
        Ok(trajectory) => Some(trajectory),
        Err(RefereeError::NotForIt(_)) => None,
        Err(e) => panic!("{} on {}: {e}", case.id, engine.name()),
    }
}

#[test]
fn every_case_holds_on_every_engine_that_takes_it() {
    let mut missed = String::new();
    let mut figures = [0; ENGINES.len()];
    for case in cases() {
        let before: usize = figures.iter().sum();
        for (count, engine) in figures.iter_mut().zip(ENGINES) {
            let Some(trajectory) = takes(&case, engine) else { continue };
            trajectory.check(&case).unwrap();
            for verdict in case.judge(&trajectory) {
                *count += 1;
                if !verdict.holds() {
                    missed += &format!("{} on {}: {verdict:?}\n", case.id, engine.name());
                }
            }
        }
        assert!(figures.iter().sum::<usize>() > before, "no engine takes {}", case.id);
    }
    assert_eq!(missed, "");
    // Each engine has been judged, not skipped.
    for (engine, (count, least)) in ENGINES.iter().zip(figures.iter().zip([50, 25, 30, 20, 20])) {
        assert!(*count >= least, "{}: {count} figures", engine.name());
    }
}

#[test]
fn a_case_that_expects_something_else_fails() {
    for (name, text) in BUILT_IN {
        let case = Case::parse(name, text).unwrap();
        // Each expectation off by three times what it allows, or a millionth where it allows nothing.
        let off = |e: &clutch_sim::referee::Expect| {
            e.value + 3.0 * e.within + if e.within == 0.0 { 1e-6 } else { 0.0 }
        };
        let wrong = Case {
            expect: case
                .expect
                .iter()
                .cloned()
                .map(|e| {
                    let value = off(&e);
                    clutch_sim::referee::Expect { value, ..e }
                })
                .collect(),
            ..case
        };
        for engine in ENGINES {
            if let Some(trajectory) = takes(&wrong, engine) {
                assert!(wrong.judge(&trajectory).iter().all(|v| !v.holds()), "{name} on {}", engine.name());
            }
        }
    }
}

#[test]
fn figures_of_bristles_do_not_depend_on_the_period_in_which_the_motion_is_asked() {
    let mut compared = [0; 2];
    for (compared, engine) in compared.iter_mut().zip([RefereeEngine::Bristle, RefereeEngine::BristledSystem])
    {
        for case in cases() {
            if takes(&Case { duration: case.sample, ..case.clone() }, engine).is_some() {
                *compared += independent_of_the_period(case, engine);
            }
        }
    }
    assert!(compared[0] > 60 && compared[1] > 30, "{compared:?} figures");
}

#[test]
#[ignore = "takes minutes: cargo test --test physics -- --ignored"]
fn figures_of_hunting_and_of_lag_are_the_same_at_a_millisecond_a_tenth_and_a_hundredth() {
    for engine in [RefereeEngine::Bristle, RefereeEngine::BristledSystem] {
        let mut compared = 0;
        for mut case in cases().into_iter().filter(|case| case.id == "L2" || case.id.starts_with("L6")) {
            if takes(&Case { duration: case.sample, ..case.clone() }, engine).is_none() {
                continue;
            }
            // A whole number of samples, of 1 ms or a little less.
            case.sample = case.duration / f64::from((case.duration / 1e-3 - 1e-6) as u32 + 1);
            compared += same_at(&case, engine, &[1.0, 0.1, 0.01]);
        }
        println!("{}: {compared} figures", engine.name());
        assert!(compared >= 4, "{}: {compared} figures", engine.name());
    }
}

/// Compares figures of a case at 1 ms, 0.1 ms and 10 µs, or these parts of its time between samples where that is longer.
fn independent_of_the_period(mut case: Case, engine: RefereeEngine) -> usize {
    case.sample = case.sample.max(1e-3).min(case.duration / 20.0);
    // The 200 s of L2 would take minutes; so would 10 µs for more than 2000 samples of a system.
    let shares: &[f64] = match case.samples() {
        100_000.. => &[1.0, 0.25],
        2_000.. if engine == RefereeEngine::BristledSystem => &[1.0, 0.1],
        _ => &[1.0, 0.1, 0.01],
    };
    same_at(&case, engine, shares)
}

/// Compares figures of a case at these shares of the time between its samples; sampled alike, so that like is compared with like.
fn same_at(case: &Case, engine: RefereeEngine, shares: &[f64]) -> usize {
    let figures = |share: f64| {
        let trajectory = run(case, engine, Some(case.sample * share)).unwrap();
        case.judge(&trajectory)
    };
    let finest = figures(shares[shares.len() - 1]);
    let mut compared = 0;
    for share in &shares[..shares.len() - 1] {
        for (a, b) in figures(*share).iter().zip(&finest) {
            assert_eq!(a.measured.is_some(), b.measured.is_some(), "{} {}", case.id, a.name);
            let (Some(x), Some(y)) = (a.measured, b.measured) else { continue };
            let what = || format!("{} on {}, {}", case.id, engine.name(), a.name);
            assert!((x - y).abs() <= 1e-6 * y.abs().max(1e-9), "{}: {x} and {y}", what());
            compared += 1;
        }
    }
    compared
}

#[test]
fn a_file_with_numbers_out_of_all_proportion_is_refused_or_read_and_nothing_panics() {
    let (mut refused, mut taken) = (0, 0);
    for (name, text) in BUILT_IN {
        let numbers: Vec<(usize, &str)> = text
            .match_indices(|c: char| c.is_ascii_digit() || c == '.' || c == '-')
            .filter(|(i, _)| !text[..*i].ends_with(|c: char| c.is_ascii_alphanumeric() || "._-".contains(c)))
            .collect();
        for (begin, _) in numbers {
            let end = text[begin..].find(|c: char| !(c.is_ascii_alphanumeric() || "._-+".contains(c)));
            let end = end.map_or(text.len(), |n| begin + n);
            for other in ["nan", "-inf", "-1.0", "0.0", "0", "1e308", "\"x\"", "9223372036854775807", "[]"] {
                let changed = format!("{}{other}{}", &text[..begin], &text[end..]);
                match Case::parse(name, &changed) {
                    Ok(case) => {
                        taken += 1;
                        assert!(case.samples() <= 5_000_000);
                    }
                    Err(e) => {
                        refused += 1;
                        assert!(e.to_string().starts_with(name), "{e}");
                    }
                }
            }
        }
    }
    assert!(refused > 1000 && taken > 500, "{refused} refused, {taken} taken");
}

#[test]
fn each_mistake_in_a_case_is_named() {
    let good = BUILT_IN.iter().find(|(name, _)| *name == "A5").unwrap().1;
    Case::parse("mine", good).unwrap();
    for (from, to, said) in [
        (
            "inertia = [[1.0]]",
            "inertia = [[-1.0]]",
            "mechanism.inertia: expected a symmetric, positive definite matrix",
        ),
        ("inertia = [[1.0]]", "inertia = [[1.0, 0.0]]", "mechanism.inertia: expected 1 rows of 1 numbers"),
        ("stiffness = [[2.0]]", "spring = [[2.0]]", "unknown field `spring`"),
        ("velocity = [0.1]", "velocity = [0.1, 0.2]", "mechanism.velocity: 2 numbers; expected 1"),
        ("joints = [1.0]", "joints = []", "mechanism.row[1].joints = []: expected 1 finite numbers"),
        (
            "constant = 1.0",
            "constant = inf",
            "mechanism.row[1].normal.constant = inf: expected a finite number",
        ),
        (
            "constant = 1.0",
            "from_s = -1",
            "mechanism.row[1].normal.from_s = -1: expected a time of at least 0 s",
        ),
        (
            "mu_static = 1.5",
            "mu_static = -1.5",
            "mechanism.row[1].friction.coulomb.mu_static = -1.5: expected",
        ),
        ("mu_static = 1.5", "mu_static = 0.5", "mechanism.row[1].friction.coulomb.mu_static"),
        ("coulomb = {", "colomb = {", "mechanism.row[1].friction.colomb: unknown key: did you mean coulomb?"),
        ("duration_s = 60", "duration_s = -60", "duration_s = -60: expected a number above 0"),
        (
            "sample_s = 0.001",
            "sample_s = 0.7",
            "sample_s = 0.7: expected duration_s = 60 divided by a whole number",
        ),
        ("sample_s = 0.001", "", "sample_s: missing"),
        ("still = 0.001", "still = 0", "still = 0: expected a number above 0"),
        ("within = 1e-09", "within = -1", "expect[1].within = -1: expected a number of at least 0"),
        (
            "kind = \"slip_time\", number = 3",
            "kind = \"slip_time\", number = 0",
            "expect[1].observe.number = 0: expected",
        ),
        ("kind = \"slip_time\", number = 3", "kind = \"slip_tim\"", "unknown variant `slip_tim`"),
        (
            "kind = \"slip_time\", number = 3",
            "kind = \"slip_time\", row = 2",
            "expect[1].observe.row = 2: expected the number of a row",
        ),
        (
            "kind = \"slip_time\", number = 3",
            "kind = \"slip_time\", at_s = 2",
            "expect[1].observe.at_s: this kind takes none",
        ),
        (
            "kind = \"slip_time\", number = 3",
            "kind = \"at\", at_s = 2.0",
            "expect[1].observe.position, velocity, torque: none given",
        ),
        (
            "kind = \"slip_time\", number = 3",
            "kind = \"at\", position = [1.0]",
            "expect[1].observe.at_s: missing",
        ),
        (
            "kind = \"slip_time\", number = 3",
            "kind = \"at\", position = [1.0], at_s = 61.0",
            "at_s = 61: expected a time from 0 to duration_s = 60",
        ),
        (
            "kind = \"slip_time\", number = 3",
            "kind = \"at\", torque = [1.0, 1.0], at_s = 6.0",
            "torque: 2 weights; expected 1",
        ),
        ("kind = \"slip_time\", number = 3", "kind = \"metric\", metric = \"x\"", "metrics are of scenarios"),
    ] {
        assert!(good.contains(from), "{from}");
        let e = Case::parse("mine", &good.replacen(from, to, 1)).expect_err(to).to_string();
        assert!(e.starts_with("mine: ") && e.contains(said), "{to}:\n{e}\ninstead of\n{said}");
    }
}

/// A case of the belt's file, with another mechanism and one expectation.
fn other(mechanism: &str, duration: &str, observe: &str) -> Case {
    let text = format!(
        "id = \"x\"\ntitle = \"x\"\nsource = \"x\"\nduration_s = {duration}\nsample_s = 0.001\n[mechanism]\n{mechanism}\n\
         [[mechanism.row]]\njoints = [1.0]\nnormal = [{{ constant = 0.25 }}]\n\
         friction.coulomb = {{ mu_static = 1.0, mu_dynamic = 1.0 }}\n\
         [[expect]]\nname = \"x\"\nvalue = 0.0\nwithin = 1.0\nobserve = {observe}\n"
    );
    Case::parse("x", &text).unwrap_or_else(|e| panic!("{e}"))
}

fn measured(case: &Case, engine: RefereeEngine) -> Option<f64> {
    case.judge(&run(case, engine, None).unwrap())[0].measured
}

#[test]
fn an_extreme_at_the_edge_of_a_window_is_the_value_there() {
    // From 1 m/s with 0.25 m/s²: 0.875 m after a second, and on the way to 2 m.
    let observe = "{ kind = \"highest\", position = [1.0], to_s = 1.0 }";
    let case = other("inertia = [[1.0]]\nvelocity = [1.0]", "5", observe);
    let way = measured(&case, RefereeEngine::System).unwrap();
    assert!((way - 0.875).abs() < 1e-9, "{way}");
}

#[test]
fn a_mass_that_turns_round_has_not_begun_to_slip() {
    let spring = "inertia = [[1.0]]\nstiffness = [[100.0]]\nvelocity = [1.0]";
    let case = other(spring, "0.5", "{ kind = \"slips\" }");
    for engine in [RefereeEngine::System, RefereeEngine::DormandPrince] {
        assert_eq!(measured(&case, engine), None, "{}", engine.name());
        let trajectory = run(&case, engine, None).unwrap();
        if engine == RefereeEngine::System {
            assert_eq!(trajectory.events, Some(vec![]));
        }
    }
}

#[test]
fn what_no_engine_can_follow_ends_with_a_word() {
    let strong = other("inertia = [[0.001]]\nload = [[{ constant = 1e308 }]]", "1", "{ kind = \"slips\" }");
    for engine in [RefereeEngine::System, RefereeEngine::DormandPrince, RefereeEngine::ExactFlow] {
        assert!(run(&strong, engine, None).is_err(), "{}", engine.name());
    }
    let plain = other("inertia = [[1.0]]\nvelocity = [1.0]", "1", "{ kind = \"slips\" }");
    for step in [1e-300, 1e-14, 0.0, -1.0, f64::NAN, 0.0007] {
        let e = run(&plain, RefereeEngine::DormandPrince, Some(step)).unwrap_err();
        assert!(matches!(e, RefereeError::Step { .. }), "{e}");
    }
}

#[test]
fn what_a_case_cannot_pose_is_refused_by_its_name() {
    let good = BUILT_IN.iter().find(|(name, _)| *name == "A5").unwrap().1;
    let row = "joints = [1.0]";
    for (from, to, said) in [
        (
            row,
            "joints = [1.0]\nnormal_force_of = 0",
            "mechanism.row[1].normal_force_of: cannot be posed: a normal force",
        ),
        (
            row,
            "joints = [1.0]\nreaction_of = [1]",
            "mechanism.row[1].reaction_of: cannot be posed: a normal force",
        ),
        (
            row,
            "joints = [0.0]",
            "mechanism.row[1].joints: 0 of each joint: expected a row that one of them moves",
        ),
        (row, "joints = [1.0, 2.0]", "mechanism.row[1].joints = [1.0, 2.0]: expected 1 finite numbers"),
        ("constant = 1.0", "of = 1", "mechanism.row[1].normal[1].of: cannot be posed: a normal force"),
        (row, "joints = [1.0]\nrestitution = 0.5", "mechanism.row[1].restitution: cannot be posed: impacts"),
        ("inertia =", "backlash = 0.01\ninertia =", "mechanism.backlash: cannot be posed: backlash"),
        ("inertia =", "gap_rad = [0.01]\ninertia =", "mechanism.gap_rad: cannot be posed: backlash"),
        ("[mechanism]", "[[impact]]\nat = 1.0\n\n[mechanism]", "impact: cannot be posed: impacts"),
        (
            "[mechanism]",
            "[mechanism]\nimpact = { restitution = 0.3 }",
            "mechanism.impact: cannot be posed: impacts; velocities here do not jump",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let error = Case::parse("mine", &good.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.starts_with(&format!("mine: {said}")), "{to}: {error}");
    }
}
