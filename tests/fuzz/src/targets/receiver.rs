//! Any bytes as a recorded log of a receiver: UBX, NMEA, NovAtel or SBF; and as the log of a u-blox
//! receiver with its own sensors. Sums and checksums are repaired where a message stands.

use firmware::wire::{Framing, ReceiverFormat, Scan};
use host_io::recordings::{receiver, ubx};

/// Fletcher's sum modulo 256.
fn fletcher(bytes: &[u8]) -> [u8; 2] {
    bytes.iter().fold([0u8; 2], |[a, b], byte| {
        let a = a.wrapping_add(*byte);
        [a, b.wrapping_add(a)]
    })
}

fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |mut crc, &byte| {
        crc ^= u16::from(byte) << 8;
        for _ in 0..8 {
            crc = (crc << 1) ^ if crc & 0x8000 != 0 { 0x1021 } else { 0 };
        }
        crc
    })
}

fn repaired(input: &[u8]) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for at in 0..bytes.len() {
        let rest = &mut bytes[at..];
        for format in [ReceiverFormat::Ubx, ReceiverFormat::Sbf] {
            let mut len = 0;
            while let Scan::Partial(needed) = format.scan(&rest[..len]) {
                if needed > rest.len() || needed <= len {
                    break;
                }
                len = needed;
            }
            if format.scan(&rest[..len]) != Scan::BadChecksum || len < 8 {
                continue;
            }
            match format {
                ReceiverFormat::Ubx => {
                    let sum = fletcher(&rest[2..len - 2]);
                    rest[len - 2..len].copy_from_slice(&sum);
                }
                _ => {
                    let sum = crc16(&rest[4..len]).to_le_bytes();
                    rest[2..4].copy_from_slice(&sum);
                }
            }
        }
    }
    bytes
}

/// Whether a log was read.
pub fn run(input: &[u8]) -> bool {
    let path = crate::file("in.log", &repaired(input));
    let read = match receiver::read(&path, None, &|_, _| ()) {
        Ok(log) => {
            for fix in &log.fixes {
                assert!(fix.time.is_finite(), "{fix:?}");
            }
            true
        }
        Err(error) => crate::refused(&error),
    };
    match ubx::read(&path, &ubx::Choice::default(), &|_, _| ()) {
        Ok(reading) => {
            let samples: Vec<_> = reading
                .record
                .increments()
                .map(|(_, sample)| sample)
                .collect();
            let values = samples.iter().flat_map(|s| s.dtheta.iter().chain(&s.dv));
            assert!(values.into_iter().all(|value| value.is_finite()));
            true
        }
        Err(error) => read | crate::refused(&error),
    }
}
