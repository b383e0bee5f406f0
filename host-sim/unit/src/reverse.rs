//! The unit file of a device's configuration: the reverse of [`Unit::configuration`].
//!
//! The configuration has single precision and SI units. Each number of the file is the shortest
//! decimal that becomes the same bits again.

use super::Unit;
use super::around::{
    Activation, Correction, Kind, Mode, MountingKnowledge, Protocol, Receiver, Vehicle,
};
use super::mounting::Mounting;
use super::networks::Networks;
use super::sensor::{Adis, FormatName, Parity, Sensor};
use super::triads::{Accel, Gyro, MRAD};
use super::wheels::Wheels;
use firmware::configuration::{self, Configuration, ReceiverProtocol};
use firmware::control;
use host_core::inertial::units::{DEG, DEG_PER_H, DEG_PER_SQRT_H, G0, PPM, UG, UG_PER_SQRT_HZ};

impl Unit {
    /// The unit file that gives exactly this configuration again. `None` if there is none, because
    /// the configuration was not made from a unit file.
    #[must_use]
    pub fn of(configuration: &Configuration) -> Option<Self> {
        let (known, mounting) = if configuration.mounting == configuration::UNKNOWN {
            (MountingKnowledge::Unknown, Mounting::default())
        } else {
            (
                MountingKnowledge::Known,
                Mounting::of(configuration.mounting)?,
            )
        };
        let unit = Self {
            name: configuration.identity.name.to_string(),
            serial: configuration.identity.serial.to_string(),
            sensor: sensor(configuration)?,
            mounting,
            gyro: gyro(&configuration.gyro),
            accel: accel(&configuration.accel),
            receiver: self::receiver(configuration),
            vehicle: Vehicle {
                kind: match configuration.vehicle.kind {
                    configuration::VehicleKind::Land => Kind::Land,
                    configuration::VehicleKind::Ship => Kind::Ship,
                    configuration::VehicleKind::Air => Kind::Air,
                },
                largest_speed_mps: shortest(configuration.vehicle.speed, |mps| mps as f32, 1.0),
                mounting: known,
            },
            wheels: configuration.wheels.as_ref().map(Wheels::of),
            correction: correction(&configuration.correction),
            networks: Networks::of(&configuration.inputs),
            prior: None,
            simulation: None,
        };
        (unit.configuration().as_ref() == Ok(configuration)).then_some(unit)
    }
}

fn receiver(configuration: &Configuration) -> Receiver {
    let receiver = &configuration.receiver;
    Receiver {
        protocol: match receiver.protocol {
            ReceiverProtocol::Ubx => Protocol::Ubx,
            ReceiverProtocol::Nmea => Protocol::Nmea,
            ReceiverProtocol::Novatel => Protocol::Novatel,
            ReceiverProtocol::Sbf => Protocol::Sbf,
            ReceiverProtocol::Detect => Protocol::Detect,
        },
        baud: configuration.lines.receiver_baud,
        lever_arm_m: receiver.lever_arm.map(|m| scaled(m, 1.0)),
        lever_arm_sigma_m: Some(scaled(receiver.lever_arm_sigma, 1.0)),
        fix_delay_ms: scaled(receiver.fix_delay, 1e-3),
        fix_delay_sigma_ms: scaled(receiver.fix_delay_sigma, 1e-3),
        pulse: receiver.pulse,
        heading_offset_deg: scaled(receiver.heading_offset, DEG),
    }
}

/// The shortest decimal that `convert` turns into `value`. `convert` multiplies by about `factor`.
pub(super) fn shortest(value: f32, convert: impl Fn(f64) -> f32, factor: f64) -> f64 {
    let near = f64::from(value) / factor;
    let decimal = |digits: usize| format!("{near:.digits$e}").parse().unwrap_or(near);
    let same = |decimal: &f64| convert(*decimal).to_bits() == value.to_bits();
    (0..17).map(decimal).find(same).unwrap_or(near)
}

