//! Where the images of boards are.

use anyhow::bail;
use clutch_sim::nearest;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The images that are found without a path, and their targets: `cargo xtask firmware build` leaves them in the folder
/// of their target.
const NAMES: [(&str, &str); 6] = [
    ("mps2-controller", "thumbv7em-none-eabihf"),
    ("nucleo-controller", "thumbv7em-none-eabihf"),
    ("nucleo-daq", "thumbv7em-none-eabihf"),
    ("nucleo-alone", "thumbv7em-none-eabihf"),
    ("pico-controller", "thumbv6m-none-eabi"),
    ("pico-daq", "thumbv6m-none-eabi"),
];

/// The folder of a package that brings images beside a command that is no file of its own.
pub(crate) static PACKAGED: OnceLock<PathBuf> = OnceLock::new();

/// Where the images of an archive are, beside the command or, where that is in a folder `bin`, beside this folder.
const BESIDE: [&str; 2] = ["share/clutch/images", "../share/clutch/images"];

/// A file; or, for a name, the first image of that name: in $CLUTCH_IMAGES alone if it is set, else in the tree that
/// this is run in, else in the package or beside the command.
///
/// # Errors
/// There is none; all places are named.
pub(crate) fn image(named: PathBuf) -> anyhow::Result<PathBuf> {
    if named.is_file() {
        return Ok(named);
    }
    let Some((_, target)) = NAMES.iter().find(|(name, _)| Path::new(name) == named) else {
        let name = named.display().to_string();
        let meant = nearest(&name, &NAMES.map(|(name, _)| name));
        // A file that is missing is reported by what would have read it.
        anyhow::ensure!(meant.is_empty(), "--image {name}: no such file, and no image of that name{meant}");
        return Ok(named);
    };
    // Alone: an image of another build than the one that was asked for would run unseen.
    if let Some(folder) = std::env::var_os("CLUTCH_IMAGES") {
        let image = Path::new(&folder).join(&named);
        if !image.is_file() {
            bail!("--image {}: CLUTCH_IMAGES is set, and there is no {}", named.display(), image.display());
        }
        return Ok(image);
    }
    let built = Path::new("target/firmware").join(target).join("release");
    let command = std::env::current_exe().ok();
    let beside = command.as_deref().and_then(Path::parent);
    let beside = beside.into_iter().flat_map(|folder| BESIDE.map(|place| folder.join(place)));
    let places = std::iter::once(built).chain(PACKAGED.get().cloned()).chain(beside);
    let places: Vec<PathBuf> = places.map(|place| place.join(&named)).collect();
    if let Some(image) = places.iter().find(|place| place.is_file()) {
        return Ok(image.clone());
    }
    let places: Vec<String> = places.iter().map(|place| format!("\n  {}", place.display())).collect();
    bail!(
        "--image {}: no image of this name in\n{}\nbuild it in a checkout of clutch (cargo xtask firmware build), or name a file,\n\
         or a folder of images by CLUTCH_IMAGES",
        named.display(),
        places.concat().trim_start_matches('\n')
    )
}
