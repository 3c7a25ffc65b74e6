//! Scenarios: a TOML file that describes rig, law, path, sampling, run and seed.
//!
//! The rig begins as a copy of the one that `rig.base` names; every key in the file overrides
//! its value. Unknown keys are errors. `docs/scenario.md` lists all keys.

mod another_loop;
mod cannot_follow;
pub mod describe;
mod outside;
mod params;
mod path_refusal;
mod sampled;
mod schema;
mod section;
mod verdict;
mod written;

pub use params::{Safety, ScalarKind, ScenarioBounds, ScenarioLimits, ScenarioParams, ScenarioSampling};
pub use sampled::{NOISE_ROOTS, NotCovered};
pub use schema::schema;
pub use section::check_section;
pub use verdict::{CERTIFIED, CertificateError, Proven, STICKS, Sampled, Unproven};
pub use written::written_value;

use crate::engine::{EngineError, EngineKind};
use crate::friction_map::MapGrid;
use crate::progress::Report;
use crate::rig::{Rig, RigBase, RigParams};
use crate::ripple::Ripple;
use crate::run::{Keep, Run, RunError, RunSpec, Start, simulate_watched};
use crate::scenario_error::ScenarioError;
use crate::tables::{
    self, Place, check, checked, complete, default_value, find, lookup, nearest, numbers, read, shown,
    with_todays_keys,
};
use clutch_core::certificate::{Certificate, Demand, PaperConditions, certify, paper_conditions};
use clutch_core::friction::FrictionModel;
use clutch_core::law::{Asked, Law, Output, Shell};
use clutch_core::params::{Choice, Info, Kind, Params, Row};
use clutch_core::reference::{Knot, Reference, ReferenceParams, Table as PathTable};
use clutch_core::{
    ActuatorKind, Bounds, Dac, Encoder, Envelope, FixedCounts, Interval, ParamError, Plant, Real, Supervisor,
    SupervisorParams, VelocitySource, check_path,
};
use std::io::ErrorKind;
use std::path::Path;
use std::sync::{Arc, OnceLock};
pub use toml::{Table, Value};

/// Root mean squares of a rig's torque noise that the supervisor counts as drive.
const SUPERVISED_NOISE_ROOTS: f64 = 6.0;

/// A built-in scenario.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// Its name.
    pub name: &'static str,
    /// Its file.
    pub toml: &'static str,
}

impl BuiltIn {
    /// Asks for the built-in scenario whose name is much like this one, as `: did you mean smc_2?`; empty if none is.
    #[must_use]
    pub fn like(name: &str) -> String {
        let names: Vec<&str> = BUILT_IN.iter().map(|b| b.name).collect();
        nearest(name, &names)
    }
}

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        /// The built-in scenarios.
        pub const BUILT_IN: &[BuiltIn] = &[$(BuiltIn {
            name: $name,
            toml: include_str!(concat!("../../scenarios/", $name, ".toml")),
        }),*];
    };
}
built_in!(
    "pd_2",
    "ctc_2",
    "smc_2",
    "motor_pid",
    "motor_pid_coulomb",
    "motor_smc",
    "motor_ctc",
    "motor_glide",
    "slide_pid",
    "bench_pd_2",
    "bench_pid_2",
    "bench_smc_2",
    "bench_glide_2",
    "bench_dob_2",
    "bench_smc_integral_2",
    "bench_super_twisting_2",
    "shell_glide_2",
    "observer_smc_2",
    "minimum_jerk",
    "hand_guided",
    "f32_smc_2",
    "board_smc_2",
    "board_minimum_jerk",
);

/// A checked scenario.
#[derive(Clone, Debug)]
pub struct Scenario {
    origin: Arc<str>,
    /// Contents of the file alone: without what `rig.base` and defaults add.
    given: Arc<Table>,
    /// Contents of the file, and defaults: made of the tables of `base`, with `changes` not yet in it.
    base: Arc<Table>,
    changes: Vec<(Arc<str>, Value)>,
    /// Both together, made when it is asked for: a sweep has thousands of scenarios, of which few are shown.
    table: OnceLock<Table>,
    params: ScenarioParams,
    knots: Vec<Knot>,
    map: Option<Arc<MapGrid>>,
    /// Made once: it walks the whole path.
    plan: Option<Plan>,
}

/// A key of which the rows of a sweep have values, found once for all of them.
#[derive(Clone, Debug)]
pub(crate) struct Setter {
    key: Arc<str>,
    place: Place,
    /// The path knows nothing of it, and is not walked anew.
    keeps_path: bool,
}

impl Setter {
    /// True if runs of all its values have as many periods.
    pub(crate) fn keeps_length(&self) -> bool {
        self.keeps_path || &*self.key == "run.seed"
    }
}