fn sensor(configuration: &Configuration) -> Option<Sensor> {
    let lines = &configuration.lines;
    let of = match &configuration.sensor {
        Some(configuration::Sensor::Stream(format)) => Sensor::of_stream(*format),
        Some(configuration::Sensor::Spi(settings)) => Sensor {
            adis: Some(Adis::of(settings)?),
            ..Sensor::of(FormatName::AdisSpi)
        },
        None => Sensor::of(FormatName::Detect),
    };
    Some(Sensor {
        rate_hz: Some(configuration.rate),
        baud: lines.sensor_baud,
        parity: match lines.parity {
            configuration::Parity::None => Parity::None,
            configuration::Parity::Even => Parity::Even,
            configuration::Parity::Odd => Parity::Odd,
        },
        stop_bits: 1 + u8::from(lines.two_stop_bits),
        pins: lines.pins,
        cut_through: lines.cut_through,
        silence_ms: f64::from(configuration.correction.silence_us) / 1e3,
        ..of
    })
}

/// As [`shortest`], of a number that is multiplied by `factor`.
pub(super) fn scaled(value: f32, factor: f64) -> f64 {
    shortest(value, |decimal| (decimal * factor) as f32, factor)
}

fn gyro(triad: &configuration::Triad) -> Gyro {
    Gyro {
        bias_turn_on_dph: scaled(triad.bias_turn_on, DEG_PER_H),
        bias_in_run_dph: scaled(triad.bias_in_run, DEG_PER_H),
        angle_random_walk_dpsqrth: scaled(triad.white_noise, DEG_PER_SQRT_H),
        scale_ppm: scaled(triad.scale, PPM),
        misalignment_mrad: scaled(triad.misalignment, MRAD),
        g_sensitivity_dphpg: shortest(
            triad.g_sensitivity,
            |dphpg| (dphpg * DEG_PER_H / G0) as f32,
            DEG_PER_H / G0,
        ),
        range_dps: scaled(triad.range, DEG),
    }
}

fn accel(triad: &configuration::Triad) -> Accel {
    Accel {
        bias_turn_on_ug: scaled(triad.bias_turn_on, UG),
        bias_in_run_ug: scaled(triad.bias_in_run, UG),
        velocity_random_walk_ugpsqrthz: scaled(triad.white_noise, UG_PER_SQRT_HZ),
        scale_ppm: scaled(triad.scale, PPM),
        misalignment_mrad: scaled(triad.misalignment, MRAD),
        second_order_ugpg2: shortest(
            triad.g_sensitivity,
            |ugpg2| (ugpg2 * UG / (G0 * G0)) as f32,
            UG / (G0 * G0),
        ),
        range_g: scaled(triad.range, G0),
    }
}

