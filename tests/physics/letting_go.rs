//! Rows that let go, or stop, for less than a step of the engine of systems: the instants, by formulas.

use crate::draw::Draw;
use crate::linear::Linear;
use clutch_core::Friction;
use clutch_core::friction::{CoulombParams, FrictionModel};
use clutch_sim::referee::{Case, RefereeEngine, run};
use clutch_sim::system::{Mode, Motion, System, SystemEvent, SystemState};
use nalgebra::{SMatrix, SVector};
use std::f64::consts::{PI, TAU};

/// A sine that a joint is loaded with.
#[derive(Clone, Copy, Debug, Default)]
struct Sine {
    amplitude: f64,
    hz: f64,
    turns: f64,
}

impl Sine {
    fn toml(&self) -> String {
        format!(
            "{{ amplitude = {:?}, frequency_hz = {:?}, phase_turns = {:?} }}",
            self.amplitude, self.hz, self.turns
        )
    }

    /// The first time after 0 at which its absolute value reaches a limit.
    fn reaches(&self, limit: f64) -> f64 {
        let share = (limit / self.amplitude).asin() / TAU;
        let after = |turns: f64| (turns - self.turns).rem_euclid(0.5);
        after(share).min(after(-share)) / self.hz
    }
}

/// A row: its joints, its normal force as a signal, its static coefficient.
type Rubs<'a> = (&'a [f64], String, f64);

