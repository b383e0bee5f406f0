//! Linker flags of the images, for the build scripts of this package and of those in `tests`. The
//! linker runs at the top of the workspace and finds `memory.x` there.

/// Prints the flags that every image needs, and whether this is a build for a target at all.
pub fn image_flags(memory: &str) -> bool {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={memory}");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return false;
    }
    // The interrupt tables are in Rust; `link.x` still asks for a file that names the handlers.
    let out = std::env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    std::fs::write(format!("{out}/device.x"), "").expect("OUT_DIR can be written");
    // for these images only: a search path would also be that of who depends on this package
    println!("cargo:rustc-link-arg-bins=-L{out}");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // Flash has no pages to map, so sections need not be page-aligned.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    true
}
