//! `allan` of one sensor at rest, in every form that a replay reads.

use super::host_sim;
use crate::writers::{bag, csv, euroc, session, ubx, ulog};
use serde_json::Value;
use std::path::Path;

/// The random walk of the third gyro, which has the same unit in all forms.
fn walk(dir: &Path, args: &str) -> f64 {
    let out = host_sim(dir, &format!("allan {args} --json a.json")).success();
    let text = String::from_utf8_lossy(&out.get_output().stdout).into_owned();
    assert!(!text.contains("panicked"), "{args}: {text}");
    let bytes = std::fs::read(dir.join("a.json")).unwrap();
    let found: Value = serde_json::from_slice(&bytes).unwrap();
    let columns = found["analyses"].as_array().unwrap();
    assert_eq!(columns.len(), 6, "{args}");
    let gyros = columns.iter().take(3).map(|column| {
        let terms = column["coefficients"].as_array().unwrap();
        let walk = terms.iter().find(|term| term["symbol"] == "N").unwrap();
        walk["value"].as_f64().unwrap_or(f64::NAN)
    });
    // axes are turned in some forms
    gyros.sum::<f64>() / 3.0
}

#[test]
fn allan_reads_every_form() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let rest = session(300.0, 1.0);
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(dir.join(name), bytes).unwrap();
    csv(dir, &rest, false);
    write("rest.mcap", bag(&rest));
    write("rest.ulg", ulog(&rest));
    write("rest.ubx", ubx(&rest));
    euroc(dir, &rest);
    host_sim(dir, "convert csv --header header.toml --to kf-gins --out k").success();
    let want = walk(dir, "--header header.toml");
    assert!(want > 0.0, "{want}");
    for (args, share) in [
        ("header.toml", 1e-6),
        ("--header header.toml --unit tactical", 1e-6),
        ("k/imu.txt", 1e-3),
        ("rest.mcap", 1e-3),
        ("rest.ulg", 1e-3),
        ("rest.mcap --unit tactical", 1e-3),
        (".", 1e-3),
        ("rest.ubx", 0.5), // counts of 2^-12 deg/s
    ] {
        let got = walk(dir, args);
        assert!((got / want - 1.0).abs() < share, "{args}: {got} {want}");
    }
    csv(dir, &rest, true);
    let rates = walk(dir, "--header header.toml");
    assert!((rates / want - 1.0).abs() < 1e-3, "{rates} {want}");
}
