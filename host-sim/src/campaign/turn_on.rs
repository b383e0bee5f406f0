//! What is new at every turn-on, for the filters with a memory. The search that finds the walks
//! finds it, too, on the same further units. They have earlier drives with the same kind of start.
//!
//! First all have the same share; then the laws' is searched for, then that of the gyros' biases,
//! and then the accelerometers'. What counts is the geometric mean of the errors of all units, each
//! after one, two and four drives. Of equals the largest is taken: it trusts the past least.

use super::laws::Models;
use super::memory::{Kept, REMEMBERING, kept, pass, recalled};
use super::schemes::Case;
use super::tuning::{FIRST_UNIT, Tuning, error_m};
use super::{Campaign, Error, Group};
use crate::inertial::ekf::TurnOn;
use crate::simulator::imu::ImuSpec;
use rayon::prelude::*;

/// Candidates for a share of the prior variance, ascending. The last one is the end of its range:
/// nothing is remembered. Below the first one a bias walks more in a drive. They are dense where
/// turn-ons of good sensors lie: a tenth of the whole bias is a share of 0.01.
const SHARES: [f64; 11] = [1e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.3, 0.6, 1.0];
/// After so many earlier drives a unit is judged that is tuned on, at most. What is wrong with a
/// share adds up over drives.
const DRIVES: [u32; 3] = [1, 2, 4];

/// What is searched for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    All,
    Law,
    Gyro,
    Accel,
}

/// The searches, one after the other.
const STAGES: [Stage; 4] = [Stage::All, Stage::Law, Stage::Gyro, Stage::Accel];
/// How often each unit is simulated for them.
pub(super) const ROUNDS: u32 = STAGES.len() as u32;

impl Stage {
    fn candidate(self, share: f64, best: TurnOn) -> TurnOn {
        match self {
            Self::All => TurnOn::of_all(share),
            Self::Law => TurnOn { law: share, ..best },
            Self::Gyro => TurnOn {
                gyro: share,
                ..best
            },
            Self::Accel => TurnOn {
                accel: share,
                ..best
            },
        }
    }

    /// A filter without laws has no search for theirs.
    fn concerns(self, index: usize) -> bool {
        self != Self::Law || !is_alone(REMEMBERING[index].2)
    }
}

fn is_alone(models: Models) -> bool {
    std::ptr::fn_addr_eq(models, super::laws::biases as Models)
}

/// The candidates of one filter for one group of errors, and what each has kept.
struct Trial {
    model: Group,
    index: usize,
    candidates: Vec<TurnOn>,
    /// What each candidate has kept after the drives so far.
    now: Vec<Vec<Kept>>,
    /// The same after those of [`DRIVES`].
    kept: Vec<Vec<Vec<Kept>>>,
    /// Logarithm of the error of each candidate in the judged drive, summed up.
    logs: Vec<f64>,
}

impl Trial {
    /// The next earlier drive, `number` from 1. All candidates are alike before the first one.
    fn keep(&mut self, case: &Case<'_>, number: u32) -> Option<()> {
        let index = self.index;
        if self.now.is_empty() {
            let passed = pass(index, case, *self.candidates.first()?, &[])?;
            let of = |turn_on: &TurnOn| kept(index, case, *turn_on, &[], &passed);
            self.now = self.candidates.iter().map(of).collect();
        } else {
            let of = |(turn_on, before): (&TurnOn, &Vec<Kept>)| {
                let passed = pass(index, case, *turn_on, before)?;
                Some(kept(index, case, *turn_on, before, &passed))
            };
            let each = self.candidates.iter().zip(&self.now).map(of);
            self.now = each.collect::<Option<_>>()?;
        }
        if DRIVES.contains(&number) {
            self.kept.push(self.now.clone());
        }
        Some(())
    }

    /// The judged drive, after each number of drives.
    fn judge(&mut self, case: &Case<'_>) -> Option<()> {
        for kept in &self.kept {
            for ((turn_on, kept), sum) in self.candidates.iter().zip(kept).zip(&mut self.logs) {
                let free = recalled(self.index, case, *turn_on, kept)?;
                *sum += error_m(&free)?.ln();
            }
        }
        Some(())
    }
}

