//! Serial lines that receive what they send. In half-duplex mode the chip connects receiver and
//! transmitter within itself (RM0090 30.3.10), so no jumper is needed and the receiving pins are
//! not tried.

use cortex_m_semihosting::hprintln;
use firmware::app::COMMAND_BAUD;
use firmware::configuration::SerialLines;
use firmware::link::Line;
use stm32f4::stm32f405::Peripherals;

use crate::board::clock::Clocks;
use crate::board::counter;
use crate::board::serial::{self, Port};

/// Each byte once, in no order.
const SENT: [u8; 256] = {
    let mut bytes = [0; 256];
    let mut n = 0;
    while n < 256 {
        bytes[n] = (n as u8).wrapping_mul(167);
        n += 1;
    }
    bytes
};

/// Tries all four lines as they are open without a configuration.
pub fn all(chip: &Peripherals, clocks: &Clocks) {
    let (ports, dma) = serial::open(chip, clocks);
    assert!(dma, "a DMA stream does not keep its configuration");
    // the transmitter lets go of an idle line
    chip.GPIOA
        .pupdr()
        .modify(|_, w| w.pupdr0().pull_up().pupdr2().pull_up());
    chip.GPIOB
        .pupdr()
        .modify(|_, w| w.pupdr6().pull_up().pupdr10().pull_up());
    chip.USART1.cr3().modify(|_, w| w.hdsel().set_bit());
    chip.USART2.cr3().modify(|_, w| w.hdsel().set_bit());
    chip.USART3.cr3().modify(|_, w| w.hdsel().set_bit());
    chip.UART4.cr3().modify(|_, w| w.hdsel().set_bit());
    let (fast, slow) = (
        SerialLines::DEFAULT.sensor_baud,
        SerialLines::DEFAULT.receiver_baud,
    );
    returns("USART1", ports.usart1, fast);
    returns("USART2", ports.usart2, fast);
    returns("USART3", ports.usart3, slow);
    returns("UART4", ports.uart4, COMMAND_BAUD);
}

/// What a line sends comes back, unchanged and at this rate.
fn returns(name: &str, mut port: Port, baud: u32) {
    let byte_us = 10_000_000 / baud;
    let due_us = SENT.len() as u32 * 10_000_000 / baud;
    let mut came = [0; SENT.len()];
    let begun = counter::low();
    while counter::low().wrapping_sub(begun) < 10 * byte_us {
        let _ = port.receive(&mut came); // of the change to half-duplex
    }
    let begun = counter::low();
    let mut lost = port.send(&SENT).is_err();
    let (mut count, mut us) = (0, 0);
    while count < SENT.len() && us < 2 * due_us {
        match port.receive(&mut came[count..]) {
            Ok(more) => count += more,
            Err(_) => lost = true,
        }
        us = counter::low().wrapping_sub(begun);
    }
    hprintln!("{}: {} bytes in {} us", name, count, us);
    let whole = count == SENT.len() && !lost && came == SENT;
    assert!(whole, "lost {lost}; does something hold the TX pin?");
    let off = us.abs_diff(due_us);
    assert!(off <= due_us / 50 + 2 * byte_us, "{due_us} us are due");
}
