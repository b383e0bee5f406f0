//! Estimates of the matching filter.

use super::LEAST_FIXES;
use super::filter::{Biased, COSINE, ERRORS, Filter, SINE};
use crate::control::Way;

impl Filter {
    /// The velocity of `H`, north and east, m/s.
    pub fn velocity(&self) -> [f32; 2] {
        self.velocity
    }

    /// The filter, for the hand-over.
    pub fn kalman(&self) -> &Biased {
        &self.kalman
    }

    /// Estimates of cosine and sine.
    pub fn azimuth(&self) -> [f32; 2] {
        let [.., cosine, sine, _] = *self.kalman.error_state();
        [1.0 - cosine, -sine]
    }

    /// Whether no heading has been given yet.
    pub fn wants_heading(&self) -> bool {
        !self.heading
    }

    /// Fixes used.
    pub fn fixes(&self) -> u16 {
        self.fixes
    }

    /// Mean normalised innovation squared.
    pub fn residual(&self) -> f32 {
        if self.fixes < LEAST_FIXES {
            0.0
        } else {
            self.residual
        }
    }

    /// Source of the heading.
    pub fn way(&self) -> Way {
        match (self.heading, self.course) {
            (true, _) => Way::Heading,
            (_, true) => Way::Course,
            _ => Way::Velocity,
        }
    }

    /// Standard deviations of the tilt and of the attitude about down in `w`, rad.
    pub fn attitude_sigma(&self) -> (f32, f32) {
        let of = |i| self.kalman.covariance().variance(i);
        (libm::sqrtf(of(0).max(of(1))), libm::sqrtf(of(2)))
    }

    /// Root of `c^2 + s^2`, and its standard deviation.
    pub fn norm(&self) -> (f32, f32) {
        let [c, s] = self.azimuth();
        let norm = libm::hypotf(c, s);
        let mut row = [0.0; ERRORS];
        (row[COSINE], row[SINE]) = (c / norm, s / norm);
        (norm, self.sigma_of(&row))
    }

    /// Standard deviation of the heading, rad. Infinite while the norm may be 0.
    pub fn heading_sigma(&self) -> f32 {
        let (norm, sigma) = self.norm();
        if norm.is_nan() || norm <= 3.0 * sigma {
            return f32::INFINITY;
        }
        let mut row = azimuth_row(self.azimuth());
        row[2] -= 1.0;
        self.sigma_of(&row)
    }

    /// Standard deviation of a combination of the errors.
    fn sigma_of(&self, row: &[f32; ERRORS]) -> f32 {
        let all = self.kalman.covariance().errors();
        let variance = row.iter().zip(all).fold(0.0, |sum, (&a, of)| {
            let inner = of.iter().zip(row).fold(0.0, |sum, (p, b)| sum + p * b);
            sum + a * inner
        });
        libm::sqrtf(variance.max(0.0))
    }
}

/// The error of the azimuth, estimate minus truth, by the errors of cosine and sine.
pub fn azimuth_row([c, s]: [f32; 2]) -> [f32; ERRORS] {
    let per = 1.0 / (c * c + s * s);
    let mut row = [0.0; ERRORS];
    // the state holds 1 - c and -s, whose errors are the negative of those of c and s, and the
    // state is truth where the estimate has been taken out
    (row[COSINE], row[SINE]) = (-s * per, c * per);
    row
}
