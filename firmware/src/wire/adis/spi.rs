//! Fetches ADIS bursts over `embedded_hal::spi::SpiDevice`.
//!
//! SPI mode 3, most significant byte first. Two words read a register: one names it and the next
//! one carries the answer, with chip select up and the stall time between them. A burst is one
//! transaction: command, then reply.

use super::BURST_1649X_LEN;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;
use serde::{Deserialize, Serialize};

/// Between two register words, microseconds (Linux adis16475: 5 + 16; `ArduPilot`: 20).
pub const STALL_US: u32 = 21;

/// Registers of the 1646x, 1647x and 1650x, and of the 1649x where it says so.
pub mod register {
    /// Gyro range.
    pub const RANGE: u8 = 0x5E;
    /// 1649x: the page of all other addresses.
    pub const PAGE: u8 = 0x00;
    /// 1649x, page 0.
    pub const PRODUCT_ID_1649X: u8 = 0x7E;
    /// 1649x, page 3: output rate 4250 Hz / (this + 1).
    pub const DEC_RATE_1649X: u8 = 0x0C;
    /// 1649x, page 3: gyro range.
    pub const RANGE_1649X: u8 = 0x12;
    /// Sync and data-ready options; bit 8 BURST_SEL, bit 9 BURST32.
    pub const MSC_CTRL: u8 = 0x60;
    /// Output rate 2000 Hz / (this + 1).
    pub const DEC_RATE: u8 = 0x64;
    /// 16470, 16475, 16507, ...
    pub const PRODUCT_ID: u8 = 0x72;
}

/// The forms of burst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Form {
    /// 1646x, 1647x, 1650x; clock at most 1 MHz.
    Narrow,
    /// A burst with BURST32 set.
    Wide,
    /// 1649x; clock at most 6 MHz.
    Adis1649x,
}

impl Form {
    /// Fastest clock for a burst, Hz.
    pub fn clock_hz(self) -> u32 {
        match self {
            Form::Narrow | Form::Wide => 1_000_000,
            Form::Adis1649x => 6_000_000,
        }
    }

    /// First byte of the command for a burst, and with it the bytes of the exchange. Its other
    /// bytes are 0.
    pub fn exchange(self) -> (u8, usize) {
        let command = match self {
            Form::Narrow | Form::Wide => 0x68,
            Form::Adis1649x => 0x7C,
        };
        (command, 2 + self.bytes())
    }
}

/// The longest exchange: a command and the longest reply.
pub const LONGEST: usize = 2 + BURST_1649X_LEN;

/// One ADIS sensor.
#[derive(Debug)]
pub struct Adis<S> {
    spi: S,
    form: Form,
}

impl<S: SpiDevice> Adis<S> {
    /// A sensor whose chip select is `spi`'s.
    pub fn new(spi: S, form: Form) -> Adis<S> {
        Adis { spi, form }
    }

