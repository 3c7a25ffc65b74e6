//! The engines of this crate before the referee.

use super::case::{Case, CaseError};
use super::mechanism::{Mechanism, Padded, Row};
use super::model::{CaseModel, ScenarioCase};
use super::trajectory::{Trajectory, TrajectoryEvent};
use crate::drive::{Drive, RampDrive};
use crate::engine::rosenbrock::Linear;
use crate::engine::{
    self, Bristle, DormandPrince, Engine, EngineError, EventKind, ExactFlow, Input, Shaft, Volts,
};
use crate::metrics;
use crate::progress::UNWATCHED;
use crate::run::Keep;
use crate::scenario::Scenario;
use crate::scenario_error::ScenarioError;
use crate::system::{BristledMotion, Mode, Motion, SystemError, SystemState};
use clutch_core::friction::FrictionModel;
use clutch_core::{ActuatorParams, ParamError, Plant, PlantParams};
use nalgebra::SVector;

clutch_core::words! {
    /// Engine that takes cases.
    pub enum RefereeEngine {
        /// Systems of several inertias, their rows without bristles: modes by least constraint, Dormand and Prince's pair.
        System = "system" default,
        /// Systems whose rows have bristles: a Rosenbrock method.
        BristledSystem = "bristled_system",
        /// The shaft of a scenario, and Dormand and Prince's pair.
        DormandPrince = "dormand_prince",
        /// The shaft, and its exact flow.
        ExactFlow = "exact_flow",
        /// The shaft, and the engine of bristles.
        Bristle = "bristle",
    }
}

/// All engines, in the order of a table.
pub const ENGINES: [RefereeEngine; 5] = [
    RefereeEngine::System,
    RefereeEngine::BristledSystem,
    RefereeEngine::DormandPrince,
    RefereeEngine::ExactFlow,
    RefereeEngine::Bristle,
];

/// Periods in which a shaft engine is asked for a motion, at most.
const MOST_STEPS: f64 = 1e8;

/// A case could not be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefereeError {
    /// The engine does not take such a case: no fault of either.
    #[error("does not apply: {0}")]
    NotForIt(
        /// The need of the engine.
        String,
    ),
    /// Period of a shaft engine that does not divide the time between samples.
    #[error(
        "step = {step:e} s: expected a whole part of the time between samples, {sample} s, and no more than {MOST_STEPS:e} \
         steps in all"
    )]
    Step {
        /// Asked for, s.
        step: f64,
        /// Time between two samples, s.
        sample: f64,
    },
    /// A parameter of the case that the engine refuses.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// The motion could not be followed.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The motion could not be followed.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The scenario of the case.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The case.
    #[error(transparent)]
    Case(#[from] CaseError),
}

/// Runs a case on an engine. `step` is the period in which the engine is asked for the motion, s; none is the time
/// between samples. Each engine chooses its steps within it.
///
/// # Errors
/// [`RefereeError::NotForIt`] where the engine does not take the case; a motion that cannot be followed.
pub fn run(case: &Case, engine: RefereeEngine, step: Option<f64>) -> Result<Trajectory, RefereeError> {
    let mechanism = match &case.model {
        CaseModel::Mechanism(mechanism) => mechanism,
        CaseModel::Scenario(scenario) => return run_scenario(case, scenario, engine),
    };
    let bristled = mechanism.rows.iter().filter(|row| row.friction.bristles().is_some()).count();
    let needs_none = not_for_it("it needs friction without bristles");
    let needs_all = not_for_it("it needs friction with bristles in every row");
    let elements = |row: &Row| row.friction.bristles().is_some_and(|b| b.count() > 1);
    match engine {
        RefereeEngine::BristledSystem if mechanism.rows.iter().any(elements) => {
            return Err(not_for_it("it needs friction with one bristle in each row"));
        }
        RefereeEngine::System | RefereeEngine::DormandPrince | RefereeEngine::ExactFlow if bristled > 0 => {
            return Err(needs_none);
        }
        RefereeEngine::BristledSystem | RefereeEngine::Bristle if bristled < mechanism.rows.len() => {
            return Err(needs_all);
        }
        _ => {}
    }
    let size = (mechanism.joints(), mechanism.rows.len());
    match (engine, size) {
        (RefereeEngine::System, (1, 1)) => rigid::<1, 1>(case, mechanism, step),
        (RefereeEngine::System, (..=2, ..=2)) => rigid::<2, 2>(case, mechanism, step),
        (RefereeEngine::System, _) => rigid::<4, 4>(case, mechanism, step),
        (RefereeEngine::BristledSystem, (1, 1)) => bristled_system::<1, 1, 3>(case, mechanism, step),
        (RefereeEngine::BristledSystem, (..=2, ..=2)) => bristled_system::<2, 2, 6>(case, mechanism, step),
        (RefereeEngine::BristledSystem, _) => bristled_system::<4, 4, 12>(case, mechanism, step),
        (RefereeEngine::DormandPrince, _) => {
            shaft(case, mechanism, &mut DormandPrince::default(), step, false)
        }
        (RefereeEngine::ExactFlow, _) => {
            if mechanism.rows.first().is_some_and(|row| row.friction.exponential().is_none()) {
                return Err(not_for_it("it needs friction that falls exponentially with the speed"));
            }
            shaft(case, mechanism, &mut ExactFlow, step, true)
        }
        (RefereeEngine::Bristle, _) => shaft(case, mechanism, &mut Bristle::default(), step, false),
    }
}

