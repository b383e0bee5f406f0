//! Errors of the accelerometers from rests in several attitudes, by gravity alone.
//!
//! With z the mean specific force in a rest as the sensor has it, f the true one, M the map and B
//! the bias,
//!
//! ```text
//! f = (1 - M) (z - B),        |f| = g.
//! ```
//!
//! B stands before the map, because a rotation of all axes then leaves it as it is.
//!
//! The 12 unknowns and gravity have a prior that is wide for every sensor ([`PRIOR`]). The
//! posterior mean and covariance come from Gauss-Newton steps, so a combination that the rests do
//! not show keeps its prior standard deviation. One such combination is the common rotation of the
//! three axes, which gravity's amount does not show: M comes out symmetric. Only known attitudes
//! (`placement`: the sensor's axes vertical within a standard deviation) show it.

mod sheet;
mod turns;

pub use sheet::{PAIRS, gyro_scale, numbers};
pub use turns::{Turn, scales, turns};

use super::standing::{Log, Rests, Stretch, rests};
use host_core::error::Error;
use host_core::inertial::units::DEG;
use nalgebra::{Matrix3, SMatrix, Vector3};
use serde::Serialize;

/// Number of unknowns: map row by row, bias, error of gravity.
pub const UNKNOWNS: usize = 13;
/// Standard deviations beforehand of an element of the map and of the bias, m/s2: a consumer
/// sensor that nobody has calibrated (3 %, 50 mg).
pub const PRIOR: [f64; 2] = [0.03, 0.5];
/// Least number of rests.
pub const LEAST_RESTS: usize = 6;
/// Largest angle between a vertical axis and gravity for a placed sensor, deg.
const PLACED_DEG: f64 = 20.0;
/// An unknown that keeps more than this share of its prior standard deviation was not shown.
const SHOWN: f64 = 0.5;
/// Steps; three are enough for errors of some per cent.
const STEPS: usize = 10;

/// Covariance of the unknowns.
pub type Covariance = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// The mean specific force of a rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Log and time, for messages.
    pub name: String,
    /// m/s2.
    pub force: Vector3<f64>,
    /// Its standard deviation, m/s2.
    pub sigma: f64,
    /// Mean rate, rad/s.
    pub rate: Vector3<f64>,
}

/// Errors of the accelerometers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// The map M, a row for each axis: `f = (1 - M) (z - B)`.
    pub map: [[f64; 3]; 3],
    /// The bias B, m/s2.
    pub bias: [f64; 3],
    /// Gravity, m/s2, and its standard deviation.
    pub gravity: [f64; 2],
    /// Standard deviations of map and bias.
    pub map_sigma: [[f64; 3]; 3],
    /// m/s2.
    pub bias_sigma: [f64; 3],
    /// Covariance of map, bias and gravity, all in SI.
    #[serde(skip)]
    pub covariance: Covariance,
    /// Root mean square of what is left of the force less gravity, m/s2, before and after.
    pub left: [f64; 2],
    /// Factor by which the scatter of the rests enlarged the standard deviations, at least 1.
    pub enlarged: f64,
    /// Degrees of freedom that judge the model.
    pub degrees: f64,
}

/// The rests of all logs.
///
/// # Errors
/// There are too few; the force is not gravity within 20 %.
pub fn positions(logs: &[Log], least_s: f64) -> Result<Vec<Position>, Error> {
    let (mut all, mut longest) = (vec![], 0.0);
    for log in logs {
        let Rests {
            stretches,
            longest_s,
            ..
        } = rests(log, least_s);
        longest = f64::max(longest, longest_s);
        all.extend(stretches.iter().map(|s| position(log, s)));
    }
    let name = logs.first().map_or(String::new(), |log| log.name.clone());
    let refused = |problem: String, remedy: &str| Error::Option {
        option: name.clone(),
        problem,
        remedy: remedy.into(),
    };
    if all.len() < LEAST_RESTS {
        let problem = format!(
            "has {} of {least_s} s and longer (the longest lasts {longest:.0} s); {LEAST_RESTS} in \
             different attitudes are needed",
            match all.len() {
                1 => "one rest".into(),
                n => format!("{n} rests"),
            }
        );
        let remedy = "let the sensor rest on each of its six sides, and better also on edges; \
                      --least-rest-s takes shorter rests";
        return Err(refused(problem, remedy));
    }
    let [gravity, _] = logs.first().map_or([9.8, 0.0], Log::gravity);
    let off = |p: &&Position| (p.force.norm() / gravity - 1.0).abs() > 0.2;
    if let Some(p) = all.iter().find(off) {
        let problem = format!(
            "the specific force in the rest of {} is {:.3} m/s2 instead of gravity",
            p.name,
            p.force.norm()
        );
        let remedy = "check the unit of the accelerometers (docs/your-data.md)";
        return Err(refused(problem, remedy));
    }
    Ok(all)
}

