//! Rauch-Tung-Striebel smoothing of the recorded intervals (fixed interval), for a filter with
//! feedback.

use crate::inertial::earth::Geodetic;
use crate::inertial::sins::NavState;
use crate::list::{Item, List, numbers, put_all};
use nalgebra::{DMatrix, DVector, Quaternion, UnitQuaternion, Vector3};

/// Input of the smoother for one interval. The state is that after the last fix, at the start of
/// the interval.
#[derive(Debug, Clone)]
pub struct Record {
    /// Covariance at the start of the interval.
    pub p: DMatrix<f64>,
    /// Navigation state at the start.
    pub nav: NavState,
    /// Parameters at the start.
    pub theta: DVector<f64>,
    /// Transition over the interval.
    pub phi: DMatrix<f64>,
    /// Covariance at the end, before the fix.
    pub predicted: DMatrix<f64>,
    /// Error that the fix at the end gave and that was fed back.
    pub correction: DVector<f64>,
    /// Normalised innovation squared of that fix: chi-square with 6 degrees of freedom when the
    /// filter is consistent.
    pub nis: f64,
}

/// All numbers, after the numbers of states and of parameters.
impl Item for Record {
    fn put(&self, bytes: &mut Vec<u8>) {
        let Geodetic { lat, lon, h } = self.nav.position;
        put_all(bytes, &[self.p.nrows() as f64, self.theta.len() as f64]);
        put_all(bytes, &[lat, lon, h]);
        put_all(bytes, self.nav.velocity.as_slice());
        put_all(bytes, self.nav.q_bn.coords.as_slice());
        put_all(bytes, self.theta.as_slice());
        [&self.p, &self.phi, &self.predicted]
            .iter()
            .for_each(|matrix| put_all(bytes, matrix.as_slice()));
        put_all(bytes, self.correction.as_slice());
        put_all(bytes, &[self.nis]);
    }

    fn take(bytes: &[u8]) -> Self {
        let mut numbers = numbers(bytes);
        let mut next = || numbers.next().unwrap_or_default();
        let [n, m] = [0; 2].map(|_: usize| next() as usize);
        let [lat, lon, h] = [0; 3].map(|_: usize| next());
        let nav = NavState {
            position: Geodetic { lat, lon, h },
            velocity: Vector3::from_fn(|_, _| next()),
            q_bn: UnitQuaternion::new_unchecked(Quaternion::from_vector(
                nalgebra::Vector4::from_fn(|_, _| next()),
            )),
        };
        let theta = DVector::from_fn(m, |_, _| next());
        // in storage order: column by column
        let [p, phi, predicted] = [(); 3].map(|()| DMatrix::from_fn(n, n, |_, _| next()));
        Self {
            p,
            nav,
            theta,
            phi,
            predicted,
            correction: DVector::from_fn(n, |_, _| next()),
            nis: next(),
        }
    }
}

/// Smoothed parameters over one interval.
#[derive(Debug, Clone)]
pub struct Smoothed {
    /// Navigation state at the start of the interval.
    pub nav: NavState,
    /// Parameters at the start of the interval.
    pub theta: DVector<f64>,
    /// Standard deviations of the parameters.
    pub sigma: DVector<f64>,
}

/// Smooths intervals in the order of recording and gives one entry a record. The last entry is the
/// filter's own estimate, corrected by the last fix alone.
#[must_use]
pub fn smooth(records: &List<Record>) -> Vec<Smoothed> {
    let mut out: Vec<Smoothed> = Vec::with_capacity(records.len());
    let Some(last) = records.end() else {
        return out;
    };
    let size = last.p.nrows();
    let mut s = DVector::zeros(size);
    // Covariance of the smoothed state at the end of the last interval. The covariance after the
    // fix is not recorded. The predicted one is used instead, which is on the safe side for that
    // one interval.
    let mut p_s = last.predicted.clone();
    let mut cursor = records.cursor();
    for k in (0..records.len()).rev() {
        let Some(r) = cursor.get(k) else {
            break;
        };
        // gain C = P Phi' P-^-1, solved from P- C' = Phi P
        let rhs = &r.phi * &r.p;
        let Some(chol) = scaled_cholesky(&r.predicted) else {
            break;
        };
        let gain = chol.solve(&rhs).transpose();
        s = &gain * (&r.correction + &s);
        p_s = &r.p + &gain * (&p_s - &r.predicted) * gain.transpose();
        let n = r.theta.len();
        let sigma = p_s.diagonal().rows(size - n, n).map(|v| v.max(0.0).sqrt());
        out.push(Smoothed {
            nav: super::displaced(&r.nav, &s),
            theta: &r.theta - s.rows(size - n, n),
            sigma,
        });
    }
    out.reverse();
    out
}

/// Cholesky factor of a covariance whose diagonal spans many decades. It is scaled to unit diagonal
/// first.
struct Scaled {
    chol: nalgebra::Cholesky<f64, nalgebra::Dyn>,
    d: DVector<f64>,
}

fn scaled_cholesky(p: &DMatrix<f64>) -> Option<Scaled> {
    let d = p
        .diagonal()
        .map(|v| if v > 0.0 { 1.0 / v.sqrt() } else { 1.0 });
    let unit = DMatrix::from_fn(p.nrows(), p.ncols(), |i, j| p[(i, j)] * d[i] * d[j]);
    Some(Scaled {
        chol: unit.cholesky()?,
        d,
    })
}

impl Scaled {
    fn solve(&self, rhs: &DMatrix<f64>) -> DMatrix<f64> {
        let mut x = DMatrix::from_fn(rhs.nrows(), rhs.ncols(), |i, j| rhs[(i, j)] * self.d[i]);
        self.chol.solve_mut(&mut x);
        DMatrix::from_fn(rhs.nrows(), rhs.ncols(), |i, j| x[(i, j)] * self.d[i])
    }
}
