//! One table of a scenario by itself: what is wrong with it whatever the rest may be.

use super::error::{self, Locator, ScenarioError};
use super::file::File;
use super::{merge_base, read_table};
use crate::rig::Rig;
use clutch_core::law::{Law, Output};
use clutch_core::reference::Reference;
use clutch_core::{
    Bounds, DacParams, Encoder, FixedCounts, Micros, ParamError, Plant, PlantParams, ServoParams, Supervisor,
    Tolerances, VelocitySource,
};
use toml::{Table, Value};

/// What stands beside a table while it is checked: the paper's rig, law and sampling.
const BESIDE: &str = "name = \"beside\"\n[rig]\nbase = \"paper\"\n[law.smc]\n[reference.ramp]\nrate_deg_s = 1.0\n\
                      [run]\nduration_s = 5.0\nsettle_s = 1.0\n";

/// Checks the table at `key` (`law.smc`, `rig.friction`, `reference.ramp`, `run` …) by itself, and
/// gives it back with every default filled in. What depends on other tables (a path that the
/// drive is too weak for) is not looked at: [`Scenario::from_table`](super::Scenario::from_table) does that.
///
/// # Errors
/// As for a file; `origin` is what errors begin with, their key is the whole one.
pub fn check_section(origin: &str, key: &str, table: Table) -> Result<Table, ScenarioError> {
    let mut whole = read_table(origin, BESIDE)?;
    let (section, rest) = key.split_once('.').map_or((key, None), |(s, r)| (s, Some(r)));
    match (section, rest) {
        // Each is one choice of several: the one beside it must go.
        ("law" | "velocity" | "reference", Some(_)) => {
            whole.remove(section);
        }
        ("safety", _) => {
            whole.insert("safety".into(), Value::Table(a_safety()));
            if rest.is_some_and(|r| r.starts_with("on_fault")) {
                error::set(origin, &mut whole, "safety.on_fault", Value::Table(Table::new()))?;
            }
        }
        _ => {}
    }
    error::set(origin, &mut whole, key, Value::Table(table))?;
    if section == "rig" && rest.is_none() {
        // A rig without a base is the paper's, with changes.
        let base = error::lookup(&whole, "rig.base").cloned().unwrap_or_else(|| "paper".into());
        error::set(origin, &mut whole, "rig.base", base)?;
    }
    merge_base(origin, &mut whole)?;
    let file: File = error::deserialize(origin, &whole)?;
    let locator = Locator::new(origin, &file);
    if let Some(safety) = &file.safety {
        check_reason(&safety.reason, &locator)?;
    }
    check(&file, section).map_err(|e| locator.at(section, &e))?;
    Ok(error::lookup(locator.table(), key).and_then(Value::as_table).cloned().unwrap_or_default())
}

fn a_safety() -> Table {
    let hold = Table::from_iter([("volts_v".to_owned(), Value::Float(4.5))]);
    let on_fault = Table::from_iter([("hold".to_owned(), Value::Table(hold))]);
    Table::from_iter([
        ("reason".to_owned(), Value::String("beside".into())),
        ("on_fault".to_owned(), Value::Table(on_fault)),
    ])
}

/// Stand-ins for the other tables while one table is checked alone: a long time, a small angle or a high
/// voltage is fine with some periods, encoders and converters, and not with others.
struct Beside {
    period: Micros,
    encoder: Encoder,
    dac: DacParams,
}

impl Beside {
    /// The paper's first: its error is the one that is told if none will do.
    fn all() -> impl Iterator<Item = Beside> {
        let encoders = [Some(Encoder::PAPER), Encoder::new::<f64>(1 << 24).ok(), Encoder::new::<f64>(4).ok()];
        let dacs = [
            DacParams::default(),
            DacParams { bits: 8, ..DacParams::default() },
            DacParams { bits: 16, lowest: 0.0, highest: 1000.0 },
        ];
        dacs.into_iter().flat_map(move |dac| {
            encoders.into_iter().flatten().flat_map(move |encoder| {
                [1000, 1, 100, 10_000, 1_000_000].map(|us| Beside { period: Micros(us), encoder, dac })
            })
        })
    }
}

fn check(file: &File, section: &str) -> Result<(), ParamError> {
    let mut first = None;
    for beside in Beside::all() {
        match check_beside(file, section, &beside) {
            Ok(()) => return Ok(()),
            Err(e) => first = first.or(Some(e)),
        }
    }
    first.map_or(Ok(()), Err)
}

fn check_beside(file: &File, section: &str, beside: &Beside) -> Result<(), ParamError> {
    let Beside { period, encoder, dac } = *beside;
    let model = PlantParams::default();
    match section {
        "rig" => Rig::new(&file.rig.params()?, 1).map(drop),
        "model" => {
            let model = file.model.params();
            Plant::new(&model)?;
            Bounds::around(&model, &Tolerances::default()).map(drop)
        }
        "law" => Law::new(&file.law.params(), &model, &Default::default(), period).map(drop),
        "velocity" => {
            let plant = Plant::new(&model)?;
            VelocitySource::new(&file.velocity.params(), &plant, encoder, period).map(drop)
        }
        "output" => Output::new(&file.output.params(), period).map(drop),
        "reference" => {
            let knots = file.reference.knots(encoder)?;
            let params = file.reference.params(&knots);
            Reference::new(&params, FixedCounts(0), encoder, period).map(drop)
        }
        "sampling" => Micros(file.sampling.period_us).period::<f64>().map(drop),
        "bounds" => {
            let expected = "at least 0 and below 100 %";
            let bounds =
                Bounds::around(&model, &file.bounds.tolerances()).map_err(|e| ParamError { expected, ..e });
            let rate = file.bounds.reach_rate_rad_s2;
            if !(rate >= 0.0 && rate.is_finite()) {
                let expected = "a finite rate of at least 0 rad/s²";
                return Err(ParamError { field: "reach_rate", value: rate, expected });
            }
            bounds.map(drop)
        }
        "run" => file.run.params().check(period),
        "safety" => {
            let Some(safety) = &file.safety else { return Ok(()) };
            let safety = safety.safety(1.0);
            check_cycles(&safety)?;
            let paper = ServoParams::paper(file.law.params());
            let servo = ServoParams { period, encoder, dac, ..paper };
            let bounds = Bounds::around(&model, &Tolerances::default())?;
            Supervisor::new(&safety.supervisor, &servo, &bounds).map(drop)
        }
        _ => Ok(()),
    }
}

