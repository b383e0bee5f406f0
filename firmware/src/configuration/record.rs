//! The bytes by which a configuration is sent and stored. Little-endian:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 4 | magic `LRNC` |
//! | 4 | 2 | [`SCHEMA`]; 1 to 5 are read too |
//! | 6 | 2 | length n of the body |
//! | 8 | n | the [`Configuration`] in postcard's encoding |
//! | 8 + n | 4 | CRC-32 (zlib's) of bytes 0 to 8 + n |

use super::older::{Schema1, Schema3};
use super::{Configuration, SCHEMA, Wheels};
use crate::control::Reason;
use crate::inputs::{Inputs, OWN};
use crate::wire::checksum::crc32_zlib;
use crate::wire::field::{head, put, take};
use heapless::Vec;
use serde::Deserialize;

/// Most bytes of a record.
pub const MAX_LEN: usize = 512;
/// A record.
pub type Record = Vec<u8, MAX_LEN>;

const MAGIC: [u8; 4] = *b"LRNC";
const HEADER_LEN: usize = 8;
const CRC_LEN: usize = 4;

/// The record of a configuration. Empty if it does not fit, which no configuration does that
/// passes [`Configuration::check`].
#[must_use]
pub fn encode(configuration: &Configuration) -> Record {
    let mut bytes = [0; MAX_LEN];
    let Some(body) = bytes.get_mut(HEADER_LEN..MAX_LEN - CRC_LEN) else {
        return Record::new();
    };
    let whole = (
        configuration,
        configuration.lines.cut_through,
        configuration.wheels,
    );
    let Ok(body) = postcard::to_slice(&whole, body) else {
        return Record::new();
    };
    let body = body.len();
    put(&mut bytes, 0, MAGIC);
    put(&mut bytes, 4, SCHEMA.to_le_bytes());
    put(&mut bytes, 6, (body as u16).to_le_bytes()); // less than MAX_LEN
    let end = HEADER_LEN + body;
    let sum = crc32_zlib(head(&bytes, end));
    put(&mut bytes, end, sum.to_le_bytes());
    Record::from_slice(head(&bytes, end + CRC_LEN)).unwrap_or_default()
}

/// The schema that bytes claim which begin like a record.
#[must_use]
pub fn schema(bytes: &[u8]) -> Option<u16> {
    (take(bytes, 0) == MAGIC).then(|| u16::from_le_bytes(take(bytes, 4)))
}

/// The configuration of a record, with all its values in range.
///
/// # Errors
/// [`Reason::Record`] for bytes that are no whole record, [`Reason::Schema`] for a version that is
/// not read,
/// [`Reason::Field`] for a value out of range.
pub fn decode(bytes: &[u8]) -> Result<Configuration, Reason> {
    let body = usize::from(u16::from_le_bytes(take(bytes, 6)));
    let end = HEADER_LEN + body;
    if take(bytes, 0) != MAGIC || bytes.len() != end + CRC_LEN {
        return Err(Reason::Record);
    }
    if crc32_zlib(head(bytes, end)) != u32::from_le_bytes(take(bytes, end)) {
        return Err(Reason::Record);
    }
    let body = bytes.get(HEADER_LEN..end).unwrap_or_default();
    let configuration: Configuration = match u16::from_le_bytes(take(bytes, 4)) {
        SCHEMA => {
            type Whole = (Schema3, Inputs, bool, Option<Wheels>);
            let (configuration, inputs, cut_through, wheels) = whole::<Whole>(body)?;
            let mut configuration = configuration.with(inputs);
            configuration.lines.cut_through = cut_through;
            configuration.wheels = wheels;
            configuration
        }
        5 => {
            let (configuration, inputs, cut_through) = whole::<(Schema3, Inputs, bool)>(body)?;
            let mut configuration = configuration.with(inputs);
            configuration.lines.cut_through = cut_through;
            configuration
        }
        4 => {
            let (configuration, inputs) = whole::<(Schema3, Inputs)>(body)?;
            configuration.with(inputs)
        }
        // schema 3 has one activation more, at the end of the list
        2 | 3 => whole::<Schema3>(body)?.with(OWN),
        1 => whole::<Schema1>(body)?.with(OWN),
        _ => return Err(Reason::Schema(SCHEMA)),
    };
    configuration.check().map_err(Reason::Field)?;
    Ok(configuration)
}

/// A value that takes up the whole body.
fn whole<'a, T: Deserialize<'a>>(body: &'a [u8]) -> Result<T, Reason> {
    match postcard::take_from_bytes(body) {
        Ok((value, [])) => Ok(value),
        _ => Err(Reason::Record),
    }
}
