//! The error terms of the simulated sensor: as the file gives them, or derived from the datasheet.

use super::Unit;
use super::triads::MRAD;
use crate::inertial::counts::FINE_LSB;
use crate::inertial::units::{ARCSEC, UG};
use crate::simulator::imu::{AccelSpec, BlockSpec, GyroSpec, ImuSpec};

/// The simulator takes at most so many samples a second, Hz.
const MOST_HZ: f64 = 4000.0;

impl Unit {
    /// The table `[simulation]`. Without it the terms follow from the datasheet: the bias at
    /// power-on is drawn anew at each turn-on; in run it walks at random and reaches the
    /// datasheet's value in an hour; white noise, scale factor, misalignment, g-sensitivity and the
    /// second-order coefficient are the datasheet's. Values are not rounded to the counts of the
    /// frames. A sensor faster than 4000 Hz is simulated at a whole fraction of its rate.
    #[must_use]
    pub fn simulated(&self) -> ImuSpec {
        let given = self.simulation.clone();
        given.unwrap_or_else(|| self.derived())
    }

    fn derived(&self) -> ImuSpec {
        let (g, a) = (&self.gyro, &self.accel);
        let arcsec = |mrad: f64| mrad * MRAD / ARCSEC;
        let rate = self.sensor.rate();
        let rate = rate / (rate / MOST_HZ).ceil();
        ImuSpec {
            rate_hz: (rate.round() as u32).max(10),
            gyro: GyroSpec {
                bias_turn_on_dph: g.bias_turn_on_dph,
                rate_random_walk_dphpsqrth: g.bias_in_run_dph,
                angle_random_walk_dpsqrth: g.angle_random_walk_dpsqrth,
                scale_ppm: g.scale_ppm,
                misalignment_arcsec: arcsec(g.misalignment_mrad),
                g_sensitivity_dphpg: g.g_sensitivity_dphpg,
                pulse_arcsec: FINE_LSB.rad / ARCSEC,
                ..GyroSpec::none()
            },
            accel: AccelSpec {
                bias_turn_on_ug: a.bias_turn_on_ug,
                acceleration_random_walk_ugpsqrth: a.bias_in_run_ug,
                velocity_random_walk_ugpsqrthz: a.velocity_random_walk_ugpsqrthz,
                scale_ppm: a.scale_ppm,
                misalignment_arcsec: arcsec(a.misalignment_mrad),
                k2_ugpg2: a.second_order_ugpg2,
                pulse_ugs: FINE_LSB.mps / UG,
                ..AccelSpec::none()
            },
            block: BlockSpec::default(),
        }
    }
}
