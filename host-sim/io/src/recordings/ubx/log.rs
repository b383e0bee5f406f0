//! Finds UBX messages in a log. Other bytes (NMEA, RTCM, damage) are skipped.
//!
//! The decoder of the firmware ([`firmware::wire::ubx`]) reads NAV-PVT, so a replay tests it, too.
//! Of the other messages, the sensor fusion messages of dead-reckoning receivers (u-blox M8 and F9
//! interface descriptions, as pyubx2 reads them) hold the samples. Numbers are little-endian:
//!
//! ```text
//! ESF-RAW   10 03 | 4 reserved | then each: data u32, time tag u32
//! ESF-MEAS  10 02 | time tag, ms, u32 | flags u16: count << 11 | id u16 | then each: data u32 ...
//! data      type << 24 | value, 24 bits, signed
//! ```

use super::KINDS;
use crate::recordings::input::Input;
use firmware::wire::Scan;
use firmware::wire::ubx::{self, Pvt};
use std::io::{self, Read};

const ESF_MEAS: [u8; 2] = [0x10, 0x02];
const ESF_RAW: [u8; 2] = [0x10, 0x03];
/// Longest message that is accepted, bytes. Raw observations of all satellites are shorter.
const LONGEST: usize = 8192;
/// Bytes read at once.
const PIECE: u64 = 1 << 16;

/// The measurement of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Measured {
    /// Time tag on the clock of the sensor.
    pub(super) tag: u32,
    /// 14, 13, 5: gyro x, y, z, 2^-12 deg/s; 16, 17, 18: accelerometer x, y, z, 2^-10 m/s2.
    pub(super) kind: u8,
    pub(super) value: i32,
}

/// Content of a log, in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Log {
    /// Fixes, each with the numbers of raw and plain measurements before it.
    pub(super) fixes: Vec<(Pvt, [usize; 2])>,
    /// ESF-RAW.
    pub(super) raw: Vec<Measured>,
    /// ESF-MEAS.
    pub(super) plain: Vec<Measured>,
    /// Whole messages.
    pub(super) messages: usize,
    /// Bytes that begin like a message and are none.
    pub(super) damaged: usize,
    /// Whether the log ends within a message.
    pub(super) cut: bool,
}

impl Log {
    /// Reads a log to its end.
    ///
    /// # Errors
    /// It cannot be read or unpacked.
    pub(super) fn read(input: &mut Input<'_>) -> io::Result<Self> {
        let mut log = Self::default();
        let mut bytes = Vec::new();
        loop {
            let more = match Read::by_ref(input).take(PIECE).read_to_end(&mut bytes) {
                Err(_) if input.ended => {
                    log.cut = true;
                    0
                }
                more => more?,
            };
            let used = log.messages(&bytes, more == 0);
            bytes.drain(..used);
            if more == 0 {
                return Ok(log);
            }
        }
    }

    /// Takes the messages in `bytes` and returns how many bytes are done with. At the `end` of the
    /// log nothing is left over.
    fn messages(&mut self, bytes: &[u8], end: bool) -> usize {
        let mut at = 0;
        loop {
            let Some(rest) = bytes.get(at..).filter(|rest| !rest.is_empty()) else {
                return at;
            };
            at += match ubx::scan(rest) {
                Scan::Frame(length) | Scan::Other(length) => {
                    self.message(&rest[..length.min(rest.len())]);
                    length.max(1)
                }
                Scan::Partial(length) if !end && length <= LONGEST => return at,
                Scan::Partial(length) => {
                    self.cut |= end && length > 2;
                    1
                }
                Scan::BadChecksum => {
                    self.damaged += 1;
                    1
                }
                _ => 1,
            };
        }
    }

    /// A message whose checksum is right.
    fn message(&mut self, bytes: &[u8]) {
        self.messages += 1;
        let Some((head, rest)) = bytes.split_first_chunk::<6>() else {
            return;
        };
        let payload = &rest[..rest.len().saturating_sub(2)];
        match [head[2], head[3]] {
            ESF_RAW => {
                let all = payload.get(4..).unwrap_or_default().chunks_exact(8);
                let all = all.filter_map(|pair| {
                    let (data, tag) = pair.split_first_chunk()?;
                    Some(measured(*data, u32::from_le_bytes(tag.try_into().ok()?)))
                });
                self.raw.extend(all.filter(is_inertial));
            }
            ESF_MEAS => {
                let Some((&[t0, t1, t2, t3, _, flags, _, _], data)) = payload.split_first_chunk()
                else {
                    return;
                };
                let tag = u32::from_le_bytes([t0, t1, t2, t3]);
                let all = data.chunks_exact(4).take(usize::from(flags >> 3));
                let all = all.filter_map(|data| Some(measured(data.try_into().ok()?, tag)));
                self.plain.extend(all.filter(is_inertial));
            }
            _ => {
                if let Ok(pvt) = Pvt::parse(bytes) {
                    self.fixes.push((pvt, [self.raw.len(), self.plain.len()]));
                }
            }
        }
    }
}

/// Whether it is of the gyros or accelerometers. Others, such as a host's wheel ticks, may have the
/// tags of another clock.
fn is_inertial(measured: &Measured) -> bool {
    KINDS.contains(&measured.kind)
}

fn measured(data: [u8; 4], tag: u32) -> Measured {
    let data = u32::from_le_bytes(data);
    Measured {
        tag,
        kind: (data >> 24) as u8,
        value: (data as i32) << 8 >> 8,
    }
}
