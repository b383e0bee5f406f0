//! Texts and numbers of a page.

/// `text` with non-breaking hyphens, so that `ls-3x3` stays in one piece.
pub(super) fn unbroken(text: &str) -> String {
    text.replace('-', "\u{2011}")
}

/// A number with its sign and `digits` decimals.
pub(super) fn signed(value: f64, digits: usize) -> String {
    format!("{value:+.digits$}").replace('-', "\u{2212}")
}
