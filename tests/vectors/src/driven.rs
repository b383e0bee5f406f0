//! Networks that temperature and vibration drive: the whole way from samples and readings of the
//! thermometer to corrected samples.

use firmware::compensator::{Compensator, Limit};
use firmware::inputs::Source;
use firmware::sample::{Lsb, RawSample};
use lrnn_nostd::{Net, Normalisation, Rational};

use crate::Digest;
use crate::network::net;

/// Blocks, and samples in each.
const BLOCKS: u32 = 150;
const SAMPLES: u16 = 25;

/// Digest of each block's report, of the networks' outputs and of the corrected samples. 0, which
/// is no digest, if the compensator cannot be created.
pub fn driven_digest() -> u64 {
    let limit = Limit {
        gyro: 1e-4,
        accel: 0.1,
    };
    let lsb = Lsb {
        rad: 1e-7,
        mps: 1e-4,
    };
    let [gyro, accel] = [driven(1e-5), driven(1e-2)];
    let made = Compensator::new(gyro, accel, lsb, 0.04, SAMPLES, limit);
    let Ok(mut compensator) = made else {
        return 0;
    };
    compensator.set_inputs([
        [
            Source::Temperature,
            Source::TemperatureRate,
            Source::Vibration,
        ],
        [
            Source::TemperatureRate,
            Source::RateMagnitude,
            Source::Temperature,
        ],
    ]);
    let mut digest = Digest::new();
    let mut state = compensator.power_on(false);
    for n in 0..BLOCKS * u32::from(SAMPLES) {
        // it warms up by 1/256 K in four samples, and some readings are missing
        if n % 3 != 1 && !(1500..1700).contains(&n) {
            state.read_temperature((20 * 256 + n / 4 + noise(n) % 16) as f32 / 256.0);
        }
        let shake = |axis: u32| noise(3 * n + axis) as i32 % 2000 - 1000;
        let mut sample = RawSample::Counts {
            gyro: [0, 1, 2].map(|axis| shake(axis) * 50),
            accel: [3, 4, 5].map(|axis| shake(axis) + 3900),
        };
        let block = compensator.accumulate(&mut state, &sample);
        compensator.correct(&mut state, 0, &mut sample);
        if let RawSample::Counts { gyro, accel } = sample {
            digest.numbers([gyro, accel].as_flattened().iter().map(|c| *c as f32));
        }
        if let Some(block) = block {
            let sources = Source::ALL.map(|source| block.sources.select(&[source; 3])[0]);
            digest.numbers(sources);
            digest.numbers(block.network_output.as_flattened().iter().copied());
        }
    }
    digest.value()
}

/// The fixed network, for inputs of 25 degrees C, 0.05 K/s and 1 (m/s2)^2 in any order.
fn driven(output: f32) -> Net {
    let normalisation = Normalisation {
        input_offset: [25.0, 0.0, 0.0],
        input_scale: [0.05, 1.0, 0.5],
        output_scale: [output; 3],
    };
    Net::new(net::<Rational>().weights, normalisation)
}

/// 0 to 65535 from a linear congruential generator (Numerical Recipes' constants) seeded by the
/// index.
fn noise(index: u32) -> u32 {
    let mut seed = index ^ 0x5eed_0002;
    for _ in 0..4 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    }
    seed >> 16
}
