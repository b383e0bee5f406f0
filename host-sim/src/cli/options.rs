//! Options of several commands, and the errors of bad values.

use clap::Args as ClapArgs;
use host_core::error::Error;
pub(super) use host_reading::options::*;
use host_unit::Unit;
use host_unit::scenario::Scenario;

/// `--scenario`.
#[derive(Debug, ClapArgs)]
pub(super) struct ScenarioOption {
    /// Built-in scenario (medium, nav, tactical, fog, mems) or a TOML file
    #[arg(long, default_value = "medium", value_name = "NAME|FILE.toml")]
    pub(super) scenario: String,
    #[command(flatten)]
    pub(super) unit: UnitOption,
}

impl ScenarioOption {
    pub(super) fn load(&self) -> Result<Scenario, Error> {
        let mut scenario = Scenario::load(&self.scenario)?;
        if let Some(name) = &self.unit.unit {
            scenario.set_unit(name, Unit::load(name)?);
        }
        Ok(scenario)
    }

    /// The option as typed on a command line.
    pub(super) fn typed(&self) -> String {
        let unit = self.unit.unit.as_ref();
        let unit = unit.map_or(String::new(), |name| format!(" --unit {name}"));
        format!("--scenario {}{unit}", self.scenario)
    }
}

/// `--scenario` and `--seed`: what determines a simulation completely.
#[derive(Debug, ClapArgs)]
pub(super) struct Simulation {
    #[command(flatten)]
    pub(super) scenario: ScenarioOption,
    /// Seed of everything random: sensor errors of the unit and of each turn-on, roads, noise
    #[arg(long, default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    pub(super) seed: u64,
}

/// A seed, for options that allow negative numbers to be typed.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    let whole = format!("a seed is a whole number from 0 to {}", u64::MAX);
    text.parse().map_err(|_| whole)
}

/// The arguments of this command, for a shell.
pub(super) fn arguments() -> String {
    for_a_shell(std::env::args().skip(1))
}

/// The arguments without an option and its value.
pub(super) fn arguments_without(option: &str) -> String {
    for_a_shell(without(option, std::env::args().skip(1)))
}

/// Words without an option and its value, which is joined to it by `=` or is the next word.
fn without(option: &str, words: impl Iterator<Item = String>) -> impl Iterator<Item = String> {
    let mut value_follows = false;
    words.filter(move |word| {
        let is_value = std::mem::take(&mut value_follows);
        value_follows = !is_value && word == option;
        let joined = word
            .strip_prefix(option)
            .is_some_and(|rest| rest.starts_with('='));
        !(is_value || value_follows || joined)
    })
}

fn for_a_shell(words: impl Iterator<Item = String>) -> String {
    words.map(quoted).collect::<Vec<_>>().join(" ")
}

/// A word, quoted for a shell where necessary.
pub(super) fn quoted(word: String) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// Thread pool with `--jobs` threads, by default one for each core.
pub(super) fn pool(jobs: Option<usize>) -> Result<rayon::ThreadPool, Error> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(jobs.map_or(0, |jobs| jobs.max(1)))
        .build()
        .map_err(|e| refused("--jobs", e.to_string(), "give fewer"))
}

/// Which part of the runs: I/N, or /N where the environment of a cluster gives I.
pub(super) fn shard(text: Option<&str>) -> Result<(u32, u32), Error> {
    let Some(text) = text else {
        return Ok((0, 1));
    };
    let wrong = || {
        refused(
            "--shard",
            format!("'{text}'"),
            "give I/N with I from 0 to N-1, or /N under SLURM or Kubernetes",
        )
    };
    let (i, n) = text.split_once('/').ok_or_else(wrong)?;
    let from_environment = || {
        ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"]
            .iter()
            .find_map(|v| std::env::var(v).ok())
    };
    let i = if i.is_empty() {
        from_environment().ok_or_else(wrong)?
    } else {
        i.to_string()
    };
    match (i.parse(), n.parse()) {
        (Ok(i), Ok(n)) if i < n => Ok((i, n)),
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_goes_with_its_value_and_words_are_quoted_for_a_shell() {
        let words = |text: &str| -> Vec<String> { text.split('|').map(String::from).collect() };
        for text in [
            "a|--jobs|2|--out|b c",
            "a|--jobs=2|--out|b c",
            "a|--out|b c|--jobs|3",
        ] {
            let rest = for_a_shell(without("--jobs", words(text).into_iter()));
            assert_eq!(rest, "a --out 'b c'", "{text}");
        }
        let given = words("--jobs-of|2|--jobs|--jobs|it's|").into_iter();
        assert_eq!(
            for_a_shell(without("--jobs", given)),
            r"--jobs-of 2 'it'\''s' ''"
        );
    }
}
