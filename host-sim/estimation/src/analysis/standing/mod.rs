//! What logs of sensors at rest show of a unit: noise, walk of the biases, their scatter from
//! power-on to power-on, and laws of the temperature. Each log is one power-on.
//!
//! Only times at rest count ([`rests`]). The longest one gives the noise; every minute at rest is a
//! point of the biases. Of the accelerometers only the component along gravity is known, because a
//! tilt of 0.06 degrees is 1 mg across it.

mod laws;
mod log;
mod rests;
mod sheet;

pub use laws::{Law, Scatter};
pub use log::{Log, Temperature, gravity};
pub use rests::{Move, Rests, Stretch, rests};
pub(super) use sheet::three;
pub use sheet::{Number, Sheet, nearest, sheet};

use super::allan::findings::Findings;
use super::allan::{Column, Kind};
use host_core::error::Error;
use host_core::inertial::units::{DEG, G0};
use host_core::list::{IN_MEMORY, Writer};
use host_io::recordings::columns::IMU;
use laws::Point;
use nalgebra::Vector3;
use serde::Serialize;

/// Shortest rest that is analysed, s.
pub const LEAST_S: f64 = 60.0;
/// The Earth's rotation, rad/s.
pub const EARTH: f64 = 7.292_115e-5;
/// Length of a point of the biases, s.
const POINT_S: f64 = 60.0;

/// Results of one log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfLog {
    /// File.
    pub name: String,
    /// Samples per second.
    pub rate_hz: f64,
    /// Time at rest that was used, s.
    pub rest_s: f64,
    /// Times at rest and in motion.
    pub rests: Rests,
    /// Least and largest temperature at rest, degrees C.
    pub range_degc: Option<[f64; 2]>,
    /// Mean rate at rest, rad/s.
    #[serde(serialize_with = "axes")]
    pub rate: Vector3<f64>,
    /// Mean specific force at rest less gravity, m/s2, and the standard deviation of gravity.
    pub above_gravity: [f64; 2],
    /// Components of the gyros' bias that are known: along gravity and along the horizontal part
    /// of the Earth's rotation, or those of each axis, rad/s.
    pub gyro_bias: Vec<f64>,
}

/// Results of several logs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LogResults {
    /// One for each log.
    pub logs: Vec<OfLog>,
    /// Noise in the longest rest of all.
    pub noise: Findings,
    /// Law of the temperature of the gyros' biases, rad/s per K.
    pub gyro_law: Option<Law>,
    /// Law of the temperature of the force along gravity, m/s2 per K, in x.
    pub accel_law: Option<Law>,
    /// Scatter of the gyros' biases over the logs, rad/s.
    pub gyro_scatter: Option<Scatter>,
    /// Scatter of the force along gravity over the logs, m/s2.
    pub accel_scatter: Option<Scatter>,
    /// Notes for the reader.
    pub notes: Vec<String>,
}

/// Analyses the logs of one unit.
///
/// # Errors
/// A log has no rest of [`LEAST_S`], or its units are wrong; temporary files cannot be written.
pub fn shown(logs: &[Log]) -> Result<LogResults, Error> {
    let (mut found, mut points, mut notes) = (Vec::new(), [vec![], vec![]], Vec::new());
    let mut longest: Option<(&Log, Stretch)> = None;
    for (number, log) in logs.iter().enumerate() {
        let rests = rests(log, LEAST_S);
        let Some(best) = rests
            .stretches
            .iter()
            .max_by(|a, b| a.seconds().total_cmp(&b.seconds()))
        else {
            return Err(no_rest(log, &rests));
        };
        if longest
            .as_ref()
            .is_none_or(|(_, s)| s.seconds() < best.seconds())
        {
            longest = Some((log, best.clone()));
        }
        let each = minutes(log, number, &rests);
        notes.extend(left_out(log, &rests));
        found.push(of_log(log, rests, &each));
        for (all, of) in points.iter_mut().zip(each) {
            all.extend(of);
        }
    }
    let Some((log, stretch)) = longest else {
        return Err(Error::Option {
            option: "LOG".into(),
            problem: "is not given".into(),
            remedy: "give at least one recording at rest".into(),
        });
    };
    let source = format!("{}, {:.0} s at rest", log.name, stretch.seconds());
    let noise = Findings::of(source, columns(log, &stretch)?, None)?;
    let (gyro_law, gyro_scatter) = laws::of(&points[0], logs.len(), 3);
    let (accel_law, accel_scatter) = laws::of(&points[1], logs.len(), 1);
    notes.extend(turned(&found));
    notes.extend(noise.notes.iter().cloned());
    for log in logs {
        notes.extend(log.notes.iter().map(|note| format!("{}: {note}", log.name)));
    }
    Ok(LogResults {
        logs: found,
        noise,
        gyro_law,
        accel_law,
        gyro_scatter,
        accel_scatter,
        notes,
    })
}

