//! An ADIS at an SPI of an STM32, whose bursts DMA moves, over the drivers of `embassy-stm32`.
//!
//! The loop looks for the sensor. Then a task has the bus and fetches bursts. It runs in an
//! interrupt of its own, above the loop and below the drivers' interrupts, so that no data-ready is
//! missed while the loop is busy. Up to [`WAITING`] bursts wait for the loop.
//!
//! Each transfer has a bound. One that has not ended by then is given up: the SPI is reopened,
//! and the burst is reported as lost, as is one that finds no room.

use core::future::{Future, pending};
use core::pin::pin;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;

use embassy_executor::InterruptExecutor;
use embassy_futures::poll_once;
use embassy_futures::select::{Either, select};
use embassy_stm32::exti::ExtiInput;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::{Delay, Duration, Instant, with_timeout};
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::adis::{DetectedSensor, Form, Rate, begin, find};

use crate::adis::{Fetch, LOOK_US, New, Source};

/// Bursts that may wait for the loop: 1 ms of an ADIS1649x at its fastest.
const WAITING: usize = 4;
/// A clock that every model can do, Hz.
const SLOWEST: u32 = 1_000_000;
/// A transfer may take so long beside its bits, microseconds.
const SPARE_US: u64 = 100;

/// A reply, and its bytes.
type Burst = ([u8; LONGEST], usize);

static ABOVE: InterruptExecutor = InterruptExecutor::new();
/// The bus on its way to the task, the end of its work, and the bus on its way back.
static BEGIN: Signal<CriticalSectionRawMutex, (Bus, Form)> = Signal::new();
static FORGET: Signal<CriticalSectionRawMutex, ()> = Signal::new();
static BACK: Signal<CriticalSectionRawMutex, Bus> = Signal::new();
static BURSTS: Channel<CriticalSectionRawMutex, Burst, WAITING> = Channel::new();
static LOST: AtomicU32 = AtomicU32::new(0);

/// The SPI's interrupts are free, since its DMA has its own.
#[embassy_stm32::interrupt]
#[allow(
    unsafe_code,
    reason = "the executor of this interrupt, and nobody else's"
)]
fn SPI3() {
    // SAFETY: this is the interrupt that `ABOVE` is started with.
    unsafe { ABOVE.on_interrupt() }
}

/// Opens the SPI, from its beginning.
pub type Open = fn(spi::Config) -> Spi<'static, Async, Master>;

/// [`Adis`] at these of the board's peripherals: SPI; pins of clock, out and in; streams out and
/// in; the SPI's clock, Hz; select; data-ready with its line of EXTI. The board's `Interrupts` bind
/// streams and line.
#[macro_export]
macro_rules! adis {
    ($of:ident: $spi:ident, $clock:ident, $out:ident, $into:ident; $to:ident, $from:ident;
     $hz:expr; $select:ident, $ready:ident, $line:ident) => {{
        // nobody else has them
        let _ = (
            $of.$spi, $of.$clock, $of.$out, $of.$into, $of.$to, $of.$from,
        );
        $crate::spi::Adis {
            open: |config| {
                use embassy_stm32::peripherals as of;
                #[allow(unsafe_code, reason = "reopened after a transfer that was given up")]
                // SAFETY: they were moved to here, and the SPI of before is dropped.
                let (spi, clock, out, into, to, from) = unsafe {
                    (
                        of::$spi::steal(),
                        of::$clock::steal(),
                        of::$out::steal(),
                        of::$into::steal(),
                        of::$to::steal(),
                        of::$from::steal(),
                    )
                };
                embassy_stm32::spi::Spi::new(spi, clock, out, into, to, from, Interrupts, config)
            },
            hz: $hz,
            select: embassy_stm32::gpio::Output::new(
                $of.$select,
                embassy_stm32::gpio::Level::High,
                embassy_stm32::gpio::Speed::High,
            ),
            ready: embassy_stm32::exti::ExtiInput::new(
                $of.$ready,
                $of.$line,
                embassy_stm32::gpio::Pull::Down,
                Interrupts,
            ),
        }
    }};
}

