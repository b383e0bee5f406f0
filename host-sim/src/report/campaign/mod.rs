//! What a campaign leaves: the tables that it prints, and its page.

mod forest;
mod groups;
mod page;
mod tables;
mod verdict;

pub use page::{Made, document};
pub use tables::tables;

/// Time of the tables, min after the start of free-inertial navigation.
const T_MIN: u32 = 22;

#[cfg(test)]
mod tests;
