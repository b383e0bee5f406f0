//! An ADIS at an SPI, over the traits of `embedded-hal`.

use core::future::{Future, pending};

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::spi::SpiBus;
use embedded_hal_async::digital::Wait;
use embedded_hal_bus::spi::ExclusiveDevice;
use firmware::wire::adis::spi::{Adis as Bursts, LONGEST};
use firmware::wire::adis::{Form, Found, begin, find};

/// Between two looks for a sensor, which takes up to 0.3 s to start, microseconds.
const LOOK_US: u64 = 100_000;

/// What gives bursts.
pub trait Source {
    /// The sensor has said that there is a new burst.
    fn ready(&mut self) -> impl Future<Output = ()>;

    /// A new burst, if there is one.
    fn burst<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]>;

    /// Looks for a sensor from time to time, until one is found.
    fn look(&mut self, now_us: u64) -> Option<Found>;
}

/// A board without SPI.
pub struct NoAdis;

impl Source for NoAdis {
    fn ready(&mut self) -> impl Future<Output = ()> {
        pending()
    }

    fn burst<'b>(&mut self, _: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]> {
        None
    }

    fn look(&mut self, _: u64) -> Option<Found> {
        None
    }
}

/// A sensor at a bus in mode 3 of at most 1 MHz, with chip select and data-ready.
pub struct Adis<B, S, R> {
    device: ExclusiveDevice<B, S, embassy_time::Delay>,
    ready: R,
    form: Option<Form>,
    /// Data-ready has risen and no burst was fetched since.
    new: bool,
    looked_us: u64,
}

impl<B: SpiBus, S: OutputPin, R: InputPin + Wait> Adis<B, S, R> {
    /// At these. `None`: the chip select cannot be set.
    pub fn new(bus: B, select: S, ready: R) -> Option<Self> {
        Some(Self {
            device: ExclusiveDevice::new(bus, select, embassy_time::Delay).ok()?,
            ready,
            form: None,
            new: false,
            looked_us: 0,
        })
    }

    fn find(&mut self) -> Option<Found> {
        let mut delay = Waits;
        let found = find(&mut self.device, &mut delay).ok()??;
        if !begin(&mut self.device, &mut delay, found.model).ok()? {
            return None;
        }
        self.form = Some(found.model.form());
        Some(found)
    }
}

/// The waits of the set-up.
struct Waits;

impl DelayNs for Waits {
    fn delay_ns(&mut self, ns: u32) {
        embassy_time::Delay.delay_ns(ns);
    }
}

impl<B: SpiBus, S: OutputPin, R: InputPin + Wait> Source for Adis<B, S, R> {
    async fn ready(&mut self) {
        if self.form.is_none() || self.ready.wait_for_rising_edge().await.is_err() {
            pending::<()>().await;
        }
        self.new = true;
    }

    fn burst<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]> {
        let form = self.form?;
        if !core::mem::take(&mut self.new) {
            return None;
        }
        Bursts::new(&mut self.device, form).fetch(frame).ok()
    }

    fn look(&mut self, now_us: u64) -> Option<Found> {
        if self.form.is_some() || now_us.saturating_sub(self.looked_us) < LOOK_US {
            return None;
        }
        self.looked_us = now_us;
        self.find()
    }
}
