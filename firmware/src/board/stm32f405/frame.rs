//! Bit rate, parity and stop bits of USART1 to USART3 (RM0090 section 30.6).

use firmware::app::COMMAND_BAUD;
use firmware::configuration::{Parity, SerialLines};
use firmware::link::rates::{Clock, LOOKS};
use stm32f4::stm32f405::usart1::RegisterBlock;

use super::pins::EXCHANGED;

/// How a line is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    baud: u32,
    parity: Parity,
    two_stop_bits: bool,
}

impl Frame {
    /// Of the command link.
    pub const COMMAND: Frame = Frame {
        baud: COMMAND_BAUD,
        parity: Parity::None,
        two_stop_bits: false,
    };

    /// Of USART1, USART2 and USART3. A receiver has neither parity nor a second stop bit.
    pub fn of(lines: &SerialLines) -> [Frame; 3] {
        let sensor = Frame {
            baud: lines.sensor_baud,
            parity: lines.parity,
            two_stop_bits: lines.two_stop_bits,
        };
        let receiver = Frame {
            baud: lines.receiver_baud,
            parity: Parity::None,
            two_stop_bits: false,
        };
        if lines.pins == EXCHANGED {
            [sensor, receiver, sensor]
        } else {
            [sensor, sensor, receiver]
        }
    }
}

/// Sets a line up that is switched off, and switches it on; `dma`: its bytes are moved by DMA, and
/// `idle`: it interrupts when it falls idle. A rate that the clock cannot make becomes the nearest,
/// which fault BIT_RATE reports.
///
/// With parity a word has nine bits, of which the ninth is the parity (30.3.7); the data register
/// then gives it as its ninth bit, which nobody reads.
pub fn set(uart: &RegisterBlock, clock: Clock, frame: &Frame, dma: bool, idle: bool) {
    let divider = clock.nearest(frame.baud).divider;
    let eight = divider < LOOKS;
    uart.brr().write(|w| {
        if eight {
            // three bits of fraction; the fourth stays 0 (30.6.3)
            w.div_mantissa().set((divider >> 3) as u16);
            w.div_fraction().set((divider & 0x7) as u8)
        } else {
            // Mantissa and fraction together are clock / rate (30.3.4).
            w.div_mantissa().set((divider >> 4) as u16);
            w.div_fraction().set((divider & 0xf) as u8)
        }
    });
    uart.cr2().write(|w| {
        if frame.two_stop_bits {
            w.stop().stop2()
        } else {
            w.stop().stop1()
        }
    });
    // What was there from before: reading status, then data, clears it.
    let _ = uart.sr().read();
    let _ = uart.dr().read();
    if dma {
        // The requests first, then the UART. EIE makes errors interrupt and needs DMAR (30.4).
        uart.cr3()
            .write(|w| w.dmar().set_bit().dmat().set_bit().eie().set_bit());
    }
    let parity = frame.parity != Parity::None;
    uart.cr1().write(|w| {
        w.over8().bit(eight);
        w.m().bit(parity).pce().bit(parity).peie().bit(parity);
        w.ps().bit(frame.parity == Parity::Odd);
        w.ue().set_bit().te().set_bit().re().set_bit();
        w.rxneie().bit(!dma).idleie().bit(dma && idle)
    });
}
