//! Reads an address at which there may be nothing.

use core::arch::asm;

use cortex_m::peripheral::SCB;

/// CCR.BFHFNMIGN: code at priority -1 ignores bus faults of its loads (ARM DDI 0403, B3.2.8: "to
/// probe system devices and bridges").
const IGNORE: u32 = 1 << 8;
/// CFSR: flags of bus faults.
const BUS_FAULTS: u32 = 0xFF00;

/// The word at `address`, a multiple of 4; `None` when the bus answers with a fault. No fault
/// handler runs.
pub fn word(scb: &SCB, address: u32) -> Option<u32> {
    let value: u32;
    // SAFETY: a load has no effect on memory, and the addresses read are registers without side
    // effects. FAULTMASK makes the priority -1, where with BFHFNMIGN a bus fault only sets a flag
    // in CFSR and gives an invalid value. Both registers are restored afterwards.
    unsafe {
        scb.cfsr.write(BUS_FAULTS); // written ones clear
        scb.ccr.modify(|ccr| ccr | IGNORE);
        asm!(
            "dsb",
            "isb",
            "cpsid f",
            "ldr {value}, [{address}]",
            "dsb",
            "isb",
            "cpsie f",
            address = in(reg) address,
            value = out(reg) value,
            options(nostack, preserves_flags),
        );
        scb.ccr.modify(|ccr| ccr & !IGNORE);
    }
    let fault = scb.cfsr.read() & BUS_FAULTS != 0;
    // SAFETY: clears flags that have been read.
    unsafe { scb.cfsr.write(BUS_FAULTS) };
    (!fault).then_some(value)
}
