//! Scenarios: a TOML file that describes rig, law, path, sampling, run and seed.
//!
//! The rig begins as a copy of the one that `rig.base` names; every key in the file overrides
//! its value. Unknown keys are errors. `docs/scenario.md` lists all keys.

mod error;
mod file;
mod section;

pub use error::ScenarioError;
pub use file::ScalarKind;
pub use section::check_section;

use crate::progress::Report;
use crate::rig::{Rig, RigParams, Ripple};
use crate::run::{Keep, Run, RunError, RunSpec, Start, simulate_watched};
use clutch_core::certificate::{Certificate, Demand, PaperConditions, certify, paper_conditions};
use clutch_core::law::{Law, LawParams, Output};
use clutch_core::reference::{Knot, Reference};
use clutch_core::{
    Bounds, Dac, Envelope, FixedCounts, Interval, Micros, Obstacle, ParamError, Plant, Real, Supervisor,
    SupervisorParams, Tolerances, VelocitySource, check_path,
};
use error::Locator;
use file::File;
use std::io::ErrorKind;
use std::path::Path;
use toml::{Table, Value};

/// A built-in scenario.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// Its name.
    pub name: &'static str,
    /// Its file.
    pub toml: &'static str,
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
    "bench_pd_2",
    "bench_smc_2",
    "observer_smc_2",
    "minimum_jerk",
    "hand_guided",
    "f32_smc_2",
    "board_smc_2",
    "board_minimum_jerk",
);

/// How a run on a board ends, and what ends it.
#[derive(Clone, Debug, PartialEq)]
pub struct Safety {
    /// Why this safe state is the right one for this rig, in the operator's words.
    pub reason: String,
    /// Limits and safe state.
    pub supervisor: SupervisorParams,
    /// Periods without a valid code after which the board goes to the safe state by itself.
    pub watchdog_cycles: u32,
    /// Periods after its sample during which a code is valid.
    pub valid_cycles: u32,
}

/// A checked scenario.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Its title.
    pub name: String,
    /// Scalar that the servo runs in.
    pub scalar: ScalarKind,
    spec: RunSpec<'static>,
    reference: file::ReferenceFile,
    knots: Vec<Knot>,
    tolerances: Tolerances,
    reach_rate: f64,
    safety: Option<Safety>,
    locator: Locator,
    /// Made once: it walks the whole path.
    plan: Option<Plan>,
}

/// A scenario could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The system's answer.
    #[error("{name}: {}", io_text(error))]
    Io {
        /// The file.
        name: String,
        /// What the system said; told in words, so not a source to be told again.
        error: std::io::Error,
    },
    /// What is in the file.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

fn io_text(e: &std::io::Error) -> String {
    match e.kind() {
        ErrorKind::NotFound => {
            "no such file, and no built-in scenario of that name; `clutch scenario list` shows those, \
             `clutch scenario new FILE` writes one to begin with"
                .to_owned()
        }
        ErrorKind::InvalidData => "not a text file: expected TOML in UTF-8".to_owned(),
        _ => e.to_string(),
    }
}

/// What can be said of a scenario before it runs.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What the path asks for.
    pub envelope: Envelope<f64>,
    /// What is known of the plant.
    pub bounds: Bounds,
    /// What the gains guarantee.
    pub certificate: Certificate,
    /// The paper's own conditions; for the sliding-mode laws, for which it states them.
    pub paper: Option<PaperConditions>,
    /// The demand that both were asked.
    pub demand: Demand,
}

impl Scenario {
    /// Reads a scenario; `origin` (a file's name) is what errors begin with, and each of `set`
    /// (`("law.smc.kp_v", "4")`) overrides a key.
    ///
    /// # Errors
    /// What is wrong, where, and what is expected.
    pub fn parse(origin: &str, text: &str, set: &[(String, String)]) -> Result<Scenario, ScenarioError> {
        let read = |(key, text): &(String, String)| Ok((key.clone(), error::read_value(origin, key, text)?));
        let values = set.iter().map(read).collect::<Result<Vec<_>, ScenarioError>>()?;
        Scenario::from_table(origin, read_table(origin, text)?, &values)
    }

