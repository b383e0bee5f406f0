//! The device's estimates of the sensor errors, against time and temperature.

use super::super::{Contents, Figure, Part, Table};
use super::{benches, case};
use crate::allan::figures;
use crate::sensor_errors::sensor_errors;
use firmware::learn::bank::NAMES;
use host_chart::axis::{Axis, extent, widened};
use host_chart::palette::{Look, RNN, SOFT};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_core::inertial::units::{DEG_PER_H, UG};
use host_estimation::learning::device::{EVERY_S, Entry};
use host_lab::experiment::outcome::Bench;
use serde_json::{Value, json};

const TITLE: &str = "Learnt errors";
const AXES: [&str; 6] = [
    "gyro x", "gyro y", "gyro z", "accel x", "accel y", "accel z",
];
const BELIEF: Look = Look::solid(RNN, 2.2);
const BAND: Look = Look::dashed(SOFT, 1.0, (4.0, 3.0));
const BAND_95: f64 = 1.96;
const WIDER: &str = "Intervals of biases are wider than the device claims: tilts and rates from scale \
                     factors, misalignments and g-sensitivity of the unit file pass for biases, \
                     and its filter does not consider them.";
/// Largest time between an entry and the reading of its temperature, s.
const NEAR_S: f64 = 60.0;

/// Unit of an axis and its value in SI.
fn unit(axis: usize) -> (&'static str, f64) {
    if axis < 3 {
        ("deg/h", DEG_PER_H)
    } else {
        ("ug", UG)
    }
}

fn value(bench: &Bench, entry: &Entry, axis: usize) -> [f64; 2] {
    let estimate = f64::from(entry.estimate[axis]);
    [estimate, bench.sigma(entry, axis)].map(|x| x / unit(axis).1)
}

pub(super) fn part(contents: &Contents) -> Part {
    let benches = match benches(contents) {
        Ok(benches) => benches,
        Err(why) => return Part::without("learnt", TITLE, why),
    };
    let mut part = Part::new("learnt", TITLE);
    let (mut all, mut wider) = (vec![], false);
    for (outcome, bench) in benches {
        let entries = &bench.diary.entries;
        let Some(last) = entries.last() else {
            let why = "the device did not navigate in the learning part, so it believed nothing";
            part.sentences.push(format!("{}: {why}.", case(outcome)));
            continue;
        };
        part.tables.push(table(&case(outcome), bench, last));
        if (0..6).any(|axis| bench.sigma(last, axis) > f64::from(last.sigma[axis])) {
            wider = true;
        }
        part.figures.push(Figure {
            name: "learnt-time",
            title: format!("Learnt errors against time: {}", case(outcome)),
            caption: format!(
                "What the device's likeliest candidate that corrects anything believes, each \
                 {EVERY_S} s, with the 95 % interval of its biases. Each panel has its own scale."
            ),
            picture: over_time(bench),
            narrow: None,
        });
        match temperatures(contents, bench) {
            Ok(celsius) => part.figures.push(Figure {
                name: "learnt-temperature",
                title: format!("Learnt errors against temperature: {}", case(outcome)),
                caption: "The same values over the temperature of the sensor.".into(),
                picture: over_temperature(&celsius),
                narrow: None,
            }),
            Err(why) => {
                let text = format!("Against temperature: left out, because {why}.");
                if !part.sentences.contains(&text) {
                    part.sentences.push(text);
                }
            }
        }
        if !outcome.curves.traces.is_empty() {
            part.figures.push(Figure {
                name: "sensor-errors",
                title: format!("Networks of the desktop (rnn): {}", case(outcome)),
                caption: "Dots: errors that the teacher gave. Line: output of the networks. The \
                          true error of recorded data is unknown."
                    .into(),
                picture: sensor_errors(&outcome.curves.traces),
                narrow: None,
            });
        }
        all.push(entries_as_data(outcome.case.as_str(), bench));
    }
    if wider {
        part.sentences.push(WIDER.to_owned());
    }
    part.data = Value::Array(all);
    part
}

fn entries_as_data(case: &str, bench: &Bench) -> Value {
    let rows = bench.diary.entries.iter().map(|entry| {
        let values: Vec<[f64; 2]> = (0..6).map(|axis| value(bench, entry, axis)).collect();
        json!({ "t_s": entry.t_s, "error_and_sigma": values })
    });
    json!({
        "case": case,
        "axes": AXES,
        "units": (0..6).map(|axis| unit(axis).0).collect::<Vec<_>>(),
        "rows": rows.collect::<Vec<_>>(),
    })
}

