//! Virtual environments of Python below the target folder, each with the packages of a list of
//! requirements.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::images::target_directory;
use anyhow::{Context, Result};

use crate::needs;
use crate::stage::succeed;

const REMEDY: &str = "remedy: what this file names must be reachable by pip";

/// An environment that is ready.
pub struct Environment(PathBuf);

impl Environment {
    /// The environment in the folder `place` below the target folder, with the packages of this
    /// file and of the files beside it that it names with `-r`. It is recreated after a change of
    /// them.
    pub fn of(place: &str, requirements: &Path) -> Result<Environment> {
        let venv = target_directory()?.join(place);
        let (stamp, wanted) = (venv.join("installed.txt"), whole(requirements)?);
        if fs::read_to_string(&stamp).is_ok_and(|there| there == wanted) {
            return Ok(Environment(venv));
        }
        let mut make = Command::new(needs::python()?);
        succeed(make.args(["-m", "venv", "--clear"]).arg(&venv))?;
        let environment = Environment(venv);
        let mut pip = environment.pip();
        succeed(pip.arg("--requirement").arg(requirements))
            .with_context(|| format!("{}; {REMEDY}", requirements.display()))?;
        fs::write(&stamp, wanted).with_context(|| stamp.display().to_string())?;
        Ok(environment)
    }

    /// Its interpreter, which writes no cache files beside the scripts.
    pub fn python(&self) -> Command {
        let mut python = Command::new(self.program("python"));
        python.env("PYTHONDONTWRITEBYTECODE", "1");
        python
    }

    /// `pip install`; options and packages follow.
    pub fn pip(&self) -> Command {
        let mut pip = self.python();
        pip.args(["-m", "pip", "install", "--quiet"]);
        pip.arg("--disable-pip-version-check");
        pip
    }

    /// A program that one of its packages installed.
    pub fn program(&self, name: &str) -> PathBuf {
        let folder = if cfg!(windows) { "Scripts" } else { "bin" };
        self.0.join(folder).join(name)
    }
}

/// The text of a list and of the lists that it includes.
fn whole(requirements: &Path) -> Result<String> {
    let mut text =
        fs::read_to_string(requirements).with_context(|| requirements.display().to_string())?;
    let named: Vec<PathBuf> = (text.lines())
        .filter_map(|line| line.strip_prefix("-r "))
        .map(|name| requirements.with_file_name(name.trim()))
        .collect();
    for file in named {
        text += &whole(&file)?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_has_the_lists_that_it_names() {
        let dir = tempfile::tempdir().expect("a directory");
        let file = |name: &str| dir.path().join(name);
        fs::write(file("long.txt"), "# more\n-r short.txt\nb==2\n").expect("written");
        fs::write(file("short.txt"), "a==1\n").expect("written");
        let text = whole(&file("long.txt")).expect("read");
        assert_eq!(text, "# more\n-r short.txt\nb==2\na==1\n");
        fs::write(file("long.txt"), "-r none.txt\n").expect("written");
        let error = format!("{:#}", whole(&file("long.txt")).expect_err("missing"));
        assert!(error.contains("none.txt"), "{error}");
    }
}
