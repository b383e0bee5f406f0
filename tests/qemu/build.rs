//! Linker flags of the QEMU programs.

#[path = "../../firmware/linker.rs"]
mod linker;

fn main() {
    if linker::image_flags("../../memory.x") {
        // Every machine has memory there.
        println!("cargo:rustc-link-arg-bins=--defsym=__flash_start=0");
    }
}
