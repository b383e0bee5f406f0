//! USART1 at 921 600 bit/s: two receive buffers, which DMA fills in turn, and one to send.

use chip::{BYTES, LAST, Report, report};
use cortex_m::singleton;
use stm32f4xx_hal::dma::config::DmaConfig;
use stm32f4xx_hal::dma::{DMAError, StreamsTuple, Transfer};
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::Serial;
use stm32f4xx_hal::serial::config::{self, DmaConfig as Dma};
use stm32f4xx_hal::{ReadFlags, block};

/// Bytes of each of the two buffers.
pub const HALF: usize = 64;

/// Sends back [`BYTES`] bytes. The number of received bytes is reported at each pause of the line.
pub fn echo(chip: pac::Peripherals) {
    let mut rcc = chip.RCC.freeze(Config::hse(12.MHz()).sysclk(168.MHz()));
    let port = chip.GPIOA.split(&mut rcc);
    let set = config::Config::default()
        .baudrate(921_600.bps())
        .dma(Dma::TxRx);
    let Ok(line) = Serial::new(chip.USART1, (port.pa9, port.pa10), set, &mut rcc) else {
        return;
    };
    let (out, mut into) = line.split();
    into.listen_idle();
    let streams = StreamsTuple::new(chip.DMA2, &mut rcc);
    let buffers = (
        singleton!(: [u8; HALF] = [0; HALF]),
        singleton!(: [u8; HALF] = [0; HALF]),
        singleton!(: [u8; HALF] = [0; HALF]),
        singleton!(: [u8; BYTES] = [0; BYTES]),
    );
    let (Some(first), Some(second), Some(third), Some(sent)) = buffers else {
        return;
    };
    let each = DmaConfig::default().memory_increment(true);
    let ring = each.double_buffer(true).transfer_complete_interrupt(true);
    let mut coming =
        Transfer::init_peripheral_to_memory(streams.2, into, first, Some(second), ring);
    coming.start(|_| {});
    report(Report::Mark, 0);
    let (mut spare, mut count, mut idle) = (Some(third), 0, 0);
    while count + HALF - usize::from(coming.number_of_transfers()) < BYTES {
        if coming.flags().is_transfer_complete()
            && let Some(next) = spare.take()
        {
            match coming.next_transfer(next) {
                Ok((full, _)) => {
                    sent[count..count + HALF].copy_from_slice(&full[..]);
                    count += HALF;
                    spare = Some(full);
                }
                Err(DMAError::NotReady(kept) | DMAError::SmallBuffer(kept)) => spare = Some(kept),
                Err(DMAError::Overrun(_)) => return report(Report::Error, 1),
            }
        }
        if coming.is_idle() {
            coming.clear_idle_interrupt();
            idle += 1;
            let here = count + HALF - usize::from(coming.number_of_transfers());
            report(Report::Read, here as u32);
        }
    }
    report(Report::Idle, idle);
    // the buffers are filled in turn, and the last one is not full
    let (_, _, first, second) = coming.release();
    if let Some(rest) = if (count / HALF).is_multiple_of(2) {
        Some(first)
    } else {
        second
    } {
        sent[count..].copy_from_slice(&rest[..BYTES - count]);
    }
    let mut going = Transfer::init_memory_to_peripheral(streams.7, out, sent, None, each);
    going.start(|_| {});
    going.wait();
    report(Report::Mark, 1);
    let (_, mut out, ..) = going.release();
    let end = block!(out.write(LAST)).and_then(|()| block!(out.flush()));
    report(Report::Error, u32::from(end.is_err()));
    report(Report::Mark, 2);
}
