//! Linker flags: the memory map of the STM32F405 is the workspace's above.

#[path = "../../firmware/linker.rs"]
mod linker;

fn main() {
    let here = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    println!("cargo:rustc-link-search={here}/../..");
    println!("cargo:rerun-if-changed={here}/../../memory.x");
    if std::env::var_os("CARGO_FEATURE_CASES").is_some() {
        linker::image_flags("../../memory.x");
        println!("cargo:rustc-link-arg-bins=-Tembedded-test.x");
        return;
    }
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
}
