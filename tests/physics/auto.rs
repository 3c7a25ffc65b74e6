//! Figures of `auto` against Dormand–Prince's pair with a thousandth of its tolerance: motions that once stalled the exact
//! flow, and scenarios drawn at random.

use crate::draw::Draw;
use clutch_core::law::{LawParams, OutputParams};
use clutch_core::params::{Choice, Editor, Params, Table};
use clutch_core::reference::ReferenceParams;
use clutch_core::{Micros, PlantParams, Servo};
use clutch_sim::engine::{DormandPrince, EngineKind};
use clutch_sim::progress::UNWATCHED;
use clutch_sim::{Keep, Metrics, RigParams, Run, RunError, RunSpec, Scenario, simulate_prepared};

/// Share of Dormand–Prince's tolerances that the second opinion has.
const TIGHT: f64 = 1e-3;

/// The run by the engine that it asks for, and with Dormand–Prince's pair at a tight tolerance in its place.
fn twice(spec: &RunSpec<'_>) -> Result<[Run; 2], RunError> {
    let servo = Servo::<f64>::new(&spec.servo()?)?;
    let run = simulate_prepared(spec, &servo, spec.prepare()?, Keep::Trace, UNWATCHED)?;
    let mut other = spec.prepare()?;
    other.moving = other.moving.by(DormandPrince::with_tolerance(TIGHT));
    other.engine = EngineKind::DormandPrince;
    Ok([run, simulate_prepared(spec, &servo, other, Keep::Trace, UNWATCHED)?])
}

fn furthest_apart([a, b]: &[Run; 2]) -> f64 {
    a.trace.position.iter().zip(&b.trace.position).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

fn agrees(set: &[(&str, &str)], sticks: f64) {
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let text = clutch_sim::scenario::BUILT_IN.iter().find(|b| b.name == "pd_2").unwrap().toml;
    let scenario = Scenario::parse("pd_2", text, &set).unwrap();
    let runs = twice(&scenario.spec()).unwrap();
    assert_eq!(runs[0].engine, EngineKind::ExactFlow);
    assert_eq!(runs[0].trace.time.len() as u64, scenario.ticks(), "it ran to its end");
    assert!(runs[0].metrics.stick_slip_cycles_per_s > sticks, "{set:?}: {:?}", runs[0].metrics);
    let apart = furthest_apart(&runs);
    assert!(apart <= 1e-9, "{set:?}: {apart:e} rad apart");
    let kinds = |run: &Run| run.events.iter().map(|e| e.kind).collect::<Vec<_>>();
    assert_eq!(kinds(&runs[0]), kinds(&runs[1]), "{set:?}");
}

#[test]
fn noise_that_just_lets_a_stuck_shaft_go_stalls_no_engine() {
    agrees(
        &[
            ("rig.torque_noise_nm", "0.005"),
            ("sampling.period_us", "5000"),
            ("run.duration_s", "100"),
            ("run.seed", "6"),
        ],
        20.0,
    );
}

#[test]
fn much_drag_beside_a_thin_layer_stalls_no_engine() {
    for seed in ["1", "2", "3", "4", "5", "6"] {
        agrees(
            &[
                ("rig.viscous_damping_nm_s_rad", "0.02"),
                ("rig.friction.stribeck.stribeck_velocity_rad_s", "1e-4"),
                ("run.seed", seed),
            ],
            10.0,
        );
    }
}

/// Each number of a law times 0.1 to 10, where its range has that.
struct Scaled<'a>(&'a mut Draw);

impl Editor<f64> for Scaled<'_> {
    fn real<P: Table<f64>>(&mut self, row: usize, value: &mut f64) {
        let (row, x) = (&P::ROWS[row], *value * self.0.log(0.1, 10.0));
        if row.range.holds(&row.unit, x) {
            *value = x;
        }
    }
    fn whole<P: Table<f64>>(&mut self, _: usize, _: &mut u64) {}
    fn switch<P: Table<f64>>(&mut self, _: usize, _: &mut bool) {}
    fn word<P: Table<f64>>(&mut self, _: usize, _: &mut usize) {}
}

fn law(draw: &mut Draw, volts: f64) -> LawParams {
    let mut law = draw.of(&LawParams::<f64>::all());
    law.edit(&mut Scaled(draw));
    if let LawParams::Voltage(open) = &mut law {
        (open.start, open.end) = (volts * draw.between(-0.5, 1.5), volts * draw.between(-0.5, 1.5));
        open.rate = volts * draw.log(0.1, 100.0);
        open.returns = draw.one_in(2);
    }
    law
}

