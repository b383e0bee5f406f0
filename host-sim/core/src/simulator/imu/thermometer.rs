//! Thermometers of an IMU, and of the processor beside it.
//!
//! A thermometer lags the temperature at its position (first order), has a constant error of the
//! unit, and the resolution of the protocol that sends it:
//!
//! ```text
//! dS/dt = (T - S) / lag        reading = resolution * round((S + offset) / resolution)
//! ```

use super::draws::normal3;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::inertial::session::Readings;

/// Resolution of the temperatures in frames of a STIM300, degrees C: 2^-8, three a cluster
/// (datasheet TS1524, temperature data).
pub const STIM300_K: f64 = 1.0 / 256.0;
/// Resolution of a HG4930: whole degrees in the low byte of the second status word, one
/// accelerometer's.
pub const HG4930_K: f64 = 1.0;
/// Resolution of a KVH 1750 or 1775 as delivered (`=TEMPUNITS,C`): whole degrees. Hundredths can be
/// chosen (user manual 56-0298, tables 5-2 to 5-7).
pub const KVH_K: f64 = 1.0;
/// Resolution of an ADIS1647x or ADIS1650x, register TEMP_OUT (datasheets).
pub const ADIS_1650X_K: f64 = 0.1;
/// Resolution of an ADIS1649x, register TEMP_OUT: 80 counts a degree (datasheet of the ADIS16495).
pub const ADIS_1649X_K: f64 = 1.0 / 80.0;

/// Thermometers of a unit and of the processor beside it. They do not act on the samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ThermometerSpec {
    /// Temperature of the calibration, from which all other temperatures count, degrees C; a plain
    /// value.
    pub calibration_degc: f64,
    /// One reading for each axis; otherwise all three are that of the block.
    pub per_axis: bool,
    /// Delay of the reading behind the sensor, first order, s, > 0; a plain value.
    pub lag_time_s: f64,
    /// Constant error of each thermometer: standard deviation over units, K.
    pub offset_k: f64,
    /// Step of the reading, K; a plain value. Zero: not rounded.
    pub resolution_k: f64,
    /// Final temperature of the processor above its surroundings, K; a plain value.
    pub processor_heating_k: f64,
    /// Time constant of the processor's board, s, > 0; a plain value.
    pub processor_time_s: f64,
    /// Constant error of the processor's thermometer: standard deviation over units, K.
    pub processor_offset_k: f64,
    /// Step of the processor's reading, K; a plain value.
    pub processor_resolution_k: f64,
}

impl Default for ThermometerSpec {
    /// A good thermometer for the block. The processor is an STM32F405: its offset varies by
    /// several 10 K from chip to chip and 15 K remain after the factory's two-point calibration
    /// (assumed), and 12 bits of 3.3 V at 2.5 mV/K are 0.32 K (datasheet, temperature sensor).
    fn default() -> Self {
        Self {
            calibration_degc: 25.0,
            per_axis: false,
            lag_time_s: 5.0,
            offset_k: 0.5,
            resolution_k: 0.0,
            processor_heating_k: 8.0,
            processor_time_s: 240.0,
            processor_offset_k: 5.0,
            processor_resolution_k: 0.32,
        }
    }
}

/// The thermometers of one unit at one turn-on.
#[derive(Debug, Clone)]
pub struct Thermometers {
    spec: ThermometerSpec,
    axes: Vector3<f64>,
    offsets: Vector3<f64>,
    processor: f64,
    processor_offset: f64,
}

impl Thermometers {
    /// At power-on with these temperatures of the axes and of the surroundings, K above the
    /// calibration; `warmth`: remaining share of the processor's own heating, 0 to 1.
    #[must_use]
    pub fn new(
        spec: &ThermometerSpec,
        axes: &Vector3<f64>,
        (ambient, warmth): (f64, f64),
        unit: &mut ChaCha8Rng,
    ) -> Self {
        let mut offsets = normal3(unit) * spec.offset_k;
        if !spec.per_axis {
            offsets = Vector3::repeat(offsets.x);
        }
        let z: f64 = StandardNormal.sample(unit);
        Self {
            spec: spec.clone(),
            axes: *axes,
            offsets,
            processor: ambient + spec.processor_heating_k * warmth,
            processor_offset: z * spec.processor_offset_k,
        }
    }

