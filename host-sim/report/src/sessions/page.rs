//! The page of several sessions of one unit.

use super::{counted_sessions, figure, median, of_phase, schemes};
use crate::document::{Document, Figure, Part, Table};
use crate::front::{Each, Front, SIZES, three};
use crate::text::{capital, counted, thousands};
use crate::verdict::{Device, Effect, Several, times, waits};
use host_chart::axis::{Axis, extent, widened};
use host_chart::palette::{Look, RNN, SOFT, scheme as look};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_lab::experiment::sessions::{Judged, PHASES, Row, shared};
use serde_json::json;

/// Schemes in the pictures.
const DRAWN: [&str; 6] = [
    "uncorrected",
    "rest",
    "ekf6",
    "ekf6-memory",
    "ekf24-memory",
    "device",
];
const AXES: [(&str, &str); 6] = [
    ("gyro x", "deg/s"),
    ("gyro y", "deg/s"),
    ("gyro z", "deg/s"),
    ("accel x", "m/s2"),
    ("accel y", "m/s2"),
    ("accel z", "m/s2"),
];
const BAND_95: f64 = 1.96;

/// The page. `unit`: its name; `start`: where coasts start.
#[must_use]
pub fn document(unit: &str, sessions: &[Judged], start: &str) -> Document {
    let rows: Vec<&Row> = sessions.iter().flat_map(|of| &of.rows).collect();
    let mut parts = vec![course(sessions)];
    parts.extend(PHASES.iter().filter_map(|phase| part(&rows, phase, start)));
    parts.push(remembered(sessions));
    Document {
        title: format!(
            "{unit}: {}, each from power-on",
            counted(sessions.len() as u64, "session")
        ),
        verdict: verdict(sessions),
        front: front(&rows, sessions),
        parts,
        ..Document::default()
    }
}

/// The phase of the verdict, and its longest time without fixes, s: power-on if it is there.
fn main_phase(rows: &[&Row]) -> Option<(&'static str, f64)> {
    let mut each = PHASES
        .iter()
        .filter_map(|phase| Some((*phase, longest(rows, phase)?)));
    each.next()
}

fn longest(rows: &[&Row], phase: &str) -> Option<f64> {
    let of = rows.iter().filter(|row| row.phase == phase);
    of.map(|row| row.horizon_s).reduce(f64::max)
}

/// The device in a phase.
fn device(rows: &[&Row], sessions: &[Judged], phase: &str, horizon: f64) -> Option<Device> {
    let metres = ["device", "uncorrected"].map(|scheme| median(rows, phase, scheme, horizon));
    let [with, without] = metres;
    let of = |scheme: &str, session: usize| {
        let mut all = rows
            .iter()
            .filter(|row| row.phase == phase && row.horizon_s == horizon);
        let row = all.find(|row| row.scheme == scheme && row.session == session)?;
        Some(row.median_m)
    };
    let ratios = sessions.iter().filter_map(|session| {
        Some(of("device", session.session)? / of("uncorrected", session.session)?)
    });
    let mut ratios: Vec<f64> = ratios.collect();
    ratios.sort_by(f64::total_cmp);
    let (least, most) = (*ratios.first()?, *ratios.last()?);
    let worse = ratios.iter().filter(|ratio| **ratio > 1.02).count();
    let ratio = ratios[ratios.len() / 2];
    let nothing = ratios.iter().all(|ratio| (ratio - 1.0).abs() < 1e-3);
    let course = sessions.last().map(|session| &session.device);
    Some(Device {
        after: format!("after {horizon} s without fixes ({})", meaning(phase)),
        metres: [with?, without?],
        several: Some(Several {
            ratio,
            between: format!(
                "median of {}, {} to {}, worse in {worse}",
                counted(ratios.len() as u64, "session"),
                times(least),
                times(most)
            ),
            decided: match ratio {
                r if r > 1.02 => Effect::Harms,
                r if r < 0.98 => Effect::Helps,
                _ => Effect::Open,
            },
        }),
        waits: nothing.then(|| waits(course)),
        earlier: vec![],
    })
}

/// A phase in words.
fn meaning(phase: &str) -> String {
    match phase {
        "power-on" => "from power-on".to_owned(),
        "end" => "at the end of the session, after all fixes".to_owned(),
        other => format!("after fixes for {} s", other.trim_start_matches("fixes-")),
    }
}

