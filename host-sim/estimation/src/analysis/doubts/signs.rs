//! The signs and places of the gyros: as they turn the specific force, it must be the changes of
//! velocity and gravity, whatever the mounting is. Over a window the rotations by the gyros bring
//! the specific force into the axes of its beginning, and the one rotation is fitted that brings it
//! to north, east and down (Wahba's problem). Signs or places that leave much less than those given
//! are the right ones.

use super::AXES;
use super::ahead::velocities;
use super::evidence::Evidence;
use super::measure::{Kind, Measure};
use host_core::inertial::units::G0;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Length of a window, s, and the most windows, evenly over the recording.
const WINDOW_S: f64 = 60.0;
const WINDOWS: usize = 40;
/// Times between two velocities that are compared, s, and the least number of them in a window.
const APART_S: [f64; 2] = [0.9, 2.5];
const STEPS: usize = 10;
/// Step of the rotation, s.
const STEP_S: f64 = 0.1;
/// Other signs must leave so much less: a ratio of sums of squares.
const BETTER: f64 = 1.5;

/// Another way to connect the gyros.
pub(super) struct Gyros {
    /// Turns the given rates into the right ones.
    pub(super) turn: Matrix3<f64>,
    /// The axes that it changes, in words.
    pub(super) axes: String,
    /// They are in each other's place, and not of the wrong sign.
    pub(super) swapped: bool,
}

/// Wrong signs, all first, and two gyros in each other's place.
pub(super) fn others() -> impl Iterator<Item = Gyros> {
    let of = |swapped: bool| {
        move |changed: [bool; 3]| {
            let names = AXES.into_iter().zip(changed);
            let axes: Vec<&str> = names.filter(|(_, it)| *it).map(|(name, _)| name).collect();
            let signs = changed.map(|it| if it { -1.0 } else { 1.0 });
            let mut turn = Matrix3::from_diagonal(&signs.into());
            let both: Vec<usize> = (0..3).filter(|axis| changed[*axis]).collect();
            if swapped {
                turn = Matrix3::identity();
                turn.swap_rows(both[0], both[1]);
            }
            Gyros {
                turn,
                axes: axes.join(" and "),
                swapped,
            }
        }
    };
    let signs = (1..8u8)
        .rev()
        .map(|bits| [0, 1, 2].map(|axis| bits >> axis & 1 == 1));
    let places = [0b011, 0b101, 0b110].map(|bits: u8| [0, 1, 2].map(|axis| bits >> axis & 1 == 1));
    signs.map(of(false)).chain(places.into_iter().map(of(true)))
}

/// A second or so: rotation and velocity gained in steps of it, and the velocity gained from the
/// fixes, north, east, down, with gravity.
struct Second {
    steps: Vec<[Vector3<f64>; 2]>,
    seconds: f64,
    force: Vector3<f64>,
}

/// `None` where no window has enough velocities.
pub(super) fn measure(evidence: &Evidence) -> Option<Measure> {
    let windows = windows(evidence);
    let every = windows.len().div_ceil(WINDOWS).max(1);
    let used: Vec<&Vec<Second>> = windows.iter().step_by(every).collect();
    let left = |turn: &Matrix3<f64>| used.iter().map(|window| left(window, turn)).sum::<f64>();
    let given = left(&Matrix3::identity());
    let best = others().map(|gyros| (left(&gyros.turn), gyros));
    let (least, Gyros { axes, swapped, .. }) = best.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let ratio = given / least;
    (!used.is_empty() && ratio.is_finite()).then(|| Measure {
        kind: Kind::Signs,
        left: given.ln(),
        size: ratio.ln().max(0.0) / BETTER.ln(),
        problem: match swapped {
            true => format!(
                "turns about the axes called {axes} in each other's place, by gravity and the \
                 changes of velocity"
            ),
            false => format!(
                "turns the other way about the axis called {axes} than gravity and the changes of \
                 velocity"
            ),
        },
        state: "gravity and the changes of velocity turn as the gyros say".into(),
    })
}

fn windows(evidence: &Evidence) -> Vec<Vec<Second>> {
    let mut out: Vec<Vec<Second>> = Vec::new();
    let mut window: Vec<Second> = Vec::new();
    let mut length = 0.0;
    let mut begin: Option<(f64, Vector3<f64>)> = None;
    let mut close = |window: &mut Vec<Second>, length: &mut f64| {
        let done = std::mem::take(window);
        *length = 0.0;
        out.extend((done.len() >= STEPS).then_some(done));
    };
    for (time, span, velocity) in velocities(evidence) {
        let velocity = Vector3::from(velocity);
        let (from, before) = *begin.get_or_insert((time, velocity));
        let seconds = time - from;
        if seconds < APART_S[0] {
            continue;
        }
        begin = Some((time, velocity));
        let force = (velocity - before) / seconds - Vector3::new(0.0, 0.0, G0);
        match steps(evidence, from, seconds).filter(|_| seconds <= APART_S[1].max(1.5 * span)) {
            Some(steps) => window.push(Second {
                steps,
                seconds,
                force,
            }),
            None => close(&mut window, &mut length),
        }
        length += seconds;
        if length > WINDOW_S {
            close(&mut window, &mut length);
        }
    }
    close(&mut window, &mut length);
    out
}

fn steps(evidence: &Evidence, from: f64, seconds: f64) -> Option<Vec<[Vector3<f64>; 2]>> {
    let count = (seconds / STEP_S).round().max(1.0) as usize;
    let at = |k: usize| evidence.up_to(from + seconds * k as f64 / count as f64);
    let all = (0..count).map(|k| {
        let (a, b) = (at(k)?, at(k + 1)?);
        Some([b[0] - a[0], b[1] - a[1]])
    });
    all.collect()
}

/// What the best rotation leaves of a window, m2/s4.
fn left(window: &[Second], gyros: &Matrix3<f64>) -> f64 {
    let mut turned = Rotation3::identity();
    let (mut sum, mut squares) = (Matrix3::zeros(), 0.0);
    for second in window {
        let mut pushed = Vector3::zeros();
        for [angle, velocity] in &second.steps {
            let angle = gyros * angle;
            pushed += turned * Rotation3::new(0.5 * angle) * velocity;
            turned *= Rotation3::new(angle);
        }
        let force = pushed / second.seconds;
        sum += second.force * force.transpose();
        squares += second.force.norm_squared() + force.norm_squared();
    }
    let values = sum.singular_values();
    let mirrored = if sum.determinant() < 0.0 {
        2.0 * values.min()
    } else {
        0.0
    };
    squares - 2.0 * (values.sum() - mirrored)
}
