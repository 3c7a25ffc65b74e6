//! From a scenario to what runs: servo, supervisor, path, numbers for the wire and the log.

use crate::build_error::BuildError;
use crate::drift::Drift;
use clutch_core::law::ControlLaw;
use clutch_core::supervisor::Checks;
use clutch_core::{
    ActuatorKind, DacCode, FNV_64, FixedCounts, Micros, OnDisc, Real, Servo, ServoParams, Supervisor, Target,
    fnv1a_64,
};
use clutch_log::{Header, Source};
use clutch_node::ControllerParams;
use clutch_settings::{RunParams, RunTimes, Settings};
use clutch_sim::detected::Detector;
use clutch_sim::scenario::{Plan, ScalarKind};
use clutch_sim::{Keep, Scenario, ScenarioError};
use clutch_wire::Hello;

/// Hash of the whole scenario, defaults filled in: what the board echoes.
#[must_use]
pub fn config_hash(scenario: &Scenario) -> u64 {
    fnv1a_64(FNV_64, scenario.canonical().as_bytes())
}

/// Hash of what decides the law's answers: law, model, velocity, output, shell, sampling, encoder,
/// converter. Two logs with the same hash come from the same law.
#[must_use]
pub fn law_hash(scenario: &Scenario) -> u64 {
    let tables = [
        "law.",
        "model.",
        "velocity.",
        "output.",
        "shell.",
        "sampling.",
        "rig.encoder.",
        "rig.dac.",
        "friction_map.",
    ];
    let mut text = String::new();
    for (key, value) in scenario.parameters() {
        if tables.iter().any(|t| key.starts_with(t)) {
            text += &format!("{key}={value}\n");
        }
    }
    fnv1a_64(FNV_64, text.as_bytes())
}

/// The parts of a run on a board, in the scalar `T`.
#[derive(Clone, Debug)]
pub struct BuiltRun<T: Real> {
    /// The servo's parameters, for one built around another law.
    pub params: ServoParams<T>,
    /// The servo.
    pub servo: Servo<T>,
    /// The supervisor.
    pub supervisor: Supervisor<T>,
    /// Numbers for the wire.
    pub controller: ControllerParams,
    /// The detector that sees stick-slip in counts and voltages.
    pub detector: Detector,
    /// The watch over friction and load.
    pub drift: Drift,
    /// Ticks of the run.
    pub ticks: u64,
}

impl<T: Real> BuiltRun<T> {
    /// Builds a scenario's run; `run` is the run's number on the wire.
    ///
    /// # Errors
    /// The scenario has no safe state.
    pub fn new(scenario: &Scenario, run: u16) -> Result<Self, BuildError> {
        BuiltRun::with_checks(scenario, run, Checks::ALL)
    }

    /// The same with fewer of the supervisor's checks: for the campaign that shows that each is
    /// needed.
    ///
    /// # Errors
    /// As [`BuiltRun::new`].
    pub fn with_checks(scenario: &Scenario, run: u16, checks: Checks) -> Result<Self, BuildError> {
        let spec = scenario.spec();
        let safety = scenario.safety()?;
        let plan = scenario.plan()?;
        let servo_params = spec.servo()?.cast::<T>();
        let limits = scenario.supervisor(safety).cast::<T>();
        let bounds = scenario.supervised_bounds(&plan.bounds)?.cast::<T>();
        let cycles = |n: u32| Micros(spec.period.0.saturating_mul(n));
        Ok(BuiltRun {
            params: servo_params,
            servo: Servo::new(&servo_params).map_err(|e| scenario.refused_in_single(&e))?,
            supervisor: Supervisor::new(&limits, &servo_params, &bounds)
                .map_err(|e| scenario.refused_in_single(&e))?
                .with_checks(checks),
            controller: ControllerParams {
                run,
                config: config_hash(scenario),
                boot: 0, // until the board has said it
                watchdog: cycles(safety.limits.watchdog_cycles),
                valid: cycles(safety.limits.valid_cycles),
                silence: cycles(safety.limits.supervisor.silence_cycles),
            },
            detector: Detector::new(&spec, Keep::Trace)?,
            drift: Drift::new(scenario, &plan.bounds)?,
            ticks: scenario.ticks(),
        })
    }
}