impl Campaign {
    /// Which of [`REMEMBERING`] are tuned: none without earlier drives.
    fn remembering(&self) -> Vec<usize> {
        let drives = self.drives.iter().any(|&drives| drives > 0);
        let wanted = |index: &usize| {
            let mut schemes = self.schemes();
            drives && schemes.any(|(name, _)| *name == REMEMBERING[*index].0)
        };
        (0..REMEMBERING.len()).filter(wanted).collect()
    }

    /// How often a unit is simulated to tune all filters.
    #[must_use]
    pub fn tuning_rounds(&self) -> u32 {
        match self.remembering().is_empty() {
            true => 1,
            false => 1 + ROUNDS,
        }
    }
}

/// Adds to `tuning` what is best for the filters with a memory.
pub(super) fn search(
    campaign: &Campaign,
    imu: &ImuSpec,
    tuning: &mut Tuning,
    progress: &(dyn Fn() + Sync),
) -> Result<(), Error> {
    let filters = campaign.remembering();
    if filters.is_empty() {
        return Ok(());
    }
    for stage in STAGES {
        let trials = trials(campaign, &filters, stage, tuning);
        let so_far = &*tuning;
        let units: Result<Vec<Vec<Trial>>, Error> = (0..campaign.tuning_units)
            .into_par_iter()
            .map(|k| {
                let tried = unit(campaign, imu, so_far, FIRST_UNIT + k, trials());
                progress();
                tried
            })
            .collect();
        let units = units?;
        for (i, trial) in trials().iter().enumerate() {
            let judged: usize = units.iter().map(|unit| unit[i].kept.len()).sum();
            let of = |candidate: usize| {
                let logs = units.iter().map(|unit| unit[i].logs[candidate]);
                (logs.sum::<f64>() / judged as f64).exp()
            };
            let errors: Vec<f64> = (0..trial.candidates.len()).map(of).collect();
            tuning.set_turn_on(trial.model, trial.index, trial.candidates[best(&errors)]);
        }
    }
    Ok(())
}

/// The last candidate of the least error.
fn best(errors: &[f64]) -> usize {
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let good = |error: &f64| *error <= least;
    errors.iter().rposition(good).unwrap_or(errors.len() - 1)
}

/// What a stage tries on each unit.
fn trials<'a>(
    campaign: &'a Campaign,
    filters: &'a [usize],
    stage: Stage,
    tuning: &Tuning,
) -> impl Fn() -> Vec<Trial> + Sync + use<'a> {
    let found: Vec<(Group, [TurnOn; REMEMBERING.len()])> = campaign
        .models
        .iter()
        .map(|&model| (model, tuning.of(model).turn_on))
        .collect();
    move || {
        let each = found.iter().flat_map(|(model, best)| {
            let filters = filters.iter().filter(|&&index| stage.concerns(index));
            filters.map(|&index| Trial {
                model: *model,
                index,
                candidates: SHARES.map(|s| stage.candidate(s, best[index])).to_vec(),
                now: Vec::new(),
                kept: Vec::new(),
                logs: vec![0.0; SHARES.len()],
            })
        });
        each.collect()
    }
}

/// All trials on one unit.
fn unit(
    campaign: &Campaign,
    imu: &ImuSpec,
    tuning: &Tuning,
    k: u32,
    mut trials: Vec<Trial>,
) -> Result<Vec<Trial>, Error> {
    let lost = || campaign.scenario.no_attitude();
    let most = campaign.drives.iter().copied().max().unwrap_or(0);
    for number in 1..=most.min(DRIVES[DRIVES.len() - 1]) {
        campaign.earlier(imu, k, number, |model, case| {
            let mut own = trials.iter_mut().filter(|trial| trial.model == model);
            case.tuned(tuning.of(model), |case| {
                own.try_for_each(|trial| trial.keep(case, number))
                    .ok_or_else(lost)
            })
        })?;
    }
    campaign.sessions(imu, k, |model, case| {
        let mut own = trials.iter_mut().filter(|trial| trial.model == model);
        case.tuned(tuning.of(model), |case| {
            own.try_for_each(|trial| trial.judge(case)).ok_or_else(lost)
        })
    })?;
    Ok(trials)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_error_is_taken_and_the_last_of_equals() {
        assert_eq!(best(&[5.0, 3.0, 3.01, 3.07, 9.0]), 1);
        assert_eq!(best(&[3.0, 3.0, 3.0]), 2);
        assert_eq!(best(&[1.0, 2.0, 3.0]), 0);
        assert_eq!(best(&[f64::NAN, f64::NAN]), 1);
    }
}