    /// As [`Scenario::parse`], from a table that is already read, with values for the keys to
    /// override.
    ///
    /// # Errors
    /// What is wrong, where, and what is expected.
    pub fn from_table(
        origin: &str,
        mut table: Table,
        set: &[(String, Value)],
    ) -> Result<Scenario, ScenarioError> {
        override_keys(origin, &mut table, set)?;
        merge_base(origin, &mut table)?;
        let file: File = error::deserialize(origin, &table)?;
        Scenario::check(origin, &file)
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
        match std::fs::read_to_string(name) {
            Ok(text) => Ok((origin, text)),
            Err(error) => Err(LoadError::Io { name: origin, error }),
        }
    }

    fn check(origin: &str, file: &File) -> Result<Scenario, ScenarioError> {
        let locator = Locator::new(origin, file);
        let rig = file.rig.params().map_err(|e| locator.at("rig", &e))?;
        let run = file.run.params();
        let model = file.model.params();
        let checked = Rig::new(&rig, run.seed).map_err(|e| locator.at("rig", &e))?;
        Bounds::around(&model, &Tolerances::default()).map_err(|e| locator.at("model", &e))?;
        let tolerances = file.bounds.tolerances();
        Bounds::around(&model, &tolerances).map_err(|e| {
            let expected = "at least 0 and below 100 %";
            locator.at("bounds", &ParamError { expected, ..e })
        })?;
        let knots = file.reference.knots(checked.encoder).map_err(|e| locator.at("reference", &e))?;
        let spec = RunSpec {
            rig,
            period: Micros(file.sampling.period_us),
            velocity: file.velocity.params(),
            model,
            law: file.law.params(),
            output: file.output.params(),
            // Replaced at each use by the file's own path, which borrows the knots.
            reference: clutch_core::reference::ReferenceParams::Hold,
            run,
        };
        let mut scenario = Scenario {
            name: file.name.clone(),
            scalar: file.sampling.scalar,
            spec,
            reference: file.reference.clone(),
            knots,
            tolerances,
            reach_rate: file.bounds.reach_rate_rad_s2,
            safety: file.safety.as_ref().map(|s| s.safety(checked.params.speed_limit)),
            locator,
            plan: None,
        };
        scenario.plan = Some(scenario.check_parts()?);
        Ok(scenario)
    }

    /// Builds each part once, so that whatever is wrong is said before anything runs.
    fn check_parts(&self) -> Result<Plan, ScenarioError> {
        let (spec, at) = (self.spec(), &self.locator);
        spec.period.period::<f64>().map_err(|e| at.at("sampling", &e))?;
        match self.scalar {
            ScalarKind::F32 => self.check_servo::<f32>(&spec)?,
            ScalarKind::F64 => self.check_servo::<f64>(&spec)?,
        }
        spec.run.check(spec.period).map_err(|e| at.at("run", &e))?;
        let rig = Rig::new(&spec.rig, spec.run.seed).map_err(|e| at.at("rig", &e))?;
        spec.engine(&rig).map_err(|e| at.message("run.engine", e.to_string()))?;
        self.path().map_err(|e| at.at("reference", &e))?;
        if self.scalar == ScalarKind::F32 {
            // What is in range in f64 can be nothing, or beyond everything, in f32.
            spec.path::<f32>().map_err(|e| at.at("reference", &e))?;
        }
        let plan = self.make_plan()?;
        self.safety.as_ref().map_or(Ok(()), |s| self.check_safety(s, &plan))?;
        Ok(plan)
    }

