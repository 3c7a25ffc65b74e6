//! The page around a module: `page MODULE.wasm PAGE.html`. One file, which asks for nothing else.

use clutch_web::declared::{figures, parameter};
use serde_json::{Map, Value, json};

/// Laws on common axes: name among the keys, name for people, scenario.
const LAWS: [(&str, &str, &str); 4] = [
    ("pd", "PD", "bench_pd_2"),
    ("pid", "PID", "bench_pid_2"),
    ("smc", "SMC", "bench_smc_2"),
    ("glide", "Glide", "bench_glide_2"),
];

/// Groups of sliders: title, law that alone has these keys, keys.
const GROUPS: [(&str, Option<&str>, &[&str]); 6] = [
    (
        "Path and rig",
        None,
        &[
            "reference.ramp.rate_deg_s",
            "rig.friction.stribeck.mu_static",
            "rig.friction.stribeck.mu_dynamic",
            "rig.ripple.rms",
            "rig.drive.weight.mass_kg",
            "rig.delay_ticks",
        ],
    ),
    ("PD", Some("pd"), &["law.pd.kp_v_rad", "law.pd.kd_v_s_rad"]),
    ("PID", Some("pid"), &["law.pid.kp_v_rad", "law.pid.ki_v_rad_s", "law.pid.kd_v_s_rad"]),
    (
        "Sliding mode",
        Some("smc"),
        &["law.smc.kp_v", "law.smc.kd_v_s_rad", "law.smc.slope_1_s", "law.smc.boundary_rad_s"],
    ),
    ("Glide", Some("glide"), &["law.glide.kp_1_s", "law.glide.kd_1_s", "law.glide.filter.delay_ticks"]),
    (
        "Friction that the laws believe in",
        None,
        &["model.friction.stribeck.mu_static", "model.friction.stribeck.mu_dynamic"],
    ),
];

/// Letters that stand for bytes whose own letters a page may not have: it knows no U+0000, takes U+000D for the end of a line,
/// and might see the end of the script after U+003C. U+0000 is the most frequent byte: it gets the short letter of another.
const PLACES: [(u8, char); 4] = [(0x00, '\u{7f}'), (0x7f, '\u{100}'), (0x0d, '\u{101}'), (0x3c, '\u{102}')];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(module), Some(page)) = (args.next(), args.next()) else {
        return Err("expected: page MODULE.wasm PAGE.html".into());
    };
    let letter =
        |b: &u8| PLACES.iter().find(|(byte, _)| byte == b).map_or(char::from(*b), |(_, letter)| *letter);
    let module: String = std::fs::read(module)?.iter().map(letter).collect();
    let places: Map<String, Value> =
        PLACES.iter().map(|(byte, letter)| (u32::from(*letter).to_string(), json!(byte))).collect();
    let script =
        bare(include_str!("../page/page.js")).replace("{{places}}", &Value::from(places).to_string());
    // The module last: nothing is looked for in it.
    let text = include_str!("../page/page.html")
        .replace("{{style}}", include_str!("../page/page.css"))
        .replace("{{worker}}", &bare(include_str!("../page/worker.js")))
        .replace("{{script}}", &script)
        .replace("{{declared}}", &declared()?.to_string().replace('<', "\\u003c"))
        .replace("{{module}}", &module);
    std::fs::write(page, text)?;
    Ok(())
}

/// A script, whose strings end on their lines, without its indents and lines of comment: who loads the page does not read them.
fn bare(script: &str) -> String {
    let lines = script.lines().map(str::trim_start);
    lines.filter(|line| !line.starts_with("//")).flat_map(|line| [line, "\n"]).collect()
}

fn declared() -> Result<Value, String> {
    let mut parameters = Map::new();
    for (_, law, keys) in GROUPS {
        // A key of all laws is looked up in the first: a slider begins where all have it.
        let (_, _, scenario) =
            LAWS.iter().find(|(name, ..)| law.is_none_or(|law| law == *name)).ok_or("no such law")?;
        for key in keys {
            parameters.insert((*key).to_owned(), parameter(scenario, key)?);
        }
    }
    let laws =
        LAWS.map(|(name, title, scenario)| json!({ "name": name, "title": title, "scenario": scenario }));
    let groups = GROUPS.map(|(title, law, keys)| json!({ "title": title, "law": law, "keys": keys }));
    Ok(json!({ "laws": laws, "groups": groups, "parameters": parameters, "figures": figures() }))
}
