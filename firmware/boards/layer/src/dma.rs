//! Serial lines of STM32s whose bytes DMA moves, over the DMA driver of `embassy-stm32`.
//!
//! **Receiving.** A stream fills a ring and wraps at its end, without an interrupt. The UART
//! interrupts when the line falls idle, once a frame, and the loop reads the ring whenever it
//! looks: where the stream is, and whether it has wrapped since ([`Received`]). The driver's own
//! `ReadableRingBuffer` divides once for each byte, and interrupts twice in each round.
//!
//! **Errors.** The driver's own `RingBufferedUartRx` stops its stream at every error of the line
//! and starts it again without its ring knowing where, and a poll of it reads the data register
//! beside the DMA. So the UART's interrupt is served here: it clears the error and informs the
//! loop, and the stream goes on. How a UART is set up, and the streams, are the driver's.
//!
//! **Sending.** Messages gather in one half of a buffer while the other half leaves in one
//! transfer, which interrupts once, at its end. So no message has a gap.
//!
//! Nothing here waits for the line.

use core::future::{Future, poll_fn};
use core::marker::PhantomData;
use core::mem::transmute;
use core::pin::Pin;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::Poll;

use embassy_stm32::dma::{Channel, InterruptHandler, Transfer, TransferOptions};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::interrupt::typelevel::{self, Interrupt as _};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::usart::Usart;
use embassy_stm32::usart::{Config, Instance, Parity, RxDma, RxPin, StopBits, TxDma, TxPin, Uart};
use embassy_stm32::{Peri, gpio, pac, peripherals};
use embassy_sync::waitqueue::AtomicWaker;
use firmware::link::{Full, Line, Lost};
use firmware::wire::adis::spi::LONGEST;
use static_cell::ConstStaticCell;

mod outgoing;
mod received;

use crate::line::{Frame, RING, Wire};
use outgoing::Outgoing;
use received::Received;

/// Lines that there is memory for.
const LINES: usize = 4;
/// Bytes that wait until those before them have left.
const GATHERED: usize = 512;

/// The buffers of a line that DMA reads and writes.
struct Buffers {
    into: [u8; RING],
    out: [[u8; GATHERED]; 2],
}

impl Buffers {
    const EMPTY: Self = Self {
        into: [0; RING],
        out: [[0; GATHERED]; 2],
    };
}

/// Buffers of all lines in one place, which one region of a Cortex-M7's MPU covers.
#[cfg_attr(feature = "m7", repr(C, align(8192)))]
struct Memory(
    [ConstStaticCell<Buffers>; LINES],
    ConstStaticCell<[u8; LONGEST]>,
);

static MEMORY: Memory = Memory(
    [const { ConstStaticCell::new(Buffers::EMPTY) }; LINES],
    ConstStaticCell::new([0; LONGEST]),
);

/// What DMA moves of a burst ([`crate::spi`]).
pub(crate) fn exchange() -> &'static mut [u8; LONGEST] {
    MEMORY.1.try_take().expect("called once")
}

/// Where the DMA's memory begins, and the binary logarithm of its length in bytes.
#[cfg(feature = "m7")]
pub(crate) fn region() -> (u32, u32) {
    const { assert!(size_of::<Memory>() == 1 << 13 && align_of::<Memory>() == 1 << 13) };
    ((&raw const MEMORY) as u32, 13)
}

/// What a UART's interrupt reports to the loop.
pub struct Events {
    waker: AtomicWaker,
    idle: AtomicBool,
    lost: AtomicBool,
}

impl Events {
    const fn new() -> Self {
        Self {
            waker: AtomicWaker::new(),
            idle: AtomicBool::new(false),
            lost: AtomicBool::new(false),
        }
    }
}

/// A UART of this chip.
pub trait Served: Instance {
    /// Its registers.
    const REGISTERS: Usart;

    /// What its interrupt reports.
    fn events() -> &'static Events;
}

