//! One table of a scenario by itself: what is wrong with it whatever the rest may be.

use super::params::ScenarioParams;
use super::{error_of, merge_base, written};
use crate::scenario_error::ScenarioError;
use crate::tables::{check, complete, lookup, read};
use clutch_core::params::{Info, Params, TableInfo};
use toml::{Table, Value};

/// Checks the table at `key` (`law.smc`, `rig.friction.stribeck`, `reference.ramp`, `run` …) by itself, and gives it
/// back with every default filled in. Anything that depends on other tables (a path that the drive is too weak for, a
/// time shorter than the period) is not looked at: [`Scenario::from_table`](super::Scenario::from_table) does that.
///
/// # Errors
/// As for a file; `origin` is what errors begin with, their key is the whole one.
pub fn check_section(origin: &str, key: &str, table: Table) -> Result<Table, ScenarioError> {
    let unknown = || ScenarioError::new(origin, key, "", "no table of a scenario has this name".to_owned());
    let info = info_at(key).ok_or_else(unknown)?;
    let mut whole = Table::new();
    written::set(origin, &mut whole, key, Value::Table(table))?;
    if key == "rig" {
        // A rig without a base is the paper's, with changes.
        let base = lookup(&whole, "rig.base").cloned().unwrap_or_else(|| "paper".into());
        written::set(origin, &mut whole, "rig.base", base)?;
        merge_base(origin, &mut whole)?;
    }
    let mut table = lookup(&whole, key).and_then(Value::as_table).cloned().unwrap_or_default();
    match info {
        At::Info(info) => complete(origin, key, info, &mut table)?,
        At::Option(info) => crate::tables::complete_table(origin, key, info, &mut table)?,
    }
    written::set(origin, &mut whole, key, Value::Table(table.clone()))?;
    // Values that are not in the table stay blank, and are not looked at.
    let mut params: ScenarioParams = read(&whole);
    match check(&mut params, key) {
        None => Ok(table),
        Some((path, e)) => Err(error_of(origin, &path, &whole, &e)),
    }
}

enum At {
    Info(&'static Info),
    Option(&'static TableInfo),
}

/// The declaration of the table at a key.
fn info_at(key: &str) -> Option<At> {
    let mut at = At::Info(&<ScenarioParams as Params<f64>>::INFO);
    for part in key.split('.') {
        let below = |table: &'static TableInfo| table.nested.iter().find(|n| n.key == part).map(|n| n.info);
        at = match at {
            At::Info(Info::Table(table)) | At::Option(table) => At::Info(below(table)?),
            At::Info(Info::Choice(choice)) => {
                At::Option(choice.options.iter().find(|option| option.key == part)?.table)
            }
        };
    }
    Some(at)
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
        assert_eq!(Some(&Value::Table(smc)), lookup(whole.table(), "law.smc"));
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
            ("rig.friction.stribeck", "mu_static = -0.1", "rig.friction.stribeck.mu_static"),
            ("rig.drive.weight", "mass_kg = -1.0", "rig.drive.weight.mass_kg"),
            ("rig.encoder", "counts_per_rev = 0", "rig.encoder.counts_per_rev"),
            ("rig", "inertia_kg_m2 = 0.0", "rig.inertia_kg_m2"),
            ("model", "inertia_kg_m2 = 0.0", "model.inertia_kg_m2"),
            ("safety", "reason = \" \"\non_fault = { release = {} }", "safety.reason"),
            (
                "rig.ripple",
                "rms = 0.1\nlowest_waves_per_turn = 1\nhighest_waves_per_turn = 2\nspacing_waves_per_turn = 0",
                "rig.ripple.spacing_waves_per_turn",
            ),
            ("output", "lowest_v = nan", "output.lowest_v"),
            ("output", "highest_v = 8.0", "output.on_invalid_v"),
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
