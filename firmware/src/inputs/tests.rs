use super::*;
use proptest::prelude::*;
use std::vec::Vec;

#[test]
fn every_source_is_selected_and_has_its_number() {
    let block = Sources {
        rate: [3.0, -4.0, 12.0],
        force: [0.1, 0.2, -9.8],
        temperature: 31.0,
        temperature_rate: 0.01,
        vibration: 0.5,
    };
    let values = Source::ALL.map(|source| block.select(&[source; 3]));
    let expected = [3.0, -4.0, 12.0, 0.1, 0.2, -9.8, 31.0, 0.01, 0.5, 13.0];
    assert_eq!(values, expected.map(|value| [value; 3]));
    assert_eq!(block.select(&OWN[0]), block.rate);
    assert_eq!(block.select(&OWN[1]), block.force);
    for (number, source) in Source::ALL.into_iter().enumerate() {
        assert_eq!(source as usize, number);
        let mut bytes = [0; 4];
        assert_eq!(
            postcard::to_slice(&source, &mut bytes).unwrap(),
            [number as u8]
        );
    }
}

/// Blocks of `block_s` seconds with four readings each of a temperature over time, and what the
/// thermometer makes of them.
fn blocks(block_s: f32, number: u32, celsius: impl Fn(f32) -> f32) -> Vec<[f32; 2]> {
    let mut thermometer = Thermometer::default();
    let block = |block: u32| {
        for part in 0..4 {
            let part = part as f32 / 4.0;
            thermometer.read(celsius((block as f32 + part) * block_s));
        }
        thermometer.end_block(block_s)
    };
    (0..number).map(block).collect()
}

#[test]
fn the_rate_of_a_ramp_is_exact_after_ten_seconds() {
    for (block_s, slope) in [(1.0, 0.02), (0.1, -0.005), (10.0, 0.03), (1.0, 0.0)] {
        for (number, [celsius, rate]) in
            (blocks(block_s, 200, |t| 20.0 + slope * t).into_iter()).enumerate()
        {
            let age = number as f32 * block_s;
            let mean = 20.0 + slope * (age + 0.375 * block_s);
            assert!((celsius - mean).abs() < 1e-4, "{celsius} for {mean}");
            if age < 9.99 {
                assert_eq!(rate, 0.0, "at {age} s");
            } else if age > 10.01 {
                // what the temperature is rounded to, over 10 s
                assert!((rate - slope).abs() < 2e-6, "{rate} for {slope} at {age} s");
            }
        }
    }
}

/// Compared with the solution of the low-pass's equation, for an exponential warm-up.
#[test]
fn the_rate_of_a_curve_is_that_of_the_low_pass() {
    let (amplitude, time) = (12.0f64, 400.0f64);
    let found = blocks(1.0, 1500, |t| {
        (40.0 - amplitude * (-f64::from(t) / time).exp()) as f32
    });
    for (number, [_, rate]) in found.into_iter().enumerate().skip(11) {
        let t = number as f64;
        // the first block's mean is 0.375 s after its beginning, where the low-pass starts
        let at_start = amplitude * (-0.375 / time).exp();
        let decay = |c: f64| (-t / c).exp();
        let lead = at_start * 60.0 / (time - 60.0) * (decay(time) - decay(60.0));
        let expected = lead / 60.0 / (1.0 - decay(60.0));
        let rate = f64::from(rate);
        assert!(
            (rate - expected).abs() < 3e-6,
            "{rate} for {expected} at {t} s"
        );
    }
}

#[test]
fn rare_readings_give_the_same_and_a_gap_starts_anew() {
    let mut thermometer = Thermometer::default();
    let mut last = [0.0; 2];
    for second in 0..100 {
        if second % 7 == 0 {
            thermometer.read(20.0 + 0.01 * second as f32);
        }
        last = thermometer.end_block(1.0);
    }
    assert!((last[1] - 0.01).abs() < 2e-6, "{last:?}");
    // 60 s of given-up blocks, beside the second since the last reading
    thermometer.give_up(59.0);
    thermometer.read(50.0);
    assert_eq!(thermometer.end_block(1.0), [50.0, 0.0]);
    for second in 1..10 {
        thermometer.read(50.0 - 0.1 * second as f32);
        assert_eq!(thermometer.end_block(1.0)[1], 0.0, "{second}");
    }
    thermometer.read(49.0);
    let [celsius, rate] = thermometer.end_block(1.0);
    assert!(celsius == 49.0 && (rate + 0.1).abs() < 2e-6, "{rate}");
    // while it is silent, the last reading stays, and after 60 s its rate is unknown
    let silent: Vec<[f32; 2]> = (0..61).map(|_| thermometer.end_block(1.0)).collect();
    assert!(silent[..60].iter().all(|output| *output == [49.0, rate]));
    assert_eq!(silent[60], [49.0, 0.0]);
}

#[test]
fn without_a_thermometer_or_with_a_broken_one_the_temperature_is_the_reference() {
    let mut thermometer = Thermometer::default();
    for celsius in [f32::NAN, f32::INFINITY, -273.0, 1e9] {
        thermometer.read(celsius);
        assert_eq!(thermometer.end_block(1.0), [REFERENCE_DEGC, 0.0]);
    }
}

proptest! {
    /// Compared with the variance of all samples in f64 by its definition.
    #[test]
    fn vibration_is_the_variance_of_the_forces(
        level in prop::array::uniform3(-2_000_000_000i32..2_000_000_000),
        noise in prop::collection::vec(prop::array::uniform3(-30_000i32..30_000), 1..2000),
        floats in any::<bool>(),
    ) {
        let per_unit = 2.5e-4;
        let mut vibration = Vibration::default();
        let mut values: Vec<[f64; 3]> = Vec::new();
        for (k, noise) in noise.iter().enumerate() {
            let counts: [i32; 3] = core::array::from_fn(|axis| level[axis] + noise[axis]);
            let sample = if floats {
                let accel = counts.map(|x| x as f32 * 1e-3);
                values.push(accel.map(f64::from));
                RawSample::Floats { gyro: [0.0; 3], accel }
            } else {
                values.push(counts.map(f64::from));
                RawSample::Counts { gyro: [0; 3], accel: counts }
            };
            vibration.add(k == 0, &sample);
        }
        let n = values.len() as f64;
        let expected: f64 = (0..3)
            .map(|axis| {
                let mean = values.iter().map(|v| v[axis]).sum::<f64>() / n;
                values.iter().map(|v| (v[axis] - mean).powi(2)).sum::<f64>() / n
            })
            .sum::<f64>() * per_unit * per_unit;
        let found = f64::from(vibration.mean_square(values.len() as u16, per_unit as f32));
        let scale = 1e4 * per_unit * per_unit;
        prop_assert!((found - expected).abs() <= 1e-3 * expected + 1e-6 * scale, "{found} for {expected}");
    }
}

#[test]
fn a_block_of_no_numbers_does_not_vibrate() {
    let mut vibration = Vibration::default();
    for (k, x) in [f32::NAN, 1.0, f32::INFINITY].into_iter().enumerate() {
        let sample = RawSample::Floats {
            gyro: [0.0; 3],
            accel: [x; 3],
        };
        vibration.add(k == 0, &sample);
    }
    assert_eq!(vibration.mean_square(3, 1.0), 0.0);
}
