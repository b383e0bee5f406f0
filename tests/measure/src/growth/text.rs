//! The tables, and their position in the document.

use std::fmt::Write;

use anyhow::{Context, Result};

use super::laws::Polynomial;
use super::pictures::CLOCK;
use super::{Measured, Point, scaling};
use crate::table::{markdown, thousands};

/// Equal things, of which only the cost of one more is shown.
const SEVERAL: [(&str, &str); 3] = [
    (
        "candidates",
        "hypothesis of 24 output weights that learns a fix",
    ),
    (
        "navigators",
        "navigator that shares nothing, a second of 200 samples",
    ),
    (
        "coasts",
        "coast of the rehearsals, a second of eight shadow navigators, with start and end",
    ),
];

/// All tables with their pictures.
pub fn part(measured: &Measured) -> Result<String> {
    let mut out = String::new();
    rates(&mut out, &measured.points("rate")?)?;
    nets(&mut out, &measured.points("nets")?)?;
    weights(&mut out, &measured.points("weights")?)?;
    out.push_str("**One more** costs on the Cortex-M4F:\n\n");
    for (kind, what) in SEVERAL {
        several(&mut out, &measured.points(kind)?, what)?;
    }
    out.push('\n');
    runs(&mut out, measured)?;
    drives(&mut out, measured)?;
    Ok(out)
}

fn picture(out: &mut String, name: &str, what: &str) -> Result<()> {
    writeln!(out, "\n![{what}](growth-{name}.svg)\n")?;
    Ok(())
}

fn rates(out: &mut String, points: &[Point]) -> Result<()> {
    writeln!(
        out,
        "**Samples per second**: compensator with two networks (one step per second) and \
         navigator, one second of data.\n"
    )?;
    let header = [
        "samples per second",
        "Cortex-M4F, instructions",
        "of 168 M",
        "desktop, us",
        "desktop, samples/s",
    ];
    let rows = points.iter().map(|p| {
        let (share, rate) = (100.0 * p.instructions / CLOCK, p.size * 1e9 / p.nanoseconds);
        vec![
            p.size.to_string(),
            thousands(p.instructions),
            format!("{share:.2} %"),
            format!("{:.1}", p.nanoseconds / 1e3),
            thousands(rate),
        ]
    });
    out.push_str(&markdown(&header.map(str::to_owned), rows));
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p.size, p.instructions)).unzip();
    if let Some(fit) = Polynomial::fit(1, &x, &y) {
        writeln!(
            out,
            "\nOn the target: {} per second and {:.0} per sample, to {:.1} %.",
            thousands(fit.0[0]),
            fit.0[1],
            100.0 * fit.worst(&x, &y)
        )?;
    }
    picture(
        out,
        "rate",
        "cost of a second of data against samples per second",
    )
}

fn nets(out: &mut String, points: &[Point]) -> Result<()> {
    writeln!(
        out,
        "**Networks**: step, exact gradient and descent of all networks.\n"
    )?;
    let header = [
        "networks",
        "Cortex-M4F, instructions",
        "per network",
        "desktop, ns",
        "per network",
        "desktop, steps/s",
    ];
    let rows = points.iter().map(|p| {
        vec![
            p.size.to_string(),
            thousands(p.instructions),
            format!("{:.0}", p.instructions / p.size),
            thousands(p.nanoseconds),
            format!("{:.0}", p.nanoseconds / p.size),
            thousands(p.size * 1e9 / p.nanoseconds),
        ]
    });
    out.push_str(&markdown(&header.map(str::to_owned), rows));
    picture(out, "nets", "cost against networks")
}

