//! Every byte protocol: makes good frames, and checks the checksum of a message by its definition.

use crate::checksum::{crc16, crc16_reflected, crc32_novatel, fletcher, sum16};
use firmware::control::Mode;
use firmware::wire::command::{MAX_PACKET, Request, encode};
use firmware::wire::framer::LONGEST;
use firmware::wire::ubx::Pvt;
use firmware::wire::{Fields, ImuFormat, ReceiverFormat, Settings, Simulated};
use rand::{Rng, RngExt};

/// A protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// A protocol of an IMU.
    Imu(ImuFormat),
    /// A protocol of a receiver.
    Receiver(ReceiverFormat),
    /// The command link, in the direction to the device.
    Command,
}

/// All protocols.
pub fn all() -> Vec<Protocol> {
    let imus = ImuFormat::ALL.map(Protocol::Imu).into_iter();
    let receivers = ReceiverFormat::ALL.map(Protocol::Receiver);
    imus.chain(receivers).chain([Protocol::Command]).collect()
}

/// A protocol as sent by one sensor.
#[derive(Debug, Clone, Copy)]
pub struct Speaker {
    /// The protocol, with the layout of its frames.
    pub protocol: Protocol,
    sensor: Option<&'static Simulated>,
}

impl Protocol {
    /// Its name: lower case, without spaces.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Imu(format) => format.name(),
            Protocol::Receiver(ReceiverFormat::Ubx) => "ubx",
            Protocol::Receiver(ReceiverFormat::Nmea) => "nmea",
            Protocol::Receiver(ReceiverFormat::Novatel) => "novatel-best",
            Protocol::Receiver(ReceiverFormat::Sbf) => "sbf",
            Protocol::Command => "command",
        }
    }

    /// Length of the checksum, bits.
    pub fn bits(self) -> u32 {
        match self {
            Protocol::Imu(
                ImuFormat::Stim300 | ImuFormat::Kvh | ImuFormat::Novatel | ImuFormat::AdisUart,
            )
            | Protocol::Receiver(ReceiverFormat::Novatel)
            | Protocol::Command => 32,
            Protocol::Imu(ImuFormat::Xsens) | Protocol::Receiver(ReceiverFormat::Nmea) => 8,
            Protocol::Imu(_) | Protocol::Receiver(_) => 16,
        }
    }

    /// Whether the checksum is a sum or an exclusive or: it misses errors that cancel and exchanged
    /// pieces more often than its length suggests.
    pub fn is_sum(self) -> bool {
        matches!(
            self,
            Protocol::Imu(ImuFormat::Hg4930 | ImuFormat::Epson(_) | ImuFormat::Xsens)
                | Protocol::Receiver(ReceiverFormat::Ubx | ReceiverFormat::Nmea)
        )
    }

    /// The `n`th of the sensors with this protocol, cyclically.
    pub fn speaker(self, n: usize) -> Speaker {
        let Protocol::Imu(format) = self else {
            let (protocol, sensor) = (self, None);
            return Speaker { protocol, sensor };
        };
        let sensors = format.simulated();
        let sensor = &sensors[n % sensors.len()];
        let protocol = Protocol::Imu(format.configured(&sensor.settings()));
        let sensor = Some(sensor);
        Speaker { protocol, sensor }
    }

    /// Whether the checksum of what was accepted as a frame is right by its definition. A 32-bit
    /// checksum is never right by accident.
    pub fn is_right(self, frame: &[u8]) -> bool {
        match self {
            Protocol::Imu(format) => imu_is_right(format, frame),
            Protocol::Receiver(format) => receiver_is_right(format, frame),
            Protocol::Command => false,
        }
    }
}

fn imu_is_right(format: ImuFormat, frame: &[u8]) -> bool {
    let len = frame.len();
    match (format, frame) {
        (ImuFormat::Hg4930, [summed @ .., a, b]) => {
            sum16(summed, u16::from_le_bytes) == u16::from_le_bytes([*a, *b])
        }
        (ImuFormat::SbgEcom, [0xFF, 0x5A, summed @ .., a, b, 0x33]) => {
            crc16_reflected(0x8408, 0, summed) == u16::from_le_bytes([*a, *b])
        }
        (ImuFormat::Epson(_), [0x80, summed @ .., a, b, 0x0D]) => {
            sum16(summed, u16::from_be_bytes) == u16::from_be_bytes([*a, *b])
        }
        (ImuFormat::VectorNav(_), [0xFA, summed @ ..]) => crc16(0x1021, 0, summed) == 0,
        (ImuFormat::Mavlink(_), [mark, ..]) => {
            let (payload, signature) = match (mark, frame.get(2)) {
                (0xFD, Some(1)) => (10, 13),
                (0xFD, Some(0)) => (10, 0),
                (0xFE, _) => (6, 0),
                _ => return false,
            };
            let crc = payload + usize::from(frame[1]);
            if len != crc + 2 + signature {
                return false;
            }
            let mut summed = frame[1..crc].to_vec();
            summed.push(93); // CRC_EXTRA of HIGHRES_IMU
            crc16_reflected(0x8408, 0xFFFF, &summed).to_le_bytes() == frame[crc..crc + 2]
        }
        (ImuFormat::Xsens, [0xFA, summed @ ..]) => {
            summed.iter().map(|&byte| u32::from(byte)).sum::<u32>() % 256 == 0
        }
        _ => false,
    }
}

