//! The share of the errors that is new at every turn-on, for the filters with a memory. It is
//! searched for together with the walks, on the same training units. They have earlier drives with
//! the same kind of start.
//!
//! First all errors have the same share. Then the shares of the gyros' biases, of the
//! accelerometers' biases and of the laws are searched for one after the other. The score of biases
//! is the likelihood of the fixes of all earlier drives under the best model of each unit, each
//! before it learnt from them: the errors of a dozen free-inertial drives scatter too much to
//! distinguish shares. For laws the likelihood is less suitable: where starts are cold, warm and
//! hot, it takes a wrong law for one that is new at every turn-on. Their score is the geometric
//! mean of the errors of all units after one, two and four drives, smoothed over neighbouring
//! shares. Of equal shares the largest is taken, which relies least on earlier drives.

use super::laws::Models;
use super::memory::{REMEMBERING, StoredModel, pass, recalled, stored_models, uses};
use super::schemes::Case;
use super::tuning::{FIRST_UNIT, Tuning, error_m};
use super::{Campaign, Error, Group};
use host_core::inertial::ekf::TurnOn;
use host_core::simulator::imu::ImuSpec;
use rayon::prelude::*;

/// Candidates for the share of the prior variance, ascending. At the last one nothing is
/// remembered. Below the first one a bias walks more in a drive. They are dense in the range of
/// good sensors: a tenth of the whole bias is a share of 0.01.
const SHARES: [f64; 11] = [1e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.3, 0.6, 1.0];
/// Number of drives of a training unit. The first one contains no information on turn-ons.
const DRIVES: u32 = 4;
/// Numbers of drives after which errors are judged.
const JUDGED: [u32; 3] = [1, 2, 4];

/// The parameter that is searched for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SearchedParameter {
    All,
    Law,
    Gyro,
    Accel,
}

/// The searches, one after the other.
const STAGES: [SearchedParameter; 4] = [
    SearchedParameter::All,
    SearchedParameter::Gyro,
    SearchedParameter::Accel,
    SearchedParameter::Law,
];
/// Number of simulations of each unit for the searches.
pub(super) const ROUNDS: u32 = STAGES.len() as u32;

impl SearchedParameter {
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

    /// Whether it concerns a filter: one without laws has no share of laws.
    fn concerns(self, index: usize) -> bool {
        self != Self::Law || !is_alone(REMEMBERING[index].2)
    }
}

fn is_alone(models: Models) -> bool {
    std::ptr::fn_addr_eq(models, super::laws::biases as Models)
}

/// The candidates of one filter for one group of errors, and the memory of each.
struct Trial {
    model: Group,
    index: usize,
    candidates: Vec<TurnOn>,
    /// Whether the score is by errors, not by likelihood.
    judges: bool,
    /// The memory of each candidate after the drives so far.
    stored: Vec<Vec<StoredModel>>,
    /// The same after the drives of [`JUDGED`], if the score is by errors.
    after: Vec<Vec<Vec<StoredModel>>>,
    /// Sum of the logarithms of each candidate's errors in the judged drive.
    errors: Vec<f64>,
}

impl Trial {
    /// Runs the next drive, `number` from 1. All candidates are alike before the first one.
    fn keep(&mut self, case: &Case<'_>, number: u32) -> Option<()> {
        let index = self.index;
        if self.stored.is_empty() {
            let passed = pass(index, case, *self.candidates.first()?, &[])?;
            let of = |turn_on: &TurnOn| stored_models(index, case, *turn_on, &[], &passed);
            self.stored = self.candidates.iter().map(of).collect();
        } else {
            let of = |(turn_on, before): (&TurnOn, &Vec<StoredModel>)| {
                let passed = pass(index, case, *turn_on, before)?;
                Some(stored_models(index, case, *turn_on, before, &passed))
            };
            let each = self.candidates.iter().zip(&self.stored).map(of);
            self.stored = each.collect::<Option<_>>()?;
        }
        if self.judges && JUDGED.contains(&number) {
            self.after.push(self.stored.clone());
        }
        Some(())
    }

