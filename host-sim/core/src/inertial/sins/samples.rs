//! Coning and sculling: from an increment, and those before it, to the rotation vector `phi` and
//! its counterpart for velocity `eta` (Savage 1998, "Strapdown inertial navigation integration
//! algorithm design", parts 1 and 2; Ignagni 1990, 1998; Miller 1983).
//!
//! To second order `phi = dtheta + 1/2 int alpha x omega dt` with `alpha` the integral of `omega`
//! since the start of the increment. Sculling is the same bilinear form with specific force instead
//! of one of its two arguments (Roscoe 2001). One set of coefficients serves both: every product
//! `A x B` becomes `A_theta x B_v + A_v x B_theta`.
//!
//! With `A`, `B`, `C` the increments k-2, k-1 and k, and the rate over them `a + b t + c t^2` (t in
//! sample periods, from the start of C):
//!
//! | | a x b | a x c | b x c |
//! |---|---|---|---|
//! | wanted, `1/2 int alpha x omega` | 1/12 | 1/12 | 1/60 |
//! | `B x C` | 1 | 0 | -1/3 |
//! | `A x C` | 2 | -2 | -5/3 |
//! | `A x B` | 1 | -2 | 2/3 |
//!
//! Two samples: `B x C / 12` is exact in the first column. Three samples: `17/120 B x C - 1/60 A x
//! C - 1/40 A x B` is exact in the first two columns for any motion. The third degree of freedom
//! serves classical coning instead of `b x c`, where it is worth more. With the phase `l` of the
//! cone per sample and its half-angle `a`, the mean error per sample falls from `l^5/60 sin^2 a` to
//! the order of `l^7`. The plain polynomial solution, 121/720, -31/720, 1/720, would stay at `l^5`.

use crate::inertial::lane::{Lane, V3, add, cross, scaled, sub};
use crate::list::{Item, numbers, put_all};
use nalgebra::Vector3;

/// Increments over one sample period `dt`: the integrals of the inertial rate and of the specific
/// force, both in body axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increment {
    /// Delta-theta, rad.
    pub dtheta: Vector3<f64>,
    /// Delta-v, m/s.
    pub dv: Vector3<f64>,
}

impl Increment {
    /// Delta-theta and delta-v.
    #[inline(always)]
    pub(crate) fn parts(&self) -> [V3<f64>; 2] {
        [self.dtheta.into(), self.dv.into()]
    }
}

impl Item for Increment {
    fn put(&self, bytes: &mut Vec<u8>) {
        put_all(bytes, self.dtheta.as_slice());
        put_all(bytes, self.dv.as_slice());
    }

    fn take(bytes: &[u8]) -> Self {
        let mut numbers = numbers(bytes);
        let mut next = || Vector3::from_fn(|_, _| numbers.next().unwrap_or_default());
        Self {
            dtheta: next(),
            dv: next(),
        }
    }
}

/// The number of increments that coning and sculling are computed from: the newest and those before
/// it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Samples {
    /// No compensation. For increments that are compensated already, and for comparison.
    One,
    /// The newest increment and the one before. It stores only one increment.
    Two,
    /// The newest increment and two before. It is at least as good as [`Self::Two`] in every motion
    /// of the tests, and much better in fast coning, in sculling and on bodies that spin.
    #[default]
    Three,
}

impl Samples {
    /// Rotation vector in rad of the newest increment, and its velocity counterpart in m/s. An
    /// increment here is delta-theta and delta-v; `previous` has the two increments before, the
    /// later one first.
    #[inline(always)]
    pub(crate) fn combine<L: Lane>(
        self,
        previous: &[[V3<L>; 2]; 2],
        increment: &[V3<L>; 2],
    ) -> (V3<L>, V3<L>) {
        let [b, a] = previous;
        let (coning, sculling) = match self {
            Self::One => return (increment[0], increment[1]),
            Self::Two => {
                let (coning, sculling) = products(b, increment);
                (over(&coning, 12.0), over(&sculling, 12.0))
            }
            Self::Three => {
                let earlier = [earlier(&a[0], &b[0]), earlier(&a[1], &b[1])];
                let (coning, sculling) = products(&earlier, increment);
                let (coning_ab, sculling_ab) = products(a, b);
                let last = 1.0 / 40.0;
                (
                    sub(&coning, &scaled(&coning_ab, last)),
                    sub(&sculling, &scaled(&sculling_ab, last)),
                )
            }
        };
        (add(&increment[0], &coning), add(&increment[1], &sculling))
    }
}

/// The product of two increments for coning, and its counterpart for sculling.
#[inline(always)]
fn products<L: Lane>(x: &[V3<L>; 2], y: &[V3<L>; 2]) -> (V3<L>, V3<L>) {
    let sculling = add(&cross(&x[0], &y[1]), &cross(&x[1], &y[0]));
    (cross(&x[0], &y[0]), sculling)
}

/// `17/120 b - 1/60 a`.
#[inline(always)]
fn earlier<L: Lane>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    sub(&scaled(b, 17.0 / 120.0), &scaled(a, 1.0 / 60.0))
}

#[inline(always)]
fn over<L: Lane>(a: &V3<L>, by: f64) -> V3<L> {
    [a[0] / by, a[1] / by, a[2] / by]
}
