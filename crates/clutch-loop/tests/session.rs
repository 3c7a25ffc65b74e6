//! A session from Rust: refusals before anything moves, events in order, a summary that says how it ended.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use clutch_core::supervisor::Cause;
use clutch_log::{EventKind, Limits};
use clutch_loop::clearance::ClearanceError;
use clutch_loop::control_loop::OnDrift;
use clutch_loop::faults::Fault;
use clutch_loop::port::Address;
use clutch_loop::realtime::RealtimeOptions;
use clutch_loop::replay;
use clutch_loop::session::{Board, Event, Release, Session, SessionError, SessionOptions};
use clutch_loop::sim_board_server::PATIENCE;
use clutch_loop::summary::{Summary, Verdict};
use clutch_sim::Scenario;
use clutch_sim::progress::UNWATCHED;
use clutch_sim::scenario::ScalarKind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

fn scenario(name: &str, set: &[(&str, &str)]) -> Scenario {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    Scenario::load(name.as_ref(), &set).unwrap()
}

/// The machine's settings are not the subject.
fn options() -> SessionOptions {
    let realtime = RealtimeOptions { thread_priority: 0, lock_memory: false, ..RealtimeOptions::default() };
    SessionOptions { realtime, ..SessionOptions::default() }
}

fn faults(text: &str) -> Board {
    Board::Simulated { faults: vec![text.parse::<Fault>().unwrap()], seed: 1, strict: false }
}

/// Runs it; its summary, and the events without where the run stood.
fn run(session: &Session, stop: &Arc<AtomicBool>, stop_after_s: f64) -> (Summary, Vec<Event>) {
    let mut events = Vec::new();
    let summary = session.run(stop, &mut |event| match event {
        Event::Progress(p) => stop.store(p.time >= stop_after_s, Ordering::Relaxed),
        other => events.push(other),
    });
    (summary.unwrap(), events)
}

#[test]
fn what_can_be_refused_without_a_board_is_refused_before_one_is_looked_for() {
    let nowhere = Board::Daq("/dev/ttyNOTHERE7".parse::<Address>().unwrap());
    let options = SessionOptions { board: nowhere, ..options() };
    let refused = |scenario, options| Session::new(scenario, options).unwrap_err();
    let weak = scenario("board_smc_2", &[("law.smc.kp_v", "0.1")]);
    let refusal = refused(weak.clone(), options.clone());
    assert!(
        matches!(&refusal, SessionError::Clearance(ClearanceError::NotCertified { scenario, .. }) if *scenario == weak.name())
    );
    let asked_for = Session::new(weak, SessionOptions { uncertified: true, ..options.clone() }).unwrap();
    assert!(!asked_for.certified());

    // Certified in continuous time, and linearly unstable as sampled.
    let unstable = scenario("board_smc_2", &[("law", "{ pd = {} }"), ("rig.delay_ticks", "1")]);
    assert!(unstable.plan().unwrap().certificate.certified());
    let refusal = refused(unstable.clone(), options.clone());
    let said =
        "the sampled loop is linearly unstable, with a spectral radius up to 1.057, so nothing was started.";
    assert!(refusal.to_string().ends_with(said), "{refusal}");
    assert!(Session::new(unstable, SessionOptions { uncertified: true, ..options.clone() }).is_ok());

    let refusal = refused(scenario("pd_2", &[]), options.clone());
    assert!(refusal.to_string().contains("a run on a board needs a safe state"), "{refusal}");

    let log = std::env::temp_dir().join(format!("clutch-session-{}.mcap", std::process::id()));
    std::fs::write(&log, "the only record of a run").unwrap();
    let refusal =
        refused(scenario("board_smc_2", &[]), SessionOptions { log: Some(log.clone()), ..options.clone() });
    assert!(matches!(refusal, SessionError::Clearance(ClearanceError::LogExists { .. })), "{refusal}");
    assert_eq!(std::fs::read_to_string(&log).unwrap(), "the only record of a run");
    std::fs::remove_file(&log).unwrap();

    // And the port only when it runs.
    let session = Session::new(scenario("board_smc_2", &[]), options).unwrap();
    let refusal = session.run(&Arc::default(), &mut |event| panic!("{event:?}")).unwrap_err();
    assert!(refusal.to_string().starts_with("/dev/ttyNOTHERE7: there is no such device"), "{refusal}");
}

