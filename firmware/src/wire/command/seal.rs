//! Sealed packets: behind the message stand session, counter and authentication code.
//!
//! A sealed packet is `(number, message)` as in every packet, then [`Seal`], then the CRC-32 over
//! all of it. The code covers the challenge of the session, the counter, the number and the whole
//! message. An older device refuses such a packet, because bytes are left over behind the message.

use super::field::{head, put, take};
use super::key::{Challenge, Direction, Secret};
use super::{Error, MAX_PACKET, cobs, crc32_zlib};
use serde::{Deserialize, Serialize};

/// Bytes of a seal.
pub const SEAL_LEN: usize = 28;
const CRC_LEN: usize = 4;

/// The seal of a packet, in the order of its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seal {
    /// [`Challenge::session`].
    pub session: [u8; 4],
    /// Counts the requests of a session from 1; little-endian. A request that is sent again has the
    /// same.
    pub counter: u32,
    /// [`Secret::door`].
    pub door: [u8; 4],
    /// [`Secret::tag`].
    pub tag: [u8; 16],
}

impl Seal {
    fn of(bytes: &[u8]) -> Option<Seal> {
        let bytes: &[u8; SEAL_LEN] = bytes.try_into().ok()?;
        Some(Seal {
            session: take(bytes, 0),
            counter: u32::from_le_bytes(take(bytes, 4)),
            door: take(bytes, 8),
            tag: take(bytes, 12),
        })
    }

    fn bytes(&self) -> [u8; SEAL_LEN] {
        let mut bytes = [0; SEAL_LEN];
        put(&mut bytes, 0, self.session);
        put(&mut bytes, 4, self.counter.to_le_bytes());
        put(&mut bytes, 8, self.door);
        put(&mut bytes, 12, self.tag);
        bytes
    }
}

/// Seals messages.
#[derive(Debug, Clone, Copy)]
pub struct Sealer<'k> {
    /// The key.
    pub secret: &'k Secret,
    /// The session.
    pub challenge: &'k Challenge,
    /// The request's counter, which its answer has too.
    pub counter: u32,
    /// Direction of the message.
    pub direction: Direction,
}

impl Sealer<'_> {
    /// The seal of a message: number and message as encoded. That of an answer has no door.
    #[inline(never)]
    fn seal(&self, coded: &[u8]) -> Seal {
        let (challenge, counter) = (self.challenge, self.counter);
        Seal {
            session: challenge.session(),
            counter,
            door: match self.direction {
                Direction::Request => self.secret.door(challenge, counter),
                Direction::Answer => [0; 4],
            },
            tag: self.secret.tag(self.direction, challenge, counter, coded),
        }
    }
}

/// A packet that was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opened<'b, M> {
    /// Number of the request.
    pub number: u8,
    /// The message.
    pub message: M,
    /// Number and message as encoded: what the authentication code covers.
    pub coded: &'b [u8],
    /// The seal, which is not checked here; `None`: a plain packet.
    pub seal: Option<Seal>,
}

/// Reads a packet, plain or sealed, with or without its zero byte. It is decoded in place, and its
/// message borrows from it.
///
/// # Errors
/// [`Error::Header`] for bytes that are not COBS, [`Error::Checksum`], [`Error::Field`] for a
/// message that this version does not know or that has bytes left over other than a seal.
pub fn open<'b, M: Deserialize<'b>>(packet: &'b mut [u8]) -> Result<Opened<'b, M>, Error> {
    let end = packet
        .iter()
        .position(|&byte| byte == 0)
        .unwrap_or(packet.len());
    let packet = packet.get_mut(..end).unwrap_or_default();
    let len = cobs::decode_in_place(packet).ok_or(Error::Header)?;
    let crc = len.checked_sub(CRC_LEN).ok_or(Error::Header)?;
    let packet: &'b [u8] = packet;
    let checked = packet.get(..crc).unwrap_or_default();
    if crc32_zlib(checked) != u32::from_le_bytes(take(packet, crc)) {
        return Err(Error::Checksum);
    }
    let ((number, message), rest) =
        postcard::take_from_bytes::<(u8, M)>(checked).map_err(|_| Error::Field)?;
    let seal = match rest {
        [] => None,
        rest => Some(Seal::of(rest).ok_or(Error::Field)?),
    };
    let coded = head(checked, checked.len().saturating_sub(rest.len()));
    Ok(Opened {
        number,
        message,
        coded,
        seal,
    })
}

/// Writes a packet, plain or sealed, its zero byte included, and returns it.
///
/// # Errors
/// [`Error::Length`] when it is longer than the buffer or than [`MAX_PACKET`].
pub fn encode_sealed<'b, M: Serialize>(
    number: u8,
    message: &M,
    buffer: &'b mut [u8],
    sealer: Option<&Sealer>,
) -> Result<&'b mut [u8], Error> {
    let mut plain = [0; MAX_PACKET - 2]; // COBS adds a byte in front and the zero behind
    let coded = postcard::to_slice(&(number, message), &mut plain).map_err(|_| Error::Length)?;
    let len = coded.len();
    finish(&mut plain, len, buffer, sealer)
}

/// Puts seal and CRC behind the first `len` bytes, and encodes them.
#[inline(never)]
fn finish<'b>(
    plain: &mut [u8; MAX_PACKET - 2],
    mut len: usize,
    buffer: &'b mut [u8],
    sealer: Option<&Sealer>,
) -> Result<&'b mut [u8], Error> {
    let seal_len = if sealer.is_some() { SEAL_LEN } else { 0 };
    if len + seal_len + CRC_LEN > plain.len() {
        return Err(Error::Length);
    }
    if let Some(sealer) = sealer {
        let seal = sealer.seal(head(plain, len));
        put(plain, len, seal.bytes());
        len += SEAL_LEN;
    }
    let crc = crc32_zlib(head(plain, len));
    put(plain, len, crc.to_le_bytes());
    let len = cobs::encode(head(plain, len + CRC_LEN), buffer).ok_or(Error::Length)?;
    buffer.get_mut(..len).ok_or(Error::Length)
}
