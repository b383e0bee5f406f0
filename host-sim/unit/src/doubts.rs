//! Values that are possible but implausible: the wrong unit, the wrong row of the datasheet.

use super::Unit;
use super::around::Kind;
use super::finding::Finding;
use super::sensor::FormatName;

/// Gyros with less bias than this are optical, deg/h.
const OPTICAL_DPH: f64 = 5.0;
/// Most angle random walk of an optical gyro, and of any gyro, deg/sqrt(h).
const OPTICAL_ARW: f64 = 0.5;
const MOST_ARW: f64 = 5.0;
/// Least angle random walk, deg/sqrt(h), of gyros with a bias of 1 deg/h, whose square root it
/// grows with, and the largest that is asked for: between all presets and those with a wrong unit.
const LEAST_ARW: f64 = 0.004;
const LEAST_ARW_COARSE: f64 = 0.05;

/// All doubts about a unit.
pub(super) fn of(unit: &Unit) -> Vec<Finding> {
    let mut found = gyro(unit);
    found.extend(accel(unit));
    found.extend(surroundings(unit));
    found
}

/// A finding if a condition holds.
fn doubt(when: bool, key: &str, problem: String, remedy: &str) -> Option<Finding> {
    when.then(|| Finding::doubtful(key, problem, remedy))
}

