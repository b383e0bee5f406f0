//! The trials, in a process that may end at any of them.

use crate::device::{Device, Scenario, configured};
use crate::judge::{Judge, Verdict};
use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

/// Exit code when a trial did not end.
pub const HANGS: i32 = 97;
/// Exit code when the process is no longer intact.
pub const NOT_INTACT: i32 = 98;

/// A trial that takes longer counts as endless.
const PATIENCE: Duration = Duration::from_secs(10);
/// Number of trials after which the process is checked for being intact.
const CHECK: usize = 200;

/// A range of trials.
#[derive(Clone, Copy, Debug)]
pub struct Trials {
    /// What the device does.
    pub scenario: Scenario,
    /// Seconds after each flip.
    pub seconds: u32,
    /// The first bit, counted over all regions.
    pub from: usize,
    /// Step between bits: every `every`th bit is tried.
    pub every: usize,
    /// A second bit that flips at the same time.
    pub second: Option<Second>,
}

/// Which bit flips together with another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Second {
    /// The next one, by the same particle.
    Neighbour,
    /// Any one, by another particle.
    Any,
}

impl Second {
    /// The second bit of `all`, another than `first`.
    fn bit(self, first: usize, all: usize) -> usize {
        let distance = match self {
            Self::Neighbour => 1,
            // as good as random, and the same each time
            Self::Any => 1 + first.wrapping_mul(0x9E37_79B9_7F4A_7C15) % (all - 1),
        };
        (first + distance) % all
    }
}

/// Runs them. Writes the number of bits of each region, then `> BIT` before and `= LETTER` after
/// each trial.
///
/// # Errors
/// The device does not reach the state under test; the output is closed.
pub fn run(trials: Trials) -> Result<()> {
    let mut device = Device::driven(trials.scenario, trials.seconds)?;
    let without = device.trial(&[]);
    ensure!(device.trial(&[]) == without, "a trial leaves traces");
    let configuration = configured(trials.scenario);
    let judge =
        Judge::new(trials.scenario, &configuration, without.clone()).context("no such stream")?;
    let idle = judge.judge(device.came(), &without);
    ensure!(idle == Verdict::Same, "without an upset: {idle:?}");
    let mut out = std::io::stdout().lock();
    for region in &device.regions {
        writeln!(out, "region {} {}", region.bits(), region.name)?;
    }
    watch();
    std::panic::set_hook(Box::new(|_| {}));
    let all: usize = device.regions.iter().map(|region| region.bits()).sum();
    for (count, bit) in (trials.from..all).step_by(trials.every).enumerate() {
        TURN.fetch_add(1, Ordering::Relaxed);
        writeln!(out, "> {bit}")?;
        out.flush()?;
        let bits = [Some(bit), trials.second.map(|second| second.bit(bit, all))];
        let places = bits
            .into_iter()
            .flatten()
            .map(|bit| region_of(&device, bit));
        let places: Option<Vec<_>> = places.collect();
        let places = places.context("no such bit")?;
        let left = catch_unwind(AssertUnwindSafe(|| device.trial(&places)));
        let verdict = match left {
            Ok(left) => judge.judge(device.came(), &left),
            Err(_) => {
                device.put_back();
                Verdict::Check
            }
        };
        writeln!(out, "= {}", verdict.letter())?;
        if count % CHECK == CHECK - 1 && device.trial(&[]) != without {
            out.flush()?;
            process::exit(NOT_INTACT);
        }
    }
    Ok(out.flush()?)
}

/// Region of a bit, and the bit within it.
fn region_of(device: &Device, bit: usize) -> Option<(usize, usize)> {
    let mut left = bit;
    for (number, region) in device.regions.iter().enumerate() {
        if left < region.bits() {
            return Some((number, left));
        }
        left -= region.bits();
    }
    None
}

static TURN: AtomicU64 = AtomicU64::new(0);

/// Starts a thread that ends the process when a trial does not end.
fn watch() {
    thread::spawn(|| {
        let mut seen = TURN.load(Ordering::Relaxed);
        loop {
            thread::sleep(PATIENCE);
            let now = TURN.load(Ordering::Relaxed);
            if now == seen {
                process::exit(HANGS);
            }
            seen = now;
        }
    });
}
