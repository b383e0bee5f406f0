//! Process noise of the classical filters, chosen for each group of errors by search over training units that no campaign judges.

use super::{Campaign, Knowledge, Scheme, judge, learn_epochs};
use crate::error::Error;
use crate::imu::{ErrorModelName, ImuSpec};
use crate::session::Session;
use rayon::prelude::*;

/// Walk of a bias an hour, relative to its prior, that the datasheet's in-run drift means for the presets.
pub const DATASHEET_WALK: f64 = 0.05;
/// Candidates for the walk.
const WALKS: [f64; 8] = [0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2];
/// Candidates for the noise of the filter without a model.
const FACTORS: [f64; 4] = [1.0, 3.0, 10.0, 30.0];
/// Number of the first unit to train on: far above any run's.
const FIRST_UNIT: u32 = 4_000_000_000;

/// What was chosen for one group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuned {
    /// Walk for `ekf6-tuned`.
    pub walk: f64,
    /// Noise factor for `none`.
    pub none_factor: f64,
    /// Noise factor for the filter behind the networks.
    pub rnn_factor: f64,
}

/// What was chosen for each group.
#[derive(Debug, Clone, Default)]
pub struct Tuning {
    chosen: Vec<(ErrorModelName, Tuned)>,
}

impl Tuning {
    /// Searches. The measure is the median horizontal error at the end of the coast.
    ///
    /// # Errors
    /// A standstill that gives no attitude.
    pub fn find(campaign: &Campaign, imu: &ImuSpec) -> Result<Self, Error> {
        // the floor is judged in every campaign
        let mut models = campaign.models.clone();
        if !models.contains(&ErrorModelName::Noise) {
            models.push(ErrorModelName::Noise);
        }
        let units: Vec<Vec<(ErrorModelName, ImuSpec, Session)>> = (0..campaign.tuning_units)
            .into_par_iter()
            .map(|k| campaign.sessions(imu, FIRST_UNIT + k, &models))
            .collect();
        let median_error = |group: usize, scheme: Scheme| -> Result<f64, Error> {
            let errors: Result<Vec<f64>, Error> = units
                .par_iter()
                .map(|unit| {
                    let (_, spec, session) = &unit[group];
                    let knows = Knowledge {
                        datasheet: imu,
                        simulated: spec,
                    };
                    let coast = judge(
                        scheme,
                        session,
                        &session.increments(),
                        &knows,
                        learn_epochs(),
                    );
                    let row = coast.and_then(|c| c.row("", 22));
                    row.map(|r| r.horizontal_m)
                        .ok_or_else(|| campaign.scenario.no_attitude())
                })
                .collect();
            let mut errors = errors?;
            errors.sort_by(f64::total_cmp);
            Ok(0.5 * (errors[(errors.len() - 1) / 2] + errors[errors.len() / 2]))
        };
        let best =
            |group: usize, candidates: &[f64], scheme: fn(f64) -> Scheme| -> Result<f64, Error> {
                let mut best = (f64::INFINITY, candidates[0]);
                for c in candidates {
                    let error = median_error(group, scheme(*c))?;
                    if error < best.0 {
                        best = (error, *c);
                    }
                }
                Ok(best.1)
            };
        let mut chosen = Vec::new();
        for (group, model) in models.iter().enumerate() {
            let tuned = Tuned {
                walk: best(group, &WALKS, Scheme::Ekf6)?,
                none_factor: best(group, &FACTORS, Scheme::None)?,
                rnn_factor: best(group, &FACTORS, Scheme::RnnWindow)?,
            };
            chosen.push((*model, tuned));
        }
        Ok(Self { chosen })
    }

    /// What was chosen for a group.
    #[must_use]
    pub fn of(&self, model: ErrorModelName) -> Tuned {
        let found = self.chosen.iter().find(|(m, _)| *m == model);
        found.map_or(
            Tuned {
                walk: DATASHEET_WALK,
                none_factor: 1.0,
                rnn_factor: 1.0,
            },
            |(_, t)| *t,
        )
    }
}