/// A sensor at an SPI, with chip select and data-ready.
pub struct Adis {
    /// Opens the SPI.
    pub open: Open,
    /// The SPI's clock, Hz.
    pub hz: u32,
    /// Chip select.
    pub select: Output<'static>,
    /// Data-ready.
    pub ready: ExtiInput<'static, Async>,
}

impl Source for Adis {
    type Fetch = Fetched;

    fn split(self, new: &'static New) -> (Fetched, impl Future<Output = ()>) {
        let mut bus = Bus {
            open: self.open,
            hz: self.hz,
            clock_hz: SLOWEST,
            spi: None,
            select: self.select,
            memory: crate::dma::exchange(),
        };
        interrupt::SPI3.set_priority(Priority::P6);
        let task = serve(self.ready, new).expect("called once");
        ABOVE.start(interrupt::SPI3).spawn(task);
        bus.set(SLOWEST);
        let fetched = Fetched {
            new,
            bus: Some(bus),
            looked_us: 0,
            reported: 0,
        };
        (fetched, pending())
    }
}

/// The loop's end.
pub struct Fetched {
    new: &'static New,
    /// While there is no sensor.
    bus: Option<Bus>,
    looked_us: u64,
    /// Lost bursts that were reported.
    reported: u32,
}

impl Fetch for Fetched {
    fn burst<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]> {
        let (bytes, len) = BURSTS.try_receive().ok()?;
        if !BURSTS.is_empty() {
            self.new.signal(());
        }
        *frame = bytes;
        frame.get_mut(..len)
    }

    fn has_lost(&mut self) -> bool {
        let lost = self.reported != LOST.load(Ordering::Relaxed);
        self.reported = self.reported.wrapping_add(lost.into());
        lost
    }

    fn look(&mut self, now_us: u64, rate: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor> {
        self.bus = self.bus.take().or_else(|| BACK.try_take());
        if now_us.saturating_sub(self.looked_us) < LOOK_US {
            return None;
        }
        let bus = self.bus.as_mut()?;
        self.looked_us = now_us;
        let found = bus.find(rate())?;
        let form = found.model.form();
        bus.set(form.clock_hz());
        FORGET.reset();
        BEGIN.signal((self.bus.take()?, form));
        Some(found)
    }

    fn forget(&mut self) {
        if self.bus.is_none() {
            FORGET.signal(());
        }
        self.looked_us = 0;
    }
}

#[embassy_executor::task]
async fn serve(mut ready: ExtiInput<'static, Async>, new: &'static New) {
    loop {
        let (mut bus, form) = BEGIN.wait().await;
        while let Either::First(()) = select(ready.wait_for_rising_edge(), FORGET.wait()).await {
            let came = bus.burst(form).await.map(|burst| BURSTS.try_send(burst));
            if !matches!(came, Some(Ok(()))) {
                LOST.fetch_add(1, Ordering::Relaxed);
            }
            new.signal(());
        }
        BURSTS.clear(); // of the old rate
        bus.set(SLOWEST);
        BACK.signal(bus);
    }
}

/// The SPI and chip select.
struct Bus {
    open: Open,
    /// The SPI's clock, and the fastest at the sensor, Hz.
    hz: u32,
    clock_hz: u32,
    spi: Option<Spi<'static, Async, Master>>,
    select: Output<'static>,
    memory: &'static mut [u8; LONGEST],
}

/// A transfer that was given up.
#[derive(Debug)]
struct Late;

impl embedded_hal::spi::Error for Late {
    fn kind(&self) -> embedded_hal::spi::ErrorKind {
        embedded_hal::spi::ErrorKind::Other
    }
}

