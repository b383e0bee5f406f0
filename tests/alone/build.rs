//! Memory maps of the QEMU machines, for the linker.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=start/image.x");
    let (Ok(target), Ok(here)) = (std::env::var("TARGET"), std::env::var("CARGO_MANIFEST_DIR"))
    else {
        return;
    };
    let (code, memory) = match target.as_str() {
        "thumbv6m-none-eabi" | "thumbv7em-none-eabihf" => ("0", "0x20000000"),
        "thumbv8m.main-none-eabihf" => ("0x10000000", "0x38000000"),
        "riscv32imac-unknown-none-elf" => ("0x80000000", "0x80400000"),
        _ => return,
    };
    println!("cargo:rustc-link-arg-bins=-T{here}/start/image.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=--defsym=__code={code}");
    println!("cargo:rustc-link-arg-bins=--defsym=__memory={memory}");
}
