//! The schemes of a campaign. Each is aided by fixes up to an epoch and navigates free inertial
//! from there, on the same samples.

use super::bench::{self, Bench, Task};
use super::causes::{Size, enlarged, enlarged_configuration};
use super::limit::limit;
use super::memory::{Memory, REMEMBERING, corrected_by_memory, recalled};
use super::rivals;
use super::zupt::zupt;
use firmware::learn::bank::{
    ALL, Gates, HYPOTHESES, KEYS, MAP, STORED, WITH_NETWORKS, ZERO_CORRECTION,
};
use host_core::inertial::ekf::{Aided, AuxiliaryData, ErrorModel, Noise, TurnOn};
use host_core::inertial::free_inertial::{FreeInertial, from_filter};
use host_core::inertial::session::{Session, Surroundings};
use host_core::inertial::sins::Increment;
use host_core::simulator::imu::{ImuSpec, UnitErrors};
use host_estimation::learning::device::Device;
use host_estimation::learning::fit::{Use, fit};
use host_estimation::learning::fix_learner;
use host_estimation::learning::teacher::{Assumptions, IN_RUN, aligned};
use host_estimation::learning::window::{compensator, corrected_increments};
use host_unit::scenario::network::NetworkSpec;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::cell::OnceCell;
use std::sync::Arc;

/// The classical filters, whose biases walk by a share of their prior in an hour. There are
/// two schemes of each: one with the walk of the datasheet, which the device's learner has too, and
/// one with the walk that was best on other units, by the same search for all of them.
pub const FILTERS: [&str; 7] = [
    "ekf6",
    "ekf12",
    "ekf24",
    "ekf-ramp",
    "ekf-exp",
    "ekf-temp",
    "ekf-inputs",
];

/// End of the name of a filter with a tuned walk.
pub const TUNED: &str = "-tuned";

/// The tuned parameters of one group.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tuned {
    /// Walks for the tuned classical filters.
    pub walks: [f64; FILTERS.len()],
    /// Noise factor for `uncorrected`.
    pub none_factor: f64,
    /// Noise factor for the filter behind the networks.
    pub rnn_factor: f64,
    /// Share of the errors that is new at every turn-on, for the filters with a memory.
    pub turn_on: [TurnOn; REMEMBERING.len()],
    /// Size of the cause on other units, for a group whose schemes know it.
    #[serde(default)]
    pub cause: Size,
}

impl Tuned {
    /// The walk of a tuned filter by its scheme's name. For all other schemes that of `ekf6-tuned`.
    #[must_use]
    pub fn walk_of(&self, scheme: &str) -> f64 {
        let filter = scheme.trim_end_matches(TUNED);
        let index = FILTERS.iter().position(|name| *name == filter);
        self.walks[index.unwrap_or(0)]
    }
}

impl Default for Tuned {
    fn default() -> Self {
        Self {
            walks: [IN_RUN[0]; FILTERS.len()],
            none_factor: 1.0,
            rnn_factor: 1.0,
            turn_on: [TurnOn::of_all(0.1); REMEMBERING.len()],
            cause: Size::default(),
        }
    }
}

/// One task: a session measured with one group of errors.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// The session, aided to `until`.
    pub session: &'a Session,
    /// Its [`Session::increments`], computed when a scheme asks for them.
    pub increments: &'a OnceCell<Vec<Increment>>,
    /// The classical filters that have run on it.
    pub bench: &'a Bench,
    /// Knowledge of the IMU.
    pub knows: Knowledge<'a>,
    /// Parameters that were tuned for this group of errors on other units.
    pub tuned: Tuned,
    /// Epoch at which the fixes end.
    pub until: usize,
    /// Whether the drive has fixes. Otherwise they end with the standstill.
    pub fixes: bool,
    /// Memory of earlier drives, if there were any.
    pub memory: Option<&'a Memory>,
}

impl<'a> Case<'a> {
    /// Calls `then` with this case and the tuned parameters of its group. Where the schemes know
    /// the group's cause, their datasheet includes it.
    pub(super) fn tuned<R>(&self, tuned: Tuned, then: impl FnOnce(&Case<'_>) -> R) -> R {
        let assumptions = enlarged(self.knows.assumptions, &tuned.cause);
        then(&self.with(tuned, &assumptions))
    }

    /// The case with tuned parameters, and the assumptions that belong to them.
    pub(super) fn with<'b>(&self, tuned: Tuned, assumptions: &'b Assumptions) -> Case<'b>
    where
        'a: 'b,
    {
        let knows = Knowledge {
            assumptions,
            ..self.knows
        };
        Case {
            tuned,
            knows,
            ..*self
        }
    }