impl Bus {
    /// With this clock from now on, or a slower one: half, a quarter, ... of its own. The driver
    /// alone takes the nearest, which may be faster.
    fn set(&mut self, clock_hz: u32) {
        self.clock_hz = (1..=8)
            .map(|half| self.hz >> half)
            .find(|hz| *hz <= clock_hz)
            .unwrap_or(self.hz >> 8);
        self.spi = None;
        self.reset_controller();
    }

    /// Opens the SPI, which is closed.
    #[inline(never)] // seldom, by three callers
    fn reset_controller(&mut self) {
        let mut config = spi::Config::default();
        (config.mode, config.frequency) = (spi::MODE_3, Hertz(self.clock_hz));
        self.spi = Some((self.open)(config));
    }

    /// So long a transfer of so many bytes may take.
    fn bound(&self, bytes: usize) -> Duration {
        Duration::from_micros(bytes as u64 * 8_000_000 / u64::from(self.clock_hz) + SPARE_US)
    }

    /// A burst's reply. `None`: the transfer was given up.
    async fn burst(&mut self, form: Form) -> Option<Burst> {
        let (command, length) = form.exchange();
        let bound = self.bound(length);
        let (spi, bytes) = (self.spi.as_mut()?, self.memory.get_mut(..length)?);
        bytes.fill(0);
        if let Some(first) = bytes.first_mut() {
            *first = command;
        }
        self.select.set_low();
        let done = with_timeout(bound, spi.transfer_in_place(bytes)).await;
        let done = matches!(done, Ok(Ok(())));
        self.ended(done);
        let mut reply = [0; LONGEST];
        let came = self.memory.get(2..length).unwrap_or_default();
        for (place, byte) in reply.iter_mut().zip(came) {
            *place = *byte;
        }
        done.then_some((reply, came.len()))
    }

    /// Releases the sensor. The SPI of a transfer that was given up is reopened.
    fn ended(&mut self, done: bool) {
        if !done {
            self.spi = None;
        }
        self.select.set_high();
        if !done {
            self.reset_controller();
        }
    }

    /// Moves these bytes both ways, and waits.
    fn exchange(&mut self, bytes: &mut [u8]) -> Result<(), Late> {
        let bound = self.bound(bytes.len());
        let spi = self.spi.as_mut().ok_or(Late)?;
        let memory = self.memory.get_mut(..bytes.len()).ok_or(Late)?;
        memory.copy_from_slice(bytes);
        self.select.set_low();
        let done = waited(spi.transfer_in_place(memory), bound);
        bytes.copy_from_slice(memory);
        self.ended(done);
        if done { Ok(()) } else { Err(Late) }
    }

    fn find(&mut self, rate: Option<Rate>) -> Option<DetectedSensor> {
        let found = find(&mut *self, &mut Delay, rate).ok()??;
        let kept = begin(self, &mut Delay, &found).ok()?;
        kept.then_some(found)
    }
}

/// Whether a transfer has ended within a time. The core waits.
fn waited(transfer: impl Future<Output = Result<(), spi::Error>>, bound: Duration) -> bool {
    let begun = Instant::now();
    let mut transfer = pin!(transfer);
    loop {
        match poll_once(transfer.as_mut()) {
            Poll::Ready(done) => return done.is_ok(),
            Poll::Pending if begun.elapsed() > bound => return false,
            Poll::Pending => {}
        }
    }
}

impl ErrorType for Bus {
    type Error = Late;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Late> {
        // each is a transaction of its own for an ADIS, and its driver has one in each
        for operation in operations {
            match operation {
                Operation::Read(bytes) => {
                    bytes.fill(0);
                    self.exchange(bytes)?;
                }
                Operation::Write(bytes) => {
                    let mut both = [0; LONGEST];
                    let both = both.get_mut(..bytes.len()).ok_or(Late)?;
                    both.copy_from_slice(bytes);
                    self.exchange(both)?;
                }
                Operation::TransferInPlace(bytes) => self.exchange(bytes)?,
                Operation::Transfer(..) | Operation::DelayNs(_) => return Err(Late),
            }
        }
        Ok(())
    }
}
