//! Agreement with the Python package AllanTools, an independent implementation, if Python and pip
//! are installed.

use super::covariance::Model;
use super::tests::gyro;
use super::{Kind, analyse};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The package and its version.
const PACKAGE: &str = "allantools==2024.6";
/// Reads increments from a file. Prints for each `m` the overlapping Allan deviation and the
/// degrees of freedom for white, flicker and random-walk rate noise.
const SCRIPT: &str = r#"
import sys, numpy, allantools
from allantools.ci import edf_greenhall
rate, name = float(sys.argv[1]), sys.argv[2]
ms = [int(m) for m in sys.argv[3:]]
increments = numpy.loadtxt(name)
phase = numpy.concatenate([[0.0], numpy.cumsum(increments - increments.mean())])
taus, deviations, _, _ = allantools.oadev(phase, rate=rate, data_type="phase", taus=[m / rate for m in ms])
assert len(taus) == len(ms), (list(taus), ms)
for m, deviation in zip(ms, deviations):
    edf = [edf_greenhall(alpha=alpha, d=2, m=m, N=len(phase), overlapping=True, modified=False) for alpha in (0, -1, -2)]
    print(m, repr(float(deviation)), *[repr(float(e)) for e in edf])
"#;

/// Python of a virtual environment with AllanTools under the build directory, which is made if
/// necessary.
fn python() -> Result<PathBuf, String> {
    // .../target/debug/deps/host_sim-...
    let test = std::env::current_exe().map_err(|e| e.to_string())?;
    let target = test.ancestors().nth(2).ok_or("no build directory")?;
    let environment = target.join("allantools-venv");
    let python = environment.join("bin/python");
    let works = |python: &Path| run(Command::new(python).args(["-c", "import allantools"])).is_ok();
    if works(&python) {
        return Ok(python);
    }
    run(Command::new("python3")
        .args(["-m", "venv", "--clear"])
        .arg(&environment))?;
    run(Command::new(&python).args([
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        PACKAGE,
    ]))?;
    Ok(python)
}

fn run(command: &mut Command) -> Result<String, String> {
    let out = command.output().map_err(|e| format!("{command:?}: {e}"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if out.status.success() {
        Ok(text(&out.stdout))
    } else {
        Err(format!("{command:?}: {}", text(&out.stderr)))
    }
}

#[test]
fn the_curve_agrees_with_allantools() {
    let python = match python() {
        Ok(python) => python,
        Err(why) => {
            println!("SKIPPED: needs python3 with venv and pip for {PACKAGE}: {why}");
            return;
        }
    };
    let series = gyro([1e-6, 2e-6, 0.0, 3e-7, 1e-10], 50.0, 30_000, 9);
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("increments.txt");
    let text: String = series
        .increments
        .iter()
        .map(|d| format!("{d:e}\n"))
        .collect();
    std::fs::write(&file, text).unwrap();
    let curve = analyse(series).unwrap().curve;
    let ms: Vec<usize> = curve
        .iter()
        .map(|p| (p.tau_s * 50.0).round() as usize)
        .collect();
    let mut command = Command::new(python);
    command
        .args(["-c", SCRIPT, "50"])
        .arg(&file)
        .args(ms.iter().map(usize::to_string));
    let printed = run(&mut command).unwrap();
    assert_eq!(printed.lines().count(), curve.len());
    let (mut worst, mut worst_edf) = (0.0_f64, 0.0_f64);
    for (point, line) in curve.iter().zip(printed.lines()) {
        let fields: Vec<f64> = line
            .split(' ')
            .map(|field| field.parse().unwrap())
            .collect();
        let (m, deviation) = (fields[0] as usize, fields[1]);
        worst = worst.max((point.deviation * Kind::Gyro.unit().1 / deviation - 1.0).abs());
        // Pure N, B and K. AllanTools sums in strides, which is wrong by up to a sixth for averages
        // of few samples: at one sample white noise has 2/3 N degrees of freedom, not 0.78 N.
        if m < 50 {
            continue;
        }
        for (noise, theirs) in (1..4).zip(&fields[2..]) {
            let mut squares = [0.0; 5];
            squares[noise] = 1.0;
            worst_edf = worst_edf.max((Model(squares).edf(m, 30_000, 0.02) / theirs - 1.0).abs());
        }
    }
    println!("deviations agree to {worst:.1e}, degrees of freedom to {worst_edf:.1e}");
    assert!(worst < 1e-9, "deviations differ by {worst:e}");
    assert!(worst_edf < 0.01, "degrees of freedom differ by {worst_edf}");
}
