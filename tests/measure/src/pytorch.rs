//! PyTorch on the same work, where a Python with it is available.

use std::process::Command;

use anyhow::{Context, Result, ensure};
use qemu::images::workspace;
use serde::Serialize;
use vectors::work::DRIVE;

/// The script's result for a drive on one core.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PyTorch {
    version: String,
    /// With `torch.nn.RNN`, s.
    built_in_s: f64,
    /// With the recurrence written out, s.
    written_out_s: f64,
}

/// Runs the script, which takes a minute or two. Returns `None`, and prints why, where PyTorch is
/// missing. `PYTHON` names another interpreter than `python3`.
///
/// # Errors
/// PyTorch is available and the script fails.
pub fn measure() -> Result<Option<PyTorch>> {
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let there = Command::new(&python).args(["-c", "import torch"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        let python = python.display();
        eprintln!(
            "skipped: PyTorch, which {python} cannot import; to see it beside us: PYTHON=/path/to/python/with/torch"
        );
        return Ok(None);
    }
    eprintln!("PyTorch over {DRIVE} samples, one core ...");
    let script = workspace().join("tests/vectors/benches/tbptt.py");
    let output = Command::new(&python)
        .arg(&script)
        .arg(DRIVE.to_string())
        .env("OMP_NUM_THREADS", "1")
        .output()
        .with_context(|| python.display().to_string())?;
    ensure!(
        output.status.success(),
        "{}: {}",
        script.display(),
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8_lossy(&output.stdout);
    read(&text)
        .with_context(|| format!("{}: it printed {text:?}", script.display()))
        .map(Some)
}

/// `<version> <s> <s>`.
fn read(text: &str) -> Option<PyTorch> {
    let mut words = text.split_whitespace();
    let version = words.next()?.to_owned();
    let mut seconds = || words.next()?.parse::<f64>().ok().filter(|s| *s > 0.0);
    Some(PyTorch {
        version,
        built_in_s: seconds()?,
        written_out_s: seconds()?,
    })
}

impl PyTorch {
    /// The result as one line.
    pub fn line(&self, ours: f64) -> String {
        let Self {
            version,
            built_in_s,
            written_out_s,
        } = self;
        format!(
            "PyTorch {version}, the same samples, TBPTT-200 on one core: {built_in_s:.1} s with torch.nn.RNN ({:.0} times ours), {written_out_s:.1} s written out ({:.0} times)",
            built_in_s / ours,
            written_out_s / ours
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_script_says_is_read_and_nothing_else() {
        let text = read("1.13.0a0 8.5 40.25\n").expect("well formed");
        assert_eq!((text.built_in_s, text.written_out_s), (8.5, 40.25));
        assert!(text.line(0.5).contains("(17 times ours)"));
        for torn in ["", "1.13", "1.13 8.5", "1.13 8.5 nan", "1.13 0 1"] {
            assert_eq!(read(torn), None, "{torn}");
        }
    }
}
