//! The median of more numbers than memory should hold.

/// Number of bits found in one reading of the numbers.
const DIGIT: u32 = 16;

/// The number in the middle of `numbers`, in the order of [`f64::total_cmp`]; the upper one of two,
/// NaN of none. `numbers` is called five times and must give the same numbers each time.
///
/// Digit by digit from the highest, it counts how many numbers with the digits found so far have
/// each next one.
pub fn median<I: Iterator<Item = f64>>(numbers: impl Fn() -> I) -> f64 {
    let mut rank = numbers().count() / 2;
    let mut found = 0_u64;
    let mut shift = u64::BITS;
    while shift > 0 {
        shift -= DIGIT;
        let mut counts = vec![0_usize; 1 << DIGIT];
        let known = |key: u64| key.checked_shr(shift + DIGIT).unwrap_or(0) == found;
        for key in numbers().map(key).filter(|key| known(*key)) {
            counts[(key >> shift) as usize & ((1 << DIGIT) - 1)] += 1;
        }
        let Some(digit) = counts.iter().position(|count| {
            let here = rank < *count;
            rank -= if here { 0 } else { *count };
            here
        }) else {
            return f64::NAN;
        };
        found = found << DIGIT | digit as u64;
    }
    number(found)
}

const SIGN: u64 = 1 << 63;

/// A whole number for each number, in the same order.
fn key(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits & SIGN == 0 { bits | SIGN } else { !bits }
}

fn number(key: u64) -> f64 {
    f64::from_bits(if key & SIGN == 0 { !key } else { key ^ SIGN })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_middle_of_the_sorted_numbers(
            numbers in proptest::collection::vec(proptest::num::f64::ANY, 0..50),
            near in proptest::collection::vec(-3_i8..3, 0..50),
        ) {
            let near = near.into_iter().map(|x| 5e-3 + f64::from(x) * 1e-17).collect();
            for mut all in [numbers, near] {
                let got = median(|| all.iter().copied());
                all.sort_by(f64::total_cmp);
                match all.get(all.len() / 2) {
                    Some(want) => prop_assert_eq!(got.to_bits(), want.to_bits()),
                    None => prop_assert!(got.is_nan()),
                }
            }
        }
    }
}
