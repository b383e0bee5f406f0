//! The comparison of the `agreement` image with one bit of one constant flipped. It must exit with
//! code 1. It is also the one image that can panic, so that the search for panics has something to
//! find.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    let mut checks = vectors::CHECKS;
    // Hidden from the optimiser, which therefore has to keep the bounds check.
    let wrong: usize = core::hint::black_box(0);
    checks[wrong].expected ^= 1;
    let equal = vectors::compare(&checks, &mut qemu::target::output());
    qemu::target::exit(equal)
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
