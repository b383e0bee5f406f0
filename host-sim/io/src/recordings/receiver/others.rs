//! Protocols that are not read, by the messages at the begin of a log. They are named to the user
//! whose log holds no fix.
//!
//! Source: gpsd's drivers, and the manuals that they name.

use host_core::words::counted;
use std::collections::BTreeSet;

/// Bytes of a log that are looked at.
pub(super) const LOOK: u64 = 1 << 18;
/// A protocol is named where its messages have so much of these bytes: one of it in so many.
const SHARE: usize = 10;
/// The longest message between escapes that is looked for.
const ESCAPED: usize = 1024;

/// Length of the message with which bytes begin.
type Message = fn(&[u8]) -> Option<usize>;

/// A protocol, and whether it has positions.
const TABLE: [(&str, bool, Message); 13] = [
    ("SiRF (binary)", true, sirf),
    ("SkyTraq (binary)", true, skytraq),
    ("Zodiac (Rockwell)", true, zodiac),
    ("iTalk (Fastrax)", true, italk),
    ("SuperStar II (NovAtel)", true, superstar),
    ("NCT (NavCom)", true, navcom),
    ("GREIS (Topcon, Javad)", true, greis),
    ("GeoStar (binary)", true, geostar),
    ("Garmin (binary)", true, garmin),
    ("EverMore (binary)", true, evermore),
    ("TSIP (Trimble)", true, tsip),
    ("AIS (ships, AIVDM)", false, ais),
    ("RTCM 3 (corrections)", false, rtcm),
];

/// What the log begins with, and whether it has positions of a receiver.
pub(super) fn recognised(bytes: &[u8]) -> Option<(String, bool)> {
    let mut counts = [[0_usize; 2]; TABLE.len()];
    let mut at = 0;
    while let Some(rest) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
        let mut all = TABLE.iter().zip(&mut counts);
        let found = all.find_map(|((.., message), count)| {
            let len = message(rest).filter(|len| *len <= rest.len())?;
            *count = [count[0] + 1, count[1] + len];
            Some(len)
        });
        at += found.unwrap_or(1);
    }
    let body = without_comments(bytes);
    let named = TABLE.iter().zip(counts);
    let best = named.max_by_key(|(_, [_, len])| *len);
    if let Some(((name, has_positions, _), [count, len])) = best
        && len * SHARE >= body.len()
        && count > 0
    {
        return Some((
            format!("{name}: {}", counted(count, "message")),
            *has_positions,
        ));
    }
    is_rtcm2(body).then(|| ("RTCM 2 (corrections)".to_owned(), false))
}

/// Bytes behind the lines of comments with which a log may begin.
fn without_comments(mut bytes: &[u8]) -> &[u8] {
    while bytes.starts_with(b"#") {
        let end = bytes.iter().position(|byte| *byte == b'\n');
        bytes = end.map_or(&[], |end| &bytes[end + 1..]);
    }
    bytes
}

fn u16_at(bytes: &[u8], at: usize) -> Option<usize> {
    let pair = bytes.get(at..at + 2)?;
    Some(usize::from(u16::from_le_bytes([pair[0], pair[1]])))
}

fn be_at(bytes: &[u8], at: usize) -> Option<usize> {
    let pair = bytes.get(at..at + 2)?;
    Some(usize::from(u16::from_be_bytes([pair[0], pair[1]])))
}

/// Length where a message of `len` bytes begins and ends so.
fn between(bytes: &[u8], begin: &[u8], len: usize, end: &[u8]) -> Option<usize> {
    let message = bytes.get(..len)?;
    (message.starts_with(begin) && message.ends_with(end)).then_some(len)
}

fn sirf(bytes: &[u8]) -> Option<usize> {
    let len = be_at(bytes, 2)? + 8;
    between(bytes, &[0xA0, 0xA2], len, &[0xB0, 0xB3])
}

fn skytraq(bytes: &[u8]) -> Option<usize> {
    let len = be_at(bytes, 2)? + 7;
    between(bytes, &[0xA0, 0xA1], len, b"\r\n")
}

/// The sum of the five words of the header is 0.
fn zodiac(bytes: &[u8]) -> Option<usize> {
    let words: Option<Vec<usize>> = (0..5).map(|k| u16_at(bytes, 2 * k)).collect();
    let words = words.filter(|words| words[0] == 0x81FF)?;
    let len = if words[2] == 0 { 10 } else { 12 + 2 * words[2] };
    (words.iter().sum::<usize>() % 0x1_0000 == 0).then_some(len)
}

