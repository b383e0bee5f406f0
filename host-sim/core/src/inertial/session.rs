//! A session is one turn-on of one IMU: its samples, the fixes of the same time, and the truth as
//! far as it is known.

use crate::inertial::earth::Geodetic;
use crate::inertial::ekf::InitialSigma;
use crate::inertial::gnss::{Fix, NOT_MEASURED};
use crate::inertial::motion::Increments;
use crate::inertial::sins::{Increment, NavState, Samples, gather};
use crate::list::List;
use firmware::sample::{Counts, Lsb};
use nalgebra::{UnitQuaternion, Vector3};
use std::ops::Range;

/// Temperature of the sensor block at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Temperature {
    /// Difference from the calibration temperature, K.
    pub offset: f64,
    /// Rate of change, K/s.
    pub rate: f64,
    /// Temperature of the heated face above that of the free face, K.
    pub gradient: f64,
}

/// Temperature, magnetic field and motion at the sensors during one second.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Surroundings {
    /// Temperature of the block.
    pub temperature: Temperature,
    /// Temperature of the sensor of each axis, difference from the calibration temperature, K.
    pub axes: Vector3<f64>,
    /// Magnetic field in body axes, gauss.
    pub field: Vector3<f64>,
    /// Mean square of the specific force about its mean in the second before, sum over the axes,
    /// with the part above the sample rate, (m/s2)^2. Zero where no error follows it.
    pub vibration: f64,
    /// Mean magnitude of the rate in the second before, rad/s. Zero where no error follows it.
    pub turning: f64,
}

/// Thermometer readings of one second, degrees C.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Readings {
    /// The IMU's thermometers of the axes x, y, z; all the same where it has only one.
    pub axes: Vector3<f64>,
    /// The processor beside the IMU.
    pub processor: f64,
}

/// A known state to start from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// The state of the IMU.
    pub nav: NavState,
    /// Standard deviations of its errors.
    pub sigma: InitialSigma,
}

/// Epochs whose samples are missing, or during which the attitude is not known again yet. Their
/// counts are placeholders.
#[derive(Debug, Clone, PartialEq)]
pub struct Outage {
    /// The epochs.
    pub epochs: Range<usize>,
    /// State at the end of the last one.
    pub resume: Start,
}

/// Seconds between epochs. Fixes, reference states and the blocks of the networks share the epochs.
pub const EPOCH_S: f64 = 1.0;

/// A recorded or simulated session. Epoch `k` is `k` seconds after power-on. There is one more
/// reference state than there are whole seconds.
#[derive(Debug, Clone)]
pub struct Session {
    /// Sample period, s.
    pub dt: f64,
    /// Value of a count.
    pub lsb: Lsb,
    /// Samples in counts, body axes forward-right-down.
    pub counts: List<Counts>,
    /// Epochs at the start during which the vehicle stands still and is aligned.
    pub standstill: usize,
    /// Reference state at each epoch: the truth of a simulation, or position and velocity of a
    /// surveyed site.
    pub reference: Vec<NavState>,
    /// Epochs whose reference state only bridges a gap: errors are not judged there.
    pub unjudged: Vec<Range<usize>>,
    /// From the IMU to the point of the vehicle that the reference describes, body axes, m.
    pub reference_arm: Vector3<f64>,
    /// State at epoch 0, if more is known of it than the reference says. Not used with a
    /// standstill.
    pub start: Option<Start>,
    /// Outages of samples, in the order of time.
    pub outages: Vec<Outage>,
    /// The fix of each epoch, if there is one.
    pub fixes: Vec<Option<Fix>>,
    /// From the IMU to the antenna in body axes, m.
    pub lever_arm: Vector3<f64>,
    /// Configured standard deviations of the lever arm along each axis, m, and of the ages of the
    /// fixes, s. With 0 the device's learner takes both for exact; the desktop's filters always do.
    pub antenna_sigmas: [f64; 2],
    /// Speed of the wheels at each epoch, m/s, where it is reported.
    pub wheels: Option<Vec<Option<f64>>>,
    /// Systematic sensor error averaged over each second (rad/s, m/s2), if known.
    pub systematic: Option<Vec<Increment>>,
    /// Temperature of the block and magnetic field in each second, if known, as in a simulation.
    pub surroundings: Option<Vec<Surroundings>>,
    /// Thermometer readings of each second, if they are known.
    pub readings: Option<Vec<Readings>>,
    /// Samples that a navigator takes in one step: at least 1, and a divisor of the samples per
    /// epoch. Coning and sculling are computed sample by sample.
    pub gather: usize,
}