/// The settings that a board needs to close the loop by itself; the run ends there after so many ticks.
///
/// # Errors
/// The scenario is not one in single precision, or asks for what boards do not have.
pub fn settings(
    scenario: &Scenario,
    built: &BuiltRun<f32>,
    host_silence: Micros,
    ticks: u64,
) -> Result<Settings, BuildError> {
    if scenario.scalar() != ScalarKind::F32 {
        return Err(BuildError::Scalar);
    }
    let spec = scenario.spec();
    if spec.friction_map.is_some() {
        return Err(BuildError::Map);
    }
    let within = spec.run.start_position().0 & ((1 << FixedCounts::FRACTION_BITS) - 1);
    Ok(Settings::new(&RunParams {
        servo: &built.params,
        supervisor: &scenario.supervisor(scenario.safety()?).cast(),
        bounds: &scenario.supervised_bounds(&scenario.plan()?.bounds)?.cast(),
        reference: &spec.reference.cast(),
        start: FixedCounts(within),
        times: RunTimes {
            watchdog: built.controller.watchdog,
            valid: built.controller.valid,
            silence: built.controller.silence,
            host_silence,
        },
        ticks,
    })?)
}

/// The note for a scenario in which [`in_single_precision`] changes something.
pub const SINGLE_PRECISION: &str = "such a board calculates in single precision: sampling.scalar = \"f32\"";

/// The scenario as a board takes it that closes the loop itself; none if it is one already.
///
/// # Errors
/// The scenario does not go with single precision.
pub fn in_single_precision(scenario: &Scenario) -> Result<Option<Scenario>, ScenarioError> {
    if scenario.scalar() == ScalarKind::F32 {
        return Ok(None);
    }
    let set = [("sampling.scalar".to_owned(), "f32".to_owned())];
    Scenario::parse(scenario.name(), &scenario.canonical(), &set).map(Some)
}

/// The scenario's path from the count on which a run begins, and its map of the disc. The path's first point lies within
/// that count, where the simulation's does, and its targets are the simulation's in the same scalar.
///
/// # Errors
/// None for a checked scenario.
pub fn path<T: Real>(
    scenario: &Scenario,
) -> Result<OnDisc<'_, impl Fn(u64) -> Target<T> + Copy>, BuildError> {
    let reference = scenario.spec().path::<T>()?;
    // Whole counts, so that nothing is rounded anew.
    let first = reference.at(0).position.0 >> FixedCounts::FRACTION_BITS;
    let first = FixedCounts::from_counts(first);
    let path = move |tick: u64| {
        let target = reference.at(tick);
        let position = FixedCounts(target.position.0.wrapping_sub(first.0));
        Target { position, ..target }
    };
    Ok(OnDisc { path, map: scenario.spec().friction_map })
}

/// The scalar of a scenario, as a log names it.
#[must_use]
pub fn scalar_name(scalar: ScalarKind) -> &'static str {
    match scalar {
        ScalarKind::F32 => "f32",
        ScalarKind::F64 => "f64",
    }
}

/// A log's header for a run of a scenario.
#[must_use]
pub fn header<T: Real>(
    scenario: &Scenario,
    servo: &Servo<T>,
    source: Source,
    port: &str,
    version: &str,
) -> Header {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    Header {
        scenario_name: scenario.name().to_owned(),
        scenario_toml: scenario.canonical(),
        parameters: scenario.parameters(),
        version: version.to_owned(),
        law_hash: law_hash(scenario),
        port: port.to_owned(),
        source,
        scalar: scalar_name(scenario.scalar()).to_owned(),
        period_us: scenario.spec().period.0,
        term_names: servo.law().term_names().iter().map(|&name| name.to_owned()).collect(),
        started_unix_ns: now.map_or(0, |t| u64::try_from(t.as_nanos()).unwrap_or(u64::MAX)),
        ..Header::default()
    }
}

