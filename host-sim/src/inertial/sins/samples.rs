//! Coning and sculling: from a word's increments, and those of the words before, to the rotation vector `phi` and its
//! twin for velocity `eta` (Savage 1998, "Strapdown inertial navigation integration algorithm design", parts 1 and 2;
//! Ignagni 1990, 1998; Miller 1983).
//!
//! To second order `phi = dtheta + 1/2 int alpha x omega dt` with `alpha` the integral of `omega` since the start of the word.
//! Sculling is the same bilinear form with one of its two arguments exchanged for specific force (Roscoe 2001), so
//! that one set of coefficients serves both: every product `A x B` becomes `A_theta x B_v + A_v x B_theta`.
//!
//! With `A`, `B`, `C` the words k-2, k-1 and k, and the rate over them `a + b t + c t^2` (t in words, from the start of C):
//!
//! | | a x b | a x c | b x c |
//! |---|---|---|---|
//! | wanted, `1/2 int alpha x omega` | 1/12 | 1/12 | 1/60 |
//! | `B x C` | 1 | 0 | -1/3 |
//! | `A x C` | 2 | -2 | -5/3 |
//! | `A x B` | 1 | -2 | 2/3 |
//!
//! Two samples: `B x C / 12` is right in the first column. Three samples: `17/120 B x C - 1/60 A x C - 1/40 A x B` is right in the
//! first two columns, whatever the motion, and spends its third freedom not on `b x c` but on classical coning, where it is
//! worth more: with `l` the cone's phase per word and `a` its half-angle the mean error per word falls from
//! `l^5/60 sin^2 a` to order `l^7` (the plain polynomial solution, 121/720, -31/720, 1/720, would stay at `l^5`).

use nalgebra::Vector3;

/// Increments of one word: integrals over `dt` of the inertial rate and of the specific force, both in body axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increment {
    /// Delta-theta, rad.
    pub dtheta: Vector3<f64>,
    /// Delta-v, m/s.
    pub dv: Vector3<f64>,
}

/// How many words coning and sculling are computed from: the word itself and the last ones before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Samples {
    /// No compensation; only for comparison.
    One,
    /// The word and the one before: a navigator that may start between any two words and keeps only one.
    Two,
    /// The word and two before; at least as good as [`Self::Two`] in every motion of the tests, and much better in fast coning, in
    /// sculling and on bodies that spin.
    #[default]
    Three,
}

impl Samples {
    /// Rotation vector in rad and its velocity counterpart in m/s of the newest word; `past` holds the last word and the one before it.
    pub(crate) fn combine(
        self,
        past: &[Increment; 2],
        word: &Increment,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let [b, a] = past;
        let (coning, sculling) = match self {
            Self::One => return (word.dtheta, word.dv),
            Self::Two => {
                let (coning, sculling) = cross(b, word);
                (coning / 12.0, sculling / 12.0)
            }
            Self::Three => {
                let earlier = Increment {
                    dtheta: b.dtheta * (17.0 / 120.0) - a.dtheta / 60.0,
                    dv: b.dv * (17.0 / 120.0) - a.dv / 60.0,
                };
                let (coning, sculling) = cross(&earlier, word);
                let (coning_ab, sculling_ab) = cross(a, b);
                (coning - coning_ab / 40.0, sculling - sculling_ab / 40.0)
            }
        };
        (word.dtheta + coning, word.dv + sculling)
    }
}

/// The product of two words for coning, and its counterpart for sculling.
fn cross(x: &Increment, y: &Increment) -> (Vector3<f64>, Vector3<f64>) {
    (
        x.dtheta.cross(&y.dtheta),
        x.dtheta.cross(&y.dv) + x.dv.cross(&y.dtheta),
    )
}

/// Specific force integrated in the axes the body had at the start of the word, m/s: `(I + (1 - cos n)/n^2 [phi x] +
/// (n - sin n)/n^3 [phi x]^2) eta` with `n = |phi|` (Savage 1998, part 2), by series: relative error `n^4/720`, 3e-8 at 0.07 rad.
pub(super) fn in_start_axes(phi: &Vector3<f64>, eta: &Vector3<f64>) -> Vector3<f64> {
    let n2 = phi.norm_squared();
    let once = phi.cross(eta);
    eta + once * (0.5 - n2 / 24.0) + phi.cross(&once) * (1.0 / 6.0 - n2 / 120.0)
}
