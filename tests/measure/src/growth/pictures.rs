//! The curves.

use anyhow::Result;
use host_lab::experiment::results::Curve;
use host_report::growth::{self, Panel};

use super::laws::Polynomial;
use super::scaling::SAMPLES;
use super::{Measured, Point};

/// Processor clock of the STM32F405, Hz; one instruction per cycle would be the best case.
pub const CLOCK: f64 = 168e6;

type Pick = fn(&Point) -> f64;

/// File name and content of each.
pub fn all(measured: &Measured) -> Result<Vec<(&'static str, String)>> {
    let rate = measured.points("rate")?;
    let nets = measured.points("nets")?;
    let weights = measured.points("weights")?;
    let rate_axis = "samples per second";
    let [first, last] = [&rate[0], &rate[rate.len() - 1]].map(|point| point.size);
    let rates = vec![
        panel(
            "Cortex-M4F: a second of data",
            [rate_axis, "instructions"],
            vec![curve("measured", &rate, |p| p.instructions)],
            vec![named("168 MHz", &[(first, CLOCK), (last, CLOCK)])],
        ),
        panel(
            "this desktop, one core",
            [rate_axis, "samples navigated per second"],
            vec![curve("measured", &rate, |p| p.size * 1e9 / p.nanoseconds)],
            vec![],
        ),
    ];
    let many = vec![
        panel(
            "Cortex-M4F: step, gradient, descent",
            ["networks", "instructions"],
            vec![curve("measured", &nets, |p| p.instructions)],
            vec![proportional(&nets, |p| p.instructions)],
        ),
        panel(
            "this desktop, one core",
            ["networks", "ns"],
            vec![curve("measured", &nets, |p| p.nanoseconds)],
            vec![proportional(&nets, |p| p.nanoseconds)],
        ),
    ];
    let fixes = vec![
        panel(
            "Cortex-M4F: a fix learnt from",
            ["parameters n", "instructions"],
            vec![curve("measured", &weights, |p| p.instructions)],
            parabola(&weights, |p| p.instructions),
        ),
        panel(
            "this desktop, one core",
            ["parameters n", "ns"],
            vec![curve("measured", &weights, |p| p.nanoseconds)],
            parabola(&weights, |p| p.nanoseconds),
        ),
    ];
    let title = "Cost against";
    let draw = |name: &'static str, what: &str, panels: &[Panel]| -> Result<_> {
        let svg = growth::svg(panels, name, &format!("{title} {what}"))?;
        Ok((name, svg))
    };
    Ok(vec![
        draw("growth-rate.svg", "samples per second", &rates)?,
        draw("growth-nets.svg", "networks", &many)?,
        draw("growth-weights.svg", "parameters of a fix", &fixes)?,
        draw("growth-runs.svg", "runs and cores", &runs(measured))?,
    ])
}

/// A campaign's time and rate by runs, one curve for each number of jobs.
fn runs(measured: &Measured) -> Vec<Panel> {
    let scaling = &measured.scaling;
    let by = |value: fn(u32, f64) -> f64| -> Vec<Curve> {
        let jobs = scaling.jobs().into_iter();
        jobs.map(|jobs| {
            let cells: Vec<_> = scaling.with(jobs).collect();
            let points: Vec<(f64, f64)> = cells
                .iter()
                .map(|cell| (f64::from(cell.runs), value(cell.runs, cell.wall)))
                .collect();
            let plural = if jobs == 1 { "" } else { "s" };
            named(&format!("{jobs} core{plural}"), &points)
        })
        .collect()
    };
    vec![
        panel(
            "campaign, from start to exit",
            ["runs", "s"],
            by(|_, wall| wall),
            vec![],
        ),
        panel(
            "simulated and judged by nine schemes",
            ["runs", "samples per second"],
            by(|runs, wall| SAMPLES * f64::from(runs) / wall),
            vec![],
        ),
    ]
}

fn panel(title: &str, axes: [&str; 2], measured: Vec<Curve>, laws: Vec<Curve>) -> Panel {
    Panel {
        title: title.to_owned(),
        axes: axes.map(str::to_owned),
        measured,
        laws,
    }
}

fn named(name: &str, points: &[(f64, f64)]) -> Curve {
    let (x, y) = points.iter().copied().unzip();
    let name = name.to_owned();
    Curve { name, x, y }
}

fn curve(name: &str, points: &[Point], pick: Pick) -> Curve {
    let values: Vec<_> = points.iter().map(|p| (p.size, pick(p))).collect();
    named(name, &values)
}

/// A straight line through the first point and the origin.
fn proportional(points: &[Point], pick: Pick) -> Curve {
    let each = pick(&points[0]) / points[0].size;
    let line: Vec<_> = points.iter().map(|p| (p.size, each * p.size)).collect();
    named("n times one", &line)
}

/// The fitted parabola, and its quadratic term alone.
fn parabola(points: &[Point], pick: Pick) -> Vec<Curve> {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p.size, pick(p))).unzip();
    let Some(fit) = Polynomial::fit(2, &x, &y) else {
        return vec![];
    };
    let most = x.iter().copied().fold(1.0, f64::max);
    let fine: Vec<f64> = (0..=40)
        .map(|k| most.powf(1.0 - f64::from(k) / 40.0))
        .collect();
    let least = y.iter().copied().fold(f64::INFINITY, f64::min);
    let line = |of: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        let points = fine.iter().rev().map(|&n| (n, of(n)));
        points.filter(|(_, y)| *y >= 0.3 * least).collect()
    };
    vec![
        named("a + b n + c n\u{b2}", &line(&|n| fit.at(n))),
        named("c n\u{b2}", &line(&|n| fit.top_share(n) * fit.at(n))),
    ]
}
