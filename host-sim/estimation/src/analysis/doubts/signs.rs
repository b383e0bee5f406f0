//! The signs and places of the gyros: as they turn the specific force, it must be the changes of
//! velocity and gravity, whatever the mounting is. Over a window the rotations by the gyros bring
//! the specific force into the axes of its beginning, and the one rotation is fitted that brings it
//! to north, east and down (Wahba's problem), with a bias of the gyros. Signs or places that leave
//! much less than those given are the right ones.

use super::AXES;
use super::ahead::velocities;
use super::evidence::Evidence;
use super::measure::{Kind, Measure};
use host_core::inertial::units::{DEG, G0};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Rotation3, Vector3, Vector6};

/// Length of a window, s, and the most windows, evenly over the recording.
const WINDOW_S: f64 = 60.0;
const WINDOWS: usize = 40;
/// Times between two velocities that are compared, s, and the least number of them in a window.
const APART_S: [f64; 2] = [0.9, 2.5];
const STEPS: usize = 10;
/// Step of the rotation, s.
const STEP_S: f64 = 0.1;
/// Other signs must leave so much less: a ratio of sums of squares, and in standard deviations of
/// its logarithm. Of ten other ways one fits a short drive better by luck.
const BETTER: f64 = 1.5;
const SIGMAS: f64 = 4.0;
/// The most that right signs leave, m/s2. Where no signs fit, the best ones are a matter of luck.
const FITS: f64 = 1.0;
/// Biases of consumer MEMS, rad/s, and noise of the forces, m/s2 (assumed). In a window they tilt
/// the forces by a radian, so they are estimated with the rotation, in so many rounds.
const BIAS: f64 = 1.0 * DEG;
const NOISE: f64 = 0.3;
const ROUNDS: usize = 5;
/// No other round, if the bias changes the attitude in a window by less, rad.
const ENOUGH: f64 = 0.01;

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
    let seconds = used.iter().map(|window| window.len()).sum::<usize>() as f64;
    let fits = least.min(given) < FITS * FITS * seconds;
    (!used.is_empty() && ratio.is_finite()).then(|| Measure {
        kind: Kind::Signs,
        left: given.ln(),
        size: match fits {
            true => ratio.ln().max(0.0) / BETTER.ln().max(SIGMAS * 2.0 / (3.0 * seconds).sqrt()),
            false => 0.0,
        },
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

/// What the best rotation and the best bias of the gyros leave of a window, m2/s4.
fn left(window: &[Second], gyros: &Matrix3<f64>) -> f64 {
    let mut bias = Vector3::zeros();
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let turned = turned(window, gyros, &bias);
        let (rotation, left) = wahba(window, &turned);
        least = least.min(left);
        let change = step(window, &turned, &rotation, &bias);
        if change.norm() * WINDOW_S < ENOUGH {
            break;
        }
        bias += change;
    }
    least
}

/// The force of a second in the axes of the window's beginning, and the integral of the rotation up
/// to its middle, s.
type Turned = (Vector3<f64>, Matrix3<f64>);

/// By the gyros, connected in this way, less a bias, rad/s.
fn turned(window: &[Second], gyros: &Matrix3<f64>, bias: &Vector3<f64>) -> Vec<Turned> {
    let mut rotation = Rotation3::identity();
    let mut integral = Matrix3::zeros();
    let seconds = window.iter().map(|second| {
        let before = integral;
        let dt = second.seconds / second.steps.len() as f64;
        let mut pushed = Vector3::zeros();
        for [angle, velocity] in &second.steps {
            let angle = gyros * angle - bias * dt;
            pushed += rotation * Rotation3::new(0.5 * angle) * velocity;
            integral += rotation.matrix() * dt;
            rotation *= Rotation3::new(angle);
        }
        (pushed / second.seconds, 0.5 * (before + integral))
    });
    seconds.collect()
}

/// The rotation that brings the forces nearest to those of the fixes, and what it leaves.
fn wahba(window: &[Second], turned: &[Turned]) -> (Matrix3<f64>, f64) {
    let (mut sum, mut squares) = (Matrix3::zeros(), 0.0);
    for (second, (force, _)) in window.iter().zip(turned) {
        sum += second.force * force.transpose();
        squares += second.force.norm_squared() + force.norm_squared();
    }
    let svd = sum.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return (Matrix3::identity(), squares);
    };
    let hand = (u * v).determinant().signum();
    let values = Vector3::new(1.0, 1.0, hand); // of falling singular values
    let rotation = u * Matrix3::from_diagonal(&values) * v;
    (rotation, squares - 2.0 * svd.singular_values.dot(&values))
}

/// The change of the bias that leaves least, with a small change of the rotation (Gauss-Newton).
fn step(
    window: &[Second],
    turned: &[Turned],
    rotation: &Matrix3<f64>,
    bias: &Vector3<f64>,
) -> Vector3<f64> {
    let weight = (NOISE / BIAS).powi(2);
    let mut normal = Matrix6::zeros();
    let mut right = Vector6::zeros();
    for axis in 0..3 {
        normal[(3 + axis, 3 + axis)] = weight;
        right[3 + axis] = -weight * bias[axis];
    }
    for (second, (force, integral)) in window.iter().zip(turned) {
        let to_north = rotation * force;
        let mut rows = Matrix3x6::zeros();
        rows.fixed_columns_mut::<3>(0)
            .copy_from(&-to_north.cross_matrix());
        rows.fixed_columns_mut::<3>(3)
            .copy_from(&(rotation * force.cross_matrix() * integral));
        normal += rows.transpose() * rows;
        right += rows.transpose() * (second.force - to_north);
    }
    let solved = normal.cholesky().map(|of| of.solve(&right));
    solved.map_or_else(Vector3::zeros, |of| of.fixed_rows::<3>(3).into_owned())
}
