//! The stated accuracy of the activations.

use lrnn_nostd::{Activation, Cubic, Identity, Rational, Tanh};

const RATIONAL_ERROR: f64 = 2.0e-7;
const RATIONAL_FALL: f32 = 2.4e-7;
const CUBIC_ERROR: f64 = 1.5e-7;
const CUBIC_FALL: f32 = 6.0e-8;
/// Difference between tanh' and the derivative of the approximation, in f64.
const RATIONAL_SLOPE: f64 = 5e-8;
const CUBIC_SLOPE: f64 = 2e-4;

/// Every `stride`-th positive f32, from the smallest normal one beyond the clamp; then to infinity
/// in larger strides.
fn sweep(stride: usize) -> impl Iterator<Item = f32> {
    let (first, clamp) = (f32::MIN_POSITIVE.to_bits(), 10.0_f32.to_bits());
    let inside = (first..clamp).step_by(stride);
    inside
        .chain((clamp..=f32::INFINITY.to_bits()).step_by(stride * 100))
        .map(f32::from_bits)
}

/// (error, fall) measured over a sweep.
fn measured<A: Activation>(stride: usize) -> (f64, f32) {
    let mut highest = 0.0_f32;
    let (mut error, mut fall, mut count) = (0.0_f64, 0.0_f32, 0);
    for x in sweep(stride) {
        if x.is_infinite() {
            continue;
        }
        let y = A::apply(x);
        error = error.max((f64::from(y) - f64::from(x).tanh()).abs());
        assert!(y <= 1.0, "f({x}) = {y}");
        assert_eq!(A::apply(-x), -y, "not odd at {x}");
        fall = fall.max(highest - y);
        highest = highest.max(y);
        count += 1;
    }
    println!(
        "{:?}, {count} values: error {error:.3e}, fall {fall:.2e}",
        A::default()
    );
    assert_eq!(A::apply(0.0_f32), 0.0);
    (error, fall)
}

#[cfg(feature = "micromath")]
#[test]
fn micromath_is_coarse() {
    let (error, fall) = measured::<lrnn_nostd::MicroMath>(331);
    assert!(error < 3.5e-4 && error > 3.0e-4, "{error:e}");
    assert_eq!(fall, 0.0);
    assert_eq!(lrnn_nostd::MicroMath::apply(f32::INFINITY), 1.0);
}

fn check(stride: usize) {
    let (error, fall) = measured::<Rational>(stride);
    assert!(fall < RATIONAL_FALL, "{fall:e}");
    assert!(
        error < RATIONAL_ERROR && error > 0.5 * RATIONAL_ERROR,
        "{error:e}"
    );
    let (error, fall) = measured::<Cubic>(stride);
    assert!(fall < CUBIC_FALL, "{fall:e}");
    assert!(
        error < CUBIC_ERROR && error > 0.5 * CUBIC_ERROR,
        "{error:e}"
    );
    assert!(Cubic::apply(f32::INFINITY).is_nan());
    assert!(Rational::apply(f32::NAN).is_nan() && Cubic::apply(f32::NAN).is_nan());
}

#[test]
fn accuracy_in_f32() {
    check(331);
}

/// Every f32; a minute or so.
#[test]
#[ignore = "long: cargo test -p lrnn-nostd --release -- --ignored"]
fn accuracy_in_f32_exhaustive() {
    check(1);
}

#[test]
fn rational_in_f64() {
    let (mut last, mut error) = (0.0_f64, 0.0_f64);
    for k in 1..2_000_000 {
        let x = 5e-6 * f64::from(k);
        let y = Rational::apply(x);
        let slope = Rational::slope(y);
        error = error.max((y - x.tanh()).abs());
        assert!((last..=1.0).contains(&y), "f({x}) = {y} after {last}");
        assert!((0.0..=1.0).contains(&slope), "f'({x}) = {slope}");
        last = y;
    }
    println!("error {error:.3e}");
    assert!(error < 1.2e-7, "{error:e}");
}

/// f' from y compared with a difference of f: rounding, and for [`Rational`] the difference between
/// tanh' and the derivative of the approximation.
#[test]
fn slopes() {
    fn worst<A: Activation>() -> f64 {
        let h = 1e-3;
        let error = |x: f64| {
            let at = |offset: f64| A::apply(x + offset);
            let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
            (A::slope(at(0.0)) - difference).abs()
        };
        (-829..=829)
            .map(|k| error(0.01 * f64::from(k)))
            .fold(0.0, f64::max)
    }
    let [tanh, rational, identity] = [worst::<Tanh>(), worst::<Rational>(), worst::<Identity>()];
    println!("{tanh:.1e} {rational:.1e} {identity:.1e}");
    assert!(tanh < 2e-11 && identity < 2e-11, "{tanh:e} {identity:e}");
    assert!(rational < RATIONAL_SLOPE, "{rational:e}");
    let cubic = worst::<Cubic>();
    assert!(cubic < CUBIC_SLOPE, "{cubic:e}");
    // all take the slope of tanh, 1 - y^2: a coarse activation has no better one
    for y in [-1.0, -0.5, 0.0, 0.3, 0.9] {
        let slope = Tanh::slope(y);
        assert_eq!([Rational::slope(y), Cubic::slope(y)], [slope; 2]);
        #[cfg(feature = "micromath")]
        assert_eq!(lrnn_nostd::MicroMath::slope(y), slope);
    }
}

/// The three values of a layer equal those computed one by one, below, at and beyond the clamp. A
/// non-finite one is reported.
#[test]
fn layers() {
    fn check<A: Activation>(x: [f32; 3]) {
        let bits = |y: [f32; 3]| y.map(f32::to_bits);
        match A::layer(x) {
            Some(y) => assert_eq!(bits(y), bits(x.map(A::apply)), "{x:?}"),
            None => assert!(x.iter().any(|x| !x.is_finite()), "{x:?}"),
        }
        assert_eq!(A::layer(x).is_some(), x.iter().all(|x| x.is_finite()));
    }
    let values = [
        0.0, -1e-30, 0.7, -4.85, 4.86, 8.3999, -8.4, 8.4001, 1e19, -3e38,
    ];
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let values: Vec<_> = values.into_iter().chain(bad).collect();
    for &a in &values {
        for &b in &values {
            for &c in &values {
                check::<Rational>([a, b, c]);
                check::<Tanh>([a, b, c]);
                check::<Identity>([a, b, c]);
                check::<Cubic>([a, b, c]);
                #[cfg(feature = "micromath")]
                check::<lrnn_nostd::MicroMath>([a, b, c]);
            }
        }
    }
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
