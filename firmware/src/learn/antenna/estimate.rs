//! Estimates of the antenna, for other modules.

use super::Antenna;
use crate::learn::prior::NAV;
use crate::nav::vector::{dot, matrix32};

/// Estimates of the antenna.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AntennaEstimate {
    /// Lever arm from the IMU to the antenna, body axes (forward, right, down), m.
    pub lever_arm: [f32; 3],
    /// Standard deviation of the lever arm along each axis, m.
    pub lever_arm_sigma: [f32; 3],
    /// Least age of a fix when it arrives, s.
    pub fix_delay: f32,
    /// Standard deviation of the delay, s.
    pub fix_delay_sigma: f32,
}

impl AntennaEstimate {
    /// No estimates.
    pub(super) const NONE: AntennaEstimate = AntennaEstimate {
        lever_arm: [0.0; 3],
        lever_arm_sigma: [f32::INFINITY; 3],
        fix_delay: 0.0,
        fix_delay_sigma: f32::INFINITY,
    };
}

impl Antenna {
    /// Renews what is known, for reading.
    pub(super) fn report(&mut self) {
        let [w, x, y, z] = self.mounting;
        let to_body = matrix32([w, x, y, z]);
        let p = self.filter.covariance().errors();
        let axis = |row: &[f32; 3]| {
            let mut variance = 0.0;
            for (a, p) in row.iter().zip(p.iter().skip(NAV)) {
                for (b, p) in row.iter().zip(p.iter().skip(NAV)) {
                    variance += a * b * p;
                }
            }
            libm::sqrtf(variance.max(0.0))
        };
        let [arm, .., delay] = self.sigma;
        let (arm_sigma, delay_sigma) = if self.begun && self.estimates() {
            (to_body.each_ref().map(axis), self.age_sigma())
        } else {
            ([arm; 3], delay)
        };
        self.estimate = AntennaEstimate {
            lever_arm: to_body.map(|row| dot(row, self.arm)),
            lever_arm_sigma: arm_sigma,
            fix_delay: self.age,
            fix_delay_sigma: delay_sigma,
        };
    }
}
