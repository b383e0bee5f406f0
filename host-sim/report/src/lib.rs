//! Output of a run: the printed table, the JSON, and the HTML page with its pictures.
//!
//! Only the command line uses this crate, and `cargo xtask growth` its charts.

pub mod abuse;
pub mod allan;
pub mod campaign;
mod document;
mod drawn;
mod figures;
pub mod fleet;
mod front;
pub mod growth;
mod html;
pub mod json;
pub mod learnability;
pub mod page;
pub mod positions;
pub mod replay;
#[cfg(test)]
mod sample;
mod sensor_errors;
pub mod sessions;
pub mod standing;
pub mod start;
pub mod table;
mod terminal;
mod terms;
mod text;
pub mod unit;
pub mod verdict;
