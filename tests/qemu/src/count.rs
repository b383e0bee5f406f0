//! Instruction counts on the target: converts the ticks that the `instructions` image prints.
//!
//! Under `-icount shift=0` QEMU gives each instruction one nanosecond. The SysTick of
//! `netduinoplus2` runs at 168 MHz, so one tick is 5.95 instructions; on the `mps2` machines one
//! tick is 40. The counts are exact to a tick and the same in every run. They are instructions, not
//! cycles: a Cortex-M4F takes one to a few cycles for most instructions, 14 for a division or
//! square root.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use crate::machine::{self, Clock, Machine};

/// Instructions of each measured piece of work, by name.
pub type Counts = BTreeMap<String, f64>;

/// A loop of known length: the measured count, and the number of instructions executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CountedLoop {
    /// Instructions by the counter.
    pub measured: f64,
    /// Instructions executed, known by construction.
    pub executed: f64,
    /// Uncertainty of one tick, in instructions.
    pub tick: f64,
}

impl CountedLoop {
    /// Checks the count. Two readings of the counter may each be wrong by a tick.
    ///
    /// # Errors
    /// The count is further off: the machine does not count as this module assumes.
    pub fn check(self) -> Result<()> {
        let off = (self.measured - self.executed).abs();
        ensure!(
            self.executed > 1e6 && off <= 2.0 * self.tick,
            "a loop of known length was miscounted: {self:?}"
        );
        Ok(())
    }
}

/// Runs the `instructions` image on `machine`.
///
/// # Errors
/// QEMU fails, the image fails, or its output is not understood.
pub fn run(machine: Machine, image: &Path) -> Result<(CountedLoop, Counts)> {
    let run = machine::run(
        machine,
        image,
        Clock::Instructions,
        Duration::from_secs(120),
    )?;
    ensure!(
        run.code == Some(0),
        "exit code {:?}\n{}",
        run.code,
        run.output
    );
    read(&run.output, machine.instructions_per_tick()).with_context(|| run.output)
}

/// Lines `loop <instructions> <ticks>` (twice; their difference is free of the cost of measuring),
/// `repetitions <n>`, `empty <ticks>`, then `<name> <ticks>`.
fn read(output: &str, tick: f64) -> Result<(CountedLoop, Counts)> {
    let mut lines = output
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>());
    let mut known = || -> Result<(f64, f64)> {
        match lines.next().as_deref() {
            Some(["loop", executed, ticks]) => Ok((executed.parse()?, ticks.parse()?)),
            other => anyhow::bail!("expected `loop <instructions> <ticks>`, got {other:?}"),
        }
    };
    let (short, long) = (known()?, known()?);
    let known = CountedLoop {
        measured: (long.1 - short.1) * tick,
        executed: long.0 - short.0,
        tick,
    };
    let mut values = Counts::new();
    for line in lines {
        let [name, value] = line[..] else {
            anyhow::bail!("expected `<name> <value>`, got {line:?}")
        };
        values.insert(name.to_owned(), value.parse()?);
    }
    let repetitions = values.remove("repetitions").context("no repetitions")?;
    let empty = values.remove("empty").context("no empty loop")?;
    values
        .values_mut()
        .for_each(|ticks| *ticks = (*ticks - empty) * tick / repetitions);
    Ok((known, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_per_repetition_without_the_empty_loop() {
        let text = "loop 1000 168\nloop 3000 504\nrepetitions 10\nempty 168\nwork 1848\n";
        let (known, counts) = read(text, 1e9 / 168e6).expect("well formed");
        assert!((known.measured - 2000.0).abs() < 1e-6 && known.executed == 2000.0);
        assert_eq!(counts.len(), 1);
        assert!((counts["work"] - 1000.0).abs() < 1e-6);
    }

    #[test]
    fn torn_output_is_an_error() {
        assert!(read("", 1.0).is_err());
        assert!(read("loop 1 2\nloop 2 3\nrepetitions 10\nwork 5\n", 1.0).is_err());
        assert!(read("loop 1 2\nloop 2 3\nrepetitions 10\nempty 1\nwork\n", 1.0).is_err());
    }
}
