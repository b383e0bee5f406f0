//! The tests, divided into quick ones (`cargo xtask test`) and slow ones (`cargo xtask check`).
//! Each is in one part, since one filter is the negation of the other. Both parts select the whole
//! workspace, so that features are the same and nothing is compiled twice.

use std::num::NonZero;
use std::process::{Command, ExitCode};
use std::thread;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::images::{REQUIRE, metadata};
use crate::needs;
use crate::stage::{Stages, cargo_with, succeed};

/// Packages whose programs in `tests` are slow: whole commands, images in an emulator, a browser,
/// hours of driving, a million bytes.
const SLOW: [&str; 6] = ["damage", "live", "qemu", "soak", "system", "upsets"];

/// Programs of these packages that are quick. `agreement` compares the bits of desktop and target.
const QUICK: [&str; 1] = ["agreement"];

/// Further slow tests, as a filter of nextest.
const CAMPAIGNS: &str = "(package(=host-lab) & kind(lib) & test(/^campaign::/)) | \
     (package(=host-estimation) & kind(lib) & test(/^learning::fleet::/))";

/// A part of the tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TestSet {
    /// Without `qemu` what needs the target or QEMU is left out.
    Quick { qemu: bool },
    /// All others.
    Slow,
}

impl TestSet {
    /// The part as a filter of nextest.
    fn filter(self) -> String {
        let all = |of: &str, names: &[&str]| {
            let names = names.iter().map(|name| format!("{of}(={name})"));
            names.collect::<Vec<_>>().join(" | ")
        };
        let (slow, quick) = (all("package", &SLOW), all("binary", &QUICK));
        let slow = format!("(kind(test) & ({slow}) - ({quick})) | ({CAMPAIGNS})");
        match self {
            Self::Slow => slow,
            Self::Quick { .. } => format!("not ({slow})"),
        }
    }

    /// Options that select the programs with these tests. cargo selects by name alone, so a program
    /// of the other part comes with them where two have the same name.
    fn selected(self, metadata: &Value) -> Result<Vec<String>> {
        let mut options = vec!["--workspace".to_owned()];
        let without = self == Self::Quick { qemu: false };
        if without {
            options.extend(["--exclude", "qemu"].map(str::to_owned));
        }
        options.push("--lib".to_owned());
        for package in metadata["packages"].as_array().context("no packages")? {
            if without && package["name"] == "qemu" {
                continue;
            }
            let slow = SLOW.iter().any(|name| package["name"] == *name);
            for target in package["targets"].as_array().context("no targets")? {
                let name = target["name"].as_str().context("no name")?;
                let slow = slow && !QUICK.contains(&name);
                let kind = match target["kind"][0].as_str() {
                    Some("test") if slow != (self == Self::Slow) => continue,
                    Some(kind @ ("test" | "bin" | "example" | "bench")) => kind,
                    _ => continue, // the library has an option of its own
                };
                if target["test"] == true {
                    options.extend([format!("--{kind}"), name.to_owned()]);
                }
            }
        }
        Ok(options)
    }

    /// cargo with a command over these programs.
    fn cargo(self, command: &str) -> Result<Command> {
        let mut cargo = cargo_with(command);
        cargo.args(self.selected(&metadata()?)?);
        Ok(cargo)
    }

    /// Compiles them.
    pub fn build(self) -> Result<()> {
        succeed(&mut self.cargo("test --quiet --no-run")?)
    }

    /// Runs them. Nothing is printed after the runner.
    pub fn run(self, stages: &Stages) -> Result<ExitCode> {
        let mut runner = if needs::nextest() {
            stages.begin("tests (nextest)");
            let mut runner = self.cargo("nextest run --no-fail-fast")?;
            // some tests wait for a silence or for QEMU most of their time, so one more than cores
            let cores = thread::available_parallelism().map_or(1, NonZero::get);
            runner.args(["--test-threads", &(cores + 1).to_string()]);
            runner.args(["--filterset", &self.filter()]);
            runner
        } else {
            stages.begin("tests");
            self.cargo("test --no-fail-fast")?
        };
        if self != (Self::Quick { qemu: false }) {
            runner.env(REQUIRE, "1").env("LRNN_REQUIRE_BROWSER", "1");
        }
        let status = runner.status().context("cannot start the test runner")?;
        Ok(if status.success() {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(status.code().map_or(1, |code| code as u8))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUICKLY: TestSet = TestSet::Quick { qemu: true };

    #[test]
    fn what_is_not_slow_is_quick() {
        assert_eq!(
            QUICKLY.filter(),
            format!("not ({})", TestSet::Slow.filter())
        );
        assert_eq!(QUICKLY.filter(), TestSet::Quick { qemu: false }.filter());
    }

    /// A name that is in one list twice stands for programs of the same name.
    #[test]
    fn every_program_with_tests_is_selected() {
        let metadata = metadata().unwrap();
        let [quick, slow] = [QUICKLY, TestSet::Slow].map(|part| part.selected(&metadata).unwrap());
        let targets = |package: &Value| package["targets"].as_array().unwrap().clone();
        let packages = metadata["packages"].as_array().unwrap();
        let targets = packages.iter().flat_map(targets);
        let (mut programs, mut both) = (0, 0);
        for target in targets.filter(|target| target["test"] == true) {
            let (kind, name) = (target["kind"][0].as_str(), target["name"].as_str());
            let option = [format!("--{}", kind.unwrap()), name.unwrap().to_owned()];
            let [quick, slow] = [&quick, &slow]
                .map(|part| kind == Some("lib") || part.windows(2).any(|pair| pair == option));
            assert!(quick || slow, "{option:?}");
            programs += 1;
            both += usize::from(quick && slow);
        }
        assert!(programs > both, "{programs} programs, {both} in both parts");
        for name in SLOW {
            assert!(
                packages.iter().any(|package| package["name"] == name),
                "{name}"
            );
        }
    }
}