/// A scenario could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The system's answer.
    #[error("{name}: {}", io_text(name, error))]
    Io {
        /// The file.
        name: String,
        /// The system's error; given in words, so not a source to be given again.
        error: std::io::Error,
    },
    /// The contents of the file.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

fn io_text(name: &str, e: &std::io::Error) -> String {
    match e.kind() {
        ErrorKind::NotFound => format!(
            "no such file, and no built-in scenario of that name{} `clutch scenario list` shows those, `clutch scenario new \
             FILE` writes one to begin with",
            Some(BuiltIn::like(name)).filter(|like| !like.is_empty()).unwrap_or_else(|| ";".to_owned())
        ),
        ErrorKind::InvalidData => "not a text file: expected TOML in UTF-8".to_owned(),
        _ => e.to_string(),
    }
}

/// The plan of a scenario: all that can be said of it before it runs.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Requirements of the path.
    pub envelope: Envelope<f64>,
    /// Bounds on the plant.
    pub bounds: Bounds,
    /// Guarantee of the gains.
    pub certificate: Certificate,
    /// The paper's own conditions; for the sliding-mode laws, for which it states them.
    pub paper: Option<PaperConditions>,
    /// The demand that both were asked.
    pub demand: Demand,
}

/// Overrides as they are written, read.
fn values(origin: &str, set: &[(String, String)]) -> Result<Vec<(String, Value)>, ScenarioError> {
    set.iter().map(|(key, text)| Ok((key.clone(), written::read_value(origin, key, text)?))).collect()
}

impl Scenario {
    /// Reads a scenario; `origin` (a file's name) is what errors begin with, and each of `set`
    /// (`("law.smc.kp_v", "4")`) overrides a key.
    ///
    /// # Errors
    /// The mistake, its place, and what is expected.
    pub fn parse(origin: &str, text: &str, set: &[(String, String)]) -> Result<Scenario, ScenarioError> {
        Scenario::from_table(origin, read_table(origin, text)?, &values(origin, set)?)
    }

    /// As [`Scenario::parse`], of a log's scenario, which may have keys of a version before this one: a log is not written anew.
    ///
    /// # Errors
    /// The mistake, its place, and what is expected.
    pub fn of_log(origin: &str, text: &str, set: &[(String, String)]) -> Result<Scenario, ScenarioError> {
        let mut table = read_table(origin, text)?;
        with_todays_keys(&mut table);
        Scenario::from_table(origin, table, &values(origin, set)?)
    }

    /// As [`Scenario::parse`], from a table that is already read, with values for the keys to
    /// override.
    ///
    /// # Errors
    /// The mistake, its place, and what is expected.
    pub fn from_table(
        origin: &str,
        mut table: Table,
        set: &[(String, Value)],
    ) -> Result<Scenario, ScenarioError> {
        override_keys(origin, &mut table, set)?;
        let given = Arc::new(table.clone());
        merge_base(origin, &mut table)?;
        complete(origin, "", &<ScenarioParams as Params<f64>>::INFO, &mut table)?;
        let params: ScenarioParams = read(&table);
        let mut scenario = Scenario {
            origin: origin.into(),
            given,
            base: Arc::new(table),
            changes: Vec::new(),
            table: OnceLock::new(),
            params,
            knots: Vec::new(),
            map: None,
            plan: None,
        };
        scenario.make(None)?;
        Ok(scenario)
    }

    /// A key of which there may be other values; none if it changes more than a value, as `rig.base` does, or a table of
    /// points.
    pub(crate) fn setter(&self, key: &str) -> Option<Setter> {
        let place = Place::of(&self.params, key)?;
        let plain = matches!(place.row.kind, Kind::Real | Kind::Whole | Kind::Switch | Kind::Word(_));
        // A parameter that may be absent decides what else may be there.
        if !plain || key == "rig.base" || place.row.optional {
            return None;
        }
        let section = key.split('.').next().unwrap_or_default();
        let keeps_path = matches!(section, "law" | "velocity" | "safety")
            || (section == "rig" && !key.starts_with("rig.encoder") && key != "rig.speed_limit_deg_s");
        Some(Setter { key: key.into(), place, keeps_path })
    }

