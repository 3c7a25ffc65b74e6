//! A certificate of another loop: what differs, in words and keys of a scenario.

use crate::number;
use clutch_certificate::Setup;
use serde_json::Value;

/// Field of a setup, the quantity with the unit in which it is told and the keys that it comes of, and its factor from SI.
type Row = (&'static str, &'static str, f64);

const ROWS: [Row; 21] = [
    ("period_s", "period in µs, of sampling.period_us", 1e6),
    ("counts_per_rev", "counts per revolution, of rig.encoder.counts_per_rev", 1.0),
    ("inertia", "J in kg m², of [model] and [bounds]", 1.0),
    ("drive_torque", "T_u in N m, of [model] and [bounds]", 1.0),
    ("viscous_damping", "C_d in N m s/rad, of [model] and [bounds]", 1.0),
    ("brake_gain", "K_COF in N m/V, of [model] and [bounds]", 1.0),
    ("motor", "k_t in N m/V and N_0 in N m, of [model] and [bounds]", 1.0),
    ("sliding", "mu_d, of [model] and [bounds]", 1.0),
    ("at_rest", "mu_s, of [model] and [bounds]", 1.0),
    ("rest_not_below_sliding", "mu_s never below mu_d, of [model]", 1.0),
    ("stribeck", "v_s in rad/s and δ, of [model]", 1.0),
    ("ripple", "share of friction along the disc, of [rig.ripple] and [bounds]", 1.0),
    ("torque_noise", "torque noise in N m, of rig.torque_noise_nm and [bounds]", 1.0),
    ("delay_ticks", "periods of delay, of rig.delay_ticks", 1.0),
    ("converter_step", "step of the converter in V, of [rig.dac]", 1.0),
    ("volts", "volts that go out, of [output] and [rig.dac]", 1.0),
    ("rate", "rate in °/s, of reference.ramp.rate_deg_s", 180.0 / core::f64::consts::PI),
    ("smoothing", "smoothing, of [velocity]", 1.0),
    ("law", "law: gains in V and rad, of [law] or [shell]", 1.0),
    ("from_rest", "start from rest, of run.start", 1.0),
    ("start_volts", "volts before the first tick, of [model] and [bounds]", 1.0),
];

/// Lines on all that differs, the scenario's value first.
pub(super) fn differences(scenario: &Setup, file: &Setup) -> Vec<String> {
    let told = |(field, own, other): (String, Value, Value)| {
        let row = ROWS.iter().find(|row| row.0 == field);
        let (words, factor) = row.map_or((field.as_str(), 1.0), |row| (row.1, row.2));
        format!("{words}: {} and {}", value(&own, factor), value(&other, factor))
    };
    scenario.differences(file).into_iter().map(told).collect()
}

fn value(of: &Value, factor: f64) -> String {
    match of {
        Value::Null => "none".into(),
        Value::Bool(yes) => if *yes { "yes" } else { "no" }.into(),
        Value::Number(x) => x.as_f64().map_or_else(|| x.to_string(), |x| number(factor * x)),
        Value::String(text) => text.clone(),
        Value::Array(parts) => match parts.as_slice() {
            [low, high] if low == high => value(low, factor),
            parts => parts.iter().map(|part| value(part, factor)).collect::<Vec<_>>().join(" … "),
        },
        Value::Object(parts) => {
            let told = parts.iter().map(|(key, part)| format!("{key} {}", value(part, factor)));
            told.collect::<Vec<_>>().join(" ")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clutch_certificate::Gains;

    #[test]
    fn each_quantity_of_a_loop_has_its_words() {
        let setup = Setup::paper(Gains::Shell { slope: 70.0, boundary: 0.1 });
        let motor = Some(clutch_certificate::Motor { gain: [0.05; 2], preload: 0.2 });
        let fields = serde_json::to_value(Setup { motor, ..setup }).unwrap();
        for field in fields.as_object().unwrap().keys() {
            assert!(ROWS.iter().any(|row| row.0 == field), "{field}");
        }
        assert_eq!(ROWS.len(), fields.as_object().unwrap().len());
    }

    #[test]
    fn each_key_that_is_named_is_one_of_a_scenario() {
        let words = ROWS.iter().flat_map(|row| row.1.split([' ', ',']));
        let keys: Vec<&str> = words.filter(|word| word.contains('.') && !word.contains('[')).collect();
        assert!(keys.len() > 4, "{keys:?}");
        for key in keys {
            let set = [(key.to_owned(), "no_such_word".to_owned())];
            let told = crate::Scenario::load("smc_2".as_ref(), &set).unwrap_err().to_string();
            assert!(told.contains(&format!("{key} = \"no_such_word\": expected ")), "{told}");
        }
    }

    #[test]
    fn what_differs_is_told_in_units_of_a_scenario() {
        let one = Setup::paper(Gains::Layer { kp: 3.0, kd: 400.0, slope: 70.0, boundary: 0.1 });
        let mut other = Setup::paper(Gains::Shell { slope: 70.0, boundary: 0.1 });
        (other.rate, other.sliding, other.period_s) = (4.0_f64.to_radians(), [0.1, 0.15], 0.002);
        assert_eq!(
            differences(&one, &other),
            [
                "law: gains in V and rad, of [law] or [shell]: layer boundary 0.1 kd 400 kp 3 slope 70 and shell boundary \
                 0.1 slope 70",
                "period in µs, of sampling.period_us: 1000 and 2000",
                "rate in °/s, of reference.ramp.rate_deg_s: 2 and 4",
                "mu_d, of [model] and [bounds]: 0.15 and 0.1 … 0.15",
            ]
        );
        assert!(differences(&one, &one).is_empty());
    }
}
