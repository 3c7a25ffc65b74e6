//! Hands the linker the script beside this file, from whatever directory cargo is called.

fn main() {
    let dir = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    println!("cargo::rustc-link-arg-bins=-T{dir}/link.x");
    println!("cargo::rerun-if-changed=link.x");
}
