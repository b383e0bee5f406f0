//! `cargo xtask growth`: how cost grows with samples per second, networks, weights, runs and cores.
//! It writes `docs/growth-*.svg` and the part of `docs/PERFORMANCE.md` between the markers. No
//! figure there is written by hand.

mod laws;
mod pictures;
mod scaling;
mod text;

use std::fs;
use std::process::ExitCode;

use anyhow::{Context, Result};
use qemu::budget::Budgets;
use qemu::count::{self, Counts};
use qemu::images::{GROWTH, workspace};
use qemu::machine::NETDUINOPLUS2;

use crate::times::{Times, host_times};
use crate::{markers, needs};
use scaling::Scaling;

/// The measurements; names are `rate/100`, `nets/4`, `weights/132`.
struct Measured {
    /// Instructions on the Cortex-M4F.
    target: Counts,
    /// Nanoseconds on this machine.
    host: Times,
    scaling: Scaling,
}

/// One measured piece of work of a kind.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    size: f64,
    instructions: f64,
    nanoseconds: f64,
}

impl Measured {
    /// All sizes of a kind, in rising order.
    fn points(&self, kind: &str) -> Result<Vec<Point>> {
        let sizes = self.target.iter().filter_map(|(name, &instructions)| {
            let (of, size) = name.split_once('/')?;
            (of == kind).then_some((name, size, instructions))
        });
        let mut points = sizes
            .map(|(name, size, instructions)| {
                let nanoseconds = self.host.get(name).copied();
                Ok(Point {
                    size: size.parse().with_context(|| name.clone())?,
                    instructions,
                    nanoseconds: nanoseconds
                        .with_context(|| format!("`{name}` was not measured on this machine"))?,
                })
            })
            .collect::<Result<Vec<_>>>()?;
        points.sort_by(|a, b| a.size.total_cmp(&b.size));
        anyhow::ensure!(points.len() > 2, "`{kind}`: only {points:?} was measured");
        Ok(points)
    }
}

/// Measures, draws, writes.
pub fn growth() -> Result<ExitCode> {
    needs::target()?;
    needs::emulator()?;
    eprintln!("[1/4] instructions on the target");
    let (known, target) = count::run(NETDUINOPLUS2, &GROWTH.build()?)?;
    known.check()?;
    eprintln!("[2/4] times on this machine");
    let host = host_times("vectors", "growth")?;
    eprintln!("[3/4] campaigns on one core and on more");
    let scaling = Scaling::measure()?;
    let measured = Measured {
        target,
        host,
        scaling,
    };
    eprintln!("[4/4] docs");
    let docs = workspace().join("docs");
    for (name, svg) in pictures::all(&measured)? {
        let path = docs.join(name);
        fs::write(&path, svg).with_context(|| path.display().to_string())?;
    }
    let part = text::part(&measured)?;
    markers::write("growth", &part)?;
    println!("{part}");
    within_budget(&measured)?;
    Ok(ExitCode::SUCCESS)
}

/// Checks that one more network, candidate and the like costs at most its budget.
fn within_budget(measured: &Measured) -> Result<()> {
    for (kind, budget) in Budgets::read()?.one_more {
        let more = text::one_more(&measured.points(&kind)?);
        let more = more.with_context(|| format!("`{kind}`: too few sizes"))?;
        anyhow::ensure!(
            more <= budget,
            "one more of `{kind}` costs {more:.0} instructions, and {budget:.0} are allowed"
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_of_one_kind_in_order_of_size_and_from_both_machines() {
        let both = |names: &[&str]| -> Counts {
            let named = names.iter().zip(1..);
            named
                .map(|(name, n)| ((*name).to_owned(), f64::from(n)))
                .collect()
        };
        let names = ["nets/16", "nets/2", "nets/1", "rate/3"];
        let mut measured = Measured {
            target: both(&names),
            host: both(&names),
            scaling: Scaling::default(),
        };
        let points = measured.points("nets").expect("all there");
        let sizes: Vec<f64> = points.iter().map(|point| point.size).collect();
        assert_eq!(sizes, [1.0, 2.0, 16.0]);
        assert_eq!((points[2].instructions, points[2].nanoseconds), (1.0, 1.0));
        assert!(measured.points("rate").is_err());
        measured.host.remove("nets/2");
        assert!(measured.points("nets").is_err());
    }
}
