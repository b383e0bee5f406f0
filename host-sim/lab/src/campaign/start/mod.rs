//! The start of the device's learner: success and heading error by classes of sensors, vehicles and
//! locations.
//!
//! A trial is one turn-on. The sensor's errors are drawn from its unit, the vehicle moves by a
//! journey of its own, and the receiver sends fixes. The device's learner is that of the firmware
//! and gets every sample.

mod class;
mod markdown;
mod receiver;
mod summary;
mod trial;

pub use class::{CLASSES, Class, Goal, JOURNEY_S, chosen};
pub use markdown::{HEADS, markdown, row};
pub use receiver::Receiver;
pub use summary::{Share, Spread, Summary};
pub use trial::{Attitude, LATER_S, MOST_HZ, Prepared, Started, Trial};

use host_core::error::Error;
use host_unit::Unit;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};

/// The settings of a study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Classes, each once.
    pub classes: Vec<Class>,
    /// Trials of each class, numbered from 0.
    pub seeds: u32,
    /// A sensor for all classes instead of their own.
    pub unit: Option<Unit>,
    /// The receiver.
    pub receiver: Receiver,
}

/// The trials of a class, with their statistics.
#[derive(Debug, Clone, Serialize)]
pub struct Tried {
    /// The statistics.
    #[serde(flatten)]
    pub summary: Summary,
    /// The trials by their seeds.
    pub trials: Vec<Trial>,
}

impl Study {
    /// Number of all trials.
    #[must_use]
    pub fn trials(&self) -> usize {
        self.classes.len() * self.seeds as usize
    }

    /// Runs the trials on rayon's threads. Calls `progress` after each trial. After `stop` no
    /// further trial starts, and the result contains those that are done. The first seeds of all
    /// classes come first.
    ///
    /// # Errors
    /// A unit that a device rejects; a rate of fixes that does not divide the samples.
    pub fn execute(
        &self,
        stop: &AtomicBool,
        progress: &(dyn Fn() + Sync),
    ) -> Result<Vec<Tried>, Error> {
        let prepare = |class| Prepared::new(class, self.unit.as_ref(), &self.receiver);
        let prepared: Result<Vec<_>, Error> = self.classes.iter().map(prepare).collect();
        let prepared = prepared?;
        let all: Vec<(u32, &Prepared)> = (0..self.seeds)
            .flat_map(|seed| prepared.iter().map(move |class| (seed, class)))
            .collect();
        let done: Vec<Trial> = all
            .into_par_iter()
            .with_max_len(1)
            .filter_map(|(seed, class)| {
                if stop.load(Ordering::Relaxed) {
                    return None;
                }
                let trial = class.run(seed);
                progress();
                Some(trial)
            })
            .collect();
        let tried = prepared.iter().map(|prepared| {
            let class = &prepared.class;
            let of = done.iter().filter(|trial| trial.class == class.name);
            let trials: Vec<Trial> = of.cloned().collect();
            let unit = self.unit.as_ref().map_or(class.unit, |unit| &unit.name);
            Tried {
                summary: Summary::of(class, unit, &trials),
                trials,
            }
        });
        Ok(tried.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_have_different_names_and_units_that_a_device_takes() {
        for (i, class) in CLASSES.iter().enumerate() {
            assert!(CLASSES[..i].iter().all(|other| other.name != class.name));
            Prepared::new(class, None, &Receiver::default()).unwrap();
        }
    }

    #[test]
    fn all_classes_and_some_by_name() {
        let names = |names: &[&str]| -> Result<Vec<&str>, Error> {
            let names: Vec<String> = names.iter().map(|name| (*name).into()).collect();
            Ok(chosen(&names)?.iter().map(|class| class.name).collect())
        };
        assert_eq!(names(&[]).unwrap().len(), CLASSES.len());
        assert_eq!(names(&["all"]).unwrap(), names(&[]).unwrap());
        assert_eq!(names(&["laser-47"]).unwrap(), ["laser-47"]);
        assert!(names(&["laser-48"]).is_err());
    }

    /// A class by name, an interruption, and the same figures again.
    #[test]
    fn a_study_can_be_repeated_and_interrupted() {
        let study = Study {
            classes: chosen(&["laser-47".into()]).unwrap(),
            seeds: 2,
            unit: None,
            receiver: Receiver::default(),
        };
        let never = AtomicBool::new(false);
        let [tried, again] = [(); 2].map(|()| study.execute(&never, &|| ()).unwrap());
        assert_eq!(tried[0].trials, again[0].trials);
        assert_eq!(tried[0].summary.started.k, 2);
        assert_eq!(tried[0].summary.silently_wrong, 0);
        assert_ne!(tried[0].trials[0].started, tried[0].trials[1].started);
        let stopped = study.execute(&AtomicBool::new(true), &|| ()).unwrap();
        assert_eq!(
            (stopped[0].trials.len(), stopped[0].summary.started.n),
            (0, 0)
        );
    }

    /// A hand swings the sensor: scale factors, misalignments and g-sensitivity do again and again
    /// what they did before. The device knows its heading no better than it claims, with a
    /// receiver's velocities and without.
    #[test]
    fn a_sensor_that_is_swung_is_not_silently_wrong() {
        const SEEDS: u32 = 8;
        let mut exact = Receiver {
            positions_only: true,
            ..Receiver::default()
        };
        (exact.noise.horizontal_m, exact.noise.vertical_m) = (0.1, 0.15);
        for receiver in [Receiver::default(), exact] {
            let study = Study {
                classes: chosen(&["hand-held".into()]).unwrap(),
                seeds: SEEDS,
                unit: None,
                receiver,
            };
            let tried = study.execute(&AtomicBool::new(false), &|| ()).unwrap();
            let Summary {
                started,
                silently_wrong,
                normalised_square: [_, later @ ..],
                ..
            } = &tried[0].summary;
            println!("{:?}", tried[0].summary);
            assert_eq!((started.k, *silently_wrong), (SEEDS as usize, 0));
            // one degree of freedom each, and four standard deviations
            let most = 1.0 + 4.0 * (2.0 / f64::from(SEEDS)).sqrt();
            assert!(
                later.iter().flatten().all(|square| *square < most),
                "{later:?}"
            );
        }
    }
}
