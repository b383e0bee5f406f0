//! One turn-on of one IMU: the words it gave, the fixes beside them, and what is known of the truth.

use crate::inertial::gnss::Fix;
use crate::inertial::sins::{Increment, NavState, Samples, gather};
use firmware::sample::{Counts, Lsb};
use nalgebra::Vector3;

/// Temperature of the block at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Temperature {
    /// Off the calibration temperature, K.
    pub offset: f64,
    /// Heating rate, K/s.
    pub rate: f64,
    /// Heated face over free face, K.
    pub gradient: f64,
}

/// What surrounds the sensors in the present second.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Surroundings {
    /// Temperature of the block.
    pub temperature: Temperature,
    /// Magnetic field in body axes, gauss.
    pub field: Vector3<f64>,
}

/// Seconds between epochs: fixes, reference states and network blocks share them.
pub const EPOCH_S: f64 = 1.0;

/// A recorded or simulated session. Epoch `k` lies `k` seconds after power-on; there is one more epoch state than whole seconds.
#[derive(Debug, Clone)]
pub struct Session {
    /// Word period, s.
    pub dt: f64,
    /// Value of a count.
    pub lsb: Lsb,
    /// Words, body axes forward-right-down.
    pub counts: Vec<Counts>,
    /// Epochs at the start during which the vehicle stands still and is aligned.
    pub standstill: usize,
    /// Reference state at each epoch (truth of a simulation; position and velocity of a surveyed site).
    pub reference: Vec<NavState>,
    /// Fix at each epoch.
    pub fixes: Vec<Fix>,
    /// Noise of the fixes.
    pub sigmas: [f64; 6],
    /// Systematic sensor error averaged over each second (rad/s, m/s2), if it is known.
    pub systematic: Option<Vec<Increment>>,
    /// Temperature of the block and magnetic field over each second, if they are known (of a simulation).
    pub surroundings: Option<Vec<Surroundings>>,
    /// Words that navigators take in one step, >= 1, a divisor of the words per epoch. Coning and sculling are computed word by word.
    pub gather: usize,
}

impl Session {
    /// Words per epoch.
    #[must_use]
    pub fn words_per_epoch(&self) -> usize {
        (EPOCH_S / self.dt).round() as usize
    }

    /// Whole seconds.
    #[must_use]
    pub fn epochs(&self) -> usize {
        self.counts.len() / self.words_per_epoch()
    }

    /// Words in SI, [`Self::gather`] of them in one.
    #[must_use]
    pub fn increments(&self) -> Vec<Increment> {
        self.navigable(self.counts.iter().copied())
    }

    /// The same for `counts` in the place of the session's own.
    pub(crate) fn navigable(&self, counts: impl Iterator<Item = Counts>) -> Vec<Increment> {
        let words = counts.map(|c| to_si(&c, &self.lsb));
        if self.gather == 1 {
            return words.collect();
        }
        gather(words, self.gather, Samples::default())
    }

    /// Duration of a word of [`Self::increments`], s.
    #[must_use]
    pub fn step_s(&self) -> f64 {
        self.dt * self.gather as f64
    }

    /// Words of [`Self::increments`] per epoch.
    #[must_use]
    pub fn steps_per_epoch(&self) -> usize {
        self.words_per_epoch() / self.gather
    }

    /// What a navigator has yet to compensate in the words of [`Self::increments`].
    #[must_use]
    pub fn samples(&self) -> Samples {
        if self.gather == 1 {
            Samples::default()
        } else {
            Samples::One
        }
    }
}

/// A word in SI.
#[must_use]
pub fn to_si(c: &Counts, lsb: &Lsb) -> Increment {
    let v =
        |x: [i32; 3], k: f64| Vector3::new(f64::from(x[0]), f64::from(x[1]), f64::from(x[2])) * k;
    Increment {
        dtheta: v(c.dtheta, lsb.rad),
        dv: v(c.dv, lsb.mps),
    }
}