    /// Fetches one burst as bytes, for `App::burst`, which checks them. Call it when data-ready
    /// rises, and within one sample period: there is no FIFO.
    ///
    /// # Errors
    /// The bus's.
    pub fn fetch<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Result<&'b mut [u8], S::Error> {
        let (command, length) = self.form.exchange();
        let frame = frame.get_mut(..length).unwrap_or_default();
        frame.fill(0);
        if let Some(first) = frame.first_mut() {
            *first = command;
        }
        self.spi.transfer_in_place(frame)?;
        Ok(frame.get_mut(2..).unwrap_or_default())
    }

    /// Reads one 16-bit register.
    ///
    /// # Errors
    /// The bus's.
    #[inline(never)] // many callers, and slow anyway
    pub fn read_register(
        &mut self,
        delay: &mut impl DelayNs,
        address: u8,
    ) -> Result<u16, S::Error> {
        self.spi.write(&[address, 0])?;
        delay.delay_us(STALL_US);
        let mut word = [0; 2];
        self.spi.read(&mut word)?;
        delay.delay_us(STALL_US);
        Ok(u16::from_be_bytes(word))
    }

    /// Writes one 16-bit register, byte by byte as the sensor requires.
    ///
    /// # Errors
    /// The bus's.
    pub fn write_register(
        &mut self,
        delay: &mut impl DelayNs,
        address: u8,
        value: u16,
    ) -> Result<(), S::Error> {
        let [low, high] = value.to_le_bytes();
        self.write_byte(delay, address, low)?;
        self.write_byte(delay, address.wrapping_add(1), high)
    }

    /// Writes one byte of a register: the page of a 1649x has only one.
    ///
    /// # Errors
    /// The bus's.
    #[inline(never)]
    pub fn write_byte(
        &mut self,
        delay: &mut impl DelayNs,
        address: u8,
        byte: u8,
    ) -> Result<(), S::Error> {
        self.spi.write(&[0x80 | address, byte])?;
        delay.delay_us(STALL_US);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::adis::Burst;
    use crate::wire::{Error, field::take};
    use core::cell::Cell;
    use core::convert::Infallible;
    use embedded_hal::spi::{ErrorType, Operation};

    /// A 1650x as its register map, stricter than the part: it answers only after the stall time
    /// has passed, and counts every breach.
    struct Sensor<'a> {
        registers: [u8; 128],
        burst: Burst,
        answer: [u8; 2],
        clock_us: &'a Cell<u32>,
        free_at: u32,
        breaches: u32,
    }

    impl ErrorType for &mut Sensor<'_> {
        type Error = Infallible;
    }

    impl SpiDevice for &mut Sensor<'_> {
        fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
            assert_eq!(operations.len(), 1, "chip select framing");
            self.breaches += u32::from(self.clock_us.get() < self.free_at);
            match &mut operations[0] {
                Operation::Write([address, value]) if *address & 0x80 != 0 => {
                    self.registers[usize::from(*address & 0x7F)] = *value;
                }
                Operation::Write([address, _]) => {
                    let at = usize::from(*address);
                    self.answer = [self.registers[at + 1], self.registers[at]];
                }
                Operation::Read(word) => word.copy_from_slice(&self.answer),
                Operation::TransferInPlace(frame) => self.reply(frame),
                other => unreachable!("{other:?}"),
            }
            self.free_at = self.clock_us.get() + 16;
            Ok(())
        }
    }

    impl Sensor<'_> {
        fn reply(&mut self, frame: &mut [u8]) {
            let wide = self.registers[usize::from(register::MSC_CTRL) + 1] & 0x02 != 0;
            match (&frame[..2], frame.len(), wide) {
                ([0x68, 0], 22, false) => frame[2..].copy_from_slice(&self.burst.emit16()),
                ([0x68, 0], 34, true) => frame[2..].copy_from_slice(&self.burst.emit32()),
                ([0x7C, 0], 42, _) => frame[2..].copy_from_slice(&self.burst.emit_1649x(true)),
                // wrong length for the mode: the part sends what it has
                _ => frame[2..].fill(0xFF),
            }
            frame[..2].fill(0);
        }
    }

    struct Clock<'a>(&'a Cell<u32>);

    impl DelayNs for Clock<'_> {
        fn delay_ns(&mut self, ns: u32) {
            self.0.set(self.0.get() + ns.div_ceil(1000));
        }
    }

    const BURST: Burst = Burst {
        diagnosis: 0,
        gyro: [1, -2, 3],
        accel: [400, -500, 600],
        temperature: 250,
        counter: 0xFFFF,
    };

    fn sensor(clock_us: &Cell<u32>) -> Sensor<'_> {
        Sensor {
            registers: [0; 128],
            burst: BURST,
            answer: [0; 2],
            clock_us,
            free_at: 0,
            breaches: 0,
        }
    }

    #[test]
    fn registers_and_all_bursts() {
        let time = Cell::new(0);
        let mut sensor = sensor(&time);
        let mut delay = Clock(&time);
        sensor.registers[0x72..0x74].copy_from_slice(&16507u16.to_le_bytes());

        let mut adis = Adis::new(&mut sensor, Form::Narrow);
        let product = adis.read_register(&mut delay, register::PRODUCT_ID);
        assert_eq!(product, Ok(16507));
        let mut frame = [0; LONGEST];
        assert_eq!(adis.fetch(&mut frame), Ok(&mut BURST.emit16()[..]));
        time.set(time.get() + 500);
        adis.write_register(&mut delay, register::MSC_CTRL, 0x02C1)
            .unwrap();
        assert_eq!(
            adis.read_register(&mut delay, register::MSC_CTRL),
            Ok(0x02C1)
        );
        // the mode changed under the driver: found out, not misread
        let burst = adis.fetch(&mut frame).unwrap();
        assert_eq!(Burst::parse16(&take(burst, 0)), Err(Error::Checksum));
        time.set(time.get() + 500);

        let mut adis = Adis::new(&mut sensor, Form::Wide);
        assert_eq!(adis.fetch(&mut frame), Ok(&mut BURST.emit32()[..]));
        time.set(time.get() + 500);
        let mut adis = Adis::new(&mut sensor, Form::Adis1649x);
        assert_eq!(adis.fetch(&mut frame), Ok(&mut BURST.emit_1649x(true)[..]));
        assert_eq!(sensor.breaches, 0);
    }

    #[test]
    fn a_broken_bus_is_an_error() {
        struct Broken;
        impl ErrorType for Broken {
            type Error = embedded_hal::spi::ErrorKind;
        }
        impl SpiDevice for Broken {
            fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
                Err(embedded_hal::spi::ErrorKind::Other)
            }
        }
        let mut adis = Adis::new(Broken, Form::Wide);
        let failure = embedded_hal::spi::ErrorKind::Other;
        assert_eq!(adis.fetch(&mut [0; LONGEST]), Err(failure));
    }
}
