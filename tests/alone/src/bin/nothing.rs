//! Only start-up and exit: what the other programs contain besides the network.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod program {
    use alone::machine::exit;

    #[allow(unsafe_code, reason = "nothing else has this name")]
    #[unsafe(no_mangle)]
    extern "C" fn main() -> ! {
        exit(true)
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("this is a program for QEMU; `cargo xtask alone` runs it");
}