    /// This scenario with other values: what a row of a sweep is made of. Only what the keys touch is checked and
    /// planned anew.
    ///
    /// # Errors
    /// The mistake, its place, and what is expected.
    pub(crate) fn with<'a>(
        &self,
        set: impl Iterator<Item = (&'a Setter, &'a Value)>,
    ) -> Result<Scenario, ScenarioError> {
        let mut scenario = Scenario {
            origin: self.origin.clone(),
            given: self.given.clone(),
            base: self.base.clone(),
            changes: self.changes.clone(),
            table: OnceLock::new(),
            params: self.params.clone(),
            knots: Vec::new(),
            map: self.map.clone(),
            plan: None,
        };
        let mut keeps_path = true;
        for (Setter { key, place, keeps_path: keeps }, value) in set {
            let value = checked(&self.origin, key, place.row, value.clone())?;
            place.put(&mut scenario.params, &value);
            scenario.changes.push((key.clone(), value));
            keeps_path &= keeps;
        }
        let envelope = self.plan.as_ref().filter(|_| keeps_path).map(|plan| plan.envelope);
        scenario.make(envelope)?;
        Ok(scenario)
    }

    /// This scenario with other values, checked.
    pub(crate) fn changed(&self, set: &[(String, Value)]) -> Result<Scenario, ScenarioError> {
        let setters: Option<Vec<_>> = set.iter().map(|(key, _)| self.setter(key)).collect();
        match setters {
            Some(setters) => self.with(setters.iter().zip(set.iter().map(|(_, value)| value))),
            None => Scenario::from_table(&self.origin, self.given(), set),
        }
    }

    /// The meaning of a parameter; none of a key that is no parameter of the scenario.
    #[must_use]
    pub fn meaning(&self, key: &str) -> Option<String> {
        self.row(key).map(describe::meaning)
    }

    /// The unit of a parameter's value in a file; none of a key that is no parameter of the scenario.
    #[must_use]
    pub fn unit(&self, key: &str) -> Option<&'static str> {
        self.row(key).map(|row| row.unit.text)
    }

    /// The declaration of a parameter.
    pub(crate) fn row(&self, key: &str) -> Option<&'static Row> {
        Place::of(&self.params, key).map(|place| place.row)
    }

    /// True for a key that takes a whole number.
    #[must_use]
    pub fn takes_whole(&self, key: &str) -> bool {
        self.row(key).is_some_and(|row| matches!(row.kind, Kind::Whole))
    }

    /// An error about a key that is there.
    pub(crate) fn refuse(&self, key: &str, message: &str) -> ScenarioError {
        self.message(key, message.to_owned())
    }

    /// The built-in scenario of that name.
    #[must_use]
    pub fn built_in(name: &str) -> Option<Result<Scenario, ScenarioError>> {
        BUILT_IN.iter().find(|b| b.name == name).map(|b| Scenario::parse(b.name, b.toml, &[]))
    }

    /// Reads the file of that name or, if there is none, the built-in scenario of that name.
    ///
    /// # Errors
    /// The file cannot be read, or what is wrong with the scenario in it.
    pub fn load(name: &Path, set: &[(String, String)]) -> Result<Scenario, LoadError> {
        let (origin, text) = Scenario::text(name)?;
        Ok(Scenario::parse(&origin, &text, set)?)
    }

    /// The text of that file or, if there is none, of that built-in scenario, and what errors
    /// call it.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn text(name: &Path) -> Result<(String, String), LoadError> {
        let origin = name.to_string_lossy().into_owned();
        let built_in = BUILT_IN.iter().find(|b| b.name == origin);
        if let (Some(b), false) = (built_in, name.exists()) {
            return Ok((origin, b.toml.to_owned()));
        }
        match read_text(name) {
            Ok(text) => Ok((origin, text)),
            Err(error) => Err(LoadError::Io { name: origin, error }),
        }
    }

    /// Checks what relates parameters, and builds each part once, so that whatever is wrong is said before anything
    /// runs. `envelope` is what the path asks for, if it is known.
    fn make(&mut self, envelope: Option<Envelope<f64>>) -> Result<(), ScenarioError> {
        if let Some((path, e)) = check(&mut self.params, "") {
            return Err(error_of(&self.origin, &path, self.table(), &e));
        }
        self.knots = self.read_knots()?;
        self.map = self.read_map()?;
        let spec = self.spec();
        self.check_parts(&spec)?;
        let plan = self.make_plan(&spec, envelope)?;
        self.params.safety.as_ref().map_or(Ok(()), |s| self.check_safety(s, &plan))?;
        self.plan = Some(plan);
        Ok(())
    }

    /// Points of a path that is a table, in the core's terms.
    fn read_knots(&self) -> Result<Vec<Knot>, ScenarioError> {
        let key = "reference.table";
        let Some(Value::Table(table)) = lookup(&self.base, key) else { return Ok(Vec::new()) };
        let points = table.get("points_s_deg").and_then(Value::as_array);
        let encoder = Encoder::new::<f64>(self.params.rig.encoder.sensor.counts_per_rev)
            .map_err(|e| self.at("rig", &e))?;
        points
            .into_iter()
            .flatten()
            .filter_map(tables::pair)
            .enumerate()
            .map(|(i, (time, angle))| {
                let counts = angle.to_radians() * encoder.counts_per_radian::<f64>();
                if counts.abs() >= 1e12 {
                    return Err(self.at("reference", &PathTable::HELD.error(i as f64)));
                }
                let time_us = libm::rint(time * 1e6) as u64;
                Ok(Knot { time_us, position: FixedCounts::from_real(counts) })
            })
            .collect()
    }

    /// The map of the disc, on the grid of the encoder. No key of it changes without a new scenario.
    fn read_map(&self) -> Result<Option<Arc<MapGrid>>, ScenarioError> {
        let Some(params) = &self.params.friction_map else { return Ok(None) };
        let encoder = Encoder::new::<f64>(self.params.rig.encoder.sensor.counts_per_rev)
            .map_err(|e| self.at("rig", &e))?;
        if let Some(grid) = self.map.as_ref().filter(|grid| grid.is_of(encoder)) {
            return Ok(Some(grid.clone()));
        }
        let grid = MapGrid::new(params, encoder).map_err(|e| self.at("friction_map", &e))?;
        Ok(Some(Arc::new(grid)))
    }

    /// The error of a parameter somewhere in the table `section` ("" = the whole file), as this file has it.
    fn at<T: Real>(&self, section: &str, e: &ParamError<T>) -> ScenarioError {
        let nested = <ScenarioParams as Params<f64>>::INFO.table().map_or(&[][..], |file| file.nested);
        // The rig, which comes first, last: of a table that rig and model both have, the model's is what laws, bounds
        // and certificate refuse. Errors of a rig come with its section.
        let below = nested.iter().rev().filter(|below| section.is_empty() || below.key == section);
        let places = below.filter_map(|below| {
            find(below.info, below.key, self.table().get(below.key)?.as_table()?, e.table.id())
        });
        let places: Vec<String> = places.collect();
        // Where two sections have such a table, as law and velocity a filter, the value says which it is.
        let has_it = |path: &&String| {
            let row = e.row()?;
            let here = lookup(self.table(), &format!("{path}.{}", row.key))?.as_float()?;
            let value = e.value.to_f64();
            Some((row.unit.to_si(here) - value).abs() <= 1e-6 * value.abs())
        };
        let path = places.iter().find(|path| has_it(path) == Some(true)).or(places.first());
        error_of(&self.origin, path.map_or(section, String::as_str), self.table(), &e.cast())
    }

    fn message(&self, key: &str, message: String) -> ScenarioError {
        ScenarioError::new(&self.origin, key, "", message)
    }

    /// An error of the path as a whole.
    fn path_message(&self, message: String) -> ScenarioError {
        let kind =
            <ReferenceParams<'static> as Choice<f64>>::CHOICE.options[self.params.reference.chosen()].key;
        self.message(&format!("reference.{kind}"), message)
    }

    fn check_parts(&self, spec: &RunSpec<'_>) -> Result<(), ScenarioError> {
        // First: limits that are right for the one are wrong for the other.
        self.check_actuator(spec)?;
        match self.scalar() {
            ScalarKind::F32 => self.check_servo::<f32>(spec)?,
            ScalarKind::F64 => self.check_servo::<f64>(spec)?,
        }
        spec.run.check(spec.period).map_err(|e| self.at("run", &e))?;
        let rig = Rig::new(&spec.rig, spec.run.seed).map_err(|e| self.at("rig", &e))?;
        spec.engine(&rig).map_err(|e| self.run_error(&e))?;
        self.path().map_err(|e| self.at("reference", &e))?;
        if self.scalar() == ScalarKind::F32 {
            // A number in range in f64 can be nothing, or beyond everything, in f32.
            spec.path::<f32>().map_err(|e| self.single("reference", &e))?;
        }
        Ok(())
    }

    /// A law for another actuator than the rig's would drive the shaft the wrong way.
    fn check_actuator(&self, spec: &RunSpec<'_>) -> Result<(), ScenarioError> {
        let (rig, model) = (spec.rig.actuator.kind(), spec.model.actuator.kind());
        if rig == model {
            return Ok(());
        }
        let name = |kind: ActuatorKind| match kind {
            ActuatorKind::Brake => "a brake",
            ActuatorKind::Motor => "a motor",
            ActuatorKind::Both => "a brake with a motor",
        };
        Err(self.message(
            "model.actuator",
            format!(
                "the law believes in {}, and the rig has {}: voltages would do other things than it believes; give [rig.actuator] and [model.actuator] the same kind",
                name(model), name(rig)
            ),
        ))
    }

    fn check_safety(&self, safety: &Safety, plan: &Plan) -> Result<(), ScenarioError> {
        let servo = self.spec().servo().map_err(|e| self.at("rig", &e))?;
        let supervisor = self.supervisor(safety);
        let bounds = self.supervised_bounds(&plan.bounds)?;
        Supervisor::new(&supervisor, &servo, &bounds).map_err(|e| self.at("safety", &e))?;
        // A voltage that is to hold must hold the strongest drive with the weakest actuator.
        let b = &plan.bounds;
        let Some(volts) = safety.on_fault.holding_voltage() else { return Ok(()) };
        let left = b.left_over(volts);
        if left <= 0.0 {
            return Ok(());
        }
        let message = match b.actuator {
            ActuatorKind::Motor => format!(
                "holds with {volts} V, and at the worst corner of [bounds] drive and motor exceed friction by {left:.4} N m: the shaft runs on; take a voltage that balances the drive, release, or a brake"
            ),
            ActuatorKind::Brake | ActuatorKind::Both => {
                let needed = volts + left / b.weakest_brake();
                format!(
                    "holds with {volts} V, and the strongest drive against the weakest brake of [bounds] needs {needed:.4} V; twice as much is usual"
                )
            }
        };
        Err(self.message("safety.on_fault", message))
    }

    /// Limits that the supervisor of a run on a board watches.
    #[must_use]
    pub fn supervisor(&self, safety: &Safety) -> SupervisorParams {
        let rig = &self.params.rig;
        let mut limits = safety.limits.supervisor;
        // A lag has no end: as a delay of which nobody knows the length.
        let delay = if rig.actuator_time_constant.is_some() { 1000 } else { rig.delay_ticks };
        limits.delay_cycles = limits.delay_cycles.max(delay);
        SupervisorParams { on_fault: safety.on_fault, speed: rig.speed, limits }
    }

    /// Bounds that the supervisor's envelope has to hold: those of the scenario, and beyond them what its rig is said to
    /// be. Six times the root mean square of its torque noise counts as drive, and of bristles, which give back what
    /// bends them, no least friction is expected.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn supervised_bounds(&self, bounds: &Bounds) -> Result<Bounds, ScenarioError> {
        /// N m; no shaft of such a rig has as much, and a supervisor can calculate with it.
        const ANY_TORQUE: f64 = 1e3;
        let rig = Rig::new(&self.params.rig, self.params.run.seed).map_err(|e| self.at("rig", &e))?;
        let (p, actuator) = (rig.model.plant.params(), rig.model.plant.actuator());
        let swing = rig.model.ripple.as_ref().map_or(0.0, Ripple::largest);
        let noise = SUPERVISED_NOISE_ROOTS * rig.params.torque_noise;
        let (weakest, strongest) = rig.drive.range();
        let friction = rig.model.plant.friction();
        let (envelope, bristles) = (friction.envelope(), friction.bristles().is_some());
        let grip = if bristles { 0.0 } else { envelope.low * (1.0 - swing).max(0.0) };
        let hold =
            |b: Interval, low: f64, high: f64| Interval { low: b.low.min(low), high: b.high.max(high) };
        let exactly = |b: Interval, x: f64| hold(b, x, x);
        let (weakest, strongest) = ((weakest - noise).max(-ANY_TORQUE), (strongest + noise).min(ANY_TORQUE));
        Ok(Bounds {
            inertia: exactly(bounds.inertia, p.inertia),
            drive_torque: hold(bounds.drive_torque, weakest, strongest),
            viscous_damping: exactly(bounds.viscous_damping, p.viscous_damping),
            brake_gain: exactly(bounds.brake_gain, actuator.brake_gain()),
            motor_gain: exactly(bounds.motor_gain, actuator.motor_gain()),
            friction: hold(bounds.friction, grip, envelope.high * (1.0 + swing)),
            ..*bounds
        })
    }

    /// The servo part by part, in the scalar that it runs in.
    fn check_servo<T: Real>(&self, spec: &RunSpec<'_>) -> Result<(), ScenarioError> {
        let at = |section: &'static str| move |e: ParamError<T>| self.single(section, &e);
        let servo = spec.servo().map_err(|e| self.at("rig", &e))?.cast::<T>();
        let model = Plant::new(&servo.model).map_err(at("model"))?;
        Output::new(&servo.output, servo.period).map_err(at("output"))?;
        servo.check_output().map_err(at("output"))?;
        Shell::new(&servo.shell, &servo.output, servo.model.actuator.kind()).map_err(at("shell"))?;
        // A law with a model divides by its friction.
        Law::new(&servo.law, &servo.beside()).map_err(at(""))?;
        VelocitySource::new(&servo.velocity, &model, servo.encoder, servo.period).map_err(at("velocity"))?;
        Dac::new(&servo.dac).map_err(at("rig"))?;
        Ok(())
    }

    /// As [`Scenario::at`], of a part in the servo's scalar: what single precision cannot hold is said so.
    fn single<T: Real>(&self, section: &str, e: &ParamError<T>) -> ScenarioError {
        match self.scalar() {
            ScalarKind::F32 if e.relation == 0 => self.in_single(section, e),
            _ => self.at(section, e),
        }
    }

    fn in_single<T: Real>(&self, section: &str, e: &ParamError<T>) -> ScenarioError {
        let mut error = self.at(section, e);
        error.message.push_str(", in single precision (sampling.scalar = \"f32\")");
        error
    }

    /// The error of a part that double precision took when the scenario was read, and the loop's scalar does not take.
    #[must_use]
    pub fn refused_in_single<T: Real>(&self, e: &ParamError<T>) -> ScenarioError {
        self.in_single("", e)
    }

    /// Its title.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.params.name.0
    }

    /// Scalar that the servo runs in.
    #[must_use]
    pub fn scalar(&self) -> ScalarKind {
        self.params.sampling.scalar
    }

    /// Every parameter, SI and radians.
    #[must_use]
    pub fn params(&self) -> &ScenarioParams {
        &self.params
    }

    /// The way a run on a board ends.
    ///
    /// # Errors
    /// The scenario has no table `[safety]`.
    pub fn safety(&self) -> Result<&Safety, ScenarioError> {
        self.params.safety.as_ref().ok_or_else(|| {
            let example = if self.params.model.actuator.kind() == ActuatorKind::Motor {
                "For a motor with nothing on its shaft:\n\n\
                 [safety]\nreason = \"friction holds the axis, and nothing drives it\"\n\n[safety.on_fault.release]"
            } else {
                "For a shaft that a weight or a spring drives:\n\n\
                 [safety]\nreason = \"a weight drives the shaft\"\n\n[safety.on_fault.hold]\nvolts_v = 4.5"
            };
            self.message(
                "safety",
                format!(
                    "missing; a run on a board needs a safe state, and there is no default. {example}\n\n\
                     docs/safety.md says how to choose"
                ),
            )
        })
    }

    /// Every key with its tables, and its value, defaults filled in.
    #[must_use]
    pub fn parameters(&self) -> Vec<(String, String)> {
        fn walk(table: &Table, path: &str, out: &mut Vec<(String, String)>) {
            for (key, value) in table {
                let key = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                match value {
                    Value::Table(t) if t.is_empty() => out.push((key, "{}".to_owned())),
                    Value::Table(t) => walk(t, &key, out),
                    value => out.push((key, shown(value))),
                }
            }
        }
        let mut out = Vec::new();
        walk(self.table(), "", &mut out);
        out
    }

    /// The number of the rig that is farthest from its default in ratio, by its key, and that default.
    fn farthest_of_the_rig(&self) -> Option<(String, String, &'static str)> {
        let rig = <ScenarioParams as Params<f64>>::INFO.table()?.nested.iter().find(|n| n.key == "rig")?;
        let mut all = Vec::new();
        numbers(rig.info, rig.key, self.table().get(rig.key)?.as_table()?, &mut all);
        let far = |(row, key, x): (&'static Row, String, f64)| {
            let ratio = (x / default_value(row)?.as_float()?).abs();
            let far = ratio.max(1.0 / ratio);
            (far.is_finite() && far > 1.0).then(|| (far, (key, x.to_string(), row.default)))
        };
        let farthest = all.into_iter().filter_map(far).max_by(|a, b| a.0.total_cmp(&b.0));
        farthest.map(|(_, number)| number)
    }

    /// The scenario as TOML with every default filled in; parsing it gives the same scenario.
    #[must_use]
    pub fn canonical(&self) -> String {
        self.table().to_string()
    }

    /// The scenario as a table with every default filled in.
    #[must_use]
    pub fn table(&self) -> &Table {
        self.table.get_or_init(|| {
            let mut table = Table::clone(&self.base);
            self.change(&mut table);
            table
        })
    }

    /// The contents of its file with what was set, without what `rig.base` and defaults add: what another scenario of it is
    /// made of, be it on another rig.
    #[must_use]
    pub fn given(&self) -> Table {
        let mut table = Table::clone(&self.given);
        self.change(&mut table);
        table
    }

    /// As [`Scenario::table`], for many that begin with it.
    pub(crate) fn tables(&self) -> Arc<Table> {
        if self.changes.is_empty() { self.base.clone() } else { Arc::new(self.table().clone()) }
    }

    /// True if the exact flow moves the shaft.
    pub(crate) fn flows_exactly(&self) -> bool {
        let spec = self.spec();
        let rig = Rig::new(&spec.rig, spec.run.seed).ok();
        rig.is_some_and(|rig| spec.engine(&rig).is_ok_and(|engine| engine == EngineKind::ExactFlow))
    }

    fn change(&self, table: &mut Table) {
        let changes = self.changes.iter().map(|(key, value)| (&**key, value));
        // Keys of rows that are there already: nothing can be wrong.
        let _ = override_each(&self.origin, table, changes);
    }

    /// The specification of the run.
    #[must_use]
    pub fn spec(&self) -> RunSpec<'_> {
        let p = &self.params;
        RunSpec {
            rig: p.rig.clone(),
            period: p.sampling.sampling.period,
            velocity: p.velocity,
            model: p.model,
            law: p.law,
            output: p.output,
            shell: p.shell,
            reference: self.reference(),
            friction_map: self.map.as_ref().and_then(|grid| grid.map()),
            run: p.run,
        }
    }

    /// The map of the disc on the encoder's grid, if there is one.
    #[must_use]
    pub fn map_grid(&self) -> Option<&Arc<MapGrid>> {
        self.map.as_ref()
    }

    fn reference(&self) -> ReferenceParams<'_> {
        match self.params.reference {
            ReferenceParams::Table(t) => ReferenceParams::Table(PathTable { knots: &self.knots, ..t }),
            other => other,
        }
    }

    /// Shares of the model's between which `[bounds]` has mean friction, the ripple along the disc apart.
    #[must_use]
    pub fn mean_friction_shares(&self) -> [f64; 2] {
        self.params.bounds.friction_shares(0.0).0
    }

    /// The number of ticks in the run.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.params.run.ticks(self.params.sampling.sampling.period)
    }

    fn path(&self) -> Result<Reference<'_, f64>, ParamError> {
        let encoder = Encoder::new::<f64>(self.params.rig.encoder.sensor.counts_per_rev)?;
        Reference::new(&self.reference(), FixedCounts(0), encoder, self.params.sampling.sampling.period)
    }

    /// Path and gains against the bounds of the believed plant.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn plan(&self) -> Result<Plan, ScenarioError> {
        self.plan.clone().map_or_else(|| self.make_plan(&self.spec(), None), Ok)
    }

    /// True if the gains are certified in continuous time.
    pub(crate) fn certified(&self) -> bool {
        self.plan.as_ref().is_some_and(|plan| plan.certificate.certified())
    }

    fn make_plan(&self, spec: &RunSpec<'_>, envelope: Option<Envelope<f64>>) -> Result<Plan, ScenarioError> {
        let p = &self.params;
        let bounds = Bounds::around(&p.model, &p.bounds.tolerances).map_err(|e| self.at("", &e))?;
        let servo = spec.servo().map_err(|e| self.at("rig", &e))?;
        let law = Law::new(&servo.law, &servo.beside()).map_err(|e| self.at("", &e))?;
        let envelope = envelope.map_or_else(|| self.walk_path(&bounds, law.output()), Ok)?;
        let demand = Demand {
            velocity: envelope.velocity,
            acceleration: envelope.largest_acceleration(),
            reach_rate: p.bounds.reach_rate,
            start_error_rate: envelope.start_jump,
            velocity_jump: envelope.velocity_jump,
        };
        let shell =
            Shell::new(&p.shell, &p.output, p.model.actuator.kind()).map_err(|e| self.at("shell", &e))?;
        let certificate = certify(&law, &shell, &bounds, &demand).map_err(|e| self.at("bounds", &e))?;
        let asked = Asked { velocity: 0.0, acceleration: 0.0, fastest: &|_| 0.0 };
        let surface = law.surface(&asked).filter(|surface| surface.sliding);
        // They are a brake's.
        let surface = surface.filter(|_| bounds.actuator == ActuatorKind::Brake);
        let paper = surface.map(|s| paper_conditions(&bounds, &demand, s.kp, s.slope));
        Ok(Plan { envelope, bounds, certificate, paper, demand })
    }

    /// Requirements of the path on drive and brake.
    fn walk_path(&self, bounds: &Bounds, limits: &Output<f64>) -> Result<Envelope<f64>, ScenarioError> {
        let p = &self.params;
        let period = p.sampling.sampling.period;
        let path = self.path().map_err(|e| self.at("reference", &e))?;
        let first = path.at(0).velocity;
        let start_velocity = if p.run.start == Start::OnPath { first } else { 0.0 };
        let envelope = check_path(&path, self.ticks(), period, start_velocity, bounds, limits)
            .map_err(|e| self.path_refusal(&path, bounds, &e))?;
        let limit = p.rig.speed.speed_limit;
        if envelope.velocity > limit * (1.0 + 1e-9) {
            return Err(self.path_message(format!(
                "the path's velocity of {:.4} °/s is above rig.speed_limit_deg_s = {:.4}; lower it or raise the limit (angles here are in degrees: 1 rad/s is 57.3 °/s)",
                envelope.velocity.to_degrees(),
                limit.to_degrees()
            )));
        }
        Ok(envelope)
    }

    /// Runs it, keeping what is asked for and reporting its progress in samples.
    ///
    /// # Errors
    /// A motion that cannot be followed; the end of `progress`'s patience.
    pub fn run(&self, keep: Keep, progress: Report<'_>) -> Result<Run, ScenarioError> {
        let spec = self.spec();
        let run = match self.scalar() {
            ScalarKind::F32 => simulate_watched::<f32>(&spec, keep, progress),
            ScalarKind::F64 => simulate_watched::<f64>(&spec, keep, progress),
        };
        run.map_err(|e| self.run_error(&e))
    }

    /// The error of a run as one of this scenario.
    #[must_use]
    pub fn run_error(&self, e: &RunError) -> ScenarioError {
        match e {
            RunError::Param(e) => self.at("", e),
            RunError::Engine { asked, expected } => {
                ScenarioError::value(&self.origin, "run.engine", &format!("{:?}", asked.name()), expected)
            }
            RunError::Motion(EngineError::TooManySteps { .. }) => match self.farthest_of_the_rig() {
                Some((key, value, default)) => {
                    let message = format!("{e}; this number is the farthest from its default, {default}");
                    ScenarioError::new(&self.origin, &key, &value, message)
                }
                None => self.message("rig", e.to_string()),
            },
            RunError::Motion(_) => self.message("rig", e.to_string()),
            RunError::Begin(_) => self.path_message(e.to_string()),
            RunError::OtherServo => self.message("", e.to_string()),
            RunError::Memory(_) => self.message("run.duration_s", e.to_string()),
            RunError::Stopped => self.message("", e.to_string()),
        }
    }
}