#[test]
fn a_board_that_closes_the_loop_gets_a_scenario_in_single_precision() {
    let double = scenario("board_smc_2", &[]);
    assert_eq!(double.scalar(), ScalarKind::F64);
    let address = "/dev/ttyNOTHERE7".parse::<Address>().unwrap();
    let options = SessionOptions { board: Board::Controller(address), ..options() };
    let session = Session::new(double.clone(), options).unwrap();
    assert_eq!(session.scenario().scalar(), ScalarKind::F32);
    let set = [("sampling.scalar", "f32")];
    assert_eq!(session.scenario().canonical(), scenario("board_smc_2", &set).canonical());
    let session = Session::new(double.clone(), self::options()).unwrap();
    assert_eq!(session.scenario().canonical(), double.canonical());
}

#[test]
fn limits_that_a_sound_shaft_will_meet_are_remarked_before_it_begins() {
    let remarks = |set: &[(&str, &str)]| {
        let set = [set, &[("run.duration_s", "0.3"), ("run.settle_s", "0.1")]].concat();
        let options = SessionOptions { uncertified: true, ..options() };
        let session = Session::new(scenario("board_smc_2", &set), options).unwrap();
        let (_, events) = run(&session, &Arc::default(), f64::INFINITY);
        let Some(Event::Announced(announcement)) = events.into_iter().next() else {
            panic!("nothing was announced")
        };
        announcement.remarks.join("\n")
    };
    let sign = ("law", "{ smc_sign = {} }");
    assert!(remarks(&[sign]).contains("set safety.limits.saturation_time_s to the duration of the run"));
    assert!(!remarks(&[sign, ("safety.limits.saturation_time_s", "0.3")]).contains("saturation_time_s"));
    // 1.745² / (2 · 27.7) rad.
    let fast = remarks(&[("reference.ramp.rate_deg_s", "100.0")]);
    assert!(fast.contains("the shaft falls 3.15° behind: more than the 3.00° of"), "{fast}");
    assert!(!remarks(&[("reference.ramp.rate_deg_s", "90.0")]).contains("behind"));
}

#[test]
fn a_bound_as_sampled_is_not_of_a_rig_whose_friction_falls_more_slowly() {
    let slower = |set: &[(&str, &str)]| {
        let scenario = scenario("board_smc_2", set);
        scenario.sampled(&scenario.plan().unwrap().bounds).slower_fall
    };
    assert_eq!(slower(&[]), None);
    let velocity = ("rig.friction.stribeck.stribeck_velocity_rad_s", "0.05");
    assert!(
        slower(&[velocity]).is_some_and(|fall| fall.contains("v_s 0.05 rad/s, δ 1, slower than v_s 0.001"))
    );
    assert!(slower(&[("rig.friction.stribeck.stribeck_exponent", "0.5")]).is_some());
    assert_eq!(slower(&[velocity, ("model.friction.stribeck.stribeck_velocity_rad_s", "0.05")]), None);
    assert_eq!(slower(&[velocity, ("rig.friction.stribeck.mu_static", "0.15")]), None, "there is no fall");
}

/// A scenario's certificate as sampled, in a file of its own.
fn saved(scenario: &Scenario, name: &str) -> std::path::PathBuf {
    let (_, certificate) = scenario.sampled(&scenario.plan().unwrap().bounds).prove().unwrap();
    let path = std::env::temp_dir().join(format!("clutch-session-{}-{name}.json", std::process::id()));
    std::fs::write(&path, serde_json::to_vec(&certificate).unwrap()).unwrap();
    path
}

#[test]
fn a_rig_outside_of_the_box_is_told_with_either_certificate() {
    // As sampled alone: in continuous time PD has no certificate at this rate. Noise and delay are a part of that box.
    let pd = [
        ("law", "{ pd = { kp_v_rad = 1660.0, kd_v_s_rad = 12.9 } }"),
        ("velocity.smoothed_derivative.smoothing", "0.712"),
        ("reference.ramp.rate_deg_s", "20.0"),
        ("rig.delay_ticks", "1"),
        ("rig.torque_noise_nm", "1e-5"),
        ("run.duration_s", "0.3"),
        ("run.settle_s", "0.1"),
    ];
    let file = saved(&scenario("board_smc_2", &pd), "outside");
    let gains = |set: &[(&str, &str)], certificate: Option<&std::path::PathBuf>| {
        let options = SessionOptions { certificate: certificate.cloned(), ..options() };
        let session = Session::new(scenario("board_smc_2", set), options).unwrap();
        let (_, events) = run(&session, &Arc::default(), f64::INFINITY);
        let Some(Event::Announced(announcement)) = events.into_iter().next() else {
            panic!("nothing was announced")
        };
        announcement.rows.iter().find(|(name, _)| *name == "gains").unwrap().1.clone()
    };
    let sampled = "not certified in continuous time; certified as sampled for the bounds given";
    let remark = ", outside of which the scenario's rig lies";
    assert_eq!(gains(&pd, Some(&file)), sampled);
    for outside in [
        ("rig.viscous_damping_nm_s_rad", "0.0012"),
        ("rig.friction.stribeck.mu_dynamic", "0.14"),
        ("rig.friction.stribeck.stribeck_velocity_rad_s", "0.002"),
    ] {
        assert_eq!(
            gains(&[&pd[..], &[outside]].concat(), Some(&file)),
            format!("{sampled}{remark}"),
            "{outside:?}"
        );
    }
    let damping =
        [("rig.viscous_damping_nm_s_rad", "0.0012"), ("run.duration_s", "0.3"), ("run.settle_s", "0.1")];
    assert_eq!(gains(&damping, None), format!("certified in continuous time for the bounds given{remark}"));
    std::fs::remove_file(file).unwrap();
}

