//! What a device did in a drive, in words: what is in force and since when, or what it waits for.

use super::{Device, Drive};
use firmware::control::HeadingSource;
use firmware::learn::bank::NAMES;
use firmware::model::Nets;
use host_device::device::biases::{large, sheet};
use host_device::device::proof::{Interruption, Nearest};
use serde::Serialize;

/// What a device did in a drive, for the reader.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Course {
    /// The correction at the beginning and at the end: gyros, deg/s, then accelerometers, m/s2.
    pub correction: [[f64; 6]; 2],
    /// The second from which on a correction was in force to the end.
    pub in_force_since_s: Option<usize>,
    /// Its navigator was aligned and used fixes at the end.
    pub navigates: bool,
    /// Alignments in which samples and fixes contradicted each other, if it does not navigate.
    #[serde(skip)]
    pub contradicted: u32,
    /// Fixes used, and of these with a value that was refused.
    pub fixes: [u32; 2],
    /// Hypotheses that had proved themselves at the end.
    pub proved: Vec<&'static str>,
    /// The one that was nearest to its proof.
    pub nearest: Option<Nearest>,
    /// When it stored a record, s after power-on.
    pub stored_s: Vec<f64>,
    /// What it does, or what it waits for.
    pub says: String,
}

impl Course {
    /// Whether it navigates, and no hypothesis has proved itself yet.
    #[must_use]
    pub fn is_proving(&self) -> bool {
        self.navigates && self.fixes[0] > 0 && self.proved.is_empty()
    }
}

impl Drive {
    /// The second from which on a correction was in force to the end, if one was.
    #[must_use]
    pub fn in_force_since(&self) -> Option<usize> {
        let zero = |of: &[[f32; 3]; 2]| *of == [[0.0; 3]; 2];
        let off = self.correction.iter().rposition(zero);
        let since = off.map_or(0, |last| last + 1);
        (since < self.correction.len()).then_some(since)
    }

    /// Hypotheses that had proved themselves at the end.
    fn proved(&self) -> Vec<&'static str> {
        let each = self.trials.iter().flat_map(|trials| &trials.each);
        let proved = each.zip(NAMES).skip(1).filter(|(trial, _)| trial.proved);
        proved.map(|(_, name)| name).collect()
    }

    /// So many fixes were refused that it teaches nothing for the next ones.
    fn is_contradicted(&self) -> bool {
        self.report.refused > self.report.fixes / firmware::learn::REFUSED
    }

    /// Coasts that have ended, at the horizon with most of them.
    fn coasts(&self) -> u16 {
        let most = self
            .trials
            .and_then(|trials| trials.ended.into_iter().max());
        most.unwrap_or(0)
    }
}

/// What interruptions of the navigation have cost.
fn costs(all: &[Interruption]) -> String {
    let said: Vec<String> = all.iter().map(Interruption::to_string).collect();
    match said.is_empty() {
        true => String::new(),
        false => format!("; {} (s after the first sample)", said.join("; ")),
    }
}

/// What is in force at the end of a drive, and since when.
#[must_use]
pub fn since(drive: &Drive) -> String {
    match drive.in_force_since() {
        None => "corrects nothing".to_owned(),
        Some(0) => "corrects from power-on".to_owned(),
        Some(since) => format!("corrects from {since} s after power-on"),
    }
}

/// Describes a drive with fixes. `device`: as the drive has left it; `before`: the networks that
/// were in use from power-on on.
#[must_use]
pub fn course(drive: &Drive, device: &Device, before: &Nets) -> Course {
    let at = |of: Option<&[[f32; 3]; 2]>| {
        let [gyro, accel] = of.copied().unwrap_or_default();
        let [a, b, c] = gyro.map(|x| f64::from(x).to_degrees());
        let [d, e, f] = accel.map(f64::from);
        [a, b, c, d, e, f]
    };
    let report = &drive.report;
    Course {
        correction: [at(drive.correction.first()), at(drive.correction.last())],
        in_force_since_s: drive.in_force_since(),
        navigates: report.navigates,
        contradicted: match report.navigates {
            true => 0,
            false => report.refused_alignments,
        },
        fixes: [report.fixes, report.refused],
        proved: drive.proved(),
        nearest: drive.diary.proofs.nearest(),
        stored_s: drive.stored_s.clone(),
        says: format!(
            "{}; {}{}{}",
            since(drive),
            learns(drive, device, before),
            biases(drive, device),
            if report.equal_scales { TIME_BASE } else { "" }
        ),
    }
}

const TIME_BASE: &str = "; all axes of the gyros have the same scale error, so the time base is \
                         wrong, and no map is learnt; remedy: measure the sample rate, and enter \
                         it as rate_hz";

/// Biases that are large against the unit file.
fn biases(drive: &Drive, device: &Device) -> String {
    let last = drive.diary.entries.last();
    let large = last.and_then(|of| {
        let [a, b, c, x, y, z] = of.estimate.map(f64::from);
        large([[a, b, c], [x, y, z]], sheet(device.configuration()))
    });
    large.map_or(String::new(), |says| format!("; {says}"))
}

/// What the learner has come to, or what it waits for.
fn learns(drive: &Drive, device: &Device, before: &Nets) -> String {
    let (report, proved) = (&drive.report, drive.proved().join("; "));
    let next = device.stored().0;
    match () {
        () if drive.given == 0 => "has had no fix to learn from".to_owned(),
        () if !report.navigates && report.refused_alignments > 0 => format!(
            "waits for its alignment in motion: samples and fixes contradicted each other {}, \
             residual {:.1}",
            match report.refused_alignments {
                1 => "once".to_owned(),
                n => format!("{n} times"),
            },
            report.residual
        ),
        () if !report.navigates => format!(
            "waits for its alignment: its heading is known by {}",
            match report.way {
                HeadingSource::None => "nothing",
                _ => "too little",
            }
        ),
        () if report.stored_harms && before.same_images(&Nets::NONE) => {
            "finds that what it remembers of earlier sessions would do harm, and does not use it"
                .to_owned()
        }
        () if report.stored_harms && next.same_images(&Nets::NONE) => {
            "has found that what it had stored does harm, and has taken it back for the next \
             power-on"
                .to_owned()
        }
        () if !next.same_images(before) && !proved.is_empty() => {
            format!("has proved \"{proved}\" and stored it for the next power-on")
        }
        () if !next.same_images(before) => "has stored other networks for the next power-on".into(),
        () if proved.is_empty() => match drive.diary.proofs.nearest() {
            Some(nearest) => format!(
                "has proved nothing: \"{}\" is the nearest, proof {} of 100 after {} coasts, {}{}",
                nearest.name,
                nearest.proof,
                drive.coasts(),
                nearest.pace(),
                costs(&drive.diary.proofs.interruptions)
            ),
            None => "has proved nothing".to_owned(),
        },
        () if drive.is_contradicted() => format!(
            "has proved \"{proved}\" and stores nothing: more than one fix in eight was refused"
        ),
        () => format!("has proved \"{proved}\" since the last record that was due"),
    }
}