/// Puts values at the dotted keys of a scenario's table, in their order.
///
/// # Errors
/// A name that is no key, or lies below a value.
pub fn override_keys(origin: &str, table: &mut Table, set: &[(String, Value)]) -> Result<(), ScenarioError> {
    override_each(origin, table, set.iter().map(|(key, value)| (key.as_str(), value)))
}

fn override_each<'a>(
    origin: &str,
    table: &mut Table,
    mut set: impl Iterator<Item = (&'a str, &'a Value)>,
) -> Result<(), ScenarioError> {
    set.try_for_each(|(key, value)| written::set(origin, table, key, value.clone()))
}

fn read_table(origin: &str, text: &str) -> Result<Table, ScenarioError> {
    text.parse().map_err(|e| ScenarioError::syntax(origin, &e))
}

/// Lays the file's rig over the one that `rig.base` names.
fn merge_base(origin: &str, table: &mut Table) -> Result<(), ScenarioError> {
    let Some(Value::Table(own)) = table.get_mut("rig") else { return Ok(()) };
    let names: Vec<&str> = RigBase::ALL.iter().map(|base| base.name()).collect();
    let expected = format!("the name of a rig: {}", names.join(", "));
    let base = match own.get("base") {
        Some(Value::String(name)) => {
            RigBase::named(name).ok_or_else(|| (format!("\"{name}\""), nearest(name, &names)))
        }
        other => Err((other.map_or("missing".to_owned(), shown), String::new())),
    };
    let base = base.map_err(|(value, like)| {
        ScenarioError::value(origin, "rig.base", &value, &format!("{expected}{like}"))
    })?;
    let mut merged = RigParams::base_table(base);
    // Alternatives: naming one drops the base's other.
    let nested = <RigParams as Params<f64>>::INFO.table().map_or(&[][..], |info| info.nested);
    for choice in nested.iter().filter(|n| matches!(n.info, Info::Choice(_))).map(|n| n.key) {
        if let (Some(Value::Table(own)), Some(Value::Table(base))) = (own.get(choice), merged.get(choice))
            && own.keys().any(|k| !base.contains_key(k))
        {
            merged.remove(choice);
        }
    }
    overlay(&mut merged, std::mem::take(own));
    *own = merged;
    Ok(())
}