#[test]
fn the_path_is_announced_run_to_its_end_and_done() {
    let session = Session::new(scenario("board_smc_2", &[("run.duration_s", "1.2")]), options()).unwrap();
    let (summary, events) = run(&session, &Arc::default(), f64::INFINITY);
    let [Event::Announced(announcement)] = &events[..] else { panic!("{events:?}") };
    assert_eq!(announcement.title, session.scenario().name());
    let row = |name: &str| announcement.rows.iter().find(|(n, _)| *n == name).unwrap().1.as_str();
    assert_eq!(row("gains"), "certified in continuous time for the bounds given");
    assert_eq!(
        row("as sampled"),
        "error bound UNCERTIFIED; linearly stable, spectral radius up to 0.948; sticks not excluded"
    );
    assert_eq!(
        (summary.verdict(), summary.report.cause, summary.report.ticks),
        (Verdict::Done, Cause::Done, 1200)
    );
    assert_eq!(summary.last_line(), "the path is done; the board is in its safe state");
    assert_eq!(summary.to_json()["verdict"], "done");
}

#[test]
fn a_stop_is_no_fault_and_a_fault_is_no_stop() {
    let session = Session::new(scenario("board_smc_2", &[]), options()).unwrap();
    let (summary, _) = run(&session, &Arc::default(), 0.2);
    assert_eq!((summary.verdict(), summary.report.board_safe), (Verdict::Stopped, true));
    assert!(summary.report.ticks < 5_000, "{}", summary.report.ticks);

    let options = SessionOptions { board: faults("loss:at=0.3"), ..options() };
    let session = Session::new(scenario("board_smc_2", &[("run.duration_s", "2.0")]), options).unwrap();
    let (summary, _) = run(&session, &Arc::default(), f64::INFINITY);
    assert_eq!((summary.verdict(), summary.report.cause), (Verdict::Fault, Cause::Board));
    assert_eq!(summary.last_line(), "FAULT: the board sees no encoder; the board is in its safe state");
}

#[test]
fn the_simulated_boards_clock_waits_for_no_answer_that_does_not_come() {
    // Ten times the load that is believed: samples that are not believed are not answered.
    let heavy = scenario("board_smc_2", &[("rig.drive.weight.mass_kg", "5")]);
    let session = Session::new(heavy, SessionOptions { uncertified: true, ..options() }).unwrap();
    let (summary, _) = run(&session, &Arc::default(), f64::INFINITY);
    assert_eq!(summary.verdict(), Verdict::Fault);
    let board = summary.board.unwrap();
    assert!(board.waited < PATIENCE.as_secs_f64(), "{board:?}");
}

#[test]
fn what_is_stopped_before_consent_moves_nothing() {
    let session = Session::new(scenario("board_smc_2", &[]), options()).unwrap();
    let stop = Arc::new(AtomicBool::new(true));
    let summary = session.run(&stop, &mut |_| ()).unwrap();
    assert_eq!((summary.verdict(), summary.report.begun), (Verdict::Stopped, false));
    assert_eq!(summary.last_line(), "stopped before the board was armed; its output is as it was");
}