/// A rig, a law and a path: everything is drawn but the length.
fn spec(draw: &mut Draw) -> RunSpec<'static> {
    let period = draw.log(1e-4, 2e-2);
    let volts = draw.between(1.0, 8.0);
    let friction = draw.friction();
    let (plant, torque) = draw.plant(friction, period, volts);
    let seconds = 200.0 * period;
    let drive = draw.drive(torque, seconds);
    let mut rig = RigParams {
        inertia: plant.inertia,
        viscous_damping: plant.viscous_damping,
        actuator: plant.actuator,
        friction: plant.friction,
        drive,
        delay_ticks: if draw.one_in(3) { 2 } else { 0 },
        torque_noise: if draw.one_in(3) { torque * draw.log(1e-4, 0.3) } else { 0.0 },
        actuator_time_constant: draw.one_in(5).then(|| period * draw.log(0.01, 10.0)),
        ..RigParams::paper()
    };
    (rig.ripple, rig.runout) = draw.disc();
    rig.encoder.quantised = !draw.one_in(4);
    rig.encoder.sensor.counts_per_rev = draw.log(1e3, 1e6) as u32;
    rig.dac.quantised = !draw.one_in(4);
    let model = PlantParams { drive_torque: torque, ..plant };
    let rate = draw.log(1e-3, 3.0) * draw.of(&[1.0, 1.0, 1.0, -1.0]);
    let law = law(draw, volts);
    let mut spec = RunSpec::new(rig, law, ReferenceParams::ramp(rate));
    (spec.period, spec.model) = (Micros((1e6 * period) as u32), model);
    if plant.actuator.kind().two_sided() {
        spec.output = OutputParams { lowest: -10.0, on_invalid: 0.0, ..spec.output };
    }
    (spec.run.duration, spec.run.settle) = (200.0 * spec.period.seconds::<f64>(), 0.0);
    spec.run.seed = draw.whole(1000);
    spec
}

/// Figures of a scenario may differ by this share.
const SAME: f64 = 1e-6;
/// Error that counts as no smaller, rad: such a share of it is 1e-10 rad.
const SMALL: f64 = 1e-4;

fn figures(run: &Run) -> impl Iterator<Item = (&'static str, f64)> {
    Metrics::FIGURES.iter().map(|f| (f.name, f.of(&run.metrics).unwrap_or(-1.0)))
}

#[test]
fn figures_of_random_scenarios_are_what_the_pair_at_a_tight_tolerance_says() {
    let mut draw = Draw::new(11);
    let (mut ran, mut exact, mut sticks, mut edges) = (0, 0, 0, 0);
    for n in 0..400 {
        let spec = spec(&mut draw);
        let runs = match twice(&spec) {
            Ok(runs) => runs,
            // A number that does not fit the others.
            Err(RunError::Param(_)) => continue,
            Err(e) => panic!("{n}: {e}"),
        };
        ran += 1;
        exact += u32::from(runs[0].engine == EngineKind::ExactFlow);
        sticks += u32::from(!runs[0].events.is_empty());
        assert_eq!(runs[0].events.len(), runs[1].events.len(), "{n}");
        // A sum in which errors cancel has their size, and not its own.
        let size = |name: &str| match name {
            "mean_error_rad" => runs[0].metrics.max_error_rad.max(SMALL),
            "max_error_rad" | "rms_error_rad" | "iae_rad_s" => SMALL,
            _ => 1e-9,
        };
        let share = |name, a: f64, b: f64| (a - b).abs() / a.abs().max(b.abs()).max(size(name)).max(1e-9);
        // The start moved by some roundings: where that is seen, the run is a coin on its edge, and no engine is right.
        let moved = with_another_start(&spec);
        if figures(&runs[1]).zip(figures(&moved)).any(|((name, a), (_, b))| share(name, a, b) > 1e-3 * SAME) {
            edges += 1;
            continue;
        }
        for ((name, a), (_, b)) in figures(&runs[0]).zip(figures(&runs[1])) {
            assert!(share(name, a, b) < SAME, "{n}, {}: {name} is {a} and {b}", spec.law.name());
        }
    }
    assert!(ran > 350 && exact > 40 && sticks > 150, "{ran} ran, {exact} exact, {sticks} stick");
    println!("{edges} of {ran} on an edge");
    assert!(edges < ran / 4, "{edges} of {ran} on an edge");
}

/// The run by the tight pair with a start that is 1e-14 of its speed faster.
fn with_another_start(spec: &RunSpec<'_>) -> Run {
    let servo = Servo::<f64>::new(&spec.servo().unwrap()).unwrap();
    let mut moved = spec.prepare().unwrap();
    let shaft = *moved.moving.shaft();
    moved.moving = moved.moving.by(DormandPrince::with_tolerance(TIGHT));
    moved.moving.place(shaft.position, shaft.velocity * (1.0 + 1e-14), None);
    simulate_prepared(spec, &servo, moved, Keep::Trace, UNWATCHED).unwrap()
}
