//! Prints the model description of a unit: `cargo run -p clutch-fmi --example describe -- rig`.

use clutch_fmi::{Part, description};

fn main() -> Result<(), String> {
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let part = Part::ALL.into_iter().find(|part| part.name() == wanted);
    print!("{}", description(part.ok_or_else(|| format!("{wanted}: expected rig or law"))?));
    Ok(())
}
