//! An identified motor axis as a file: `[model]` and `[bounds]` for scenarios, and the intervals behind them.

use super::Report;
use crate::Estimate;
use crate::rig_file::{Lacks, MOST_PERCENT, RIPPLE, around, identified, need};
use crate::shown::MOTOR_ROWS;
use clutch_core::Actuator;
use clutch_sim::Scenario;
use toml::{Table, Value};

/// Normal force of a model that has none, as torque per unit of μ, N m: only its product with μ matters.
const PRELOAD_NM: f64 = 0.25;

/// The file. Torque per volt and normal force are those of the scenario's model: counts and volts give the other parameters as
/// ratios to the first, and μ only with the second.
///
/// # Errors
/// A parameter that is not known.
pub fn rig_file(report: &Report, scenario: &Scenario) -> Result<String, Lacks> {
    let inertia = need("J/K", &report.inertia)?;
    let viscous = need("C/K", &report.viscous)?;
    let ripple = need("the ripple", &report.ripple)?;
    let load = need("the load", &report.load)?;
    let both = |of: &[crate::Finding; 2], names: [&'static str; 2]| -> Result<[Estimate; 2], Lacks> {
        Ok([need(names[0], &of[0])?, need(names[1], &of[1])?])
    };
    let at_rest = both(&report.at_rest, ["T_s/K forwards", "T_s/K backwards"])?;
    let sliding = both(&report.sliding, ["T_c/K forwards", "T_c/K backwards"])?;
    let actuator = Actuator::new(&scenario.spec().model.actuator).ok();
    let gain = actuator.map_or(0.0, |a| a.motor_gain());
    let preload = actuator.map(|a| a.preload()).filter(|n| *n > 0.0).unwrap_or(PRELOAD_NM);
    // A load gives one way the torque that it takes the other.
    let mean = |of: [Estimate; 2]| {
        let [value, low, high] = [|e: Estimate| e.value, |e: Estimate| e.low, |e: Estimate| e.high]
            .map(|get| 0.5 * (get(of[0]) + get(of[1])));
        Estimate { value, low, high }
    };
    let (at_rest, sliding) = (mean(at_rest), mean(sliding));
    let off = 0.5 * (load.high - load.low);
    // A load that may be none is a part of what friction may be.
    let (torque, torque_share, as_friction) = if off < 0.9 * load.value.abs() {
        (load.value * gain, off / load.value.abs(), 0.0)
    } else {
        (0.0, 0.0, load.high.abs().max(load.low.abs()) / sliding.value)
    };
    let at_disc = report.uneven.max(RIPPLE * ripple.value);
    let friction = (1.0 + at_rest.share().max(sliding.share()) + as_friction) * (1.0 + at_disc) - 1.0;
    let inertia = around(inertia.low * gain, inertia.high * gain);
    let viscous = around(viscous.low * gain, viscous.high * gain);
    let percent = |share: f64| Value::Float((100.0 * share).min(MOST_PERCENT));
    let mu = |volts: f64| Value::Float(volts * gain / preload);
    let mut stribeck = Table::from_iter([
        ("mu_static".to_owned(), mu(at_rest.value)),
        ("mu_dynamic".to_owned(), mu(sliding.value)),
    ]);
    if let Some(velocity) = report.stribeck.known() {
        stribeck.insert("stribeck_velocity_rad_s".to_owned(), Value::Float(velocity.value));
    }
    let of =
        |key: &str, table: Table| Value::Table(Table::from_iter([(key.to_owned(), Value::Table(table))]));
    let motor = Table::from_iter([
        ("gain_nm_v".to_owned(), Value::Float(gain)),
        ("preload_nm".to_owned(), Value::Float(preload)),
    ]);
    let model = Table::from_iter([
        ("inertia_kg_m2".to_owned(), Value::Float(inertia.0)),
        ("drive_torque_nm".to_owned(), Value::Float(torque)),
        ("viscous_damping_nm_s_rad".to_owned(), Value::Float(viscous.0)),
        ("friction".to_owned(), of("stribeck", stribeck)),
        ("actuator".to_owned(), of("motor", motor)),
    ]);
    let bounds = Table::from_iter([
        ("inertia_percent".to_owned(), percent(inertia.1)),
        ("viscous_damping_percent".to_owned(), percent(viscous.1)),
        ("friction_percent".to_owned(), percent(friction)),
        ("ripple_percent".to_owned(), percent(at_disc)),
        ("drive_torque_percent".to_owned(), percent(torque_share)),
        ("motor_gain_percent".to_owned(), Value::Float(0.0)),
    ]);
    let file = Table::from_iter([
        ("model".to_owned(), Value::Table(model)),
        ("bounds".to_owned(), Value::Table(bounds)),
        ("identified".to_owned(), Value::Table(identified(&MOTOR_ROWS, report, report.waves))),
    ]);
    Ok(format!(
        "# Findings of `clutch identify` for: {}\n\
         # For `clutch certify`, `clutch loop` and `clutch sim`: --identified THIS_FILE.toml puts [model] and [bounds] into a\n\
         # scenario. Torque per volt and normal force are the scenario's own: only ratios to them can be determined, and matter.\n\n{file}",
        scenario.name().replace(['\n', '\r'], " ")
    ))
}
