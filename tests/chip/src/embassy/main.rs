//! Runs a subject over unmodified `embassy-stm32`.

#![no_std]
#![no_main]

mod line;
mod waiting;

use chip::registers::{self, sleep};
use chip::{PATTERN, Report, SECTOR, Subject, begin, done, report, report_sector, subject};
use cortex_m::peripheral::SYST;
use embassy_stm32::flash::{Error, FLASH_SIZE, Flash};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource,
    Sysclk, clocks,
};
use embassy_stm32::rtc::{DateTime, DayOfWeek, Rtc, RtcConfig};
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::{IndependentWatchdog, WindowWatchdog};
use embassy_stm32::{Config, Peri, Peripherals, bind_interrupts, dma, peripherals};

use waiting::wait_for;

bind_interrupts!(struct Interrupts {
    USART1 => embassy_stm32::usart::InterruptHandler<peripherals::USART1>;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    DMA2_STREAM7 => dma::InterruptHandler<peripherals::DMA2_CH7>;
});

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(mut core) = cortex_m::Peripherals::take() else {
        done()
    };
    begin(&mut core.DCB, &mut core.ITM);
    match subject() {
        Subject::Clock(variant) => clock(&mut core.SYST, variant),
        Subject::Line => line::echo(embassy_stm32::init(fast())),
        Subject::Spi => spi(embassy_stm32::init(fast())),
        Subject::Flash => flash(embassy_stm32::init(slow())),
        Subject::Watchdog => watchdog(embassy_stm32::init(slow()).IWDG, &mut core.SYST),
        Subject::Window(fed) => window(embassy_stm32::init(slow()).WWDG, &mut core.SYST, fed),
        Subject::Calendar => calendar(embassy_stm32::init(slow()), &mut core.SYST),
        Subject::Supply => {
            let _ = embassy_stm32::init(slow());
            registers::supply(&mut core.SYST);
        }
    }
    done()
}

/// The internal oscillator without PLL.
fn slow() -> Config {
    Config::default()
}

/// A PLL of `mul` / `div` times the source divided to 1 MHz.
fn pll(mhz: PllPreDiv, mul: PllMul, div: PllPDiv) -> Option<Pll> {
    Some(Pll {
        prediv: mhz,
        mul,
        divp: Some(div),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    })
}

fn crystal(mhz: u32) -> Option<Hse> {
    let (freq, mode) = (Hertz::mhz(mhz), HseMode::Oscillator);
    Some(Hse { freq, mode })
}

