//! Counts instructions with SysTick under `-icount shift=0`. It prints ticks, which `qemu::count`
//! converts to instructions.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    qemu::target::counting::print(vectors::list::all)
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
