//! The earlier drives of a unit: each on another day, with its own turn-on, road and fixes, and its
//! own start where starts are mixed.

use super::memory::{DEVICE, Memory, REMEMBERING, uses};
use super::rivals;
use super::{AIDED_S, Campaign, Case, DriveOfRun, Group, STANDSTILL_S, Seeds, Tuning};
use host_core::error::Error;
use host_core::simulator::imu::ImuSpec;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The random stream of the judged drive's seeds, and the distance of those of earlier drives.
const JUDGED: u64 = 7;
const APART: u64 = 1 << 8;

impl Seeds {
    /// The seeds of the judged drive of run `k`.
    #[must_use]
    pub fn of(k: u32) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(k));
        rng.set_stream(JUDGED);
        Self {
            heading: rng.random_range(0.0..std::f64::consts::TAU),
            unit: rng.random(),
            turn_on: rng.random(),
            drive: rng.random(),
        }
    }

    /// The seeds of the earlier drive `number` of the unit of run `k`, counted from 1.
    #[must_use]
    pub fn of_earlier(k: u32, number: u32) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(k));
        rng.set_stream(JUDGED + APART * u64::from(number));
        Self {
            heading: rng.random_range(0.0..std::f64::consts::TAU),
            unit: Self::of(k).unit,
            turn_on: rng.random(),
            drive: rng.random(),
        }
    }
}

/// A unit that has been turned on so many times before.
pub(super) fn turned_on(imu: &ImuSpec, times: u32) -> ImuSpec {
    let mut imu = imu.clone();
    imu.world.power.power_ons += times;
    imu
}

/// The memories of one unit, by number of earlier drives and group of errors.
pub(super) type Memories = Vec<(u32, Group, Memory)>;

impl Campaign {
    /// Runs the wanted schemes with a memory through the earlier drives of run `k`. Only drives
    /// that one of them uses are simulated.
    pub(super) fn known(&self, imu: &ImuSpec, tuning: &Tuning, k: u32) -> Result<Memories, Error> {
        let filters: Vec<usize> = (0..REMEMBERING.len())
            .filter(|&index| self.schemes().any(|(scheme, _)| uses(scheme, index)))
            .collect();
        let stores = self.schemes().any(|(scheme, _)| *scheme == DEVICE);
        let last = self.drives.iter().copied().max().unwrap_or(0);
        let mut known = Memories::new();
        let rivals: Vec<&str> = self
            .schemes()
            .map(|(scheme, _)| *scheme)
            .filter(|scheme| rivals::without_memory(scheme).is_some())
            .collect();
        if filters.is_empty() && !stores && rivals.is_empty() {
            return Ok(known);
        }
        let mut present = Memories::new();
        let lost = || self.scenario.no_attitude();
        for number in 1..=last {
            self.earlier(imu, k, number, |model, case| {
                let at = present.iter().position(|(_, of, _)| *of == model);
                let at = at.unwrap_or_else(|| {
                    present.push((0, model, Memory::default()));
                    present.len() - 1
                });
                let (drives, _, memory) = &mut present[at];
                *drives = number;
                case.tuned(tuning.of(model), |case| {
                    for index in &filters {
                        memory.keep(*index, case).ok_or_else(lost)?;
                    }
                    for scheme in &rivals {
                        memory.recall(scheme, case).ok_or_else(lost)?;
                    }
                    if stores {
                        memory.store(case);
                    }
                    Ok(())
                })?;
                if self.drives.contains(&number) {
                    known.push(present[at].clone());
                }
                Ok(())
            })?;
        }
        Ok(known)
    }

    /// Calls `pass` with the earlier drive `number` of run `k`, as measured with each group of
    /// errors. It has fixes to its end.
    pub(super) fn earlier(
        &self,
        imu: &ImuSpec,
        k: u32,
        number: u32,
        pass: impl FnMut(Group, &Case<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let part = DriveOfRun {
            seeds: Seeds::of_earlier(k, number),
            drive_s: AIDED_S,
            until: STANDSTILL_S + AIDED_S,
            fixes: true,
            judged: false,
        };
        let imu = turned_on(imu, number - 1);
        self.part(&imu, &part, &self.models, |_| Ok(()), pass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::simulator::imu::world::{Power, StartName};

    #[test]
    fn earlier_drives_are_other_days_of_the_same_unit() {
        let judged = Seeds::of(3);
        let drives: Vec<Seeds> = (1..=60).map(|n| Seeds::of_earlier(3, n)).collect();
        assert!(drives.iter().all(|d| d.unit == judged.unit));
        let mut seeds: Vec<u64> = drives.iter().flat_map(|d| [d.turn_on, d.drive]).collect();
        seeds.extend([judged.turn_on, judged.drive]);
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 2 * 61);
        assert_eq!(Seeds::of_earlier(3, 7), drives[6]);
        let power = Power {
            start: StartName::Mixed,
            ..Power::default()
        };
        for kind in [StartName::Cold, StartName::Warm, StartName::Hot] {
            let of = |d: &&Seeds| power.history_of(d.turn_on).start == kind;
            assert!(
                (8..=32).contains(&drives.iter().filter(of).count()),
                "{kind}"
            );
        }
    }
}