    fn check_safety(&self, safety: &Safety, plan: &Plan) -> Result<(), ScenarioError> {
        let (spec, at) = (self.spec(), &self.locator);
        let wrong = |e: ParamError| at.at("safety", &e);
        section::check_reason(&safety.reason, at)?;
        let servo = spec.servo().map_err(|e| at.at("rig", &e))?;
        Supervisor::new(&safety.supervisor, &servo, &plan.bounds).map_err(wrong)?;
        section::check_cycles(safety).map_err(wrong)?;
        // A brake that is to hold must hold the strongest drive with the weakest brake.
        let b = &plan.bounds;
        let needed = b.drive_torque.high / b.weakest_brake();
        match safety.supervisor.on_fault.holding_voltage() {
            Some(volts) if volts < needed => Err(at.message(
                "safety.on_fault",
                format!("holds with {volts} V, and the strongest drive against the weakest brake of [bounds] needs {needed:.4} V; twice as much is usual"),
            )),
            _ => Ok(()),
        }
    }

    /// The servo part by part, in the scalar that it runs in.
    fn check_servo<T: Real>(&self, spec: &RunSpec<'_>) -> Result<(), ScenarioError> {
        let at = |section: &'static str| {
            move |e: ParamError<T>| {
                let value = e.value.to_f64();
                self.locator.at(section, &ParamError { field: e.field, value, expected: e.expected })
            }
        };
        let servo = spec.servo().map_err(|e| self.locator.at("rig", &e))?.cast::<T>();
        let model = Plant::new(&servo.model).map_err(at("model"))?;
        Output::new(&servo.output, servo.period).map_err(at("output"))?;
        servo.check_output().map_err(at("output"))?;
        Law::new(&servo.law, &servo.model, &servo.output, servo.period)
            .map_err(|e| at(if e.field.starts_with("mu_") { "model" } else { "law" })(e))?;
        VelocitySource::new(&servo.velocity, &model, servo.encoder, servo.period).map_err(at("velocity"))?;
        Dac::new(&servo.dac).map_err(at("rig"))?;
        Ok(())
    }

    /// How a run on a board ends.
    ///
    /// # Errors
    /// The scenario has no table `[safety]`.
    pub fn safety(&self) -> Result<&Safety, ScenarioError> {
        self.safety.as_ref().ok_or_else(|| {
            self.locator.message(
                "safety",
                "missing; a run on a board needs a safe state, and there is no default. For a shaft that a weight or a spring drives:\n\n\
                 [safety]\nreason = \"a weight drives the shaft\"\n\n[safety.on_fault.hold]\nvolts_v = 4.5\n\n\
                 docs/safety.md says how to choose"
                    .to_owned(),
            )
        })
    }

    /// Every key with its tables, and its value, defaults filled in.
    #[must_use]
    pub fn parameters(&self) -> Vec<(String, String)> {
        self.locator.flattened()
    }

    /// The scenario as TOML with every default filled in; parsing it gives the same scenario.
    #[must_use]
    pub fn canonical(&self) -> String {
        self.table().to_string()
    }

    /// The scenario as a table with every default filled in.
    #[must_use]
    pub fn table(&self) -> &Table {
        self.locator.table()
    }

    /// The specification of the run.
    #[must_use]
    pub fn spec(&self) -> RunSpec<'_> {
        RunSpec { reference: self.reference.params(&self.knots), ..self.spec.clone() }
    }

    /// The number of ticks in the run.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.spec.run.ticks(self.spec.period)
    }

    fn path(&self) -> Result<Reference<'_, f64>, ParamError> {
        let encoder = clutch_core::Encoder::new::<f64>(self.spec.rig.counts_per_rev)?;
        Reference::new(&self.reference.params(&self.knots), FixedCounts(0), encoder, self.spec.period)
    }

    /// Path and gains against the bounds of the believed plant.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn plan(&self) -> Result<Plan, ScenarioError> {
        self.plan.clone().map_or_else(|| self.make_plan(), Ok)
    }

    fn make_plan(&self) -> Result<Plan, ScenarioError> {
        let (spec, at) = (self.spec(), &self.locator);
        let param = |section: &'static str| move |e: ParamError| at.at(section, &e);
        let path = self.path().map_err(param("reference"))?;
        let bounds = Bounds::around(&spec.model, &self.tolerances).map_err(param("bounds"))?;
        let law = Law::new(&spec.law, &spec.model, &spec.output, spec.period).map_err(param("law"))?;
        let first = path.at(0).velocity;
        let start_velocity = if spec.run.start == Start::OnPath { first } else { 0.0 };
        let envelope = check_path(&path, self.ticks(), spec.period, start_velocity, &bounds, law.output())
            .map_err(|e| {
                let at_time = format!("a brake cannot follow the path from t = {:.4} s on", e.time);
                let (asked, available) = (e.asked, e.available);
                at.path(match e.obstacle {
                    Obstacle::Reverse => format!(
                        "{at_time}: it runs backwards at {:.4} °/s, and a brake drives nothing; keep the velocity at or above 0",
                        -asked.to_degrees()
                    ),
                    Obstacle::Acceleration if available <= 0.0 && spec.output.lowest > 0.0 => format!(
                        "{at_time}: with output.lowest_v = {} the brake never lets go enough for the drive to keep the path; lower it",
                        spec.output.lowest
                    ),
                    Obstacle::Acceleration => format!(
                        "{at_time}: it accelerates at {:.5} °/s², and the drive grants {:.5} °/s²; accelerate more slowly",
                        asked.to_degrees(),
                        available.to_degrees()
                    ),
                    Obstacle::Voltage => format!(
                        "{at_time}: it needs {asked:.4} V of braking, and output.highest_v = {available}; decelerate more slowly, drive it with less torque, or raise the limit"
                    ),
                    Obstacle::NotFinite => format!("{at_time}: its velocity or acceleration is not a number"),
                })
            })?;
        let limit = spec.rig.speed_limit;
        if envelope.velocity > limit * (1.0 + 1e-9) {
            return Err(at.path(format!(
                "the path's velocity of {:.4} °/s is above rig.speed_limit_deg_s = {:.4}; lower it or raise the limit (angles here are in degrees: 1 rad/s is 57.3 °/s)",
                envelope.velocity.to_degrees(),
                limit.to_degrees()
            )));
        }
        let demand = Demand {
            velocity: envelope.velocity,
            acceleration: envelope.largest_acceleration(),
            reach_rate: self.reach_rate,
            start_error_rate: envelope.start_jump,
            velocity_jump: envelope.velocity_jump,
        };
        let certificate = certify(&law, &bounds, &demand).map_err(param("bounds"))?;
        let paper = match &spec.law {
            LawParams::Smc(p) => Some(paper_conditions(&bounds, &demand, p.kp, p.slope)),
            LawParams::SmcSign(p) => Some(paper_conditions(&bounds, &demand, p.kp, p.slope)),
            _ => None,
        };
        Ok(Plan { envelope, bounds, certificate, paper, demand })
    }

    /// Runs it, keeping what is asked for and telling of its progress in samples.
    ///
    /// # Errors
    /// A motion that cannot be followed; the end of `progress`'s patience.
    pub fn run(&self, keep: Keep, progress: Report<'_>) -> Result<Run, ScenarioError> {
        let spec = self.spec();
        let run = match self.scalar {
            ScalarKind::F32 => simulate_watched::<f32>(&spec, keep, progress),
            ScalarKind::F64 => simulate_watched::<f64>(&spec, keep, progress),
        };
        run.map_err(|e| self.run_error(&e))
    }

    /// The error of a run as one of this scenario.
    #[must_use]
    pub fn run_error(&self, e: &RunError) -> ScenarioError {
        match e {
            RunError::Param(e) => self.locator.at("", e),
            RunError::Engine(_) => self.locator.message("run.engine", e.to_string()),
            RunError::Motion(_) => self.locator.message("rig", e.to_string()),
            RunError::Memory(_) => self.locator.message("run.duration_s", e.to_string()),
            RunError::Stopped => self.locator.message("", e.to_string()),
        }
    }

    /// Where the rig lies outside the bounds that the certificate was asked for: a line each.
    /// The certificate says nothing of such a rig.
    ///
    /// # Errors
    /// None for a checked scenario.
    pub fn outside_bounds(&self, bounds: &Bounds) -> Result<Vec<String>, ScenarioError> {
        let rig = Rig::new(&self.spec.rig, self.spec.run.seed).map_err(|e| self.locator.at("rig", &e))?;
        let p = rig.model.plant.params();
        let swing = rig.model.ripple.as_ref().map_or(0.0, Ripple::largest);
        let (low, high) = rig.drive.range();
        let mut lines = Vec::new();
        let mut check = |name: &str, low: f64, high: f64, bound: &Interval| {
            // A hair's breadth for what °, % and products round.
            let slack = 1e-9 * bound.high.abs();
            if low < bound.low - slack || high > bound.high + slack {
                let range = |a: f64, b: f64| {
                    if b - a <= slack { format!("{a:.5}") } else { format!("{a:.5} … {b:.5}") }
                };
                lines.push(format!(
                    "{name} is {}, bounds {}",
                    range(low, high),
                    range(bound.low, bound.high)
                ));
            }
        };
        let friction = |mu: f64| (mu * (1.0 - swing), mu * (1.0 + swing));
        let (s, d) = (friction(p.friction.mu_static), friction(p.friction.mu_dynamic));
        check("inertia", p.inertia, p.inertia, &bounds.inertia);
        check("driving torque", low, high, &bounds.drive_torque);
        check("viscous damping", p.viscous_damping, p.viscous_damping, &bounds.viscous_damping);
        check("brake gain", p.brake_gain, p.brake_gain, &bounds.brake_gain);
        check("static friction", s.0, s.1, &bounds.mu_static);
        check("dynamic friction", d.0, d.1, &bounds.mu_dynamic);
        Ok(lines)
    }
}

