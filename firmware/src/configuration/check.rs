//! Ranges of all values.

use super::{Configuration, Sensor, Triad, UNKNOWN, Wheels};
use crate::align::LEAST_S;
use crate::control::Field;

/// Longest time for a correction at its limit to fade out, s. Until it has, no configuration is
/// accepted. So it must end, and each step of it must be more than a float rounds.
const FADE_S: f32 = 86_400.0;
/// The sensor is silent after so many periods of its samples at the soonest. With less than one,
/// each sample would be a gap, and no correction would ever move.
const PERIODS: f64 = 2.0;

impl Configuration {
    /// Checks the ranges of all values.
    ///
    /// # Errors
    /// The first field whose value is out of its range.
    pub fn check(&self) -> Result<(), Field> {
        let Self {
            identity,
            lines,
            receiver,
            vehicle,
            correction,
            ..
        } = self;
        let [w, x, y, z] = self.mounting;
        let norm = w * w + x * x + y * y + z * z;
        let bauds = 1_200..=12_000_000;
        let limit = [correction.limit.gyro, correction.limit.accel];
        let slew = [correction.slew.gyro, correction.slew.accel];
        let not_negative = |values: [f32; 2]| values.iter().all(|v| (0.0..1e3).contains(v));
        let tests = [
            (Field::Name, printable(&identity.name, 1)),
            (Field::Serial, printable(&identity.serial, 0)),
            (Field::SensorBaud, bauds.contains(&lines.sensor_baud)),
            (Field::ReceiverBaud, bauds.contains(&lines.receiver_baud)),
            (Field::CutThrough, !lines.cut_through || self.can_be_cut()),
            (Field::Rate, (1.0..=20_000.0).contains(&self.rate)),
            (
                Field::Mounting,
                self.mounting == UNKNOWN || (0.999..1.001).contains(&norm),
            ),
            (Field::Gyro, sheet(&self.gyro)),
            (Field::Accel, sheet(&self.accel)),
            (
                Field::LeverArm,
                receiver.lever_arm.iter().all(|m| m.abs() <= 100.0),
            ),
            (Field::FixDelay, (0.0..=1.0).contains(&receiver.fix_delay)),
            (
                Field::LeverArmSigma,
                (0.0..=100.0).contains(&receiver.lever_arm_sigma),
            ),
            (
                Field::FixDelaySigma,
                (0.0..=1.0).contains(&receiver.fix_delay_sigma),
            ),
            (
                Field::HeadingOffset,
                receiver.heading_offset.abs() <= core::f32::consts::PI,
            ),
            (Field::Speed, vehicle.speed > 0.0 && vehicle.speed <= 1000.0),
            (Field::Limit, not_negative(limit)),
            (Field::Slew, not_negative(slew) && fades(limit, slew)),
            (Field::Block, (0.1..=10.0).contains(&correction.block)),
            (
                Field::Align,
                (LEAST_S as f32..=3600.0).contains(&correction.align),
            ),
            (
                Field::Silence,
                (1000..=10_000_000).contains(&correction.silence_us)
                    && f64::from(correction.silence_us) * self.rate >= PERIODS * 1e6,
            ),
            (
                Field::Wheels,
                self.wheels.is_none_or(|wheels| rolls(&wheels)),
            ),
        ];
        tests
            .iter()
            .find(|(_, good)| !good)
            .map_or(Ok(()), |(field, _)| Err(*field))
    }

    /// Whether cut-through supports the sensor's format. It does not if no format is configured.
    fn can_be_cut(&self) -> bool {
        let Some(Sensor::Stream(configuration)) = self.sensor else {
            return false;
        };
        configuration.format().can_be_cut()
    }
}

/// Whether corrections at these limits fade out in a time that ends.
fn fades(limit: [f32; 2], slew: [f32; 2]) -> bool {
    let pairs = limit.iter().zip(slew);
    pairs
        .into_iter()
        .all(|(limit, slew)| *limit <= FADE_S * slew)
}

/// All values of the wheels are in their ranges.
fn rolls(wheels: &Wheels) -> bool {
    let Wheels {
        lever_arm,
        ahead,
        scale,
        noise,
        delay,
    } = *wheels;
    lever_arm.iter().all(|m| m.abs() <= 100.0)
        && (0.0..=100.0).contains(&ahead)
        && (0.0..=0.5).contains(&scale)
        && noise > 0.0
        && noise <= 10.0
        && (0.0..=1.0).contains(&delay)
}

/// ASCII without control characters, of at least `least` bytes.
fn printable(text: &str, least: usize) -> bool {
    text.len() >= least && text.bytes().all(|byte| (b' '..=b'~').contains(&byte))
}

/// All numbers of a triad are finite and not negative; those that divide are positive.
fn sheet(triad: &Triad) -> bool {
    let all = [
        triad.bias_in_run,
        triad.scale,
        triad.misalignment,
        triad.g_sensitivity,
    ];
    let positive = [triad.bias_turn_on, triad.white_noise, triad.range];
    all.iter().all(|value| (0.0..1e6).contains(value))
        && positive.iter().all(|value| *value > 0.0 && *value < 1e6)
}
