//! Linker flags of the board binaries. The linker finds `memory.x` at the top of the workspace, its working directory.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    // Each board has its interrupt table in Rust; `link.x` still asks for the file that would name its handlers.
    let out = std::env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    std::fs::write(format!("{out}/device.x"), "").expect("OUT_DIR can be written");
    println!("cargo:rustc-link-search={out}");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=--nmagic"); // sections are not page-aligned: flash has no pages to map
    for bin in ["stm32f405", "stm32f405_window"] {
        println!("cargo:rustc-link-arg-bin={bin}=-Tdefmt.x");
    }
    println!("cargo:rustc-link-arg-bin=mps2=--defsym=__flash_start=0");
}
