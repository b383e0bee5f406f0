//! Any bytes as a recorded NovAtel log, with the checksums repaired where a message stands.

use firmware::wire::{Framing, ImuFormat, Scan};
use host_sim::inertial::axes::Axes;
use host_sim::recordings::novatel;

/// `NovAtel`'s CRC-32: as zlib's, but from zero and not inverted.
fn crc(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0, |mut crc, &byte| {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ if crc & 1 != 0 { 0xEDB8_8320 } else { 0 };
        }
        crc
    })
}

fn repaired(input: &[u8]) -> Vec<u8> {
    let mut bytes = input.to_vec();
    let mut at = 0;
    while at < bytes.len() {
        let rest = &mut bytes[at..];
        let mut len = 0;
        while let Scan::Partial(needed) = ImuFormat::Novatel.scan(&rest[..len]) {
            if needed > rest.len() || needed <= len {
                break;
            }
            len = needed;
        }
        at += 1;
        if ImuFormat::Novatel.scan(&rest[..len]) == Scan::BadChecksum && len > 16 {
            let sum = crc(&rest[..len - 4]).to_le_bytes();
            rest[len - 4..len].copy_from_slice(&sum);
        }
    }
    bytes
}

/// Whether samples were read.
pub fn run(input: &[u8]) -> bool {
    let path = crate::file("in.gps", &repaired(input));
    let recording = match novatel::read(&path) {
        Ok(recording) => recording,
        Err(error) => return crate::refused(&error),
    };
    let axes = Axes::RIGHT_FORWARD_UP;
    let record = novatel::record(&recording, axes, None);
    if let Ok(record) = &record {
        let (_, samples) = record.increments();
        let values = samples.iter().flat_map(|s| s.dtheta.iter().chain(&s.dv));
        assert!(values.into_iter().all(|value| value.is_finite()));
    }
    let _ = novatel::session(&recording, axes, None);
    let _ = novatel::log(&recording, axes, None);
    record.is_ok()
}
