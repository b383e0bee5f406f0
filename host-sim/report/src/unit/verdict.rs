//! The verdict of the report, harm first.

use super::parts::device::name;
use super::parts::{halved, in_force};
use super::{Contents, Readout};
use crate::allan::against;
use crate::text::{counted, thousands};
use crate::verdict::{Compared, of_outcomes};

/// All sentences. The first is the shortest answer.
pub(super) fn sentences(contents: &Contents) -> Vec<String> {
    let mut out = vec![];
    if contents.unit_name.is_none() {
        out.push(
            "No unit was given, so the datasheet of a preset is assumed: what is said against it \
             means little."
                .to_owned(),
        );
    }
    match (&contents.outcomes, &contents.device) {
        (Ok(outcomes), _) => {
            let Compared { headline, others } = of_outcomes(outcomes);
            out.insert(0, headline);
            out.extend(others);
            for outcome in outcomes {
                if let Some(bench) = &outcome.bench {
                    out.push(format!("Device, {}: {}", outcome.case, in_force(bench)));
                }
            }
        }
        (Err(_), Some(device)) => drop(out.splice(0..0, of_device(device))),
        (Err(why), None) => out.insert(
            0,
            format!(
                "Verdict: whether a correction helps or does harm is not known, because {why}."
            ),
        ),
    }
    if let Ok(findings) = &contents.noise {
        out.extend(against(findings));
    }
    if let Ok(answer) = &contents.learnable {
        out.extend(halved(answer));
    }
    out
}

/// The verdict on a device by the state that it reports.
fn of_device(readout: &Readout) -> Vec<String> {
    let (info, learner) = (&readout.info, &readout.info.learner);
    let faults: Vec<&str> = readout.faults.iter().map(|fault| fault.name).collect();
    let mut out = vec![];
    out.push(match (info.configured, faults.is_empty()) {
        (false, _) => "Verdict: the device has no configuration and corrects nothing.".to_owned(),
        (true, true) => "Verdict: the device reports no fault.".to_owned(),
        (true, false) => format!("Verdict: the device reports faults: {}.", faults.join(", ")),
    });
    out.push(match learner.winner {
        0 => "No candidate is in force: what is learnt in this drive corrects nothing.".to_owned(),
        winner => format!("The candidate in force is \"{}\".", name(winner)),
    });
    if learner.rollbacks > 0 {
        out.push(format!(
            "Since power-on a candidate was given up {}, because it did harm or lost its proof.",
            counted(learner.rollbacks, "time")
        ));
    }
    out.push(
        "A device does not know how far navigation gets with its correction and without: make a \
         report from a recording."
            .into(),
    );
    out
}

/// The figures of the first screen where no error without fixes is known.
pub(super) fn figures(contents: &Contents) -> Vec<(String, String)> {
    let Some(Readout { info, .. }) = &contents.device else {
        return vec![];
    };
    let learner = &info.learner;
    vec![
        (
            thousands(learner.used_fixes),
            "fixes used since power-on".into(),
        ),
        (
            thousands(learner.promotions),
            "corrections that have proved themselves".into(),
        ),
        (thousands(info.memory.drives), "drives remembered".into()),
    ]
}
