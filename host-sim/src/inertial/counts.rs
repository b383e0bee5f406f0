//! Increments as counts: the whole pulses that a sensor would have sent.

use crate::inertial::sins::Increment;
use firmware::sample::{Counts, Lsb};
use nalgebra::Vector3;

/// Count value for files that hold decimal numbers: so fine that rounding, which is carried to the next word, never shows (1e-9 rad in
/// all is 0.0002 arcsec), and coarse enough that a word holds 2.1 rad and 21 m/s.
pub const FINE_LSB: Lsb = Lsb {
    rad: 1e-9,
    mps: 1e-8,
};

/// Counts whose sums follow the sums of `words` to half a count: what rounding leaves is carried.
///
/// # Errors
/// Index of the first word that does not fit.
pub fn quantise(words: &[Increment], lsb: &Lsb) -> Result<Vec<Counts>, usize> {
    let mut left = Increment::default();
    let whole = |exact: Vector3<f64>, rest: &mut Vector3<f64>| {
        let due = exact + *rest;
        let counts = due.map(f64::round);
        *rest = due - counts;
        // also false for NaN
        let fits = counts.iter().all(|c| c.abs() <= f64::from(i32::MAX));
        fits.then_some([counts.x as i32, counts.y as i32, counts.z as i32])
    };
    let mut out = Vec::with_capacity(words.len());
    for (k, word) in words.iter().enumerate() {
        let dtheta = whole(word.dtheta / lsb.rad, &mut left.dtheta).ok_or(k)?;
        let dv = whole(word.dv / lsb.mps, &mut left.dv).ok_or(k)?;
        out.push(Counts { dtheta, dv });
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_follow_the_sum() {
        let word = Increment {
            dtheta: Vector3::new(0.3e-9, -7.77e-9, 0.0),
            dv: Vector3::new(0.0, 0.49e-8, -0.098),
        };
        let counts = quantise(&vec![word; 1000], &FINE_LSB).unwrap();
        let sum = |f: &dyn Fn(&Counts) -> i32| counts.iter().map(|c| i64::from(f(c))).sum::<i64>();
        assert_eq!(sum(&|c| c.dtheta[0]), 300);
        assert_eq!(sum(&|c| c.dtheta[1]), -7770);
        assert_eq!(sum(&|c| c.dv[1]), 490);
        assert_eq!(sum(&|c| c.dv[2]), -9_800_000_000);
    }

    #[test]
    fn words_that_do_not_fit_are_named() {
        let mut words = vec![Increment::default(); 5];
        words[3].dv.y = 22.0;
        assert_eq!(quantise(&words, &FINE_LSB).unwrap_err(), 3);
        words[3].dv.y = f64::NAN;
        assert_eq!(quantise(&words, &FINE_LSB).unwrap_err(), 3);
    }
}
