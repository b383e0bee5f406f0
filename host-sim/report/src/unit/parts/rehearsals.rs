//! Results of the device's rehearsals of each candidate, and the candidates that passed its gates.

use super::super::{Contents, Figure, Part, Table};
use super::{benches, case};
use crate::allan::figures;
use crate::text::{counted, thousands};
use firmware::learn::bank::{HYPOTHESES, NAMES, ZERO_CORRECTION};
use firmware::learn::rehearsal::{HORIZONS_S, PROVED, of_100};
use host_chart::axis::Axis;
use host_chart::palette::{Look, numbered};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_estimation::learning::device::{Candidate, Diary, Entry};
use host_lab::experiment::outcome::Bench;
use serde_json::{Value, json};

const TITLE: &str = "Rehearsals and gates";

pub(super) fn part(contents: &Contents) -> Part {
    let benches = match benches(contents) {
        Ok(benches) => benches,
        Err(why) => return Part::without("rehearsals", TITLE, why),
    };
    let mut part = Part::new("rehearsals", TITLE);
    part.folded = true;
    part.explained.push(
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
                narrow: None,
            });
        }
        part.explained.extend(outcome.notes.iter().cloned());
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
        let times = counted(given_up as u64, "time");
        text += &format!(" A candidate was given up again {times}.");
    }
    text
}

fn gates(diary: &Diary) -> String {
    let [fixes, refused] = diary.fixes;
    let lengths = HORIZONS_S.iter().zip(&diary.rehearsals);
    let rehearsed: Vec<String> = lengths
        .map(|(s, n)| format!("{} of {s} s", thousands(*n)))
        .collect();
    format!(
        "{} were compared with the navigator; of {} of them a component was \
         refused as an outlier, and {} came too late. Rehearsals: {}.",
        match fixes {
            1 => "1 fix".to_owned(),
            fixes => format!("{} fixes", thousands(fixes)),
        },
        thousands(refused),
        thousands(diary.late),
        rehearsed.join(", ")
    )
}

/// The candidates that take part.
fn shown(diary: &Diary) -> impl Iterator<Item = (usize, &Candidate)> {
    let each = diary.candidates.iter().enumerate();
    each.filter(|(h, of)| *h != ZERO_CORRECTION && of.enabled)
}

/// The state of a candidate at the end, with the reason where it has not proved itself.
fn state(h: usize, of: &Candidate, last: Option<&Entry>) -> String {
    let proof = last.map_or(0.0, |last| last.proof[h]);
    match (of.proved, of.harms) {
        (true, _) => "has proved itself".into(),
        (_, true) => "does harm".into(),
        _ if proof < PROVED => {
            format!(
                "not proved: its bets have won {} of {PROVED} stakes",
                figures(proof.into())
            )
        }
        _ => "not proved: its bets won enough, but its check or the age of its proof forbids it"
            .into(),
    }
}

fn candidates(case: &str, diary: &Diary) -> Table {
    let last = diary.entries.last();
    let row = |(h, of): (usize, &Candidate)| {
        let capital = |of: Option<f32>| of.map_or("-".into(), |x| figures(f64::from(x)));
        vec![
            NAMES[h].to_owned(),
            state(h, of, last),
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
