//! Instructions of the steps that every period has, counted by valgrind and held against benches/instructions.toml:
//! `cargo xtask instructions`.
//!
//! Without arguments it runs itself under valgrind once for each item, and counts inside of [`counted`] alone; with the name
//! of an item it does that item's work. Other processors run the same machine code, so the counts are the same; another
//! compiler makes others, and a new budget.

use clutch_core::law::{Beside, ControlLaw, Law, LawParams, OutputParams, Tick};
use clutch_core::params::Choice;
use clutch_core::reference::ReferenceParams;
use clutch_core::{
    Counts, FixedCounts, Friction, Plant, PlantParams, Servo, ServoParams, StribeckParams, Target,
};
use clutch_sim::drive::{Drive, DriveParams, SineDrive};
use clutch_sim::engine::{DormandPrince, Engine, EngineKind, Input, Model, Shaft, Volts};
use clutch_sim::system::{Motion, System, SystemState};
use clutch_sim::{RigParams, RunSpec};
use clutch_wire::{Actuate, Decoder, Message, Sample, encode};
use nalgebra::{SMatrix, SVector};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::error::Error;
use std::hint::black_box;
use std::process::{Command, ExitCode};

/// Steps of an item that are counted together.
const STEPS: u32 = 1000;
const BUDGET: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../benches/instructions.toml");

/// The file of budgets.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Plan {
    /// Share by which a count may differ from its budget, either way, before it is reported.
    tolerance: f64,
    /// Instructions of a step.
    budget: BTreeMap<String, f64>,
}

/// Steps that are counted, and nothing of their preparation.
#[inline(never)]
fn counted(mut step: impl FnMut(u32)) {
    for i in 0..STEPS {
        step(i);
    }
}

/// The names of all items.
fn items() -> Vec<String> {
    let laws = LawParams::<f64>::all().map(|law| law.name().to_owned());
    let laws: Vec<_> =
        laws.into_iter().flat_map(|law| [format!("law_{law}"), format!("servo_{law}")]).collect();
    let others = ["encode_sample", "decode_sample", "encode_actuate", "decode_actuate"];
    let engines = ["exact_flow_20", "exact_flow_2", "dormand_prince_2", "dormand_prince_rippled_2"];
    let engines = engines.iter().map(|name| format!("engine_{name}"));
    let shaft = ["shaft_by_dormand_prince", "shaft_by_system"].map(str::to_owned);
    laws.into_iter().chain(others.map(str::to_owned)).chain(engines).chain(shaft).collect()
}

/// Does the work of an item; false if there is none of that name.
fn work(name: &str) -> Result<bool, Box<dyn Error>> {
    match name.split_once('_') {
        Some(("law", law)) => {
            let Some(params) = LawParams::<f64>::all().into_iter().find(|p| p.name() == law) else {
                return Ok(false);
            };
            law_step(&params)?;
        }
        Some(("servo", law)) => {
            let Some(params) = LawParams::<f64>::all().into_iter().find(|p| p.name() == law) else {
                return Ok(false);
            };
            servo_tick(params)?;
        }
        Some((way @ ("encode" | "decode"), message)) => codec(way, message),
        Some(("engine", which)) => return engine(which),
        Some(("shaft", which)) => return shaft(which),
        _ => return Ok(false),
    }
    Ok(true)
}

/// Measurements around a path, so that no branch is always the same.
fn law_step(params: &LawParams<f64>) -> Result<(), Box<dyn Error>> {
    let law = Law::new(params, &Beside::paper(&PlantParams::default(), &OutputParams::default()))?;
    let ticks: Vec<_> = (0..64)
        .map(|i| {
            let x = f64::from((i * 37) % 64 - 32) / 32.0;
            Tick {
                error: 0.002 * x,
                error_rate: 0.2 * x * x - 0.05,
                target_velocity: 0.035,
                target_acceleration: 0.0,
            }
        })
        .collect();
    let mut state = Default::default();
    counted(|i| {
        black_box(law.update(&mut state, black_box(&ticks[i as usize % 64])));
    });
    Ok(())
}