fn correction(settings: &configuration::Correction) -> Correction {
    let [limit, slew] = [&settings.limit, &settings.slew];
    Correction {
        mode: match settings.mode {
            control::Mode::Bypass => Mode::Bypass,
            control::Mode::Frozen => Mode::Frozen,
            control::Mode::Shadow => Mode::Shadow,
            control::Mode::Learn => Mode::Learn,
        },
        activation: match settings.activation {
            configuration::Activation::Commanded => Activation::Commanded,
            configuration::Activation::Standstill => Activation::Standstill,
            configuration::Activation::Faded => Activation::Faded,
            configuration::Activation::NextPowerOn => Activation::NextPowerOn,
            configuration::Activation::FirstRest => Activation::FirstRest,
        },
        limit_gyro_dph: Some(scaled(limit.gyro, DEG_PER_H)),
        limit_accel_ug: Some(scaled(limit.accel, UG)),
        slew_gyro_dphps: Some(scaled(slew.gyro, DEG_PER_H)),
        slew_accel_ugps: Some(scaled(slew.accel, UG)),
        block_s: scaled(settings.block, 1.0),
        align_s: scaled(settings.align, 1.0),
        mark: settings.mark,
        check_rate: settings.check_rate,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::SHORT;
    use super::*;

    /// A file that says something other than the default in every field that all formats have.
    const LONG: &str = "\
name = 'long'
serial = 'N25581'
[sensor]
format = 'kvh'
rate_hz = 750
baud = 1843200
parity = 'odd'
stop_bits = 2
pins = 1
silence_ms = 12.5
kvh = { rotation = 'rate', angle = 'deg' }
[mounting]
roll_deg = 12.345
pitch_deg = -3.3
heading_deg = 271.07
[gyro]
bias_turn_on_dph = 250.3
bias_in_run_dph = 0.51
angle_random_walk_dpsqrth = 0.157
scale_ppm = 511
misalignment_mrad = 1.07
g_sensitivity_dphpg = 7.03
range_dps = 399
[accel]
bias_turn_on_ug = 19001
bias_in_run_ug = 53
velocity_random_walk_ugpsqrthz = 61.7
scale_ppm = 313
misalignment_mrad = 0.97
second_order_ugpg2 = 101
range_g = 9.7
[receiver]
protocol = 'novatel'
baud = 230400
lever_arm_m = [1.01, -0.57, -1.53]
lever_arm_sigma_m = 0.17
fix_delay_ms = 87.3
fix_delay_sigma_ms = 13.7
pulse = true
heading_offset_deg = -91.7
[wheels]
lever_arm_m = [-1.23, 0.04, 0.71]
axle = 'steered'
wheelbase_m = 2.71
scale_percent = 1.3
noise_mps = 0.07
delay_ms = 23
[vehicle]
kind = 'air'
largest_speed_mps = 83.1
[correction]
mode = 'learn'
activation = 'standstill'
limit_gyro_dph = 1003
limit_accel_ug = 31007
slew_gyro_dphps = 1.7
slew_accel_ugps = 13.1
block_s = 0.7
align_s = 61.3
mark = false
check_rate = false
";

    #[test]
    fn every_field_of_a_file_comes_back_as_it_was_written() {
        let unit: Unit = toml::from_str(LONG).unwrap();
        let configuration = unit.configuration().unwrap();
        let back = Unit::of(&configuration).expect("it was made from a file");
        assert_eq!(back, unit);
        let text = toml::to_string(&back).unwrap();
        assert_eq!(toml::from_str::<Unit>(&text).unwrap(), unit);
    }

    /// `Unit::of` compares both configurations itself.
    #[test]
    fn every_format_and_mounting_comes_back() {
        let unit: Unit = toml::from_str(SHORT).unwrap();
        for name in FormatName::ALL
            .iter()
            .filter(|n| **n != FormatName::AdisSpi)
        {
            let mut unit = unit.clone();
            unit.sensor = Sensor::of(*name);
            let configuration = unit.configuration().unwrap();
            assert!(Unit::of(&configuration).is_some(), "{name:?}");
        }
        for axes in ["y x -z", "-y x z", "z -y x", "-x -y z", "-z y x"] {
            let mut unit = unit.clone();
            unit.mounting.axes = Some(axes.into());
            let configuration = unit.configuration().unwrap();
            let back = Unit::of(&configuration).unwrap_or_else(|| panic!("{axes}"));
            assert_eq!(back.mounting.axes.as_deref(), Some(axes));
        }
        for model in ["ADIS16495-2", "ADIS16505-3", "ADIS16470"] {
            let mut unit = unit.clone();
            unit.sensor = Sensor::of(FormatName::AdisSpi);
            unit.sensor.adis = Some(Adis {
                model: model.into(),
                framed: true,
            });
            let configuration = unit.configuration().unwrap();
            assert!(Unit::of(&configuration).is_some(), "{model}");
        }
    }

    /// Datagrams and outputs of a STIM300 that differ from the defaults.
    #[test]
    fn the_variants_of_a_stim300_come_back() {
        let mut unit: Unit = toml::from_str(SHORT).unwrap();
        let table = "datagram = '0xA7'\ngyro_output = 'average'\naccel_output = 'rate'\n\
                     accel_range_g = 30\nline_end = 'crlf'\nask = false\nanswer_ms = 0\n\
                     family = 'pps'";
        unit.sensor.stim300 = Some(toml::from_str(table).unwrap());
        unit.sensor.rate_hz = Some(500.0);
        let back = Unit::of(&unit.configuration().unwrap()).expect("it comes back");
        assert_eq!(back.sensor.stim300, unit.sensor.stim300);
    }
}
