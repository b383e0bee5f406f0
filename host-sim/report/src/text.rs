//! How texts and numbers are written on a page.

/// `text` with hyphens that no line breaks at, so that `ls-3x3` stays in one piece.
pub(super) fn unbroken(text: &str) -> String {
    text.replace('-', "\u{2011}")
}

/// A number with its sign and `digits` decimals.
pub(super) fn signed(value: f64, digits: usize) -> String {
    format!("{value:+.digits$}").replace('-', "\u{2212}")
}
