//! Linker flags of the QEMU programs.

#[path = "../../firmware/linker.rs"]
mod linker;

fn main() {
    if linker::image_flags("../../memory.x") {
        // Every machine has memory there.
        println!("cargo:rustc-link-arg-bins=--defsym=__flash_start=0");
        // The soak's own lines and buffers do not fit beside the application into 128 KiB, nor its
        // code into 768 KiB of flash. It runs on a machine that has 4 MiB of each, and its stack
        // takes the first of them.
        println!("cargo:rustc-link-arg-bin=soaking=--defsym=_stack_start=0x20100000");
        println!("cargo:rustc-link-arg-bin=soaking=--defsym=__flash_size=0x100000");
    }
}
