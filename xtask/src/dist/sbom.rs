//! Bills of materials, in CycloneDX's format: each crate with version, licence and hash.

use super::tools::Tools;
use super::{Made, VERSION, folder};
use crate::run::{cargo, program, root};
use anyhow::{Context, Result};

const TOOL: (&str, &str) = ("cargo-cyclonedx", "0.5.9");

/// Described folders, and names of their bills.
const DESCRIBED: [(&str, &str); 7] = [
    ("crates/clutch-cli", "clutch"),
    ("crates/clutch-c", "libclutch"),
    ("crates/clutch-fmi", "clutch-fmi"),
    ("crates/clutch-web", "clutch-playground"),
    ("firmware/nucleo-g474re", "clutch-firmware-nucleo"),
    ("firmware/pico-rp2040", "clutch-firmware-pico"),
    ("firmware/qemu-mps2", "clutch-firmware-mps2"),
];

/// Prints the number of components of a bill that the format's schema allows.
const VALID: &str = "\
import json, pathlib, sys
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
text = pathlib.Path(sys.argv[1]).read_text()
wrong = JsonStrictValidator(SchemaVersion.V1_5).validate_str(text)
sys.exit(str(wrong)) if wrong else print(len(json.loads(text)['components']))
";

pub(super) fn make(tools: &Tools) -> Result<Vec<Made>> {
    let (found, version) = cargo(["cyclonedx", "--version"]).quietly()?;
    if !found || !version.contains(TOOL.1) {
        cargo(["install", TOOL.0, "--locked", "--version", TOOL.1]).run()?;
    }
    // It lays a bill beside each manifest of a workspace: under a name that nothing else has.
    let temporary = format!("bill-{}", std::process::id());
    // The command's bill is of the command with all its options, as a release has it.
    let workspaces = [
        ("Cargo.toml", &["--features", "clutch-cli/foxglove,clutch-cli/parquet,clutch-cli/scope"][..]),
        ("firmware/Cargo.toml", &[]),
    ];
    let described = workspaces.iter().try_for_each(|(workspace, features)| {
        let describe =
            ["cyclonedx", "--quiet", "--format", "json", "--spec-version", "1.5", "--target", "all"];
        let named = ["--override-filename", &temporary, "--manifest-path", workspace];
        cargo(describe).args(named).args(*features).run()
    });
    let made = described.and_then(|()| {
        DESCRIBED
            .iter()
            .map(|(package, name)| kept(tools, &format!("{package}/{temporary}.json"), name))
            .collect()
    });
    let laid = program("git")
        .args(["ls-files", "--others", "--exclude-standard", &format!("*/{temporary}.json")])
        .output()?;
    for file in String::from_utf8_lossy(&laid).lines() {
        std::fs::remove_file(root().join(file)).with_context(|| file.to_owned())?;
    }
    made
}

/// Keeps a bill, without the name of the folder in which this tree is.
fn kept(tools: &Tools, bill: &str, name: &str) -> Result<Made> {
    let text = std::fs::read_to_string(root().join(bill)).with_context(|| bill.to_owned())?;
    let file = folder().join(format!("{name}-{VERSION}.cdx.json"));
    std::fs::write(&file, text.replace(&root().display().to_string(), ""))?;
    let components = tools.script(VALID).arg(&file).output()?;
    let components = String::from_utf8_lossy(&components).trim().to_owned();
    Ok(Made { file, checked: vec![format!("{components} components, valid CycloneDX 1.5")] })
}