/// From counts to voltage at 2 °/s: a count each ninth tick.
fn servo_tick(params: LawParams<f64>) -> Result<(), Box<dyn Error>> {
    let servo = Servo::new(&ServoParams::paper(params))?;
    let target = |k: u32| Target {
        position: FixedCounts(i64::from(k) * 7282),
        velocity: 2.0_f64.to_radians(),
        acceleration: 0.0,
    };
    let mut state = servo.start(Counts(0), &target(0), 2.25);
    counted(|k| {
        black_box(servo.tick(&mut state, black_box(Counts((k / 9) as i32)), black_box(&target(k))));
    });
    Ok(())
}

/// The cycle's two frames, each way.
fn codec(way: &str, message: &str) {
    let sent: Vec<_> = (0..64_u16)
        .map(|i| {
            let (counts, time_us) = (i32::from(i).wrapping_mul(-7919), 1000 * u32::from(i));
            if message == "sample" {
                Message::Sample(Sample { run: 1, sequence: i, time_us, counts, status: 3 })
            } else {
                Message::Actuate(Actuate { run: 1, sequence: i, code: 61 * i, valid_us: 2000 })
            }
        })
        .collect();
    let frames: Vec<_> = sent.iter().map(encode).collect();
    let mut decoder = Decoder::new();
    if way == "encode" {
        counted(|i| {
            black_box(encode(black_box(&sent[i as usize % 64])));
        });
    } else {
        counted(|i| {
            for &byte in black_box(&frames[i as usize % 64]).as_bytes() {
                black_box(decoder.push(byte));
            }
        });
    }
}

/// A rig's tick under PD, second second of the run: sensor, voltage, motion. The servo's part is not counted out.
fn engine(which: &str) -> Result<bool, Box<dyn Error>> {
    let (rig, engine, rate) = match which {
        "exact_flow_20" => (RigParams::paper(), EngineKind::ExactFlow, 20.0_f64),
        "exact_flow_2" => (RigParams::paper(), EngineKind::ExactFlow, 2.0),
        "dormand_prince_2" => (RigParams::paper(), EngineKind::DormandPrince, 2.0),
        "dormand_prince_rippled_2" => {
            (RigParams::named(clutch_sim::rig::RigBase::Bench), EngineKind::DormandPrince, 2.0)
        }
        _ => return Ok(false),
    };
    let law = LawParams::Pd(clutch_core::law::PdParams::default());
    let mut spec = RunSpec::new(rig, law, ReferenceParams::ramp(rate.to_radians()));
    spec.run.engine = engine;
    let servo = Servo::<f64>::new(&spec.servo()?)?;
    let prepared = spec.prepare::<f64>()?;
    let mut state = prepared.servo_state(&servo);
    let (path, mut moving) = (prepared.reference, prepared.moving);
    let period: f64 = spec.period.seconds();
    let mut failed = Ok(());
    let mut tick = |k: u32| {
        moving.set_time(f64::from(k) * period);
        moving.begin_period();
        let out = servo.tick(&mut state, moving.counts(), &path.at(u64::from(k)));
        let volts = moving.rig().dac.volts(out.code);
        moving.command(volts);
        if let Err(e) = moving.advance(period) {
            failed = Err(e);
        }
    };
    (0..STEPS).for_each(&mut tick);
    counted(|k| tick(STEPS + k));
    failed?;
    Ok(true)
}

/// The paper's shaft with 2 V, under a torque that swings across break-away: a period of the engine of shafts, and the same as
/// a system of one inertia and one row, which stops at no period.
fn shaft(which: &str) -> Result<bool, Box<dyn Error>> {
    let params = StribeckParams { stribeck_velocity: 0.01, ..StribeckParams::default() };
    let params = PlantParams { friction: params.into(), ..PlantParams::default() };
    let plant = Plant::new(&params)?;
    let sine = SineDrive { mean: 0.03, amplitude: 0.05, frequency: 3.0, phase_turns: 0.0 };
    let drive = Drive::new(&DriveParams::Sine(sine), 0)?;
    match which {
        "by_dormand_prince" => {
            let model = Model { plant, ripple: None };
            let (mut engine, mut shaft, mut events) =
                (DormandPrince::default(), Shaft::new(0.0, 0.0), Vec::new());
            let mut done = Ok(());
            counted(|k| {
                let (time, volts) = (f64::from(k) * 1e-3, Volts::Held(2.0));
                let input = Input { time, duration: 1e-3, origin: 0.0, volts, drive: &drive, noise: 0.0 };
                if let Err(e) = engine.advance(&model, &input, &mut shaft, &mut events) {
                    done = Err(e);
                }
            });
            done?;
        }
        "by_system" => {
            let system = OneRow { plant, drive };
            let begin = SystemState { time: 0.0, position: SVector::zeros(), velocity: SVector::zeros() };
            let mut motion = Motion::new(&system, begin)?;
            let mut done = Ok(());
            counted(|k| {
                if k == 0 {
                    done = motion.advance(1.0, &mut Vec::new());
                }
            });
            done?;
        }
        _ => return Ok(false),
    }
    Ok(true)
}