/// The error of a parameter of the table at `path`, as the file has it.
fn error_of(origin: &str, path: &str, table: &Table, e: &ParamError) -> ScenarioError {
    let (Some(_), Some(row)) = (e.table(), e.row()) else {
        return ScenarioError::new(origin, path, "", e.to_string());
    };
    let key = if path.is_empty() { row.key.to_owned() } else { format!("{path}.{}", row.key) };
    let value = match lookup(table, &key) {
        // A table's own text would be long; the core says which point.
        Some(Value::Array(_)) => format!("(point {})", e.value),
        Some(value) => shown(value),
        None => row.unit.from_si(e.value).to_string(),
    };
    let expected = match e.relation() {
        Some(relation) => relation.expected.to_owned(),
        None => row.range.words(row.kind, &row.unit, false).to_string(),
    };
    ScenarioError::value(origin, &key, &value, &expected)
}

fn overlay(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(b)), Value::Table(o)) => overlay(b, o),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// The text of a file that people write, which is no longer than 16 MiB.
///
/// # Errors
/// As [`read_text_up_to`].
pub fn read_text(path: &Path) -> std::io::Result<String> {
    read_text_up_to(path, 16)
}

/// The text of a file of at most so many MiB.
///
/// # Errors
/// It cannot be read, is longer, or is no text.
pub fn read_text_up_to(path: &Path, most_mib: u64) -> std::io::Result<String> {
    use std::io::{ErrorKind, Read as _};
    let most = most_mib << 20;
    let mut text = String::new();
    let read = std::fs::File::open(path)?.take(most + 1).read_to_string(&mut text)?;
    if read as u64 > most {
        let message = format!("more than {most_mib} MiB: expected a shorter file");
        return Err(std::io::Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(text)
}
