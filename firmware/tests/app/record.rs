//! Configurations of test units, and how a record gets to a device and back.

use crate::device::Device;
use crate::frames::Kind;
use firmware::app::{Config, Hardware};
use firmware::configuration::record::encode;
use firmware::configuration::{Configuration, Sensor};
use firmware::control::Reason;
use firmware::link::rates::Clock;
use firmware::wire::adis;
use firmware::wire::checksum::crc32_zlib;
use firmware::wire::command::{Board, MAX_CHUNK, Request, Response};

/// A board like the STM32F405's.
pub const HARDWARE: Hardware = Hardware {
    name: "a board",
    clocks: [
        Clock::stm32(84_000_000),
        Clock::stm32(42_000_000),
        Clock::stm32(42_000_000),
    ],
    parity: true,
    pin_sets: 2,
    reset: None,
};

pub fn unconfigured() -> Device {
    Device::new(Config::unconfigured(HARDWARE))
}

/// Configuration of a unit with this sensor.
pub fn configured(kind: Kind) -> Configuration {
    let settings = kind.format.settings(&kind.config().sensor);
    let mut configuration = Configuration {
        sensor: Some(Sensor::Stream(settings)),
        rate: kind.rate(),
        ..Configuration::default()
    };
    if kind == Kind::SPI {
        let model = adis::Model::Adis16505(2);
        configuration.sensor = Some(Sensor::Spi(adis::Settings {
            form: model.form(),
            units: model.units(true).expect("a model"),
            framed: true,
        }));
    }
    configuration.correction.block = 0.1;
    configuration.correction.silence_us = 10_000_000; // every answer takes some milliseconds
    configuration
}

pub fn write(device: &mut Device, offset: usize, bytes: &[u8]) {
    device.order(&Request::WriteConfiguration {
        offset: offset as u32,
        bytes,
    });
}

pub fn upload(device: &mut Device, record: &[u8]) {
    for (n, piece) in record.chunks(100).enumerate() {
        write(device, n * 100, piece);
    }
}

pub fn commit(device: &mut Device, length: usize) -> Result<(), Reason> {
    let length = length as u32;
    device.ask(
        &Request::CommitConfiguration { length },
        |answer| match answer {
            Response::Done => Ok(()),
            Response::Refused(reason) => Err(reason),
            other => panic!("{other:?}"),
        },
    )
}

/// Sends a record and commits it.
pub fn configure(device: &mut Device, record: &[u8]) -> Result<(), Reason> {
    upload(device, record);
    commit(device, record.len())
}

/// All bytes that a request gives piece by piece, from an offset on.
pub fn read_all(device: &mut Device, request: impl Fn(u32, u16) -> Request<'static>) -> Vec<u8> {
    let mut all = Vec::new();
    loop {
        let piece = device.ask(
            &request(all.len() as u32, MAX_CHUNK as u16),
            |answer| match answer {
                Response::Image { bytes, .. } => bytes.to_vec(),
                other => panic!("{other:?}"),
            },
        );
        if piece.is_empty() {
            return all;
        }
        all.extend(piece);
    }
}

/// The record in use.
pub fn read(device: &mut Device) -> Vec<u8> {
    read_all(device, |offset, length| Request::ReadConfiguration {
        offset,
        length,
    })
}

/// Asks for the board's description.
pub fn board<T>(device: &mut Device, look: impl FnOnce(&Board) -> T) -> T {
    device.ask(&Request::GetBoard, |answer| match answer {
        Response::Board(board) => look(&board),
        other => panic!("{other:?}"),
    })
}

/// The record with its checksum recomputed.
pub fn sealed(mut record: Vec<u8>) -> Vec<u8> {
    let end = record.len() - 4;
    let sum = crc32_zlib(&record[..end]);
    record[end..].copy_from_slice(&sum.to_le_bytes());
    record
}

pub fn record(configuration: &Configuration) -> Vec<u8> {
    encode(configuration).to_vec()
}