fn gyro(unit: &Unit) -> Vec<Finding> {
    let g = &unit.gyro;
    let arw = g.angle_random_walk_dpsqrth;
    let optical = g.bias_turn_on_dph < OPTICAL_DPH;
    [
        doubt(
            arw > MOST_ARW || (optical && arw > OPTICAL_ARW),
            "gyro.angle_random_walk_dpsqrth",
            format!(
                "is {arw} deg/sqrt(h), more than gyros of {} deg/h have",
                g.bias_turn_on_dph
            ),
            "if the datasheet gives deg/h/sqrt(Hz), divide by 60; if deg/s/sqrt(Hz), multiply by 60",
        ),
        doubt(
            arw < (LEAST_ARW * g.bias_turn_on_dph.max(0.0).sqrt()).min(LEAST_ARW_COARSE),
            "gyro.angle_random_walk_dpsqrth",
            format!(
                "is {arw} deg/sqrt(h), less than gyros of {} deg/h have",
                g.bias_turn_on_dph
            ),
            "if the datasheet gives deg/s/sqrt(Hz), multiply by 60",
        ),
        doubt(
            g.bias_turn_on_dph < 1e-4,
            "gyro.bias_turn_on_dph",
            format!("is {} deg/h, less than any gyro has", g.bias_turn_on_dph),
            "if the datasheet gives deg/s, multiply by 3600",
        ),
        doubt(
            g.bias_in_run_dph > g.bias_turn_on_dph,
            "gyro.bias_in_run_dph",
            format!(
                "is {} deg/h, more than the bias at power-on, {} deg/h",
                g.bias_in_run_dph, g.bias_turn_on_dph
            ),
            "the bias at power-on has the larger row of the datasheet: repeatability or temperature",
        ),
        doubt(
            g.bias_turn_on_dph > 3600.0 * g.range_dps,
            "gyro.bias_turn_on_dph",
            format!("is more than the range of {} deg/s", g.range_dps),
            "give the bias in deg/h and the range in deg/s",
        ),
        scale("gyro.scale_ppm", g.scale_ppm, g.bias_turn_on_dph > OPTICAL_DPH),
        misalignment("gyro.misalignment_mrad", g.misalignment_mrad),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn accel(unit: &Unit) -> Vec<Finding> {
    let a = &unit.accel;
    let vrw = a.velocity_random_walk_ugpsqrthz;
    [
        doubt(
            vrw < 0.5,
            "accel.velocity_random_walk_ugpsqrthz",
            format!("is {vrw} ug/sqrt(Hz), less than any accelerometer has"),
            "if the datasheet gives m/s/sqrt(h), multiply by 1700; if mg/sqrt(Hz), by 1000",
        ),
        doubt(
            vrw > 5000.0,
            "accel.velocity_random_walk_ugpsqrthz",
            format!("is {vrw} ug/sqrt(Hz), more than accelerometers of IMUs have"),
            "look at the unit of the datasheet's row",
        ),
        doubt(
            a.bias_turn_on_ug < 5.0,
            "accel.bias_turn_on_ug",
            format!("is {} ug, less than IMUs have", a.bias_turn_on_ug),
            "if the datasheet gives mg, multiply by 1000",
        ),
        doubt(
            a.bias_in_run_ug > a.bias_turn_on_ug,
            "accel.bias_in_run_ug",
            format!(
                "is {} ug, more than the bias at power-on, {} ug",
                a.bias_in_run_ug, a.bias_turn_on_ug
            ),
            "the bias at power-on has the larger row of the datasheet: repeatability or temperature",
        ),
        scale("accel.scale_ppm", a.scale_ppm, a.bias_turn_on_ug > 500.0),
        misalignment("accel.misalignment_mrad", a.misalignment_mrad),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// `coarse`: the sensor is too coarse for a scale factor of a few ppm.
fn scale(key: &str, ppm: f64, coarse: bool) -> Option<Finding> {
    let low = coarse && ppm > 0.0 && ppm < 10.0;
    let remedy = "if the datasheet gives per cent, multiply by 10000; mrad and ppm are 1000 apart";
    doubt(
        low || ppm > 50_000.0,
        key,
        format!("is {ppm} ppm, which is hardly meant"),
        remedy,
    )
}

fn misalignment(key: &str, mrad: f64) -> Option<Finding> {
    doubt(
        mrad > 50.0,
        key,
        format!(
            "is {mrad} mrad, that is {:.1} deg",
            mrad * 1e-3 / host_core::inertial::units::DEG
        ),
        "if the datasheet gives arcsec, multiply by 0.00485; ppm and urad, by 0.001",
    )
}

/// Largest plausible lever arm for a kind of vehicle, m (assumed).
const fn longest(kind: Kind) -> f64 {
    match kind {
        Kind::Land => 20.0,
        Kind::Air => 40.0,
        Kind::Ship => 100.0,
    }
}

fn receiver(unit: &Unit) -> Vec<Finding> {
    let receiver = &unit.receiver;
    let arm = receiver.lever_arm_m;
    let length = arm.iter().map(|m| m * m).sum::<f64>().sqrt();
    let longest = longest(unit.vehicle.kind);
    let sigma = receiver.lever_arm_sigma();
    let (delay, uncertain) = (receiver.fix_delay_ms, receiver.fix_delay_sigma_ms);
    let seconds = |ms: f64| ms > 0.0 && ms < 1.0;
    let heading = receiver.heading_offset_deg.abs();
    let radians = |angle: f64| (heading - angle).abs() < 0.01;
    use std::f64::consts::{FRAC_PI_2, PI};
    [
        doubt(
            length > longest,
            "receiver.lever_arm_m",
            format!("has a length of {length:.1} m, more than the vehicle (vehicle.kind)"),
            "give metres: forward, right, down",
        ),
        doubt(
            sigma > longest,
            "receiver.lever_arm_sigma_m",
            format!("is {sigma} m, more than the vehicle (vehicle.kind)"),
            "give the standard deviation in metres",
        ),
        doubt(
            seconds(delay),
            "receiver.fix_delay_ms",
            format!("is {delay} ms"),
            "give milliseconds: 0.1 s is 100",
        ),
        doubt(
            seconds(uncertain),
            "receiver.fix_delay_sigma_ms",
            format!("is {uncertain} ms"),
            "give milliseconds: 0.1 s is 100",
        ),
        doubt(
            delay == 0.0 && uncertain == 0.0 && !receiver.pulse,
            "receiver.fix_delay_ms",
            "is 0 ms with fix_delay_sigma_ms 0, but every fix takes time".into(),
            "leave both out, or give what the receiver's manual says",
        ),
        doubt(
            receiver.pulse && uncertain == 0.0,
            "receiver.fix_delay_sigma_ms",
            "is 0 with pulse = true: without pulses fix_delay_ms would count as exact".into(),
            "leave it out",
        ),
        doubt(
            radians(FRAC_PI_2) || radians(PI),
            "receiver.heading_offset_deg",
            format!("is {} deg", receiver.heading_offset_deg),
            "give degrees: pi / 2 is 90",
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn surroundings(unit: &Unit) -> Vec<Finding> {
    let sensor = &unit.sensor;
    let mut found = receiver(unit);
    for (table, format) in sensor.tables() {
        if format != sensor.format {
            found.push(Finding::doubtful(
                format!("sensor.{table}"),
                format!(
                    "has no effect, because the format is {}",
                    sensor.format.name()
                ),
                "leave the table out, or correct sensor.format",
            ));
        }
    }
    if sensor.format == FormatName::Detect && sensor.rate_hz.is_none() {
        found.push(Finding::doubtful(
            "sensor.rate_hz",
            "is missing, and detection does not find it for all formats",
            "give the rate",
        ));
    }
    found
}
