//! Counts instructions as `instructions` does, for work of growing size: samples per second,
//! networks, parameters of a fix.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    qemu::target::counting::print(vectors::growth::all)
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