/// The verdict: the sentence on the device at power-on, then the other phases.
#[must_use]
pub fn verdict(sessions: &[Judged]) -> Vec<String> {
    let rows: Vec<&Row> = sessions.iter().flat_map(|of| &of.rows).collect();
    let main = main_phase(&rows).and_then(|(phase, s)| device(&rows, sessions, phase, s));
    let Some(main) = main else {
        return vec!["Verdict: no session is long enough to say what the device does.".to_owned()];
    };
    let others = PHASES.iter().skip(1).filter_map(|phase| {
        let horizon = longest(&rows, phase)?;
        let [with, without] =
            ["device", "uncorrected"].map(|scheme| median(&rows, phase, scheme, horizon));
        Some(format!(
            "{}: {} m with the device after {horizon} s without fixes, {} m without the device.",
            capital(&meaning(phase)),
            figure(with?),
            figure(without?)
        ))
    });
    std::iter::once(main.sentence()).chain(others).collect()
}

/// The first screen: the error of each session at power-on.
fn front(rows: &[&Row], sessions: &[Judged]) -> Option<Front> {
    let (phase, horizon) = main_phase(rows)?;
    let device = device(rows, sessions, phase, horizon)?;
    let curve = |scheme: &'static str| {
        let own = rows
            .iter()
            .filter(|row| row.phase == phase && row.scheme == scheme && row.horizon_s == horizon);
        (
            scheme,
            own.map(|row| (row.session as f64, row.median_m))
                .collect::<Vec<_>>(),
        )
    };
    let curves = DRAWN
        .map(curve)
        .into_iter()
        .filter(|(_, points)| !points.is_empty());
    let each = Each {
        of: "session",
        highlit: ["device", "uncorrected"],
        curves: curves.collect(),
    };
    let nearest = sessions.last().and_then(|of| of.device.nearest.as_ref());
    Some(Front {
        title: format!(
            "Error of each session after {horizon} s without fixes, {}",
            meaning(phase)
        ),
        pictures: SIZES.map(|size| each.picture(size)),
        figures: three(&device, nearest.map(|of| of.proof)),
    })
}

/// What the device did in each session.
fn course(sessions: &[Judged]) -> Part {
    let row = |of: &Judged| {
        vec![
            format!("{}: {}", of.session, of.name),
            format!("the device {}. {}", of.device.says, of.notes.join(" ")),
            thousands(of.duration_s.round() as u64),
            format!("{:.2}", of.residual),
            thousands(of.device.fixes[0]),
        ]
    };
    Part {
        tables: vec![Table {
            head: [
                "session",
                "the device, with all fixes",
                "duration, s",
                "residual",
                "fixes",
            ]
            .map(String::from)
            .to_vec(),
            rows: sessions.iter().map(row).collect(),
            text: 2,
            ..Table::default()
        }],
        explained: vec![
            "Residual: how far fixes and samples contradict each other, where 1 is expected; below \
             1 the fixes are better than they say."
                .into(),
        ],
        data: json!(sessions),
        ..Part::new("sessions", "What the device did")
    }
}

/// A phase: medians over the sessions, and each session.
fn part(rows: &[&Row], phase: &str, start: &str) -> Option<Part> {
    let of: Vec<&Row> = of_phase(rows, phase);
    let longest = of.iter().map(|row| row.horizon_s).reduce(f64::max)?;
    let compared = shared(&of);
    let horizons = super::horizons(&compared);
    let head = std::iter::once("scheme".to_owned());
    let head = head.chain(horizons.iter().map(|h| format!("{h} s")));
    let line = |scheme: &&str| {
        let cells = horizons
            .iter()
            .map(|h| median(&compared, phase, scheme, *h).map_or("-".into(), figure));
        std::iter::once((*scheme).to_owned()).chain(cells).collect()
    };
    let means = match phase {
        "power-on" => "No scheme has had a fix in the session.".to_owned(),
        "end" => {
            "All fixes until the coast begins, one coast at the end of each session.".to_owned()
        }
        _ => format!(
            "The schemes had fixes for the first {} s of the session and no more.",
            phase.trim_start_matches("fixes-")
        ),
    };
    Some(Part {
        explained: vec![means, start.to_owned()],
        figures: vec![Figure {
            name: "sessions",
            title: format!("Error after {longest} s without fixes, {}", meaning(phase)),
            caption: "Median over the coasts of each session.".into(),
            picture: over_sessions(&of, longest),
            narrow: None,
        }],
        tables: vec![Table {
            caption: Some(
                "Error, m: median over the sessions of the median of each; only sessions that all \
                 schemes have"
                    .into(),
            ),
            head: head.collect(),
            rows: schemes(&compared)
                .iter()
                .map(line)
                .chain([counted_sessions(&compared, &horizons)])
                .collect(),
            text: 1,
            ..Table::default()
        }],
        ..Part::new(phase, &format!("Errors {}", meaning(phase)))
    })
}

