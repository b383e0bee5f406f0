//! An ADIS at an SPI, over the traits of `embedded-hal`.

use core::future::{Future, pending};

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Delay;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiBus;
use embedded_hal_async::digital::Wait;
use embedded_hal_bus::spi::ExclusiveDevice;
use firmware::wire::adis::spi::{Adis as Bursts, LONGEST};
use firmware::wire::adis::{DetectedSensor, Form, Rate, begin, find};

/// Between two looks for a sensor, which takes up to 0.3 s to start, microseconds.
pub const LOOK_US: u64 = 100_000;

/// The sensor has a new burst. Further ones until it is taken are one.
pub type New = Signal<CriticalSectionRawMutex, ()>;

/// A board's SPI with an ADIS, instead of a sensor on a serial line.
pub trait Source {
    /// The end that fetches bursts.
    type Fetch: Fetch;

    /// The end that fetches bursts, and a task that announces new bursts. It goes on beside the
    /// loop, so that no edge comes while nobody waits for one.
    fn split(self, new: &'static New) -> (Self::Fetch, impl Future<Output = ()>);
}

/// Fetches bursts.
pub trait Fetch {
    /// The newest burst. `None`: there is no sensor, or the bus failed.
    fn burst<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]>;

    /// Whether a burst was lost, once for each.
    fn has_lost(&mut self) -> bool {
        false
    }

    /// Looks for a sensor from time to time, until one is found. It is set to the configured rate.
    fn look(&mut self, now_us: u64, rate: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor>;

    /// The sensor is looked for again, and set up again.
    fn forget(&mut self) {}
}

/// A board without SPI.
pub struct NoAdis;

impl Source for NoAdis {
    type Fetch = Self;

    fn split(self, _: &'static New) -> (Self, impl Future<Output = ()>) {
        (self, pending())
    }
}

impl Fetch for NoAdis {
    fn burst<'b>(&mut self, _: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]> {
        None
    }

    fn look(&mut self, _: u64, _: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor> {
        None
    }
}

/// A sensor at a bus in mode 3 of at most 1 MHz, with chip select and data-ready. The core waits
/// for the bytes of a burst, so none is set to a rate above the usual one.
pub struct Adis<B, S, R> {
    sensor: Sensor<B, S>,
    ready: R,
}

/// Bus and chip select.
pub struct Sensor<B, S> {
    device: ExclusiveDevice<B, S, Delay>,
    form: Option<Form>,
    looked_us: u64,
}

impl<B: SpiBus, S: OutputPin, R: Wait> Adis<B, S, R> {
    /// At these. `None`: the chip select cannot be set.
    pub fn new(bus: B, select: S, ready: R) -> Option<Self> {
        let device = ExclusiveDevice::new(bus, select, Delay).ok()?;
        let sensor = Sensor {
            device,
            form: None,
            looked_us: 0,
        };
        Some(Self { sensor, ready })
    }
}

impl<B: SpiBus, S: OutputPin, R: Wait> Source for Adis<B, S, R> {
    type Fetch = Sensor<B, S>;

    fn split(self, new: &'static New) -> (Sensor<B, S>, impl Future<Output = ()>) {
        let mut ready = self.ready;
        let edges = async move {
            while ready.wait_for_rising_edge().await.is_ok() {
                new.signal(());
            }
            pending().await
        };
        (self.sensor, edges)
    }
}

impl<B: SpiBus, S: OutputPin> Sensor<B, S> {
    fn find(&mut self, rate: Option<Rate>) -> Option<DetectedSensor> {
        let found = find(&mut self.device, &mut Delay, rate).ok()??;
        if !begin(&mut self.device, &mut Delay, &found).ok()? {
            return None;
        }
        self.form = Some(found.model.form());
        Some(found)
    }
}

impl<B: SpiBus, S: OutputPin> Fetch for Sensor<B, S> {
    fn burst<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]> {
        Bursts::new(&mut self.device, self.form?).fetch(frame).ok()
    }

    fn look(&mut self, now_us: u64, rate: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor> {
        if self.form.is_some() || now_us.saturating_sub(self.looked_us) < LOOK_US {
            return None;
        }
        self.looked_us = now_us;
        self.find(rate().filter(|rate| rate.hz <= Rate::usual(rate.form).hz))
    }

    fn forget(&mut self) {
        (self.form, self.looked_us) = (None, 0);
    }
}
