//! The prior of a type of sensor, learnt from a fleet of units: [`host_unit::prior::Prior`].
//!
//! Each drive of each unit becomes a series of errors (`series`). That is most of the work, and its
//! results are stored unit by unit (`runs`). Then a fit finds, for each triad independently, the
//! common hidden layers of the units (`fit`, `shape`), and the scatter of their output layers and
//! turn-on biases (`linear`).

mod recorded;
mod series;

pub use recorded::{folders, readings};
pub use series::{Drive, Error10};

use super::runs::{Runs, Stamp, gathered, same_stamp};
use super::{AIDED_S, Campaign, DriveOfRun, Group, STANDSTILL_S, Seeds};
use firmware::inputs::{Inputs, settles};
use firmware::learn::prior::Datasheet;
use host_core::error::Error;
use host_core::inertial::units::{DEG_PER_H, UG};
use host_estimation::learning::fleet::fit::{
    self, DriveData, Fitted, Law, Parts, STARTS, UnitData, mean_of,
};
use host_estimation::learning::fleet::linear::Point;
use host_estimation::learning::teacher::Assumptions;
use host_unit::Unit;
use host_unit::networks::Networks;
use host_unit::prior::{Prior, Triad};
use lrnn_nostd::Normalisation;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// First seed of a simulated fleet's units. It is apart from the runs of campaigns, and from their
/// training units.
const FIRST_UNIT: u32 = 3_000_000_000;
/// Smallest number of units with two drives or more.
pub const LEAST_UNITS: usize = 10;
/// Smallest standard deviation of an error, as a share of the output.
const LEAST_SIGMA: f64 = 0.01;

const STAMP: Stamp = Stamp {
    file: "fleet.txt",
    other: "holds another fleet (other version, scenario, errors, inputs, drives or recordings)",
    foreign: "holds a directory 'runs' that is not a fleet's",
};

/// The source of the drives.
#[derive(Debug, Clone)]
pub enum Origin {
    /// A simulation of units.
    Simulation {
        /// Scenario, start and shards.
        campaign: Box<Campaign>,
        /// Errors of the sensors.
        group: Group,
        /// Number of drives of each unit.
        drives: u32,
    },
    /// Folders of units.
    Recordings {
        /// One folder for each unit.
        units: Vec<PathBuf>,
        /// The type of all units.
        unit: Box<Unit>,
    },
}

/// A fleet.
#[derive(Debug, Clone)]
pub struct Fleet {
    /// Its drives.
    pub from: Origin,
    /// Inputs of the networks of gyros and accelerometers.
    pub inputs: Inputs,
    /// Directory of the series.
    pub out: PathBuf,
    /// Whether to keep finished series of an earlier start.
    pub resume: bool,
    /// Shard and number of shards: only units with `number % shards == shard` are processed.
    pub shard: (u32, u32),
}

impl Fleet {
    /// Numbers of this shard's units.
    #[must_use]
    pub fn wanted(&self) -> Vec<u32> {
        let all = match &self.from {
            Origin::Simulation { campaign, .. } => campaign.runs,
            Origin::Recordings { units, .. } => units.len() as u32,
        };
        let (shard, shards) = self.shard;
        (0..all).filter(|k| k % shards == shard).collect()
    }

    /// Computes the missing series on rayon's threads. Calls `progress` after each unit.
    ///
    /// # Errors
    /// Unwritable directory; a directory of another fleet; a drive that gives no attitude; a folder
    /// without drives.
    pub fn execute(&self, progress: &(dyn Fn() + Sync)) -> Result<(), Error> {
        let runs = Runs::open(&self.out, &STAMP, &self.fingerprint())?;
        match (self.resume, self.shard.1) {
            (true, _) => {}
            (false, 1) => runs.forget_all(None)?,
            (false, _) => runs.forget(&self.wanted())?,
        }
        runs.begin()?;
        self.wanted().into_par_iter().try_for_each(|k| {
            if runs.load::<Drive>(k)?.is_none() {
                runs.save(k, &self.drives(k)?)?;
            }
            progress();
            Ok(())
        })
    }

    /// The drives of one unit.
    fn drives(&self, k: u32) -> Result<Vec<Drive>, Error> {
        match &self.from {
            Origin::Recordings { units, unit } => {
                let dir = units
                    .get(k as usize)
                    .map_or_else(PathBuf::new, Clone::clone);
                recorded::drives((k, &dir), unit, &self.inputs)
            }
            Origin::Simulation {
                campaign,
                group,
                drives,
            } => {
                let imu = campaign.imu();
                let mut out = Vec::new();
                for number in 1..=*drives {
                    let part = DriveOfRun {
                        seeds: Seeds::of_earlier(FIRST_UNIT + k, number),
                        drive_s: AIDED_S,
                        until: STANDSTILL_S + AIDED_S,
                        fixes: true,
                        judged: false,
                    };
                    campaign.part(
                        &imu,
                        &part,
                        &[*group],
                        |_| Ok(()),
                        |_, case| {
                            let drive =
                                Drive::of(k, case.session, case.knows.assumptions, &self.inputs);
                            out.push(drive.ok_or_else(|| campaign.scenario.no_attitude())?);
                            Ok(())
                        },
                    )?;
                }
                Ok(out)
            }
        }
    }