    /// Advances by `dt` s in which the axes and the surroundings have these temperatures.
    pub fn step(&mut self, dt: f64, axes: &Vector3<f64>, ambient: f64) {
        let late = (-dt / self.spec.lag_time_s).exp();
        self.axes = axes + (self.axes - axes) * late;
        let target = ambient + self.spec.processor_heating_k;
        let keep = (-dt / self.spec.processor_time_s).exp();
        self.processor = target + (self.processor - target) * keep;
    }

    /// The readings at this time.
    #[must_use]
    pub fn readings(&self) -> Readings {
        let s = &self.spec;
        let at = |x: f64, resolution: f64| rounded(s.calibration_degc + x, resolution);
        Readings {
            axes: (self.axes + self.offsets).map(|x| at(x, s.resolution_k)),
            processor: at(
                self.processor + self.processor_offset,
                s.processor_resolution_k,
            ),
        }
    }
}

fn rounded(x: f64, step: f64) -> f64 {
    match step > 0.0 {
        true => (x / step).round() * step,
        false => x,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn thermometers(spec: &ThermometerSpec, unit: u64) -> Thermometers {
        let mut rng = ChaCha8Rng::seed_from_u64(unit);
        Thermometers::new(spec, &Vector3::zeros(), (0.0, 0.0), &mut rng)
    }

    /// Behind a ramp a first-order lag is rate times time constant, exactly.
    #[test]
    fn it_lags_a_ramp_by_rate_times_time() {
        let spec = ThermometerSpec {
            offset_k: 0.0,
            lag_time_s: 20.0,
            ..Default::default()
        };
        let mut all = thermometers(&spec, 1);
        let dt = 0.01;
        for k in 1..=60_000 {
            let t = f64::from(k) * dt;
            all.step(dt, &Vector3::repeat(0.02 * t), 0.0);
        }
        let lag = 25.0 + 0.02 * 600.0 - all.readings().axes.x;
        assert!((lag - 0.02 * 20.0).abs() < 3e-4, "{lag}");
        // the processor knows nothing of it: after ten minutes 8 K (1 - exp(-600/240))
        let own = 8.0 * (1.0 - (-2.5f64).exp()) + all.processor_offset + 25.0;
        assert!((all.readings().processor - own).abs() <= 0.16 + 1e-9);
    }

    #[test]
    fn a_reading_has_the_resolution_of_its_protocol() {
        for (resolution_k, counts) in [
            (STIM300_K, 6272),
            (HG4930_K, 25),
            (ADIS_1650X_K, 245),
            (ADIS_1649X_K, 1960),
        ] {
            let spec = ThermometerSpec {
                offset_k: 0.0,
                resolution_k,
                ..Default::default()
            };
            let mut all = thermometers(&spec, 1);
            // 24.5 degrees, and a hundredth of a count more
            all.step(1e6, &Vector3::repeat(-0.5 + 0.01 * resolution_k), 0.0);
            let read = all.readings().axes.x / resolution_k;
            assert!(
                (read - f64::from(counts)).abs() < 1e-9,
                "{read} counts of {resolution_k}"
            );
        }
    }

    #[test]
    fn offsets_belong_to_the_unit_and_to_the_axis_where_each_has_its_own() {
        let at = |per_axis, unit| {
            let spec = ThermometerSpec {
                per_axis,
                ..Default::default()
            };
            thermometers(&spec, unit).readings().axes
        };
        let one = at(false, 1);
        assert!(one.x == one.y && one.y == one.z && one == at(false, 1) && one != at(false, 2));
        let three = at(true, 1);
        assert!(three.x != three.y && three.y != three.z);
        let squares: f64 = (0..1000)
            .map(|k| (at(true, k).add_scalar(-25.0)).norm_squared())
            .sum();
        assert!(((squares / 3000.0).sqrt() / 0.5 - 1.0).abs() < 0.05);
    }
}