    /// Runs the judged drive after each number of drives.
    fn judge(&mut self, case: &Case<'_>) -> Option<()> {
        for stored in &self.after {
            for ((turn_on, stored), sum) in self.candidates.iter().zip(stored).zip(&mut self.errors)
            {
                let free = recalled(self.index, case, *turn_on, stored)?;
                *sum += error_m(&free)?.ln();
            }
        }
        Some(())
    }

    /// Score of a candidate: minus the sum of its errors' logarithms, or the logarithm of the
    /// likelihood of all fixes under its best model.
    fn score(&self, candidate: usize) -> f64 {
        if self.judges {
            return self.errors.get(candidate).map_or(f64::NAN, |sum| -sum);
        }
        let models = self.stored.get(candidate).into_iter().flatten();
        models
            .map(|stored| stored.score)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}

impl Campaign {
    /// Which of [`REMEMBERING`] are tuned: none without earlier drives.
    fn remembering(&self) -> Vec<usize> {
        let drives = self.drives.iter().any(|&drives| drives > 0);
        let wanted = |index: &usize| {
            let mut schemes = self.schemes();
            drives && schemes.any(|(name, _)| uses(name, *index))
        };
        (0..REMEMBERING.len()).filter(wanted).collect()
    }

    /// Number of simulations of a unit for the tuning of all filters.
    #[must_use]
    pub fn tuning_rounds(&self) -> u32 {
        match self.remembering().is_empty() {
            true => 1,
            false => 1 + ROUNDS,
        }
    }
}

/// Adds the best shares of the filters with a memory to `tuning`.
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
            let of = |candidate: usize| units.iter().map(|unit| unit[i].score(candidate)).sum();
            let scores: Vec<f64> = (0..trial.candidates.len()).map(of).collect();
            let scores = if trial.judges {
                smoothed(&scores)
            } else {
                scores
            };
            tuning.set_turn_on(trial.model, trial.index, trial.candidates[best(&scores)]);
        }
    }
    Ok(())
}

/// Each score with half of the weight, and its neighbours with a quarter each. At an end the score
/// itself replaces the missing neighbour.
fn smoothed(scores: &[f64]) -> Vec<f64> {
    let at = |k: usize| scores[k.min(scores.len() - 1)];
    let of = |k: usize| 0.25 * (at(k.saturating_sub(1)) + 2.0 * at(k) + at(k + 1));
    (0..scores.len()).map(of).collect()
}

/// The last candidate with the greatest score.
fn best(scores: &[f64]) -> usize {
    let most = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let good = |score: &f64| *score >= most;
    scores.iter().rposition(good).unwrap_or(scores.len() - 1)
}

/// The trials of a stage on each unit.
fn trials<'a>(
    campaign: &'a Campaign,
    filters: &'a [usize],
    stage: SearchedParameter,
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
                judges: stage == SearchedParameter::Law,
                stored: Vec::new(),
                after: Vec::new(),
                errors: vec![0.0; SHARES.len()],
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
    for number in 1..=DRIVES {
        campaign.earlier(imu, k, number, |model, case| {
            let mut own = trials.iter_mut().filter(|trial| trial.model == model);
            case.tuned(tuning.of(model), |case| {
                own.try_for_each(|trial| trial.keep(case, number))
                    .ok_or_else(lost)
            })
        })?;
    }
    if trials.iter().any(|trial| trial.judges) {
        campaign.sessions(imu, k, |model, case| {
            let mut own = trials.iter_mut().filter(|trial| trial.model == model);
            case.tuned(tuning.of(model), |case| {
                own.try_for_each(|trial| trial.judge(case)).ok_or_else(lost)
            })
        })?;
    }
    Ok(trials)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_lucky_candidate_counts_for_half() {
        let smooth = smoothed(&[0.0, 8.0, 0.0, 6.0, 6.0, 6.0]);
        assert_eq!(smooth, [2.0, 4.0, 3.5, 4.5, 6.0, 6.0]);
        assert_eq!(best(&smooth), 5);
    }

    #[test]
    fn the_greatest_density_is_taken_and_the_last_of_equals() {
        assert_eq!(best(&[-5.0, 3.0, 2.99, 1.0, -9.0]), 1);
        assert_eq!(best(&[3.0, 3.0, 3.0]), 2);
        assert_eq!(best(&[-1.0, -2.0, -3.0]), 0);
        assert_eq!(best(&[f64::NAN, f64::NAN]), 1);
    }
}
