//! Samples as integer counts, also of a sensor that sends floats.

use crate::sample::{Counts, Lsb, RawSample};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Largest angle (rad) and change of velocity (m/s) of a float sample that the counts can hold:
/// more than a navigator believes.
const LARGEST: [f64; 2] = [1.0, 20.0];

/// Value of a count, and how samples become counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Value of a count.
    pub lsb: Lsb,
    /// Counts of 1.0 in a float sample: powers of two, so that hardly anything is rounded.
    per_float: [f32; 2],
}

impl Scale {
    /// Scale for samples of this kind, where `lsb` is the value of a count or of 1.0.
    pub fn of(sample: &RawSample, lsb: &Lsb) -> Scale {
        let RawSample::Floats { .. } = sample else {
            return Scale::counts_of(*lsb);
        };
        let of = |value: f64, largest: f64| {
            // the largest power of two with which `largest` fits into 31 bits
            let room = f64::from(1 << 30) * value / largest;
            libm::ilogb(room).clamp(-60, 60)
        };
        let powers = [of(lsb.rad, LARGEST[0]), of(lsb.mps, LARGEST[1])];
        Scale {
            lsb: Lsb {
                rad: libm::scalbn(lsb.rad, -powers[0]),
                mps: libm::scalbn(lsb.mps, -powers[1]),
            },
            per_float: powers.map(|power| libm::scalbnf(1.0, power)),
        }
    }

    /// Scale for samples in counts.
    pub fn counts_of(lsb: Lsb) -> Scale {
        Scale {
            lsb,
            per_float: [0.0; 2],
        }
    }

    /// A sample in counts.
    pub fn counts(&self, sample: &RawSample) -> Counts {
        match sample {
            RawSample::Counts { gyro, accel } => Counts {
                dtheta: *gyro,
                dv: *accel,
            },
            RawSample::Floats { gyro, accel } => {
                // to the nearest; `as` saturates and makes 0 of NaN
                let [g, a] = self.per_float;
                Counts {
                    dtheta: gyro.map(|x| libm::roundf(x * g) as i32),
                    dv: accel.map(|x| libm::roundf(x * a) as i32),
                }
            }
        }
    }
}

/// The largest divisor of `whole` that is no greater than `most`, so that a whole number of pieces
/// makes a block.
pub fn divisor(whole: u16, most: u16) -> u16 {
    let fits = |part: &u16| whole.is_multiple_of(*part);
    (1..=most).rev().find(fits).unwrap_or(1)
}

/// The gyros' three of six values, and the accelerometers'.
pub fn split([a, b, c, d, e, f]: &[f32; OUTPUTS]) -> [[f32; 3]; 2] {
    [[*a, *b, *c], [*d, *e, *f]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_divided() {
        for (whole, most, part) in [
            (250, 13, 10),
            (200, 10, 10),
            (7, 5, 1),
            (1, 1, 1),
            (10, 50, 10),
        ] {
            assert_eq!(divisor(whole, most), part);
        }
    }

    #[test]
    fn counts_stay_and_floats_keep_their_digits() {
        let lsb = Lsb {
            rad: 1.0,
            mps: 9.806_65e-3,
        };
        let counts = RawSample::Counts {
            gyro: [1, -2, i32::MAX],
            accel: [0; 3],
        };
        let scale = Scale::of(&counts, &lsb);
        assert_eq!(
            (scale.lsb, scale.counts(&counts).dtheta),
            (lsb, [1, -2, i32::MAX])
        );
        let floats = RawSample::Floats {
            gyro: [1.25e-4, -0.49, f32::NAN],
            accel: [1.0, -1e3, 0.02],
        };
        let scale = Scale::of(&floats, &lsb);
        let got = scale.counts(&floats);
        assert!(scale.lsb.rad < 2e-9 && scale.lsb.mps < 4e-8, "{scale:?}");
        let RawSample::Floats { gyro, accel } = floats else {
            return;
        };
        for i in 0..3 {
            let (rad, mps) = (f64::from(gyro[i]), f64::from(accel[i]) * lsb.mps);
            if rad.is_finite() {
                assert!((f64::from(got.dtheta[i]) * scale.lsb.rad - rad).abs() <= scale.lsb.rad);
            }
            assert!((f64::from(got.dv[i]) * scale.lsb.mps - mps).abs() <= scale.lsb.mps);
        }
        assert_eq!(got.dtheta[2], 0);
    }
}
