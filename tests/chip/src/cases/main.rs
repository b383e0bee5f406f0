//! Cases that only a chip can answer, of the board `stm32f405` and with its drivers:
//! `cargo xtask hil-test stm32f405` runs each by `probe-rs run`, after a reset of its own.
//!
//! Each case says what it has measured by semihosting. One that cannot run here says `skipped:`
//! and why. No case lets a watchdog bite: the runner takes a reset within a case for a failure.
//!
//! **They have not run on silicon**, only in QEMU and in the chip model (`tests/qemu`).

#![no_std]
#![no_main]

mod board;
mod line;
#[path = "../../../../firmware/src/board/shared/mod.rs"]
mod shared;
mod store;

use board::clock::{self, Clocks};
use board::{counter, interrupts, supply};
use cortex_m::peripheral::DWT;
use cortex_m_semihosting::{debug, hprintln};
use firmware::wire::command::ClockSource;
use stm32f4::stm32f405::Peripherals;

/// The board, started as its image starts it, without watchdogs.
struct Bench {
    chip: Peripherals,
    clocks: Clocks,
}

impl Bench {
    fn start() -> Self {
        let mut core = cortex_m::Peripherals::take().expect("the first call");
        let chip = Peripherals::take().expect("the first call");
        supply::watch(&chip.RCC, &chip.PWR);
        let clocks = clock::start(&chip, &mut core.SYST);
        counter::start(&chip.RCC, &chip.TIM2, &clocks);
        interrupts::prioritise(&mut core.NVIC, &mut core.SCB);
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        Self { chip, clocks }
    }

    /// Whether there are clock registers. The rest of the chip's own is missing without them, too.
    fn is_chip(&self) -> bool {
        let is_chip = self.clocks.source != ClockSource::Simulator;
        if !is_chip {
            hprintln!("skipped: no clock registers, so this is an emulator of the core alone");
        }
        is_chip
    }
}

/// What `work` gives, and how long it takes, microseconds.
fn timed<R>(work: impl FnOnce() -> R) -> (R, u32) {
    let begun = counter::low();
    let done = work();
    (done, counter::low().wrapping_sub(begun))
}

/// Time of the host, s: SYS_TIME.
#[allow(unsafe_code)]
fn host_s() -> usize {
    // SAFETY: the call has no argument and gives a number.
    unsafe { cortex_m_semihosting::syscall1(0x11, 0) }
}

/// Waits until a second of the host begins. Gives it, and the count of microseconds.
fn host_second() -> (usize, u32) {
    let last = host_s();
    loop {
        let now = host_s();
        if now != last {
            return (now, counter::low());
        }
    }
}

/// The lines wake the frame path, which is not here.
#[cortex_m_rt::exception]
fn PendSV() {}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    hprintln!("{}", info);
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}

#[embedded_test::tests]
mod cases {
    use super::*;
    use core::hint::black_box;
    use firmware::compensator::{Compensator, Limit};
    use firmware::sample::{Lsb, RawSample};
    use lrnn_nostd::Rational;
    use vectors::{CHECKS, net};

    /// Seconds of the host that the clock is compared with. A call of the host takes up to 0.1 s.
    const SECONDS: usize = 5;

    #[init]
    fn init() -> Bench {
        Bench::start()
    }

    /// The crystal is the one that the firmware is built for, and runs at its frequency by the
    /// internal oscillator (within 8 %) and by the clock of the host (within 4 %).
    #[test]
    fn clock(bench: Bench) {
        if !bench.is_chip() {
            return;
        }
        let (source, crystal) = (bench.clocks.source, bench.clocks.crystal);
        hprintln!("core at {} Hz, {:?}", bench.clocks.core, source);
        hprintln!("{:?}", crystal);
        let ((first, begun), mut now) = (host_second(), host_second());
        while now.0 - first < SECONDS {
            now = host_second();
        }
        let us = now.1.wrapping_sub(begun) / (now.0 - first) as u32;
        hprintln!("a second of the host is {} us here", us);
        let runs = source == ClockSource::Crystal;
        assert!(runs, "no crystal of 4 to 26 MHz, or no lock of the PLL");
        let (built, used) = (crystal.built_mhz, crystal.used_mhz);
        assert!(built == used, "remedy: set LRNN_CRYSTAL_MHZ={used}");
        let off = us.abs_diff(1_000_000);
        assert!(off < 40_000, "the core has another clock");
    }

    /// Both sectors hold every word and become blank again, and records are found in them.
    #[test]
    fn flash(bench: Bench) {
        if bench.is_chip() {
            store::holds(bench.chip.FLASH);
        }
    }

    /// Each line receives what it sends, by DMA and at its bit rate.
    #[test]
    fn lines(bench: Bench) {
        if bench.is_chip() {
            line::all(&bench.chip, &bench.clocks);
        }
    }

    /// The arithmetic gives the bits that it gives on the desktop.
    #[test]
    fn digests(_bench: Bench) {
        let mut different = 0;
        // as data, which a test changes in the image
        for check in black_box(&CHECKS) {
            let begun = DWT::cycle_count();
            let here = (check.digest)();
            let cycles = DWT::cycle_count().wrapping_sub(begun);
            let equal = here == check.expected;
            different += u32::from(!equal);
            let verdict = if equal { "equal" } else { "DIFFERENT" };
            hprintln!("{}: {}, {} cycles", check.name, verdict, cycles);
        }
        assert!(
            different == 0,
            "{different} digests differ from the desktop's"
        );
    }

    /// The core makes its cycles, and a sample is corrected in the time of the fastest sensor.
    #[test]
    fn cycles(bench: Bench) {
        let begun = DWT::cycle_count();
        let ((), us) = timed(|| cortex_m::asm::delay(1_000_000));
        let turned = DWT::cycle_count().wrapping_sub(begun);
        if turned == 0 {
            return hprintln!("skipped: no cycle counter, so this is an emulator");
        }
        let each_us = turned / us.max(1);
        let due = bench.clocks.core / 1_000_000;
        hprintln!("{} cycles a microsecond; {} are due", each_us, due);
        assert!(each_us.abs_diff(due) <= 2, "core and timers disagree");
        let limit = Limit {
            gyro: 1e-4,
            accel: 0.1,
        };
        let lsb = Lsb {
            rad: 1e-7,
            mps: 1e-4,
        };
        let net = net::<Rational>();
        let compensator = Compensator::new(net, net, lsb, 0.04, 25, limit).expect("plausible");
        let mut state = compensator.power_on(false);
        let (mut all, mut worst) = (0, 0);
        for n in 0..1000 {
            let (gyro, accel) = ([n, -n, 7], [n, 100, 3900]);
            let mut sample = black_box(RawSample::Counts { gyro, accel });
            let begun = DWT::cycle_count();
            compensator.accumulate(&mut state, &sample);
            compensator.correct(&mut state, 0, &mut sample);
            let cycles = DWT::cycle_count().wrapping_sub(begun);
            black_box(&sample);
            all += cycles;
            worst = worst.max(cycles);
        }
        let mean = all / 1000;
        hprintln!("a sample: {} cycles, at a block's end {}", mean, worst);
        assert!(worst < bench.clocks.core / 2000, "longer than a period");
    }
}