/// A shaft as a system.
struct OneRow {
    plant: Plant<f64>,
    drive: Drive,
}

impl System<1, 1> for OneRow {
    fn inertia(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[self.plant.params().inertia]])
    }
    fn applied(&self, t: f64, q: &SVector<f64, 1>, v: &SVector<f64, 1>) -> SVector<f64, 1> {
        SVector::from([self.drive.torque(t, q[0]) - self.plant.params().viscous_damping * v[0]])
    }
    fn rows(&self, _: &SVector<f64, 1>) -> SMatrix<f64, 1, 1> {
        SMatrix::from([[1.0]])
    }
    fn normal(&self, _: f64) -> SVector<f64, 1> {
        SVector::from([self.plant.actuator().normal(2.0)])
    }
    fn friction(&self, _: usize) -> &Friction<f64> {
        self.plant.friction()
    }
}

/// Instructions of a step, as valgrind counts them.
fn count(name: &str) -> Result<f64, Box<dyn Error>> {
    let done = Command::new("valgrind")
        .args([
            "--tool=callgrind",
            "--callgrind-out-file=/dev/null",
            "--toggle-collect=*instructions::counted*",
        ])
        .arg(std::env::current_exe()?)
        .arg(name)
        .output()
        .map_err(|e| format!("valgrind: {e}; on Debian: apt-get install valgrind"))?;
    let log = String::from_utf8_lossy(&done.stderr).into_owned();
    let found = log.lines().find_map(|line| line.split_once("Collected : ")?.1.trim().parse::<f64>().ok());
    match found {
        Some(n) if done.status.success() && n > 0.0 => Ok(n / f64::from(STEPS)),
        _ => Err(format!("{name}: valgrind ended with {}, and counted nothing:\n{log}", done.status).into()),
    }
}

/// Counts all items, and holds them against their budgets.
fn check() -> Result<bool, Box<dyn Error>> {
    let text = std::fs::read_to_string(BUDGET).map_err(|e| format!("{BUDGET}: {e}"))?;
    let plan: Plan = toml::from_str(&text).map_err(|e| format!("{BUDGET}: {e}"))?;
    let mut within = true;
    println!("| step | instructions | budget | |\n|---|---|---|---|");
    for name in items() {
        let n = count(&name)?;
        let verdict = match plan.budget.get(&name) {
            None => "no budget",
            Some(most) if n > most * (1.0 + plan.tolerance) => "more",
            Some(least) if n < least * (1.0 - plan.tolerance) => "less: lower the budget",
            Some(_) => "",
        };
        within &= verdict.is_empty();
        let budget = plan.budget.get(&name).map_or(String::new(), |b| format!("{b:.1}"));
        println!("| `{name}` | {n:.1} | {budget} | {verdict} |");
    }
    for name in plan.budget.keys().filter(|name| !items().contains(name)) {
        within = false;
        println!("| `{name}` | | | no such step |");
    }
    let percent = 100.0 * plan.tolerance;
    if !within {
        eprintln!(
            "instructions: some steps are more than {percent} % off their budgets, or have none. If that is meant, put the new \
             counts into benches/instructions.toml, with the compiler that made them"
        );
    }
    Ok(within)
}

fn main() -> ExitCode {
    let done = match std::env::args().nth(1) {
        None => check(),
        Some(name) => work(&name).and_then(|known| {
            if known {
                Ok(true)
            } else {
                Err(format!("{name}: no such step; expected one of {}", items().join(", ")).into())
            }
        }),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(e) => {
            eprintln!("instructions: {e}");
            ExitCode::FAILURE
        }
    }
}
