//! USART1 at 921 600 bit/s: received into a ring that DMA fills continuously, and sent by DMA.

use chip::{BYTES, LAST, Report, report};
use cortex_m::singleton;
use embassy_stm32::Peripherals;
use embassy_stm32::usart::{Config, Uart};

use crate::Interrupts;
use crate::waiting::wait_for;

/// Sends back [`BYTES`] bytes. The driver delivers the received bytes at each pause of the line,
/// and when half of the ring is full.
pub fn echo(chip: Peripherals) {
    let mut config = Config::default();
    config.baudrate = 921_600;
    let (into, out) = (chip.PA10, chip.PA9);
    let streams = (chip.DMA2_CH7, chip.DMA2_CH2);
    let line = Uart::new(
        chip.USART1,
        into,
        out,
        streams.0,
        streams.1,
        Interrupts,
        config,
    );
    let buffers = (
        singleton!(: [u8; 128] = [0; 128]),
        singleton!(: [u8; BYTES] = [0; BYTES]),
    );
    let (Ok(line), (Some(ring), Some(sent))) = (line, buffers) else {
        return;
    };
    let (mut out, into) = line.split();
    let mut into = into.into_ring_buffered(ring);
    into.start_uart();
    report(Report::Mark, 0);
    let mut count = 0;
    while count < BYTES {
        match wait_for(into.read(&mut sent[count..])) {
            Ok(bytes) => {
                count += bytes;
                report(Report::Read, count as u32);
            }
            Err(_) => return report(Report::Error, 1),
        }
    }
    let end = wait_for(out.write(sent));
    report(Report::Mark, 1);
    let end = end.and_then(|()| out.blocking_write(&[LAST]));
    let flushed = out.blocking_flush();
    report(Report::Error, u32::from(end.is_err() || flushed.is_err()));
    report(Report::Mark, 2);
}
