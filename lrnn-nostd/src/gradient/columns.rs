//! Memory layout of the sensitivities of a layer.
//!
//! A Cortex-M reads the three values of a parameter from one address (and several at a time). A
//! desktop works on several parameters at once, which must be neighbours. The values have the same
//! bits in both layouts.

use crate::real::Real;
use crate::shape::NEURONS;

/// Whether the three values of a parameter are adjacent in memory.
pub(super) const BY_COLUMN: bool = cfg!(all(target_arch = "arm", target_abi = "eabihf"));

/// dy_j/dtheta of N parameters and three units j.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub(super) struct Columns<T, const N: usize>(Values<T, N>);

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
type Values<T, const N: usize> = [[T; NEURONS]; N];
#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
type Values<T, const N: usize> = [[T; N]; NEURONS];

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
impl<T: Real, const N: usize> Columns<T, N> {
    pub(super) const ZERO: Self = Self([[T::ZERO; NEURONS]; N]);

    /// The values of one parameter, `theta` < N.
    #[inline(always)]
    pub(super) fn at(&self, theta: usize) -> [T; NEURONS] {
        self.0[theta]
    }

    /// Sets the values of one parameter, `theta` < N.
    #[inline(always)]
    pub(super) fn put(&mut self, theta: usize, values: [T; NEURONS]) {
        self.0[theta] = values;
    }
}

#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
impl<T: Real, const N: usize> Columns<T, N> {
    pub(super) const ZERO: Self = Self([[T::ZERO; N]; NEURONS]);

    /// The values of one parameter, `theta` < N.
    #[inline(always)]
    pub(super) fn at(&self, theta: usize) -> [T; NEURONS] {
        let [a, b, c] = &self.0;
        [a[theta], b[theta], c[theta]]
    }

    /// Sets the values of one parameter, `theta` < N.
    #[inline(always)]
    pub(super) fn put(&mut self, theta: usize, values: [T; NEURONS]) {
        for j in 0..NEURONS {
            self.0[j][theta] = values[j];
        }
    }
}

impl<T: Real, const N: usize> Columns<T, N> {
    /// Adds to the value of unit `j` < 3 of one parameter, `theta` < N.
    #[inline(always)]
    pub(super) fn add(&mut self, theta: usize, j: usize, more: T) {
        let mut values = self.at(theta);
        values[j] += more;
        self.put(theta, values);
    }

    /// Whether every value is finite.
    #[inline]
    pub(super) fn is_finite(&self) -> bool {
        // Without an early exit, so that several values are checked at once.
        let values = self.0.as_flattened();
        values
            .iter()
            .fold(true, |all, value| all & value.is_finite())
    }
}
