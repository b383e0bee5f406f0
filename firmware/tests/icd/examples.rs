//! The examples of the document, byte for byte.

use super::ICD;
use firmware::control::Mode;
use firmware::sample::RawSample;
use firmware::update;
use firmware::update::header::{HEADER_LEN, Header, is_signed};
use firmware::wire::command::{MAX_PACKET, Request, Response, encode};
use firmware::wire::{Change, Checked, ImuFormat, Settings};

/// The lines of bytes behind a mark in the document.
fn lines<const N: usize>(mark: &str) -> [Vec<u8>; N] {
    let (_, rest) = ICD.split_once(mark).expect("a mark");
    let (_, rest) = rest.split_once("\n\n").expect("a paragraph");
    let mut lines = rest.lines().take_while(|line| line.starts_with("    "));
    core::array::from_fn(|_| {
        let words = lines.next().expect("a line of bytes").split_whitespace();
        words
            .map(|word| u8::from_str_radix(word, 16).expect("a byte"))
            .collect()
    })
}

/// All bytes behind a mark in the document, on as many lines as they take.
pub(super) fn all_bytes(mark: &str) -> Vec<u8> {
    let (_, rest) = ICD.split_once(mark).expect("a mark");
    let (_, rest) = rest.split_once("\n\n").expect("a paragraph");
    let lines = rest.lines().take_while(|line| line.starts_with("    "));
    let words = lines.flat_map(str::split_whitespace);
    words
        .map(|word| u8::from_str_radix(word, 16).expect("a byte"))
        .collect()
}

/// The example of section 2.1, read as the section says and without the code under test.
#[test]
fn the_example_of_an_adis_frame() {
    let [mut bytes] = lines("(t: `adis example`):");
    let length = usize::from(bytes[2]);
    assert_eq!((&bytes[..2], length, bytes[3]), (&[0xAD, 0x15][..], 20, 0));
    assert_eq!(bytes.len(), 8 + length + 4);
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    assert_eq!(u32_at(4), 305_419_896);
    assert_eq!(u32_at(8 + length), crc32(&bytes[..8 + length]));
    let word = |n: usize| i16::from_be_bytes([bytes[8 + 2 * n], bytes[9 + 2 * n]]);
    assert_eq!([1, 2, 3, 4, 5, 6].map(word), [1, -2, 3, 100, -200, 800]);
    assert_eq!([0, 7, 8].map(word), [0, 250, 7]);
    let sum: u32 = bytes[8..26].iter().map(|&byte| u32::from(byte)).sum();
    assert_eq!(sum as u16, word(9) as u16);
    // and the device takes it for a frame with these values
    let adis = ImuFormat::from_name("adis-uart").expect("a format");
    let frame = Checked::new(adis, &mut bytes).expect("a frame");
    let expected = RawSample::Counts {
        gyro: [1, -2, 3],
        accel: [100, -200, 800],
    };
    assert_eq!(frame.read().expect("values").sample, expected);
}

/// CRC-32 bit by bit, from its definition: reflected polynomial 0xEDB88320, from all ones,
/// inverted.
pub(super) fn crc32(bytes: &[u8]) -> u32 {
    let bits = |crc: u32, _| (crc >> 1) ^ (0xEDB8_8320 & 0u32.wrapping_sub(crc & 1));
    !bytes
        .iter()
        .fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), bits))
}

/// Section 2: a STIM300's frame before and after a correction. Values and bytes were made apart
/// from this code, in Python.
#[test]
fn the_example_of_a_corrected_frame() {
    let [mut frame, after] = lines("(t: `stim300 example`):");
    let stim300 = ImuFormat::from_name("stim300").expect("a format");
    let mut checked = Checked::new(stim300, &mut frame).expect("a frame");
    let counts = |gyro, accel| RawSample::Counts { gyro, accel };
    let sample = checked.read().expect("values").sample;
    assert_eq!(sample, counts([1000, -2, 77], [5, 6, 524_288]));
    let change = Change {
        sample: &counts([997, -1, 77], [5, 4, 524_292]),
        mark: false,
        settings: &Settings::DEFAULT,
    };
    checked.change(&change).expect("values of this kind");
    assert_eq!(frame, after);
    let counter_and_latency = [0x2A, 0x01, 0xC2]; // 42 and 450
    assert_eq!(frame[21..24], counter_and_latency);
}