    /// [`Session::increments`].
    pub fn increments(&self) -> &'a [Increment] {
        self.increments.get_or_init(|| self.session.increments())
    }
}

/// Knowledge of a scheme.
#[derive(Debug, Clone, Copy)]
pub struct Knowledge<'a> {
    /// Assumptions by the unit's datasheet, for all schemes. They do not say which groups of errors
    /// are simulated.
    pub assumptions: &'a Assumptions,
    /// The device of the unit, as its file configures it, before its first drive.
    pub device: &'a Device,
    /// The simulated IMU, for the oracle.
    pub simulated: &'a ImuSpec,
    /// The true errors of the unit, for the limit.
    pub unit: &'a UnitErrors,
    /// For the oracle: the sensors' errors in each second for which it has no parameters, rad/s and
    /// m/s2. Empty if there are none.
    pub beyond: &'a [Increment],
}

/// A scheme: aided to [`Case::until`], free inertial from there to the end. `None` if the
/// standstill gives no attitude.
pub type Scheme = fn(&Case<'_>) -> Option<FreeInertial>;

/// All schemes in the order of the tables, which add `floor`: `uncorrected` on an IMU with noise
/// only. Those of `rivals` take part only where they are named.
pub const SCHEMES: [(&str, Scheme); 33] = [
    ("uncorrected", |c| {
        none(c, c.increments(), c.tuned.none_factor)
    }),
    ("ekf6", |c| by_datasheet::<0>(c)),
    ("ekf6-tuned", |c| tuned::<0>(c)),
    ("ekf12", |c| by_datasheet::<1>(c)),
    ("ekf12-tuned", |c| tuned::<1>(c)),
    ("ekf24", |c| by_datasheet::<2>(c)),
    ("ekf24-tuned", |c| tuned::<2>(c)),
    ("ekf-ramp", |c| by_datasheet::<3>(c)),
    ("ekf-ramp-tuned", |c| tuned::<3>(c)),
    ("ekf-exp", |c| by_datasheet::<4>(c)),
    ("ekf-exp-tuned", |c| tuned::<4>(c)),
    ("ekf-temp", |c| by_datasheet::<5>(c)),
    ("ekf-temp-tuned", |c| tuned::<5>(c)),
    ("ekf-inputs", |c| by_datasheet::<6>(c)),
    ("ekf-inputs-tuned", |c| tuned::<6>(c)),
    (REMEMBERING[0].0, |c| remembering::<0>(c)),
    (REMEMBERING[1].0, |c| remembering::<1>(c)),
    (REMEMBERING[2].0, |c| remembering::<2>(c)),
    (REMEMBERING[3].0, |c| remembering::<3>(c)),
    ("ekf6-memory-frozen", |c| frozen::<0>(c)),
    ("ekf-exp-memory-frozen", |c| frozen::<1>(c)),
    ("ekf-temp-memory-frozen", |c| frozen::<2>(c)),
    ("ekf-inputs-memory-frozen", |c| frozen::<3>(c)),
    ("limit", limit),
    ("oracle", |c| {
        let assumptions = *c.knows.assumptions;
        let model = oracle(c.knows.simulated, c.session);
        aided_free_inertial(c, &without_beyond(c), &assumptions, model)
    }),
    ("rnn-window", |c| {
        none(c, &rnn_increments(c)?, c.tuned.rnn_factor)
    }),
    ("device", device),
    ("zupt", zupt),
    ("rest", rivals::rest),
    ("last", rivals::last),
    ("ekf6-tight", |c| rivals::tight::<0>(c)),
    ("ekf12-tight", |c| rivals::tight::<1>(c)),
    ("ekf24-tight", |c| rivals::tight::<2>(c)),
];

/// The device's learner with all its hypotheses, whose result corrects at once.
pub const LEARNER: &str = "learner";

/// The whole bank and parts of it, to compare the hypotheses of the learner: their names, and the
/// hypotheses that take part, one bit each. A hypothesis alone is used whatever its evidence.
pub fn ablations() -> impl Iterator<Item = (String, u8)> {
    let alone = (0..HYPOTHESES)
        .filter(|&index| ![ZERO_CORRECTION, STORED].contains(&index))
        .map(|index| (format!("only-{}", KEYS[index]), 1 << index));
    let all = ALL & !(1 << STORED);
    let without = [
        (LEARNER.to_owned(), all),
        ("no-networks".to_owned(), all & !WITH_NETWORKS),
        (format!("no-{}", KEYS[MAP]), all & !(1 << MAP)),
    ];
    alone.chain(without)
}

/// The learner's hypotheses whose bit in `enabled` is set, by the learner's own driver
/// ([`fix_learner`]): not the device, since what proves itself corrects at once, and nothing limits
/// or stores it.
pub fn hypotheses(case: &Case<'_>, enabled: u8) -> Option<FreeInertial> {
    let assumptions = *case.knows.assumptions;
    let gates = Gates {
        enabled,
        ..Gates::default()
    };
    let (session, until) = (case.session, case.until);
    let learnt = fix_learner::learn(session, &assumptions, gates, None, until)?;
    if learnt.running == ZERO_CORRECTION {
        return none(case, case.increments(), case.tuned.none_factor);
    }
    Some(learnt.free_inertial(session, &assumptions, until))
}

/// The device before the drive, with what it has stored in earlier ones. Where the schemes know the
/// group's cause, its configuration includes it.
pub(super) fn before_drive(case: &Case<'_>) -> Device {
    let new = case.knows.device;
    let known = case.memory.and_then(Memory::device);
    let mut device = known.unwrap_or(new).clone();
    device.configure(&enlarged_configuration(
        new.configuration(),
        &case.tuned.cause,
    ));
    device
}

/// The firmware's own application through the drive, from power-on to its end. On its samples the
/// navigation computer of `uncorrected` navigates.
fn device(case: &Case<'_>) -> Option<FreeInertial> {
    let (session, factor) = (case.session, case.tuned.none_factor);
    let drive = before_drive(case).drive_session(session, case.until);
    if !drive.changed {
        return none(case, case.increments(), factor);
    }
    let corrected = session.navigable(drive.corrected.each());
    none(case, &corrected, factor)
}

/// One of [`REMEMBERING`] after the earlier drives. Before the first one it is the filter without
/// memory.
fn remembering<const INDEX: usize>(case: &Case<'_>) -> Option<FreeInertial> {
    let models = case.memory.map_or(&[][..], |memory| memory.of(INDEX));
    if models.is_empty() {
        let (_, filter, _) = REMEMBERING[INDEX];
        return filtered(case, filter, case.knows.assumptions.datasheet_walk());
    }
    recalled(INDEX, case, case.tuned.turn_on[INDEX], models)
}

/// The memory of one of [`REMEMBERING`], used as the device uses its own: subtracted from the
/// samples from power-on, before a navigator without a model of the IMU. So it learns nothing in
/// this drive, neither from fixes nor from the standstill.
fn frozen<const INDEX: usize>(case: &Case<'_>) -> Option<FreeInertial> {
    let corrected = case
        .memory
        .and_then(|memory| corrected_by_memory(INDEX, case, memory.of(INDEX)));
    let increments = corrected.as_deref().unwrap_or(case.increments());
    none(case, increments, case.tuned.none_factor)
}

/// The aided filter without a model of the IMU. White noise times `factor` covers the
/// errors that it does not model.
pub fn none(case: &Case<'_>, increments: &[Increment], factor: f64) -> Option<FreeInertial> {
    if std::ptr::eq(increments, case.increments()) {
        return case.bench.free(case, bench::NONE, factor);
    }
    nones(case, increments, &[factor])?.pop()
}

/// [`uncorrected`] with each of these factors.
pub(super) fn nones(
    case: &Case<'_>,
    increments: &[Increment],
    factors: &[f64],
) -> Option<Vec<FreeInertial>> {
    let (session, until) = (case.session, case.until);
    let aligned = aligned(session, &increments)?;
    let of = |factor: &f64| {
        let mut assumptions = *case.knows.assumptions;
        assumptions.noise = Noise {
            gyro: assumptions.noise.gyro * factor,
            accel: assumptions.noise.accel * factor,
        };
        Task {
            filter: aligned.filter(ErrorModel::default(), &assumptions),
            first: aligned.first,
            until,
            session,
            increments,
        }
    };
    let scored = bench::scored(factors.iter().map(of).collect());
    let filters: Vec<&Aided> = scored.iter().map(|(filter, _)| filter).collect();
    Some(bench::flown(&filters, session, increments, until))
}

/// One of [`FILTERS`] with the datasheet's walk.
fn by_datasheet<const FILTER: usize>(case: &Case<'_>) -> Option<FreeInertial> {
    filtered(case, FILTER, case.knows.assumptions.datasheet_walk())
}

/// One of [`FILTERS`] with the walk that was best on other units.
fn tuned<const FILTER: usize>(case: &Case<'_>) -> Option<FreeInertial> {
    filtered(case, FILTER, case.tuned.walks[FILTER])
}

/// One of [`FILTERS`] with this walk. Of several models it uses the one under which the fixes had
/// the greatest likelihood.
pub(super) fn filtered(case: &Case<'_>, filter: usize, walk: f64) -> Option<FreeInertial> {
    case.bench.free(case, filter, walk)
}

pub(super) fn aided_free_inertial(
    case: &Case<'_>,
    increments: &[Increment],
    assumptions: &Assumptions,
    model: ErrorModel,
) -> Option<FreeInertial> {
    let session = case.session;
    let aligned = aligned(session, &increments)?;
    let filter = aligned.aided(model, assumptions, session, &increments, case.until);
    Some(from_filter(&filter, session, increments, case.until))
}

/// The increments corrected by networks that were trained over the aided part. Without fixes, and
/// where no network is promoted, they are the session's own.
pub fn rnn_increments<'a>(case: &Case<'a>) -> Option<Cow<'a, [Increment]>> {
    if !case.fixes {
        return Some(Cow::Borrowed(case.increments()));
    }
    let assumptions = *case.knows.assumptions;
    let session = case.session;
    let learnt = fit(
        session,
        &case.increments(),
        assumptions,
        &NetworkSpec::default(),
        case.until,
        true,
    )?;
    let silent = Use {
        gyro: false,
        accel: false,
    };
    if learnt.promoted == silent {
        return Some(Cow::Borrowed(case.increments()));
    }
    let compensator = compensator(session, &learnt.nets, &learnt.assumptions);
    let increments = corrected_increments(session, &compensator, 0..session.epochs());
    Some(Cow::Owned(increments))
}

