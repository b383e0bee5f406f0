//! Converts a unit file to the device's configuration.

use super::Unit;
use super::around::{Correction, MountingKnowledge};
use super::finding::Finding;
use super::mounting::Mounting;
use super::wheels::Wheels;
use firmware::compensator::Limit;
use firmware::configuration::{self, Configuration, Identity, NAME_LEN, SERIAL_LEN, SerialLines};
use firmware::control::Field;
use host_core::inertial::units::{DEG, DEG_PER_H, UG};

/// Default limit of a correction, in standard deviations of the bias.
const LIMIT_BIASES: f64 = configuration::LIMIT_SIGMAS as f64;
/// Default change of a correction per second, as a fraction of the limit.
const SLEW_SHARE: f64 = 1e-3;

impl Unit {
    /// The device's configuration, in SI.
    ///
    /// # Errors
    /// The first value that no device accepts.
    pub fn configuration(&self) -> Result<Configuration, Finding> {
        let Self {
            sensor,
            receiver,
            vehicle,
            ..
        } = self;
        let mounting = self.quaternion()?;
        let configuration = Configuration {
            identity: Identity {
                name: text::<NAME_LEN>("name", &self.name)?,
                serial: text::<SERIAL_LEN>("serial", &self.serial)?,
            },
            lines: SerialLines {
                sensor_baud: sensor.baud,
                parity: sensor.line_parity(),
                two_stop_bits: sensor.stop_bits == 2,
                receiver_baud: receiver.baud,
                pins: sensor.pins,
                cut_through: sensor.cut_through,
            },
            sensor: sensor.settings()?,
            rate: sensor.rate(),
            mounting,
            gyro: self.gyro.triad(),
            accel: self.accel.triad(),
            receiver: configuration::Receiver {
                protocol: receiver.protocol.into(),
                lever_arm: receiver.lever_arm_m.map(|m| m as f32),
                lever_arm_sigma: receiver.lever_arm_sigma() as f32,
                fix_delay: (receiver.fix_delay_ms * 1e-3) as f32,
                fix_delay_sigma: (receiver.fix_delay_sigma_ms * 1e-3) as f32,
                pulse: receiver.pulse,
                heading_offset: (receiver.heading_offset_deg * DEG) as f32,
            },
            vehicle: configuration::Vehicle {
                kind: vehicle.kind.into(),
                speed: vehicle.largest_speed_mps as f32,
            },
            correction: self.correction_settings(),
            inputs: self.networks.inputs(),
            wheels: self
                .wheels
                .as_ref()
                .map(Wheels::configuration)
                .transpose()?,
        };
        configuration.check().map_err(refused)?;
        Ok(configuration)
    }

    /// The device's mounting.
    fn quaternion(&self) -> Result<[f32; 4], Finding> {
        let q = self.mounting.rotation()?;
        if self.vehicle.mounting == MountingKnowledge::Known {
            return Ok([q.w, q.i, q.j, q.k].map(|x| x as f32));
        }
        if self.mounting == Mounting::default() {
            return Ok(configuration::UNKNOWN);
        }
        Err(Finding::wrong(
            "vehicle.mounting",
            "is \"unknown\", but the table [mounting] gives one",
            "delete one of them",
        ))
    }

    /// Largest correction of gyros and accelerometers, then its fastest change a second, SI.
    #[must_use]
    pub fn limits(&self) -> [[f64; 2]; 2] {
        let c: &Correction = &self.correction;
        let (g, a) = (&self.gyro, &self.accel);
        let gyro = || LIMIT_BIASES * g.bias_turn_on_dph.hypot(g.bias_in_run_dph);
        let accel = || LIMIT_BIASES * a.bias_turn_on_ug.hypot(a.bias_in_run_ug);
        let gyro = c.limit_gyro_dph.unwrap_or_else(gyro);
        let accel = c.limit_accel_ug.unwrap_or_else(accel);
        let slew_gyro = c.slew_gyro_dphps.unwrap_or(SLEW_SHARE * gyro);
        let slew_accel = c.slew_accel_ugps.unwrap_or(SLEW_SHARE * accel);
        [
            [gyro * DEG_PER_H, accel * UG],
            [slew_gyro * DEG_PER_H, slew_accel * UG],
        ]
    }

    fn correction_settings(&self) -> configuration::Correction {
        let correction = &self.correction;
        let [limit, slew] = self.limits().map(|[gyro, accel]| Limit {
            gyro: gyro as f32,
            accel: accel as f32,
        });
        configuration::Correction {
            mode: correction.mode.into(),
            activation: correction.activation.into(),
            limit,
            slew,
            block: correction.block_s as f32,
            align: correction.align_s as f32,
            silence_us: (self.sensor.silence_ms * 1e3).round() as u32,
            mark: correction.mark,
            check_rate: correction.check_rate,
        }
    }
}

/// Text that fits into the record.
fn text<const N: usize>(key: &str, text: &str) -> Result<heapless::String<N>, Finding> {
    let printable = text.bytes().all(|byte| (b' '..=b'~').contains(&byte));
    let fits = heapless::String::try_from(text).ok().filter(|_| printable);
    fits.ok_or_else(|| {
        Finding::wrong(
            key,
            format!("is '{text}'"),
            format!("give at most {N} letters, digits and signs of ASCII"),
        )
    })
}

/// The field of the file from which a field of the configuration comes.
#[must_use]
pub const fn key(field: Field) -> &'static str {
    match field {
        Field::Parity => "sensor.parity",
        Field::CutThrough => "sensor.cut_through",
        Field::Name => "name",
        Field::Serial => "serial",
        Field::SensorBaud => "sensor.baud",
        Field::ReceiverBaud => "receiver.baud",
        Field::Rate => "sensor.rate_hz",
        Field::Mounting => "mounting",
        Field::Gyro => "gyro",
        Field::Accel => "accel",
        Field::LeverArm => "receiver.lever_arm_m",
        Field::FixDelay => "receiver.fix_delay_ms",
        Field::LeverArmSigma => "receiver.lever_arm_sigma_m",
        Field::FixDelaySigma => "receiver.fix_delay_sigma_ms",
        Field::HeadingOffset => "receiver.heading_offset_deg",
        Field::Speed => "vehicle.largest_speed_mps",
        Field::Limit => "correction.limit_gyro_dph",
        Field::Slew => "correction.slew_gyro_dphps",
        Field::Block => "correction.block_s",
        Field::Align => "correction.align_s",
        Field::Silence => "sensor.silence_ms",
        Field::Wheels => "wheels",
    }
}

/// The finding for a field of the configuration that no device accepts.
fn refused(field: Field) -> Finding {
    Finding::wrong(
        key(field),
        "is out of the range that a device takes",
        "see the field's range in `host-sim unit schema`",
    )
}