fn not_for_it(needs: &str) -> RefereeError {
    RefereeError::NotForIt(needs.to_owned())
}

/// A trajectory without a sample.
fn empty(case: &Case, mechanism: &Mechanism) -> Trajectory {
    let lists = |n: usize| vec![Vec::with_capacity(case.samples() + 1); n];
    Trajectory {
        sample: case.sample,
        position: lists(mechanism.joints()),
        velocity: lists(mechanism.joints()),
        torque: Some(lists(mechanism.rows.len())),
        events: None,
        metrics: Vec::new(),
    }
}

fn begin<const N: usize>(m: &Mechanism) -> SystemState<N> {
    let padded = |list: &[f64]| SVector::from_fn(|i, _| list.get(i).copied().unwrap_or(0.0));
    SystemState { time: 0.0, position: padded(&m.position), velocity: padded(&m.velocity) }
}

impl Trajectory {
    fn push(&mut self, position: &[f64], velocity: &[f64], torque: &[f64]) {
        let lists = [(&mut self.position, position), (&mut self.velocity, velocity)];
        for (lists, values) in lists.into_iter().chain(self.torque.as_mut().map(|t| (t, torque))) {
            for (list, value) in lists.iter_mut().zip(values) {
                list.push(*value);
            }
        }
    }
}

/// Periods between two samples, of a step that divides it.
fn periods_per_sample(case: &Case, step: Option<f64>) -> Result<usize, RefereeError> {
    let step = step.unwrap_or(case.sample);
    let count = libm::round(case.sample / step);
    let fits = (count * step - case.sample).abs() <= 1e-9 * case.sample;
    if step > 0.0 && fits && count * case.samples() as f64 <= MOST_STEPS {
        Ok(count as usize)
    } else {
        Err(RefereeError::Step { step, sample: case.sample })
    }
}

/// The ends of the periods before sample `k`, the sample itself last, s.
fn periods(case: &Case, k: usize, per_sample: usize) -> impl Iterator<Item = f64> {
    let (sample, first) = (case.sample, if k == 0 { 0 } else { (k - 1) * per_sample + 1 });
    (first..=k * per_sample).map(move |n| n as f64 * sample / per_sample as f64)
}

fn rigid<const N: usize, const B: usize>(
    case: &Case,
    m: &Mechanism,
    step: Option<f64>,
) -> Result<Trajectory, RefereeError> {
    let per_sample = periods_per_sample(case, step)?;
    let system = Padded::<N, B>::new(m);
    let mut motion = Motion::new(&system, begin(m))?;
    let mut held = motion.modes().map(|mode| mode == Mode::Stuck);
    let (mut out, mut events) = (empty(case, m), Vec::new());
    for k in 0..=case.samples() {
        for end in periods(case, k, per_sample) {
            motion.advance(end, &mut events)?;
        }
        let state = motion.state();
        out.push(state.position.as_slice(), state.velocity.as_slice(), motion.friction()?.as_slice());
    }
    // A row that turns round slips on.
    let changes = events.iter().filter(|e| {
        let holds = e.mode == Mode::Stuck;
        std::mem::replace(&mut held[e.row], holds) != holds
    });
    let known = changes.filter(|e| e.row < m.rows.len());
    out.events = Some(
        known.map(|e| TrajectoryEvent { time: e.time, row: e.row, holds: e.mode == Mode::Stuck }).collect(),
    );
    Ok(out)
}