macro_rules! served {
    ($($uart:ident),+) => {
        $(impl Served for peripherals::$uart {
            const REGISTERS: Usart = pac::$uart;

            fn events() -> &'static Events {
                static EVENTS: Events = Events::new();
                &EVENTS
            }
        })+
    };
}
served!(USART1, USART2, USART3, UART4, USART6);
#[cfg(feature = "m7")]
served!(UART7);

/// Serves a UART's interrupt: the line has fallen idle, or a byte came damaged or too early.
#[derive(Debug)]
pub struct Handler<U>(PhantomData<U>);

impl<U: Served> typelevel::Handler<U::Interrupt> for Handler<U> {
    #[allow(unsafe_code, reason = "the trait asks for it; nothing here needs it")]
    unsafe fn on_interrupt() {
        let (idle, lost) = taken(U::REGISTERS);
        let events = U::events();
        if idle {
            events.idle.store(true, Ordering::Release);
        }
        if lost {
            events.lost.store(true, Ordering::Release);
        }
        if idle || lost {
            events.waker.wake();
        }
    }
}

/// Whether the line is idle, and whether bytes were damaged or lost. Clears both: a reading of the
/// data register after the status does (RM0090 30.6.1). The DMA has taken the byte before, in a
/// fraction of the time that an interrupt takes to begin.
#[cfg(not(feature = "m7"))]
fn taken(uart: Usart) -> (bool, bool) {
    let status = uart.sr().read();
    let lost = status.ore() || status.fe() || status.ne() || status.pe();
    if status.idle() || lost {
        let _ = uart.dr().read();
    }
    (status.idle(), lost)
}

/// What has happened at a UART of an F7 or an H7, whose flags are cleared by writing.
#[cfg(feature = "m7")]
fn taken(uart: Usart) -> (bool, bool) {
    let status = uart.isr().read();
    uart.icr().write(|w| {
        w.set_idle(status.idle());
        w.set_ore(status.ore());
        w.set_fe(status.fe());
        w.set_ne(status.ne());
        w.set_pe(status.pe());
    });
    let lost = status.ore() || status.fe() || status.ne() || status.pe();
    (status.idle(), lost)
}

#[cfg(not(feature = "m7"))]
fn data(uart: Usart) -> [*mut u8; 2] {
    [uart.dr().as_ptr().cast(); 2]
}

#[cfg(feature = "m7")]
fn data(uart: Usart) -> [*mut u8; 2] {
    [uart.rdr().as_ptr().cast(), uart.tdr().as_ptr().cast()]
}

/// A line whose bytes DMA moves.
pub struct Port {
    uart: Uart<'static, Blocking>,
    registers: Usart,
    events: &'static Events,
    frame: Frame,
    received: Received,
    /// The stream that fills the ring, for ever.
    _into: Transfer<'static>,
    out: Outgoing,
}

/// [`open`] for these of the board's peripherals: UART, pins in and out, streams in and out, frame.
/// The board's `Interrupts` bind them.
#[macro_export]
macro_rules! line {
    ($of:ident, $uart:ident, $into:ident, $out:ident, $from:ident, $to:ident, $frame:expr) => {
        $crate::dma::open(
            ($of.$uart, $of.$into, $of.$out),
            ($of.$from, $of.$to),
            Interrupts,
            $frame,
        )
    };
}

