//! A whole raw IMU log as numbers.

use super::{Frame, Log, PAYLOAD, at, put_values, seal};
use crate::wire::Error;
use crate::wire::field::{put, take};

/// A log's header without the fields that follow from the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Header {
    /// GPS week.
    pub week: u16,
    /// Millisecond of the week.
    pub millisecond: u32,
    /// The rest of a long header; not sent with a short one.
    pub long: LongHeader,
}

/// Fields that only a long header has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LongHeader {
    /// Message type: 0 = binary, measured.
    pub kind: u8,
    /// Port address: 32 = COM1, all virtual addresses together.
    pub port: u8,
    /// Number of logs of this group still to come.
    pub sequence: u16,
    /// Idle time in half per cent.
    pub idle: u8,
    /// 180 = FINESTEERING.
    pub time_status: u8,
    /// Receiver status.
    pub receiver_status: u32,
    /// Definition CRC; 0x0DC5 for RAWIMUX.
    pub definition: u16,
    /// Receiver software build.
    pub software: u16,
}

/// Every field of a raw IMU log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repr {
    /// Kind of the log.
    pub log: Log,
    /// Header.
    pub header: Header,
    /// First four payload bytes: info, IMU type and week, or a 32-bit week.
    pub lead: [u8; 4],
    /// Second of the GPS week.
    pub second_of_week: f64,
    /// The IMU's status word.
    pub status: u32,
    /// Angle increments x, y, z.
    pub gyro: [i32; 3],
    /// Velocity increments x, y, z.
    pub accel: [i32; 3],
}

impl Repr {
    /// Takes a log apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        let bytes = frame.buffer.as_ref();
        let short = frame.log.header_len() == 12;
        let [_, _, _, _, _, _, kind, port] = take(bytes, 0);
        let [idle, time_status] = take(bytes, 12);
        let long = LongHeader {
            kind,
            port,
            sequence: u16::from_le_bytes(take(bytes, 10)),
            idle,
            time_status,
            receiver_status: u32::from_le_bytes(take(bytes, 20)),
            definition: u16::from_le_bytes(take(bytes, 24)),
            software: u16::from_le_bytes(take(bytes, 26)),
        };
        Repr {
            log: frame.log,
            header: Header {
                week: u16::from_le_bytes(take(bytes, if short { 6 } else { 14 })),
                millisecond: u32::from_le_bytes(take(bytes, if short { 8 } else { 16 })),
                long: if short { LongHeader::default() } else { long },
            },
            lead: frame.payload(at::INFO),
            second_of_week: frame.second_of_week(),
            status: frame.status(),
            gyro: frame.gyro(),
            accel: frame.accel(),
        }
    }

    /// Writes the log with its CRC and returns its length.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short; it is then unchanged.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let len = self.log.frame_len();
        let frame = buffer.get_mut(..len).ok_or(Error::Length)?;
        let header = self.log.header_len();
        put(frame, at::ID, self.log.id().to_le_bytes());
        let week = self.header.week.to_le_bytes();
        let millisecond = self.header.millisecond.to_le_bytes();
        if header == 12 {
            put(frame, 0, [0xAA, 0x44, 0x13, PAYLOAD as u8]);
            put(frame, 6, week);
            put(frame, 8, millisecond);
        } else {
            let long = &self.header.long;
            put(frame, 0, [0xAA, 0x44, 0x12, 28]);
            put(frame, 6, [long.kind, long.port, PAYLOAD as u8, 0]);
            put(frame, 10, long.sequence.to_le_bytes());
            put(frame, 12, [long.idle, long.time_status]);
            put(frame, 14, week);
            put(frame, 16, millisecond);
            put(frame, 20, long.receiver_status.to_le_bytes());
            put(frame, 24, long.definition.to_le_bytes());
            put(frame, 26, long.software.to_le_bytes());
        }
        put(frame, header + at::INFO, self.lead);
        put(
            frame,
            header + at::SECOND,
            self.second_of_week.to_le_bytes(),
        );
        put(frame, header + at::STATUS, self.status.to_le_bytes());
        put_values(frame, header + at::ACCEL, self.gyro, self.accel);
        seal(frame);
        Ok(len)
    }
}