    /// The settings on which the series depend, as text.
    fn fingerprint(&self) -> String {
        let from = match &self.from {
            Origin::Simulation {
                campaign,
                group,
                drives,
            } => format!("{:?}|{group}|{drives}", campaign.scenario),
            Origin::Recordings { units, unit } => format!("{units:?}|{unit:?}"),
        };
        format!("{}|{from}|{:?}", env!("CARGO_PKG_VERSION"), self.inputs)
    }
}

/// The drives in the directories of a fleet's shards with these inputs, unit by unit.
///
/// # Errors
/// A directory that is not a fleet's, fleets that do not belong together, other inputs, or a
/// broken file.
pub fn merge(dirs: &[PathBuf], inputs: &Inputs) -> Result<Vec<Vec<Drive>>, Error> {
    let stamp = same_stamp(dirs, &STAMP)?;
    if !stamp.trim_end().ends_with(&format!("|{inputs:?}")) {
        return Err(Error::Option {
            option: "--inputs".into(),
            problem: "are not those of the shards".into(),
            remedy: "give --inputs and --accel-inputs as for the shards".into(),
        });
    }
    let mut units: BTreeMap<u32, Vec<Drive>> = BTreeMap::new();
    for drive in gathered::<Drive>(dirs)? {
        units.entry(drive.unit).or_default().push(drive);
    }
    Ok(units.into_values().collect())
}

/// Number of calls of `progress` by [`learn`].
pub const PROGRESS: usize = 2 * (STARTS + 1);

/// The prior of the type `unit`, whose units have these drives. `inputs` are those of the series.
///
/// # Errors
/// Too few units with two drives.
pub fn learn(
    units: &[Vec<Drive>],
    inputs: &Inputs,
    unit: &Unit,
    progress: &dyn Fn(),
) -> Result<Prior, Error> {
    let several: Vec<&Vec<Drive>> = units.iter().filter(|drives| drives.len() > 1).collect();
    if several.len() < LEAST_UNITS {
        return Err(Error::Option {
            option: "fleet".into(),
            problem: format!(
                "only {} units have two drives or more, too few to separate a type from a unit",
                several.len()
            ),
            remedy: format!("give at least {LEAST_UNITS} units, each with several drives"),
        });
    }
    let prior = Assumptions::of(unit).prior;
    let output = [prior.gyro_bias, prior.accel_bias];
    let sheet = Datasheet::land_vehicle(prior.gyro_bias as f32, prior.accel_bias as f32);
    let scales = sheet.driven_normalisation(inputs);
    let triad = |index: usize| {
        let data: Vec<UnitData> = several
            .iter()
            .map(|drives| {
                let of = |drive: &Drive| data(drive, index, &scales[index], output[index]);
                drives.iter().map(of).collect()
            })
            .collect();
        let per = [DEG_PER_H, UG][index];
        let found = of_triad(&data, settles(inputs), progress);
        Triad {
            inputs: inputs[index].map(Into::into),
            input_offset: scales[index].input_offset.map(short),
            input_scale: scales[index].input_scale.map(short),
            output: rounded(output[index] / per),
            ..found
        }
    };
    Ok(Prior {
        units: several.len() as u32,
        drives: several.iter().map(|drives| drives.len() as u32).sum(),
        gyro: triad(0),
        accel: triad(1),
    })
}

/// One drive for the fit, with inputs and errors in units of the network.
fn data(drive: &Drive, triad: usize, scales: &Normalisation, output: f64) -> DriveData {
    let normal = |all: &[f32; 3]| scales.input(*all).map(f64::from);
    let points = [0, 1, 2].map(|axis| {
        let of = |e: &Error10| Point {
            second: e.second as usize,
            error: f64::from(e.error[triad][axis]) / output,
            weight: (f64::from(e.sigma[triad][axis]) / output)
                .max(LEAST_SIGMA)
                .powi(-2),
        };
        drive.errors.iter().map(of).collect()
    });
    DriveData {
        inputs: drive.inputs[triad].iter().map(normal).collect(),
        points,
    }
}

/// The prior of a triad. `settles`: its networks start in their steady state.
fn of_triad(units: &[UnitData], settles: bool, progress: &dyn Fn()) -> Triad {
    let parts = Parts::of(units);
    let network = fit::fit(&parts, settles, progress);
    let [line, biases] = [Law::Linear, Law::Biases].map(|law| fit::rival(law, &parts));
    let left = |fitted: &Fitted| {
        let mut left = fitted.left(&parts.judge);
        super::statistics::median(&mut left)
    };
    let [first, second] = network.layers();
    let moments = &network.moments;
    let (mean_w, mean_b) = mean_of(moments);
    let mut triad = Triad {
        inputs: Networks::default().gyro_inputs,
        input_offset: [0.0; 3],
        input_scale: [1.0; 3],
        output: 1.0,
        sigma_w: [moments.sigma[0], moments.sigma[1], moments.sigma[2]],
        sigma_b: moments.sigma[3],
        sigma_turn_on: moments.turn_on,
        left: [left(&network), left(&line), left(&biases)],
        mean_w,
        mean_b,
        first: first.into(),
        second: second.into(),
    };
    triad.numbers(|x| *x = rounded(*x));
    triad
}

/// Rounds to the digits of an `f32`, so that files are short and give the same networks.
fn rounded(x: f64) -> f64 {
    format!("{x:.7e}").parse().unwrap_or(x)
}

/// An `f32` as the `f64` of its shortest text.
fn short(x: f32) -> f64 {
    x.to_string().parse().unwrap_or_else(|_| f64::from(x))
}

#[cfg(test)]
mod tests;