/// The error of each session.
fn over_sessions(rows: &[&Row], horizon: f64) -> Picture {
    let size = (WIDTH, 380.0);
    let curve = |scheme: &str| -> Vec<(f64, f64)> {
        rows.iter()
            .filter(|row| row.scheme == scheme && row.horizon_s == horizon)
            .map(|row| (row.session as f64, row.median_m.max(1e-3)))
            .collect()
    };
    let curves: Vec<(&str, Vec<(f64, f64)>)> = DRAWN
        .iter()
        .map(|scheme| (*scheme, curve(scheme)))
        .filter(|(_, points)| !points.is_empty())
        .collect();
    let all = || curves.iter().flat_map(|(_, points)| points);
    let (Some(x), Some((low, high))) = (
        extent(all().map(|(x, _)| *x)),
        extent(all().map(|(_, y)| *y)),
    ) else {
        return Picture::without_data(size, "no session is long enough");
    };
    Picture {
        size,
        legends: vec![Legend {
            at: (66.0, 18.0),
            width: size.0 - 66.0,
            entries: curves
                .iter()
                .map(|(scheme, _)| ((*scheme).to_owned(), drawn(scheme)))
                .collect(),
        }],
        panels: vec![Panel {
            at: (80.0, 62.0),
            size: (size.0 - 100.0, size.1 - 116.0),
            title: ["horizontal error".into(), "m".into()],
            x: Axis::whole("session", x),
            y: Axis::log("", (low / 1.5, high * 1.5)),
            marks: curves
                .into_iter()
                .flat_map(|(scheme, points)| {
                    let look = drawn(scheme);
                    [
                        Mark::Dots(points.clone(), 3.0, look.colour),
                        Mark::Line(points, look),
                    ]
                })
                .collect(),
        }],
        notes: vec![],
    }
}

fn drawn(scheme: &str) -> Look {
    look(match scheme {
        "uncorrected" => "raw",
        "rest" => "ls-bias",
        "ekf6-memory" => "rnn",
        "ekf24-memory" => "ekf24",
        "device" => "device-4",
        other => other,
    })
}

/// What `ekf6-memory` knows of the unit after each session.
fn remembered(sessions: &[Judged]) -> Part {
    let title = "What is remembered of the unit";
    let known: Vec<(f64, &[f64; 6], &[f64; 6])> = sessions
        .iter()
        .filter_map(|of| {
            let remembered = of.remembered.as_ref()?;
            Some((of.session as f64, &remembered.mean, &remembered.sigma))
        })
        .collect();
    if known.is_empty() {
        return Part::without("remembered", title, "no session had fixes");
    }
    let panel = |axis: usize, at: (f64, f64), size: (f64, f64)| {
        let x: Vec<f64> = known.iter().map(|(session, ..)| *session).collect();
        let bound = |sign: f64| -> Vec<f64> {
            let of = known.iter();
            of.map(|(_, mean, sigma)| mean[axis] + sign * BAND_95 * sigma[axis])
                .collect()
        };
        let [low, mean, high] = [-1.0, 0.0, 1.0].map(bound);
        let (first, last) = extent(x.iter().copied()).unwrap_or_default();
        let range = extent(low.iter().chain(&high).copied()).unwrap_or_default();
        let band = Look::dashed(SOFT, 1.0, (4.0, 3.0));
        Panel {
            at,
            size,
            title: [AXES[axis].0.to_owned(), AXES[axis].1.to_owned()],
            x: Axis::linear(
                if axis < 3 { "" } else { "session" },
                (first - 0.5, last + 0.5),
                8,
            ),
            y: Axis::linear("", widened(range, 0.06), 6),
            marks: vec![
                Mark::curve(&x, &low, band),
                Mark::curve(&x, &high, band),
                Mark::curve(&x, &mean, Look::solid(RNN, 2.0)),
            ],
        }
    };
    let size = (WIDTH, 560.0);
    let (column, row) = (size.0 / 3.0, (size.1 - 76.0) / 2.0);
    let at = |i: usize| ((i % 3) as f64 * column + 72.0, (i / 3) as f64 * row + 62.0);
    Part {
        figures: vec![Figure {
            name: "remembered",
            title: "Biases of the unit after each session".into(),
            caption: "Mean and 95 % interval of the unit's own part of each bias, as ekf6-memory \
                      knows it, as wide as scale factors, misalignments and g-sensitivity of the \
                      unit file make it. What is new at every power-on is not in it."
                .into(),
            narrow: None,
            picture: Picture {
                size,
                panels: (0..6)
                    .map(|i| panel(i, at(i), (column - 88.0, row - 52.0)))
                    .collect(),
                ..Picture::default()
            },
        }],
        ..Part::new("remembered", title)
    }
}
