//! An ADIS at SPI1: clock PA5, in PA6, out PA7, select PA4, data-ready PC4 (RM0090 sections 28 and
//! 12).
//!
//! While nothing has come on the sensor's serial line, the board looks for a sensor and its model.
//! These registers it reads and writes byte by byte, and waits. From then on the core takes no part
//! in a burst: data-ready begins a transfer by DMA, and an interrupt comes when it has ended
//! (`firmware::link::bursts`).
//!
//! The SPI has a byte to send as soon as the sending stream is enabled, so the receiving one is
//! enabled before it (28.3.9). When the last byte has come, its last bit was taken; BSY falls half
//! a clock later, and then chip select may rise. **Not tested on hardware**, only in a model
//! (`tests/qemu/judges/stm32f405.py`). QEMU has nothing at its bus.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU8, Ordering};

use cortex_m::peripheral::NVIC;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, OutputPin};
use embedded_hal_bus::spi::ExclusiveDevice;
use firmware::link::Lost;
use firmware::link::bursts::{Bursts, Exchange};
use firmware::link::dma::Stream as _;
use firmware::link::progress::Progress as _;
use firmware::link::spi::{Bus, Registers, Status};
use firmware::wire::adis::spi::{LONGEST, STALL_US};
use firmware::wire::adis::{DetectedSensor, Form, Rate, begin, find};
use stm32f4::stm32f405::{DMA2, EXTI, GPIOA, GPIOC, Interrupt, Peripherals, RCC, SPI1};

use super::clock::Clocks;
use super::counter;
use super::stream::{SPI, Stream, StreamProgress};
use crate::shared::wake::wake;

/// Readings of the status until a byte is given up. Each takes at least 6 cycles, so 0.7 ms at 168
/// MHz. The slowest byte takes 0.25 ms (8 bits at 84 MHz / 256 are 24 us, at 8 MHz / 256 256 us).
const PATIENCE: u32 = 20_000;

/// A clock that every model can do, Hz.
const SLOWEST: u32 = 1_000_000;

/// The longest burst at 1 MHz, 34 bytes at the slowest clock for it, 0.5 MHz: 544 microseconds.
const BURST_US: u32 = 600;

/// Readings of the status until half a clock of a burst is over, of at least 6 cycles each. Half a
/// clock of 0.5 MHz takes 168 cycles.
const HALF_A_CLOCK: u32 = 100;

/// Bursts that may wait for the frame path: 1 ms of an ADIS1649x at its fastest.
static BURSTS: Bursts<4, LONGEST, STALL_US> = Bursts::new();

/// What is sent in a burst, in SRAM, which every stream reaches.
static COMMAND: [AtomicU8; LONGEST] = [const { AtomicU8::new(0) }; LONGEST];

/// Controller and sensor.
pub struct Spi {
    device: ExclusiveDevice<Bus<Controller>, Select, Delay>,
    delay: Delay,
}

impl Spi {
    /// The pins and the controller; the clock is one that every model can do.
    pub fn open(peripherals: &Peripherals, clocks: &Clocks) -> Self {
        pins(&peripherals.RCC, &peripherals.GPIOA, &peripherals.GPIOC);
        data_ready(peripherals);
        let mut controller = Controller {
            bus_hz: clocks.apb2,
        };
        controller.set_up(SLOWEST);
        let bus = Bus::new(controller, PATIENCE);
        let delay = Delay {
            core_hz: clocks.core,
        };
        let device = match ExclusiveDevice::new(bus, Select, delay) {
            Ok(device) => device,
            Err(never) => match never {},
        };
        Self { device, delay }
    }

    /// Looks for a sensor and sets it up, with this rate; from then on its bursts come
    /// by themselves. Without a sensor this takes some 0.5 ms.
    pub fn find(&mut self, rate: Option<Rate>) -> Option<DetectedSensor> {
        let found = find(&mut self.device, &mut self.delay, rate).ok()??;
        let retained = begin(&mut self.device, &mut self.delay, &found).ok()?;
        if !retained {
            return None;
        }
        let form = found.model.form();
        self.device.bus_mut().registers().set_up(form.clock_hz());
        begin_bursts(form).then_some(found)
    }

    /// Ends the bursts, so that a sensor can be found again. One that is under way comes to its
    /// end, since chip select must not move within a byte.
    pub fn forget(&mut self) {
        NVIC::mask(Interrupt::EXTI4);
        self.delay.delay_us(BURST_US);
        NVIC::mask(Interrupt::DMA2_STREAM0);
        BURSTS.forget(&ByDma);
        NVIC::unpend(Interrupt::DMA2_STREAM0);
        spi().cr2().reset();
        let _ = spi().dr8().read(); // a byte that nobody has taken
        self.device.bus_mut().registers().set_up(SLOWEST);
        self.delay.delay_us(STALL_US); // the sensor wants a pause
    }
}