fn position(log: &Log, rest: &Stretch) -> Position {
    Position {
        name: format!("{} from {:.1} to {:.1} s", log.name, rest.from_s, rest.to_s),
        force: rest.force,
        sigma: rest.sigma[1].norm() / 3.0_f64.sqrt(),
        rate: rest.rate,
    }
}

/// Which of the six sides were down or up: smallest angle of any rest to each, deg.
#[must_use]
pub fn sides(positions: &[Position]) -> [f64; 6] {
    std::array::from_fn(|side| {
        let axis = Vector3::ith(side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
        let angles = positions.iter().map(|p| p.force.angle(&axis) / DEG);
        angles.fold(180.0, f64::min)
    })
}

/// Fits the model. `noise`: standard deviation of a rest beside that of its own mean, m/s2, for
/// what a bias does between the rests. `placement`: how well the sensor's axes were vertical, rad.
///
/// # Errors
/// A rest has no axis near the vertical, although the sensor was placed so.
pub fn fit(
    positions: &[Position],
    gravity: [f64; 2],
    noise: f64,
    placement: Option<f64>,
) -> Result<Fit, Error> {
    let mut weights = Covariance::zeros();
    for i in 0..UNKNOWNS {
        let sigma = match i {
            0..9 => PRIOR[0],
            9..12 => PRIOR[1],
            _ => gravity[1],
        };
        weights[(i, i)] = sigma.powi(-2);
    }
    let mut x = SMatrix::<f64, UNKNOWNS, 1>::zeros();
    let mut information = weights;
    for _ in 0..STEPS {
        let (mut a, mut right) = (weights, -(weights * x));
        for position in positions {
            for (row, residual, sigma) in rows(position, &x, gravity[0], noise, placement)? {
                a += row * row.transpose() / (sigma * sigma);
                right -= row * (residual / (sigma * sigma));
            }
        }
        let Some(step) = a.cholesky().map(|c| c.solve(&right)) else {
            break;
        };
        (x, information) = (x + step, a);
    }
    let mut covariance = inverse(information);
    let (mut squares, mut shown, mut count) = (0.0, 0.0, 0.0);
    for position in positions {
        for (row, residual, sigma) in rows(position, &x, gravity[0], noise, placement)? {
            squares += (residual / sigma).powi(2);
            shown += (row.transpose() * covariance * row)[0] / (sigma * sigma);
            count += 1.0;
        }
    }
    let degrees: f64 = count - shown;
    let enlarged = match degrees >= 1.0 {
        true => (squares / degrees).sqrt().max(1.0),
        false => 1.0,
    };
    // what the rests showed is less certain by the factor; what the prior says stays
    covariance = inverse((information - weights) / (enlarged * enlarged) + weights);
    Ok(result(
        positions, gravity, &x, covariance, enlarged, degrees,
    ))
}

/// The covariance of an information matrix, which the prior makes positive.
fn inverse(information: Covariance) -> Covariance {
    let inverse = information.cholesky().map(|c| c.inverse());
    inverse.unwrap_or_else(Covariance::identity)
}

/// Gradient, residual and standard deviation of a rest's equations.
type Row = (SMatrix<f64, UNKNOWNS, 1>, f64, f64);

fn rows(
    position: &Position,
    x: &SMatrix<f64, UNKNOWNS, 1>,
    gravity: f64,
    noise: f64,
    placement: Option<f64>,
) -> Result<Vec<Row>, Error> {
    let z = position.force;
    let f = corrected(x, &z);
    let sigma = position.sigma.hypot(noise).max(1e-7);
    let (matrix, unbiased) = (matrix(x), z - bias(x));
    // d (u f) / d x: -u_i (z - B)_j for the map, -(1 - M)' u for the bias
    let along = |u: &Vector3<f64>| {
        let mut row = SMatrix::<f64, UNKNOWNS, 1>::zeros();
        let of_bias = matrix.transpose() * u;
        for i in 0..3 {
            for j in 0..3 {
                row[3 * i + j] = -u[i] * unbiased[j];
            }
            row[9 + i] = -of_bias[i];
        }
        row
    };
    let mut norm = along(&f.normalize());
    norm[12] = -1.0;
    let mut all = vec![(norm, f.norm() - gravity - x[12], sigma)];
    let Some(placement) = placement else {
        return Ok(all);
    };
    let axis = z.iamax();
    let vertical = Vector3::ith(axis, z[axis].signum());
    if z.angle(&vertical) > PLACED_DEG * DEG {
        return Err(Error::Option {
            option: "--placement-deg".into(),
            problem: format!(
                "is given, and in the rest of {} no axis is within {PLACED_DEG} degrees of the \
                 vertical",
                position.name
            ),
            remedy: "leave it out for rests that are not on the sides".into(),
        });
    }
    for i in (0..3).filter(|i| *i != axis) {
        let across = Vector3::ith(i, 1.0);
        all.push((along(&across), f[i], sigma.hypot(placement * gravity)));
    }
    Ok(all)
}

/// The force less the errors.
fn corrected(x: &SMatrix<f64, UNKNOWNS, 1>, z: &Vector3<f64>) -> Vector3<f64> {
    matrix(x) * (z - bias(x))
}

/// 1 - M.
fn matrix(x: &SMatrix<f64, UNKNOWNS, 1>) -> Matrix3<f64> {
    Matrix3::identity() - Matrix3::from_fn(|i, j| x[3 * i + j])
}

fn bias(x: &SMatrix<f64, UNKNOWNS, 1>) -> Vector3<f64> {
    Vector3::from_fn(|i, _| x[9 + i])
}

fn result(
    positions: &[Position],
    gravity: [f64; 2],
    x: &SMatrix<f64, UNKNOWNS, 1>,
    covariance: Covariance,
    enlarged: f64,
    degrees: f64,
) -> Fit {
    let sigma = |i: usize| covariance[(i, i)].max(0.0).sqrt();
    let rms = |f: &dyn Fn(&Position) -> f64| {
        let squares: f64 = positions.iter().map(|p| f(p).powi(2)).sum();
        (squares / positions.len() as f64).sqrt()
    };
    Fit {
        map: std::array::from_fn(|i| std::array::from_fn(|j| x[3 * i + j])),
        bias: std::array::from_fn(|i| x[9 + i]),
        gravity: [gravity[0] + x[12], sigma(12)],
        map_sigma: std::array::from_fn(|i| std::array::from_fn(|j| sigma(3 * i + j))),
        bias_sigma: std::array::from_fn(|i| sigma(9 + i)),
        covariance,
        left: [
            rms(&|p| p.force.norm() - gravity[0]),
            rms(&|p| corrected(x, &p.force).norm() - gravity[0] - x[12]),
        ],
        enlarged,
        degrees,
    }
}

impl Fit {
    /// What was shown of the sum of two unknowns with these factors: value and standard deviation.
    #[must_use]
    pub fn combined(&self, of: &[(usize, f64)]) -> [f64; 2] {
        let mut c = SMatrix::<f64, UNKNOWNS, 1>::zeros();
        of.iter().for_each(|(i, factor)| c[*i] += factor);
        let map = self.map.as_flattened().iter().chain(&self.bias);
        let value = map.enumerate().map(|(i, x)| x * c[i]).sum();
        let variance = (c.transpose() * self.covariance * c)[0];
        [value, variance.max(0.0).sqrt()]
    }

    /// Angle between two axes less a right angle, rad, with its standard deviation.
    #[must_use]
    pub fn skew(&self, [i, j]: [usize; 2]) -> [f64; 2] {
        self.combined(&[(3 * i + j, 1.0), (3 * j + i, 1.0)])
    }

    /// Whether the rests showed the scale factor of an axis.
    #[must_use]
    pub fn shows_scale(&self, axis: usize) -> bool {
        self.map_sigma[axis][axis] < SHOWN * PRIOR[0]
    }

    /// Whether they showed the bias of an axis.
    #[must_use]
    pub fn shows_bias(&self, axis: usize) -> bool {
        self.bias_sigma[axis] < SHOWN * PRIOR[1]
    }

    /// Whether they showed the angle between two axes.
    #[must_use]
    pub fn shows_skew(&self, axes: [usize; 2]) -> bool {
        self.skew(axes)[1] < SHOWN * PRIOR[0] * std::f64::consts::SQRT_2
    }
}

/// The gyros' bias over the rests, rad/s, and its standard deviation. Half of the Earth's rotation,
/// whose direction is not known, is a part of each rest's.
#[must_use]
pub fn gyro_bias(positions: &[Position]) -> [[f64; 3]; 2] {
    let count = positions.len().max(1) as f64;
    let mean = positions.iter().map(|p| p.rate).sum::<Vector3<f64>>() / count;
    let squares = positions.iter().map(|p| (p.rate - mean).map(|x| x * x));
    let scatter = squares.sum::<Vector3<f64>>() / (count - 1.0).max(1.0);
    // attitudes that do not average out leave what the Earth's rotation is along an axis
    let earth = super::standing::EARTH / 3.0_f64.sqrt();
    let sigma = scatter.map(|v| (v / count).sqrt().hypot(earth / count.sqrt()));
    [mean.into(), sigma.into()]
}

#[cfg(test)]
mod tests;