/// Section 2: a STIM300's frame whose CRC is over two zeros more than are sent.
#[test]
fn the_example_of_a_padded_checksum() {
    let [mut frame] = lines("(t: `stim300 padded`):");
    let (sent, sum) = frame.split_last_chunk::<4>().expect("a CRC");
    assert_eq!((sent[0], sent.len() % 4), (0x93, 2));
    let mut padded = sent.to_vec();
    padded.resize(sent.len().next_multiple_of(4), 0);
    // CRC-32/MPEG-2 bit by bit, from its definition
    let bits = |crc: u32, _| (crc << 1) ^ (0x04C1_1DB7 & 0u32.wrapping_sub(crc >> 31));
    let crc = padded.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte) << 24, bits)
    });
    assert_eq!(u32::from_be_bytes(*sum), crc);
    let stim300 = ImuFormat::from_name("stim300").expect("a format");
    let sample = Checked::new(stim300, &mut frame).expect("a frame").read();
    let expected = RawSample::Counts {
        gyro: [1000, -2, 77],
        accel: [5, 6, 524_288],
    };
    assert_eq!(sample.expect("values").sample, expected);
}

/// Section 7: the header of an update, by the table's offsets. Bytes and signature were made apart
/// from this code, in Python.
#[test]
fn the_example_of_an_update() {
    let bytes = all_bytes("(t: `update header`):");
    let (_, rows) = ICD
        .split_once("| offset (t: `update fields`)")
        .expect("a table");
    let rows = rows
        .lines()
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    let mut at = 0;
    let fields: Vec<&[u8]> = rows
        .map(|row| {
            let mut cells = row.split('|').skip(1);
            let mut number = || cells.next()?.trim().parse::<usize>().ok();
            let (offset, length) = (number().expect("an offset"), number().expect("a length"));
            assert_eq!(offset, at, "{row}");
            at += length;
            &bytes[offset..at]
        })
        .collect();
    assert_eq!((at, bytes.len()), (HEADER_LEN, HEADER_LEN));
    let [
        magic,
        format,
        version,
        address,
        length,
        board,
        digest,
        signature,
    ] = fields[..]
    else {
        panic!("{} fields", fields.len());
    };
    assert_eq!((magic, format), (&b"LRNU"[..], &[1, 0][..]));
    assert_eq!(version, [0, 0, 2, 0, 1, 0]);
    assert_eq!((address, length), (&[0, 0, 16, 8][..], &[3, 0, 0, 0][..]));
    assert_eq!(board, b"h743\0\0\0\0\0\0\0\0");
    let header = Header {
        version: [0, 2, 1],
        address: 0x0810_0000,
        length: 3,
        board: update::header::board("h743").expect("a name"),
        digest: update::header::digest([&[1, 2, 3][..]]),
    };
    assert_eq!(digest, header.digest);
    let signed = bytes.first_chunk().expect("a header");
    assert_eq!(Header::parse(signed), Some(header));
    assert_eq!(header.signed(), bytes[..bytes.len() - signature.len()]);
    assert!(is_signed(signed, &update::DEVELOPMENT_KEY));
    let seed = core::str::from_utf8(&update::DEVELOPMENT_SEED).expect("a text");
    assert!(ICD.contains(&format!("`{seed}`")));
    let mut other = *signed;
    other[63] ^= 1;
    assert!(!is_signed(&other, &update::DEVELOPMENT_KEY));
}

/// Section 7: a request without a seal, and its answer.
#[test]
fn the_example_of_a_packet() {
    let [request, answer] = lines("(t: `request`, `answer`):");
    let mut buffer = [0; MAX_PACKET];
    let made = encode(5, &Request::SetMode(Mode::Frozen), &mut buffer);
    assert_eq!(made.expect("a packet"), request);
    let made = encode(5, &Response::Done, &mut buffer);
    assert_eq!(made.expect("a packet"), answer);
}
