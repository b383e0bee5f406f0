//! The start of filters: a session aligned on the first part of its standstill.

use super::{Assumptions, aid};
use crate::learning::aiding::ZERO_VELOCITY_MPS;
use host_core::inertial::align::{self, Alignment};
use host_core::inertial::ekf::{
    Aided, Belief, ErrorModel, InitialSigma, NAV, SlowErrors, attitude_error,
};
use host_core::inertial::motion::Motion;
use host_core::inertial::session::{EPOCH_S, Session, Start};
use host_core::inertial::sins::{Increment, NavState, Samples};
use nalgebra::{SMatrix, Vector3};

/// Share of the standstill that is used for alignment. The filters learn from the rest, since a
/// warm-up is steepest there.
pub const ALIGN_SHARE: f64 = 1.0 / 3.0;

/// A session aligned on the first part of its standstill.
#[derive(Debug, Clone)]
pub struct Aligned {
    /// State at the end of that part.
    pub nav: NavState,
    /// The epoch at which it ends.
    pub first: usize,
    alignment: Alignment,
    /// Standard deviations of the position and velocity there.
    sigmas: [f64; 6],
    samples: Samples,
}

impl Aligned {
    /// State and standard deviations, for a learner without parameters for the sensors' errors.
    #[must_use]
    pub fn start(&self, assumptions: &Assumptions) -> Start {
        Start {
            nav: self.nav,
            sigma: assumptions.initial_sigma(&self.nav, &self.sigmas),
        }
    }

    /// The initial errors (attitude, velocity, position) as a linear function of constant errors of
    /// the sensors, and the covariance of the remaining part.
    #[must_use]
    pub fn errors(
        &self,
        assumptions: &Assumptions,
    ) -> (SMatrix<f64, NAV, 6>, SMatrix<f64, NAV, NAV>) {
        let (by, rest) = attitude_error(&self.alignment, &assumptions.prior, assumptions.noise);
        let mut all = SMatrix::<f64, NAV, 6>::zeros();
        let mut covariance = SMatrix::<f64, NAV, NAV>::zeros();
        all.fixed_view_mut::<3, 6>(0, 0).copy_from(&by);
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&rest);
        for i in 0..3 {
            covariance[(3 + i, 3 + i)] = ZERO_VELOCITY_MPS.powi(2);
            covariance[(6 + i, 6 + i)] = self.sigmas[i].powi(2);
        }
        (all, covariance)
    }

    /// A filter with `model` that starts from here. Without a model, the biases of `assumptions`
    /// count as part of the alignment's error.
    #[must_use]
    pub fn filter(&self, model: ErrorModel, assumptions: &Assumptions) -> Aided {
        let unmodelled = if model.is_empty() {
            ErrorModel::biases(&assumptions.prior)
        } else {
            ErrorModel::default()
        };
        self.unaligned(model, assumptions)
            .aligned_by(&self.alignment, &unmodelled)
    }

    /// A filter with `model` that starts with this belief of the parameters at power-on. The
    /// alignment must be that of [`aligned_knowing`] with the same belief.
    #[must_use]
    pub fn filter_knowing(
        &self,
        model: ErrorModel,
        assumptions: &Assumptions,
        known: &Belief,
    ) -> Aided {
        self.unaligned(model, assumptions)
            .aligned_knowing(&self.alignment, known)
    }

    /// A filter whose attitude has no error yet.
    fn unaligned(&self, model: ErrorModel, assumptions: &Assumptions) -> Aided {
        let sigma = InitialSigma {
            tilt: 0.0,
            heading: 0.0,
            velocity: ZERO_VELOCITY_MPS,
            position: self.sigmas[0],
        };
        let mut filter = Aided::new(self.nav, &sigma, model, assumptions.noise)
            .with_samples(self.samples)
            .powered_for(self.first as f64 * EPOCH_S);
        for i in 0..3 {
            filter.p[(6 + i, 6 + i)] = self.sigmas[i].powi(2);
        }
        filter
    }
}

impl Aligned {
    /// [`Aligned::filter`], with the fixes up to the end of epoch `until` processed.
    #[must_use]
    pub fn aided(
        &self,
        model: ErrorModel,
        assumptions: &Assumptions,
        session: &Session,
        increments: &dyn Motion,
        until: usize,
    ) -> Aided {
        let scored = self.scored(model, assumptions, session, increments, until);
        scored.0
    }

    /// As [`Aligned::aided`], with the logarithm of the likelihood of all fixes, each before the
    /// filter processed it.
    #[must_use]
    pub fn scored(
        &self,
        model: ErrorModel,
        assumptions: &Assumptions,
        session: &Session,
        increments: &dyn Motion,
        until: usize,
    ) -> (Aided, f64) {
        let filter = self.filter(model, assumptions);
        self.scored_from(filter, session, increments, until)
    }

    /// [`Aligned::scored`] with a filter that starts from here.
    #[must_use]
    pub fn scored_from(
        &self,
        mut filter: Aided,
        session: &Session,
        increments: &dyn Motion,
        until: usize,
    ) -> (Aided, f64) {
        let each = |k| aid(&mut filter, session, increments, k);
        let score = (self.first..until).map(each).sum();
        (filter, score)
    }
}

