use super::*;
use crate::compensator::Limit;
use crate::sample::{Counts, Lsb};
use lrnn_nostd::{Net, Normalisation, State as NetState, Weights};

const LSB: Lsb = Lsb {
    rad: 4.848e-7,
    mps: 1.226e-3,
};
const LIMIT: Limit = Limit {
    gyro: 1e-3,
    accel: 1e-1,
};
/// A thousandth of the limit a second.
const SLEW: Limit = Limit {
    gyro: 1e-6,
    accel: 1e-4,
};
const SAMPLES: u16 = 10;

/// Networks whose output follows their inputs.
fn nets(offset: f32) -> Nets {
    let net = |input: f32, output: f32| {
        let mut weights = Weights::zero();
        for layer in &mut weights.layers {
            for (i, row) in layer.w.iter_mut().enumerate() {
                row[i] = 1.0;
            }
        }
        weights.layers[2].b = [offset; 3];
        let scales = Normalisation {
            input_offset: [0.0; 3],
            input_scale: [input; 3],
            output_scale: [output; 3],
        };
        Net::new(weights, scales)
    };
    Nets {
        gyro: net(10.0, LIMIT.gyro / 2.0),
        accel: net(1.0, LIMIT.accel / 2.0),
        maps: Nets::NONE.maps,
    }
}

/// The compensator with these networks, without and with the slew limit.
fn pair(nets: Nets) -> [(Compensator, State); 2] {
    [None, Some(SLEW)].map(|slew| {
        let (gyro, accel) = (nets.gyro, nets.accel);
        let made = Compensator::new(gyro, accel, LSB, 0.1, SAMPLES, LIMIT);
        let mut made = made.expect("in range");
        let state = made.power_on(false);
        made.set_slew(slew);
        (made, state)
    })
}

/// A block of samples that changes from block to block.
fn block(of: &mut (Compensator, State), number: i32) -> [[f32; 3]; 2] {
    let (made, state) = of;
    for _ in 0..SAMPLES {
        let rate = 20_000 - 3_000 * (number % 13);
        let sample = Counts {
            dtheta: [rate, -rate, rate / 2],
            dv: [80, 8 * (number % 11), -40],
        };
        made.process(state, sample);
    }
    state.estimate()
}

/// Largest difference between two estimates, in slew limits.
fn slews(a: &[[f32; 3]; 2], b: &[[f32; 3]; 2]) -> f32 {
    let each = a.iter().zip(b).zip([SLEW.gyro, SLEW.accel]);
    let of = |((a, b), slew): ((&[f32; 3], &[f32; 3]), f32)| {
        let off = a.iter().zip(b).map(|(a, b)| (a - b).abs() / slew);
        off.fold(0.0, f32::max)
    };
    each.map(of).fold(0.0, f32::max)
}

/// While the same networks stay in force, the correction is the same, bit for bit, as without a
/// slew limit, although it changes more than fifty times faster than that limit.
#[test]
fn a_correction_follows_its_networks() {
    let [mut free, mut slow] = pair(nets(0.0));
    // up to the alignment there is no limit
    slow.0.set_slew(None);
    let mut last = block(&mut free, 0);
    assert_eq!(block(&mut slow, 0), last);
    slow.0.set_slew(Some(SLEW));
    block(&mut free, 1);
    block(&mut slow, 1);
    let mut fastest = 0.0f32;
    for number in 2..40 {
        let now = block(&mut free, number);
        assert_eq!(block(&mut slow, number), now, "{number}");
        fastest = fastest.max(slews(&now, &last));
        last = now;
    }
    assert!(fastest > 50.0, "{fastest}");
}

/// Other networks, correction off and on again, a correction that was held: the way to the new
/// correction is one slew limit a block, while the networks' output goes its own way.
#[test]
fn what_somebody_decides_comes_slowly() {
    let [mut free, mut slow] = pair(nets(0.0));
    for number in 0..20 {
        slow.0.set_slew((number > 3).then_some(SLEW));
        block(&mut free, number);
        block(&mut slow, number);
    }
    assert_eq!(slow.1.estimate(), free.1.estimate());
    let comes = |free: &mut (Compensator, State), slow: &mut (Compensator, State), first: i32| {
        let mut was = slow.1.estimate();
        let at_once = slews(&block(free, first), &was);
        let now = block(slow, first);
        assert!(slews(&now, &was) <= 1.01, "a jump: {}", slews(&now, &was));
        assert!(at_once > 40.0, "{at_once}");
        was = now;
        let mut left = slews(&was, &free.1.estimate());
        for number in first + 1..first + 2000 {
            let now = slews(&block(slow, number), &block(free, number));
            assert!((left - now - left.min(1.0)).abs() < 0.02, "{left} {now}");
            left = now;
        }
        assert_eq!(slow.1.estimate(), free.1.estimate());
    };
    for of in [&mut free, &mut slow] {
        of.0.exchange(&mut of.1, nets(0.6), [NetState::new(); 2]);
    }
    comes(&mut free, &mut slow, 20);
    (free.1.off, slow.1.off) = (true, true);
    comes(&mut free, &mut slow, 20);
    assert!(slow.1.is_zero());
    (free.1.off, slow.1.off) = (false, false);
    comes(&mut free, &mut slow, 20);
    slow.1.hold = true;
    for number in 2019..2026 {
        block(&mut free, number);
        block(&mut slow, number);
    }
    slow.1.hold = false;
    comes(&mut free, &mut slow, 2026);
}

/// A bit flips in what the correction follows: no jump comes of it.
#[test]
fn a_flipped_bit_of_what_is_followed_is_noticed() {
    let [_, mut made] = pair(nets(0.0));
    for number in 0..20 {
        made.0.set_slew((number > 3).then_some(SLEW));
        block(&mut made, number);
    }
    let mut intact = made.clone();
    let right = block(&mut intact, 20);
    let was = made.1.estimate();
    for bit in 0..32 {
        for (triad, axis) in [(0, 0), (0, 2), (1, 1)] {
            let mut upset = made.clone();
            if let Some(followed) = &mut upset.1.followed {
                let value = &mut followed[triad][axis];
                *value = f32::from_bits(value.to_bits() ^ 1 << bit);
            }
            let now = block(&mut upset, 20);
            assert_eq!(upset.1.mended, 1, "{bit}");
            let on_the_way = slews(&now, &was).min(slews(&now, &right));
            assert!(on_the_way <= 1.01, "{bit}: {on_the_way}");
        }
    }
}
