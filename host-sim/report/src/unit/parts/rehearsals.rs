//! Results of the device's rehearsals of each candidate, and the candidates that passed its gates.

use super::super::{Contents, Figure, Part, Table};
use super::{benches, case};
use crate::allan::figures;
use crate::axis::Axis;
use crate::chart::{Legend, Mark, Panel, Picture, WIDTH};
use crate::palette::{Look, numbered};
use firmware::learn::bank::{HYPOTHESES, NAMES, STORED, ZERO_CORRECTION};
use firmware::learn::rehearsal::{HORIZONS_S, of_100};
use host_lab::experiment::outcome::Bench;
use host_lab::learning::device::{Candidate, Diary};
use serde_json::{Value, json};

const TITLE: &str = "Rehearsals and gates";

pub(super) fn part(contents: &Contents) -> Part {
    let benches = match benches(contents) {
        Ok(benches) => benches,
        Err(why) => return Part::without("rehearsals", TITLE, why),
    };
    let mut part = Part::new("rehearsals", TITLE);
    part.sentences.push(
        "In a rehearsal the device navigates for some time as if it had no fixes, with each \
         candidate's correction and without any, and compares both with the next fix. A candidate \
         that wins so often that luck is no explanation has proved itself. The device stores it, and by \
         default it corrects from the next power-on on. One that loses \
         them does harm and is not stored."
            .into(),
    );
    let mut all = vec![];
    for (outcome, bench) in benches {
        let diary = &bench.diary;
        part.sentences
            .push(format!("{}: {}", case(outcome), in_force(bench)));
        part.sentences
            .push(format!("{}: {}", case(outcome), gates(diary)));
        part.tables.push(candidates(&case(outcome), diary));
        if !diary.entries.is_empty() {
            part.figures.push(Figure {
                name: "rehearsals",
                title: format!("Proof of each candidate: {}", case(outcome)),
                caption: "How near the proof of each candidate is, of 100.".into(),
                picture: picture(diary),
            });
        }
        part.sentences.extend(outcome.notes.iter().cloned());
        all.push(diary_as_data(&case(outcome), bench));
    }
    part.data = Value::Array(all);
    part
}

/// What is in force and what has proved itself, each since when, or what the device waits for.
pub(in super::super) fn in_force(bench: &Bench) -> String {
    let changes = &bench.diary.changes;
    let given_up = changes
        .iter()
        .filter(|(_, to)| *to == ZERO_CORRECTION)
        .count();
    let mut text = format!("in the learning part the device {}.", bench.course.says);
    if let Some((since, candidate)) = bench.diary.proved() {
        text += &format!(" \"{}\" is proved since {since} s.", NAMES[candidate]);
    }
    if given_up > 0 {
        text += &format!(" A candidate was given up again {given_up} time(s).");
    }
    text
}

fn gates(diary: &Diary) -> String {
    let [fixes, refused] = diary.fixes;
    let lengths = HORIZONS_S.iter().zip(&diary.rehearsals);
    let rehearsed: Vec<String> = lengths.map(|(s, n)| format!("{n} of {s} s")).collect();
    format!(
        "{fixes} fixes were compared with the navigator; of {refused} of them a component was \
         refused as an outlier, and {} came too late. Rehearsals: {}.",
        diary.late,
        rehearsed.join(", ")
    )
}

/// The candidates that take part. The stored one takes part only if something is stored.
fn shown(diary: &Diary) -> impl Iterator<Item = (usize, &Candidate)> {
    let each = diary.candidates.iter().enumerate();
    each.filter(|(h, of)| *h != ZERO_CORRECTION && (*h != STORED || of.proved || of.harms))
}

fn candidates(case: &str, diary: &Diary) -> Table {
    let last = diary.entries.last();
    let row = |(h, of): (usize, &Candidate)| {
        let capital = |of: Option<f32>| of.map_or("-".into(), |x| figures(f64::from(x)));
        let state = match (of.proved, of.harms) {
            (true, _) => "has proved itself",
            (_, true) => "does harm",
            _ => "not proved",
        };
        vec![
            NAMES[h].to_owned(),
            state.to_owned(),
            last.map_or("-".into(), |l| {
                format!("{} of 100", of_100(l.proof[h], of.proved))
            }),
            capital(last.map(|l| l.check[h])),
            match of.evidence.is_finite() {
                true => format!("{:+.1}", of.evidence),
                false => "-".into(),
            },
        ]
    };
    let head = [
        "candidate",
        "at the end",
        "proof",
        "left of the check, stakes",
        "log-likelihood against none",
    ];
    Table {
        caption: Some(case.to_owned()),
        head: head.map(String::from).to_vec(),
        rows: shown(diary).map(row).collect(),
        text: 2,
        ..Table::default()
    }
}

fn picture(diary: &Diary) -> Picture {
    let size = (WIDTH, 400.0);
    let t = |k: usize| diary.entries[k].t_s as f64 / 60.0;
    let look = |h: usize| Look {
        dash: [None, Some((9.0, 4.0)), Some((3.0, 3.0))][h / 4 % 3],
        ..numbered(h)
    };
    let drawn: Vec<usize> = shown(diary)
        .map(|(h, _)| h)
        .filter(|h| *h < HYPOTHESES)
        .collect();
    let line = |h: &usize| {
        let points = diary.entries.iter().enumerate();
        let points = points.map(|(k, e)| (t(k), f64::from(of_100(e.proof[*h], false))));
        Mark::Line(points.collect(), look(*h))
    };
    let (from, to) = (t(0), t(diary.entries.len() - 1).max(t(0) + 0.5));
    Picture {
        size,
        legends: vec![Legend {
            at: (76.0, 20.0),
            width: size.0 - 90.0,
            entries: drawn
                .iter()
                .map(|h| (NAMES[*h].to_owned(), look(*h)))
                .collect(),
        }],
        panels: vec![Panel {
            at: (76.0, 66.0),
            size: (size.0 - 100.0, size.1 - 118.0),
            title: Default::default(),
            x: Axis::linear("time, min", (from, to), 10),
            y: Axis::linear("proof, of 100", (0.0, 100.0), 10),
            marks: drawn.iter().map(line).collect(),
        }],
        notes: vec![],
    }
}

fn diary_as_data(case: &str, bench: &Bench) -> Value {
    let diary = &bench.diary;
    let candidates = diary.candidates.iter().enumerate();
    let candidates = candidates.map(|(h, of)| {
        json!({
            "name": NAMES[h], "proved": of.proved, "harms": of.harms, "evidence": of.evidence,
        })
    });
    json!({
        "case": case,
        "device": bench.course,
        "proved_since_s": diary.proved().map(|(since, _)| since),
        "changes": diary.changes.iter().map(|(t, h)| json!([t, NAMES[*h]])).collect::<Vec<_>>(),
        "candidates": candidates.collect::<Vec<_>>(),
        "rehearsals": HORIZONS_S.iter().zip(&diary.rehearsals).collect::<Vec<_>>(),
        "fixes": diary.fixes[0],
        "refused": diary.fixes[1],
        "late": diary.late,
    })
}
