use super::*;
use lrnn_nostd::{Normalisation, Weights};
use proptest::prelude::*;

const LSB: Lsb = Lsb {
    rad: 4.848e-7,
    mps: 1.226e-3,
};

/// A network whose output is `error` for every input.
fn constant(error: [f32; 3]) -> Net {
    let mut weights = Weights::zero();
    weights.layers[2].b = error;
    Net::new(
        weights,
        Normalisation {
            input_offset: [0.0; 3],
            input_scale: [1.0; 3],
            output_scale: [1.0; 3],
        },
    )
}

fn compensator(gyro: [f32; 3], accel: [f32; 3], limit: f32) -> Compensator {
    let limit = Limit {
        gyro: limit,
        accel: limit,
    };
    Compensator::new(constant(gyro), constant(accel), LSB, 0.005, 200, limit).unwrap()
}

proptest! {
    #[test]
    fn zero_correction_is_the_identity(
        samples in prop::collection::vec(any::<[i32; 6]>(), 1..500)
    ) {
        let c = compensator([0.0; 3], [0.0; 3], 1.0);
        let mut state = State::default();
        for w in samples {
            let sample = Counts { dtheta: [w[0], w[1], w[2]], dv: [w[3], w[4], w[5]] };
            prop_assert_eq!(c.process(&mut state, sample).0, sample);
        }
    }

    #[test]
    fn sum_of_corrections_is_exact_to_one_count(e in -1e-4f32..1e-4, a in -0.1f32..0.1) {
        let c = compensator([e, -e, 0.0], [a, 0.0, -a], 1.0);
        let mut state = State::default();
        let mut sum = [0i64; 6];
        let n = 20_000;
        for _ in 0..n {
            let (w, _) = c.process(&mut state, Counts::default());
            for (s, x) in sum.iter_mut().zip(w.dtheta.iter().chain(&w.dv)) {
                *s -= i64::from(*x);
            }
        }
        // the first block has no estimate yet
        let time = f64::from(n - 200) * 0.005;
        let want_g = f64::from(e) * time / LSB.rad;
        let want_a = f64::from(a) * time / LSB.mps;
        let close = |got: i64, want: f64| (got as f64 - want).abs() <= 1.0 + want.abs() * 1e-6;
        let gyro = close(sum[0], want_g) && close(sum[1], -want_g) && sum[2] == 0;
        prop_assert!(gyro, "{:?} {}", sum, want_g);
        let accel = close(sum[3], want_a) && sum[4] == 0 && close(sum[5], -want_a);
        prop_assert!(accel, "{:?} {}", sum, want_a);
    }
}

#[test]
fn corrections_are_clipped_and_counted() {
    let c = compensator([1.0, 0.0, 0.0], [0.0; 3], 0.25);
    let mut state = State::default();
    let mut last = None;
    for _ in 0..400 {
        last = c.process(&mut state, Counts::default()).1.or(last);
    }
    assert_eq!(last.unwrap().rate_error, [0.25, 0.0, 0.0]);
    assert_eq!((state.clipped, state.faults), (2, 0));
}

