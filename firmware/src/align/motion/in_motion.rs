//! The alignment in motion by what the receiver measures: velocities, or positions alone.

use super::places::Places;
use super::take::Found;
use super::{Config, Matching, Progress};
use crate::fix::{Fix, Heading};
use crate::sample::Counts;
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// Fixes in a row of the other kind after which the receiver is one of that kind.
const CHANGES: u8 = 5;
/// Fixes after which precise positions are used in place of velocities.
const PATIENCE: u8 = 30;
/// Errors in proportion to the motion repeat in a hand that swings. As white noise they count for
/// so much more (by `host-sim start --class hand-held --position-sigma-m 0.03`).
const REPEATS: f32 = 2.0;

/// An alignment in motion.
#[derive(Debug, Clone)]
pub struct InMotion {
    config: Config,
    /// The sensors' errors that are known already, rad/s and m/s2.
    known: [f32; OUTPUTS],
    by: By,
    /// Fixes in a row of the other kind.
    others: u8,
    /// Fixes that were matched by their velocities.
    by_velocities: u8,
}

/// What the receiver measures.
#[derive(Debug, Clone)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap, and either is needed"
)]
enum By {
    Velocities(Matching),
    Positions(Places),
}

impl InMotion {
    /// Waits for the first fix. `known`: errors of the sensors that have been learnt before, rad/s
    /// and m/s2.
    #[must_use]
    pub fn new(config: Config, known: [f32; OUTPUTS]) -> Self {
        Self {
            config,
            known,
            by: By::Velocities(Matching::new(config, known)),
            others: 0,
            by_velocities: 0,
        }
    }

    /// Takes one uncorrected sample.
    #[inline]
    pub fn sample(&mut self, counts: &Counts) {
        match &mut self.by {
            By::Velocities(matching) => matching.sample(counts),
            By::Positions(places) => places.sample(counts),
        }
    }

    /// The samples are interrupted: restarts. The count of refused alignments stays.
    pub fn gap(&mut self) {
        match &mut self.by {
            By::Velocities(matching) => matching.gap(),
            By::Positions(places) => places.gap(),
        }
    }

    /// A heading of the vehicle that somebody knows, valid now. Without effect where the mounting
    /// is unknown.
    pub fn heading(&mut self, heading: Heading) {
        if !self.knows_forward() {
            return;
        }
        match &mut self.by {
            By::Velocities(matching) => matching.heading(heading),
            By::Positions(places) => places.heading(heading),
        }
    }

    /// Whether the vehicle's forward axis is known.
    #[must_use]
    pub fn knows_forward(&self) -> bool {
        self.config.forward != [0.0; 3]
    }

    /// Whether the alignment has begun: a given heading then stays in use.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        match &self.by {
            By::Velocities(matching) => matching.has_begun(),
            By::Positions(places) => places.has_begun(),
        }
    }

    /// Progress of the alignment.
    #[must_use]
    pub fn progress(&self) -> Progress {
        match &self.by {
            By::Velocities(matching) => matching.progress(),
            By::Positions(places) => places.progress(),
        }
    }

    /// Takes a fix that was valid `age` before the last sample: seconds and their standard
    /// deviation. `rest`: the vehicle stands, and its velocity has this standard deviation, m/s. A
    /// fix with neither a position nor a horizontal velocity is not used.
    ///
    /// Gives the attitude when it is known well enough; its matrices are in `scratch` then.
    pub fn fix(
        &mut self,
        fix: &Fix,
        rest: Option<f32>,
        age: [f32; 2],
        scratch: &mut Transition<9>,
    ) -> Option<Found> {
        self.choose(fix);
        let mut fix = *fix;
        fix.heading = fix.heading.filter(|_| self.knows_forward());
        let fix = &fix;
        match &mut self.by {
            By::Velocities(matching) => {
                self.by_velocities = self.by_velocities.saturating_add(1);
                let still = rest.is_some();
                let fix = rest.map_or(*fix, |sigma| fix.at_rest(sigma));
                matching.fix(&fix, age, still, scratch)
            }
            By::Positions(places) => places.fix(fix, age, rest, scratch),
        }
    }

    /// Another kind of receiver: at the first fix, or when such fixes go on.
    fn choose(&mut self, fix: &Fix) {
        let positions = match (fix.has(3..5), fix.has(0..2)) {
            (true, true) => self.positions_are_better(fix),
            (true, false) => false,
            (false, true) => true,
            (false, false) => return,
        };
        if positions == matches!(self.by, By::Positions(_)) {
            self.others = 0;
            return;
        }
        self.others += 1;
        if self.has_begun() && self.others < CHANGES {
            return;
        }
        self.others = 0;
        self.change(positions);
    }

    /// Positions show more than velocities that are noisier than theirs over a second, but no
    /// course: they are for what velocities have not aligned in time, a sensor in the hand.
    fn positions_are_better(&self, fix: &Fix) -> bool {
        let [n, e, _, vn, ve, _] = fix.sigmas;
        self.by_velocities >= PATIENCE && n.max(e) < vn.max(ve)
    }

    #[inline(never)]
    fn change(&mut self, positions: bool) {
        let refused = self.progress().refused;
        self.by = if positions {
            let mut config = self.config;
            if self.by_velocities >= PATIENCE {
                config.scale = config.scale.map(|ratio| REPEATS * ratio);
            }
            By::Positions(Places::new(config, self.known, refused))
        } else {
            let mut matching = Matching::new(self.config, self.known);
            matching.refused = refused;
            By::Velocities(matching)
        };
    }
}
