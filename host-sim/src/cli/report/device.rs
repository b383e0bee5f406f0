//! Reads a device for its report. Nothing in the device is changed: its black box goes on
//! recording.

use firmware::configuration::Configuration;
use host_core::error::Error;
use host_device::device::{Link, configuration, info, recording};
use host_report::unit::Readout;
use host_unit::Unit;

/// Data read from a device.
pub(super) struct DeviceData {
    /// The unit that the device is configured for.
    pub unit: Option<Unit>,
    pub readout: Readout,
    pub source: Vec<(String, String)>,
    pub warnings: Vec<String>,
}

/// Asks the device at a port. `unit`: the unit for which it should be configured.
pub(super) fn read(port: &str, baud: u32, unit: Option<&Unit>) -> Result<DeviceData, Error> {
    let mut link = Link::open("--from device:", port, baud)?;
    let link = &mut link;
    let info = info(link)?;
    let (health, counters) = (link.health()?, link.counters()?);
    let weights = link.images()?;
    let in_device = configuration(link)?;
    let mut missing = vec![];
    let black_box = recording(link);
    let black_box = black_box
        .map(|of| of.pages)
        .map_err(|error| error.to_string());
    if let Err(why) = &black_box {
        missing.push(format!("The black box could not be read: {why}."));
    }
    let warnings = differs(unit, in_device.as_ref());
    let unit = in_device.as_ref().and_then(Unit::of);
    if in_device.is_some() && unit.is_none() {
        missing.push(
            "Its configuration was not made from a unit file and cannot be shown as one.".into(),
        );
    }
    missing.push(
        "A device does not report samples, a track, the course of its learning, or the course of \
         its temperatures."
            .into(),
    );
    let pair = |label: &str, value: String| (label.to_owned(), value);
    let unknown = || "not configured".to_owned();
    let source = vec![
        pair("device", format!("{} at {port}", info.board)),
        pair("firmware", info.firmware.clone()),
        pair("configured for", info.name.clone().unwrap_or_else(unknown)),
        pair(
            "serial number configured",
            info.serial.clone().unwrap_or_else(unknown),
        ),
    ];
    Ok(DeviceData {
        readout: Readout {
            faults: host_device::device::faults::of_bits(health.faults),
            counters: host_device::device::named_counters(&counters),
            info,
            weights,
            black_box,
            missing,
        },
        unit,
        source,
        warnings,
    })
}

/// A warning if the device's configuration differs from the unit file's.
fn differs(unit: Option<&Unit>, in_device: Option<&Configuration>) -> Vec<String> {
    let same = match (unit.map(Unit::configuration), in_device) {
        (Some(Ok(wanted)), Some(in_device)) => wanted == *in_device,
        (Some(_), _) => false,
        (None, _) => true,
    };
    if same {
        return vec![];
    }
    vec![
        "The device is not configured for this unit: what it holds differs from the unit file. \
         Remedy: `host-sim device configure FILE`, or report with the unit file that it was \
         configured with."
            .into(),
    ]
}