proptest! {
    /// For all weights, even when one of their bits flips on the way, and for all inputs: the sum
    /// of the corrections over any stretch of time is at most the limit times that time, to one
    /// count.
    #[test]
    fn no_correction_exceeds_the_limit(
        bits in prop::collection::vec(any::<u32>(), 126),
        small in any::<bool>(),
        inputs in prop::collection::vec(any::<[i32; 6]>(), 1..40),
        upset in (0usize..126, 0u32..32, 0usize..1000),
        slow in any::<bool>(),
    ) {
        let limit = Limit { gyro: 3e-5, accel: 2e-2 };
        let weight = |k: usize| match small {
            // plausible weights, so that the networks live
            true => (bits[k] as f32 / u32::MAX as f32 - 0.5) * 4.0,
            false => f32::from_bits(bits[k]),
        };
        let nets = [0, 63].map(|first| {
            let mut w = Weights::zero();
            w.set_all(&core::array::from_fn::<f32, 63, _>(|i| weight(first + i)));
            Net::new(w, Normalisation::identity())
        });
        let mut c = Compensator::new(nets[0], nets[1], LSB, 0.005, 10, limit).unwrap();
        c.set_slew(slow.then_some(Limit { gyro: 1e-6, accel: 1e-3 }));
        let mut state = c.power_on(false);
        let most = [limit.gyro, limit.accel].map(f64::from);
        let most = [most[0] * 0.005 / LSB.rad, most[1] * 0.005 / LSB.mps];
        let (mut taken, mut n) = ([0i64; 6], 0u32);
        for k in 0..1000 {
            if k == upset.2 {
                let net = if upset.0 < 63 { &mut c.gyro } else { &mut c.accel };
                let mut all = net.weights.to_array();
                all[upset.0 % 63] = f32::from_bits(all[upset.0 % 63].to_bits() ^ (1 << upset.1));
                net.weights.set_all(&all);
            }
            // far from the ends of the range, where the sample itself saturates
            let w = inputs[k % inputs.len()].map(|x| x / 2);
            let sample = Counts { dtheta: [w[0], w[1], w[2]], dv: [w[3], w[4], w[5]] };
            let (out, _) = c.process(&mut state, sample);
            n += 1;
            for (i, (o, w)) in out.dtheta.iter().chain(&out.dv).zip(w).enumerate() {
                taken[i] += i64::from(w) - i64::from(*o);
                let bound = most[i / 3] * f64::from(n) * (1.0 + 1e-6) + 1.0;
                prop_assert!(taken[i].abs() as f64 <= bound, "{} of {}", taken[i], bound);
            }
        }
    }
}

#[test]
fn at_power_on_the_output_bias_is_in_force() {
    let c = compensator([1e-5, 0.0, -2.0], [f32::NAN, 0.5, 0.0], 0.25);
    assert_eq!(
        c.power_on(false).estimate(),
        [[1e-5, 0.0, -0.25], [0.0, 0.25, 0.0]]
    );
    assert_eq!(c.power_on(true).estimate(), [[0.0; 3]; 2]);
    assert!(c.power_on(true).off);
}

#[test]
fn block_mean_is_the_mean_input() {
    let c = compensator([0.0; 3], [0.0; 3], 1.0);
    let mut state = State::default();
    let mut block = None;
    for k in 0..200 {
        let sample = Counts {
            dtheta: [k, 100, 0],
            dv: [0, 0, -40],
        };
        block = c.process(&mut state, sample).1;
    }
    let b = block.unwrap();
    assert!((f64::from(b.sources.rate[0]) - 99.5 * LSB.rad / 0.005).abs() < 1e-8);
    assert!((f64::from(b.sources.force[2]) + 40.0 * LSB.mps / 0.005).abs() < 1e-5);
}

#[test]
fn wrong_configuration_is_named() {
    let net = || constant([0.0; 3]);
    let limit = Limit {
        gyro: 1.0,
        accel: 1.0,
    };
    let build = |lsb, dt, n, limit| Compensator::new(net(), net(), lsb, dt, n, limit).err();
    assert_eq!(
        build(Lsb { rad: 0.0, mps: 1.0 }, 0.01, 1, limit),
        Some(ConfigError::Lsb)
    );
    assert_eq!(
        build(LSB, f64::NAN, 1, limit),
        Some(ConfigError::SamplePeriod)
    );
    assert_eq!(build(LSB, 0.01, 0, limit), Some(ConfigError::BlockSamples));
    assert_eq!(
        build(
            LSB,
            0.01,
            1,
            Limit {
                gyro: -1.0,
                accel: 0.0
            }
        ),
        Some(ConfigError::Limit)
    );
}
