//! Process noise of the classical filters. For each group of errors it is chosen by search over
//! training units that no campaign judges.

use super::causes::Size;
use super::memory::REMEMBERING;
use super::schemes::{Case, FILTERS, Tuned, filtered, none, nones, rnn_increments};
use super::statistics::median;
use super::turn_on;
use super::{Campaign, Group, bench};
use crate::experiment::results::Row;
use host_core::error::Error;
use host_core::inertial::ekf::TurnOn;
use host_core::inertial::free_inertial::FreeInertial;
use host_core::inertial::sins::Increment;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::imu::world::StartName;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Candidates for the walk. The range is so wide that the best is not the last one.
const WALKS: [f64; 13] = [
    0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8,
];
/// Candidates for the noise of the filter without a model.
const FACTORS: [f64; 11] = [
    0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0,
];
/// Without a search: noise of the filter without a model, which a search chooses in most groups,
/// and the shares of the variances that are new at a turn-on.
const UNTUNED_NONE: f64 = 10.0;
const KNOWN: TurnOn = TurnOn {
    gyro: 0.005,
    accel: 0.005,
    law: 0.001,
};
/// Number of the first unit to train on: far above any run's.
pub(super) const FIRST_UNIT: u32 = 4_000_000_000;

/// The common setting of all runs of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Temperature of the unit at power-on: cold, warm or hot.
    pub start: StartName,
    /// Numbers of earlier drives.
    pub drives: Vec<u32>,
    /// Whether the judged drive has fixes.
    pub fixes: bool,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            start: StartName::Cold,
            drives: vec![0],
            fixes: true,
        }
    }
}

/// Names of the simulated unit and vehicle, for information. The fingerprint contains their values.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Simulated {
    /// Unit: a preset or a file, as it was given.
    pub unit: String,
    /// Vehicle.
    pub vehicle: String,
}

/// The tuned parameters of each group.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    chosen: Vec<(Group, Tuned)>,
    /// The setting for which the filters were tuned.
    pub setting: Setting,
    /// Names of the simulated unit and vehicle; empty in directories of older versions.
    #[serde(default)]
    pub simulated: Simulated,
    /// Number of training units; 0 in directories of older versions.
    #[serde(default)]
    pub units: u32,
}

/// Errors at the end of the free-inertial part with each candidate, m.
struct Tried {
    walks: [[f64; WALKS.len()]; FILTERS.len()],
    none: [f64; FACTORS.len()],
    rnn: [f64; FACTORS.len()],
}

impl Tuning {
    /// Searches for the least median horizontal error at the end of the free-inertial part. Calls
    /// `progress` after each unit, once a round ([`Campaign::tuning_rounds`]).
    ///
    /// # Errors
    /// A standstill that gives no attitude.
    pub fn find(
        campaign: &Campaign,
        imu: &ImuSpec,
        progress: &(dyn Fn() + Sync),
    ) -> Result<Self, Error> {
        if campaign.tuning_units == 0 {
            return Ok(Self::untuned(campaign));
        }
        let units: Result<Vec<Vec<Tried>>, Error> = (0..campaign.tuning_units)
            .into_par_iter()
            .map(|k| {
                let tried = Self::unit(campaign, imu, FIRST_UNIT + k);
                progress();
                tried
            })
            .collect();
        let units = units?;
        let sizes = sizes(campaign, imu);
        let models = campaign.measured();
        let chosen = models.iter().enumerate().map(|(group, model)| {
            let of = |pick: &dyn Fn(&Tried) -> f64| {
                let mut errors: Vec<f64> = units.iter().map(|u| pick(&u[group])).collect();
                median(&mut errors)
            };
            let tuned = Tuned {
                walks: std::array::from_fn(|filter| match campaign.tunes(FILTERS[filter]) {
                    true => best(&WALKS, |i| of(&|t| t.walks[filter][i])),
                    false => Tuned::default().walks[filter],
                }),
                none_factor: best(&FACTORS, |i| of(&|t| t.none[i])),
                rnn_factor: best(&FACTORS, |i| of(&|t| t.rnn[i])),
                cause: sizes
                    .iter()
                    .find(|(g, _)| g == model)
                    .map_or_else(Size::default, |s| s.1),
                ..Tuned::default()
            };
            (*model, tuned)
        });
        let mut tuning = Self {
            chosen: chosen.collect(),
            setting: campaign.setting(),
            simulated: campaign.simulated(),
            units: campaign.tuning_units,
        };
        turn_on::search(campaign, imu, &mut tuning, progress)?;
        Ok(tuning)
    }

    /// Without a search: the filters know as well as the simulation how much is new at a turn-on,
    /// and allow for it exactly.
    fn untuned(campaign: &Campaign) -> Self {
        let tuned = Tuned {
            none_factor: UNTUNED_NONE,
            turn_on: [KNOWN; REMEMBERING.len()],
            ..Tuned::default()
        };
        let models = campaign.measured();
        Self {
            chosen: models.iter().map(|model| (*model, tuned)).collect(),
            setting: campaign.setting(),
            simulated: campaign.simulated(),
            units: 0,
        }
    }

    /// Sets the share that is new at every turn-on for a filter with a memory.
    pub(super) fn set_turn_on(&mut self, model: Group, index: usize, turn_on: TurnOn) {
        let found = self.chosen.iter_mut().find(|(m, _)| *m == model);
        if let Some((_, tuned)) = found {
            tuned.turn_on[index] = turn_on;
        }
    }

