//! State of the device: its mode, the navigation computer's alignment, and whether a learnt
//! correction is in force.

use super::at_rest::FirstRest;
use crate::app::config::Activation;
use crate::control::{Alignment, Mode};

/// Mode, alignment, and what is in force of what was learnt.
#[derive(Debug)]
pub(in crate::app) struct Session {
    pub mode: Mode,
    pub alignment: Option<Alignment>,
    /// In mode learn: whether a promoted hypothesis corrects the samples.
    pub promoted: bool,
    /// The compensator has the learner's networks instead of the configured ones.
    pub learner_nets: bool,
    /// The standstill in progress has been used as an alignment.
    pub stood: bool,
    /// The last fix: whether it shows a standstill, and the number of the sample before it.
    pub stands: Option<(bool, u64)>,
    /// With activation `FirstRest`: the first rest since power-on.
    pub first_rest: FirstRest,
    /// A rest teaches, by the answer in force.
    pub rests: bool,
    /// Latitude of the last fix, rad.
    pub latitude: Option<f64>,
}

impl Session {
    /// The state at power-on.
    pub fn new(mode: Mode) -> Session {
        Session {
            mode,
            alignment: None,
            promoted: false,
            learner_nets: false,
            stood: false,
            stands: None,
            first_rest: FirstRest::default(),
            rests: false,
            latitude: None,
        }
    }

    /// Another configuration has come. The navigation computer's alignment stays.
    pub fn restart(&mut self, mode: Mode) {
        *self = Session {
            alignment: self.alignment,
            ..Session::new(mode)
        };
    }

    /// The learnt correction is no longer in force.
    pub fn demote(&mut self) {
        (self.promoted, self.learner_nets) = (false, false);
        self.first_rest.drop_added();
    }

    /// Corrections change no faster than the slew limit: from the beginning of an alignment on, and
    /// in mode learn.
    pub fn is_slow(&self) -> bool {
        self.alignment.is_some() || self.mode == Mode::Learn
    }

    /// Whether the stored networks act on all samples of mode learn.
    pub fn acts_from_power_on(&self, activation: Activation) -> bool {
        let acts = matches!(activation, Activation::NextPowerOn | Activation::FirstRest);
        self.mode == Mode::Learn && acts
    }
}