/// A safe state is somebody's choice, who says why.
pub(super) fn check_reason(reason: &str, at: &Locator) -> Result<(), ScenarioError> {
    if reason.trim().is_empty() {
        let message = "expected why this safe state is right for this rig, as \"a weight drives the shaft\"";
        return Err(at.message("safety.reason", message.to_owned()));
    }
    Ok(())
}

/// How long board and code wait.
pub(super) fn check_cycles(safety: &super::Safety) -> Result<(), ParamError> {
    let cycles = |field, n: u32, low: u32, expected| {
        let bad = ParamError { field, value: f64::from(n), expected };
        if (low..=1000).contains(&n) { Ok(()) } else { Err(bad) }
    };
    cycles("watchdog_cycles", safety.watchdog_cycles, 2, "2 to 1000 periods")?;
    cycles("valid_cycles", safety.valid_cycles, 1, "1 to 1000 periods")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    fn table(text: &str) -> Table {
        text.parse().expect("TOML")
    }

    #[test]
    fn a_table_by_itself_gets_its_defaults() {
        let smc = check_section("Smc", "law.smc", Table::new()).unwrap();
        let whole = Scenario::built_in("smc_2").unwrap().unwrap();
        assert_eq!(Some(&Value::Table(smc)), error::lookup(whole.table(), "law.smc"));
        let rig = check_section("Rig", "rig", table("delay_ticks = 2")).unwrap();
        assert_eq!(rig.get("delay_ticks"), Some(&Value::Integer(2)));
        assert_eq!(rig.get("base"), Some(&Value::String("paper".into())));
    }

    #[test]
    fn what_depends_on_other_tables_is_left_to_the_scenario() {
        // Faster than the paper's rig may turn, and a weight that 1 V would hold.
        check_section("Ramp", "reference.ramp", table("rate_deg_s = 400.0")).unwrap();
        check_section("HoldVoltage", "safety.on_fault.hold", table("volts_v = 1.0")).unwrap();
        // Beyond the paper's converter, its period, its encoder.
        check_section("HoldVoltage", "safety.on_fault.hold", table("volts_v = 12.0")).unwrap();
        check_section("RunSettings", "run", table("duration_s = 20000.0")).unwrap();
        check_section("Limits", "safety.limits", table("jump_deg = 0.001")).unwrap();
    }

    #[test]
    fn each_bad_table_is_named_with_its_key() {
        for (key, text, bad) in [
            ("law.smc", "kp_v = -1.0", "law.smc.kp_v"),
            ("law.pd", "kp_v_rad = nan", "law.pd.kp_v_rad"),
            ("law.ctc", "kp = 1.0", "law.ctc.kp"),
            ("velocity.smoothed_derivative", "smoothing = 2.0", "velocity.smoothed_derivative.smoothing"),
            (
                "velocity.observer",
                "disturbance_walk_nm_rt_s = -1.0",
                "velocity.observer.disturbance_walk_nm_rt_s",
            ),
            ("rig.friction", "mu_static = -0.1", "rig.friction.mu_static"),
            ("rig.drive.weight", "mass_kg = -1.0", "rig.drive.weight.mass_kg"),
            ("rig.encoder", "counts_per_rev = 0", "rig.encoder.counts_per_rev"),
            ("rig", "inertia_kg_m2 = 0.0", "rig.inertia_kg_m2"),
            ("model", "inertia_kg_m2 = 0.0", "model.inertia_kg_m2"),
            ("model", "drive_torque_nm = 0.0", "model.drive_torque_nm"),
            ("safety", "reason = \" \"\non_fault = { release = {} }", "safety.reason"),
            (
                "rig.ripple",
                "rms = 0.1\nlowest_waves_per_turn = 1\nhighest_waves_per_turn = 2\nspacing_waves_per_turn = 0",
                "rig.ripple.spacing_waves_per_turn",
            ),
            ("output", "lowest_v = -1.0", "output.lowest_v"),
            (
                "reference.minimum_jerk",
                "distance_deg = 90.0\nduration_s = 0.0",
                "reference.minimum_jerk.duration_s",
            ),
            ("sampling", "period_us = 0", "sampling.period_us"),
            ("bounds", "friction_percent = 100.0", "bounds.friction_percent"),
            ("run", "duration_s = 0.0", "run.duration_s"),
            ("safety.limits", "watchdog_cycles = 1", "safety.limits.watchdog_cycles"),
            ("safety.on_fault.ramp", "rate_v_s = 0.0\nvolts_v = 4.0", "safety.on_fault.ramp.rate_v_s"),
        ] {
            let e = check_section("here", key, table(text)).expect_err(key);
            assert_eq!(e.key, bad, "{e}");
        }
    }
}
