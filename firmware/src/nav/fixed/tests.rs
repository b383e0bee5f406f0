use super::*;
use proptest::prelude::*;

/// Numbers of all sizes: few have the size of the bound.
fn number(bits: u32) -> impl Strategy<Value = i64> {
    let bound = 1_i64 << bits;
    let ends = prop_oneof![
        Just(-bound),
        Just(bound - 1),
        Just(0),
        Just(-1),
        Just((1 << 31) - 1),
        Just(1 << 31),
    ];
    prop_oneof![
        1 => ends,
        6 => (0..=bits, -bound..bound).prop_map(move |(less, x)| x >> less),
    ]
}

/// The product in 128 bits, where it fits.
fn exact(a: i64, b: i64, shift: u32) -> i128 {
    (i128::from(a) * i128::from(b)) >> shift
}

fn fits(x: i128) -> bool {
    i64::try_from(x).is_ok()
}

macro_rules! products {
    ($a:expr, $b:expr, $($shift:literal)+) => {
        $(let wanted = exact($a, $b, $shift);
        if fits(wanted) {
            prop_assert_eq!(i128::from(mul::<$shift>($a, $b)), wanted, "over 2^{}", $shift);
        })+
    };
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    #[test]
    fn products_are_those_of_128_bits(a in number(61), b in number(61)) {
        products!(a, b, 31 40 47 48 51 55 58 59 60 61 62);
    }

    #[test]
    fn sums_of_four_are_exact_to_their_bound(
        a in [number(60), number(60), number(60), number(60)],
        b in [number(60), number(60), number(60), number(60)],
    ) {
        let sum = Sum::of(a[0], b[0]).plus(a[1], b[1]).minus(a[2], b[2]).plus(a[3], b[3]);
        let products: [i128; 4] = core::array::from_fn(|i| i128::from(a[i]) * i128::from(b[i]));
        let wanted = products[0] + products[1] - products[2] + products[3];
        let overs = [(sum.over::<59>(), 59), (sum.over::<60>(), 60), (sum.over::<61>(), 61)];
        for (got, shift) in overs {
            let wanted = wanted >> shift;
            if fits(wanted) {
                let off = i128::from(got) - wanted;
                prop_assert!(off.abs() <= (4 << (62 - shift)) + 1, "over 2^{}: {}", shift, off);
            }
        }
    }

    #[test]
    fn numbers_go_to_fixed_point_and_back(x in number(62), bits in 23_u32..84) {
        let as_float = to_f64(x, bits);
        let back = from_f64(as_float, bits);
        // f64 has 53 bits
        let most = i128::from(x.unsigned_abs() >> 53);
        prop_assert!((i128::from(back) - i128::from(x)).abs() <= most);
        let single = to_f32(x, bits);
        prop_assert_eq!(single, as_float as f32);
        let back = from_f32(single, bits);
        let most = i128::from(x.unsigned_abs() >> 24);
        prop_assert!((i128::from(back) - i128::from(x)).abs() <= most);
    }

    #[test]
    fn any_float_is_rounded_towards_zero(x in any::<f64>(), bits in 23_u32..84) {
        prop_assume!(!x.is_nan());
        // a power of two changes no digit; `as` rounds towards 0 and saturates
        let wanted = ((x * unit(bits)) as i64).max(-i64::MAX);
        prop_assert_eq!(from_f64(x, bits), wanted);
        let wanted = ((f64::from(x as f32) * unit(bits)) as i64).max(-i64::MAX);
        prop_assert_eq!(from_f32(x as f32, bits), wanted);
    }

    #[test]
    fn counts_have_their_worth(
        sum in number(47),
        exponent in -50.0..2.0_f64,
        bits in prop_oneof![Just(ANGLE), Just(VELOCITY)],
    ) {
        let lsb = exponent.exp2();
        let most = if bits == ANGLE { 2.0 } else { 16_000.0 };
        let got = Scale::new(lsb, bits, most).of(sum);
        let wanted = sum as f64 * lsb;
        if wanted.abs() < most - lsb {
            let off = (got as f64 - wanted * unit(bits)).abs();
            prop_assert!(off <= 1.5 + 6e-14 * (got as f64).abs(), "{} {}", wanted, off);
        } else {
            let got = to_f64(got, bits);
            let rounded = most * (1.0 + f64::EPSILON);
            let got_at = got.abs();
            prop_assert!(got_at <= rounded && got_at >= most - 2.0 * lsb, "{} {}", wanted, got);
            prop_assert!(got * wanted >= 0.0);
        }
    }
}

#[test]
fn what_is_no_number_is_the_end() {
    for x in [f64::INFINITY, f64::NAN, f64::MAX, 8.0] {
        assert_eq!(from_f64(x, ANGLE), i64::MAX);
        assert_eq!(from_f32(x as f32, ANGLE), i64::MAX);
    }
    assert_eq!(from_f64(-8.0, ANGLE), -i64::MAX);
    assert_eq!(from_f64(-0.0, ANGLE), 0);
    assert_eq!(from_f64(f64::MIN_POSITIVE, CURVATURE), 0);
}

/// A count of any size is taken: what it is worth is bounded.
#[test]
fn strange_counts_stay_bounded() {
    for lsb in [f64::MIN_POSITIVE, 1e-300, 1e-20, 1.0, 1e9, f64::MAX] {
        for (bits, most) in [(ANGLE, 2.0), (VELOCITY, 16_000.0)] {
            for sum in [i64::MIN, -(1 << 47), -1, 0, 1, 1 << 47, i64::MAX] {
                let got = to_f64(Scale::new(lsb, bits, most).of(sum), bits);
                assert!(got.abs() <= most, "{lsb:e} {sum}: {got}");
            }
        }
    }
}

/// The parts of the smallest, of usual and of the largest numbers are those of the library.
#[test]
fn parts_are_those_of_the_library() {
    let of_sizes = (-1074..1024).map(|exponent| libm::ldexp(1.3, exponent));
    for x in of_sizes.chain([f64::MIN_POSITIVE, f64::MAX, 1.0, 4.8e-8]) {
        if x.is_finite() {
            assert_eq!(parts(x), libm::frexp(x), "{x:e}");
        }
    }
}
