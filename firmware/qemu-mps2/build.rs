//! Hands the linker this board's memory map, and compiles laws and servo in C on request.

fn main() {
    let dir = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    println!("cargo::rustc-link-search={dir}");
    println!("cargo::rerun-if-changed=memory.x");
    #[cfg(feature = "peer")]
    peer(&dir);
}

/// Built as firmware in C is, at any level of optimisation in Rust.
#[cfg(feature = "peer")]
fn peer(dir: &str) {
    let folder = format!("{dir}/../../benches/peer_c");
    println!("cargo::rerun-if-changed={folder}");
    cc::Build::new()
        .no_default_flags(true)
        .compiler("arm-none-eabi-gcc")
        .flags(["-O2", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"])
        .flags(["-ffunction-sections", "-Wall", "-Wextra", "-Werror"])
        .file(format!("{folder}/laws.c"))
        .file(format!("{folder}/servo.c"))
        .compile("peer");
}
