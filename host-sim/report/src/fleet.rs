//! The table that `host-sim fleet` prints.

use super::terminal::fitted;
use super::text::counted;
use comfy_table::{Cell, CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use host_unit::networks::Input;
use host_unit::prior::{Prior, Triad};

/// Columns in the order in which they make room: what the network gains stays.
const ORDER: [usize; 5] = [6, 7, 5, 1, 4];

/// What was learnt of gyros and accelerometers, in at most `width` columns.
#[must_use]
pub fn table(prior: &Prior, width: usize) -> String {
    let mut table = Table::new();
    table.load_preset(UTF8_FULL_CONDENSED);
    let header = [
        "triad",
        "inputs",
        "network\nleaves, %",
        "linear\nlaw, %",
        "biases,\n%",
        "new at each\nturn-on",
        "output\nlayer",
        "its\nbiases",
    ];
    let aligned = |(column, text): (usize, String)| match column {
        0 | 1 => Cell::new(text),
        _ => Cell::new(text).set_alignment(CellAlignment::Right),
    };
    let header = header.iter().map(|name| (*name).to_owned());
    table.set_header(header.enumerate().map(aligned));
    for (name, unit, triad) in [
        ("gyros", "deg/h", &prior.gyro),
        ("accelerometers", "ug", &prior.accel),
    ] {
        table.add_row(row(name, unit, triad).into_iter().enumerate().map(aligned));
    }
    format!(
        "{}, {}\n{}\nleaves: of the errors' squares in the last drive of units \
         that were not learnt from; beside it a linear law of the same inputs, and biases\noutput layer and its biases: standard deviations, in the unit of \
         the turn-on",
        counted(prior.units, "unit"),
        counted(prior.drives, "drive"),
        fitted(table, width, ORDER)
    )
}

fn row(name: &str, unit: &str, triad: &Triad) -> [String; 8] {
    let [network, line, biases] = triad.left.map(|left| format!("{:.1}", 100.0 * left));
    let w = triad
        .sigma_w
        .map(|sigma| format!("{:.3}", sigma * triad.output));
    [
        name.to_owned(),
        triad.inputs.map(Input::name).join("\n"),
        network,
        line,
        biases,
        format!("{:.3} {unit}", triad.sigma_turn_on * triad.output),
        w.join("\n"),
        format!("{:.3}", triad.sigma_b * triad.output),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::terminal::is_within;
    use super::*;
    use host_unit::prior::Layer;

    #[test]
    fn every_width_has_what_the_network_leaves() {
        let layer = Layer {
            w: [[0.0; 3]; 3],
            r: [[0.0; 3]; 3],
            b: [0.0; 3],
        };
        let triad = Triad {
            inputs: [Input::Temperature, Input::TemperatureRate, Input::Vibration],
            input_offset: [0.0; 3],
            input_scale: [1.0; 3],
            output: 2.0,
            sigma_w: [0.5, 0.25, 0.125],
            sigma_b: 1.5,
            sigma_turn_on: 3.25,
            left: [0.123, 0.456, 0.789],
            mean_w: [[0.0; 3]; 3],
            mean_b: [0.0; 3],
            first: layer,
            second: layer,
        };
        let prior = Prior {
            units: 100,
            drives: 400,
            gyro: triad.clone(),
            accel: triad,
        };
        for width in [40, 80, 120] {
            let text = table(&prior, width);
            assert!(is_within(&text, "leaves: ", width), "{width}:\n{text}");
            for part in ["100 units", "accelerometers", "12.3", "45.6"] {
                assert!(text.contains(part), "{width}, {part}:\n{text}");
            }
        }
        assert!(table(&prior, 120).contains("6.500 deg/h"));
    }
}
