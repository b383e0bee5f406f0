//! Linker flags: the memory map of the STM32F405 is the workspace's above.

fn main() {
    let here = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    println!("cargo:rustc-link-search={here}/../..");
    println!("cargo:rerun-if-changed={here}/../../memory.x");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
}