/// The model of a filter that knows the simulator: it has parameters for exactly the errors that
/// are simulated, with their exact statistics, and knows the temperature and the field in each
/// second. Errors by the environment, which have no parameters, are subtracted before.
#[must_use]
pub fn oracle(imu: &ImuSpec, session: &Session) -> ErrorModel {
    let mut out = ErrorModel {
        known: known(session),
        delay_s: imu.accel.delay_s,
        ..ErrorModel::default()
    };
    out.extend(|axis, triad| imu.parameters(triad, axis));
    out
}

/// The increments minus the known errors for which the oracle has no parameters.
pub(super) fn without_beyond<'a>(case: &Case<'a>) -> Cow<'a, [Increment]> {
    let (session, all) = (case.session, case.increments());
    if case.knows.beyond.is_empty() {
        return Cow::Borrowed(all);
    }
    let step = session.step_s();
    let seconds = all.chunks(session.steps_per_epoch());
    let less = |(second, error): (&'a [Increment], &Increment)| {
        let less = *error;
        second.iter().map(move |w| Increment {
            dtheta: w.dtheta - less.dtheta * step,
            dv: w.dv - less.dv * step,
        })
    };
    seconds.zip(case.knows.beyond).flat_map(less).collect()
}

/// Temperature and field as simulated, and the vibration that the samples show, second by second.
fn known(session: &Session) -> Arc<[AuxiliaryData]> {
    let surroundings = session.surroundings.as_deref().unwrap_or_default();
    let of = |(around, vibration): (&Surroundings, _)| AuxiliaryData {
        around: *around,
        vibration,
        ..AuxiliaryData::default()
    };
    surroundings
        .iter()
        .zip(session.vibration())
        .map(of)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ablations_are_the_documented_parts_of_the_bank() {
        let want = [
            ("only-biases", 0b00_0010),
            ("only-output", 0b00_0100),
            ("only-stepped", 0b00_1000),
            ("only-driven", 0b01_0000),
            ("only-curved", 0b10_0000),
            ("only-map", 0b1000_0000),
            ("learner", 0b1011_1111),
            ("no-networks", 0b1000_1011),
        ];
        let got: Vec<(String, u8)> = ablations().collect();
        for (name, bits) in want {
            assert!(got.contains(&(name.to_owned(), bits)), "{name}: {got:?}");
        }
        let (name, bits) = got.last().unwrap();
        assert!(name.starts_with("no-") && bits.count_ones() as usize == HYPOTHESES - 2);
    }
}
