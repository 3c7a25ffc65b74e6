//! Decisions before a run: paths, bounds, the check of a path, the certificate. Their bits, for each kind of actuator and
//! path and each law, are those that are committed. A change of them is wanted, or it is a mistake.
#![allow(
    clippy::std_instead_of_core,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "it runs on the host"
)]

use clutch_core::certificate::{Demand, certify};
use clutch_core::law::{Beside, Law, LawParams, Output, OutputParams, Shell, ShellParams};
use clutch_core::params::Choice;
use clutch_core::reference::{
    Chirp, Interpolation, JerkLimited, Knot, MinimumJerk, Reference, ReferenceParams, Sine, Table, Trapezoid,
};
use clutch_core::{
    ActuatorParams, BothActuator, Bounds, BrakeActuator, Encoder, FNV_64, FixedCounts, Micros, MotorActuator,
    PlantParams, Real, Tolerances, check_path, fnv1a_64,
};

mod table;

const PERIOD: Micros = Micros(1000);
const TICKS: u64 = 1200;

/// Plants of each kind of actuator: name, parameters, whether the output has two sides.
fn plants() -> [(&'static str, PlantParams, bool); 5] {
    let with = |actuator: ActuatorParams<f64>, drive_torque| PlantParams {
        actuator,
        drive_torque,
        ..PlantParams::default()
    };
    [
        ("brake", PlantParams::default(), false),
        (
            "brake that drags",
            with(BrakeActuator { preload: 0.05, ..BrakeActuator::default() }.into(), 0.047),
            false,
        ),
        ("motor", with(MotorActuator { gain: 0.05, preload: 0.25, load_share: 0.0 }.into(), 0.0), true),
        (
            "motor with a load",
            with(MotorActuator { gain: 0.05, preload: 0.1, load_share: 0.3 }.into(), -0.03),
            true,
        ),
        ("both", with(BothActuator { brake_gain: 0.14, motor_gain: 0.04, preload: 0.02 }.into(), 0.03), true),
    ]
}

fn tolerances() -> [Tolerances<f64>; 3] {
    let all = |share| Tolerances {
        inertia: share,
        viscous_damping: share,
        brake_gain: share / 2.0,
        motor_gain: share / 2.0,
        friction: share,
        ..Tolerances::default()
    };
    [Tolerances::default(), all(0.1), all(0.3)]
}

fn cast<T: Real>(t: &Tolerances<f64>, drive: f64) -> Tolerances<T> {
    Tolerances { drive_torque: drive, ..*t }.cast()
}

/// Each kind of path, some of them too fast for one plant or another.
fn paths(knots: &[Knot]) -> Vec<(&'static str, ReferenceParams<'_, f64>)> {
    let table = |interpolation| ReferenceParams::Table(Table { knots, interpolation });
    let trapezoid =
        |distance, acceleration| ReferenceParams::Trapezoid(Trapezoid { distance, speed: 0.4, acceleration });
    let jerk = |distance, acceleration| {
        ReferenceParams::JerkLimited(JerkLimited { distance, speed: 0.4, acceleration, jerk: 90.0 })
    };
    let sine = |rate, amplitude| ReferenceParams::Sine(Sine { rate, amplitude, frequency: 1.3, phase: 0.1 });
    vec![
        ("hold", ReferenceParams::Hold),
        ("ramp", ReferenceParams::ramp(0.1)),
        ("ramp back", ReferenceParams::ramp(-0.1)),
        ("trapezoid", trapezoid(0.3, 3.0)),
        ("trapezoid back", trapezoid(-0.3, 3.0)),
        ("steep trapezoid", trapezoid(0.3, 40.0)),
        ("jerk-limited", jerk(0.3, 3.0)),
        ("jerk-limited back", jerk(-0.2, 8.0)),
        ("minimum jerk", ReferenceParams::MinimumJerk(MinimumJerk { distance: 0.3, duration: 1.0 })),
        ("sine", sine(0.3, 0.03)),
        ("sine that reverses", sine(0.05, 0.03)),
        (
            "chirp",
            ReferenceParams::Chirp(Chirp {
                rate: 0.3,
                amplitude: 0.02,
                from: 0.5,
                to: 3.0,
                duration: 1.0,
                phase: 0.1,
            }),
        ),
        ("lines", table(Interpolation::Linear)),
        ("cubics", table(Interpolation::Cubic)),
    ]
}

/// A hash of what a value shows: every number in as many digits as tell its bits.
fn shown(hash: u64, value: &impl std::fmt::Debug) -> u64 {
    fnv1a_64(hash, format!("{value:?};").as_bytes())
}

fn output<T: Real>(two_sided: bool) -> OutputParams<T> {
    let lowest = if two_sided { T::from_i32(-9) } else { T::ZERO };
    OutputParams { lowest, highest: T::from_i32(9), on_invalid: T::ZERO, ..OutputParams::default() }
}

fn rows<T: Real>(scalar: &str) -> String {
    let mut rows = String::new();
    let knot = |(time_us, counts): (u64, i64)| Knot { time_us, position: FixedCounts(counts << 16) };
    let knots: Vec<Knot> =
        [(0, 0), (200_000, 90), (350_000, 400), (700_000, 410), (1_000_000, 800)].map(knot).to_vec();
    for (title, params) in paths(&knots) {
        let path = Reference::<T>::new(&params.cast(), FixedCounts(5 << 16), Encoder::PAPER, PERIOD).unwrap();
        let hash = (0..TICKS).step_by(7).fold(FNV_64, |hash, tick| shown(hash, &path.at(tick)));
        rows += &format!("{hash:016x}  {scalar}  path, {title}\n");
    }
    for (name, plant, two_sided) in plants() {
        let plant_t = plant.cast::<T>();
        let drive = if plant.drive_torque == 0.0 { 0.0 } else { 0.1 };
        let bounds = tolerances().map(|t| Bounds::around(&plant_t, &cast(&t, drive)).unwrap());
        let built = Output::new(&output::<T>(two_sided), PERIOD).unwrap();
        let hash = bounds.iter().fold(FNV_64, |hash, bounds| {
            let drives = bounds.drives(built.lowest(), built.highest());
            shown(shown(hash, bounds), &(drives, bounds.weakest_brake(), bounds.strongest_brake()))
        });
        rows += &format!("{hash:016x}  {scalar}  {name}: bounds\n");
        for (title, params) in paths(&knots) {
            let path = Reference::<T>::new(&params.cast(), FixedCounts(0), Encoder::PAPER, PERIOD).unwrap();
            let (mut hash, mut good) = (FNV_64, 0);
            for (bounds, start) in bounds.iter().zip([T::ZERO, path.at(0).velocity, T::ZERO]) {
                let checked = check_path(&path, TICKS, PERIOD, start, bounds, &built);
                good += u32::from(checked.is_ok());
                hash = shown(hash, &checked);
            }
            rows += &format!("{hash:016x}  {scalar}  {name}: {title}, {good} of 3 can be followed\n");
        }
        let demands =
            [[0.035, 0.0, 0.0, 0.0, 0.0], [0.035, 0.0, 0.1, 0.035, 0.0], [0.2, 1.0, 2.0, 0.2, 0.02]];
        let demands = demands.map(|numbers| {
            let [velocity, acceleration, reach_rate, start_error_rate, velocity_jump] =
                numbers.map(T::from_f64);
            Demand { velocity, acceleration, reach_rate, start_error_rate, velocity_jump }
        });
        for params in LawParams::<T>::all() {
            let out = output::<T>(two_sided);
            let law = Law::<T>::new(
                &params,
                &Beside { model: &plant_t, output: &out, encoder: Encoder::PAPER, period: PERIOD },
            );
            let Ok(law) = law else { continue };
            let (mut hash, mut good) = (FNV_64, 0);
            for boundary in [0.0, 0.1] {
                let shell = Shell::new(
                    &ShellParams { boundary, ..ShellParams::default() }.cast(),
                    &out,
                    bounds[0].actuator,
                )
                .unwrap();
                for bounds in &bounds {
                    for demand in &demands {
                        let certificate = certify(&law, &shell, bounds, demand).unwrap();
                        good += u32::from(certificate.certified());
                        hash = shown(hash, &certificate);
                    }
                }
            }
            let law = Choice::<T>::name(&params);
            rows += &format!("{hash:016x}  {scalar}  {name}: {law}, {good} of 18 certified\n");
        }
    }
    rows
}

#[test]
#[cfg_attr(miri, ignore = "an hour there")]
fn every_plan_has_the_bits_that_are_committed() {
    table::compare("plans", &(rows::<f64>("f64") + &rows::<f32>("f32")));
}
