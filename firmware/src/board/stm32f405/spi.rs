//! An ADIS at SPI1: clock PA5, in PA6, out PA7, select PA4, data-ready PC4 (RM0090 sections 28 and
//! 12).
//!
//! While nothing has come on the sensor's serial line, the board looks for a sensor and its model.
//! **Not tested on hardware**, only in a model (`tests/qemu/judges/stm32f405.py`). QEMU has nothing
//! at its bus.

use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::NVIC;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal_bus::spi::ExclusiveDevice;
use firmware::link::spi::{Bus, Registers, Status};
use firmware::wire::adis::spi::{Adis, LONGEST};
use firmware::wire::adis::{Form, Found, begin, find};
use stm32f4::stm32f405::{EXTI, GPIOA, GPIOC, Interrupt, Peripherals, RCC, SPI1};

use super::clock::Clocks;
use crate::shared::wake::wake;

/// Readings of the status until a byte is given up. Each takes at least 6 cycles, so 0.7 ms at 168
/// MHz. The slowest byte takes 0.25 ms (8 bits at 84 MHz / 256 are 24 us, at 8 MHz / 256 256 us).
const PATIENCE: u32 = 20_000;

/// The sensor has a new sample.
static READY: AtomicBool = AtomicBool::new(false);

/// Controller and sensor.
pub struct Spi {
    device: ExclusiveDevice<Bus<Controller>, Select, Delay>,
    delay: Delay,
    /// Of the sensor that was found.
    form: Option<Form>,
}

impl Spi {
    /// The pins and the controller; the clock is one that every model can do.
    pub fn open(peripherals: &Peripherals, clocks: &Clocks) -> Self {
        pins(&peripherals.RCC, &peripherals.GPIOA, &peripherals.GPIOC);
        data_ready(peripherals);
        let mut controller = Controller {
            bus_hz: clocks.apb2,
        };
        controller.set_up(Form::Narrow.clock_hz());
        let bus = Bus::new(controller, PATIENCE);
        let delay = Delay {
            core_hz: clocks.core,
        };
        let device = match ExclusiveDevice::new(bus, Select, delay) {
            Ok(device) => device,
            Err(never) => match never {},
        };
        Self {
            device,
            delay,
            form: None,
        }
    }

    /// Looks for a sensor and sets it up. Without a sensor this takes some 0.5 ms.
    pub fn find(&mut self) -> Option<Found> {
        let found = find(&mut self.device, &mut self.delay).ok()??;
        let kept = begin(&mut self.device, &mut self.delay, found.model).ok()?;
        if !kept {
            return None;
        }
        let form = found.model.form();
        self.device.bus_mut().registers().set_up(form.clock_hz());
        self.form = Some(form);
        Some(found)
    }

    /// A burst, if the sensor has said that there is a new one since the last.
    pub fn burst<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]> {
        let form = self.form?;
        if !READY.swap(false, Ordering::Relaxed) {
            return None;
        }
        Adis::new(&mut self.device, form).fetch(frame).ok()
    }
}

/// Registers of SPI1.
struct Controller {
    bus_hz: u32,
}

fn spi() -> SPI1 {
    // SAFETY: after `Board::start` only this file uses SPI1, and never in an interrupt.
    unsafe { SPI1::steal() }
}

impl Controller {
    /// Mode 3, most significant bit first, master, select by software, at most `clock_hz`.
    fn set_up(&mut self, clock_hz: u32) {
        // 2^(BR + 1) is the divider (RM0090 28.5.1)
        let slow_enough = |br: &u8| self.bus_hz >> (br + 1) <= clock_hz;
        let br = (0..8).find(slow_enough).unwrap_or(7);
        let spi = spi();
        spi.cr1().modify(|_, w| w.spe().disabled()); // no transfer is under way
        spi.cr1().write(|w| {
            w.cpol().idle_high().cpha().second_edge();
            w.mstr().master().ssm().enabled().ssi().slave_not_selected();
            // SAFETY: three bits.
            unsafe { w.br().bits(br) }
        });
        spi.cr1().modify(|_, w| w.spe().enabled());
    }
}

impl Registers for Controller {
    fn status(&mut self) -> Status {
        let status = spi().sr().read();
        Status {
            room: status.txe().is_empty(),
            came: status.rxne().is_not_empty(),
            busy: status.bsy().is_busy(),
            fault: status.ovr().is_overrun() || status.modf().is_fault(),
        }
    }

    fn put(&mut self, byte: u8) {
        spi().dr8().write(|w| w.dr().set(byte));
    }

    fn take(&mut self) -> u8 {
        spi().dr8().read().dr().bits()
    }
}

/// Chip select, low when selected.
struct Select;

impl digital::ErrorType for Select {
    type Error = Infallible;
}

impl OutputPin for Select {
    fn set_low(&mut self) -> Result<(), Infallible> {
        // SAFETY: the register sets and clears single pins, so no other user of the port is
        // disturbed.
        unsafe { GPIOA::steal() }
            .bsrr()
            .write(|w| w.br4().set_bit());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        // SAFETY: as above.
        unsafe { GPIOA::steal() }
            .bsrr()
            .write(|w| w.bs4().set_bit());
        Ok(())
    }
}

/// Waits by counting cycles.
#[derive(Clone, Copy)]
struct Delay {
    core_hz: u32,
}

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        // to the next microsecond
        let cycles = ns.div_ceil(1000).saturating_mul(self.core_hz / 1_000_000);
        cortex_m::asm::delay(cycles);
    }
}

/// Mode 3 idles high, so the clock is high before the controller is on. Inputs are pulled down: a
/// line that nothing drives reads zeros and raises no data-ready.
fn pins(rcc: &RCC, a: &GPIOA, c: &GPIOC) {
    rcc.ahb1enr().modify(|_, w| w.gpiocen().set_bit());
    rcc.apb2enr()
        .modify(|_, w| w.spi1en().set_bit().syscfgen().set_bit());
    // DS8626 table 9: AF5. A slow edge of the clock costs the last bit (ES0182, "corrupted last bit
    // of data received in master mode with delayed SCK feedback").
    a.afrl()
        .modify(|_, w| w.afrl5().af5().afrl6().af5().afrl7().af5());
    a.ospeedr()
        .modify(|_, w| w.ospeedr5().very_high_speed().ospeedr7().high_speed());
    a.pupdr().modify(|_, w| w.pupdr6().pull_down());
    c.pupdr().modify(|_, w| w.pupdr4().pull_down());
    a.bsrr().write(|w| w.bs4().set_bit());
    a.moder().modify(|_, w| {
        w.moder4().output();
        w.moder5()
            .alternate()
            .moder6()
            .alternate()
            .moder7()
            .alternate()
    });
}

/// The rising edge of PC4 interrupts.
fn data_ready(peripherals: &Peripherals) {
    peripherals.SYSCFG.exticr2().modify(|_, w| w.exti4().pc());
    peripherals.EXTI.rtsr().modify(|_, w| w.tr4().enabled());
    peripherals.EXTI.imr().modify(|_, w| w.mr4().unmasked());
    // SAFETY: what the handler uses is set up, and no critical section relies on a masked
    // interrupt.
    unsafe { NVIC::unmask(Interrupt::EXTI4) };
}

/// Data-ready rose.
pub extern "C" fn exti4() {
    // SAFETY: the register clears the flags whose ones are written; only this handler does.
    unsafe { EXTI::steal() }.pr().write(|w| w.pr4().clear());
    READY.store(true, Ordering::Relaxed);
    wake();
}
