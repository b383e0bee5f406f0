//! Start, semihosting and the counter of instructions, on Cortex-M and RISC-V.
#![allow(
    unsafe_code,
    reason = "start-up and semihosting; each block says why it is sound"
)]

use core::arch::{asm, global_asm};
use core::fmt::{self, Write};

#[cfg(target_arch = "arm")]
global_asm!(include_str!("../start/arm.s"));
#[cfg(target_arch = "riscv32")]
global_asm!(include_str!("../start/riscv.s"));

/// Writes the bytes of a text to QEMU's standard output.
pub struct Out;

impl Write for Out {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for &byte in text.as_bytes() {
            call(0x03, (&raw const byte) as usize);
        }
        Ok(())
    }
}

/// Leaves QEMU with exit code 0 or 1.
pub fn exit(success: bool) -> ! {
    const APPLICATION: usize = 0x20026;
    const ERROR: usize = 0x20023;
    loop {
        call(0x18, if success { APPLICATION } else { ERROR });
    }
}

/// A semihosting call: `number`, and its argument or the argument's address.
#[inline(never)]
fn call(number: usize, argument: usize) {
    #[cfg(target_arch = "arm")]
    // SAFETY: the debugger reads the byte at the address and nothing else.
    unsafe {
        asm!("bkpt 0xab", inout("r0") number => _, in("r1") argument, options(nostack));
    }
    #[cfg(target_arch = "riscv32")]
    // SAFETY: the debugger reads the byte at the address and nothing else.
    unsafe {
        asm!(
            ".option push", ".option norvc", ".balign 16",
            "slli x0, x0, 0x1f", "ebreak", "srai x0, x0, 7",
            ".option pop",
            inout("a0") number => _, in("a1") argument, options(nostack)
        );
    }
}

/// Starts the counter behind [`ticks`].
pub fn start_counter() {
    #[cfg(target_arch = "arm")]
    // SAFETY: SysTick's registers, which every one of these machines has and nothing else uses.
    unsafe {
        let systick = 0xe000_e010 as *mut u32;
        systick.add(1).write_volatile(MASK);
        systick.add(2).write_volatile(0);
        systick.write_volatile(0b101);
    }
}

/// Ticks of the counter, modulo `MASK` + 1. Under `-icount shift=0` they measure instructions:
/// SysTick counts at its clock, RISC-V counts each instruction.
#[inline(always)]
pub fn ticks() -> u32 {
    #[cfg(target_arch = "arm")]
    // SAFETY: a register of SysTick.
    unsafe {
        MASK - (0xe000_e018 as *const u32).read_volatile()
    }
    #[cfg(target_arch = "riscv32")]
    {
        let count: u32;
        // SAFETY: reads a counter.
        unsafe {
            asm!("rdcycle {}", out(reg) count, options(nomem, nostack));
        }
        count
    }
}

/// Largest value of the counter.
#[cfg(target_arch = "arm")]
pub const MASK: u32 = 0x00ff_ffff;
/// Largest value of the counter.
#[cfg(target_arch = "riscv32")]
pub const MASK: u32 = u32::MAX;

/// A loop of 2 instructions `turns` times.
#[inline(always)]
pub fn turn(turns: u32) {
    #[cfg(target_arch = "arm")]
    // SAFETY: changes one register.
    unsafe {
        asm!(
            ".syntax unified", "2: subs {0}, {0}, #1", "bne 2b",
            inout(reg) turns => _, options(nomem, nostack)
        );
    }
    #[cfg(target_arch = "riscv32")]
    // SAFETY: changes one register.
    unsafe {
        asm!(
            "2: addi {0}, {0}, -1", "bnez {0}, 2b",
            inout(reg) turns => _, options(nomem, nostack)
        );
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    let _ = writeln!(Out, "{info}");
    exit(false)
}