/// Instants at which rows let go or hold, of a mechanism from rest.
fn instants(
    inertia: &str,
    more: &str,
    load: &[String],
    rows: &[Rubs<'_>],
    duration: f64,
) -> Vec<(f64, usize, bool)> {
    let mut text = format!(
        "id = \"x\"\ntitle = \"x\"\nsource = \"analytic\"\nduration_s = {duration:?}\nsample_s = {duration:?}\n\
         [mechanism]\ninertia = {inertia}\nload = [{}]\n{more}\n",
        load.iter().map(|load| format!("[{load}]")).collect::<Vec<_>>().join(", ")
    );
    for (joints, normal, mu) in rows {
        text += &format!(
            "[[mechanism.row]]\njoints = {joints:?}\nnormal = [{normal}]\n\
             friction.coulomb = {{ mu_static = {mu:?}, mu_dynamic = {:?} }}\n",
            0.75 * mu
        );
    }
    text += "[[expect]]\nname = \"slips\"\nvalue = 0.0\nwithin = 1.0\nunit = \"s\"\nobserve = { kind = \"slips\" }\n";
    let case = Case::parse("x", &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let events = run(&case, RefereeEngine::System, None).unwrap().events.unwrap();
    events.iter().map(|e| (e.time, e.row, e.holds)).collect()
}

fn steady(x: f64) -> String {
    format!("{{ constant = {x:?} }}")
}

#[test]
fn a_row_lets_go_at_the_first_peak_however_little_is_too_much() {
    for excess in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let sine = Sine { amplitude: 0.2 * (1.0 + excess), hz: 33.0, turns: 0.047 };
        let seen = instants("[[0.0017]]", "", &[sine.toml()], &[(&[1.0], steady(1.0), 0.2)], 0.5);
        let expected = sine.reaches(0.2);
        assert!((seen[0].0 - expected).abs() < 1e-9, "{excess}: {:?}, expected {expected}", seen[0]);
        assert!(!seen[0].2);
    }
    let published = Sine { amplitude: 0.20002, hz: 33.0, turns: 0.047 };
    assert!((published.reaches(0.2) - 0.006_083_312_2).abs() < 1e-10);
}

#[test]
fn a_joint_under_five_hundred_hertz_lets_go_at_its_first_peak() {
    let sine = Sine { amplitude: 0.202, hz: 500.0, turns: 0.0 };
    let rows: [Rubs<'_>; 2] = [(&[1.0, 0.0], steady(1.0), 0.2), (&[1.0, -1.0], steady(0.0), 0.2)];
    let seen = instants("[[1.0, 0.0], [0.0, 1.0]]", "", &[sine.toml(), steady(0.0)], &rows, 0.1);
    let expected = (0.2_f64 / 0.202).asin() / (TAU * 500.0);
    assert!((seen[0].0 - expected).abs() < 1e-9 && seen[0].1 == 0, "{:?}, expected {expected}", seen[0]);
}

#[test]
fn two_rows_that_share_a_limit_let_go_at_a_peak_above_it_and_at_none_below() {
    // Both on one joint; then with a third that ties it to another joint, which a row of its own holds.
    let inertia = "[[0.3, 0.1], [0.1, 0.2]]";
    for (first, second) in [(1.0, 1.0), (1.5, 0.5), (2.0, 1e-3)] {
        let limit = 0.2 * (first + second);
        let rows: [Rubs<'_>; 2] = [(&[1.0], steady(first), 0.2), (&[1.0], steady(second), 0.2)];
        let tied: [Rubs<'_>; 4] = [
            (&[1.0, 0.0], steady(first), 0.2),
            (&[1.0, 0.0], steady(second), 0.2),
            (&[1.0, -1.0], steady(0.5), 0.2),
            (&[0.0, 1.0], steady(0.25), 0.2),
        ];
        for excess in [1e-2, 1e-4, 1e-6] {
            let of = |limit: f64, sign: f64| Sine {
                amplitude: limit * (1.0 + sign * excess),
                hz: 170.0,
                turns: 0.61,
            };
            let sine = of(limit, 1.0);
            let seen = instants("[[0.01]]", "", &[sine.toml()], &rows, 0.02);
            let expected = sine.reaches(limit);
            assert!((seen[0].0 - expected).abs() < 1e-9, "{first}: {:?}, expected {expected}", seen[0]);
            assert_eq!(instants("[[0.01]]", "", &[of(limit, -1.0).toml()], &rows, 0.5), []);
            // Through the tie the other joint's row holds as much as it can: less than the tie does.
            let limit = limit + 0.05;
            let sine = of(limit, 1.0);
            let seen = instants(inertia, "", &[sine.toml(), steady(0.0)], &tied, 0.02);
            let expected = sine.reaches(limit);
            assert!((seen[0].0 - expected).abs() < 1e-9, "{first}: {:?}, expected {expected}", seen[0]);
            let below = [of(limit, -1.0).toml(), steady(0.0)];
            assert_eq!(instants(inertia, "", &below, &tied, 0.5), []);
        }
    }
}

/// One to three joints, each with a row and a load that swings; the loads' peaks over their limits, or under them.
fn random_joints(draw: &mut Draw, over: bool) -> (String, Vec<Sine>, Vec<f64>) {
    let n = 1 + draw.whole(3) as usize;
    let coupled = draw.between(-0.3, 0.3);
    let inertia: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| if i == j { draw.between(1.0, 2.0) } else { coupled }).collect())
        .collect();
    let limits: Vec<f64> = (0..n).map(|_| draw.between(0.2, 0.4)).collect();
    let sines = limits.iter().map(|limit| {
        let excess = if over { draw.log(1e-6, 1e-1) } else { -draw.log(1e-6, 1e-3) };
        Sine { amplitude: limit * (1.0 + excess), hz: draw.log(1.0, 500.0), turns: draw.share() }
    });
    let sines = sines.collect();
    (format!("{inertia:?}"), sines, limits)
}

fn rows_of(limits: &[f64]) -> Vec<(Vec<f64>, f64)> {
    let n = limits.len();
    (0..n).map(|i| ((0..n).map(|j| f64::from(u8::from(i == j))).collect(), limits[i])).collect()
}

#[test]
fn random_loads_let_rows_go_at_the_roots_of_the_formula() {
    let (mut draw, mut compared, mut furthest) = (Draw::new(31), 0, 0.0_f64);
    for k in 0..400 {
        let (inertia, sines, limits) = random_joints(&mut draw, true);
        let of = || sines.iter().zip(&limits);
        // Beyond the limit at the start a row lets go there, which is no event.
        if of().any(|(sine, limit)| (sine.amplitude * (TAU * sine.turns).sin()).abs() > *limit) {
            continue;
        }
        compared += 1;
        let expected = of().map(|(sine, limit)| sine.reaches(*limit)).fold(f64::INFINITY, f64::min);
        let load: Vec<String> = sines.iter().map(Sine::toml).collect();
        let rows = rows_of(&limits);
        let rows: Vec<Rubs<'_>> =
            rows.iter().map(|(joints, limit)| (&joints[..], steady(1.0), *limit)).collect();
        let seen = instants(&inertia, "", &load, &rows, expected + 1e-6);
        let first =
            seen.first().unwrap_or_else(|| panic!("{k}: none, expected {expected}: {sines:?}, {limits:?}"));
        assert!(
            (first.0 - expected).abs() < 1e-9,
            "{k}: {first:?}, expected {expected}: {sines:?}, {limits:?}"
        );
        furthest = furthest.max((first.0 - expected).abs());
    }
    println!("{compared} first slips: {furthest:e} s");
    assert!(compared > 300, "{compared}");
}

#[test]
fn random_loads_below_the_limits_let_no_row_go() {
    let mut draw = Draw::new(32);
    for k in 0..100 {
        let (inertia, sines, limits) = random_joints(&mut draw, false);
        let load: Vec<String> = sines.iter().map(Sine::toml).collect();
        let rows = rows_of(&limits);
        let rows: Vec<Rubs<'_>> =
            rows.iter().map(|(joints, limit)| (&joints[..], steady(1.0), *limit)).collect();
        assert_eq!(instants(&inertia, "", &load, &rows, 1.0), [], "{k}: {sines:?}, {limits:?}");
    }
}

#[test]
fn a_normal_force_that_falls_short_for_an_instant_lets_go_then() {
    // 0.2 (1 + 0.5 sin) of the limit, a load of 0.1 and a little: its lowest is too low.
    for excess in [1e-2, 1e-4, 1e-6] {
        let load = 0.1 * (1.0 + excess);
        let normal = "{ constant = 1.0, amplitude = 0.5, frequency_hz = 210.0 }".to_owned();
        let seen = instants("[[0.01]]", "", &[steady(load)], &[(&[1.0], normal, 0.2)], 0.01);
        let expected = (0.5 + ((1.0 - load / 0.2) / 0.5).asin() / TAU) / 210.0;
        assert!((seen[0].0 - expected).abs() < 1e-9, "{excess}: {:?}, expected {expected}", seen[0]);
    }
}

#[test]
fn a_load_that_jumps_back_lets_go_before_it_does() {
    // A ramp over the limit, back to 0 at its end: the ends of steps are both below it.
    let load = "{ rate = 1.0 }, { from_s = 0.2005, rate = -1.0, constant = -0.2005 }";
    for end in [0.2005, 0.4] {
        let seen = instants("[[1.0]]", "", &[load.to_owned()], &[(&[1.0], steady(1.0), 0.2)], end);
        assert!((seen[0].0 - 0.2).abs() < 1e-9 && !seen[0].2, "{end}: {seen:?}");
    }
}

#[test]
fn a_spring_of_a_joint_that_swings_lets_go_the_joint_that_rests() {
    // A joint swings by 1 rad on a spring of 1 N m/rad from the joint that rests.
    let (k, inertia) = (1.0, 1e-3);
    let w = f64::sqrt(k / inertia);
    for excess in [1e-3, 1e-5, 1e-6] {
        let limit = 1.0 / (1.0 + excess);
        let more = format!(
            "stiffness = [[{k:?}, {:?}], [{:?}, {k:?}]]\nposition = [0.3, 0.0]\nvelocity = [{:?}, 0.0]",
            -k,
            -k,
            0.91_f64.sqrt() * w
        );
        let row: Rubs<'_> = (&[0.0, 1.0], steady(1.0), limit);
        let seen = instants(
            &format!("[[{inertia:?}, 0.0], [0.0, 1.0]]"),
            &more,
            &[steady(0.0), steady(0.0)],
            &[row],
            0.2,
        );
        // sin(ωt + φ) = limit, sin φ = 0.3.
        let expected = (limit.asin() - 0.3_f64.asin()) / w;
        let slope = w * (1.0 - limit * limit).sqrt();
        // The motion errs by 1e-11, of which the slope makes a time.
        let allowed = 1e-9 + 1e-10 / slope;
        assert!((seen[0].0 - expected).abs() < allowed, "{excess}: {:?}, expected {expected}", seen[0]);
    }
}

/// A mass on a plane under a load that nobody tells the curvature of.
struct Untold {
    load: fn(f64) -> f64,
    friction: Friction<f64>,
}

impl Untold {
    fn new(load: fn(f64) -> f64, mu: f64) -> Self {
        let params = CoulombParams { mu_static: mu, mu_dynamic: mu };
        Untold { load, friction: Friction::build(&params.into()).unwrap() }
    }

    fn events(&self, velocity: f64, until: f64) -> Vec<(f64, Mode)> {
        let begin =
            SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::from([velocity]) };
        let (mut motion, mut events) = (Motion::new(self, begin).unwrap(), Vec::new());
        motion.advance(until, &mut events).unwrap();
        events.iter().map(|e| (e.time, e.mode)).collect()
    }
}

