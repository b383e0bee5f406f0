//! The four serial lines: pins, bit rates, interrupts.
//!
//! DMA moves the bytes, and an interrupt comes with the last byte of a frame
//! (`firmware::link::dma`). Where there is no controller (QEMU), an interrupt of some forty
//! instructions moves each byte. In both cases the frame path sleeps until the frame may be
//! complete. **The DMA path has not run on a chip yet**, only in a model written from the same
//! manual (`tests/qemu/judges/stm32f405.py`).
//!
//! The interrupts of a line have the same priority (`interrupts`), so none interrupts another, as
//! `link` requires. Those of the sensor's and the navigation line have the same one, since the
//! sensor's sends what is cut through.

use cortex_m::peripheral::NVIC;
use firmware::configuration::SerialLines;
use firmware::link::cut::Cut;
use firmware::link::dma::Stream as _;
use firmware::link::progress::Progress as _;
use firmware::link::rates::Clock;
use firmware::link::uart::{self, Uart};
use stm32f4::stm32f405::usart1::RegisterBlock;
use stm32f4::stm32f405::{DMA1, DMA2, Interrupt, Peripherals, UART4, USART1, USART2, USART3};

use super::clock::Clocks;
use super::frame::{Frame, set};
use super::pins::{self, EXCHANGED};
use super::stream::{Stream, StreamProgress, reaches};
use crate::shared::cut::{masked, masked_cut};
use crate::shared::wake::wake;

/// The frame path's end of a line.
pub type Port = uart::Port<'static, StreamProgress>;

/// Rounds of waiting until what is to be sent has left, of some twenty cycles each: 20 ms, the time
/// of a full ring at 250 000 bit/s. At a lower rate the rest is lost when the line is reopened.
const PATIENCE: u32 = 170_000;

/// The frame path's ends.
pub struct Ports {
    /// USART1.
    pub usart1: Port,
    /// USART2.
    pub usart2: Port,
    /// USART3.
    pub usart3: Port,
    /// UART4.
    pub uart4: Port,
}

static SENSOR: Uart = Uart::new();
/// Of USART2 and USART3, which [`pins::EXCHANGED`] exchanges.
static NAVIGATION: Uart = Uart::new();
static GNSS: Uart = Uart::new();
static COMMAND: Uart = Uart::new();

/// Opens all four as they are without a configuration; called once. Whether DMA moves their bytes.
pub fn open(peripherals: &Peripherals, clocks: &Clocks) -> (Ports, bool) {
    pins::open(&peripherals.RCC, &peripherals.GPIOA, &peripherals.GPIOB);
    let mut all = true;
    macro_rules! line {
        ($line:ident, $uart:ident, $bus:expr, $frame:expr, $in:ident, $in_interrupt:ident, $out:ident, $out_interrupt:ident, $idle:expr) => {{
            // SAFETY: these registers exist for ever. Those of UART4 are laid out as those of the
            // others (RM0090 30.6.8), and the bits that it does not have stay 0.
            let uart = unsafe { &*$uart::ptr().cast::<RegisterBlock>() };
            let data = uart.dr().as_ptr() as u32;
            let ring = reaches((&raw const $line) as usize);
            let dma = ring && $in().set_up(data) && $out().set_up(data);
            set(uart, Clock::stm32($bus), $frame, dma, $idle);
            for interrupt in [
                Interrupt::$uart,
                Interrupt::$in_interrupt,
                Interrupt::$out_interrupt,
            ] {
                if dma || interrupt == Interrupt::$uart {
                    // SAFETY: what the handlers use is set up, and no critical section relies on a
                    // masked interrupt.
                    unsafe { NVIC::unmask(interrupt) };
                }
            }
            all &= dma;
            let sync = || pend(Interrupt::$in_interrupt); // masked without DMA
            let port = if dma {
                $line.port_over($in().progress(), sync, || pend(Interrupt::$out_interrupt))
            } else {
                $line.port_over($in().progress(), sync, || pend(Interrupt::$uart))
            };
            sync(); // the first transfer
            port
        }};
    }
    let [sensor, navigation, gnss] = &Frame::of(&SerialLines::DEFAULT);
    let Clocks { apb1, apb2, .. } = *clocks;
    let ports = Ports {
        usart1: line!(
            SENSOR,
            USART1,
            apb2,
            sensor,
            usart1_in,
            DMA2_STREAM2,
            usart1_out,
            DMA2_STREAM7,
            false
        ),
        usart2: line!(
            NAVIGATION,
            USART2,
            apb1,
            navigation,
            usart2_in,
            DMA1_STREAM5,
            usart2_out,
            DMA1_STREAM6,
            true
        ),
        usart3: line!(
            GNSS,
            USART3,
            apb1,
            gnss,
            usart3_in,
            DMA1_STREAM1,
            usart3_out,
            DMA1_STREAM3,
            true
        ),
        uart4: line!(
            COMMAND,
            UART4,
            apb1,
            &Frame::COMMAND,
            uart4_in,
            DMA1_STREAM2,
            uart4_out,
            DMA1_STREAM4,
            true
        ),
    };
    let ports = Ports {
        usart2: ports.usart2.with_cut(masked),
        ..ports
    };
    (ports, all)
}