/// The axes of a vector in JSON.
fn axes<S: serde::Serializer>(of: &Vector3<f64>, into: S) -> Result<S::Ok, S::Error> {
    [of.x, of.y, of.z].serialize(into)
}

/// The points of gyros and accelerometers.
fn minutes(log: &Log, number: usize, rests: &Rests) -> [Vec<Point>; 2] {
    let length = ((POINT_S * log.rate_hz).round() as usize).max(1);
    let mut points = [vec![], vec![]];
    for stretch in &rests.stretches {
        let mut first = stretch.samples.start;
        while first + length <= stretch.samples.end {
            let samples = log.samples.block(first..first + length);
            let sum = |f: fn(&host_core::inertial::sins::Increment) -> Vector3<f64>| {
                samples.iter().map(f).sum::<Vector3<f64>>() * (log.rate_hz / length as f64)
            };
            let (rate, force) = (sum(|s| s.dtheta), sum(|s| s.dv));
            let celsius = log.temperature.as_ref();
            let celsius = celsius.and_then(|t| t.at(log.time(first + length / 2)));
            let point = |value| Point {
                log: number,
                celsius,
                value,
            };
            points[0].push(point(rate));
            points[1].push(point(Vector3::x() * force.norm()));
            first += length;
        }
    }
    points
}

fn of_log(log: &Log, rests: Rests, [gyro, accel]: &[Vec<Point>; 2]) -> OfLog {
    let mean =
        |of: &[Point]| of.iter().map(|p| p.value).sum::<Vector3<f64>>() / of.len().max(1) as f64;
    let rate = mean(gyro);
    let [gravity, sigma] = log.gravity();
    let temperatures = gyro.iter().filter_map(|p| p.celsius);
    let [least, most] = temperatures.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], t| {
        [a.min(t), b.max(t)]
    });
    OfLog {
        name: log.name.clone(),
        rate_hz: log.rate_hz,
        rest_s: rests.stretches.iter().map(Stretch::seconds).sum(),
        range_degc: (least <= most).then_some([least, most]),
        rate,
        above_gravity: [mean(accel).x - gravity, sigma],
        gyro_bias: gyro_bias(log, &rate, rests.stretches.first()),
        rests,
    }
}

/// The components of the gyros' bias that a rest shows. Where the rate is far above the Earth's,
/// those of the axes; else with a site the vertical and the northern one; else none.
fn gyro_bias(log: &Log, rate: &Vector3<f64>, rest: Option<&Stretch>) -> Vec<f64> {
    const FAR: f64 = 10.0;
    if rate.norm() > FAR * EARTH {
        return rate.iter().copied().collect();
    }
    let (Some(site), Some(rest)) = (&log.site, rest) else {
        return vec![];
    };
    let up = rest.force.normalize();
    let (sin, cos) = site.lat.sin_cos();
    let across = (rate - up * rate.dot(&up)).norm();
    vec![rate.dot(&up) - EARTH * sin, across - EARTH * cos]
}

/// The samples of a stretch as columns.
fn columns(log: &Log, stretch: &Stretch) -> Result<Vec<Column>, Error> {
    let named = IMU[1..].iter().enumerate();
    let mut columns: Vec<Column> = named
        .map(|(i, name)| Column {
            name: (*name).to_owned(),
            kind: if i < 3 { Kind::Gyro } else { Kind::Accel },
            rate_hz: log.rate_hz,
            scale: 1.0,
            values: Writer::new(IN_MEMORY),
        })
        .collect();
    for sample in log.samples.part(stretch.samples.clone()).each() {
        for (column, value) in columns
            .iter_mut()
            .zip(sample.dtheta.iter().chain(&sample.dv))
        {
            column.values.push(*value)?;
        }
    }
    log.samples.check()?;
    Ok(columns)
}

