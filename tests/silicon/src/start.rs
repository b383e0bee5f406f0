//! Start and end of the bench: chip, clock, caches and counter, each reported in the log.

use cortex_m::Peripherals;
use cortex_m::peripheral::cpuid::CsselrCacheType;
use cortex_m::peripheral::{CPUID, DCB, DWT, SCB, SYST};
use cortex_m_semihosting::debug;
use silicon::chip::{self, Chip, Clock, Core};

use crate::{clock, cycles, read};

/// Bytes of a cache line of a Cortex-M7 (ARM DDI 0489).
const LINE: u32 = 32;

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(mut peripherals) = Peripherals::take() else {
        end(false)
    };
    let cpuid = peripherals.CPUID.base.read();
    let core = Core::of(cpuid);
    let found = chip::identify(core, |address| read::word(&peripherals.SCB, address));
    defmt::println!(
        "lrnn bench {=str} on {=str} (id {=u16:#x}), {=str} (CPUID {=u32:#x})",
        env!("CARGO_PKG_VERSION"),
        found.chip.name,
        found.id,
        core.name(),
        cpuid
    );
    set_clock(found.chip.clock, &mut peripherals.SYST);
    tell_flash(&peripherals.SCB, found.chip);
    caches(core, &mut peripherals.SCB, &mut peripherals.CPUID);
    tell_memory(core, found.chip);
    peripherals.DCB.enable_trace();
    if core == Core::M7 {
        DWT::unlock(); // locked after power-on
    }
    peripherals.DWT.enable_cycle_counter();
    let good = cycles::measure(core);
    defmt::println!("{=str}", if good { "done" } else { "a work went wrong" });
    end(good)
}

fn set_clock(wanted: Clock, syst: &mut SYST) {
    match (wanted, stm32f4::stm32f405::Peripherals::take()) {
        (Clock::Board, Some(peripherals)) => {
            let clocks = clock::start(&peripherals, syst);
            defmt::println!(
                "clock: {=u32} Hz, crystal {=u8} MHz, measured {=u32} kHz; APB1 {=u32}, APB2 {=u32} Hz",
                clocks.core,
                clocks.crystal.used_mhz,
                clocks.crystal.measured_khz,
                clocks.apb1,
                clocks.apb2
            );
        }
        (Clock::Reset(megahertz), _) => defmt::println!(
            "clock: internal oscillator of {=u8} MHz, as after reset",
            megahertz
        ),
        _ => defmt::println!("clock: not known, left as it is"),
    }
}

fn tell_flash(scb: &SCB, chip: Chip) {
    match chip.flash_acr.and_then(|address| read::word(scb, address)) {
        Some(acr) => defmt::println!(
            "flash: {=u32} wait states (FLASH_ACR {=u32:#x})",
            acr & 0xF,
            acr
        ),
        None => defmt::println!("flash: wait states not known"),
    }
}

/// Turns on the caches of the core.
fn caches(core: Core, scb: &mut SCB, cpuid: &mut CPUID) {
    if core != Core::M7 {
        return defmt::println!("caches: none in the core");
    }
    scb.enable_icache();
    scb.enable_dcache(cpuid);
    let mut bytes = |which| {
        let (sets, ways) = cpuid.cache_num_sets_ways(0, which);
        u32::from(sets) * u32::from(ways) * LINE
    };
    defmt::println!(
        "caches: on, {=u32} bytes for instructions, {=u32} for data",
        bytes(CsselrCacheType::Instruction),
        bytes(CsselrCacheType::DataOrUnified)
    );
}

fn tell_memory(core: Core, chip: Chip) {
    match (core, chip.dtcm) {
        (Core::M7, 128..) => defmt::println!("memory: all in DTCM, not cached"),
        (Core::M7, kib @ 1..) => defmt::println!(
            "memory: log in DTCM ({=u8} KiB), stack in the SRAM behind it, cached",
            kib
        ),
        (Core::M4, _) => defmt::println!("memory: SRAM"),
        _ => defmt::println!("memory: not known"),
    }
}

/// Notifies a probe, if there is one, and stays in a loop. It does not use WFI, so that a probe
/// that connects later can read the log.
pub fn end(good: bool) -> ! {
    if DCB::is_debugger_attached() {
        debug::exit(if good {
            debug::EXIT_SUCCESS
        } else {
            debug::EXIT_FAILURE
        });
    }
    loop {
        core::hint::spin_loop();
    }
}
