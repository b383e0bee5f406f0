//! Reception of the satellite receiver's data by a device, and what is missing.

use super::link::Link;
use firmware::configuration::{Configuration, ReceiverProtocol};
use firmware::wire::ReceiverFormat;
use firmware::wire::command::{self, Request, Response};
use firmware::wire::receiver::ReceiverStatus;
use host_core::error::Error;
use serde::Serialize;

/// Reception of the receiver's data by a device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Receiver {
    /// Configured protocol; `None` without a configuration.
    pub configured: Option<&'static str>,
    /// Protocol on the line; `None` while no message has been decoded.
    pub protocol: Option<&'static str>,
    /// Time of validity of the last good fix, s of the GPS week.
    pub fix_time_s: Option<f64>,
    /// Its age when it was completely received, ms; needs a time pulse.
    pub fix_age_ms: Option<f64>,
    /// Edges of the time pulse since the configuration.
    pub pulses: u32,
    /// What is missing, each with its remedy.
    pub missing: Vec<&'static str>,
}

/// Asks a device for its receiver's state. `configuration`: the device's own.
pub(super) fn receiver(
    link: &mut Link,
    configuration: Option<&Configuration>,
) -> Result<Receiver, Error> {
    let status = link.ask(&Request::GetReceiver, |answer| match answer {
        Response::Receiver(status) => Some(*status),
        _ => None,
    })?;
    Ok(Receiver::new(&status, configuration))
}

impl Receiver {
    fn new(status: &ReceiverStatus, configuration: Option<&Configuration>) -> Receiver {
        let wired = configuration.is_some_and(|of| of.receiver.pulse);
        let mut missing = Vec::new();
        if status.format.is_none() {
            missing.push(
                "no message was understood; check wiring, bit rate and protocol of the receiver's \
                 line",
            );
        } else if status.time_ms.is_none() {
            missing.push(
                "no good fix; check the antenna's view of the sky and that the receiver sends \
                 position and velocity",
            );
        }
        if wired && status.pulses == 0 {
            missing.push("no time pulse; check its wire and that the receiver sends it");
        } else if wired && status.time_ms.is_some() && status.age_us.is_none() {
            missing.push(
                "no believable time pulse; check that it rises (not falls) at whole seconds, once a \
                 second, and that receiver.fix_delay_ms is right within 5 fix_delay_sigma_ms",
            );
        }
        Receiver {
            configured: configuration.map(|of| protocol_name(of.receiver.protocol)),
            protocol: status.format.map(format_name),
            fix_time_s: status.time_ms.map(|ms| f64::from(ms) / 1e3),
            fix_age_ms: status.age_us.map(|us| f64::from(us) / 1e3),
            pulses: status.pulses,
            missing,
        }
    }
}

/// Lever arm and delay of the receiver's fixes: as configured, then as estimated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Antenna {
    /// From the IMU to the antenna: forward, right, down, m.
    pub lever_arm_m: [f32; 3],
    /// Its standard deviation along each axis, m; 0: exactly as configured.
    pub lever_arm_sigma_m: [f32; 3],
    /// Least age of a fix when it arrives, ms.
    pub fix_delay_ms: f32,
    /// Its standard deviation, ms; 0: exactly as configured.
    pub fix_delay_sigma_ms: f32,
}

impl From<command::Antenna> for Antenna {
    fn from(known: command::Antenna) -> Self {
        Self {
            lever_arm_m: known.lever_arm,
            lever_arm_sigma_m: known.lever_arm_sigma,
            fix_delay_ms: known.fix_delay * 1e3,
            fix_delay_sigma_ms: known.fix_delay_sigma * 1e3,
        }
    }
}

fn protocol_name(protocol: ReceiverProtocol) -> &'static str {
    match protocol {
        ReceiverProtocol::Detect => "detect",
        ReceiverProtocol::Ubx => format_name(ReceiverFormat::Ubx),
        ReceiverProtocol::Nmea => format_name(ReceiverFormat::Nmea),
        ReceiverProtocol::Novatel => format_name(ReceiverFormat::Novatel),
        ReceiverProtocol::Sbf => format_name(ReceiverFormat::Sbf),
    }
}

fn format_name(format: ReceiverFormat) -> &'static str {
    match format {
        ReceiverFormat::Ubx => "ubx",
        ReceiverFormat::Nmea => "nmea",
        ReceiverFormat::Novatel => "novatel",
        ReceiverFormat::Sbf => "sbf",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named() {
        let mut configuration = Configuration::default();
        configuration.receiver.pulse = true;
        let missing = |status: &ReceiverStatus| Receiver::new(status, Some(&configuration)).missing;
        let mut status = ReceiverStatus::default();
        assert!(matches!(&missing(&status)[..], [a, b]
            if a.contains("no message") && b.contains("no time pulse")));
        status.format = Some(ReceiverFormat::Nmea);
        status.pulses = 7;
        assert!(matches!(&missing(&status)[..], [a] if a.contains("no good fix")));
        status.time_ms = Some(1000);
        assert!(matches!(&missing(&status)[..], [a] if a.contains("believable")));
        status.age_us = Some(90_000);
        assert!(missing(&status).is_empty());
        let unconfigured = Receiver::new(&ReceiverStatus::default(), None);
        assert_eq!(
            (unconfigured.configured, unconfigured.missing.len()),
            (None, 1)
        );
    }
}
