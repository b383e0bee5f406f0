//! The README of `lrnn-nostd` has the instructions that were measured.

/// The counts of `docs/figures/works.csv`.
const WORKS: &str = include_str!("../../../docs/figures/works.csv");
const README: &str = include_str!("../../../lrnn-nostd/README.md");

fn count(work: &str) -> f64 {
    let row = WORKS
        .lines()
        .find_map(|line| line.strip_prefix(work)?.strip_prefix(','));
    let row = row.unwrap_or_else(|| panic!("{work} is not measured"));
    row.parse().unwrap_or_else(|_| panic!("{work}: {row}"))
}

/// Each row of the table of activations: a value, and a step with six of them.
#[test]
fn the_activations_cost_what_was_measured() {
    for (row, name) in [
        ("[`Tanh`]", "tanh"),
        ("[`Rational`]", "rational"),
        ("[`Cubic`]", "cubic"),
        ("`MicroMath`", "micromath"),
    ] {
        let line = README
            .lines()
            .find_map(|line| line.strip_prefix(&format!("| {row} | ")));
        let line = line.unwrap_or_else(|| panic!("the table has no row {row}"));
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let measured = ["activation", "step"].map(|work| count(&format!("{work}_{name}")).round());
        assert_eq!(
            cells[1..3],
            measured.map(|count| count.to_string()),
            "{row}"
        );
    }
}