fn table(case: &str, bench: &Bench, last: &Entry) -> Table {
    let proved = bench.diary.proved();
    let proved = proved.map_or("nothing".into(), |(_, of)| format!("\"{}\"", NAMES[of]));
    let row = |axis: usize| {
        let [error, sigma] = value(bench, last, axis);
        let half = BAND_95 * sigma;
        vec![
            AXES[axis].to_owned(),
            unit(axis).0.to_owned(),
            figures(error),
            format!("{} to {}", figures(error - half), figures(error + half)),
        ]
    };
    Table {
        caption: Some(format!(
            "{case}: believed after {} s by \"{}\". Proved: {}",
            last.t_s, NAMES[last.candidate], proved
        )),
        head: ["axis", "unit", "error", "95 % interval of the bias"]
            .map(String::from)
            .to_vec(),
        rows: (0..6).map(row).collect(),
        text: 2,
        ..Table::default()
    }
}

/// Six panels in two rows.
fn panels(panel: impl Fn(usize, (f64, f64), (f64, f64)) -> Panel) -> Picture {
    let size = (WIDTH, 560.0);
    let (column, row) = (size.0 / 3.0, (size.1 - 76.0) / 2.0);
    let at = |i: usize| ((i % 3) as f64 * column + 72.0, (i / 3) as f64 * row + 62.0);
    Picture {
        size,
        legends: vec![Legend {
            at: (66.0, 18.0),
            width: size.0 - 66.0,
            entries: vec![
                ("believed error".to_owned(), BELIEF),
                ("95 % interval".to_owned(), BAND),
            ],
        }],
        panels: (0..6)
            .map(|i| panel(i, at(i), (column - 88.0, row - 56.0)))
            .collect(),
        notes: vec![],
    }
}

fn over_time(bench: &Bench) -> Picture {
    let entries = &bench.diary.entries;
    let t: Vec<f64> = entries.iter().map(|e| e.t_s as f64 / 60.0).collect();
    let time = widened(extent(t.iter().copied()).unwrap_or_default(), 0.0);
    panels(|i, at, size| {
        let side = |sign: f64| {
            let y = entries
                .iter()
                .map(|e| value(bench, e, i))
                .map(|[x, s]| x + sign * BAND_95 * s);
            y.collect::<Vec<f64>>()
        };
        let [low, middle, high] = [-1.0, 0.0, 1.0].map(side);
        let all = low.iter().chain(&high).copied();
        Panel {
            at,
            size,
            title: [AXES[i].to_owned(), unit(i).0.to_owned()],
            x: Axis::linear(if i < 3 { "" } else { "time, min" }, time, 6),
            y: Axis::linear("", widened(extent(all).unwrap_or_default(), 0.05), 5),
            marks: vec![
                Mark::curve(&t, &low, BAND),
                Mark::curve(&t, &high, BAND),
                Mark::curve(&t, &middle, BELIEF),
            ],
        }
    })
}

/// Temperature at each entry, degrees C.
fn temperatures<'b>(
    contents: &Contents,
    bench: &'b Bench,
) -> Result<Vec<(f64, &'b Entry)>, String> {
    let readings = contents.temperatures.as_ref().map_err(Clone::clone)?;
    let near = |entry: &'b Entry| {
        let t = bench.begin_s + entry.t_s as f64;
        let next = readings.partition_point(|(at, _)| *at <= t);
        let (at, celsius) = readings.get(next.checked_sub(1)?)?;
        (t - at <= NEAR_S).then_some((*celsius, entry))
    };
    let found: Vec<_> = bench.diary.entries.iter().filter_map(near).collect();
    match found.is_empty() {
        true => Err("no reading of the thermometer falls into the learning part".into()),
        false => Ok(found),
    }
}

fn over_temperature(celsius: &[(f64, &Entry)]) -> Picture {
    let range = extent(celsius.iter().map(|(t, _)| *t)).unwrap_or_default();
    let range = widened(range, 0.03);
    let mut picture = panels(|i, at, size| {
        let dots: Vec<(f64, f64)> = celsius
            .iter()
            .map(|(t, e)| (*t, f64::from(e.estimate[i]) / unit(i).1))
            .collect();
        let ys = extent(dots.iter().map(|(_, y)| *y)).unwrap_or_default();
        Panel {
            at,
            size,
            title: [AXES[i].to_owned(), unit(i).0.to_owned()],
            x: Axis::linear(if i < 3 { "" } else { "temperature, \u{b0}C" }, range, 5),
            y: Axis::linear("", widened(ys, 0.05), 5),
            marks: vec![Mark::Dots(dots, 2.4, RNN)],
        }
    });
    for legend in &mut picture.legends {
        legend.entries.truncate(1);
        legend
            .entries
            .iter_mut()
            .for_each(|(_, look)| look.dash = Some((3.0, 3.0)));
    }
    picture
}
