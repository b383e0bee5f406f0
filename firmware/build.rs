//! Linker flags of the board binaries.

mod linker;

fn main() {
    if !linker::image_flags("../memory.x") {
        return;
    }
    for bin in ["stm32f405", "stm32f405_window"] {
        println!("cargo:rustc-link-arg-bin={bin}=-Tdefmt.x");
    }
    println!("cargo:rustc-link-arg-bin=mps2=--defsym=__flash_start=0");
}
