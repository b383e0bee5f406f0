//! Linker flags of the board binaries. What a board needs besides those of all images is in
//! `link.args` in its folder: a line for each flag, with the name of the binary before it.

mod linker;

use std::fs;

fn main() {
    println!("cargo:rerun-if-changed=src/board");
    if !linker::image_flags("../memory.x") {
        return;
    }
    for board in fs::read_dir("src/board").expect("the boards").flatten() {
        // without the file it needs no other flags
        let flags = fs::read_to_string(board.path().join("link.args")).unwrap_or_default();
        for line in flags.lines() {
            let (binary, flag) = line.split_once(' ').expect("a binary and a flag");
            println!("cargo:rustc-link-arg-bin={binary}={flag}");
        }
    }
}
