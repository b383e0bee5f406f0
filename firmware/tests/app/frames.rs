//! Frames of every kind that carries inertial values, by number.

use firmware::app::Config;
use firmware::sample::RawSample;
use firmware::wire::stim300::config::Config as Stim300;
use firmware::wire::vectornav::Values;
use firmware::wire::{Checked, Framer, ImuFormat, Simulated, framer};

pub use firmware::wire::Fields;

/// A kind of stream: one of the sensors that a format lists as examples.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    pub format: ImuFormat,
    pub sensor: &'static Simulated,
}

impl PartialEq for Kind {
    fn eq(&self, other: &Kind) -> bool {
        self.sensor.name == other.sensor.name
    }
}

const FRAMED: &Simulated = &ImuFormat::AdisUart.simulated()[0];

/// All kinds.
pub fn kinds() -> Vec<Kind> {
    let of = |format: ImuFormat| {
        let sensors = format.simulated().iter();
        sensors.map(move |sensor| Kind {
            format: format.configured(&sensor.settings()),
            sensor,
        })
    };
    ImuFormat::ALL.into_iter().flat_map(of).collect()
}

impl Kind {
    /// STIM300, increments at 1000 Hz, by its identifier.
    pub const STIM: Kind = Kind::of(ImuFormat::Stim300, 1);
    pub const STIM_F7: Kind = Kind::of(ImuFormat::Stim300, 4);
    pub const STIM_AF: Kind = Kind::of(ImuFormat::Stim300, 5);
    /// KVH A, increments.
    pub const KVH: Kind = Kind::of(ImuFormat::Kvh, 1);
    pub const RAWIMUSX: Kind = Kind::of(ImuFormat::Novatel, 4);
    pub const HG4930: Kind = Kind::of(ImuFormat::Hg4930, 0);
    pub const S_CLASS: Kind = Kind::of(ImuFormat::Hg4930, 1);
    /// Increments.
    pub const VECTORNAV: Kind = Kind::of(ImuFormat::VectorNav(Values::Sensors), 0);

    /// An ADIS at the SPI, at 100 Hz. Its frames are those in which its bursts leave.
    pub const SPI: Kind = Kind {
        format: ImuFormat::AdisUart,
        sensor: &Simulated {
            name: "ADIS16505-2 at the SPI",
            rate: 100,
            unit: [10.0 * FRAMED.unit[0], 10.0 * FRAMED.unit[1]],
            ..*FRAMED
        },
    };

    const fn of(format: ImuFormat, sensor: usize) -> Kind {
        let sensor = &format.simulated()[sensor];
        Kind { format, sensor }
    }

    /// A configuration with the settings that the stream does not contain.
    pub fn config(self) -> Config {
        let mut sensor = self.sensor.settings();
        sensor.stim300.ask = false;
        Config {
            format: Some(self.format),
            sensor,
            ..Config::default()
        }
    }

    /// Samples a second.
    pub fn rate(self) -> f64 {
        f64::from(self.sensor.rate)
    }

    /// The `n`th frame.
    pub fn frame(self, n: u32, fields: Fields) -> Vec<u8> {
        let fields = Fields {
            index: n,
            time: 1000.0 + f64::from(n) / self.rate(),
            ..fields
        };
        let mut buffer = [0; framer::LONGEST];
        let len = (self.sensor.emit)(&fields, &mut buffer);
        buffer[..len.expect("room for any frame")].to_vec()
    }

    /// Frames `from..to` with plausible small values.
    pub fn stream(self, from: u32, to: u32) -> Vec<Vec<u8>> {
        let fields = |n: u32| Fields {
            gyro: [n as i32 % 50 - 20, 7, -(n as i32 % 11)],
            accel: [3, -(n as i32 % 13), 900],
            rest: n.wrapping_mul(2_654_435_761),
            ..Fields::default()
        };
        (from..to).map(|n| self.frame(n, fields(n))).collect()
    }
}

/// A STIM300 whose values have these unit codes.
pub fn stim300_units(config: Config, gyro: u8, accel: u8) -> Config {
    let mut config = config;
    config.sensor.stim300.config = Stim300::DEFAULT.with_unit_codes(gyro, accel);
    config
}

/// All good frames of a format in a stream.
pub fn frames_in(format: ImuFormat, bytes: &[u8]) -> Vec<Vec<u8>> {
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

/// The six values as numbers.
pub fn values(format: ImuFormat, frame: &[u8]) -> [f64; 6] {
    let mut frame = frame.to_vec();
    let checked = Checked::new(format, &mut frame).expect("a good frame");
    let [[a, b, c], [d, e, f]] = match checked.read().expect("values").sample {
        RawSample::Counts { gyro, accel } => [gyro, accel].map(|w| w.map(f64::from)),
        RawSample::Floats { gyro, accel } => [gyro, accel].map(|w| w.map(f64::from)),
    };
    [a, b, c, d, e, f]
}
