//! Damage on the line: at most the damaged frame is lost, and no frame is made up.

use crate::device::{Device, Mock, nets};
use crate::frames::{Kind, frames_in, kinds, values};
use firmware::app::Config;
use firmware::control::Mode;
use firmware::link::faulty::{Chances, Faulty};
use firmware::wire::{Checked, ImuFormat};
use proptest::prelude::*;

const STIM: Kind = Kind::STIM;
const KVH: Kind = Kind::KVH;

proptest! {
    /// One wrong bit costs only the frame it is in, in any format, in whatever pieces the bytes
    /// arrive.
    #[test]
    fn a_wrong_bit_costs_one_frame(
        which in 0..kinds().len(), bit: prop::sample::Index, hit in 2..8usize, piece in 1..80usize,
    ) {
        let kind = kinds()[which];
        let mut sent = kind.stream(0, 12);
        let bits = 8 * sent[hit].len();
        let bit = bit.index(bits);
        sent[hit][bit / 8] ^= 1 << (bit % 8);
        // where the header gives the length, a wrong one passes 16 bits of a CRC by chance, once in
        // 65 536 (VectorNav, bit 26 of the eighth frame): another length, never the frame itself
        let by_chance = frames_in(kind.format, &sent[hit]);
        prop_assert!(by_chance.iter().all(|frame| frame.len() != sent[hit].len()));
        prop_assume!(by_chance.is_empty());
        let mut device = Device::new(Config { mode: Mode::Frozen, block: 0.003, ..kind.config() });
        device.lines.sensor.piece = piece;
        device.feed(&sent.concat());
        device.wait_ms(200); // a false start at the end waits for no more than the silence
        prop_assert_eq!(device.lines.navigation.bytes(), sent.concat());
        // a false start may hold the last frames back until the line is silent; they then count as
        // garbage
        sent.remove(hit);
        let frames = device.counters().frames as usize;
        prop_assert!(frames <= sent.len() && frames + 3 >= sent.len(), "{} of {}", frames, sent.len());
    }

    /// Garbage of any kind between frames costs none of them. It is counted byte for byte and
    /// leaves in order.
    #[test]
    fn garbage_is_counted_and_passes(
        which in 0..kinds().len(), piece in 1..80usize,
        noise in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..60), 10),
    ) {
        let kind = kinds()[which];
        let frames = kind.stream(0, 30);
        let mut stream = Vec::new();
        for (n, frame) in frames.iter().enumerate() {
            stream.extend(noise.get(n).into_iter().flatten());
            stream.extend(frame);
        }
        let mut device = Device::new(kind.config());
        device.lines.sensor.piece = piece;
        device.feed(&stream);
        prop_assert_eq!(frames_in(kind.format, &device.lines.navigation.bytes()), &frames[..]);
        device.wait_ms(200); // a false start at the end
        prop_assert_eq!(device.lines.navigation.bytes(), stream.clone());
        let counters = device.counters();
        prop_assert_eq!(counters.frames, 30);
        let other = stream.len() - frames.concat().len();
        let counted = counters.garbage + counters.bad_checksums + counters.raw;
        // CR LF among the noise is a message
        prop_assert_eq!(counted as usize + 2 * counters.others as usize, other);
    }

    /// A bad cable: every frame that leaves is one that was sent, in order, with its sample
    /// corrected and all other bytes unchanged.
    #[test]
    fn no_frame_is_made_up(
        seed: u64,
        which in 0..3usize,
        correct: bool,
        flip in 0..200u16,
        drop in 0..100u16,
        burst in 0..50u16,
    ) {
        let kind = [STIM, KVH, Kind::RAWIMUSX][which];
        let error = if correct { [2e-6, -1e-6, 3e-6] } else { [0.0; 3] };
        let chances = Chances { flip, drop, burst, lost: 20, full: 0 };
        let mut device = Device::on(
            Config {
                mode: Mode::Frozen,
                nets: nets(error, [0.0; 3]),
                block: 0.01,
                ..kind.config()
            },
            Faulty::new(Mock::default(), chances, seed),
        );
        let sent = kind.stream(0, 300);
        for frame in &sent {
            device.lines.sensor.inner().input.extend(frame);
            device.settle();
            device.pass_us(900);
        }
        device.wait_ms(200);
        // damaged bytes pass too, but not as frames
        let is_frame = |message: &&Vec<u8>| Checked::new(kind.format, &mut message.to_vec()).is_ok();
        let out: Vec<_> = device.lines.navigation.sent.iter().filter(is_frame).collect();
        let mut rest = sent.iter();
        for &frame in &out {
            // the same frame except for its sample's last counts and its checksum
            let near = |s: &Vec<u8>| {
                let far = if kind == KVH { 1e-7 } else { 300.0 };
                s.len() == frame.len()
                    && values(kind.format, s)
                        .iter()
                        .zip(values(kind.format, frame))
                        .all(|(a, b)| (a - b).abs() <= far)
                    && stamp(kind, s) == stamp(kind, frame)
            };
            prop_assert!(rest.any(near), "a frame that was never sent: {frame:02x?}");
        }
        let done = device.lines.sensor.done();
        // each damaged byte spoils at most its frame; bytes reported as lost do arrive here
        let enough = out.len() + done.bytes as usize + 3 >= sent.len();
        prop_assert!(enough, "{} of {}, {done:?}", out.len(), sent.len());
        if done.bytes == 0 {
            prop_assert_eq!(out.len(), sent.len());
        }
    }
}

/// The fields of a frame that no correction touches.
pub fn stamp(kind: Kind, frame: &[u8]) -> Vec<u8> {
    let (from, to) = match kind.format {
        ImuFormat::Stim300 => (20, 24), // accelerometer status to latency
        ImuFormat::Kvh => (28, 32),
        _ => (4, 28), // header, time, status
    };
    frame[from..to].to_vec()
}