/// Opens a UART at its pins in and out, with its streams in and out.
///
/// # Panics
/// More lines than [`Buffers`], or a rate that the clocks cannot make.
#[allow(unsafe_code, reason = "the driver's streams take addresses")]
pub fn open<U: Served, I: RxDma<U>, O: TxDma<U>>(
    (uart, into, out): (
        Peri<'static, U>,
        Peri<'static, impl RxPin<U>>,
        Peri<'static, impl TxPin<U>>,
    ),
    (stream_in, stream_out): (Peri<'static, I>, Peri<'static, O>),
    interrupts: impl Binding<U::Interrupt, Handler<U>>
    + Binding<I::Interrupt, InterruptHandler<I>>
    + Binding<O::Interrupt, InterruptHandler<O>>
    + 'static,
    frame: Frame,
) -> Port {
    let buffers = MEMORY.0.iter().find_map(ConstStaticCell::try_take);
    let buffers = buffers.expect("memory for a line");
    let uart = Uart::new_blocking(uart, into, out, config(&frame));
    let uart = uart.expect("a rate that these clocks can make");
    let requests = (stream_in.request(), stream_out.request());
    let [from, to] = data(U::REGISTERS);
    let mut channel = Channel::new(stream_in, interrupts);
    let mut options = TransferOptions::default();
    (options.circular, options.complete_transfer_ir) = (true, false);
    let ring = &raw mut buffers.into;
    // SAFETY: the stream is this line's alone, and moves bytes from its data register. The ring
    // exists for ever.
    let stream = unsafe { channel.read_raw(requests.0, from, ring, options) };
    // SAFETY: a transfer knows its channel by number, and the channel is used for no other.
    let stream = unsafe { transmute::<Transfer<'_>, Transfer<'static>>(stream) };
    let [gathers, leaves] = buffers.out.each_mut();
    let mut port = Port {
        uart,
        registers: U::REGISTERS,
        events: U::events(),
        frame,
        received: Received::new(ring, I::Interrupt::IRQ),
        _into: stream,
        out: Outgoing {
            channel: Channel::new(stream_out, interrupts),
            request: requests.1,
            data: to,
            gathers: gathers.as_mut_slice(),
            gathered: 0,
            leaves: leaves.as_mut_slice(),
            transfer: None,
        },
    };
    port.listen();
    port
}

impl Port {
    /// The streams serve the UART, and it interrupts.
    fn listen(&mut self) {
        let _ = taken(self.registers);
        self.registers.cr3().modify(|w| {
            w.set_dmar(true);
            w.set_dmat(true);
            w.set_eie(true);
        });
        self.registers.cr1().modify(|w| {
            w.set_peie(w.pce());
            w.set_idleie(true);
        });
    }

    fn set(&mut self, frame: &Frame) -> bool {
        let done = self.uart.split_ref().0.set_config(&config(frame)).is_ok();
        self.listen();
        done
    }
}

impl Line for Port {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        if self.events.lost.swap(false, Ordering::Acquire) {
            return Err(Lost);
        }
        self.received.take(buffer)
    }

    fn is_idle(&self) -> bool {
        self.received.is_empty() && !self.events.lost.load(Ordering::Relaxed)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.out.advance();
        self.out.gather(message)?;
        self.out.advance();
        Ok(())
    }

    fn poll(&mut self) {
        self.out.advance();
    }
}

impl Wire for Port {
    fn arrived(&mut self) -> impl Future<Output = ()> {
        poll_fn(|context| {
            self.out.advance();
            if let Some(transfer) = &mut self.out.transfer {
                // its end wakes, and the next one begins
                let _ = Pin::new(transfer).poll(context);
            }
            self.events.waker.register(context.waker());
            if self.events.idle.swap(false, Ordering::Acquire)
                || self.events.lost.load(Ordering::Acquire)
            {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
    }

    fn open(&mut self, frame: &Frame) {
        if self.set(frame) {
            self.frame = *frame;
        } else {
            defmt::println!("a line cannot have {=u32} bit/s", frame.baud);
            self.set(&{ self.frame });
        }
    }
}

/// The settings of a line for the driver, which adds the parity to eight bits. An open line is
/// silent.
fn config(frame: &Frame) -> Config {
    use firmware::configuration::Parity as ConfiguredParity;
    let mut config = Config::default();
    config.baudrate = frame.baud;
    config.rx_pull = gpio::Pull::Up;
    config.parity = match frame.parity {
        ConfiguredParity::None => Parity::ParityNone,
        ConfiguredParity::Even => Parity::ParityEven,
        ConfiguredParity::Odd => Parity::ParityOdd,
    };
    if frame.two_stop_bits {
        config.stop_bits = StopBits::STOP2;
    }
    config
}