fn italk(bytes: &[u8]) -> Option<usize> {
    let len = 2 * usize::from(*bytes.get(6)?) + 10;
    between(bytes, b"<!", len, b">")
}

fn superstar(bytes: &[u8]) -> Option<usize> {
    let [1, id, not, len] = *bytes.first_chunk()? else {
        return None;
    };
    let end = usize::from(len) + 4;
    let sum: usize = bytes
        .get(..end)?
        .iter()
        .map(|byte| usize::from(*byte))
        .sum();
    (id == !not && u16_at(bytes, end)? == sum % 0x1_0000).then_some(end + 2)
}

fn navcom(bytes: &[u8]) -> Option<usize> {
    let len = u16_at(bytes, 4)? + 4;
    between(bytes, &[2, 0x99, 0x66], len, &[3])
}

/// Two letters, three digits of the length, then as many bytes, of which the last is the checksum.
/// It is weak, so that text is none.
fn greis(bytes: &[u8]) -> Option<usize> {
    let digits = std::str::from_utf8(bytes.get(2..5)?).ok()?;
    let len = 5 + usize::from_str_radix(digits, 16).ok()?;
    let (sum, rest) = bytes.get(..len)?.split_last()?;
    let of = rest
        .iter()
        .fold(0_u8, |sum, byte| sum.rotate_left(2) ^ byte);
    let is_text = |byte: &u8| matches!(byte, b'\t' | b'\r' | b'\n' | b' '..=b'~');
    (of.rotate_left(2) == *sum && !rest.iter().all(is_text)).then_some(len)
}

fn geostar(bytes: &[u8]) -> Option<usize> {
    let len = 4 * u16_at(bytes, 6)? + 12;
    between(bytes, b"PSGG", len, &[])
}

/// What is between DLE and DLE ETX, and the length with these. A DLE in between comes twice.
fn escaped(bytes: &[u8]) -> Option<(Vec<u8>, usize)> {
    const DLE: u8 = 0x10;
    let mut inner = Vec::new();
    let mut at = 1;
    bytes.first().filter(|byte| **byte == DLE)?;
    while inner.len() < ESCAPED {
        match *bytes.get(at..at + 2)? {
            [DLE, 3] => return Some((inner, at + 2)),
            [DLE, DLE] => at += 1,
            [DLE, _] => return None,
            _ => {}
        }
        inner.push(bytes[at]);
        at += 1;
    }
    None
}

fn sum_of(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// Kind, length, data; the sum of all is 0.
fn garmin(bytes: &[u8]) -> Option<usize> {
    let (inner, len) = escaped(bytes)?;
    let stated = usize::from(*inner.get(1)?);
    (stated + 3 == inner.len() && sum_of(&inner) == 0).then_some(len)
}

/// STX, length, data, and their sum.
fn evermore(bytes: &[u8]) -> Option<usize> {
    let (inner, len) = escaped(bytes)?;
    let (sum, data) = inner.get(2..)?.split_last()?;
    (inner[0] == 2 && sum_of(data) == *sum).then_some(len)
}

/// The reports of a receiver.
fn tsip(bytes: &[u8]) -> Option<usize> {
    let (inner, len) = escaped(bytes)?;
    inner.first().filter(|id| (0x40..=0x8F).contains(*id))?;
    (inner.len() > 1).then_some(len)
}

fn ais(bytes: &[u8]) -> Option<usize> {
    let is_one = bytes.starts_with(b"!") && matches!(bytes.get(3..6)?, b"VDM" | b"VDO");
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    is_one.then_some(end + 1)
}

/// The length has ten bits, the checksum is CRC-24Q.
fn rtcm(bytes: &[u8]) -> Option<usize> {
    let [0xD3, high @ 0..4, low] = *bytes.first_chunk()? else {
        return None;
    };
    let end = usize::from(u16::from_be_bytes([high, low])) + 3;
    let crc = bytes.get(..end + 3)?.iter().fold(0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte) << 16, |crc, _| match crc << 1 {
            next if next & 0x100_0000 != 0 => next ^ 0x186_4CFB,
            next => next,
        })
    });
    (crc == 0).then_some(end + 3)
}

/// Six bits of data a byte behind 01, and most of the 64 values of them. Text has blanks and ends
/// of lines.
fn is_rtcm2(bytes: &[u8]) -> bool {
    let coded = bytes.iter().filter(|byte| **byte & 0xC0 == 0x40);
    let values: BTreeSet<&u8> = coded.clone().collect();
    coded.count() * 50 >= bytes.len() * 49 && values.len() > 32
}
