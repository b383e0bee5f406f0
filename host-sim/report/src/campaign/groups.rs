//! Descriptions of groups of errors.

use host_core::simulator::imu::ErrorModelName;
use host_lab::campaign::{FixErrors, Group};

/// The errors of the sensors and the fixes of a group, as a sentence.
pub(super) fn sentence(group: Group) -> String {
    let mut text = format!("The sensors have {}", sensors(group.sensors));
    if let Some(fixes) = fixes(group.fixes) {
        text += &format!("; the fixes {fixes}");
    }
    if group.told {
        text += ". The schemes know how large the cause is";
    }
    text + "."
}

fn sensors(errors: ErrorModelName) -> String {
    use ErrorModelName as E;
    let beside = match errors {
        E::Noise => return "white noise, quantisation and what is left of the dither only".into(),
        E::Linear => {
            return "noise, biases that drift, scale factors and misalignments".into();
        }
        E::All => return "all errors that the simulator knows".into(),
        E::AllX3 => return "all errors, the thermal and the nonlinear ones times three".into(),
        E::Thermal => "all errors by temperature: warm-up, heating rate, gradient",
        E::Nonlinear => "all nonlinear errors: asymmetry, cross coupling, vibration",
        E::Hysteresis => "thermal hysteresis",
        E::Gradient => "a bias by the difference of temperature across the block",
        E::Heating => "a bias by the rate of the temperature",
        E::ScaleTemperature => "a scale factor by the temperature",
        E::StretchedWarmUp => "a warm-up that is not exponential, of another length on each axis",
        E::ModeHop => "hops of the path-length control",
        E::Thermostat => "a bias by the temperature of a block whose thermostat cycles",
        E::Flicker => "bias instability",
        E::GSquare => "a bias of the gyros by the square of the specific force",
        E::Ageing => "a bias that has aged for a year",
        E::Temperature => "biases by the temperature and its square",
        E::WarmUp => "a warm-up by one exponential",
        E::GSensitivity => "a bias of the gyros by the specific force",
        E::Magnetic => "a bias of the gyros by the magnetic field",
        E::Dither => "what is left of the dither of a laser gyro, with its coning",
        E::Vibration => "a bias of the accelerometers by vibration",
        E::SizeEffect => "accelerometers that are apart from each other",
        E::Timing => "accelerometers that are late",
        E::Softening => "a bias that comes as an adhesive softens",
        E::ThermalLag => "a bias by the temperature of a place that has no thermometer",
        E::VibrationSaturation => "a bias by vibration that saturates",
        E::SelfHeating => "a bias of the gyros by how much they have turned lately",
        E::Real => "biases that are new, step and age at a power-on as those of recorded units",
    };
    format!("the linear errors (noise, biases, scale factors, misalignments) and {beside}")
}

fn fixes(errors: FixErrors) -> Option<&'static str> {
    Some(match errors {
        FixErrors::AsInScenario => return None,
        FixErrors::Coloured => "have errors that last, as in a town",
        FixErrors::Optimistic => "have more noise than the receiver reports",
        FixErrors::Late => "arrive late",
        FixErrors::LeverArm => "are those of an antenna that is not at the sensors",
        FixErrors::Gaps => "fail at times",
        FixErrors::Multipath => "have bursts of multipath",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_group_has_a_sentence_of_its_own() {
        let sensors = ErrorModelName::every().map(Group::from);
        let fixes = FixErrors::CAUSES.map(Group::from);
        let all = sensors
            .chain(fixes)
            .flat_map(|group| [group, group.with_known_cause()]);
        let mut said: Vec<String> = all.map(sentence).collect();
        let wanted = said.len();
        said.sort();
        said.dedup();
        assert_eq!(said.len(), wanted);
    }
}