impl System<1, 1> for Untold {
    fn inertia(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[1.0]])
    }
    fn applied(&self, t: f64, _: &SVector<f64, 1>, _: &SVector<f64, 1>) -> SVector<f64, 1> {
        SVector::from([(self.load)(t)])
    }
    fn rows(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[1.0]])
    }
    fn normal(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([1.0])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        &self.friction
    }
    fn longest_step(&self) -> f64 {
        1e-3
    }
}

#[test]
fn a_load_of_unknown_curvature_lets_go_at_its_first_peak_if_steps_are_a_tenth_of_its_period() {
    for (turns, load) in [
        (0.0, (|t: f64| 0.200_000_2 * (TAU * 100.0 * t).sin()) as fn(f64) -> f64),
        (0.04, |t: f64| 0.200_000_2 * (TAU * (100.0 * t + 0.04)).sin()),
        (0.13, |t: f64| 0.200_000_2 * (TAU * (100.0 * t + 0.13)).sin()),
    ] {
        let seen = Untold::new(load, 0.2).events(0.0, 0.01);
        let expected = Sine { amplitude: 0.200_000_2, hz: 100.0, turns }.reaches(0.2);
        assert!((seen[0].0 - expected).abs() < 1e-9, "{turns}: {seen:?}, expected {expected}");
    }
}

