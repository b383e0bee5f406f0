//! Serial lines over the buffered UARTs of `embassy-rp` and `embassy-nrf`. Their
//! interrupts move the bytes between the wire and a ring, so nothing here waits.

use core::cell::RefCell;
use core::future::{Future, pending};

use embassy_futures::poll_once;
use embedded_io_async::{BufRead, Read, ReadReady, Write};
use firmware::configuration::{Parity, SerialLines};
use firmware::link::{Full, Line, Lost, NoLine};

/// Bytes of the ring of a line in each direction, like those of `firmware::link::uart`.
pub const RING: usize = 512;
/// The longest message: any frame, any packet of the command link.
const LONGEST: usize = 256;

/// How a line is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Bit/s.
    pub baud: u32,
    /// Parity.
    pub parity: Parity,
    /// Two stop bits instead of one.
    pub two_stop_bits: bool,
}

impl Frame {
    /// Eight data bits, one stop bit, no parity.
    pub const fn plain(baud: u32) -> Self {
        Self {
            baud,
            parity: Parity::None,
            two_stop_bits: false,
        }
    }

    /// Of the sensor's and the navigation computer's line.
    pub const fn sensor(lines: &SerialLines) -> Self {
        Self {
            baud: lines.sensor_baud,
            parity: lines.parity,
            two_stop_bits: lines.two_stop_bits,
        }
    }
}

/// A line of a board.
pub trait Wire: Line {
    /// Something has come.
    fn arrived(&mut self) -> impl Future<Output = ()>;

    /// Reopens it. What it cannot do stays as it was; `Hardware::check` has refused it before.
    fn open(&mut self, frame: &Frame);
}

impl Wire for NoLine {
    fn arrived(&mut self) -> impl Future<Output = ()> {
        pending()
    }

    fn open(&mut self, _: &Frame) {}
}

/// A UART whose interrupts move bytes.
pub trait Uart: Read + ReadReady + BufRead + Write {
    /// Reopens it.
    fn open(&mut self, frame: &Frame);
}

/// A line over such a UART.
#[derive(Debug)]
pub struct Port<U> {
    uart: RefCell<U>,
    /// What the ring had no room for; the next message waits for it.
    rest: [u8; LONGEST],
    left: (usize, usize),
    /// An error came while nothing was there to read.
    lost: bool,
}

impl<U: Uart> Port<U> {
    /// Over this UART, which is open.
    pub const fn new(uart: U) -> Self {
        Self {
            uart: RefCell::new(uart),
            rest: [0; LONGEST],
            left: (0, 0),
            lost: false,
        }
    }

    /// How many of these bytes the ring takes now.
    fn write(uart: &mut U, bytes: &[u8]) -> usize {
        match poll_once(uart.write(bytes)) {
            core::task::Poll::Ready(Ok(taken)) => taken.min(bytes.len()),
            _ => 0,
        }
    }
}

impl<U: Uart> Line for Port<U> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        if core::mem::take(&mut self.lost) {
            return Err(Lost);
        }
        let uart = self.uart.get_mut();
        match uart.read_ready() {
            Ok(true) => match poll_once(uart.read(buffer)) {
                core::task::Poll::Ready(read) => read.map_err(|_| Lost),
                core::task::Poll::Pending => Ok(0),
            },
            Ok(false) => Ok(0),
            Err(_) => Err(Lost),
        }
    }

    fn is_idle(&self) -> bool {
        let uart = self.uart.try_borrow_mut();
        uart.is_ok_and(|mut uart| matches!(uart.read_ready(), Ok(false)))
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.poll();
        if self.left.0 < self.left.1 || message.len() > LONGEST {
            return Err(Full);
        }
        let taken = Self::write(self.uart.get_mut(), message);
        if taken == 0 && !message.is_empty() {
            return Err(Full);
        }
        let rest = message.get(taken..).unwrap_or_default();
        for (place, byte) in self.rest.iter_mut().zip(rest) {
            *place = *byte;
        }
        self.left = (0, rest.len());
        Ok(())
    }

    fn poll(&mut self) {
        let (from, to) = self.left;
        if let Some(rest) = self.rest.get(from..to).filter(|rest| !rest.is_empty()) {
            self.left.0 += Self::write(self.uart.get_mut(), rest);
        }
    }
}

impl<U: Uart> Wire for Port<U> {
    async fn arrived(&mut self) {
        let uart = self.uart.get_mut();
        if uart.fill_buf().await.is_err() {
            // `embassy-rp` receives nothing after an error until it is asked to
            uart.consume(0);
            self.lost = true;
        }
    }

    fn open(&mut self, frame: &Frame) {
        self.uart.get_mut().open(frame);
    }
}

#[cfg(feature = "rp")]
impl Uart for embassy_rp::uart::BufferedUart {
    fn open(&mut self, frame: &Frame) {
        self.set_baudrate(frame.baud);
    }
}

#[cfg(feature = "nrf")]
mod nrf {
    use embassy_nrf::buffered_uarte::BufferedUarte;
    use embassy_nrf::uarte::Baudrate;
    use firmware::link::rates::Clock;

    use super::{Frame, Uart};

    /// The rates that the chip has, as its product specification lists them, bit/s (table of the
    /// register BAUDRATE, "actual rate"). It makes no others.
    const RATES: [(u32, Baudrate); 18] = [
        (1_205, Baudrate::Baud1200),
        (2_396, Baudrate::Baud2400),
        (4_808, Baudrate::Baud4800),
        (9_598, Baudrate::Baud9600),
        (14_401, Baudrate::Baud14400),
        (19_208, Baudrate::Baud19200),
        (28_777, Baudrate::Baud28800),
        (31_250, Baudrate::Baud31250),
        (38_369, Baudrate::Baud38400),
        (55_944, Baudrate::Baud56000),
        (57_554, Baudrate::Baud57600),
        (76_923, Baudrate::Baud76800),
        (115_108, Baudrate::Baud115200),
        (231_884, Baudrate::Baud230400),
        (250_000, Baudrate::Baud250000),
        (457_143, Baudrate::Baud460800),
        (941_176, Baudrate::Baud921600),
        (1_000_000, Baudrate::Baud1m),
    ];
    const LISTED: [u32; RATES.len()] = {
        let (mut listed, mut at) = ([0; RATES.len()], 0);
        while at < RATES.len() {
            listed[at] = RATES[at].0;
            at += 1;
        }
        listed
    };

    /// What makes these rates.
    pub const CLOCK: Clock = Clock::of(16_000_000, &LISTED);

    /// The nearest rate of the list.
    pub fn rate(baud: u32) -> Baudrate {
        let nearest = RATES.iter().min_by_key(|(of, _)| of.abs_diff(baud));
        nearest.map_or(Baudrate::Baud115200, |(_, rate)| *rate)
    }

    impl Uart for BufferedUarte<'_> {
        fn open(&mut self, frame: &Frame) {
            self.set_baudrate(rate(frame.baud));
        }
    }
}
#[cfg(feature = "nrf")]
pub use nrf::{CLOCK, rate};