fn weights(out: &mut String, points: &[Point]) -> Result<()> {
    writeln!(
        out,
        "**Weights**: one fix learnt by a hypothesis of n parameters: none, six biases, output \
         weights, weights with diagonal feedback, all weights.\n"
    )?;
    let header = [
        "n",
        "Cortex-M4F, instructions",
        "desktop, us",
        "desktop, fixes/s",
    ];
    let rows = points.iter().map(|p| {
        vec![
            p.size.to_string(),
            thousands(p.instructions),
            format!("{:.2}", p.nanoseconds / 1e3),
            thousands(1e9 / p.nanoseconds),
        ]
    });
    out.push_str(&markdown(&header.map(str::to_owned), rows));
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p.size, p.instructions)).unzip();
    if let Some(fit) = Polynomial::fit(2, &x, &y) {
        let most = x.iter().copied().fold(0.0, f64::max);
        writeln!(
            out,
            "\nOn the target {} + {:.0} n + {:.1} n^2, to {:.0} %; at n = {most} the square is \
             {:.0} % of the total.",
            thousands(fit.0[0]),
            fit.0[1],
            fit.0[2],
            100.0 * fit.worst(&x, &y),
            100.0 * fit.top_share(most)
        )?;
    }
    picture(out, "weights", "cost of a fix against parameters")
}

/// What one more of several equal things costs.
fn several(out: &mut String, points: &[Point], what: &str) -> Result<()> {
    let more = one_more(points).context("too few sizes")?;
    writeln!(out, "- {what}: {} instructions.", thousands(more))?;
    Ok(())
}

/// Cost of one more on the target, instructions.
pub fn one_more(points: &[Point]) -> Option<f64> {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p.size, p.instructions)).unzip();
    Polynomial::fit(1, &x, &y)?.0.get(1).copied()
}

fn drives(out: &mut String, measured: &Measured) -> Result<()> {
    writeln!(
        out,
        "**Drives**: the same campaign of {} runs with earlier drives of each unit, one job.\n",
        scaling::DRIVES_RUNS
    )?;
    let header = ["earlier drives", "from start to exit, s", "processor, s"];
    let rows = measured.scaling.drives.iter().map(|cell| {
        let cpu = cell
            .cpu
            .map_or("unknown".to_owned(), |cpu| format!("{cpu:.2}"));
        vec![cell.drives.to_string(), format!("{:.2}", cell.wall), cpu]
    });
    out.push_str(&markdown(&header.map(str::to_owned), rows));
    out.push('\n');
    Ok(())
}

fn runs(out: &mut String, measured: &Measured) -> Result<()> {
    let scaling = &measured.scaling;
    let jobs = scaling.jobs();
    writeln!(
        out,
        "**Runs and cores**: a campaign of one group of errors and noise with nine schemes whose \
         filters are already tuned. Seconds from start to exit, without the time that threads \
         waited for a core (in brackets: processor time of all threads); medians of campaigns in \
         turn.\n"
    )?;
    let number = |jobs: &usize| format!("{jobs} job{}", if *jobs == 1 { "" } else { "s" });
    let header: Vec<_> = ["runs".to_owned()]
        .into_iter()
        .chain(jobs.iter().map(number))
        .collect();
    let rows = scaling.with(1).map(|one| {
        let cells = scaling.cells.iter().filter(|cell| cell.runs == one.runs);
        let times = cells.map(|cell| {
            let cpu = cell.cpu.map(|cpu| format!(" ({cpu:.2})"));
            format!("{:.2}{}", cell.wall, cpu.unwrap_or_default())
        });
        [one.runs.to_string()].into_iter().chain(times).collect()
    });
    out.push_str(&markdown(&header, rows));
    let [free, [least, median, most]] = scaling.ratio;
    if scaling.cores > 1 {
        writeln!(
            out,
            "\nTime with one job over time with {} jobs, in pairs, longest campaign: {:.2} \
             ({:.2} .. {:.2}); including the waiting {median:.2} ({least:.2} .. {most:.2}).",
            scaling.cores, free[1], free[0], free[2]
        )?;
    }
    picture(out, "runs", "time of a campaign against runs and cores")
}
