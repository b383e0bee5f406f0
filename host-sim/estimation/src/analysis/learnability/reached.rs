//! The errors that learning schemes reach with simulated units.

use super::bound::{Means, inputs, noises};
use super::{AT_POWER_ON, CONSTANTS, QUANTITIES};
use crate::learning::baseline::{Linear, LinearModel};
use crate::learning::fit::fit_from;
use crate::learning::teacher::{Assumptions, aid, aligned, navigate};
use crate::learning::window::{compensate, compensator};
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma};
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::{Increment, NavState};
use host_core::simulator::session::{SessionConfig, measure};
use host_core::simulator::truth::Truth;
use host_unit::scenario::network::NetworkSpec;
use nalgebra::{DMatrix, DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A learning scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// Least-squares fit of a bias to the references of the teacher.
    LsBias,
    /// Least-squares fit of a bias and a 3x3 matrix.
    Ls3x3,
    /// The filter of the teacher, with six biases.
    Ekf6,
    /// A filter with the 24 constants, started like the bound. It should reach the bound.
    Ekf24,
    /// The two networks.
    Rnn,
}

/// All schemes, with their names in results.
pub const SCHEMES: [(&str, Scheme); 5] = [
    ("ls-bias", Scheme::LsBias),
    ("ls-3x3", Scheme::Ls3x3),
    ("ekf6", Scheme::Ekf6),
    ("ekf24", Scheme::Ekf24),
    ("rnn", Scheme::Rnn),
];

/// Errors of one unit: `errors[scheme][time][quantity]`, NaN where there is no estimate.
pub(super) struct Unit {
    errors: Vec<Vec<Vec<f64>>>,
}

/// Simulates a unit (seeds of device, turn-on and start) on a drive, and lets every scheme learn up
/// to each of `epochs`. `None` if self-alignment fails.
pub(super) fn unit(
    config: &SessionConfig<'_>,
    [device, turn_on, start]: [u64; 3],
    (truth, fixes): (&Truth, &[Option<Fix>]),
    model: &ErrorModel,
    epochs: &[usize],
) -> Option<Unit> {
    let config = SessionConfig {
        unit: device,
        turn_on,
        ..config.clone()
    };
    let session = measure(&config, config.imu, truth, fixes);
    let constants = true_constants(&session, truth, model)?;
    let known = TrueUnit {
        truth,
        model,
        session: &session,
        constants,
    };
    let mut errors = vec![Vec::new(); SCHEMES.len()];
    let filtered = filter24(&config, &known, start, epochs);
    for (at, theta) in epochs.iter().zip(&filtered) {
        let taught = taught(&config, &session, *at)?;
        for ((_, scheme), errors) in SCHEMES.iter().zip(&mut errors) {
            errors.push(match scheme {
                Scheme::LsBias => known.of_constants(&linear(&taught.bias), *at, [true, false]),
                Scheme::Ls3x3 => known.of_constants(&linear(&taught.linear), *at, [true, true]),
                Scheme::Ekf6 => known.of_constants(&taught.ekf6, *at, [true, false]),
                Scheme::Ekf24 => known.of_constants(theta, *at, [true, true]),
                Scheme::Rnn => known.of_means(&taught.network, *at),
            });
        }
    }
    Some(Unit { errors })
}

/// A unit and its true constants.
struct TrueUnit<'a> {
    truth: &'a Truth,
    model: &'a ErrorModel,
    session: &'a Session,
    constants: DVector<f64>,
}

impl TrueUnit<'_> {
    /// Errors of the constants `theta` and of the mean errors that follow from them. `estimated`
    /// says whether biases and matrices are estimates.
    fn of_constants(&self, theta: &DVector<f64>, until: usize, estimated: [bool; 2]) -> Vec<f64> {
        let mut means = Means::new(CONSTANTS);
        (0..until).for_each(|k| means.add(self.model, self.truth, k));
        let predicted = means.jacobian() * theta;
        let mut out = self.of_means(&predicted, until);
        for i in 0..CONSTANTS {
            if estimated[usize::from(i >= 6)] {
                out[i] = theta[i] - self.constants[i];
            }
        }
        out
    }

    /// Errors of predicted mean errors of the six sensors.
    fn of_means(&self, predicted: &DVector<f64>, until: usize) -> Vec<f64> {
        let truth = self.session.systematic.as_deref().unwrap_or_default();
        let mean = mean_of(&truth[..until]);
        let mut out = vec![f64::NAN; CONSTANTS];
        out.extend((predicted - mean).iter());
        out
    }
}

fn mean_of(errors: &[Increment]) -> DVector<f64> {
    let sum = |f: fn(&Increment) -> Vector3<f64>| -> Vector3<f64> {
        errors.iter().map(f).sum::<Vector3<f64>>() / errors.len().max(1) as f64
    };
    let (gyro, accel) = (sum(|e| e.dtheta), sum(|e| e.dv));
    DVector::from_iterator(6, gyro.iter().chain(accel.iter()).copied())
}

