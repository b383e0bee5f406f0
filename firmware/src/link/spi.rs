//! An SPI bus of which this side is the master: what boards share, without their registers.
//!
//! Bytes are exchanged one at a time. The wait for each is a bounded number of readings of the
//! status, so a controller that does not exist, has no clock or has lost its mode gives an error
//! and does not stop the board.

use embedded_hal::spi::{self, ErrorKind, ErrorType, SpiBus};

/// The status of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Status {
    /// A byte to be sent finds room.
    pub room: bool,
    /// A byte has come.
    pub came: bool,
    /// A transfer is under way.
    pub busy: bool,
    /// A byte that came was overrun, or the controller is not master any more. Reading the data and
    /// the status again clears it.
    pub fault: bool,
}

/// A controller's registers.
pub trait Registers {
    /// Reads the status.
    fn status(&mut self) -> Status;

    /// Sends a byte. For each byte sent one comes.
    fn put(&mut self, byte: u8);

    /// The byte that came.
    fn take(&mut self) -> u8;
}

/// Why bytes were not exchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error {
    /// The controller was too slow.
    Late,
    /// The controller reports a fault.
    Fault,
}

impl spi::Error for Error {
    fn kind(&self) -> ErrorKind {
        match self {
            Error::Late => ErrorKind::Other,
            Error::Fault => ErrorKind::Overrun,
        }
    }
}

/// A bus over its registers.
#[derive(Debug)]
pub struct Bus<R> {
    registers: R,
    /// Readings of the status until a byte is given up.
    patience: u32,
}

impl<R: Registers> Bus<R> {
    /// `patience`: readings of the status, more than a byte takes.
    pub fn new(registers: R, patience: u32) -> Bus<R> {
        Bus {
            registers,
            patience,
        }
    }

    /// The registers, for what the bus does not know.
    pub fn registers(&mut self) -> &mut R {
        &mut self.registers
    }

    fn wait(&mut self, ready: impl Fn(Status) -> bool) -> Result<(), Error> {
        for _ in 0..self.patience {
            let status = self.registers.status();
            if status.fault {
                // What came is of no use; the next transfer begins without it.
                self.registers.take();
                self.registers.status();
                return Err(Error::Fault);
            }
            if ready(status) {
                return Ok(());
            }
        }
        Err(Error::Late)
    }

    fn exchange(&mut self, byte: u8) -> Result<u8, Error> {
        // a transfer that was given up may still be under way: its byte is not ours
        self.wait(|status| status.room && !status.busy)?;
        if self.registers.status().came {
            self.registers.take();
        }
        self.registers.put(byte);
        self.wait(|status| status.came)?;
        Ok(self.registers.take())
    }
}

impl<R> ErrorType for Bus<R> {
    type Error = Error;
}

impl<R: Registers> SpiBus for Bus<R> {
    fn read(&mut self, words: &mut [u8]) -> Result<(), Error> {
        words.fill(0);
        self.transfer_in_place(words)
    }

    fn write(&mut self, words: &[u8]) -> Result<(), Error> {
        words.iter().try_for_each(|byte| {
            self.exchange(*byte)?;
            Ok(())
        })
    }

    /// Zeros are sent when there is more to read than to write.
    fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), Error> {
        for at in 0..read.len().max(write.len()) {
            let byte = self.exchange(write.get(at).copied().unwrap_or(0))?;
            if let Some(place) = read.get_mut(at) {
                *place = byte;
            }
        }
        Ok(())
    }

    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Error> {
        words.iter_mut().try_for_each(|byte| {
            *byte = self.exchange(*byte)?;
            Ok(())
        })
    }

    /// Waits until the last clock has gone out, before chip select may rise.
    fn flush(&mut self) -> Result<(), Error> {
        self.wait(|status| !status.busy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// A controller at the level of its registers (RM0090 28.3.5): a byte takes some looks, and one
    /// that is not taken is overrun.
    #[derive(Default)]
    struct Controller {
        /// Looks a byte takes.
        slow: u32,
        left: u32,
        shifting: Option<u8>,
        came: Option<u8>,
        overrun: bool,
        /// Status was read after the data: clears an overrun.
        taken: bool,
        dead: bool,
        sent: Vec<u8>,
    }

    impl Registers for Controller {
        fn status(&mut self) -> Status {
            if core::mem::take(&mut self.taken) {
                self.overrun = false;
            }
            let fault = self.overrun;
            if self.left > 0 && !self.dead {
                self.left -= 1;
            }
            if self.left == 0
                && let Some(byte) = self.shifting.take()
            {
                self.overrun |= self.came.is_some();
                self.came.get_or_insert(!byte); // what the other side says
            }
            Status {
                room: self.shifting.is_none(),
                came: self.came.is_some(),
                busy: self.shifting.is_some(),
                fault,
            }
        }

        fn put(&mut self, byte: u8) {
            assert!(self.shifting.is_none(), "no room");
            self.sent.push(byte);
            self.shifting = Some(byte);
            self.left = self.slow;
        }

        fn take(&mut self) -> u8 {
            self.taken = true;
            self.came.take().unwrap_or(0)
        }
    }

    fn bus(slow: u32) -> Bus<Controller> {
        let controller = Controller {
            slow,
            ..Controller::default()
        };
        Bus::new(controller, 100)
    }

    #[test]
    fn bytes_are_exchanged_whatever_the_clock() {
        for slow in 1..50 {
            let mut bus = bus(slow);
            let mut words = [1, 2, 3];
            assert_eq!(bus.transfer_in_place(&mut words), Ok(()));
            assert_eq!((words, bus.flush()), ([!1, !2, !3], Ok(())));
            assert_eq!(bus.write(&[9, 8]), Ok(()));
            let mut read = [7; 3];
            assert_eq!(bus.read(&mut read), Ok(()));
            assert_eq!(read, [0xFF; 3]);
            let mut short = [0; 1];
            assert_eq!(bus.transfer(&mut short, &[5, 6]), Ok(()));
            let mut long = [0; 2];
            assert_eq!(bus.transfer(&mut long, &[4]), Ok(()));
            assert_eq!((short, long), ([!5], [!4, !0]));
            assert_eq!(bus.registers().sent, [1, 2, 3, 9, 8, 0, 0, 0, 5, 6, 4, 0]);
        }
    }

    #[test]
    fn a_dead_controller_is_late_and_a_slow_one_comes_back() {
        let mut bus = bus(10);
        bus.registers().dead = true;
        assert_eq!(bus.write(&[1]), Err(Error::Late));
        assert_eq!(
            (bus.flush(), bus.write(&[2])),
            (Err(Error::Late), Err(Error::Late))
        );
        bus.registers().dead = false;
        let mut words = [3];
        assert_eq!(bus.transfer_in_place(&mut words), Ok(()));
        assert_eq!(words, [!3], "not the byte that was given up");
    }

    #[test]
    fn a_fault_is_reported_once() {
        let mut bus = bus(1);
        bus.registers().overrun = true;
        assert_eq!(bus.write(&[1]), Err(Error::Fault));
        assert_eq!(bus.write(&[1]), Ok(()));
    }
}
