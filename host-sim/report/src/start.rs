//! The tables that `start` prints.

use super::terminal::fitted;
use comfy_table::{ContentArrangement, Table, presets::UTF8_FULL_CONDENSED};
use host_lab::campaign::start::{Goal, HEADS, Summary, row};

/// One table for the classes that should start and one for the traps.
#[must_use]
pub fn tables(summaries: &[Summary], width: usize) -> String {
    let mut out = String::from(
        "pairs: median / 95th percentile (median of what is claimed); 95 %: interval of the share that started (Clopper, Pearson);\n\
         silently wrong: off by more than 4 claimed standard deviations and 3 deg, at any second\n",
    );
    let titles = [
        (Goal::Start, "should start"),
        (Goal::Trap, "traps: better no start than a wrong one"),
    ];
    for (goal, title) in titles {
        let of: Vec<&Summary> = summaries.iter().filter(|s| s.goal == goal).collect();
        if of.is_empty() {
            continue;
        }
        let mut table = Table::new();
        table.load_preset(UTF8_FULL_CONDENSED);
        table.set_content_arrangement(ContentArrangement::Disabled);
        table.set_header(HEADS);
        for summary in of {
            table.add_row(row(summary));
        }
        out += &format!("\n{title}\n{}\n", fitted(table, width, []));
    }
    out
}
