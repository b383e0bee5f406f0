//! `cargo xtask bench`: time on this machine (criterion) and instructions on the Cortex-M4F (QEMU),
//! against the budgets.

mod activations;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use comfy_table::Table;
use firmware::wire::ImuFormat;
use qemu::budget::Budgets;
use qemu::count::{self, CountedLoop, Counts};
use qemu::images::{BOARDS, INSTRUCTIONS};
use qemu::machine::{MPS2_AN500, NETDUINOPLUS2};
use qemu::replay::Pace;
use qemu::report::counted;
use serde::Serialize;
use vectors::list::GROUPS;
use vectors::work::DRIVE;

use crate::needs;
use crate::pytorch::{self, PyTorch};
use crate::table::numbers;
use crate::times::{Times, host_times};

/// The default network's step and learning step.
const STEP: &str = "step_rational";
const LEARN: &str = "descent_rational";
const FIX: &str = "learner_fix";
const NAV: &str = "nav_second";
/// A second of eight shadow navigators, that is, one more coast of the rehearsals.
const SHADOW: &str = "shadow_nav_second";
/// The learning step over a drive of [`DRIVE`] samples; measured on this machine only.
const DRIVE_NS: &str = "drive/descent_rational";

/// The `--json` format, which stays stable.
#[derive(Serialize)]
struct Figures {
    m4f: OnTarget,
    m7: OnTarget,
    host: OnHost,
    activations: Vec<activations::Row>,
}

/// Instructions on a core.
#[derive(Serialize)]
struct OnTarget {
    /// One step of the default network (rational hidden activation, identity output).
    step_instructions: f64,
    /// One step, its exact gradient, and one weight update.
    gradient_step_instructions: f64,
    /// As `gradient_step_instructions`, with the kernel in assembly, in the form with fewer
    /// instructions.
    kernel_step_instructions: f64,
    kernel_gradient_step_instructions: f64,
    /// Learning from one fix: the covariance over a second and six updates, 126 weights and 6
    /// biases.
    kalman_fix_instructions: f64,
    /// A second of the navigator: 200 samples and the transition.
    nav_second_instructions: f64,
    /// A second of one more coast: eight shadow navigators, start and scored end included.
    shadow_nav_second_instructions: f64,
    /// A STIM300 sample, from the interrupt of its first byte in to that of its last byte out, with
    /// two frozen networks.
    word_instructions: f64,
    /// As `word_instructions`, with lines by DMA: includes the interrupts of the streams, but not
    /// moving the bytes.
    word_instructions_dma: f64,
}

/// Nanoseconds of the same work on this machine.
#[derive(Serialize)]
struct OnHost {
    step_ns: f64,
    gradient_step_ns: f64,
    /// Network, gradient and update over 264 000 samples, s.
    drive_s: f64,
    /// PyTorch over the same samples, where it is available.
    pytorch: Option<PyTorch>,
}

