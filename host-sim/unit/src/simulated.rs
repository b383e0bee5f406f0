//! The error terms of the simulated sensor: as the file gives them, or derived from the datasheet.

use super::Unit;
use super::sensor::FormatName;
use super::triads::MRAD;
use host_core::inertial::counts::FINE_LSB;
use host_core::inertial::units::{ARCSEC, UG};
use host_core::simulator::imu::{
    AccelSpec, BlockSpec, GyroSpec, ImuSpec, ThermometerSpec, World, thermometer,
};

/// Highest sample rate of the simulator, Hz.
const MOST_HZ: f64 = 4000.0;

impl Unit {
    /// The table `[simulation]`. Without it the terms follow from the datasheet: the bias at
    /// power-on is drawn again at each turn-on; in run it walks at random and reaches the
    /// datasheet's value in an hour; white noise, scale factor, misalignment, g-sensitivity and the
    /// second-order coefficient are the datasheet's. Values are not rounded to the counts of the
    /// frames. A sensor faster than 4000 Hz is simulated at a whole fraction of its rate.
    #[must_use]
    pub fn simulated(&self) -> ImuSpec {
        let given = self.simulation.clone();
        given.unwrap_or_else(|| self.derived())
    }

    /// The thermometers in the frames of the sensor, with their resolution. A format that is not
    /// listed has so fine a resolution that nothing is rounded, or no thermometer.
    fn thermometer(&self) -> ThermometerSpec {
        let sensor = &self.sensor;
        let at_line = sensor.adis_uart.clone().unwrap_or_default().model;
        let at_spi = sensor.adis.as_ref().map(|adis| adis.model.as_str());
        let adis = |model: &str| match model.starts_with("ADIS1649") {
            true => thermometer::ADIS_1649X_K,
            false => thermometer::ADIS_1650X_K,
        };
        let resolution_k = match sensor.format {
            FormatName::Stim300 => thermometer::STIM300_K,
            FormatName::Hg4930 => thermometer::HG4930_K,
            FormatName::Kvh => thermometer::KVH_K,
            FormatName::AdisUart => adis(&at_line),
            FormatName::AdisSpi => adis(at_spi.unwrap_or_default()),
            _ => 0.0,
        };
        ThermometerSpec {
            per_axis: sensor.format == FormatName::Stim300,
            resolution_k,
            ..ThermometerSpec::default()
        }
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
            nodes: None,
            thermometer: self.thermometer(),
            world: World::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::sins::Increment;
    use host_core::inertial::units::DEG_PER_H;
    use host_core::simulator::imu::Imu;

    /// Counts a kelvin, from the makers' manuals.
    #[test]
    fn the_thermometers_have_the_resolution_of_the_format() {
        for (unit, counts, per_axis) in [
            ("stim300", 256.0, true),
            ("hg4930", 1.0, false),
            ("kvh1750", 1.0, false),
            ("adis16505", 10.0, false),
            ("adis16495", 80.0, false),
        ] {
            let thermometer = Unit::preset(unit).unwrap().simulated().thermometer;
            assert!(
                (thermometer.resolution_k * counts - 1.0).abs() < 1e-12,
                "{unit}"
            );
            assert_eq!(thermometer.per_axis, per_axis, "{unit}");
        }
    }

    /// The biases that the presets with all causes state are those that the causes give: the rms
    /// over units, turn-ons and the first 44 min at rest. Those of `mems` hold a year after
    /// calibration.
    #[test]
    fn the_presets_with_all_causes_state_their_biases() {
        let mut off = vec![];
        for (name, age_days) in [("fog", 0.0), ("mems", 365.0)] {
            let unit = Unit::preset(name).unwrap();
            let mut spec = unit.simulated();
            spec.rate_hz = 10;
            spec.world.power.age_days = age_days;
            let (mut squares, mut count) = ([0.0; 2], 0.0);
            for k in 0..100 {
                let mut imu = Imu::new(&spec, k, 1000 + k);
                for n in 0..26_400 {
                    let (_, e) = imu.measure(&Increment::default());
                    if n % 600 == 0 {
                        squares[0] += (e.dtheta * 10.0 / DEG_PER_H).norm_squared();
                        squares[1] += (e.dv * 10.0 / UG).norm_squared();
                        count += 3.0;
                    }
                }
            }
            let stated = [
                unit.gyro.bias_turn_on_dph.hypot(unit.gyro.bias_in_run_dph),
                unit.accel.bias_turn_on_ug.hypot(unit.accel.bias_in_run_ug),
            ];
            for (square, stated) in squares.into_iter().zip(stated) {
                let ratio = (square / count).sqrt() / stated;
                println!("{name}: {ratio:.3} of the {stated:.2} that is stated");
                if !(0.9..1.1).contains(&ratio) {
                    off.push(format!("{name}: {ratio:.3} of {stated:.2}"));
                }
            }
        }
        assert!(off.is_empty(), "{off:?}");
    }
}
