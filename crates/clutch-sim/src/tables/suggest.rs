//! The probable meaning of a key or a word that is none.

use clutch_core::params::Unit;
use toml::Value;

/// The probable meaning: the same key in another unit, with the value in it, or the nearest name.
pub(super) fn correction(unknown: &str, value: Option<&Value>, known: &[String]) -> String {
    let number = value.and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)));
    // Large and small letters do not make another word.
    let lower = unknown.to_lowercase();
    if known.contains(&lower) {
        return format!(": did you mean {lower}?");
    }
    if let Some((stem, unit)) = unit_of(&lower) {
        let same = known.iter().find_map(|k| {
            let (other, own) = unit_of(k)?;
            (other == stem && own.quantity == unit.quantity).then_some((k, own))
        });
        if let Some((key, own)) = same {
            return match number.filter(|x| x.is_finite()) {
                Some(x) => format!(
                    ": the unit is wrong here; {unknown} = {x} would be {key} = {:.6}",
                    x * unit.size / own.size
                ),
                None => format!(": did you mean {key}?"),
            };
        }
    }
    if let Some(key) =
        known.iter().find(|k| k.strip_prefix(&*lower).is_some_and(|rest| rest.starts_with('_')))
    {
        return format!(": did you mean {key}? (keys end with their unit)");
    }
    nearest(unknown, known)
}

/// The expectation, behind the probable meaning: `: did you mean kp_v? Expected one of: kp_v, kd_v_s_rad`.
#[must_use]
pub fn expected(meaning: &str, known: &[impl AsRef<str>]) -> String {
    let begin = if meaning.ends_with('?') { " Expected" } else { "; expected" };
    let known: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
    format!("{meaning}{begin} one of: {}", known.join(", "))
}

/// Splits a key into stem and a unit that is easily taken for another.
fn unit_of(key: &str) -> Option<(&str, &'static Unit)> {
    let unit = Unit::of_key(key).filter(|u| !u.quantity.is_empty())?;
    Some((key.strip_suffix(unit.suffix)?.strip_suffix('_')?, unit))
}

/// Asks for the most alike of the known names, as `: did you mean smc_2?`; empty if none is much alike. Large and small
/// letters are alike.
#[must_use]
pub fn nearest(unknown: &str, known: &[impl AsRef<str>]) -> String {
    let unknown = unknown.to_lowercase();
    let near = known
        .iter()
        .map(|k| (strsim::jaro_winkler(&unknown, &k.as_ref().to_lowercase()), k.as_ref()))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    near.map_or(String::new(), |(_, k)| format!(": did you mean {k}?"))
}
