//! The teacher: estimates of the sensors' errors, from a navigation with fixes.
//!
//! Fixes give position and velocity but no attitude. The nominal trajectory is therefore that of an
//! aided navigator: alignment at standstill, loosely coupled filter, smoother over the learning
//! part. The reference for a window is the integral of the sensor error in body axes: measured
//! increments minus the increments that belong to the smoothed trajectory.

mod aligned;

use crate::learning::aiding::{Passed, fix_at, pass};
pub use aligned::{ALIGN_SHARE, Aligned, aligned, aligned_knowing};
use firmware::inputs::{Inputs, OWN};
use firmware::model::Nets;
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma, Noise, Prior, Record, smooth};
use host_core::inertial::motion::Motion;
use host_core::inertial::session::Session;
pub use host_core::inertial::session::Start;
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, G0, PPM, UG, UG_PER_SQRT_HZ};
use host_core::list::{IN_MEMORY, List};
use host_core::simulator::imu::ImuSpec;
use host_unit::Unit;
use host_unit::triads::MRAD;
use nalgebra::Vector3;

/// The teacher's assumptions about the sensors.
#[derive(Debug, Clone, Copy)]
pub struct Assumptions {
    /// Prior of the biases.
    pub prior: Prior,
    /// White noise, without quantisation.
    pub noise: Noise,
    /// Random walk of the biases in an hour as a share of their prior, gyros then accelerometers:
    /// the configuration of the device's learner.
    pub in_run: [f64; 2],
    /// Bias of the gyros by specific force, rad/s per m/s2.
    pub g_sensitivity: f64,
    /// Largest correction of gyros and accelerometers, SI; `None`: ten times the prior.
    pub limit: Option<[f64; 2]>,
    /// Inputs of the networks.
    pub inputs: Inputs,
    /// Networks of the type, for a device that has not driven yet.
    pub shape: Option<Nets>,
}

/// Share of its prior that a bias walks in an hour where nothing else is known (assumed).
pub const IN_RUN: [f64; 2] = [0.05; 2];

/// The sensors' mean error over one epoch, as estimated by the teacher.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    /// Epoch number.
    pub epoch: usize,
    /// Mean error: rad/s and m/s2.
    pub error: Increment,
    /// Standard deviation of each component.
    pub sigma: Increment,
}

/// The aided navigation of a whole session, one record per epoch from the end of the standstill on.
#[derive(Debug, Clone)]
pub struct Nominal {
    /// First epoch after alignment.
    pub first: usize,
    /// Records of the filter. A day of them waits in a temporary file.
    pub records: List<Record>,
}

impl Assumptions {
    /// The assumptions by a unit's datasheet. A bias is the root of the squares of its part at
    /// power-on and of its walk in an hour, as for the device (`learn::Settings::of`).
    #[must_use]
    pub fn of(unit: &Unit) -> Self {
        let (g, a) = (&unit.gyro, &unit.accel);
        let whole = |turn_on: f64, in_run: f64| (turn_on * turn_on + in_run * in_run).sqrt();
        let walk = [g.bias_in_run_dph * DEG_PER_H, a.bias_in_run_ug * UG];
        let gyro_bias = whole(g.bias_turn_on_dph * DEG_PER_H, walk[0]);
        let accel_bias = whole(a.bias_turn_on_ug * UG, walk[1]);
        let in_run = [walk[0] / gyro_bias, walk[1] / accel_bias];
        let correction = &unit.correction;
        let given = correction.limit_gyro_dph.is_some() || correction.limit_accel_ug.is_some();
        Self {
            prior: Prior {
                gyro_bias,
                accel_bias,
                walk_per_hour: WALK_PER_HOUR.max(in_run[0]).max(in_run[1]),
                scale: [g.scale_ppm * PPM, a.scale_ppm * PPM],
                misalignment: [g.misalignment_mrad * MRAD, a.misalignment_mrad * MRAD],
            },
            noise: Noise {
                gyro: g.angle_random_walk_dpsqrth * DEG_PER_SQRT_H,
                accel: a.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ,
            },
            in_run,
            g_sensitivity: g.g_sensitivity_dphpg * DEG_PER_H / G0,
            limit: given.then(|| unit.limits()[0]),
            inputs: unit.networks.inputs(),
            shape: unit.prior.as_ref().map(host_unit::prior::Prior::nets),
        }
    }

