//! The models from which classical filters select by evidence: biases, alone or with laws.

use host_core::inertial::ekf::{
    AuxiliaryData, ErrorModel, Parameter, Prior, REFERENCE_DEGC, Regressor,
};
use host_core::inertial::session::Session;
use nalgebra::Vector3;
use std::sync::Arc;

/// Time constants of the exponentials of `ekf-exp`, s, and their standard deviations as shares of
/// the bias's: those of the device's hypotheses (`firmware::learn::prior`, `bank::table`).
const TIMES_S: [f64; 3] = [150.0, 500.0, 1500.0];
const SHARES: [f64; 3] = [0.1, 0.3, 1.0];

/// The models from which a filter selects by evidence, for one session.
pub type Models = fn(&Session, &Prior) -> Vec<ErrorModel>;

/// Biases alone.
pub(super) fn biases(_: &Session, prior: &Prior) -> Vec<ErrorModel> {
    vec![ErrorModel::biases(prior)]
}

/// Biases, alone or with exponentials of the time since power-on in three sizes.
pub(super) fn exponentials(_: &Session, prior: &Prior) -> Vec<ErrorModel> {
    let with = |share| ErrorModel::with_exponentials(prior, TIMES_S, share);
    alone_or(prior, SHARES.map(with))
}

/// Biases, alone or with laws of the thermometers' readings in three sizes. Without thermometers
/// only biases.
pub(super) fn temperatures(session: &Session, prior: &Prior) -> Vec<ErrorModel> {
    by_temperature(&read(session), prior)
}

/// [`temperatures`] with these readings.
pub(super) fn by_temperature(known: &Arc<[AuxiliaryData]>, prior: &Prior) -> Vec<ErrorModel> {
    let with = |share| ErrorModel::with_temperatures(prior, known.clone(), share);
    alone_or(prior, SHARES.map(with))
}

/// Biases, alone or with laws of the networks' inputs, in three sizes: those of `temperatures`,
/// and one of the vibration in the second before.
pub(super) fn inputs(session: &Session, prior: &Prior) -> Vec<ErrorModel> {
    by_inputs(&read_and_felt(session), prior)
}

/// [`inputs`] with these readings and vibrations.
pub(super) fn by_inputs(known: &Arc<[AuxiliaryData]>, prior: &Prior) -> Vec<ErrorModel> {
    let bias = [prior.gyro_bias, prior.accel_bias];
    let with = |share| {
        let mut model = ErrorModel::with_temperatures(prior, known.clone(), share);
        model.extend(|axis, triad| {
            let sigma = bias[triad.index()] * share / SPAN_VIBRATION;
            vec![Parameter::constant(triad, axis, Regressor::Shaking, sigma)]
        });
        model
    };
    alone_or(prior, SHARES.map(with))
}

/// Vibration of all axes at which its law reaches its prior, (m/s2)^2: a road at speed.
const SPAN_VIBRATION: f64 = 0.3;

/// The result of [`read`], zero without thermometers, and the vibration of the second before.
pub(super) fn read_and_felt(session: &Session) -> Arc<[AuxiliaryData]> {
    let readings = read(session);
    let shaken = session.vibration().into_iter().enumerate();
    let of = |(second, vibration)| AuxiliaryData {
        vibration,
        ..readings.get(second).copied().unwrap_or_default()
    };
    shaken.map(of).collect()
}

fn alone_or(prior: &Prior, with: [ErrorModel; 3]) -> Vec<ErrorModel> {
    [ErrorModel::biases(prior)]
        .into_iter()
        .chain(with)
        .collect()
}

/// Seconds of readings for the rate of temperature: a resolution of 1 K then gives errors up to
/// 0.4 K/min.
const RATE_S: usize = 120;

/// The thermometers of the axes in each second, and the slope of their earlier readings.
pub(super) fn read(session: &Session) -> Arc<[AuxiliaryData]> {
    let readings = session.readings.as_deref().unwrap_or_default();
    let of = |k: usize| {
        let last = &readings[k.saturating_sub(RATE_S - 1)..=k];
        let middle = 0.5 * (last.len() as f64 - 1.0);
        let mut sums = (Vector3::zeros(), 0.0);
        for (i, reading) in last.iter().enumerate() {
            let time = i as f64 - middle;
            sums.0 += reading.axes * time;
            sums.1 += time * time;
        }
        let rate = if sums.1 > 0.0 {
            sums.0 / sums.1
        } else {
            Vector3::zeros()
        };
        let off = readings[k].axes.map(|degc| degc - REFERENCE_DEGC);
        AuxiliaryData {
            readings: [off, rate],
            ..AuxiliaryData::default()
        }
    };
    (0..readings.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::session::Readings;

    /// A ramp of 1 K/min that is read in whole degrees.
    #[test]
    fn the_rate_of_a_coarse_thermometer_is_good_to_its_resolution() {
        let reading = |second: u32| Readings {
            axes: Vector3::repeat((30.0 + f64::from(second) / 60.0).round()),
            processor: 0.0,
        };
        let lsb = firmware::sample::Lsb {
            rad: 1e-8,
            mps: 1e-6,
        };
        let none = Session::new(0.01, (Vec::new(), lsb), Vec::new(), Vec::new());
        assert!(read(&none).is_empty());
        let session = Session {
            readings: Some((0..900).map(reading).collect()),
            ..none
        };
        let known = read(&session);
        assert_eq!(known.len(), 900);
        for of in &known[RATE_S..] {
            let k_per_min = 60.0 * of.readings[1].x;
            assert!((k_per_min - 1.0).abs() < 0.4, "{k_per_min}");
        }
        assert_eq!(known[0].readings, [Vector3::repeat(5.0), Vector3::zeros()]);
    }
}
