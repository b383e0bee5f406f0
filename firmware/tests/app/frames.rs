//! Frames of every kind that carries inertial words, by number.

use firmware::app::{Config, Kvh};
use firmware::sample::RawSample;
use firmware::wire::novatel::ImuType;
use firmware::wire::stim300::config::Config as Stim300;
use firmware::wire::{Format, Framer, framer, hg4930, kvh, novatel, read, stim300};

/// Words, any status and any other fields of a frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fields {
    pub gyro: [i32; 3],
    pub accel: [i32; 3],
    /// Everything that is not a word, a counter or a time.
    pub rest: u32,
}

/// A kind of stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Identifier, gyro and accelerometer unit codes.
    Stim300(u8, u8, u8),
    /// Layout, delta angle.
    Kvh(kvh::Layout, bool),
    Novatel(novatel::Log),
    Hg4930,
    SClass,
}

pub const KINDS: [Kind; 14] = [
    Kind::Stim300(0x91, 1, 1),
    Kind::Stim300(0x90, 1, 1),
    Kind::Stim300(0xA7, 0, 0),
    Kind::Stim300(0xF7, 2, 2),
    Kind::Stim300(0xAF, 1, 0),
    Kind::Kvh(kvh::Layout::A, true),
    Kind::Kvh(kvh::Layout::B, false),
    Kind::Kvh(kvh::Layout::C, true),
    Kind::Novatel(novatel::Log::Rawimu),
    Kind::Novatel(novatel::Log::Rawimus),
    Kind::Novatel(novatel::Log::Rawimux),
    Kind::Novatel(novatel::Log::Rawimusx),
    Kind::Hg4930,
    Kind::SClass,
];

impl Kind {
    pub fn format(self) -> Format {
        match self {
            Kind::Stim300(..) => Format::Stim300,
            Kind::Kvh(..) => Format::Kvh,
            Kind::Novatel(_) => Format::Novatel,
            Kind::Hg4930 | Kind::SClass => Format::Hg4930,
        }
    }

    /// A configuration that knows what the stream does not tell.
    pub fn config(self) -> Config {
        let (gyro, accel) = match self {
            Kind::Stim300(_, gyro, accel) => (gyro, accel),
            _ => (1, 1),
        };
        Config {
            format: Some(self.format()),
            stim300: Stim300::DEFAULT.with_unit_codes(gyro, accel),
            kvh: Kvh {
                delta: matches!(self, Kind::Kvh(_, true)),
                degrees: false,
            },
            imu_type: ImuType(11),
            ask: false,
            ..Config::default()
        }
    }

    /// Words a second.
    pub fn rate(self) -> f64 {
        match self {
            Kind::Stim300(..) | Kind::Kvh(..) => 1000.0,
            Kind::Novatel(_) | Kind::Hg4930 => 100.0,
            Kind::SClass => 3600.0,
        }
    }

    /// The `n`th frame. KVH words are 2^-20 of the fields'.
    pub fn frame(self, n: u32, fields: Fields) -> Vec<u8> {
        let mut buffer = [0; 80];
        let rest = fields.rest;
        let len = match self {
            Kind::Stim300(id, ..) => stim300_frame(id, n, fields).emit(&mut buffer),
            Kind::Kvh(layout, _) => kvh::Repr {
                layout,
                gyro: fields.gyro.map(|w| w as f32 * 9.536_743e-7),
                accel: fields.accel.map(|w| w as f32 * 9.536_743e-7),
                extra: rest.to_be_bytes(),
                status: 0x77,
                sequence: (n % 128) as u8,
                temperature: rest as i16,
            }
            .emit(&mut buffer),
            Kind::Novatel(log) => novatel::Repr {
                log,
                header: novatel::Header::default(),
                lead: [0, 11, rest as u8, (rest >> 8) as u8],
                second_of_week: 1000.0 + f64::from(n) / 100.0,
                status: 0,
                gyro: fields.gyro,
                accel: fields.accel,
            }
            .emit(&mut buffer),
            Kind::Hg4930 | Kind::SClass => {
                let narrow = |words: [i32; 3]| words.map(|w| w as i16);
                hg4930::Repr {
                    message: if self == Kind::Hg4930 {
                        hg4930::Message::Inertial
                    } else {
                        hg4930::Message::SClass
                    },
                    rate: narrow(fields.gyro),
                    accel: narrow(fields.accel),
                    status_1: (n & 3) as u16,
                    status_2: 0x8000 | (rest & 0x3F) as u16,
                    angle: fields.gyro,
                    velocity: fields.accel,
                }
                .emit(&mut buffer)
            }
        };
        buffer[..len.expect("room for any frame")].to_vec()
    }

    /// Frames `from..to` with plausible small words.
    pub fn stream(self, from: u32, to: u32) -> Vec<Vec<u8>> {
        let fields = |n: u32| Fields {
            gyro: [n as i32 % 50 - 20, 7, -(n as i32 % 11)],
            accel: [3, -(n as i32 % 13), 900],
            rest: n.wrapping_mul(2_654_435_761),
        };
        (from..to).map(|n| self.frame(n, fields(n))).collect()
    }
}

fn stim300_frame(id: u8, n: u32, fields: Fields) -> stim300::Repr {
    let contents = stim300::Contents::from_id(id).expect("a measurement");
    let rest = fields.rest;
    let cluster = |words| stim300::Cluster { words, status: 0 };
    stim300::Repr {
        contents,
        gyro: cluster(fields.gyro),
        accel: cluster(fields.accel),
        incl: stim300::Cluster {
            words: [5, 6, 7],
            status: rest as u8,
        },
        temperatures: [stim300::Temperatures {
            words: [rest as i16, -1, 2],
            status: (rest >> 16) as u8,
        }; 3],
        extra: (rest >> 8, rest as u8),
        counter: (2 * n % 256) as u8,
        latency_us: (rest % 1000) as u16,
    }
}

/// All good frames of a format in a stream.
pub fn frames_in(format: Format, bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut framer = Framer::new(format);
    let mut found = Vec::new();
    for piece in bytes.chunks(64) {
        framer.push(piece);
        while let Some(event) = framer.next_event() {
            if event.kind() == framer::Kind::Frame {
                found.push(event.bytes().to_vec());
            }
        }
    }
    found
}

/// The six words as numbers.
pub fn words(format: Format, frame: &[u8]) -> [f64; 6] {
    let reading = read(format, frame).expect("a good frame");
    let [[a, b, c], [d, e, f]] = match reading.words {
        RawSample::Counts { gyro, accel } => [gyro, accel].map(|w| w.map(f64::from)),
        RawSample::Floats { gyro, accel } => [gyro, accel].map(|w| w.map(f64::from)),
    };
    [a, b, c, d, e, f]
}
