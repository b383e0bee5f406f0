//! Output of a campaign: the tables that it prints, and its page.

mod forest;
mod groups;
mod page;
mod studies;
mod tables;
mod verdict;

pub use page::{Origin, document, verdict};
pub use tables::tables;

/// Time of the tables, min after the start of free-inertial navigation.
const T_MIN: u32 = 22;

/// A quotient of two errors, with two figures at least.
fn quotient(of: f64) -> String {
    match of {
        of if of > 0.0 && of < 0.0995 => {
            let digits = 1.0 - of.log10().floor();
            format!("{of:.*}", digits.min(9.0) as usize)
        }
        of if of < 9.95 => format!("{of:.2}"),
        of => format!("{of:.0}"),
    }
}

#[cfg(test)]
mod tests;
