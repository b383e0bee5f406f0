//! Packets of the command link.

use super::MAX_PACKET;
use super::seal::{Opened, encode_sealed, open};
use crate::wire::Error;
use serde::{Deserialize, Serialize};

/// Writes a packet, its zero byte included, and returns it.
///
/// # Errors
/// [`Error::Length`] when it is longer than the buffer or than [`MAX_PACKET`], which suffices for
/// chunks of [`MAX_CHUNK`](super::MAX_CHUNK).
pub fn encode<'b, M: Serialize>(
    number: u8,
    message: &M,
    buffer: &'b mut [u8],
) -> Result<&'b mut [u8], Error> {
    encode_sealed(number, message, buffer, None)
}

/// Reads a plain packet, with or without its zero byte. It is decoded in place, and its message
/// borrows from it.
///
/// # Errors
/// [`Error::Header`] for bytes that are not COBS, [`Error::Checksum`], [`Error::Field`] for a
/// message that this version does not know or that has bytes left over, a seal for example.
pub fn decode<'b, M: Deserialize<'b>>(packet: &'b mut [u8]) -> Result<(u8, M), Error> {
    match open(packet)? {
        Opened {
            number,
            message,
            seal: None,
            ..
        } => Ok((number, message)),
        _ => Err(Error::Field),
    }
}

/// Gathers a line's bytes into packets.
#[derive(Debug)]
pub struct Packets {
    buffer: [u8; MAX_PACKET],
    /// Bytes since the last zero; beyond the buffer the packet is lost.
    len: usize,
}

impl Default for Packets {
    fn default() -> Packets {
        Packets::new()
    }
}

impl Packets {
    /// An empty one.
    pub const fn new() -> Packets {
        Packets {
            buffer: [0; MAX_PACKET],
            len: 0,
        }
    }

    /// Receives one byte. A zero completes a packet for [`decode`]. Packets that are too long are
    /// dropped, and so are empty ones: a sender may put a zero in front of a packet to separate it
    /// from noise.
    pub fn push(&mut self, byte: u8) -> Option<&mut [u8]> {
        if byte != 0 {
            if let Some(place) = self.buffer.get_mut(self.len) {
                *place = byte;
            }
            self.len = self.len.saturating_add(1);
            return None;
        }
        let len = core::mem::take(&mut self.len);
        self.buffer
            .get_mut(..len)
            .filter(|packet| !packet.is_empty())
    }
}