/// The bursts of a sensor that is set up, by DMA. False: there is no controller.
fn begin_bursts(form: Form) -> bool {
    let (command, length) = form.exchange();
    let data = spi().dr8().as_ptr() as u32;
    if !into().set_up(data) || !out().set_up(data) {
        return false;
    }
    if let Some(first) = COMMAND.first() {
        first.store(command, Ordering::Relaxed);
    }
    let _ = spi().dr8().read(); // a byte that nobody has taken is of no burst
    spi()
        .cr2()
        .write(|w| w.rxdmaen().enabled().txdmaen().enabled());
    BURSTS.found(length);
    // An earlier edge announces an old burst, and the next one would come while that is fetched.
    data_ready_seen();
    NVIC::unpend(Interrupt::EXTI4);
    // SAFETY: what the handlers use is set up, and no critical section relies on a masked
    // interrupt.
    unsafe {
        NVIC::unmask(Interrupt::DMA2_STREAM0);
        NVIC::unmask(Interrupt::EXTI4);
    }
    true
}

/// The oldest burst that has come and was not taken.
///
/// # Errors
/// [`Lost`], once for each that was lost.
pub fn burst(reply: &mut [u8; LONGEST]) -> Result<Option<&mut [u8]>, Lost> {
    BURSTS.take(reply, StreamProgress::get)
}

/// Stream 0 of DMA2, from the SPI, and stream 3, to it (RM0090 table 43).
fn into() -> Stream<0, false, SPI> {
    // SAFETY: these registers exist for ever. This stream is the SPI's alone, and once bursts have
    // begun its handlers'.
    Stream::of(unsafe { &*DMA2::ptr() })
}

fn out() -> Stream<3, true, SPI> {
    // SAFETY: as above.
    Stream::of(unsafe { &*DMA2::ptr() })
}

/// The SPI with its streams, for the handlers.
struct ByDma;

impl Exchange<'static> for ByDma {
    #[inline(always)]
    fn begin(&self, places: &'static [AtomicU8]) {
        select(true);
        into().arm(places);
        out().arm(COMMAND.get(..places.len()).unwrap_or_default());
    }

    #[inline(always)]
    fn end(&self) -> bool {
        let left = into().stop();
        out().stop();
        let status = || spi().sr().read();
        let _ = (0..HALF_A_CLOCK).any(|_| !status().bsy().is_busy());
        select(false);
        let whole = left == 0 && !status().ovr().is_overrun();
        if !whole {
            reset_controller();
        }
        whole
    }

    #[inline(always)]
    fn now_us(&self) -> u32 {
        counter::low()
    }
}

/// The controller as it was set up, without what is left of a transfer that was given up.
#[cold]
fn reset_controller() {
    let (cr1, cr2) = (spi().cr1().read().bits(), spi().cr2().read().bits());
    // SAFETY: no other interrupt uses this register, and the frame path does so only at start.
    let reset = unsafe { RCC::steal() };
    reset.apb2rstr().modify(|_, w| w.spi1rst().set_bit());
    reset.apb2rstr().modify(|_, w| w.spi1rst().clear_bit());
    // SAFETY: what was in these registers before.
    unsafe {
        spi().cr2().write(|w| w.bits(cr2));
        spi().cr1().write(|w| w.bits(cr1));
    }
}

/// Registers of SPI1.
struct Controller {
    bus_hz: u32,
}

fn spi() -> SPI1 {
    // SAFETY: after `Board::start` only this file uses SPI1: the frame path until bursts begin,
    // then the handlers.
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
        select(true);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        select(false);
        Ok(())
    }
}

/// Selects the sensor or releases it.
#[inline(always)]
fn select(low: bool) {
    // SAFETY: the register sets and clears single pins, so no other user of the port is disturbed.
    let pins = unsafe { GPIOA::steal() };
    pins.bsrr().write(|w| w.br4().bit(low).bs4().bit(!low));
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

/// The rising edge of PC4 interrupts, once bursts have begun.
fn data_ready(peripherals: &Peripherals) {
    peripherals.SYSCFG.exticr2().modify(|_, w| w.exti4().pc());
    peripherals.EXTI.rtsr().modify(|_, w| w.tr4().enabled());
    peripherals.EXTI.imr().modify(|_, w| w.mr4().unmasked());
}

/// Clears the flag of data-ready.
#[inline(always)]
fn data_ready_seen() {
    // SAFETY: the register clears the flags whose ones are written. Only the handler of data-ready
    // does, and the frame path while that is masked.
    unsafe { EXTI::steal() }.pr().write(|w| w.pr4().clear());
}

/// Data-ready rose.
pub extern "C" fn exti4() {
    data_ready_seen();
    if BURSTS.ready(&ByDma) {
        wake();
    }
}

/// A burst has come, or its transfer has failed.
pub extern "C" fn dma2_stream0() {
    if BURSTS.ended(&ByDma) {
        wake();
    }
}
