//! Shows that desktop and target agree: steps the network, its gradient and its learners over the
//! vectors embedded in the image, compares every digest with that of the desktop, and exits with
//! code 0 when all are equal.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    let equal = vectors::compare(&vectors::CHECKS, &mut qemu::target::output());
    qemu::target::exit(equal)
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
