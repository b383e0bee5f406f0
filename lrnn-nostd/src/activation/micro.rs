//! tanh by `micromath`.

use core::any::Any;

use micromath::F32Ext;

use super::Activation;
use crate::real::Real;

/// tanh as `1 - 2 / (exp(2 |x|) + 1)` with the exponential of the crate `micromath`, which has no
/// tanh of its own. For programs that link that crate already.
///
/// It is coarse, and not faster than [`Rational`](super::Rational): in `f32` |f(x) - tanh x| <
/// 3.5e-4 for every x, |f(x)| <= 1 and f(-x) = -f(x), and where x rises f does not fall. In `f64`
/// it is computed in `f32`. The slope is 1 - y^2, as for tanh. f of NaN is some number, which no
/// step sees: [`Activation::layer`] refuses a NaN before.
///
/// ```
/// use lrnn_nostd::{Activation, MicroMath, Tanh};
///
/// assert!((MicroMath::apply(0.7_f32) - Tanh::apply(0.7_f32)).abs() < 3.5e-4);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MicroMath;

/// Beyond it tanh is 1 in `f32`, and the exponential of twice of it is still finite.
const END: f32 = 10.0;

impl Activation for MicroMath {
    const CODE: u8 = 4;

    #[inline(always)]
    fn apply<T: Real>(x: T) -> T {
        match (&x as &dyn Any).downcast_ref::<f32>() {
            Some(x) => single(tanh(*x)),
            None => T::from_f64(f64::from(tanh(x.to_f64() as f32))),
        }
    }

    #[inline(always)]
    fn slope<T: Real>(y: T) -> T {
        T::ONE - y * y
    }
}

#[inline(always)]
fn tanh(x: f32) -> f32 {
    let magnitude = if x < 0.0 { -x } else { x };
    let inside = if magnitude > END { END } else { magnitude };
    // named in full: with `std` an f32 has an exponential of its own
    let y = 1.0 - 2.0 / (F32Ext::exp(inside + inside) + 1.0);
    if x < 0.0 { -y } else { y }
}

/// An `f32` as `T`, without a detour by `f64` where both are the same.
#[inline(always)]
fn single<T: Real>(y: f32) -> T {
    match (&y as &dyn Any).downcast_ref::<T>() {
        Some(y) => *y,
        None => T::from_f64(f64::from(y)),
    }
}