fn bristled_system<const N: usize, const B: usize, const D: usize>(
    case: &Case,
    m: &Mechanism,
    step: Option<f64>,
) -> Result<Trajectory, RefereeError>
where
    [f64; D]: Linear,
{
    let per_sample = periods_per_sample(case, step)?;
    let system = Padded::<N, B>::new(m);
    let mut motion = BristledMotion::<_, N, B, D>::new(&system, begin(m))?;
    let mut out = empty(case, m);
    for k in 0..=case.samples() {
        for end in periods(case, k, per_sample) {
            motion.advance(end)?;
        }
        let state = motion.state();
        out.push(state.position.as_slice(), state.velocity.as_slice(), motion.friction().as_slice());
    }
    Ok(out)
}

/// A mechanism as the shaft of a scenario, seen from what its row rubs on.
struct AsShaft {
    model: engine::Model,
    drive: Drive,
    base: f64,
    /// Times and voltages from then on.
    volts: Vec<(f64, f64)>,
}

fn as_shaft(m: &Mechanism, duration: f64) -> Result<AsShaft, RefereeError> {
    let needs = not_for_it;
    let [row] = m.rows.as_slice() else { return Err(needs("it needs one joint and one row")) };
    #[allow(clippy::float_cmp, reason = "a row of the joint itself is exactly that")]
    if m.joints() != 1 || row.joints[0] != 1.0 {
        return Err(needs("it needs one joint and one row"));
    }
    let (stiffness, damping, base) = (m.stiffness[0][0], m.damping[0][0], row.base_velocity);
    if stiffness < 0.0 || damping < 0.0 {
        return Err(needs("it needs a spring and a damper that are none less than 0"));
    }
    let load = &m.load[0];
    // Damping acts on the shaft's own velocity, the base's among it.
    let plain = load.constant().map(|t| t - damping * base);
    let drive = match plain {
        Some(torque) if stiffness > 0.0 => {
            Drive::Spring { stiffness, rest: torque / stiffness, damping: 0.0, speed: -base }
        }
        Some(torque) => Drive::Constant(torque),
        None if stiffness > 0.0 => return Err(needs("a shaft has a spring, or a load that changes")),
        None if load.0.iter().any(|t| t.from_s > 0.0) => {
            if load.0.iter().any(|t| t.amplitude != 0.0 || (t.constant != 0.0 && t.from_s > 0.0)) {
                return Err(needs("it needs a load without jumps, of straight lines or of sines"));
            }
            let mut corners: Vec<f64> = load.0.iter().map(|t| t.from_s).chain([0.0, duration]).collect();
            corners.sort_by(f64::total_cmp);
            corners.dedup();
            Drive::Table(corners.into_iter().map(|t| (t, load.at(t) - damping * base)).collect())
        }
        None => {
            let sum = |of: fn(&super::Term) -> f64| load.0.iter().map(of).sum::<f64>();
            let (mean, rate) = (sum(|t| t.constant) - damping * base, sum(|t| t.rate));
            let tau = core::f64::consts::TAU;
            let sines: Vec<_> = load
                .0
                .iter()
                .filter(|t| t.amplitude != 0.0)
                .map(|t| (t.amplitude, tau * t.frequency_hz, tau * t.phase_turns))
                .collect();
            match (rate == 0.0, sines.is_empty()) {
                (true, _) => Drive::Sines { mean, sines },
                (false, true) => Drive::Ramp(RampDrive { from: mean, rate }),
                (false, false) => return Err(needs("a shaft has a load that rises or one that swings")),
            }
        }
    };
    let steps = &row.normal.0;
    if steps.iter().any(|t| t.rate != 0.0 || t.amplitude != 0.0) {
        return Err(needs("it needs a normal force that is held between jumps"));
    }
    let mut times: Vec<f64> = steps.iter().map(|t| t.from_s).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let volts = times.iter().map(|t| (*t, row.normal.at(*t))).collect();
    let plant = PlantParams {
        inertia: m.inertia[0][0],
        viscous_damping: damping,
        drive_torque: 0.0,
        actuator: ActuatorParams::brake(1.0),
        friction: row.friction.params(),
    };
    Ok(AsShaft { model: engine::Model { plant: Plant::new(&plant)?, ripple: None }, drive, base, volts })
}

