//! All formats, of IMUs and receivers, for tests that hold for every one.

use super::{Error, Framing, ImuFormat, ReceiverFormat, Scan};
use std::vec::Vec;

/// Frames of a format.
pub(super) trait Examples {
    /// A good frame with a number in it to distinguish frames, and false starts among its data.
    fn example(self, n: u8) -> Vec<u8>;

    /// A frame taken apart into numbers, and made again from these.
    fn remade(self, frame: &[u8]) -> Result<Vec<u8>, Error>;
}

/// Any format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Any {
    /// Format of an IMU.
    Imu(ImuFormat),
    /// Format of a receiver.
    Receiver(ReceiverFormat),
}

/// All formats.
pub(super) fn all() -> Vec<Any> {
    let imus = ImuFormat::ALL.map(Any::Imu).into_iter();
    imus.chain(ReceiverFormat::ALL.map(Any::Receiver)).collect()
}

impl Framing for Any {
    fn scan(self, bytes: &[u8]) -> Scan {
        match self {
            Any::Imu(format) => format.scan(bytes),
            Any::Receiver(format) => format.scan(bytes),
        }
    }

    fn has_start_mark(self) -> bool {
        match self {
            Any::Imu(format) => format.has_start_mark(),
            Any::Receiver(format) => format.has_start_mark(),
        }
    }
}

impl Examples for Any {
    fn example(self, n: u8) -> Vec<u8> {
        match self {
            Any::Imu(format) => format.example(n),
            Any::Receiver(format) => format.example(n),
        }
    }

    fn remade(self, frame: &[u8]) -> Result<Vec<u8>, Error> {
        match self {
            Any::Imu(format) => format.remade(frame),
            Any::Receiver(format) => format.remade(frame),
        }
    }
}

/// The bytes that `emit` writes.
pub(super) fn made(emit: impl FnOnce(&mut [u8]) -> Result<usize, Error>) -> Result<Vec<u8>, Error> {
    let mut buffer = std::vec![0xEE; super::framer::LONGEST];
    let len = emit(&mut buffer)?;
    buffer.truncate(len);
    Ok(buffer)
}
