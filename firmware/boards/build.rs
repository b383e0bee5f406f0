//! Linker flags of a board: its `memory.x` beside its manifest. The build script of every board.

use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=../build.rs");
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    fs::copy("memory.x", format!("{out}/memory.x")).expect("the board has a memory.x");
    println!("cargo:rustc-link-search={out}");
    for flag in ["-Tlink.x", "-Tdefmt.x", "--nmagic"] {
        println!("cargo:rustc-link-arg-bins={flag}");
    }
}