    /// Every candidate on one unit, for each group of errors.
    fn unit(campaign: &Campaign, imu: &ImuSpec, k: u32) -> Result<Vec<Tried>, Error> {
        let mut out = Vec::new();
        let lost = || campaign.scenario.no_attitude();
        let tuned = |filter: &usize| campaign.tunes(FILTERS[*filter]);
        let tuned: Vec<usize> = (0..FILTERS.len()).filter(tuned).collect();
        let each = tuned
            .iter()
            .flat_map(|&filter| WALKS.map(|walk| (filter, walk)));
        let plain = FACTORS.map(|factor| (bench::NONE, factor));
        let wanted: Vec<(usize, f64)> = each.chain(plain).collect();
        let prepare = |cases: &[(Group, Case<'_>)]| {
            let each: Vec<_> = cases.iter().map(|(_, case)| (case, &wanted[..])).collect();
            bench::prepare(&each).ok_or_else(lost)
        };
        campaign.prepared((imu, &campaign.measured()), k, prepare, |_, case| {
            let error = |free: Option<FreeInertial>| -> Result<f64, Error> {
                free.as_ref().and_then(error_m).ok_or_else(lost)
            };
            let mut tried = Tried {
                walks: [[0.0; WALKS.len()]; FILTERS.len()],
                none: [0.0; FACTORS.len()],
                rnn: [0.0; FACTORS.len()],
            };
            case.bench.fly(case, &wanted).ok_or_else(lost)?;
            for &filter in &tuned {
                for (slot, walk) in tried.walks[filter].iter_mut().zip(WALKS) {
                    *slot = error(filtered(case, filter, walk))?;
                }
            }
            let of = |increments: &[Increment]| -> Result<Vec<f64>, Error> {
                let free = nones(case, increments, &FACTORS).ok_or_else(lost)?;
                free.into_iter().map(|free| error(Some(free))).collect()
            };
            for (slot, factor) in tried.none.iter_mut().zip(FACTORS) {
                *slot = error(none(case, case.increments(), factor))?;
            }
            case.bench.land();
            if !campaign.wants("rnn-window") {
                out.push(tried);
                return Ok(());
            }
            let corrected = rnn_increments(case).ok_or_else(lost)?;
            match corrected.as_ptr() == case.increments().as_ptr() {
                true => tried.rnn = tried.none,
                false => tried.rnn.copy_from_slice(&of(&corrected)?),
            }
            out.push(tried);
            Ok(())
        })?;
        Ok(out)
    }

    /// The tuned parameters of a group.
    #[must_use]
    pub fn of(&self, model: Group) -> Tuned {
        let found = self.chosen.iter().find(|(m, _)| *m == model);
        found.map_or_else(Tuned::default, |(_, t)| *t)
    }
}

/// Horizontal error at the end of the free-inertial part, m.
pub(super) fn error_m(free: &FreeInertial) -> Option<f64> {
    Row::of(free, "", 22 * 60).map(|row| row.horizontal_m)
}

/// The text of a walk, marked if it is at the upper edge of the candidates.
pub(super) fn walk_text(walk: f64) -> String {
    marked(walk, &WALKS[WALKS.len() - 1..])
}

/// The text of a factor, marked if it is at an edge of the candidates.
pub(super) fn factor_text(factor: f64) -> String {
    marked(factor, &[FACTORS[0], FACTORS[FACTORS.len() - 1]])
}

/// The text of a value, marked if it is one of `edges`.
fn marked(value: f64, edges: &[f64]) -> String {
    let at_edge = edges.iter().any(|edge| edge.total_cmp(&value).is_eq());
    format!("{value}{}", if at_edge { " (edge)" } else { "" })
}

/// Sizes of the causes that schemes know, over the units to train on.
fn sizes(campaign: &Campaign, imu: &ImuSpec) -> Vec<(Group, Size)> {
    let units: Vec<_> = (0..campaign.tuning_units)
        .into_par_iter()
        .map(|k| campaign.causes(imu, FIRST_UNIT + k))
        .collect();
    let groups = units.first().map_or(0, Vec::len);
    let of = |index: usize| {
        let all: Vec<&[Increment]> = units.iter().map(|unit| &unit[index].1[..]).collect();
        (units[0][index].0, Size::of(&all, campaign.aided()))
    };
    (0..groups).map(of).collect()
}

/// The candidate with the smallest error, the first of equal ones.
fn best(candidates: &[f64], error: impl Fn(usize) -> f64) -> f64 {
    let mut best = (f64::INFINITY, candidates[0]);
    for (i, c) in candidates.iter().enumerate() {
        let error = error(i);
        if error < best.0 {
            best = (error, *c);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_at_an_edge_are_marked() {
        let walks = [0.0, 1e-3, 0.4, 6.4, 12.8].map(walk_text);
        assert_eq!(walks, ["0", "0.001", "0.4", "6.4", "12.8 (edge)"]);
        let factors = [0.03, 0.1, 30.0, 1000.0, 3000.0].map(factor_text);
        assert_eq!(factors, ["0.03 (edge)", "0.1", "30", "1000", "3000 (edge)"]);
    }
}
