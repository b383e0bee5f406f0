//! Texts and numbers of a page.

use host_chart::axis::grouped;
pub(super) use host_core::words::{counted, thousands};
use maud::{Markup, html};

/// `text` with non-breaking hyphens, so that `ls-3x3` stays in one piece.
pub(super) fn unbroken(text: &str) -> String {
    text.replace('-', "\u{2011}")
}

/// A sentence on a page: what stands between backticks is set as code.
pub(super) fn prose(text: &str) -> Markup {
    let text = unbroken(text);
    html! {
        @for (k, part) in text.split('`').enumerate() {
            @if k % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

/// A number with its sign and `digits` decimals.
pub(super) fn signed(value: f64, digits: usize) -> String {
    let sign = if value.is_sign_negative() {
        "\u{2212}"
    } else {
        "+"
    };
    format!("{sign}{}", grouped(value.abs(), digits))
}

/// `text` with a capital first letter.
pub(super) fn capital(text: &str) -> String {
    let mut chars = text.chars();
    let first = chars.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + chars.as_str()
}