#[test]
fn a_mass_that_stops_for_an_instant_and_goes_on_is_seen_to_stop() {
    // v = (1 − dip) + cos ωt: below 0 by `dip` at ωt = π if it did not stop; then the load drives it on at π.
    let w = TAU * 2.0;
    for dip in [1e-4, 1e-6, 1e-8] {
        let load = |t: f64| 20.0 - TAU * 2.0 * (TAU * 2.0 * t).sin();
        let seen = Untold::new(load, 20.0).events(2.0 - dip, 0.3);
        let stops = (PI - (1.0_f64 - dip).acos()) / w;
        let [stop, go] = seen[..] else { panic!("{dip}: {seen:?}, expected {stops}") };
        assert_eq!((stop.1, go.1), (Mode::Stuck, Mode::Forward));
        // The motion errs by 1e-11, of which the slope makes a time.
        let allowed = 1e-9 + 1e-10 / (w * (2.0 * dip).sqrt());
        assert!((stop.0 - stops).abs() < allowed, "{dip}: {stop:?}, expected {stops}");
        assert!((go.0 - PI / w).abs() < 1e-9, "{dip}: {go:?}");
    }
}

/// A system in steps of a length at most.
struct InSteps<'a>(&'a Linear<3, 4>, f64);

impl System<3, 4> for InSteps<'_> {
    fn inertia(&self, q: &SVector<f64, 3>) -> SMatrix<f64, 3, 3> {
        self.0.inertia(q)
    }
    fn applied(&self, t: f64, q: &SVector<f64, 3>, v: &SVector<f64, 3>) -> SVector<f64, 3> {
        self.0.applied(t, q, v)
    }
    fn rows(&self, q: &SVector<f64, 3>) -> SMatrix<f64, 4, 3> {
        self.0.rows(q)
    }
    fn base(&self, t: f64) -> SVector<f64, 4> {
        self.0.base(t)
    }
    fn normal(&self, t: f64) -> SVector<f64, 4> {
        self.0.normal(t)
    }
    fn friction(&self, row: usize) -> &Friction<f64> {
        self.0.friction(row)
    }
    fn curvature(&self, _: f64, _: f64) -> Option<(SVector<f64, 3>, SVector<f64, 4>)> {
        Some((SVector::from_fn(|i, _| self.0.load[i].1 * self.0.load[i].2.powi(2)), SVector::zeros()))
    }
    fn longest_step(&self) -> f64 {
        self.1
    }
}

#[test]
fn random_systems_let_go_and_stop_at_the_same_instants_in_steps_of_a_hundredth() {
    let (mut draw, mut compared, mut furthest) = (Draw::new(33), 0, 0.0_f64);
    for n in 0..40 {
        let mut system = Linear::<3, 4>::draw(&mut draw, Draw::friction);
        // Two rows of one kind are redundant.
        system.rows.set_row(1, &system.rows.row(0).into_owned());
        system.base[1] = system.base[0];
        let events = |longest: f64| {
            let system = InSteps(&system, longest);
            let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::zeros() };
            let (mut motion, mut events) = (Motion::new(&system, begin).unwrap(), Vec::new());
            motion.advance(2.0, &mut events).unwrap();
            events
        };
        let (ours, short) = (events(2e-2), events(2e-4));
        let told = |all: &[SystemEvent]| all.iter().map(|e| (e.row, e.mode)).collect::<Vec<_>>();
        assert_eq!(told(&ours), told(&short), "{n}: {ours:?}\n{short:?}");
        for (a, b) in ours.iter().zip(&short) {
            furthest = furthest.max((a.time - b.time).abs());
        }
        compared += ours.len();
    }
    println!("{compared} events: {furthest:e} s");
    assert!(compared > 500 && furthest < 1e-8, "{compared}, {furthest:e} s");
}