fn shaft(
    case: &Case,
    m: &Mechanism,
    engine: &mut dyn Engine,
    step: Option<f64>,
    constant: bool,
) -> Result<Trajectory, RefereeError> {
    let AsShaft { model, drive, base, volts } = as_shaft(m, case.duration)?;
    if constant && !drive.is_constant() {
        return Err(not_for_it("it needs a load that never changes"));
    }
    let per_sample = periods_per_sample(case, step)?;
    let mut shaft = Shaft::new(m.position[0], m.velocity[0] - base);
    let (mut out, mut events) = (empty(case, m), Vec::new());
    let row = &m.rows[0];
    let bristled = row.friction.bristles().is_some();
    let sample = |out: &mut Trajectory, shaft: &Shaft, t: f64| {
        let torque = friction_of(row, &drive, shaft, t, row.normal.at(t), &model);
        out.push(&[shaft.position + base * t], &[shaft.velocity + base], &[torque]);
    };
    sample(&mut out, &shaft, 0.0);
    let mut time = 0.0;
    for k in 1..=case.samples() {
        for end in periods(case, k, per_sample) {
            while time < end {
                let jump = volts.iter().map(|(t, _)| *t).find(|t| *t > time && *t < end);
                let now = volts.iter().rev().find(|(t, _)| *t <= time).map_or(0.0, |(_, v)| *v);
                let until = jump.unwrap_or(end);
                let (volts, duration) = (Volts::Held(now), until - time);
                let input = Input { time, duration, origin: 0.0, volts, drive: &drive, noise: 0.0 };
                engine.advance(&model, &input, &mut shaft, &mut events)?;
                time = until;
            }
        }
        sample(&mut out, &shaft, time);
    }
    // Bristles hold nothing exactly: what counts as held is decided as for engines without events.
    out.events = (!bristled).then(|| {
        let all = events.iter();
        all.map(|e| TrajectoryEvent { time: e.time, row: 0, holds: e.kind == EventKind::Stick }).collect()
    });
    Ok(out)
}

/// Friction of the row of a shaft, N m.
fn friction_of(row: &Row, drive: &Drive, shaft: &Shaft, t: f64, normal: f64, model: &engine::Model) -> f64 {
    let mu = match row.friction.bristles() {
        Some(bristles) => bristles.coefficient(&shaft.bend, &bristles.rate(&shaft.bend, shaft.velocity)),
        None if shaft.motion == engine::Motion::Stuck => {
            let holds = model.break_away_torque(shaft.position, normal);
            return drive.torque(t, shaft.position).clamp(-holds, holds);
        }
        None => row.friction.coefficient(shaft.velocity),
    };
    mu * normal.max(0.0)
}

fn run_scenario(
    case: &Case,
    scenario: &ScenarioCase,
    engine: RefereeEngine,
) -> Result<Trajectory, RefereeError> {
    let mut set = scenario.set.clone();
    let name = match engine {
        RefereeEngine::System | RefereeEngine::BristledSystem => {
            return Err(not_for_it("it needs a mechanism; a scenario has a shaft"));
        }
        shaft => shaft.name(),
    };
    set.push(("run.engine".to_owned(), name.to_owned()));
    let built_in = crate::scenario::BUILT_IN.iter().find(|b| b.name == scenario.name);
    let text = built_in.map_or("", |b| b.toml);
    let scenario = Scenario::parse(&case.id, text, &set).map_err(|e| match e.key.as_str() {
        "run.engine" => RefereeError::NotForIt(e.message),
        _ => e.into(),
    })?;
    let run = scenario.run(Keep::Figures, UNWATCHED)?;
    let metrics = metrics::figure_columns(&run.metrics, &run.detected)
        .filter_map(|(name, x)| Some((name.to_owned(), x?)))
        .collect();
    Ok(Trajectory { metrics, ..Trajectory::default() })
}