/// The constants of the simulator, from its noise-free systematic errors by a linear fit that is
/// exact.
fn true_constants(session: &Session, truth: &Truth, model: &ErrorModel) -> Option<DVector<f64>> {
    let errors = session.systematic.as_ref()?;
    let mut out = DVector::zeros(model.len());
    for triad in 0..2 {
        let a = DMatrix::from_fn(errors.len(), 4, |k, j| match j {
            0 => 1.0,
            _ => inputs(truth, k)[triad][j - 1],
        });
        let svd = a.svd(true, true);
        for axis in 0..3 {
            let b = DVector::from_fn(errors.len(), |k, _| match triad {
                0 => errors[k].dtheta[axis],
                _ => errors[k].dv[axis],
            });
            let x = svd.solve(&b, 1e-12).ok()?;
            out[3 * triad + axis] = x[0];
            for j in 0..3 {
                out[6 + 9 * triad + 3 * axis + j] = x[1 + j];
            }
        }
    }
    Some(out)
}

/// The estimates of the teacher's schemes.
struct Learnt {
    bias: LinearModel,
    linear: LinearModel,
    ekf6: DVector<f64>,
    network: DVector<f64>,
}

/// Lets the schemes learn from the session up to epoch `until`, as in the product, but without
/// data held back for validation.
fn taught(config: &SessionConfig<'_>, session: &Session, until: usize) -> Option<Learnt> {
    let mut assumptions = Assumptions::of_simulated(config.imu);
    assumptions.noise = noises(config).samples;
    let n = session.samples_per_epoch();
    let mut part = session.clone();
    part.counts = part.counts.part(0..until * n);
    let increments = part.increments();
    let aligned = aligned(&part, &increments)?;
    let nominal = navigate(&part, &increments, &assumptions, until)?;
    let study = fit_from(
        &part,
        &increments,
        &nominal,
        assumptions,
        &NetworkSpec::default(),
        false,
    );
    let done = compensate(&part, &compensator(&part, &study.nets, &assumptions));
    let estimates: Vec<Increment> = done
        .estimates
        .iter()
        .map(|[g, a]| Increment {
            dtheta: Vector3::from(g.map(f64::from)),
            dv: Vector3::from(a.map(f64::from)),
        })
        .collect();
    let model = ErrorModel::biases(&assumptions.walking(assumptions.datasheet_walk()).prior);
    let filter = aligned.aided(model, &assumptions, &part, &increments, until);
    Some(Learnt {
        bias: study.bias,
        linear: study.linear,
        ekf6: with_zero_matrices(&filter.theta),
        network: mean_of(&estimates),
    })
}

fn with_zero_matrices(biases: &DVector<f64>) -> DVector<f64> {
    let zeros = std::iter::repeat_n(&0.0, CONSTANTS - biases.len());
    DVector::from_iterator(CONSTANTS, biases.iter().chain(zeros).copied())
}

fn linear(model: &LinearModel) -> DVector<f64> {
    let triads: [&Linear; 2] = [&model.gyro, &model.accel];
    let biases = triads.iter().flat_map(|l| l.bias.iter().copied());
    let rows = triads
        .iter()
        .flat_map(|l| l.matrix.transpose().iter().copied().collect::<Vec<f64>>());
    DVector::from_iterator(CONSTANTS, biases.chain(rows))
}

/// Parameters at each of `epochs` of a filter with the model of the bound, from an initial state
/// with the errors that the bound assumes.
fn filter24(
    config: &SessionConfig<'_>,
    known: &TrueUnit<'_>,
    seed: u64,
    epochs: &[usize],
) -> Vec<DVector<f64>> {
    let noises = noises(config);
    let mut session = known.session.clone();
    for fix in session.fixes.iter_mut().flatten() {
        fix.sigmas = noises.fixes;
    }
    let increments = session.increments();
    let nav = disturbed(&known.truth.epochs[0], &AT_POWER_ON, seed);
    let mut filter = Aided::new(nav, &AT_POWER_ON, known.model.clone(), noises.samples);
    let mut out = Vec::new();
    for k in 0..epochs.last().copied().unwrap_or_default() {
        aid(&mut filter, &session, &increments, k);
        if epochs.contains(&(k + 1)) {
            out.push(filter.theta.clone());
        }
    }
    out
}

/// A state with normal errors.
fn disturbed(nav: &NavState, sigma: &InitialSigma, seed: u64) -> NavState {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let sigmas = [
        [sigma.tilt, sigma.tilt, sigma.heading],
        [sigma.velocity; 3],
        [sigma.position; 3],
    ];
    let error = sigmas.iter().flatten().map(|s| {
        let z: f64 = StandardNormal.sample(&mut rng);
        s * z
    });
    host_core::inertial::ekf::displaced(nav, &DVector::from_iterator(9, error))
}

/// Root mean square errors over units.
pub(super) fn root_mean_square(units: &[Unit], times: usize) -> Vec<Vec<Vec<f64>>> {
    let of = |scheme: usize, time: usize, q: usize| {
        let squares = units.iter().map(|u| u.errors[scheme][time][q].powi(2));
        (squares.sum::<f64>() / units.len().max(1) as f64).sqrt()
    };
    (0..SCHEMES.len())
        .map(|s| {
            (0..times)
                .map(|t| (0..QUANTITIES).map(|q| of(s, t, q)).collect())
                .collect()
        })
        .collect()
}

const _: () = assert!(
    EPOCH_S.to_bits() == 1.0_f64.to_bits(),
    "means are over whole seconds"
);