/// The reasons why a board does not fit a scenario: a line each; empty if it does.
#[must_use]
pub fn misfits(scenario: &Scenario, hello: &Hello) -> Vec<String> {
    let spec = scenario.spec();
    let mut lines = Vec::new();
    let mut differ = |what: &str, board: String, key: &str, ours: String| {
        if board != ours {
            lines.push(format!("{what}: the board has {board}, the scenario {key} = {ours}"));
        }
    };
    differ(
        "encoder",
        hello.counts_per_rev.to_string(),
        "rig.encoder.counts_per_rev",
        spec.rig.encoder.sensor.counts_per_rev.to_string(),
    );
    differ("converter", hello.dac_bits.to_string(), "rig.dac.bits", spec.rig.dac.converter.bits.to_string());
    let volts = |mv: i32| format!("{:.3} V", f64::from(mv) / 1000.0);
    let ours = |v: f64| format!("{v:.3} V");
    differ("converter", volts(hello.dac_lowest_mv), "rig.dac.lowest_v", ours(spec.rig.dac.converter.lowest));
    differ(
        "converter",
        volts(hello.dac_highest_mv),
        "rig.dac.highest_v",
        ours(spec.rig.dac.converter.highest),
    );
    let period = spec.period.0;
    if period < hello.period_min_us || period > hello.period_max_us {
        lines.push(format!(
            "period: the board samples each {} to {} µs, the scenario sampling.period_us = {period}",
            hello.period_min_us, hello.period_max_us
        ));
    }
    if let Ok(safety) = scenario.safety() {
        let watchdog = u64::from(safety.limits.watchdog_cycles) * u64::from(period);
        if watchdog > u64::from(hello.watchdog_max_us) {
            lines.push(format!(
                "watchdog: the board's reaches {} µs, the scenario asks for {watchdog} µs (safety.limits.watchdog_cycles = {})",
                hello.watchdog_max_us, safety.limits.watchdog_cycles
            ));
        }
    }
    lines
}

/// Volts at which the board powers up, and whether that is what the scenario's safe state wants.
#[must_use]
pub fn boot_output(scenario: &Scenario, hello: &Hello, plan: &Plan) -> (f64, bool) {
    let spec = scenario.spec();
    let volts =
        clutch_core::Dac::new(&spec.rig.dac.converter).map_or(0.0, |d| d.volts(DacCode(hello.boot_code)));
    let holds = if plan.bounds.actuator == ActuatorKind::Motor {
        // Its safe state does not matter: nothing watches it yet.
        plan.bounds.left_over(volts) <= 0.0
    } else {
        scenario.safety().is_ok_and(|s| match s.on_fault.holding_voltage() {
            Some(_) => volts + 1e-9 >= plan.envelope.holding_voltage,
            None => true,
        })
    };
    (volts, holds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_sim::progress::UNWATCHED;
    use clutch_sim::run::{Keep, simulate_watched};

    fn same_targets<T: Real>(name: &str) {
        let scalar = if size_of::<T>() == 4 { "f32" } else { "f64" };
        for start in ["0.0", "0.625", "-3.25", "123456789.75"] {
            let set = [("sampling.scalar", scalar), ("run.start_counts", start), ("run.duration_s", "3.0")];
            let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
            let scenario = Scenario::load(name.as_ref(), &set).unwrap();
            let trace = simulate_watched::<T>(&scenario.spec(), Keep::Trace, UNWATCHED).unwrap().trace;
            let path = path::<T>(&scenario).unwrap();
            // The loop counts from the count on which it begins.
            let origin = trace.target_fixed[0].0 >> FixedCounts::FRACTION_BITS;
            let origin = FixedCounts::from_counts(origin);
            for (k, simulated) in trace.target_fixed.iter().enumerate() {
                let looped = (path.path)(k as u64);
                let what = format!("{name} in {scalar} from {start}, tick {k}");
                assert_eq!(looped.position.plus(origin), *simulated, "{what}");
                assert_eq!(looped.velocity.to_f64(), trace.target_velocity[k], "{what}");
                assert_eq!(looped.acceleration.to_f64(), trace.target_acceleration[k], "{what}");
            }
        }
    }

    #[test]
    fn the_loop_asks_for_the_targets_of_the_simulation_bit_for_bit() {
        for name in ["minimum_jerk", "smc_2"] {
            same_targets::<f32>(name);
            same_targets::<f64>(name);
        }
    }

    /// Rounded to single precision an angle of a count is less than one.
    #[test]
    fn a_supervisor_that_single_precision_refuses_is_refused_by_its_key() {
        let base = Scenario::text("board_smc_2".as_ref()).unwrap().1;
        for (counts, deg) in [("3600", "0.1"), ("14400", "0.025"), ("36000", "0.01")] {
            let set = [("rig.encoder.counts_per_rev", counts), ("safety.limits.jump_deg", deg)];
            let set = set.map(|(key, value)| (key.to_owned(), value.to_owned()));
            let scenario = Scenario::parse("small", &base, &set).unwrap();
            BuiltRun::<f64>::new(&scenario, 1).unwrap();
            let Err(BuildError::Scenario(error)) = BuiltRun::<f32>::new(&scenario, 1) else {
                panic!("{counts}, {deg}")
            };
            assert_eq!(
                (error.key.as_str(), error.value.as_str()),
                ("safety.limits.jump_deg", deg),
                "{error}"
            );
            assert!(error.message.ends_with("in single precision (sampling.scalar = \"f32\")"), "{error}");
        }
    }
}
