//! The table of activations: error, instructions, time.

use anyhow::Result;
use comfy_table::Table;
use lrnn_nostd::{Activation, Cubic, MicroMath, Rational, Tanh};
use qemu::count::Counts;
use serde::Serialize;

use super::{Times, named};
use crate::table::numbers;

/// One activation, in the `--json` format.
#[derive(Serialize)]
pub(super) struct Row {
    name: &'static str,
    /// Largest difference from tanh over every 61st positive f32 below 10.
    error: f64,
    /// One activation, and a step with six of them, on the Cortex-M4F.
    instructions: f64,
    step_instructions: f64,
    /// The same step on this machine.
    step_ns: f64,
}

pub(super) fn rows(counts: &Counts, times: &Times) -> Result<Vec<Row>> {
    let row = |name, error| -> Result<Row> {
        let step = format!("step_{name}");
        Ok(Row {
            name,
            error,
            instructions: named(counts, &format!("activation_{name}"))?,
            step_instructions: named(counts, &step)?,
            step_ns: named(times, &step)?,
        })
    };
    Ok(vec![
        row("rational", error::<Rational>())?,
        row("cubic", error::<Cubic>())?,
        row("tanh", error::<Tanh>())?,
        row("micromath", error::<MicroMath>())?,
    ])
}

pub(super) fn table(counts: &Counts, times: &Times) -> Result<Table> {
    let mut table = numbers([
        "activation",
        "largest error",
        "instructions",
        "step with six",
        "step, ns",
    ]);
    for row in rows(counts, times)? {
        table.add_row([
            row.name.to_owned(),
            format!("{:.2e}", row.error),
            format!("{:.0}", row.instructions),
            format!("{:.0}", row.step_instructions),
            format!("{:.1}", row.step_ns),
        ]);
    }
    Ok(table)
}

/// Largest |f(x) - tanh x|. Every f is odd, so positive x are enough.
fn error<A: Activation>() -> f64 {
    let (first, last) = (f32::MIN_POSITIVE.to_bits(), 10.0_f32.to_bits());
    let x = (first..last).step_by(61).map(f32::from_bits);
    x.map(|x| (f64::from(A::apply(x)) - f64::from(x).tanh()).abs())
        .fold(0.0, f64::max)
}
