//! Linker flags of the board image. The linker finds `memory.x` at the top of the workspace, its working directory.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    // The interrupt table is in Rust; `link.x` still asks for the file that would name its handlers.
    let out = std::env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    std::fs::write(format!("{out}/device.x"), "").expect("OUT_DIR can be written");
    println!("cargo:rustc-link-search={out}");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic"); // sections are not page-aligned: flash has no pages to map
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
}
