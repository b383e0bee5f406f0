//! A recording of 24 h at 200 samples a second, through `host-sim allan` and `host-sim replay csv`.
//! The vehicle stands all the time, so `replay csv` does not look for a time offset between samples
//! and fixes. docs/PERFORMANCE.md has the cost for a moving vehicle.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use host_core::inertial::earth::{Geodetic, Local};
use host_core::inertial::session::to_si;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::DEG;
use host_core::simulator::imu::Imu;
use host_core::simulator::session::{SessionConfig, simulate_in};
use host_core::simulator::truth::{Standing, Vehicle};
use host_io::output::CsvWriter;
use host_io::recordings::columns::IMU;
use host_io::recordings::generic;
use host_io::recordings::record::Record;
use host_unit::Unit;
use qemu::budget::Budgets;

use super::{Programs, peak};
use crate::child::{self, Used};
use crate::table::{markdown, thousands};

/// Length of the recording, and of the part of it that aligns, s.
const LENGTH_S: u32 = 86_400;
const STANDSTILL_S: u32 = 300;
const RATE_HZ: u32 = 200;

/// Measures, and returns the table and what exceeds its budget.
pub fn measure(programs: &Programs) -> Result<(String, Vec<String>)> {
    let folder = programs.folder.join("day");
    eprintln!("      writing {}", folder.display());
    record(&folder)?;
    let imu = folder.join("imu.csv");
    let bytes = fs::metadata(&imu)?.len();
    let budgets = Budgets::read()?.day_mib;
    let mut rows = Vec::new();
    let mut exceeded = Vec::new();
    let mut allan = Command::new(&programs.program);
    allan.arg("allan").arg(&imu);
    let mut replay = Command::new(&programs.program);
    replay
        .args(["replay", "csv", "--header"])
        .arg(folder.join("header.toml"));
    replay.arg("--out").arg(folder.join("report"));
    for (name, mut command) in [("allan", allan), ("replay csv", replay)] {
        eprintln!("      host-sim {name}");
        let used = child::run(&mut command)?;
        let budget = *budgets
            .get(name)
            .with_context(|| format!("no budget of {name}"))?;
        if used.peak_mib.is_some_and(|mib| mib > budget) {
            exceeded.push(format!("{name}: {} of {budget} MiB", peak([&used])));
        }
        rows.push(row(name, &used, budget));
    }
    fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut out = format!(
        "**24 h at {RATE_HZ} samples a second**: {} lines of CSV, {} MB. One process each.\n\n",
        thousands(f64::from(LENGTH_S * RATE_HZ)),
        thousands(bytes as f64 * 1e-6)
    );
    let header = ["host-sim", "processor, s", "peak, MiB", "budget"].map(str::to_owned);
    out += &markdown(&header, rows.into_iter());
    Ok((out + "\n", exceeded))
}

fn row(name: &str, used: &Used, budget: f64) -> Vec<String> {
    let time = used
        .cpu_s
        .map_or("unknown".to_owned(), |s| format!("{s:.1}"));
    vec![
        format!("`{name}`"),
        time,
        peak([used]),
        format!("{budget:.0}"),
    ]
}

/// Writes header, unit and fixes, then the samples one by one.
fn record(folder: &Path) -> Result<()> {
    let unit = Unit::load("medium")?;
    let mut spec = unit.simulated();
    // fixes and header do not depend on the samples, so there are few of them
    spec.rate_hz = 4;
    let start = Geodetic {
        lat: 28.2 * DEG,
        lon: 112.9 * DEG,
        h: 60.0,
    };
    let config = SessionConfig {
        start,
        heading: 0.0,
        ..SessionConfig::new(
            &spec,
            [f64::from(STANDSTILL_S), f64::from(LENGTH_S - STANDSTILL_S)],
            [1, 2, 3],
        )
    };
    let vehicle = Vehicle::Standing(Standing::default());
    let (session, _) = simulate_in(&vehicle, &config);
    generic::write(&Record::from_session(&session), Some(&unit), folder)?;
    spec.rate_hz = RATE_HZ;
    let dt = 1.0 / f64::from(RATE_HZ);
    let here = Local::at(start.lat, start.h);
    let still = Increment {
        dtheta: here.omega_ie() * dt,
        dv: -here.gravity() * dt,
    };
    let lsb = Imu::lsb(&spec);
    let mut imu = Imu::new(&spec, 1, 2);
    let mut samples = CsvWriter::create(&folder.join("imu.csv"), &IMU)?;
    for k in 1..=LENGTH_S * RATE_HZ {
        let Increment { dtheta, dv } = to_si(&imu.measure(&still).0, &lsb);
        let time = f64::from(k) / f64::from(RATE_HZ);
        samples.row(&[time, dtheta.x, dtheta.y, dtheta.z, dv.x, dv.y, dv.z])?;
    }
    Ok(samples.finish()?)
}