impl Session {
    /// A session without standstill, lever arm and further data.
    #[must_use]
    pub fn new(
        dt: f64,
        (counts, lsb): (impl Into<List<Counts>>, Lsb),
        reference: Vec<NavState>,
        fixes: Vec<Option<Fix>>,
    ) -> Self {
        Self {
            dt,
            lsb,
            counts: counts.into(),
            standstill: 0,
            reference,
            unjudged: Vec::new(),
            reference_arm: Vector3::zeros(),
            start: None,
            outages: Vec::new(),
            fixes,
            lever_arm: Vector3::zeros(),
            antenna_sigmas: [0.0; 2],
            wheels: None,
            systematic: None,
            surroundings: None,
            readings: None,
            gather: 1,
        }
    }

    /// The fix with a position that is nearest in time to `epoch`, the earlier of two; without
    /// any, the reference's state with wide standard deviations.
    #[must_use]
    pub fn nearest_fix(&self, epoch: usize) -> Fix {
        let placed = |k: usize| Some((*self.fixes.get(k)?)?).filter(|fix| fix.has(0..2));
        let steps = 0..=self.fixes.len().max(epoch);
        let near = |by: usize| placed(epoch.wrapping_sub(by)).or_else(|| placed(epoch + by));
        steps.into_iter().find_map(near).unwrap_or_else(|| {
            let last = self.reference.len().saturating_sub(1);
            let at = &self.reference[epoch.min(last)];
            Fix::new(at.position, at.velocity, [NOT_MEASURED; 6])
        })
    }

    /// The reference's state of the IMU at an epoch.
    #[must_use]
    pub fn referenced(&self, epoch: usize) -> NavState {
        let state = self.reference[epoch];
        let position = state
            .position
            .displaced(&-(state.q_bn * self.reference_arm));
        NavState { position, ..state }
    }

    /// Whether the reference state of an epoch may judge a navigator.
    #[must_use]
    pub fn judges(&self, epoch: usize) -> bool {
        !self.unjudged.iter().any(|range| range.contains(&epoch))
    }

    /// The outage that epoch `k` lies in.
    #[must_use]
    pub fn outage(&self, k: usize) -> Option<&Outage> {
        self.outages
            .iter()
            .find(|outage| outage.epochs.contains(&k))
    }

    /// Epochs `range` as a session of its own, shortened to the session's end.
    #[must_use]
    pub fn cut(&self, range: &Range<usize>) -> Self {
        let [start, end] = [range.start, range.end].map(|k| k.min(self.epochs()));
        let n = self.samples_per_epoch();
        let within = |r: &Range<usize>| {
            let [from, to] = [r.start, r.end].map(|k| k.clamp(start, end) - start);
            from..to
        };
        let outage = |outage: &Outage| Outage {
            epochs: within(&outage.epochs),
            ..outage.clone()
        };
        let per_epoch = |list: &Option<Vec<Increment>>| Some(list.as_ref()?[start..end].to_vec());
        let surroundings = self.surroundings.as_ref();
        let readings = self.readings.as_ref();
        Self {
            counts: self.counts.part(start * n..end * n),
            standstill: self.standstill.clamp(start, end) - start,
            reference: self.reference[start..=end].to_vec(),
            unjudged: self.unjudged.iter().map(within).collect(),
            start: self.start.filter(|_| start == 0),
            outages: self
                .outages
                .iter()
                .map(outage)
                .filter(|o| !o.epochs.is_empty())
                .collect(),
            fixes: self.fixes[start..=end].to_vec(),
            wheels: self.wheels.as_ref().map(|all| all[start..=end].to_vec()),
            systematic: per_epoch(&self.systematic),
            surroundings: surroundings.map(|all| all[start..end].to_vec()),
            readings: readings.map(|all| all[start..end].to_vec()),
            ..*self
        }
    }

