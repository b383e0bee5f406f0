//! The error bound against a search for the worst case: corrections that change arbitrarily within
//! their limits, in the alignment and after it, on several roads. Alignment and navigation are
//! those of the desktop.

use firmware::compensator::Limit;
use firmware::error_bound::{ErrorBound, TIMES_S};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::free_inertial::aligned_free_inertial;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::{DEG_PER_H, UG};
use host_core::simulator::imu::ErrorModelName;
use host_core::simulator::session::{SessionConfig, simulate};
use host_core::simulator::truth::Segment;
use host_unit::scenario::Scenario;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const STANDSTILL_S: f64 = 300.0;
const DRIVE_S: f64 = 1330.0;
/// Number of pieces with constant correction: one for the alignment, the others after it.
const PIECES: usize = 9;
/// Number of corrections that are tried for a road and a time.
const TRIALS: usize = 150;

/// Corrections in units of their limits: six axes in each piece.
type Push = [[f64; 6]; PIECES];

fn segment(duration_s: f64, speed_mps: f64, turn_deg: f64) -> Segment {
    Segment {
        duration_s,
        speed_mps: Some(speed_mps),
        turn_deg,
        grade_percent: None,
    }
}

/// Straight on; one turn back; repeated turns back; circles; standing.
fn roads() -> Vec<Vec<Segment>> {
    let start = segment(20.0, 30.0, 0.0);
    let back = [segment(30.0, 30.0, 180.0)];
    let legs = |hold: f64, n: usize| {
        let leg = [segment(hold, 30.0, 0.0), back[0]];
        let legs = std::iter::repeat_n(leg, n).flatten();
        std::iter::once(start).chain(legs).collect()
    };
    vec![
        vec![start, segment(DRIVE_S - 20.0, 30.0, 0.0)],
        legs(625.0, 2),
        legs(180.0, 7),
        vec![start, segment(DRIVE_S - 20.0, 30.0, 7200.0)],
        vec![Segment::hold(DRIVE_S)],
    ]
}

fn session(road: &[Segment], latitude: f64, heading: f64) -> Session {
    let scenario = Scenario::default();
    let mut imu = scenario.imu_spec();
    imu.rate_hz = 20;
    let spec = imu.error_model(ErrorModelName::Noise);
    let config = SessionConfig {
        imu: &spec,
        gnss: &scenario.gnss,
        start: Geodetic {
            lat: latitude,
            ..scenario.start()
        },
        heading,
        standstill_s: STANDSTILL_S,
        drive_s: DRIVE_S,
        segments: Some(road),
        vibration: 0.0,
        unit: 1,
        turn_on: 1,
        drive: 1,
    };
    simulate(&config).0
}

/// Samples with these corrections, whose pieces after the alignment have equal lengths.
fn pushed(
    session: &Session,
    increments: &[Increment],
    push: &Push,
    limit: [f64; 2],
) -> Vec<Increment> {
    let n = session.steps_per_epoch();
    let drive = increments.len() / n - session.standstill;
    let each = drive.div_ceil(PIECES - 1).max(1);
    let of = |k: usize| match (k / n).checked_sub(session.standstill) {
        None => 0,
        Some(s) => 1 + (s / each).min(PIECES - 2),
    };
    let [g, a] = limit.map(|l| l * session.step_s());
    let one = |(k, w): (usize, &Increment)| {
        let [x, y, z, u, v, w_] = push[of(k)];
        Increment {
            dtheta: w.dtheta + Vector3::new(x, y, z) * g,
            dv: w.dv + Vector3::new(u, v, w_) * a,
        }
    };
    increments.iter().enumerate().map(one).collect()
}

/// A road with its samples, and the end of the navigation without corrections.
struct Case {
    session: Session,
    increments: Vec<Increment>,
    plain: Vec<Vector3<f64>>,
    bound: ErrorBound,
}

impl Case {
    fn new(road: &[Segment], latitude: f64, heading: f64, limit: Limit) -> Case {
        let session = session(road, latitude, heading);
        let increments = session.increments();
        let speed = session.reference.iter().map(|s| s.velocity.xy().norm());
        let bound = ErrorBound {
            limit,
            speed: speed.fold(0.0, f64::max) as f32,
            latitude,
            words: 1.0,
        };
        let plain = aligned_free_inertial(&session, &increments).expect("it stands");
        Case {
            session,
            increments,
            plain: plain.position,
            bound,
        }
    }

    /// The error at each time as a share of the bound. More than 1 exceeds it.
    fn shares(&self, push: &Push) -> [f64; 5] {
        let limit = [self.bound.limit.gyro, self.bound.limit.accel].map(f64::from);
        let pushed = pushed(&self.session, &self.increments, push, limit);
        let Some(got) = aligned_free_inertial(&self.session, &pushed) else {
            return [0.0; 5]; // no attitude: nothing is navigated
        };
        TIMES_S.map(|t| {
            let at = t as usize;
            let apart = (got.position[at] - self.plain[at]).xy();
            apart.norm() / self.bound.metres(f64::from(t))
        })
    }

    /// Searches for the largest share at the time with this index, from a correction that reverses
    /// after the alignment. Returns the shares of the worst correction found.
    fn worst(&self, time: usize, rng: &mut ChaCha8Rng) -> [f64; 5] {
        let mut best: Push = std::array::from_fn(|piece| {
            let sign = if piece == 0 { 1.0 } else { -1.0 };
            [sign; 6]
        });
        let mut shares = self.shares(&best);
        for trial in 0..TRIALS {
            let mut next = best;
            // whole axes at first, then pieces of them
            let axis = rng.random_range(0..6);
            let pieces = match trial % 3 {
                0 => 0..1,
                1 => 1..PIECES,
                _ => {
                    let from = rng.random_range(1..PIECES);
                    from..PIECES
                }
            };
            for piece in &mut next[pieces] {
                piece[axis] = -piece[axis];
            }
            let found = self.shares(&next);
            if found[time] > shares[time] {
                (best, shares) = (next, found);
            }
        }
        shares
    }
}

/// The limits of a medium laser gyro by default, and those of 10 deg/h and 1 mg, with which the
/// alignment is off by a radian.
fn limits() -> [Limit; 2] {
    let configuration = firmware::configuration::Configuration::default();
    let wide = Limit {
        gyro: (10.0 * DEG_PER_H) as f32,
        accel: (1000.0 * UG) as f32,
    };
    [configuration.correction.limit, wide]
}

#[test]
fn no_correction_alignment_or_manoeuvre_passes_the_bound() {
    let mut rng = ChaCha8Rng::seed_from_u64(16);
    for limit in limits() {
        let mut nearest = [0.0f64; 5];
        for (n, road) in roads().iter().enumerate() {
            let latitude = [0.8, 1.05][n % 2];
            let case = Case::new(road, latitude, 0.8 + n as f64, limit);
            for time in [0, 4] {
                let shares = case.worst(time, &mut rng);
                for (nearest, share) in nearest.iter_mut().zip(shares) {
                    *nearest = nearest.max(share);
                }
            }
        }
        println!("{limit:?}: share of the bound that was reached: {nearest:.2?}");
        assert!(nearest.iter().all(|share| *share <= 1.0), "{nearest:?}");
        // a bound that no error comes near is useless
        assert!(nearest[0] > 0.3 && nearest[4] > 0.3, "{nearest:?}");
    }
}
