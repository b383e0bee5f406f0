//! The MCAP container (<https://mcap.dev/spec>, version 0): records with an operation code and a
//! length, most of them in chunks that may be compressed.
//!
//! The file is read once from front to back, and only the wanted messages are held in memory.
//! Camera images of gigabytes are skipped. The index at the end of the file is not used, so a file
//! without one (power cut) reads as well.

use crate::recordings::input::Input;
use crate::recordings::zstd::{Frames, is_zstd};
use flate2::Crc;
use host_core::error::Error;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Read};

/// First bytes of a file; the `0` is the version.
pub(super) const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

/// Longest schema, channel and wanted message that is read, bytes. The messages of interest have
/// some hundred bytes, schemas some thousand.
const LONGEST: u64 = 1 << 24;

/// A stream of messages: its topic, and how they are written.
#[derive(Debug, Clone, Default)]
pub(super) struct Channel {
    /// Name of the topic.
    pub(super) topic: String,
    /// Name of the message type, for example `sensor_msgs/msg/Imu`.
    pub(super) schema: String,
    /// `cdr` in ROS 2.
    pub(super) encoding: String,
}

/// A message.
pub(super) struct Message<'a> {
    pub(super) channel: &'a Channel,
    /// When the recorder received it, ns.
    pub(super) log_time: u64,
    pub(super) data: &'a [u8],
}

/// End of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    /// With the end mark: the file is whole.
    Whole,
    /// Without the end mark, after this number of bytes.
    Cut(u64),
}

/// Why reading stops.
#[derive(Debug)]
pub(super) enum Stop {
    /// The bytes end, or cannot be decompressed.
    Io(io::Error),
    /// The bytes violate the format: rest of a sentence that begins with the location, and remedy.
    Bad(String, &'static str),
    /// The receiver of messages refuses one.
    Refused(Error),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Remedy for a damaged file.
pub(super) const RECOVER: &str =
    "run 'mcap recover FILE -o GOOD.mcap' (mcap.dev) and give GOOD.mcap";

fn damaged(what: impl Into<String>) -> Stop {
    Stop::Bad(what.into(), RECOVER)
}

/// Reads the messages of a file in order.
pub(super) struct Walk<'a> {
    /// Whether messages of a channel are wanted. It is asked once for each channel.
    pub(super) wanted: &'a mut dyn FnMut(&Channel) -> bool,
    /// Takes a wanted message.
    pub(super) take: &'a mut dyn FnMut(&Message<'_>) -> Result<(), Error>,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, (Channel, bool)>,
    buffer: Vec<u8>,
}