/// Puts values at the dotted keys of a scenario's table, in their order.
///
/// # Errors
/// What is no key, or lies below a value.
pub fn override_keys(origin: &str, table: &mut Table, set: &[(String, Value)]) -> Result<(), ScenarioError> {
    set.iter().try_for_each(|(key, value)| error::set(origin, table, key, value.clone()))
}

fn read_table(origin: &str, text: &str) -> Result<Table, ScenarioError> {
    text.parse().map_err(|e| ScenarioError::syntax(origin, &e))
}

/// Lays the file's rig over the one that `rig.base` names.
fn merge_base(origin: &str, table: &mut Table) -> Result<(), ScenarioError> {
    let Some(Value::Table(own)) = table.get_mut("rig") else { return Ok(()) };
    let expected = format!("the name of a rig: {}", RigParams::NAMES.join(", "));
    let name = match own.get("base") {
        Some(Value::String(name)) => name.clone(),
        other => {
            let value = other.map_or("missing".to_owned(), error::shown);
            return Err(ScenarioError::value(origin, "rig.base", &value, &expected));
        }
    };
    let Some(base) = RigParams::named(&name) else {
        return Err(ScenarioError::value(origin, "rig.base", &format!("\"{name}\""), &expected));
    };
    let mut merged = error::to_table(&file::RigFile::new(&name, &base));
    // Alternatives: naming one drops the base's other.
    if let (Some(Value::Table(own)), Some(Value::Table(base))) = (own.get("drive"), merged.get("drive"))
        && own.keys().any(|k| !base.contains_key(k))
    {
        merged.remove("drive");
    }
    if own.contains_key("brake_geometry") {
        merged.remove("brake_gain_nm_v");
    }
    overlay(&mut merged, std::mem::take(own));
    *own = merged;
    Ok(())
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
