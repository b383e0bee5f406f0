//! Counts of things in messages.

use std::fmt::Display;

/// A whole number with spaces between thousands from 10 000 on.
#[must_use]
pub fn thousands(number: impl Display) -> String {
    let digits = number.to_string();
    let grouped = digits.len() > 4;
    let mut out = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if grouped && k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push('\u{a0}');
        }
        out.push(digit);
    }
    out
}

/// A number of things: `1 fix`, `2 fixes`, `36 000 samples`.
#[must_use]
pub fn counted(number: impl Display, thing: &str) -> String {
    let number = thousands(number);
    let ending = match thing {
        _ if number == "1" => "",
        thing if thing.ends_with(['s', 'x']) => "es",
        _ => "s",
    };
    format!("{number} {thing}{ending}")
}

/// The verb after a number of things: `one` after 1, else `many`.
#[must_use]
pub fn agrees(number: usize, one: &'static str, many: &'static str) -> &'static str {
    if number == 1 { one } else { many }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_things() {
        let all = [0, 1, 2, 9999, 36_000, 1_234_567].map(|n| counted(n, "fix"));
        let wanted = [
            "0 fixes",
            "1 fix",
            "2 fixes",
            "9999 fixes",
            "36\u{a0}000 fixes",
            "1\u{a0}234\u{a0}567 fixes",
        ];
        assert_eq!(all, wanted);
        assert_eq!(counted(100_u64, "sample"), "100 samples");
        assert_eq!([1, 2].map(|n| agrees(n, "is", "are")), ["is", "are"]);
    }
}