impl<'a> Walk<'a> {
    pub(super) fn new(
        wanted: &'a mut dyn FnMut(&Channel) -> bool,
        take: &'a mut dyn FnMut(&Message<'_>) -> Result<(), Error>,
    ) -> Self {
        Self {
            wanted,
            take,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            buffer: Vec::new(),
        }
    }

    /// Reads a file from its first byte to the mark of its end. `input` counts the bytes, so that
    /// the caller can name the location of an error.
    pub(super) fn file(&mut self, input: &mut Input<'_>) -> Result<Ending, Stop> {
        let mut magic = [0; 8];
        let whole = input.read_exact(&mut magic);
        if whole.is_err() || magic != MAGIC {
            let remedy = "give an MCAP file; other bags become one with 'ros2 bag convert'";
            return Err(Stop::Bad("is no MCAP file of version 0".into(), remedy));
        }
        loop {
            input.ended = false;
            match self.record_of_file(input) {
                Ok(true) => {}
                Ok(false) => return Ok(Ending::Whole),
                Err(Stop::Io(_)) if input.ended => return Ok(Ending::Cut(input.at)),
                Err(stop) => return Err(stop),
            }
        }
    }

    /// One record outside of chunks; false at the mark of the end.
    fn record_of_file(&mut self, input: &mut Input<'_>) -> Result<bool, Stop> {
        let (operation, length) = head(input)?;
        match operation {
            0x02 | 0x0F => return Ok(false),
            0x06 => self.chunk(&mut input.take(length))?,
            _ => self.record(operation, length, input)?,
        }
        Ok(true)
    }

    fn chunk(&mut self, bytes: &mut io::Take<&mut Input<'_>>) -> Result<(), Stop> {
        skip(bytes, 16)?;
        let size = u64::from_le_bytes(array(bytes)?);
        let sum = u32::from_le_bytes(array(bytes)?);
        let compression = string(bytes)?;
        let length = u64::from_le_bytes(array(bytes)?);
        if length != bytes.limit() {
            return Err(damaged("holds a chunk whose two lengths differ"));
        }
        match compression.as_str() {
            "" => self.records(&mut *bytes, size, sum)?,
            "lz4" => self.records(lz4_flex::frame::FrameDecoder::new(&mut *bytes), size, sum)?,
            "zstd" => self.records(Frames::new(&mut *bytes), size, sum)?,
            other => {
                let problem = format!("holds a chunk compressed with '{other}'");
                let remedy = "run 'mcap compress FILE -o NEW.mcap --compression zstd' (mcap.dev)";
                return Err(Stop::Bad(problem, remedy));
            }
        }
        let rest = bytes.limit();
        skip(bytes, rest)
    }

    /// The records of a chunk of `size` bytes.
    fn records(&mut self, bytes: impl Read, size: u64, sum: u32) -> Result<(), Stop> {
        let mut summed = Summed {
            bytes: bytes.take(size),
            sum: Crc::new(),
        };
        while summed.bytes.limit() > 0 {
            let (operation, length) = head(&mut summed)?;
            if length > summed.bytes.limit() {
                return Err(damaged("holds a record that is longer than its chunk"));
            }
            self.record(operation, length, &mut summed)?;
        }
        // A checksum of 0 means that the writer made none.
        if sum != 0 && sum != summed.sum.sum() {
            return Err(damaged("holds a chunk with a wrong check sum"));
        }
        Ok(())
    }

    /// A record that is no chunk.
    fn record(&mut self, operation: u8, length: u64, bytes: &mut impl Read) -> Result<(), Stop> {
        match operation {
            0 => return Err(damaged("holds zeros where a record must begin")),
            0x03 => {
                self.fill(length, bytes)?;
                let rest = &mut &self.buffer[..];
                let id = u16::from_le_bytes(array(rest)?);
                self.schemas.insert(id, string(rest)?);
            }
            0x04 => self.channel(length, bytes)?,
            0x05 => self.message(length, bytes)?,
            _ => skip(bytes, length)?,
        }
        Ok(())
    }

    fn channel(&mut self, length: u64, bytes: &mut impl Read) -> Result<(), Stop> {
        self.fill(length, bytes)?;
        let rest = &mut &self.buffer[..];
        let id = u16::from_le_bytes(array(rest)?);
        let schema = u16::from_le_bytes(array(rest)?);
        let channel = Channel {
            topic: string(rest)?,
            encoding: string(rest)?,
            schema: self.schemas.get(&schema).cloned().unwrap_or_default(),
        };
        if !self.channels.contains_key(&id) {
            let wanted = (self.wanted)(&channel);
            self.channels.insert(id, (channel, wanted));
        }
        Ok(())
    }

    fn message(&mut self, length: u64, bytes: &mut impl Read) -> Result<(), Stop> {
        let Some(size) = length.checked_sub(22) else {
            return Err(damaged("holds a message that is too short"));
        };
        let id = u16::from_le_bytes(array(bytes)?);
        skip(bytes, 4)?; // number of the message
        let log_time = u64::from_le_bytes(array(bytes)?);
        skip(bytes, 8)?; // when the sender published it
        if !self.channels.get(&id).is_some_and(|(_, wanted)| *wanted) {
            return skip(bytes, size);
        }
        self.fill(size, bytes)?;
        let Some((channel, _)) = self.channels.get(&id) else {
            return Ok(());
        };
        let message = Message {
            channel,
            log_time,
            data: &self.buffer,
        };
        (self.take)(&message).map_err(Stop::Refused)
    }

    /// Reads `length` bytes into the buffer.
    fn fill(&mut self, length: u64, bytes: &mut impl Read) -> Result<(), Stop> {
        if length > LONGEST {
            return Err(damaged(format!("holds a record of {length} bytes")));
        }
        self.buffer.clear();
        if bytes.take(length).read_to_end(&mut self.buffer)? as u64 == length {
            Ok(())
        } else {
            Err(io::Error::from(ErrorKind::UnexpectedEof).into())
        }
    }
}

/// The content of a message that rosbag2 has compressed by itself (its compression mode MESSAGE).
pub(super) fn unpacked(data: &[u8]) -> Option<Vec<u8>> {
    is_zstd(data).then_some(())?;
    let mut out = Vec::new();
    let content = Frames::new(data).take(LONGEST).read_to_end(&mut out);
    content.ok()?;
    Some(out)
}

/// Computes the checksum of the bytes that are read.
struct Summed<R> {
    bytes: io::Take<R>,
    sum: Crc,
}

impl<R: Read> Read for Summed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        self.sum.update(&buffer[..count]);
        Ok(count)
    }
}

/// Operation code and length of a record.
fn head(bytes: &mut impl Read) -> io::Result<(u8, u64)> {
    let [operation] = array(bytes)?;
    Ok((operation, u64::from_le_bytes(array(bytes)?)))
}

fn array<const N: usize>(bytes: &mut impl Read) -> io::Result<[u8; N]> {
    let mut out = [0; N];
    bytes.read_exact(&mut out)?;
    Ok(out)
}

/// A string with its length in front.
fn string(bytes: &mut impl Read) -> io::Result<String> {
    let length = u64::from(u32::from_le_bytes(array(bytes)?));
    let mut out = Vec::new();
    if length > LONGEST || bytes.take(length).read_to_end(&mut out)? as u64 != length {
        return Err(ErrorKind::UnexpectedEof.into());
    }
    Ok(String::from_utf8_lossy(&out).into_owned())
}

fn skip(bytes: &mut impl Read, length: u64) -> Result<(), Stop> {
    if io::copy(&mut bytes.take(length), &mut io::sink())? == length {
        Ok(())
    } else {
        Err(io::Error::from(ErrorKind::UnexpectedEof).into())
    }
}
