//! Compares the digests of the shared vectors with the desktop's; exit code 0 when all are equal.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod program {
    use alone::machine::{Out, exit};

    #[allow(unsafe_code, reason = "nothing else has this name")]
    #[unsafe(no_mangle)]
    extern "C" fn main() -> ! {
        exit(vectors::compare(&vectors::CHECKS, &mut Out))
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("this is a program for QEMU; `cargo xtask alone` runs it");
}
