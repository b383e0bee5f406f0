//! What a run leaves behind: the printed table, the JSON, and the self-contained HTML page with its pictures.
//!
//! Entry points: [`table::table`], [`json::json`], [`page::write`]; [`outcomes::write`] for replays.

pub mod allan;
mod allan_plot;
mod axes;
pub mod bounds;
mod canvas;
pub mod chart;
pub mod figures;
mod html;
pub mod json;
pub mod outcomes;
pub mod page;
mod palette;
mod panels;
#[cfg(test)]
mod sample;
mod sheet;
pub mod table;
