//! Messages that are sent as JSON, with their schemas.

use crate::device::Now;
use crate::samples::Sample;
use crate::window::shown;
use host_device::device::Trials;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// Values of the axes x, y, z; forward, right, down in the usual mounting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(super) struct Axes {
    x: f64,
    y: f64,
    z: f64,
}

fn triads([a, b, c, x, y, z]: [f64; 6]) -> [Axes; 2] {
    [Axes { x: a, y: b, z: c }, Axes { x, y, z }]
}

/// One sample.
#[derive(Serialize, JsonSchema)]
pub(super) struct Imu {
    /// Rate, deg/s.
    rate: Axes,
    /// Specific force, m/s2.
    force: Axes,
}

impl Imu {
    pub fn of(sample: &Sample) -> Self {
        let [rate, force] = triads(shown(*sample));
        Self { rate, force }
    }
}

/// Sensor errors: gyros in deg/h, accelerometers in mg.
#[derive(Serialize, JsonSchema)]
pub(super) struct Errors {
    gyro: Axes,
    gyro_sigma: Axes,
    gyro_in_force: Axes,
    accel: Axes,
    accel_sigma: Axes,
    accel_in_force: Axes,
}

impl Errors {
    pub fn of(now: &Now) -> Option<Self> {
        let solution = now.status.solution.as_ref()?;
        let [gyro, accel] = triads(solution.estimate);
        let [gyro_sigma, accel_sigma] = triads(solution.sigma);
        let [gyro_in_force, accel_in_force] = triads(now.in_force);
        Some(Self {
            gyro,
            gyro_sigma,
            gyro_in_force,
            accel,
            accel_sigma,
            accel_in_force,
        })
    }
}

/// State and counters.
#[derive(Serialize, JsonSchema)]
pub(super) struct Health {
    mode: String,
    faults: Vec<String>,
    counters: BTreeMap<String, u32>,
    navigates: bool,
    heading_by: String,
    heading_sigma_deg: Option<f64>,
    in_force_hypothesis: u8,
    promotions: u32,
    rollbacks: u32,
    error_bound_m: [u32; 5],
    busy_percent: Option<f64>,
}

impl Health {
    pub fn of(now: &Now) -> Self {
        let status = &now.status;
        let counters = status.counters.iter();
        Self {
            mode: status.mode.into(),
            faults: status.faults.iter().map(|of| of.name.into()).collect(),
            counters: counters.map(|(name, n)| ((*name).into(), *n)).collect(),
            navigates: status.learner.navigates,
            heading_by: status.learner.way.into(),
            heading_sigma_deg: status.learner.heading_sigma_deg,
            in_force_hypothesis: status.learner.winner,
            promotions: status.learner.promotions,
            rollbacks: status.learner.rollbacks,
            error_bound_m: status.error_bound_m,
            busy_percent: status.busy_percent,
        }
    }
}

/// State of a hypothesis.
#[derive(Serialize, JsonSchema)]
pub(super) struct Standing {
    /// Log-likelihood relative to the zero correction's.
    evidence: f32,
    /// How near its proof is, of 100.
    proof: u8,
    /// Wealth of the bets that it does no harm, in stakes.
    check: f32,
    proved: bool,
}

/// State of the hypotheses.
#[derive(Serialize, JsonSchema)]
pub(super) struct Rehearsals {
    hypotheses: BTreeMap<String, Standing>,
    /// Rehearsals that have ended, of 5, 10, 30, 60, 120 and 300 s.
    ended: [u16; 6],
}

impl Rehearsals {
    pub fn of(trials: &Trials) -> Self {
        let part = trials.each.iter().filter(|of| of.enabled);
        let standing = part.map(|of| {
            let standing = Standing {
                evidence: of.evidence,
                proof: of.proof,
                check: of.check,
                proved: of.proved,
            };
            (of.key.to_owned(), standing)
        });
        Self {
            hypotheses: standing.collect(),
            ended: trials.rehearsals,
        }
    }
}