fn receiver_is_right(format: ReceiverFormat, frame: &[u8]) -> bool {
    match (format, frame) {
        (ReceiverFormat::Ubx, [0xB5, 0x62, summed @ .., a, b]) => fletcher(summed) == [*a, *b],
        (
            ReceiverFormat::Nmea,
            [b'$', text @ .., b'*', a, b, b'\r', b'\n']
            | [b'$', text @ .., b'*', a, b, b'\r' | b'\n']
            | [b'$', text @ .., b'*', a, b],
        ) => {
            let sum = text.iter().fold(0, |sum, byte| sum ^ byte);
            format!("{sum:02X}")
                .as_bytes()
                .eq_ignore_ascii_case(&[*a, *b])
        }
        (ReceiverFormat::Sbf, [b'$', b'@', a, b, summed @ ..]) => {
            crc16(0x1021, 0, summed) == u16::from_le_bytes([*a, *b])
        }
        _ => false,
    }
}

impl Speaker {
    /// The settings of a device for this sensor.
    pub fn settings(&self) -> Settings {
        self.sensor.map_or(Settings::DEFAULT, Simulated::settings)
    }

    /// Its `n`th good frame, with random values.
    pub fn frame(&self, n: u32, rng: &mut impl Rng) -> Vec<u8> {
        match (self.protocol, self.sensor) {
            (Protocol::Imu(_), Some(sensor)) => imu(sensor, n, rng),
            (Protocol::Receiver(format), _) => receiver(format, n, rng),
            _ => packet(n as u8, rng),
        }
    }
}

fn imu(sensor: &Simulated, n: u32, rng: &mut impl Rng) -> Vec<u8> {
    let mut triad = |shift: u32| [(); 3].map(|()| rng.random::<i32>() >> shift);
    let shift = 32 - sensor.bits;
    let fields = Fields {
        index: n,
        time: f64::from(n) / f64::from(sensor.rate),
        gyro: triad(shift),
        accel: triad(shift),
        rest: sensor.rest,
    };
    let mut buffer = [0; LONGEST];
    let len = (sensor.emit)(&fields, &mut buffer).expect("room for a frame");
    buffer[..len].to_vec()
}

/// A BESTPOS of `NovAtel`'s encoder, without its CRC.
const BESTPOS: [u8; 28] = [
    0xaa, 0x44, 0x12, 0x1c, 42, 0, 0x00, 0xa0, 72, 0, 0, 0, 0x82, 0xb4, 0xa1, 0x08, 0x88, 0x69,
    0x14, 0x1d, 0x20, 0, 0, 0, 0x29, 0x2c, 0x2a, 0x94,
];

fn receiver(format: ReceiverFormat, n: u32, rng: &mut impl Rng) -> Vec<u8> {
    match format {
        ReceiverFormat::Ubx => {
            let pvt = Pvt {
                time_of_week: n.wrapping_mul(100),
                fix: 3,
                flags: 1,
                longitude: rng.random(),
                latitude: rng.random(),
                height: rng.random(),
                ..Pvt::default()
            };
            pvt.emit().to_vec()
        }
        ReceiverFormat::Nmea => {
            let text = format!(
                "GNGGA,{:02}{:02}{:02}.00,{:02}{:02}.{:05},N,{:03}{:02}.{:05},E,2,12,0.98,{}.6,M,48.1,M,,",
                n / 3600 % 24,
                n / 60 % 60,
                n % 60,
                rng.random_range(0..90),
                rng.random_range(0..60),
                rng.random_range(0..100_000),
                rng.random_range(0..180),
                rng.random_range(0..60),
                rng.random_range(0..100_000),
                rng.random_range(0..9000),
            );
            let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
            format!("${text}*{sum:02X}\r\n").into_bytes()
        }
        ReceiverFormat::Novatel => {
            let mut log = BESTPOS.to_vec();
            log[6] = 0; // binary
            log.extend((0..72).map(|_| rng.random::<u8>()));
            let crc = crc32_novatel(&log);
            log.extend(crc.to_le_bytes());
            log
        }
        ReceiverFormat::Sbf => {
            let mut block = vec![b'$', b'@', 0, 0, 0xA7, 0x4F, 96, 0]; // PVTGeodetic, revision 2
            block.extend(n.wrapping_mul(100).to_le_bytes());
            block.extend((12..96).map(|_| rng.random::<u8>()));
            let crc = crc16(0x1021, 0, &block[4..]);
            block[2..4].copy_from_slice(&crc.to_le_bytes());
            block
        }
    }
}

fn packet(n: u8, rng: &mut impl Rng) -> Vec<u8> {
    let mut bytes = [0; 128];
    rng.fill(&mut bytes);
    let bytes = &bytes[..rng.random_range(0..=128)];
    let offset = rng.random_range(0..600);
    let request = match rng.random_range(0..6) {
        0 => Request::GetHealth,
        1 => Request::SetMode(Mode::Frozen),
        2 => Request::WriteImage { offset, bytes },
        3 => Request::CommitImage { length: offset },
        4 => Request::ReadImage {
            offset,
            length: 128,
        },
        _ => Request::WriteConfiguration { offset, bytes },
    };
    let mut buffer = [0; MAX_PACKET];
    encode(n, &request, &mut buffer)
        .expect("room for a packet")
        .to_vec()
}
