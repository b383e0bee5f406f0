//! `host-sim simulate`.

use crate::error::Error;
use crate::experiment::sessions;
use crate::output::CsvWriter;
use crate::rotation::to_euler;
use crate::scenario::Scenario;
use crate::session::{EPOCH_S, Session};
use crate::units::DEG;
use clap::Args as ClapArgs;
use std::path::{Path, PathBuf};

/// Arguments of `simulate`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Built-in scenario (medium, nav, tactical) or a TOML file
    #[arg(long, default_value = "medium", value_name = "NAME|FILE.toml")]
    scenario: String,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The session to learn from instead of the one to be judged on
    #[arg(long)]
    learning: bool,
    /// Directory for imu.csv, gnss.csv and truth.csv
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Args {
    /// Simulates and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let scenario = Scenario::load(&self.scenario)?;
        let progress = super::run::Progress::new();
        progress.stage("simulating");
        let session = sessions(&scenario, self.seed)?.simulate(self.learning);
        progress.stage("writing");
        // nothing half-written: each file appears whole, and the words, which are the longest, first
        write_imu(&session, &self.out.join("imu.csv"))?;
        write_gnss(&session, &self.out.join("gnss.csv"))?;
        write_truth(&session, &self.out.join("truth.csv"))?;
        progress.end();
        println!(
            "{} words, {} fixes in {}",
            session.counts.len(),
            session.fixes.len(),
            self.out.display()
        );
        Ok(())
    }
}

/// Increments of each word, body axes forward-right-down; `t_s` is the end of the word.
fn write_imu(session: &Session, file: &Path) -> Result<(), Error> {
    let columns = [
        "t_s",
        "dtheta_x_rad",
        "dtheta_y_rad",
        "dtheta_z_rad",
        "dv_x_mps",
        "dv_y_mps",
        "dv_z_mps",
    ];
    let mut csv = CsvWriter::create(file, &columns)?;
    for (k, w) in session.increments().iter().enumerate() {
        let (g, a) = (&w.dtheta, &w.dv);
        csv.row(&[(k + 1) as f64 * session.dt, g.x, g.y, g.z, a.x, a.y, a.z])?;
    }
    csv.finish()
}

fn write_gnss(session: &Session, file: &Path) -> Result<(), Error> {
    let columns = [
        "t_s",
        "lat_deg",
        "lon_deg",
        "height_m",
        "v_north_mps",
        "v_east_mps",
        "v_down_mps",
        "sigma_north_m",
        "sigma_east_m",
        "sigma_down_m",
        "sigma_v_north_mps",
        "sigma_v_east_mps",
        "sigma_v_down_mps",
    ];
    let mut csv = CsvWriter::create(file, &columns)?;
    for (k, fix) in session.fixes.iter().enumerate() {
        let (p, v) = (&fix.position, &fix.velocity);
        let mut row = vec![
            k as f64 * EPOCH_S,
            p.lat / DEG,
            p.lon / DEG,
            p.h,
            v.x,
            v.y,
            v.z,
        ];
        row.extend(session.sigmas);
        csv.row(&row)?;
    }
    csv.finish()
}

fn write_truth(session: &Session, file: &Path) -> Result<(), Error> {
    let columns = [
        "t_s",
        "lat_deg",
        "lon_deg",
        "height_m",
        "v_north_mps",
        "v_east_mps",
        "v_down_mps",
        "roll_deg",
        "pitch_deg",
        "heading_deg",
    ];
    let mut csv = CsvWriter::create(file, &columns)?;
    for (k, s) in session.reference.iter().enumerate() {
        let (p, v) = (&s.position, &s.velocity);
        let (roll, pitch, heading) = to_euler(&s.q_bn);
        csv.row(&[
            k as f64 * EPOCH_S,
            p.lat / DEG,
            p.lon / DEG,
            p.h,
            v.x,
            v.y,
            v.z,
            roll / DEG,
            pitch / DEG,
            heading / DEG,
        ])?;
    }
    csv.finish()
}
