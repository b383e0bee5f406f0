//! Quantises increments: the whole counts that a sensor would have sent.

use crate::inertial::sins::Increment;
use firmware::sample::{Counts, Lsb};
use nalgebra::Vector3;
use std::borrow::Borrow;

/// Count value for files that hold decimal numbers. It is so fine that rounding has no effect: its
/// remainder is carried over, so that the sum errs by 1e-9 rad or 0.0002 arcsec at most. It is
/// coarse enough for an increment of 2.1 rad and 21 m/s.
pub const FINE_LSB: Lsb = Lsb {
    rad: 1e-9,
    mps: 1e-8,
};

/// Rounds increments to counts and carries the remainders over, so that the sums of both agree to
/// half a count.
///
/// # Errors
/// Index of the first increment that does not fit.
pub fn quantise(
    increments: impl IntoIterator<Item = impl Borrow<Increment>>,
    lsb: &Lsb,
) -> Result<Vec<Counts>, usize> {
    rounded(increments, lsb).collect()
}

/// [`quantise`] one by one. After an error (the index of an increment that does not fit) the rest
/// is invalid.
pub fn rounded(
    increments: impl IntoIterator<Item = impl Borrow<Increment>>,
    lsb: &Lsb,
) -> impl Iterator<Item = Result<Counts, usize>> {
    let mut remainder = Increment::default();
    let round = |exact: Vector3<f64>, remainder: &mut Vector3<f64>| {
        let due = exact + *remainder;
        let counts = due.map(f64::round);
        *remainder = due - counts;
        // false for NaN, too
        let fits = counts.iter().all(|c| c.abs() <= f64::from(i32::MAX));
        fits.then_some([counts.x as i32, counts.y as i32, counts.z as i32])
    };
    increments
        .into_iter()
        .enumerate()
        .map(move |(k, increment)| {
            let increment = increment.borrow();
            let dtheta = round(increment.dtheta / lsb.rad, &mut remainder.dtheta).ok_or(k)?;
            let dv = round(increment.dv / lsb.mps, &mut remainder.dv).ok_or(k)?;
            Ok(Counts { dtheta, dv })
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_follow_the_sum() {
        let increment = Increment {
            dtheta: Vector3::new(0.3e-9, -7.77e-9, 0.0),
            dv: Vector3::new(0.0, 0.49e-8, -0.098),
        };
        let counts = quantise(vec![increment; 1000], &FINE_LSB).unwrap();
        let sum = |f: &dyn Fn(&Counts) -> i32| counts.iter().map(|c| i64::from(f(c))).sum::<i64>();
        assert_eq!(sum(&|c| c.dtheta[0]), 300);
        assert_eq!(sum(&|c| c.dtheta[1]), -7770);
        assert_eq!(sum(&|c| c.dv[1]), 490);
        assert_eq!(sum(&|c| c.dv[2]), -9_800_000_000);
    }

    #[test]
    fn increments_that_do_not_fit_are_named() {
        let mut increments = vec![Increment::default(); 5];
        increments[3].dv.y = 22.0;
        assert_eq!(quantise(&increments, &FINE_LSB).unwrap_err(), 3);
        increments[3].dv.y = f64::NAN;
        assert_eq!(quantise(&increments, &FINE_LSB).unwrap_err(), 3);
    }
}