/// The interrupt is served before this returns (PM0214 section 4.3.9: the barriers).
fn pend(interrupt: Interrupt) {
    NVIC::pend(interrupt);
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Reopens USART1 to USART3 where they change from `old` to `new`. The command link goes on.
///
/// What has come stays in its ring. What is to be sent has some time to leave, and the rest is
/// lost. The order: the interrupts are masked, so that only this function touches line and streams;
/// the UART is switched off, then both streams; the rings learn how far the streams had come; all
/// is set up again and switched on; the interrupts are let through, and the first transfer begins.
pub fn reopen(clocks: &Clocks, dma: bool, old: &SerialLines, new: &SerialLines) {
    let lines = lines(clocks);
    let moved = (old.pins == pins::OTHER) != (new.pins == pins::OTHER);
    let frames = Frame::of(old).into_iter().zip(Frame::of(new));
    let cut = old.cut_through != new.cut_through;
    let others = [(moved, cut), (false, cut), (false, false)];
    let lines = lines.iter().enumerate();
    for (((number, line), (was, is)), (moved, cut)) in lines.zip(frames).zip(others) {
        if was != is || moved || cut {
            line.wait();
            let dma = dma && !(new.cut_through && number < 2);
            line.again(&is, dma, moved.then_some(new.pins));
        }
    }
}

/// The navigation computer's UART: USART2, or USART3 if they are exchanged.
fn navigation(lines: &SerialLines) -> usize {
    if lines.pins == EXCHANGED { 2 } else { 1 }
}

/// How many bytes have left on the navigation line since start, and whether more wait.
pub fn sent(lines: &SerialLines) -> (usize, bool) {
    if navigation(lines) == 2 {
        GNSS.sent(usart3_out().left())
    } else {
        NAVIGATION.sent(usart2_out().left())
    }
}

/// Reopens the navigation line, since it does not send. What waits is lost.
pub fn unstick(clocks: &Clocks, lines: &SerialLines) {
    let (all, frames) = (self::lines(clocks), Frame::of(lines));
    let at = navigation(lines);
    if let (Some(line), Some(frame)) = (all.get(at), frames.get(at)) {
        line.again(frame, line.by_dma(), None);
    }
}

/// USART1 to USART3.
fn lines(clocks: &Clocks) -> [Reopened; 3] {
    macro_rules! line {
        ($line:ident, $uart:ident, $bus:expr, $in:ident, $in_interrupt:ident, $out:ident, $out_interrupt:ident) => {
            Reopened {
                line: &$line,
                // SAFETY: the registers exist for ever, and the handlers that use them are masked
                // while these are used.
                uart: unsafe { &*$uart::ptr() },
                clock: Clock::stm32($bus),
                interrupts: [
                    Interrupt::$uart,
                    Interrupt::$in_interrupt,
                    Interrupt::$out_interrupt,
                ],
                stop: || {
                    $out().stop();
                    $in().stop()
                },
            }
        };
    }
    let Clocks { apb1, apb2, .. } = *clocks;
    [
        line!(
            SENSOR,
            USART1,
            apb2,
            usart1_in,
            DMA2_STREAM2,
            usart1_out,
            DMA2_STREAM7
        ),
        line!(
            NAVIGATION,
            USART2,
            apb1,
            usart2_in,
            DMA1_STREAM5,
            usart2_out,
            DMA1_STREAM6
        ),
        line!(
            GNSS,
            USART3,
            apb1,
            usart3_in,
            DMA1_STREAM1,
            usart3_out,
            DMA1_STREAM3
        ),
    ]
}

/// A line that is reopened.
struct Reopened {
    line: &'static Uart,
    uart: &'static RegisterBlock,
    clock: Clock,
    /// Of the UART and of its streams in and out.
    interrupts: [Interrupt; 3],
    /// Stops both streams; returns how many bytes the receiving one has not moved.
    stop: fn() -> usize,
}

/// A line counts as empty after this many looks in a row that find it so.
const LOOKS: u32 = 256;

impl Reopened {
    /// Waits until what is to be sent has left.
    fn wait(&self) {
        let left = || self.line.has_sent() && self.uart.sr().read().tc().bit_is_set();
        let mut looks = 0;
        let _ = (0..PATIENCE).any(|_| {
            // one look is not enough: a burst has lost its last byte after it
            looks = if left() { looks + 1 } else { 0 };
            looks == LOOKS
        });
    }

    /// Whether DMA moves its bytes.
    fn by_dma(&self) -> bool {
        self.uart.cr3().read().dmar().bit_is_set()
    }

    /// `pins`: the set whose pins the sensor's line gets.
    #[inline(never)]
    fn again(&self, frame: &Frame, dma: bool, pins: Option<u8>) {
        let (uart, [_, receives, _]) = (self.uart, self.interrupts);
        self.interrupts.into_iter().for_each(NVIC::mask);
        cortex_m::asm::dsb();
        cortex_m::asm::isb();
        let was_dma = self.by_dma();
        uart.cr1().reset();
        uart.cr3().reset();
        self.line.closed(if was_dma { (self.stop)() } else { 0 });
        if let Some(pins) = pins {
            pins::sensor(pins);
        }
        self.interrupts.into_iter().for_each(NVIC::unpend);
        set(uart, self.clock, frame, dma, true);
        for (number, interrupt) in self.interrupts.into_iter().enumerate() {
            // that of the sending stream is pending when there is something to be sent
            if dma || number != 1 {
                // SAFETY: as in `open`.
                unsafe { NVIC::unmask(interrupt) };
            }
        }
        pend(receives); // the first transfer; masked without DMA
    }
}

/// The streams of a line (RM0090 tables 42 and 43).
macro_rules! streams {
    ($in:ident, $out:ident, $controller:ident, $n_in:literal, $n_out:literal) => {
        fn $in() -> Stream<$n_in, false> {
            // SAFETY: these registers exist for ever. This stream is this line's alone, and after
            // `open` its handlers'.
            Stream::of(unsafe { &*$controller::ptr() })
        }
        fn $out() -> Stream<$n_out, true> {
            // SAFETY: as above.
            Stream::of(unsafe { &*$controller::ptr() })
        }
    };
}

streams!(usart1_in, usart1_out, DMA2, 2, 7);
streams!(usart2_in, usart2_out, DMA1, 5, 6);
streams!(usart3_in, usart3_out, DMA1, 1, 3);
streams!(uart4_in, uart4_out, DMA1, 2, 4);

/// The interrupts of a line: of its two streams, and of its UART.
///
/// The order of reads (status, then data) clears the UART's flags (RM0090 30.6.1).
///
/// With DMA, the UART interrupts at errors, and on some lines when it falls idle, since the number
/// of bytes of a request is not known. Reading the data register clears the flags. The DMA has
/// mostly taken its byte before; else both read the same one. Only when the ring is full the byte
/// is lost, and that is reported.
///
/// Without DMA, the interrupt takes the byte that came, then gives the transmitter what it has room
/// for. The frame path makes the interrupt pending when it has written something. From then on the
/// empty transmitter interrupts by itself.
macro_rules! handlers {
    (
        $name:ident, $uart:ident, $line:ident, $in:ident, $in_handler:ident,
        $out:ident, $out_handler:ident, $came:expr, $lost:expr
    ) => {
        pub extern "C" fn $in_handler() {
            if $line.received_by(&$in()) {
                wake();
            }
        }

        pub extern "C" fn $out_handler() {
            // SAFETY: as below.
            let uart = unsafe { $uart::steal() };
            if uart.cr3().read().dmar().bit_is_set() {
                $line.sent_by(&$out());
            } else {
                NVIC::pend(Interrupt::$uart);
            }
        }

        pub extern "C" fn $name() {
            // SAFETY: after `open` only this handler uses this UART's registers, and of USART2 the
            // one of the sensor's line. They do not interrupt each other. UART4: as in `open`.
            let uart = unsafe { &*$uart::ptr().cast::<RegisterBlock>() };
            let status = uart.sr().read();
            let torn =
                status.fe().bit_is_set() || status.nf().bit_is_set() || status.pe().bit_is_set();
            if uart.cr3().read().dmar().bit_is_set() {
                let _ = uart.dr().read();
                let untaken = status.rxne().bit_is_set() && !$in().is_running();
                if torn || status.ore().bit_is_set() || untaken {
                    $line.lost();
                }
                // a stream that has stopped by itself is set up again
                if status.idle().bit_is_set() || untaken {
                    $line.received_by(&$in());
                }
                return wake();
            }
            if status.rxne().bit_is_set() || status.ore().bit_is_set() {
                let byte = uart.dr().read().dr().bits() as u8; // 8 data bits: the ninth reads 0
                if torn || status.ore().bit_is_set() {
                    $line.lost();
                    $lost();
                    wake();
                }
                if status.rxne().bit_is_set() && !torn && $came(byte) {
                    wake();
                }
            }
            give(uart, &$line);
        }
    };
}

/// Gives the transmitter what it has room for. From then on it asks by an interrupt, until nothing
/// is left.
#[inline(always)]
fn give(uart: &RegisterBlock, line: &Uart) {
    let asks = uart.cr1().read().txeie().bit_is_set();
    while uart.sr().read().txe().bit_is_set() {
        let Some(byte) = line.next() else {
            if asks {
                uart.cr1().modify(|_, w| w.txeie().clear_bit());
            }
            return;
        };
        uart.dr().write(|w| w.dr().set(byte.into()));
    }
    if !asks {
        uart.cr1().modify(|_, w| w.txeie().set_bit());
    }
}

/// A byte of the sensor, whose frames may be cut through. Whether to wake the frame path.
#[inline(always)]
fn sensor_came(byte: u8) -> bool {
    let (woken, sends) = masked_cut(|cut| SENSOR.came_through(byte, cut, &NAVIGATION));
    if sends {
        // SAFETY: as in USART2's handler, which this one does not interrupt.
        let uart = unsafe { &*USART2::ptr() };
        if uart.cr3().read().dmat().bit_is_clear() {
            give(uart, &NAVIGATION);
        } else {
            NVIC::pend(Interrupt::DMA1_STREAM6);
        }
    }
    woken
}

handlers!(
    usart1,
    USART1,
    SENSOR,
    usart1_in,
    usart1_in_end,
    usart1_out,
    usart1_out_end,
    sensor_came,
    || masked_cut(Cut::end)
);
handlers!(
    usart2,
    USART2,
    NAVIGATION,
    usart2_in,
    usart2_in_end,
    usart2_out,
    usart2_out_end,
    |byte| NAVIGATION.came(byte),
    || ()
);
handlers!(
    usart3,
    USART3,
    GNSS,
    usart3_in,
    usart3_in_end,
    usart3_out,
    usart3_out_end,
    |byte| GNSS.came(byte),
    || ()
);
handlers!(
    uart4,
    UART4,
    COMMAND,
    uart4_in,
    uart4_in_end,
    uart4_out,
    uart4_out_end,
    |byte| COMMAND.came(byte),
    || ()
);
