//! A DMA controller whose other end is the program itself. The registers are in memory and are used
//! by the STM32F405 board's own stream driver. [`came`] and [`left`] move the bytes; their cost is
//! measured in a calibration and subtracted ([`Wires::let_through`]).

use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::NVIC;
use firmware::link::uart::Uart;
use stm32f4::stm32f405::dma2::RegisterBlock;

use super::interrupts::{AWAKE, Line, unmask, woken};
use super::stream::{Stream, StreamProgress};
use super::ticks;
use crate::replay::Wires;

static SENSOR: Uart = Uart::new();
static NAVIGATION: Uart = Uart::new();

/// Registers: four words for all streams, then six for each (RM0090 10.5.11).
const WORDS: usize = 4 + 8 * 6;
const _: () = assert!(size_of::<RegisterBlock>() == 4 * WORDS);
static REGISTERS: [AtomicU32; WORDS] = [const { AtomicU32::new(0) }; WORDS];

/// Numbers of the streams, as on the board, where they are of two controllers.
const SENSOR_IN: usize = 2;
const NAVIGATION_OUT: usize = 7;
const NAVIGATION_IN: usize = 5;

/// Offsets of a stream's registers, words.
const CONFIGURATION: usize = 0;
const COUNT: usize = 1;
const ADDRESS: usize = 3;
/// Bits of the configuration register.
const ENABLED: u32 = 1;

/// Size of a transfer in the calibration, which has fewer bytes.
static REHEARSED: [AtomicU8; 512] = [const { AtomicU8::new(0) }; 512];

fn controller() -> &'static RegisterBlock {
    // SAFETY: as large and as aligned, there for ever; both sides' access is atomic or volatile,
    // from one core.
    unsafe { &*REGISTERS.as_ptr().cast() }
}

fn register<const N: usize>(word: usize) -> &'static AtomicU32 {
    &REGISTERS[4 + 6 * N + word]
}

fn sensor_stream() -> Stream<SENSOR_IN, false> {
    Stream::of(controller())
}

fn out_stream() -> Stream<NAVIGATION_OUT, true> {
    Stream::of(controller())
}

fn in_stream() -> Stream<NAVIGATION_IN, false> {
    Stream::of(controller())
}

/// The lines. Their interrupts are still masked, and both streams have a transfer for the
/// calibration.
pub fn wires() -> Wires<'static, StreamProgress> {
    use firmware::link::dma::Stream as _;
    sensor_stream().arm(&REHEARSED);
    out_stream().arm(&REHEARSED);
    Wires {
        sensor: &SENSOR,
        navigation: &NAVIGATION,
        streams: [sensor_stream().progress(), in_stream().progress()],
        pend: [
            || pend(Line::SensorIn),
            || pend(Line::NavigationIn),
            || pend(Line::NavigationOut),
        ],
        came,
        left,
        ticks,
        let_through: Some(let_through),
    }
}

fn let_through() {
    use firmware::link::dma::Stream as _;
    sensor_stream().stop();
    out_stream().stop();
    unmask(&[Line::SensorIn, Line::NavigationOut, Line::NavigationIn]);
    pend(Line::SensorIn); // the first transfers
    pend(Line::NavigationIn);
}

fn pend(line: Line) {
    NVIC::pend(line);
    dsb();
    isb();
}

/// Moves one byte and returns it; `None` without a transfer. The end of a transfer interrupts.
#[inline(always)]
fn moved<const N: usize>(line: Line, byte: impl FnOnce(&AtomicU8) -> u8) -> Option<u8> {
    if register::<N>(CONFIGURATION).load(Ordering::Relaxed) & ENABLED == 0 {
        return None;
    }
    let address = register::<N>(ADDRESS).load(Ordering::Relaxed);
    register::<N>(ADDRESS).store(address + 1, Ordering::Relaxed);
    let cell = core::ptr::with_exposed_provenance::<AtomicU8>(address as usize);
    // SAFETY: the driver armed the stream with memory that exists for ever, and at most `COUNT`
    // bytes of it are accessed.
    let byte = byte(unsafe { &*cell });
    let left = register::<N>(COUNT).load(Ordering::Relaxed) - 1;
    register::<N>(COUNT).store(left, Ordering::Relaxed);
    if left == 0 {
        let configuration = register::<N>(CONFIGURATION).load(Ordering::Relaxed);
        register::<N>(CONFIGURATION).store(configuration & !ENABLED, Ordering::Relaxed);
        NVIC::pend(line);
        isb(); // it is served here
    }
    Some(byte)
}

fn came(_: &Uart, byte: u8) -> bool {
    let _ = moved::<SENSOR_IN>(Line::SensorIn, |cell| {
        cell.store(byte, Ordering::Relaxed);
        byte
    });
    woken()
}

fn left(_: &Uart) -> Option<u8> {
    moved::<NAVIGATION_OUT>(Line::NavigationOut, |cell| cell.load(Ordering::Relaxed))
}

// As the board's handlers.

pub(super) extern "C" fn sensor_in() {
    if SENSOR.received_by(&sensor_stream()) {
        AWAKE.store(true, Ordering::Relaxed);
    }
}

pub(super) extern "C" fn navigation_out() {
    NAVIGATION.sent_by(&out_stream());
}

pub(super) extern "C" fn navigation_in() {
    if NAVIGATION.received_by(&in_stream()) {
        AWAKE.store(true, Ordering::Relaxed);
    }
}