#[test]
fn a_release_test_comes_first_and_what_fails_it_is_not_started() {
    let short = || scenario("board_smc_2", &[("run.duration_s", "1.1")]);
    let tested = SessionOptions { release: Release::Always, release_way: 0.3_f64.to_radians(), ..options() };
    let sound = Session::new(short(), tested.clone()).unwrap();
    let (summary, events) = run(&sound, &Arc::default(), f64::INFINITY);
    assert_eq!((summary.verdict(), summary.report.ticks), (Verdict::Done, 1100));
    let [Event::Announced(announcement)] = &events[..] else { panic!("{events:?}") };
    let (_, says) = announcement.rows.iter().find(|(name, _)| *name == "release").unwrap();
    assert!(says.contains("counts halved") && says.contains("at most 0.27°"), "{says}");

    for (fault, causes) in [
        ("scale:at=0,factor=2", &[Cause::TooFast][..]),
        // Too few counts, or none in the last two samples: where this machine stalls, the shaft falls a period later.
        ("scale:at=0,factor=0.5", &[Cause::TooSlow, Cause::StandStill]),
        ("dac-scale:at=0,factor=-1", &[Cause::TooFast]),
    ] {
        let wired = Session::new(short(), SessionOptions { board: faults(fault), ..tested.clone() }).unwrap();
        let mut announced = 0;
        let ended = wired.run(&Arc::default(), &mut |event| {
            announced += u32::from(matches!(event, Event::Announced(_)));
        });
        assert!(
            matches!(&ended, Err(SessionError::Released { cause, .. }) if causes.contains(cause)),
            "{fault}: {ended:?}"
        );
        assert_eq!(announced, 1);
    }
}

#[test]
fn a_release_test_that_cannot_be_is_refused_only_if_it_was_asked_for() {
    let always = SessionOptions { release: Release::Always, ..options() };
    let motion = scenario("board_smc_2", &[("run.start", "on_path")]);
    let refusal = Session::new(motion.clone(), always).unwrap_err();
    assert_eq!(refusal.to_string(), "SMC at 2 °/s on a board: no release test: the run begins in motion");
    assert!(Session::new(motion, options()).is_ok());
    let pressed = scenario("board_smc_2", &[("output.lowest_v", "0.1")]);
    let always = SessionOptions { release: Release::Always, ..options() };
    let refusal = Session::new(pressed.clone(), always).unwrap_err();
    assert!(
        refusal.to_string().ends_with("output.lowest_v is above 0: the brake never lets go"),
        "{refusal}"
    );
    assert!(Session::new(pressed, options()).is_ok());
    for way in [0.0, -1.0, f64::NAN, 0.2] {
        let refusal =
            Session::new(scenario("board_smc_2", &[]), SessionOptions { release_way: way, ..options() });
        let text = refusal.unwrap_err().to_string();
        assert!(text.contains("expected a number above 0 and at most 10 °"), "{way}: {text}");
    }
}

#[test]
fn a_drift_is_told_at_once_logged_replayed_and_ends_the_run_where_that_was_asked_for() {
    let fast =
        [("reference.ramp.rate_deg_s", "10"), ("run.duration_s", "30"), ("bounds.friction_percent", "10")];
    let log = std::env::temp_dir().join(format!("clutch-drift-{}.mcap", std::process::id()));
    let options = SessionOptions {
        board: faults("dac-scale:at=2.5,factor=1.25"),
        on_drift: OnDrift::Stop,
        log: Some(log.clone()),
        uncertified: true,
        ..options()
    };
    let session = Session::new(scenario("board_smc_2", &fast), options).unwrap();
    let mut told = Vec::new();
    let summary = session
        .run(&Arc::default(), &mut |event| {
            if let Event::Drift(text) = event {
                told.push(text);
            }
        })
        .unwrap();
    let report = &summary.report;
    assert_eq!((summary.verdict(), report.cause), (Verdict::Stopped, Cause::Operator));
    assert!(report.ended_by_drift && report.board_safe);
    assert_eq!(
        summary.last_line(),
        "stopped as friction over load left the bounds; the board is in its safe state"
    );
    let first = report.drift.first.unwrap();
    // Sixteen slices of a tenth of a second.
    assert!((2_500..5_500).contains(&first.tick), "{first:?}");
    assert!(report.ticks >= first.tick && report.ticks < first.tick + 500, "{} {first:?}", report.ticks);
    assert_eq!(told, [report.drift.alarm_line().unwrap()]);
    assert!(summary.remarks().contains(&told[0]));
    let json = summary.to_json();
    assert_eq!((&json["ended_by_drift"], &json["drift"]["alarms"]), (&true.into(), &1.into()));
    assert!((json["drift"]["first_alarm_s"].as_f64().unwrap() - first.tick as f64 * 1e-3).abs() < 1e-9);

    let written = clutch_log::read(&log, &Limits::default()).unwrap();
    let event = written.events.iter().find(|e| e.kind == EventKind::Drift as u8).unwrap();
    assert_eq!((event.tick, event.value), (first.tick, first.seen.friction));
    // A log has every sample that the loop had.
    assert_eq!(replay::drift(&written, session.scenario(), UNWATCHED).unwrap(), report.drift);
    std::fs::remove_file(&log).unwrap();
}