    /// The expected values of exactly these simulated errors, for bounds, and for tests that change
    /// them. The angle random walk includes that of lock-in.
    #[must_use]
    pub fn of_simulated(spec: &ImuSpec) -> Self {
        let noise = Noise {
            gyro: spec.gyro.total_angle_random_walk_dpsqrth() * DEG_PER_SQRT_H,
            accel: spec.accel.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ,
        };
        Self {
            prior: prior(spec),
            noise,
            in_run: IN_RUN,
            g_sensitivity: spec.gyro.g_sensitivity_dphpg * DEG_PER_H / G0,
            limit: None,
            inputs: OWN,
            shape: None,
        }
    }

    /// Random walk of a bias per hour by the datasheet, relative to its prior: that of the triad
    /// with the larger one, to twelve digits. The classical filters and the device's learner use
    /// it.
    #[must_use]
    pub fn datasheet_walk(&self) -> f64 {
        let [gyro, accel] = self.in_run;
        (gyro.max(accel) * 1e12).round() / 1e12
    }

    /// The same, with biases that walk by this share of their prior in an hour.
    #[must_use]
    pub fn walking(mut self, walk: f64) -> Self {
        self.prior.walk_per_hour = walk;
        self
    }

    /// Initial uncertainty after an alignment without further information: tilt from the bias of
    /// the accelerometers, heading from that of the gyros.
    #[must_use]
    pub fn initial_sigma(&self, site: &NavState, sigmas: &[f64; 6]) -> InitialSigma {
        let here = host_core::inertial::earth::Local::at(site.position.lat, site.position.h);
        let earth = host_core::inertial::earth::OMEGA_IE * here.cos_lat;
        InitialSigma {
            tilt: self.prior.accel_bias / here.g,
            heading: self.prior.gyro_bias / earth,
            velocity: sigmas[3],
            position: sigmas[0],
        }
    }
}

/// Smallest assumed bias, deg/h, so that a filter has something to estimate.
const LEAST_DPH: f64 = 1e-5;
const LEAST_UG: f64 = 1e-2;

/// Random walk of a bias in an hour in the teacher's filter, as a share of its prior. It covers
/// errors that are not modelled (assumed).
const WALK_PER_HOUR: f64 = 0.5;

/// The prior of simulated errors.
fn prior(spec: &ImuSpec) -> Prior {
    let (g, a) = (&spec.gyro, &spec.accel);
    let [gyro_dph, accel_ug] = spec.expected_bias();
    Prior {
        gyro_bias: gyro_dph.max(LEAST_DPH) * DEG_PER_H,
        accel_bias: accel_ug.max(LEAST_UG) * UG,
        walk_per_hour: WALK_PER_HOUR,
        scale: [
            g.scale_ppm.hypot(g.scale_asymmetry_ppm) * PPM,
            a.scale_ppm.hypot(a.scale_asymmetry_ppm) * PPM,
        ],
        misalignment: [
            g.misalignment_arcsec * ARCSEC,
            a.misalignment_arcsec * ARCSEC,
        ],
    }
}

/// Processes epoch `k` and the fix at its end in the filter. While the vehicle is known to stand,
/// the velocity of the fix is zero. Returns the logarithm of the likelihood of the fix.
pub fn aid(filter: &mut Aided, session: &Session, increments: &dyn Motion, k: usize) -> f64 {
    match pass(filter, session, increments, k, fix_at(session, k + 1)) {
        Passed::Epoch(fix) => filter.take(fix.as_ref()),
        Passed::Outage(_) => 0.0,
    }
}

/// Aligns, then navigates with fixes to the end of epoch `until`. `None` when the standstill does
/// not give an attitude.
#[must_use]
pub fn navigate(
    session: &Session,
    increments: &dyn Motion,
    assumptions: &Assumptions,
    until: usize,
) -> Option<Nominal> {
    let aligned = aligned(session, increments)?;
    let filter = aligned.filter(ErrorModel::biases(&assumptions.prior), assumptions);
    Some(recorded(filter, session, increments, aligned.first, until))
}

/// Navigates with fixes from `start` at epoch `first` to the end of epoch `until`.
#[must_use]
pub fn navigate_from(
    session: &Session,
    increments: &dyn Motion,
    assumptions: &Assumptions,
    start: &Start,
    first: usize,
    until: usize,
) -> Nominal {
    let model = ErrorModel::biases(&assumptions.prior);
    let filter = Aided::new(start.nav, &start.sigma, model, assumptions.noise)
        .with_samples(session.samples());
    recorded(filter, session, increments, first, until)
}

