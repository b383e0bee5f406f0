//! The fault bits of a device in words, each with its remedy.

use firmware::wire::command::fault;
use serde::Serialize;

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// Number of its bit in `Health.faults`.
    pub bit: u32,
    /// Its name in the interface control document.
    pub name: &'static str,
    /// What is wrong, as a sentence.
    pub says: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

const fn row(mask: u32, name: &'static str, says: &'static str, remedy: &'static str) -> Fault {
    Fault {
        bit: mask.trailing_zeros(),
        name,
        says,
        remedy,
    }
}

/// All faults.
pub const FAULTS: [Fault; 23] = [
    row(
        fault::SILENT,
        "SILENT",
        "the sensor sends nothing",
        "check its power, its cable, and that its output is on",
    ),
    row(
        fault::UNKNOWN_FORMAT,
        "UNKNOWN_FORMAT",
        "bytes come from the sensor, but no frames of the configured format, or of any known one",
        "check format and bit rate in the unit's file against the sensor's settings",
    ),
    row(
        fault::UNITS,
        "UNITS",
        "the scale or the rate of the sensor's values is not known, so nothing is corrected",
        "complete the sensor's variant in the unit's file; integrated values cannot be corrected",
    ),
    row(
        fault::NETWORK,
        "NETWORK",
        "the last step of the networks failed; the estimate before it stays in force",
        "set the mode bypass; load other weights, or let the device learn again",
    ),
    row(
        fault::SATURATED,
        "SATURATED",
        "a corrected value did not fit into its field and was held at the field's end",
        "check that the sensor moves within its range",
    ),
    row(
        fault::OUTPUT_FULL,
        "OUTPUT_FULL",
        "the last frame found no room on the navigation line and was dropped",
        "raise the bit rate of the sensor's line, or lower the sensor's rate",
    ),
    row(
        fault::PASS_THROUGH,
        "PASS_THROUGH",
        "the device has stepped aside: bytes pass unread",
        "remove the other faults, then set the mode again: host-sim device mode",
    ),
    row(
        fault::SENSOR,
        "SENSOR",
        "the sensor itself calls some axis invalid",
        "look up the sensor's status in its manual",
    ),
    row(
        fault::STORE,
        "STORE",
        "the last attempt to store weights and configuration failed",
        "try again: host-sim device store; if it fails again, the flash is worn",
    ),
    row(
        fault::NOT_CONFIGURED,
        "NOT_CONFIGURED",
        "the device has no configuration and only passes bytes",
        "configure it: host-sim device configure FILE",
    ),
    row(
        fault::RATE,
        "RATE",
        "the samples come at another rate than the frames or the unit's file say",
        "set the sensor's rate and that of the unit's file to the same value",
    ),
    row(
        fault::GRAVITY,
        "GRAVITY",
        "at rest, the specific force is not within 5 % of gravity",
        "check the accelerometers' units and range in the unit's file",
    ),
    row(
        fault::EARTH_RATE,
        "EARTH_RATE",
        "at rest, the rate is neither the Earth's nor within the bias of the datasheet",
        "check the gyros' units and their bias at turn-on in the unit's file",
    ),
    row(
        fault::AXES,
        "AXES",
        "at rest, gravity is not on the axis, or not of the sign, that the mounting says",
        "check the mounting in the unit's file against the sensor in the vehicle",
    ),
    row(
        fault::STUCK,
        "STUCK",
        "the sensor repeats itself: its counter or all its values do not change",
        "restart the sensor; if it stays so, the sensor is broken",
    ),
    row(
        fault::WEIGHTS,
        "WEIGHTS",
        "the weights were learnt by a sensor with another serial number and are no longer used",
        "let the device learn again, or upload the weights of this sensor: device weights put FILE",
    ),
    row(
        fault::LEARNER,
        "LEARNER",
        "the learner fell behind and was stopped; what is in force stays",
        "lower the sensor's rate or the receiver's, then set the mode bypass and learn again",
    ),
    row(
        fault::TIME_BASE,
        "TIME_BASE",
        "all gyro axes have the same scale error, more than 0.5 %: the time base is wrong; no map \
         is learnt",
        "measure the sensor's sample rate, and enter it as rate_hz in the unit's file",
    ),
    row(
        fault::CLOCK,
        "CLOCK",
        "the board does not run on the crystal that it was built for, so its times may be wrong",
        "see clock and crystal in host-sim device info; repair the crystal or build for it",
    ),
    row(
        fault::BIT_RATE,
        "BIT_RATE",
        "the board's clock cannot make a line's bit rate within 2 %; the nearest is in use",
        "see the lines in host-sim device info; choose another bit rate, or repair the crystal",
    ),
    row(
        fault::SAFE_START,
        "SAFE_START",
        "after repeated resets the device stays in bypass and does not use the stored weights",
        "see the crash in host-sim device info; then switch the device off and on",
    ),
    row(
        fault::SUPPLY,
        "SUPPLY",
        "the supply is below the 2.7 V that writing flash needs, so nothing is stored",
        "raise the supply to 3.0 to 3.6 V, then store again: host-sim device store",
    ),
    row(
        fault::KEY,
        "KEY",
        "the last change of the key is not complete: it is not stored, or a record with the key before, or without one, is still there",
        "give the key again: host-sim device provision; if the fault stays, the flash is worn: replace the board",
    ),
];

/// The faults that are set in `bits`, lowest bit first. Unknown bits are left out.
#[must_use]
pub fn of_bits(bits: u32) -> Vec<Fault> {
    let set = |fault: &&Fault| bits >> fault.bit & 1 == 1;
    FAULTS.iter().filter(set).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names and bit numbers of the constants in the source of the command link, so that a new bit
    /// cannot be forgotten here.
    fn constants() -> Vec<(String, u32)> {
        let source = include_str!("../../../../firmware/src/wire/command.rs");
        let constant = |line: &str| {
            let line = line.trim().strip_prefix("pub const ")?;
            let (name, rest) = line.split_once(": u32 = 1 << ")?;
            Some((name.to_owned(), rest.trim_end_matches(';').parse().ok()?))
        };
        source.lines().filter_map(constant).collect()
    }

    #[test]
    fn every_fault_bit_has_a_sentence_and_a_remedy() {
        let all = constants();
        assert!(all.len() >= 15, "the source is not understood: {all:?}");
        for (name, bit) in &all {
            let fault = FAULTS.iter().find(|fault| fault.bit == *bit);
            let fault = fault.unwrap_or_else(|| panic!("{name} (bit {bit}) has no sentence"));
            assert_eq!(fault.name, name);
            assert!(fault.says.len() > 20 && fault.remedy.len() > 15, "{name}");
        }
        assert_eq!(all.len(), FAULTS.len());
    }

    #[test]
    fn faults_come_lowest_bit_first() {
        let names: Vec<_> = of_bits(fault::STUCK | fault::SILENT | 1 << 31)
            .iter()
            .map(|fault| fault.name)
            .collect();
        assert_eq!(names, ["SILENT", "STUCK"]);
        assert!(of_bits(0).is_empty());
    }
}