/// Measures, prints, and writes `json` if asked. Exceeding a budget is an error.
pub fn bench(json: Option<&Path>) -> Result<ExitCode> {
    needs::target()?;
    needs::emulator()?;
    let budgets = Budgets::read()?.instructions;
    let image = INSTRUCTIONS.build()?;
    let (known, counts) = count::run(NETDUINOPLUS2, &image)?;
    let (known_m7, counts_m7) = count::run(MPS2_AN500, &image)?;
    known_m7.check()?;
    let times = host_times("vectors", "work")?;
    println!("{}", table(known, &counts, &budgets, &times)?);
    println!("{}", activations::table(&counts, &times)?);
    let drive_s = named(&times, DRIVE_NS)? * 1e-9;
    println!("step + gradient + descent over {DRIVE} samples on one core: {drive_s:.3} s");
    let pytorch = pytorch::measure()?;
    if let Some(other) = &pytorch {
        println!("{}", other.line(drive_s));
    }
    known.check()?;
    more_work_takes_longer(&counts)?;
    if let Some(path) = json {
        let figures = Figures::of(&counts, &counts_m7, &times, pytorch)?;
        let text = serde_json::to_string_pretty(&figures)? + "\n";
        fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    let over =
        |(name, count): &(&String, &f64)| budgets.get(*name).is_none_or(|budget| *count > budget);
    let exceeded: Vec<_> = counts.iter().filter(over).collect();
    ensure!(
        exceeded.is_empty(),
        "over budget, or without one (budgets.toml): {exceeded:.1?}"
    );
    Ok(ExitCode::SUCCESS)
}

impl Figures {
    fn of(m4f: &Counts, m7: &Counts, times: &Times, pytorch: Option<PyTorch>) -> Result<Self> {
        let on_target = |counts: &Counts, machine: &str| -> Result<OnTarget> {
            let board = BOARDS
                .into_iter()
                .find(|board| board.machine.name == machine);
            let board = board.with_context(|| format!("no board on {machine}"))?;
            let sample = |pace| -> Result<f64> {
                let (equal, cost) = counted(board, ImuFormat::Stim300, pace)?;
                ensure!(
                    equal,
                    "{machine}: the corrected stream is not the desktop's"
                );
                Ok(cost.per_sample)
            };
            Ok(OnTarget {
                step_instructions: named(counts, STEP)?,
                gradient_step_instructions: named(counts, LEARN)?,
                kernel_step_instructions: named(counts, "step_m7")?,
                kernel_gradient_step_instructions: named(counts, "descent_m7")?,
                kalman_fix_instructions: named(counts, FIX)?,
                nav_second_instructions: named(counts, NAV)?,
                shadow_nav_second_instructions: named(counts, SHADOW)?,
                word_instructions: sample(Pace::Byte)?,
                word_instructions_dma: sample(Pace::Dma)?,
            })
        };
        Ok(Self {
            m4f: on_target(m4f, NETDUINOPLUS2.name)?,
            m7: on_target(m7, MPS2_AN500.name)?,
            host: OnHost {
                step_ns: named(times, STEP)?,
                gradient_step_ns: named(times, LEARN)?,
                drive_s: named(times, DRIVE_NS)? * 1e-9,
                pytorch,
            },
            activations: activations::rows(m4f, times)?,
        })
    }
}

/// A piece of work that costs less than a part of itself was not done.
fn more_work_takes_longer(costs: &BTreeMap<String, f64>) -> Result<()> {
    for pair in GROUPS.iter().flat_map(|group| group.windows(2)) {
        let [(part_name, part_is), (whole_name, whole_is)] = pair else {
            continue;
        };
        let (part, whole) = (named(costs, part_name)?, named(costs, whole_name)?);
        ensure!(
            whole > part,
            "`{whole_is}` took {whole:.1}, its part `{part_is}` {part:.1}: \
             one of them measures something else",
        );
    }
    Ok(())
}

fn named(values: &BTreeMap<String, f64>, name: &str) -> Result<f64> {
    values
        .get(name)
        .copied()
        .with_context(|| format!("`{name}` was not measured, only {:?}", values.keys()))
}

fn table(
    known: CountedLoop,
    counts: &Counts,
    budgets: &BTreeMap<String, f64>,
    times: &Times,
) -> Result<Table> {
    let mut table = numbers([
        "one ...",
        "Cortex-M4F, instructions",
        "budget",
        "this machine, ns",
    ]);
    let described = GROUPS.iter().copied().flatten();
    for (name, what) in described.filter(|(_, what)| !what.is_empty()) {
        let (count, time) = (named(counts, name)?, named(times, name)?);
        let budget = format!("{:.0}", named(budgets, name)?);
        table.add_row([
            (*what).to_owned(),
            format!("{count:.0}"),
            budget,
            format!("{time:.1}"),
        ]);
    }
    let known = [
        format!("{:.0}", known.measured),
        format!("{:.0} executed", known.executed),
    ];
    table.add_row(["(method: a loop of known length)", &known[0], &known[1], ""]);
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cheaper_than_its_part_is_an_error() {
        let nanoseconds = (1..).map(|n| 100.0 * f64::from(n));
        let works = GROUPS.iter().copied().flatten();
        let mut costs: Times = works
            .zip(nanoseconds)
            .map(|((name, _), ns)| ((*name).to_owned(), ns))
            .collect();
        assert!(more_work_takes_longer(&costs).is_ok());
        costs.insert(LEARN.to_owned(), 194.0);
        assert!(more_work_takes_longer(&costs).is_err());
    }
}
