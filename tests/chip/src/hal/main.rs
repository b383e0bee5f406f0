//! Runs a subject over unmodified `stm32f4xx-hal`.

#![no_std]
#![no_main]

mod line;

use chip::registers::{self, sleep};
use chip::{BYTES, PATTERN, Report, SECTOR, Subject, begin, done, report, report_sector, subject};
use stm32f4xx_hal::flash::{Error, FlashExt};
use stm32f4xx_hal::gpio::PinState;
use stm32f4xx_hal::hal::spi::{MODE_3, SpiBus};
use stm32f4xx_hal::pac::{self, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};
use stm32f4xx_hal::rtc::Rtc;
use stm32f4xx_hal::spi::Spi;
use stm32f4xx_hal::watchdog::IndependentWatchdog;
use time::{Date, Month, PrimitiveDateTime, Time};

#[cortex_m_rt::entry]
fn main() -> ! {
    let (Some(mut core), Some(chip)) = (cortex_m::Peripherals::take(), pac::Peripherals::take())
    else {
        done()
    };
    begin(&mut core.DCB, &mut core.ITM);
    match subject() {
        Subject::Clock(variant) => clock(chip.RCC, &mut core.SYST, variant),
        Subject::Line => line::echo(chip),
        Subject::Spi => spi(chip),
        Subject::Flash => flash(chip.FLASH),
        Subject::Watchdog => watchdog(chip.IWDG, &mut core.SYST),
        Subject::Window(_) => {} // the crate has no driver of it
        Subject::Calendar => calendar(chip, &mut core.SYST),
        Subject::Supply => registers::supply(&mut core.SYST),
    }
    done()
}

fn tell_clocks(rcc: &Rcc) {
    report(Report::Core, rcc.clocks.hclk().raw());
    report(Report::Apb1, rcc.clocks.pclk1().raw());
    report(Report::Apb2, rcc.clocks.pclk2().raw());
}

fn clock(rcc: pac::RCC, timer: &mut pac::SYST, variant: u32) {
    let config = match variant {
        0 => Config::hsi(),
        1 => Config::hsi().sysclk(168.MHz()),
        2 => Config::hse(12.MHz()).sysclk(168.MHz()).require_pll48clk(),
        3 => Config::hse(8.MHz()).sysclk(48.MHz()).pclk1(12.MHz()),
        4 => Config::hse(16.MHz()).hclk(4.MHz()),
        _ => Config::hse(25.MHz()).sysclk(120.MHz()).hclk(30.MHz()),
    };
    let rcc = rcc.freeze(config);
    tell_clocks(&rcc);
    report(Report::Mark, 0);
    registers::wait(timer, rcc.clocks.hclk().raw() / 1000);
    report(Report::Mark, 1);
}

fn spi(chip: pac::Peripherals) {
    let mut rcc = chip.RCC.freeze(Config::hse(12.MHz()).sysclk(168.MHz()));
    let port = chip.GPIOA.split(&mut rcc);
    let mut select = port.pa4.into_push_pull_output_in_state(PinState::High);
    let pins = (Some(port.pa5), Some(port.pa6), Some(port.pa7));
    let mut spi = Spi::new(chip.SPI1, pins, MODE_3, 1.MHz(), &mut rcc);
    for _ in 0..3 {
        let mut word = [0x72, 0];
        select.set_low();
        let end = spi
            .transfer_in_place(&mut word)
            .and_then(|()| SpiBus::flush(&mut spi));
        select.set_high();
        report(Report::Error, u32::from(end.is_err()));
        report(Report::Word, u32::from(u16::from_be_bytes(word)));
        cortex_m::asm::delay(168 * 20);
    }
}

fn flash(mut flash: pac::FLASH) {
    let number = |end: Result<(), Error>| match end {
        Ok(()) => 0,
        Err(Error::ProgrammingSequence) => 1,
        Err(Error::ProgrammingParallelism) => 2,
        Err(Error::ProgrammingAlignment) => 3,
        Err(_) => 9,
    };
    report(Report::Word, flash.len() as u32);
    let sector = flash
        .sector(SECTOR as usize)
        .map_or(0, |sector| sector.number);
    report(Report::Mark, 0);
    report(Report::Error, number(flash.unlocked().erase(sector)));
    report(Report::Mark, 1);
    report_sector();
    let end = flash.unlocked().program(SECTOR as usize, PATTERN.iter());
    report(Report::Mark, 2);
    report(Report::Error, number(end));
    report_sector();
    let mut open = flash.unlocked();
    registers::wrong_write(0x0800_0000 + SECTOR + 256);
    report(
        Report::Error,
        number(open.program(SECTOR as usize + 64, PATTERN.iter())),
    );
    registers::forgive();
    report(
        Report::Error,
        number(open.program(SECTOR as usize + 128, PATTERN.iter())),
    );
}

fn watchdog(watchdog: pac::IWDG, timer: &mut pac::SYST) {
    if registers::restarted() {
        return;
    }
    let mut watchdog = IndependentWatchdog::new(watchdog);
    watchdog.start(10.millis());
    report(Report::Word, watchdog.interval().ticks());
    for _ in 0..2 {
        sleep(timer, 16_000, 8);
        watchdog.feed();
        report(Report::Mark, 0);
    }
    sleep(timer, 160_000, 3);
}

fn calendar(mut chip: pac::Peripherals, timer: &mut pac::SYST) {
    let mut rcc = chip.RCC.constrain();
    let mut clock = Rtc::new_lsi(chip.RTC, &mut rcc, &mut chip.PWR);
    let date = Date::from_calendar_date(2023, Month::December, 31);
    if let (Ok(date), Ok(time)) = (date, Time::from_hms(23, 59, 58)) {
        let set = clock.set_datetime(&PrimitiveDateTime::new(date, time));
        report(Report::Error, u32::from(set.is_err()));
    }
    for _ in 0..3 {
        report(Report::Mark, 0);
        let now = clock.get_datetime();
        let (hour, minute, second) = now.time().as_hms();
        report(
            Report::Seconds,
            (u32::from(hour) * 60 + u32::from(minute)) * 60 + u32::from(second),
        );
        let date = now.year() as u32 * 10_000 + u32::from(u8::from(now.month())) * 100;
        report(Report::Date, date + u32::from(now.day()));
        report(Report::Micros, now.time().microsecond());
        sleep(timer, 16_000_000, 1);
    }
}

#[interrupt]
fn PVD() {
    registers::supply_fell();
}

const _: () = assert!(BYTES > 2 * line::HALF);
