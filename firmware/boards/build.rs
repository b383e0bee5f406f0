//! Linker flags of a board: its `memory.x` beside its manifest. The build script of every board.
//!
//! A board that takes updates has two more settings. `LRNN_SLOT`: the address of the slot for which
//! the image is linked. `LRNN_UPDATE_KEY`: a file with the public key, 64 hexadecimal digits, that
//! updates must be signed for (docs/RELEASES.md).

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
    println!("cargo:rerun-if-env-changed=LRNN_SLOT");
    if let Ok(slot) = env::var("LRNN_SLOT") {
        println!("cargo:rustc-link-arg-bins=--defsym=__slot={slot}");
    }
    println!("cargo:rerun-if-env-changed=LRNN_UPDATE_KEY");
    let signer = match env::var("LRNN_UPDATE_KEY") {
        Ok(file) => {
            println!("cargo:rerun-if-changed={file}");
            format!("Some({:?})", key(&file))
        }
        Err(_) => "None".into(),
    };
    fs::write(format!("{out}/signer.rs"), signer).expect("OUT_DIR can be written");
}

/// The public key of a file.
fn key(file: &str) -> Vec<u8> {
    let text = fs::read_to_string(file);
    let text = text.unwrap_or_else(|error| panic!("LRNN_UPDATE_KEY: {file}: {error}"));
    let digits = text.trim();
    let bytes: Option<Vec<u8>> = (0..digits.len().div_ceil(2))
        .map(|at| u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok())
        .collect();
    match bytes {
        Some(bytes) if bytes.len() == 32 => bytes,
        _ => panic!(
            "LRNN_UPDATE_KEY: {file} has no public key (64 hexadecimal digits); give the file \
             *.pub that `cargo xtask sign --new-key` has written"
        ),
    }
}