fn recorded(
    mut filter: Aided,
    session: &Session,
    increments: &dyn Motion,
    first: usize,
    until: usize,
) -> Nominal {
    let records = (first..until).map(|k| {
        match pass(&mut filter, session, increments, k, fix_at(session, k + 1)) {
            Passed::Epoch(fix) => filter.fix(fix.as_ref()),
            Passed::Outage(record) => record,
        }
    });
    let records = List::collected(records, IN_MEMORY);
    Nominal { first, records }
}

/// References for the epochs of the first `count` records. Later data is not used.
#[must_use]
pub fn references(nominal: &Nominal, count: usize) -> Vec<Reference> {
    let v = |x: &nalgebra::DVector<f64>| Increment {
        dtheta: Vector3::new(x[0], x[1], x[2]),
        dv: Vector3::new(x[3], x[4], x[5]),
    };
    smooth(&nominal.records.part(0..count))
        .iter()
        .enumerate()
        .map(|(k, s)| Reference {
            epoch: nominal.first + k,
            error: v(&s.theta),
            sigma: v(&s.sigma),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_filter_expects_the_random_walk_that_lock_in_makes() {
        let mut spec = ImuSpec::preset("medium").unwrap();
        let with = |spec: &ImuSpec| Assumptions::of_simulated(spec).noise.gyro / DEG_PER_SQRT_H;
        // as in the preset's comment: 0.0049 and lock-in give 0.005
        assert!((with(&spec) - 0.005).abs() < 2e-5, "{}", with(&spec));
        spec.gyro.dither.lock_in_dph *= 10.0;
        assert!(with(&spec) > 0.009, "{}", with(&spec));
    }

    /// The datasheets of the three simulated units state the expected values of their error terms,
    /// so that older results stay valid. The numbers are SI.
    #[test]
    fn datasheets_of_simulated_units_have_their_old_values() {
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        let known = [
            (
                "medium",
                [
                    1.629_724_102_699e-6,
                    4.055_260_250_840_567e-3,
                    1.454_636_997_070_184_4e-6,
                ],
            ),
            (
                "nav",
                [
                    3.151_288_927_211_984e-8,
                    2.832_068_156_693_355e-4,
                    5.811_687_645_783_272e-7,
                ],
            ),
            (
                "tactical",
                [
                    5.633_025_938_852_239e-6,
                    1.043_613_722_274_583_7e-2,
                    3.635_360_114_313_273e-5,
                ],
            ),
        ];
        for (name, [gyro_bias, accel_bias, gyro_noise]) in known {
            let assumed = Assumptions::of(&Unit::preset(name).unwrap());
            assert!(near(assumed.prior.gyro_bias, gyro_bias), "{name}");
            assert!(near(assumed.prior.accel_bias, accel_bias), "{name}");
            assert!(near(assumed.noise.gyro, gyro_noise), "{name}");
            let simulated = Assumptions::of_simulated(&ImuSpec::preset(name).unwrap());
            let numbers = |a: &Assumptions| {
                let (p, n) = (a.prior, a.noise);
                let biases = [p.gyro_bias, p.accel_bias, p.walk_per_hour, n.gyro, n.accel];
                [&biases[..], &p.scale, &p.misalignment, &a.in_run].concat()
            };
            let pairs = numbers(&assumed).into_iter().zip(numbers(&simulated));
            assert!(
                pairs.clone().all(|(a, b)| near(a, b)),
                "{name}: {assumed:?} {simulated:?}"
            );
            assert_eq!(assumed.in_run.map(|share| share as f32), [0.05; 2]);
        }
    }

    #[test]
    fn a_unit_with_its_own_limits_has_them() {
        let mut unit = Unit::default();
        assert_eq!(Assumptions::of(&unit).limit, None);
        unit.correction.limit_gyro_dph = Some(1.0);
        let [gyro, accel] = Assumptions::of(&unit).limit.unwrap();
        assert!((gyro / DEG_PER_H - 1.0).abs() < 1e-12);
        assert!((accel / (1.240_56e3 * UG) - 1.0).abs() < 1e-4, "{accel}");
    }
}