/// Aligns on the first part of the standstill. `None` when it does not give an attitude.
#[must_use]
pub fn aligned(session: &Session, increments: &dyn Motion) -> Option<Aligned> {
    let first = (session.standstill as f64 * ALIGN_SHARE) as usize;
    let standing = increments.beginning(first, session.steps_per_epoch());
    let alignment = align::alignment(
        &standing,
        session.step_s(),
        session.samples(),
        session.nearest_fix(0).position,
    )?;
    let fix = session.nearest_fix(first);
    let nav = NavState {
        position: session.imu_position(&fix.position, &alignment.q_bn),
        velocity: Vector3::zeros(),
        q_bn: alignment.q_bn,
    };
    Some(Aligned {
        nav,
        first,
        alignment,
        sigmas: fix.start_sigmas(),
        samples: session.samples(),
    })
}

/// [`aligned`], with the mean of a belief of the sensors subtracted from the samples.
#[must_use]
pub fn aligned_knowing(
    session: &Session,
    increments: &[Increment],
    model: &ErrorModel,
    known: &Belief,
) -> Option<Aligned> {
    let dt = session.step_s();
    let first = (session.standstill as f64 * ALIGN_SHARE) as usize;
    let standing = &increments[..first * session.steps_per_epoch()];
    let mut slow = SlowErrors::default();
    // at rest only the noise changes from one increment to the next
    let corrected = |(k, w): (usize, &Increment)| {
        model.corrected(&known.mean, [w, w], dt, (k as f64 + 0.5) * dt, &mut slow)
    };
    let corrected: Vec<Increment> = standing.iter().enumerate().map(corrected).collect();
    aligned(session, &corrected)
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::simulator::imu::{ErrorModelName, ImuSpec};
    use host_core::simulator::session::{SessionConfig, simulate};
    use nalgebra::{DMatrix, DVector};

    fn standing(imu: &ImuSpec) -> Session {
        let config = SessionConfig {
            heading: 0.7,
            ..SessionConfig::new(imu, [300.0, 60.0], [5, 6, 7])
        };
        simulate(&config).0
    }

    /// A belief that equals the prior gives the filter without a belief, to the last bit.
    #[test]
    fn a_belief_that_is_the_prior_changes_nothing() {
        let mut imu = ImuSpec::preset("medium").unwrap();
        imu.rate_hz = 50;
        let session = standing(&imu);
        let increments = session.increments();
        let a = Assumptions::of_simulated(&imu);
        let model = ErrorModel::with_exponentials(&a.prior, [150.0, 500.0, 1500.0], 0.3);
        let n = model.len();
        let known = Belief {
            mean: DVector::zeros(n),
            p: DMatrix::from_fn(n, n, |i, j| match i == j {
                true => model.parameters[i].sigma * model.parameters[i].sigma,
                false => 0.0,
            }),
        };
        let plain = aligned(&session, &increments).unwrap();
        let knowing = aligned_knowing(&session, &increments, &model, &known).unwrap();
        let [one, other] = [
            plain.scored(model.clone(), &a, &session, &increments, 320),
            knowing.scored_from(
                knowing.filter_knowing(model, &a, &known),
                &session,
                &increments,
                320,
            ),
        ];
        assert_eq!(one.1, other.1);
        assert_eq!(one.0.p, other.0.p);
        assert_eq!(one.0.theta, other.0.theta);
        assert_eq!(one.0.sins.nav, other.0.sins.nav);
    }

    /// With exactly known biases the alignment is that of sensors without biases.
    #[test]
    fn known_biases_do_not_tilt_or_turn_the_alignment() {
        let mut imu = ImuSpec::preset("medium").unwrap();
        imu.rate_hz = 50;
        let quiet = imu.error_model(ErrorModelName::Noise);
        let session = standing(&quiet);
        let a = Assumptions::of_simulated(&imu);
        let model = ErrorModel::biases(&a.prior);
        let mean = DVector::from_fn(6, |i, _| 0.5 * model.parameters[i].sigma);
        let biased: Vec<Increment> = session
            .increments()
            .iter()
            .map(|w| Increment {
                dtheta: w.dtheta + Vector3::repeat(mean[0] * session.dt),
                dv: w.dv + Vector3::repeat(mean[3] * session.dt),
            })
            .collect();
        let known = Belief {
            mean,
            p: DMatrix::zeros(6, 6),
        };
        let unbiased = aligned(&session, &session.increments()).unwrap().nav.q_bn;
        let turned = |of: &Aligned| (unbiased * of.nav.q_bn.inverse()).scaled_axis().norm();
        let plain = aligned(&session, &biased).unwrap();
        let knowing = aligned_knowing(&session, &biased, &model, &known).unwrap();
        assert!(turned(&plain) > 5e-3, "{}", turned(&plain));
        assert!(turned(&knowing) < 1e-9, "{}", turned(&knowing));
        let filter = knowing.filter_knowing(model, &a, &known);
        assert!(filter.p.view((0, NAV), (NAV, 6)).amax() == 0.0);
        assert_eq!(filter.theta, known.mean);
    }
}