/// 168 MHz from a crystal of 12 MHz.
fn fast() -> Config {
    let mut config = Config::default();
    config.rcc.hse = crystal(12);
    config.rcc.pll_src = PllSource::HSE;
    config.rcc.pll = pll(PllPreDiv::DIV12, PllMul::MUL336, PllPDiv::DIV2);
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

fn clock(timer: &mut SYST, variant: u32) {
    let mut config = fast();
    let rcc = &mut config.rcc;
    match variant {
        0 => config = slow(),
        1 => {
            (rcc.hse, rcc.pll_src) = (None, PllSource::HSI);
            rcc.pll = pll(PllPreDiv::DIV16, PllMul::MUL336, PllPDiv::DIV2);
        }
        2 => {}
        3 => {
            rcc.hse = crystal(8);
            rcc.pll = pll(PllPreDiv::DIV8, PllMul::MUL192, PllPDiv::DIV4);
            rcc.apb2_pre = APBPrescaler::DIV1;
        }
        4 => {
            (rcc.hse, rcc.pll, rcc.sys) = (crystal(16), None, Sysclk::HSE);
            rcc.ahb_pre = AHBPrescaler::DIV4;
            (rcc.apb1_pre, rcc.apb2_pre) = (APBPrescaler::DIV1, APBPrescaler::DIV1);
        }
        _ => {
            (rcc.hse, rcc.hsi) = (crystal(25), false);
            rcc.pll = pll(PllPreDiv::DIV25, PllMul::MUL240, PllPDiv::DIV2);
            rcc.ahb_pre = AHBPrescaler::DIV4;
            (rcc.apb1_pre, rcc.apb2_pre) = (APBPrescaler::DIV1, APBPrescaler::DIV1);
        }
    }
    let chip = embassy_stm32::init(config);
    let clocks = clocks(&chip.RCC);
    let hertz = |clock: Option<Hertz>| clock.map_or(0, |clock| clock.0);
    let core = hertz(clocks.hclk1.into());
    report(Report::Core, core);
    report(Report::Apb1, hertz(clocks.pclk1.into()));
    report(Report::Apb2, hertz(clocks.pclk2.into()));
    report(Report::Mark, 0);
    registers::wait(timer, core / 1000);
    report(Report::Mark, 1);
}

fn spi(chip: Peripherals) {
    let mut select = Output::new(chip.PA4, Level::High, Speed::High);
    let mut config = spi::Config::default();
    (config.mode, config.frequency) = (spi::MODE_3, Hertz::mhz(1));
    let (clock, out, into) = (chip.PA5, chip.PA7, chip.PA6);
    let streams = (chip.DMA2_CH3, chip.DMA2_CH0);
    let mut spi = Spi::new(
        chip.SPI1, clock, out, into, streams.0, streams.1, Interrupts, config,
    );
    for n in 0..3 {
        let mut word = [0x72, 0];
        select.set_low();
        let end = if n < 2 {
            spi.blocking_transfer_in_place(&mut word)
        } else {
            wait_for(spi.transfer_in_place(&mut word))
        };
        select.set_high();
        report(Report::Error, u32::from(end.is_err()));
        report(Report::Word, u32::from(u16::from_be_bytes(word)));
        cortex_m::asm::delay(168 * 20);
    }
}

fn flash(chip: Peripherals) {
    let number = |end: Result<(), Error>| match end {
        Ok(()) => 0,
        Err(Error::Seq) => 1,
        Err(Error::Parallelism) => 2,
        Err(Error::Unaligned) => 3,
        Err(_) => 9,
    };
    let mut flash = Flash::new_blocking(chip.FLASH);
    report(Report::Word, FLASH_SIZE as u32);
    report(Report::Mark, 0);
    report(
        Report::Error,
        number(flash.blocking_erase(SECTOR, SECTOR + 0x2_0000)),
    );
    report(Report::Mark, 1);
    report_sector();
    let end = flash.blocking_write(SECTOR, &PATTERN);
    report(Report::Mark, 2);
    report(Report::Error, number(end));
    report_sector();
    registers::wrong_write(0x0800_0000 + SECTOR + 256);
    report(
        Report::Error,
        number(flash.blocking_write(SECTOR + 64, &PATTERN)),
    );
    registers::forgive();
    report(
        Report::Error,
        number(flash.blocking_write(SECTOR + 128, &PATTERN)),
    );
}

fn watchdog(watchdog: Peri<'static, peripherals::IWDG>, timer: &mut SYST) {
    if registers::restarted() {
        return;
    }
    let mut watchdog = IndependentWatchdog::new(watchdog, 10_000);
    watchdog.unleash();
    for _ in 0..2 {
        sleep(timer, 16_000, 8);
        watchdog.pet();
        report(Report::Mark, 0);
    }
    sleep(timer, 160_000, 3);
}

/// A window watchdog of 12 ms, of which the last six are open. It is fed in time, then too early;
/// or never.
fn window(watchdog: Peri<'static, peripherals::WWDG>, timer: &mut SYST, fed: bool) {
    if registers::restarted() {
        return;
    }
    let mut watchdog = WindowWatchdog::new(watchdog, 12_000, 6_000);
    report(Report::Mark, 0);
    if fed {
        sleep(timer, 16_000, 8);
        watchdog.pet();
        report(Report::Mark, 1);
        sleep(timer, 16_000, 2);
        watchdog.pet();
        report(Report::Mark, 2);
    }
    sleep(timer, 160_000, 3);
}

fn calendar(chip: Peripherals, timer: &mut SYST) {
    let again = registers::cause() & 1 << 28 != 0; // started by software
    let (mut clock, time) = Rtc::new(chip.RTC, RtcConfig::default());
    if !again {
        clock.write_backup_register(7, 0x1234_5678);
        let set = DateTime::from(2023, 12, 31, DayOfWeek::Sunday, 23, 59, 58, 0);
        if let Ok(set) = set {
            report(Report::Error, u32::from(clock.set_datetime(set).is_err()));
        }
    }
    report(Report::Word, clock.read_backup_register(7).unwrap_or(0));
    for _ in 0..3 {
        report(Report::Mark, 0);
        if let Ok(now) = time.now() {
            let minutes = u32::from(now.hour()) * 60 + u32::from(now.minute());
            report(Report::Seconds, minutes * 60 + u32::from(now.second()));
            let date = u32::from(now.year()) * 10_000 + u32::from(now.month()) * 100;
            report(Report::Date, date + u32::from(now.day()));
            report(Report::Micros, now.microsecond());
        }
        sleep(timer, 16_000_000, 1);
    }
    if !again {
        registers::reset();
    }
}

#[interrupt]
fn PVD() {
    registers::supply_fell();
}
