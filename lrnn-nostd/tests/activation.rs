//! The stated accuracy of the activations.

use lrnn_nostd::{Activation, Identity, Rational, Tanh};

const RATIONAL_ERROR: f64 = 2.0e-7;
const RATIONAL_FALL: f32 = 2.4e-7;

/// Every `stride`-th positive f32, from the smallest normal one beyond the clamp; then to infinity in larger strides.
fn sweep(stride: usize) -> impl Iterator<Item = f32> {
    let (first, clamp) = (f32::MIN_POSITIVE.to_bits(), 10.0_f32.to_bits());
    let inside = (first..clamp).step_by(stride);
    inside
        .chain((clamp..=f32::INFINITY.to_bits()).step_by(stride * 100))
        .map(f32::from_bits)
}

fn check_rational(stride: usize) {
    let mut highest = 0.0_f32;
    let (mut error, mut fall, mut count) = (0.0_f64, 0.0_f32, 0);
    for x in sweep(stride) {
        let y = Rational::apply(x);
        error = error.max((f64::from(y) - f64::from(x).tanh()).abs());
        assert!(y <= 1.0, "f({x}) = {y}");
        assert_eq!(Rational::apply(-x), -y, "not odd at {x}");
        fall = fall.max(highest - y);
        highest = highest.max(y);
        count += 1;
    }
    println!("{count} values: error {error:.3e}, fall {fall:.2e}");
    assert!(error < RATIONAL_ERROR, "{error:e}");
    assert!(
        error > 0.5 * RATIONAL_ERROR,
        "the documented figure is too timid: {error:e}"
    );
    assert!(fall < RATIONAL_FALL, "{fall:e}");
    assert_eq!(Rational::apply(0.0_f32), 0.0);
    assert!(Rational::apply(f32::NAN).is_nan());
}

#[test]
fn rational_in_f32() {
    check_rational(331);
}

/// Every f32; a minute or so.
#[test]
#[ignore = "long: cargo test -p lrnn-nostd --release -- --ignored"]
fn rational_in_f32_exhaustive() {
    check_rational(1);
}

#[test]
fn rational_in_f64() {
    let (mut last, mut error) = (0.0_f64, 0.0_f64);
    for k in 1..2_000_000 {
        let x = 5e-6 * f64::from(k);
        let (y, slope) = Rational::apply_with_slope(x);
        error = error.max((y - x.tanh()).abs());
        assert!((last..=1.0).contains(&y), "f({x}) = {y} after {last}");
        assert!((0.0..=1.0).contains(&slope), "f'({x}) = {slope}");
        last = y;
    }
    println!("error {error:.3e}");
    assert!(error < 1.2e-7, "{error:e}");
}

/// The slope is that of the function itself, to the rounding of a difference, and 0 beyond the clamp.
#[test]
fn slopes() {
    fn check<A: Activation>(x: f64) {
        let h = 1e-3;
        let at = |offset: f64| A::apply(x + offset);
        let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let (y, slope) = A::apply_with_slope(x);
        assert_eq!(y, A::apply(x));
        assert!(
            (slope - difference).abs() < 2e-11,
            "{:?} at {x}: {slope} for {difference}",
            A::default()
        );
    }
    for k in -829..=829 {
        let x = 0.01 * f64::from(k);
        check::<Tanh>(x);
        check::<Rational>(x);
        check::<Identity>(x);
    }
    assert_eq!(Rational::apply_with_slope(8.41_f64).1, 0.0);
    assert_eq!(Rational::apply_with_slope(-1e30_f32).1, 0.0);
}

/// `libm`'s tanhf: within 1.2e-7 absolute.
#[test]
fn tanh_in_f32() {
    let mut error = 0.0_f64;
    for x in sweep(997) {
        let y = Tanh::apply(x);
        error = error.max((f64::from(y) - f64::from(x).tanh()).abs());
        assert!(y <= 1.0);
        assert_eq!(Tanh::apply(-x), -y);
    }
    println!("error {error:.3e}");
    assert!(error < 1.2e-7, "{error:e}");
}
