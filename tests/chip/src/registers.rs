//! Registers that neither driver supports, by address (stm32f4 0.16, stm32-metapac 21).

#![allow(unsafe_code)]

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};

use crate::{Report, report};

const RCC_APB1ENR: usize = 0x4002_3840;
const RCC_CSR: usize = 0x4002_3874;
const PWR_CR: usize = 0x4000_7000;
const PWR_CSR: usize = 0x4000_7004;
const EXTI_IMR: usize = 0x4001_3C00;
const EXTI_RTSR: usize = 0x4001_3C08;
const EXTI_PR: usize = 0x4001_3C14;
const FLASH_SR: usize = 0x4002_3C0C;

/// Reads a register or a word of memory.
#[must_use]
pub fn read(address: usize) -> u32 {
    // SAFETY: callers name registers and memory of this chip.
    unsafe { core::ptr::read_volatile(address as *const u32) }
}

/// Writes a register, or a word of flash.
pub fn write(address: usize, word: u32) {
    // SAFETY: as above; no Rust object is there.
    unsafe { core::ptr::write_volatile(address as *mut u32, word) }
}

fn set(address: usize, bits: u32) {
    write(address, read(address) | bits);
}

/// An interrupt number.
#[derive(Clone, Copy)]
struct Number(u16);

// SAFETY: the numbers are those of this chip.
unsafe impl cortex_m::interrupt::InterruptNumber for Number {
    fn number(self) -> u16 {
        self.0
    }
}

/// Interrupts served: SysTick and the supply voltage detector.
pub static SERVED: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// Flags of RCC_CSR: why the chip has started. Clears them for the next start.
#[must_use]
pub fn cause() -> u32 {
    let flags = read(RCC_CSR) & 0xFE00_0000;
    set(RCC_CSR, 1 << 24);
    flags
}

/// Reports why the chip has started. Returns whether a watchdog was the cause.
#[must_use]
pub fn restarted() -> bool {
    let flags = cause();
    report(Report::Cause, flags);
    flags & (3 << 29) != 0
}

/// Resets the chip by software.
pub fn reset() -> ! {
    SCB::sys_reset()
}

/// Sleeps for some periods, each of `cycles` cycles of the core.
pub fn sleep(timer: &mut SYST, cycles: u32, periods: u32) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(cycles - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
    let until = SERVED[0].load(Ordering::Relaxed) + periods;
    while SERVED[0].load(Ordering::Relaxed) < until {
        cortex_m::asm::wfi();
    }
    timer.disable_counter();
    timer.disable_interrupt();
}

/// Waits a period by polling the timer's flag, as drivers' delays do.
pub fn wait(timer: &mut SYST, cycles: u32) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(cycles - 1);
    timer.clear_current();
    timer.enable_counter();
    while !timer.has_wrapped() {}
    timer.disable_counter();
}

#[cortex_m_rt::exception]
fn SysTick() {
    SERVED[0].fetch_add(1, Ordering::Relaxed);
}

/// Uses the supply voltage detector, which neither driver supports. Its interrupt is that of EXTI
/// line 16 (RM0090 12.2.5).
pub fn supply(timer: &mut SYST) {
    set(RCC_APB1ENR, 1 << 28);
    set(PWR_CR, 7 << 5 | 1 << 4); // 2.9 V
    set(EXTI_RTSR, 1 << 16);
    set(EXTI_IMR, 1 << 16);
    // SAFETY: the handler touches nothing but its counter and its flag.
    unsafe { NVIC::unmask(Number(1)) };
    for _ in 0..3 {
        report(Report::Word, read(PWR_CSR) >> 2 & 1);
        report(Report::Interrupts, SERVED[1].load(Ordering::Relaxed));
        sleep(timer, 160_000, 1);
    }
}

/// Interrupt handler of the supply voltage detector.
pub fn supply_fell() {
    write(EXTI_PR, 1 << 16);
    SERVED[1].fetch_add(1, Ordering::Relaxed);
}

/// A write to flash without programming enabled: it is refused, and an error flag stays set.
pub fn wrong_write(address: u32) {
    write(address as usize, 0x1234_5678);
    while read(FLASH_SR) >> 16 & 1 != 0 {}
    report(Report::Word, read(address as usize));
}

/// Clears the error flags of the controller.
pub fn forgive() {
    write(FLASH_SR, 0xF0);
}