/// The error of a log that moves, or is too short.
fn no_rest(log: &Log, rests: &Rests) -> Error {
    let whole = log.samples.len() as f64 / log.rate_hz;
    let longest = rests.longest_s;
    let moving: f64 = rests.moves.iter().map(|m| m.to_s - m.from_s).sum();
    let how_often = match moving > 0.9 * whole {
        true => "throughout".into(),
        false => times(rests.moves.len()),
    };
    let (problem, remedy) = match (rests.moves.first(), rests.gaps.first()) {
        (Some(first), _) => (
            format!(
                "is not at rest: it moves {how_often} in {whole:.0} s, first at {:.1} s by {:.2} \
                 deg/s and {:.3} m/s2 within a second; its longest rest lasts {longest:.0} s",
                first.from_s, first.rate_dps, first.force_mps2
            ),
            "record the sensor on a firm table with nobody near",
        ),
        (None, Some(gap)) => (
            format!(
                "lacks samples, first at {gap:.3} s; its longest whole part lasts {longest:.0} s"
            ),
            "record without losing samples, or cut the file there",
        ),
        (None, None) => (
            format!("lasts {whole:.0} s"),
            "record for two hours or longer",
        ),
    };
    Error::Option {
        option: log.name.clone(),
        problem: format!("{problem}; {LEAST_S} s at rest are needed"),
        remedy: remedy.into(),
    }
}

pub(super) fn times(count: usize) -> String {
    match count {
        1 => "once".into(),
        n => format!("{n} times"),
    }
}

/// A note on what is left out of a log.
fn left_out(log: &Log, rests: &Rests) -> Vec<String> {
    let mut notes = vec![];
    if let Some(first) = rests.moves.first() {
        let all: f64 = rests.moves.iter().map(|m| m.to_s - m.from_s).sum();
        notes.push(format!(
            "{}: it moves {}, {all:.0} s in all, first from {:.1} to {:.1} s by {:.2} deg/s and \
             {:.3} m/s2; only its rests of {LEAST_S} s and longer are used",
            log.name,
            times(rests.moves.len()),
            first.from_s,
            first.to_s,
            first.rate_dps,
            first.force_mps2
        ));
    }
    if let Some(gap) = rests.gaps.first() {
        notes.push(format!(
            "{}: samples are missing {}, first before {gap:.3} s; no rest reaches across",
            log.name,
            times(rests.gaps.len())
        ));
    }
    notes
}

/// Notes on logs that differ in attitude, or turn all the time.
fn turned(logs: &[OfLog]) -> Vec<String> {
    let mut notes = vec![];
    let force = |of: &OfLog| of.rests.stretches.first().map(|s| s.force);
    let first = logs.first().and_then(force);
    let angle = |of: &OfLog| Some(first?.angle(&force(of)?) / DEG);
    if let Some((of, angle)) = logs
        .iter()
        .find_map(|l| angle(l).filter(|a| *a > 2.0).map(|a| (l, a)))
    {
        notes.push(format!(
            "{}: the sensor stands {angle:.0} degrees off its attitude in the first log, so what \
             is new at a power-on also holds what depends on the attitude",
            of.name
        ));
    }
    for of in logs.iter().filter(|of| of.rate.norm() > DEG) {
        notes.push(format!(
            "{}: the mean rate is {:.2} deg/s: a bias of the gyros, if the sensor was not turning",
            of.name,
            of.rate.norm() / DEG
        ));
    }
    let slow = |of: &&OfLog| (of.above_gravity[0] / G0).abs() > 0.05;
    for of in logs.iter().filter(slow) {
        notes.push(format!(
            "{}: the specific force is {:.2} m/s2 off gravity",
            of.name, of.above_gravity[0]
        ));
    }
    notes
}

#[cfg(test)]
mod tests;
