//! A land vehicle on a road: speed, heading and grade by segments, and the vibration of the road.

use super::vibration::{IDLE, ROAD_SPEED, Shake, Shaker};
use super::{DriveConfig, Instant, Motion, Profile};
use crate::inertial::rotation::{doubled, from_half_angles};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

/// Nose-up pitch per forward acceleration, rad per m/s2 (assumed: 0.25 deg per m/s2).
pub(super) const SQUAT: f64 = 4.4e-3;
/// Roll to the outside per lateral acceleration, rad per m/s2 (assumed: 0.35 deg per m/s2).
pub(super) const BODY_ROLL: f64 = 6.1e-3;
/// The motion of a land vehicle.
pub(super) struct Road {
    profile: Profile,
    shaker: Shaker,
    leg: usize,
}

impl Road {
    pub(super) fn new(config: &DriveConfig<'_>, rng: &mut ChaCha8Rng) -> Self {
        Self {
            profile: Profile::new(config.segments, config.heading, config.dt),
            shaker: Shaker::new(rng, config.vibration, config.dt),
            leg: 0,
        }
    }
}

impl Motion for Road {
    fn duration(&self) -> f64 {
        self.profile.duration()
    }

    fn begin(&mut self, t: f64, second: bool) {
        self.profile.advance(&mut self.leg, t);
        self.shaker.begin(t, second);
    }

    fn at(&self, t: f64, node: usize) -> Instant {
        instant(&self.profile, self.leg, t, &self.shaker.at(node))
    }
}

/// Velocity, acceleration, attitude and rate at time `t` on leg `leg`.
fn instant(profile: &Profile, leg: usize, t: f64, shake: &Shake) -> Instant {
    let c = profile.at(leg, t);
    let (s, psi, gamma) = (c.speed, c.heading, c.grade);
    // vibration grows with speed
    let road = s.value / (s.value + ROAD_SPEED);
    let road_d1 = ROAD_SPEED / ((s.value + ROAD_SPEED) * (s.value + ROAD_SPEED)) * s.d1;
    let amp = IDLE + (1.0 - IDLE) * road;
    let amp_d1 = (1.0 - IDLE) * road_d1;
    let angle = [0, 1, 2].map(|i| amp * shake.angle[i]);
    let rate = [0, 1, 2].map(|i| amp * shake.rate[i] + amp_d1 * shake.angle[i]);

    let (sp, cp) = psi.value.sin_cos();
    let (sg, cg) = gamma.value.sin_cos();
    let along = Vector3::new(cg * cp, cg * sp, -sg);
    let along_d1 = Vector3::new(
        -sg * cp * gamma.d1 - cg * sp * psi.d1,
        -sg * sp * gamma.d1 + cg * cp * psi.d1,
        -cg * gamma.d1,
    );
    let heave = Vector3::new(0.0, 0.0, amp * shake.heave[0]);
    let heave_d1 = Vector3::new(0.0, 0.0, amp * shake.heave[1] + amp_d1 * shake.heave[0]);
    let v = along * s.value + heave;
    let a = along * s.d1 + along_d1 * s.value + heave_d1;

    let roll = -BODY_ROLL * s.value * psi.d1 + angle[0];
    let roll_d1 = -BODY_ROLL * (s.d1 * psi.d1 + s.value * psi.d2) + rate[0];
    let pitch = gamma.value + SQUAT * s.d1 + angle[1];
    let pitch_d1 = gamma.d1 + SQUAT * s.d2 + rate[1];
    let heading = psi.value + angle[2];
    let heading_d1 = psi.d1 + rate[2];
    let [half_roll, half_pitch, half_heading] = [roll, pitch, heading].map(|a| (0.5 * a).sin_cos());
    let [(sr, cr), (st, ct)] = [half_roll, half_pitch].map(doubled);
    let omega_nb = Vector3::new(
        roll_d1 - heading_d1 * st,
        pitch_d1 * cr + heading_d1 * sr * ct,
        -pitch_d1 * sr + heading_d1 * cr * ct,
    );
    Instant {
        q_bn: from_half_angles(half_roll, half_pitch, half_heading),
        v,
        a,
        omega_nb,
    }
}
