//! Runs the trials in processes, and collects the verdicts.

use crate::child::{HANGS, NOT_INTACT, Trials};
use crate::judge::Verdict;
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// Verdicts of the trials.
#[derive(Clone, Debug, Default)]
pub struct UpsetResults {
    /// Name and bits of each region.
    pub regions: Vec<(String, usize)>,
    /// Verdict of each bit that was tried, counted over all regions.
    pub verdicts: BTreeMap<usize, Verdict>,
}

impl UpsetResults {
    /// Trials of a region by verdict.
    #[must_use]
    pub fn of(&self, region: usize, verdict: Verdict) -> usize {
        let bits = |region: &(String, usize)| region.1;
        let from: usize = self.regions.iter().take(region).map(bits).sum();
        let to = from + self.regions.get(region).map_or(0, bits);
        let tried = self.verdicts.range(from..to);
        tried.filter(|(_, found)| **found == verdict).count()
    }

    /// Bits that ended so, with the name of their region and the bit within it.
    pub fn bits(&self, verdict: Verdict) -> impl Iterator<Item = (&str, usize)> {
        let tried = self
            .verdicts
            .iter()
            .filter(move |(_, found)| **found == verdict);
        tried.filter_map(|(&bit, _)| {
            let mut left = bit;
            for (name, bits) in &self.regions {
                if left < *bits {
                    return Some((name.as_str(), left));
                }
                left -= bits;
            }
            None
        })
    }
}

/// Runs all trials: `program` is started with `arguments` and the trials' own.
///
/// # Errors
/// A process cannot be started, or ends before its first trial.
pub fn run(
    program: &Path,
    mut trials: Trials,
    mut progress: impl FnMut(usize, usize),
) -> Result<UpsetResults> {
    let mut found = UpsetResults::default();
    let mut unsound = None;
    loop {
        let scenario = format!("{:?}", trials.scenario).to_lowercase();
        let numbers = [trials.seconds as usize, trials.from, trials.every];
        let second = trials.second.map(|it| format!("{it:?}").to_lowercase());
        let mut child = Command::new(program)
            .args(["child", &scenario])
            .args(numbers.map(|number| number.to_string()))
            .args(second)
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let out = child.stdout.take().context("no output")?;
        let (mut regions, mut last) = (Vec::new(), None);
        let mut new = BTreeMap::new();
        for line in BufReader::new(out).lines() {
            let line = line?;
            let (key, rest) = line.split_once(' ').context("a line without a key")?;
            match key {
                "region" => {
                    let (bits, name) = rest.split_once(' ').context("a region")?;
                    regions.push((name.to_owned(), bits.parse()?));
                }
                ">" => last = Some(rest.parse::<usize>()?),
                "=" => {
                    let verdict = rest.chars().next().and_then(Verdict::of);
                    if let Some(bit) = last.take() {
                        new.insert(bit, verdict.context("a verdict")?);
                    }
                }
                _ => bail!("a line that nobody writes: {line}"),
            }
            let all: usize = regions.iter().map(|(_, bits)| bits).sum();
            progress(found.verdicts.len() + new.len(), all / trials.every);
        }
        let status = child.wait()?;
        ensure!(!regions.is_empty(), "the device did not start: {status}");
        found.regions = regions;
        let next = match (status.code(), last) {
            (Some(0), _) => {
                found.verdicts.append(&mut new);
                return Ok(found);
            }
            (Some(NOT_INTACT), _) => {
                // one of the trials since the last check has left a change behind: they are
                // repeated, each in its own process
                let first = trials.from;
                let end = new.keys().next_back().copied().context("no trial")?;
                ensure!(
                    unsound != Some(first),
                    "the process is unsound from its start"
                );
                unsound = Some(first);
                found.verdicts.append(&mut new);
                end + trials.every
            }
            (code, Some(bit)) => {
                let verdict = if code == Some(HANGS) {
                    Verdict::Hang
                } else {
                    Verdict::Fault
                };
                new.insert(bit, verdict);
                found.verdicts.append(&mut new);
                bit + trials.every
            }
            (code, None) => bail!("the process ended between two trials: {code:?}"),
        };
        trials.from = next;
    }
}
