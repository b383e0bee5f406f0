//! The packets of the interface control document, byte for byte.
//!
//! The bytes there, and those here, come from Python, not from this code:
//!
//! ```python
//! import hashlib, struct, zlib
//! def mac(purpose, *parts):
//!     data = bytes([purpose]) + b"".join(parts)
//!     return hashlib.blake2s(data, key=bytes(range(32)), digest_size=32).digest()
//! challenge, one = bytes(range(0xA0, 0xB0)), struct.pack("<I", 1)
//! def packet(coded, purpose, door):
//!     seal = challenge[:4] + one + door + mac(purpose, challenge, one, coded)[:16]
//!     plain = coded + seal
//!     plain += struct.pack("<I", zlib.crc32(plain))
//!     return b"".join(bytes([len(b) + 1]) + b for b in plain.split(b"\0")) + b"\0"
//! print(packet(bytes([5, 2, 1]), 2, mac(1, challenge, one)[:4]).hex(" "))
//! print(packet(bytes([5, 0]), 3, bytes(4)).hex(" "))
//! veil = mac(4, challenge, struct.pack("<I", 2))
//! print(bytes(a ^ b for a, b in zip(range(0x40, 0x60), veil)).hex(" "))
//! print(mac(0, bytes([9]) * 32, one, struct.pack("<Q", 123456))[:16].hex(" "))
//! ```

use super::*;

const ICD: &str = include_str!("../../../../docs/ICD.md");

const CHALLENGE: Challenge = Challenge([
    0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8, 0xA9, 0xAA, 0xAB, 0xAC, 0xAD, 0xAE, 0xAF,
]);

fn bytes(text: &str) -> Vec<u8> {
    text.split_whitespace()
        .map(|word| u8::from_str_radix(word, 16).expect("a byte"))
        .collect()
}

/// The lines of bytes behind a mark in the document.
fn stated(mark: &str) -> Vec<Vec<u8>> {
    let (_, rest) = ICD.split_once(mark).expect("a mark");
    let (_, rest) = rest.split_once("\n\n").expect("a paragraph");
    let lines = rest.lines().take_while(|line| line.starts_with("    "));
    lines.map(bytes).collect()
}

#[test]
fn the_packets_of_the_document() {
    let key = secret(0);
    let sealed = |direction, buffer: &mut [u8], message: &dyn Fn(&mut [u8], &Sealer) -> usize| {
        let sealer = Sealer {
            secret: &key,
            challenge: &CHALLENGE,
            counter: 1,
            direction,
        };
        let len = message(buffer, &sealer);
        buffer[..len].to_vec()
    };
    let mut buffer = [0; MAX_PACKET];
    let request = sealed(Direction::Request, &mut buffer, &|buffer, sealer| {
        let request = Request::SetMode(Mode::Frozen);
        encode_sealed(5, &request, buffer, Some(sealer))
            .expect("a packet")
            .len()
    });
    let answer = sealed(Direction::Answer, &mut buffer, &|buffer, sealer| {
        encode_sealed(5, &Response::Done, buffer, Some(sealer))
            .expect("a packet")
            .len()
    });
    assert_eq!(stated("(t: `sealed answer`)"), [request, answer]);
}

#[test]
fn veil_and_challenge() {
    let key = secret(0);
    let veiled = "f0 f8 be 24 0e 77 50 61 47 db 4f d7 f4 15 c8 5b \
                  b3 ad 01 11 55 13 2a 8a b5 c5 af 5d 20 ae d5 99";
    let veil = key.veiled(&CHALLENGE, 2, &secret(0x40));
    assert_eq!(veil.0[..], bytes(veiled));
    assert_eq!(key.veiled(&CHALLENGE, 2, &veil), secret(0x40));
    let given = key.challenge(&[9; 32], 1, 123_456);
    assert_eq!(
        given.0[..],
        bytes("a5 2d 98 bd 34 cf 63 71 05 9e 1e 26 8e 7f 92 47")
    );
}
