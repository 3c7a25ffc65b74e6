//! The images of the boards.

use super::{Made, VERSION, command, licences, tar, tools::Tools, work};
use crate::firmware;
use crate::run::program;
use anyhow::Result;
use std::path::Path;

/// Images that are of use, by target.
const IMAGES: [(&str, &[&str]); 2] = [
    ("thumbv7em-none-eabihf", &["mps2-controller", "nucleo-controller", "nucleo-daq"]),
    ("thumbv6m-none-eabi", &["pico-controller", "pico-daq"]),
];

/// Builds them, and lays them into a folder.
pub(super) fn stripped(folder: &Path) -> Result<()> {
    firmware::build(None)?;
    std::fs::create_dir_all(folder)?;
    for (target, images) in IMAGES {
        for image in images {
            // Without lines of the source, which a board does not get.
            let strip = program("arm-none-eabi-strip").args(["--strip-debug", "-o"]).arg(folder.join(image));
            strip.arg(firmware::folder(target).join(image)).run()?;
        }
    }
    Ok(())
}

/// Packs them; the one for the emulator runs there.
pub(super) fn make(tools: &Tools) -> Result<Made> {
    let packed = work("firmware")?.join(format!("clutch-firmware-{VERSION}"));
    stripped(&packed)?;
    licences(&packed)?;
    let clutch = program(command::here(tools)?).env("CLUTCH_IMAGES", &packed);
    clutch.args(["hil", "board_smc_2", "--quiet"]).run()?;
    let file = tar(&packed, &format!("clutch-firmware-{VERSION}.tar.gz"))?;
    let checked = "mps2-controller follows the path of board_smc_2 in qemu-system-arm (clutch hil)";
    Ok(Made { file, checked: vec![checked.to_owned()] })
}
