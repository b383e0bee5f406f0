//! Linker flags of the bench image for boards.

#[path = "../../firmware/linker.rs"]
mod linker;

fn main() {
    if linker::image_flags("../../memory.x") {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
}
