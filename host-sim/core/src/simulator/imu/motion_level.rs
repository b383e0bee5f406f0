//! Vibration and rate of a unit: means over a second, for the errors that follow them.

use super::spec::ImuSpec;
use nalgebra::Vector3;

/// Sums over the present second.
#[derive(Debug, Clone, Default)]
pub(super) struct MotionLevel {
    /// Mean square of the vibration above the sample rate over that of the samples.
    above_ratio: f64,
    samples: f64,
    turned: f64,
    force: Vector3<f64>,
    squares: Vector3<f64>,
}

impl MotionLevel {
    /// `None` if no error of the IMU follows it.
    pub fn of(spec: &ImuSpec) -> Option<Self> {
        let (gyro, accel) = (&spec.gyro.environment, &spec.accel.environment);
        let sizes = [
            gyro.vibration_saturation_dph,
            gyro.self_heating_dphpdps,
            accel.vibration_saturation_ug,
        ];
        sizes.iter().any(|size| *size > 0.0).then(|| Self {
            above_ratio: spec.accel.vibration_above_ratio,
            ..Self::default()
        })
    }

    /// Adds a sample: rate, rad/s, and specific force, m/s2.
    pub fn add(&mut self, rate: &Vector3<f64>, force: &Vector3<f64>) {
        self.samples += 1.0;
        self.turned += rate.norm();
        self.force += force;
        self.squares += force.component_mul(force);
    }

    /// Means of the second that ends here: mean square of the specific force about its mean, sum
    /// over the axes, with the part above the sample rate, (m/s2)^2; mean magnitude of the rate,
    /// rad/s. Zero without samples.
    pub fn take(&mut self) -> [f64; 2] {
        let empty = Self {
            above_ratio: self.above_ratio,
            ..Self::default()
        };
        let s = std::mem::replace(self, empty);
        if s.samples == 0.0 {
            return [0.0; 2];
        }
        let mean = s.force / s.samples;
        let about = (s.squares / s.samples).sum() - mean.norm_squared();
        [(1.0 + s.above_ratio) * about.max(0.0), s.turned / s.samples]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_is_its_mean_square_and_mean_magnitude() {
        let mut spec = ImuSpec::preset("medium").unwrap();
        assert!(MotionLevel::of(&spec).is_none());
        spec.gyro.environment.self_heating_dphpdps = 1.0;
        spec.accel.vibration_above_ratio = 3.0;
        let mut level = MotionLevel::of(&spec).unwrap();
        assert_eq!(level.take(), [0.0; 2]);
        for second in [1.0, 2.0] {
            for k in 0..100 {
                let sign = if k % 2 == 0 { second } else { -second };
                let force = Vector3::new(0.3 * sign, 5.0, -9.8 + 0.4 * sign);
                level.add(&Vector3::new(0.0, 0.6 * sign, -0.8 * sign), &force);
            }
            let [vibration, turning] = level.take();
            // 0.3^2 + 0.4^2, and three times that above the sample rate
            assert!((vibration - second * second).abs() < 1e-9, "{vibration}");
            assert!((turning - second).abs() < 1e-12, "{turning}");
        }
    }
}