    /// Position of the IMU where the antenna is at `antenna`.
    #[must_use]
    pub fn imu_position(&self, antenna: &Geodetic, q_bn: &UnitQuaternion<f64>) -> Geodetic {
        antenna.displaced(&-(q_bn * self.lever_arm))
    }

    /// Samples per epoch.
    #[must_use]
    pub fn samples_per_epoch(&self) -> usize {
        (EPOCH_S / self.dt).round() as usize
    }

    /// Whole seconds.
    #[must_use]
    pub fn epochs(&self) -> usize {
        self.counts.len() / self.samples_per_epoch()
    }

    /// The samples as increments in SI, [`Self::gather`] samples in one increment.
    #[must_use]
    pub fn increments(&self) -> Vec<Increment> {
        self.navigable(self.counts.each())
    }

    /// The increments, made epoch by epoch where that gives the same bits.
    #[must_use]
    pub fn motion(&self) -> Increments<'_> {
        if self.gather != 1 {
            return Increments::All(self.increments());
        }
        let n = self.samples_per_epoch();
        Increments::Made(Box::new(move |k| {
            let epoch = self.counts.block(k * n..(k + 1) * n);
            epoch.iter().map(|c| to_si(c, &self.lsb)).collect()
        }))
    }

    /// For each second the mean square of the specific force about its mean over the second before,
    /// of each axis, (m/s2)^2, from the samples. Zero in the first second.
    #[must_use]
    pub fn vibration(&self) -> Vec<Vector3<f64>> {
        let of = |second: &[Counts]| {
            let force = |c: &Counts| to_si(c, &self.lsb).dv / self.dt;
            let count = second.len() as f64;
            let mean = second.iter().map(force).sum::<Vector3<f64>>() / count;
            let squares = second.iter().map(|c| (force(c) - mean).map(|x| x * x));
            squares.sum::<Vector3<f64>>() / count
        };
        let seconds = self.counts.chunks(self.samples_per_epoch());
        let before = seconds.clone().map(of);
        let shifted = std::iter::once(Vector3::zeros()).chain(before);
        shifted.take(seconds.len()).collect()
    }

    /// The increments of other `counts` than the session's own.
    pub fn navigable(&self, counts: impl Iterator<Item = Counts>) -> Vec<Increment> {
        let increments = counts.map(|c| to_si(&c, &self.lsb));
        if self.gather == 1 {
            return increments.collect();
        }
        gather(increments, self.gather, Samples::default())
    }

    /// Duration of one of the [`Self::increments`], s.
    #[must_use]
    pub fn step_s(&self) -> f64 {
        self.dt * self.gather as f64
    }

    /// Number of [`Self::increments`] per epoch.
    #[must_use]
    pub fn steps_per_epoch(&self) -> usize {
        self.samples_per_epoch() / self.gather
    }

    /// The coning and sculling algorithm that a navigator needs for [`Self::increments`].
    #[must_use]
    pub fn samples(&self) -> Samples {
        if self.gather == 1 {
            Samples::default()
        } else {
            Samples::One
        }
    }
}

/// A sample in SI.
#[must_use]
pub fn to_si(c: &Counts, lsb: &Lsb) -> Increment {
    let v =
        |x: [i32; 3], k: f64| Vector3::new(f64::from(x[0]), f64::from(x[1]), f64::from(x[2])) * k;
    Increment {
        dtheta: v(c.dtheta, lsb.rad),
        dv: v(c.dv, lsb.mps),
    }
}
