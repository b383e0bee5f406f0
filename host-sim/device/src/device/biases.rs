//! Biases that are large against the unit file: one sentence for all who estimate them.

use firmware::configuration::Configuration;
use firmware::learn::Settings;

/// Biases that are larger than the unit file's by this are reported: a normal one is not in 16 000.
const LARGE: f64 = 4.0;
/// Below this rate a bias is given in deg/h, above in deg/s.
const SLOW_DEGPS: f64 = 0.05;

/// Standard deviations of the biases by a configuration: gyros, rad/s, accelerometers, m/s2.
#[must_use]
pub fn sheet(configuration: &Configuration) -> [f64; 2] {
    let sheet = Settings::of(configuration).sheet;
    [sheet.gyro_bias, sheet.accel_bias].map(f64::from)
}

/// Names biases that are large against the standard deviations of the unit file (`sheet`), with
/// their size. Gyros in rad/s, then accelerometers in m/s2.
#[must_use]
pub fn large(biases: [[f64; 3]; 2], sheet: [f64; 2]) -> Option<String> {
    let times = |of: usize| {
        biases[of]
            .iter()
            .fold(0.0, |most: f64, b| b.abs().max(most))
            / sheet[of]
    };
    let [gyro, accel] = biases;
    let gyro = gyro.map(f64::to_degrees);
    let slow = gyro.iter().all(|rate| rate.abs() < SLOW_DEGPS);
    let (gyro, unit) = match slow {
        true => (gyro.map(|rate| rate * 3600.0), "deg/h"),
        false => (gyro, "deg/s"),
    };
    let said = [("gyros", gyro, unit), ("accelerometers", accel, "m/s2")];
    let each = said.into_iter().enumerate();
    let large = each.filter(|(of, _)| times(*of) > LARGE);
    let parts: Vec<String> = large
        .map(|(of, (name, [x, y, z], unit))| {
            format!(
                "the {name}' biases, {x:.2}, {y:.2} and {z:.2} {unit}, are up to {:.0} times the \
                 unit file's",
                times(of)
            )
        })
        .collect();
    (!parts.is_empty()).then(|| {
        let parts = parts.join("; ");
        format!("{parts}: it, or the sensor, is not what it should be")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_biases_are_named_with_their_size() {
        let sheet = [0.1f64.to_radians(), 0.02];
        let gyro = [0.1, -0.39, 0.0].map(f64::to_radians);
        assert_eq!(large([gyro, [0.07, 0.0, -0.07]], sheet), None);
        let gyro = [0.1, -1.0, 0.0].map(f64::to_radians);
        let says = large([gyro, [0.0; 3]], sheet).unwrap();
        let expected = "the gyros' biases, 0.10, -1.00 and 0.00 deg/s, are up to 10 times the \
                        unit file's: it, or the sensor, is not what it should be";
        assert_eq!(says, expected);
        let says = large([[0.0; 3], [0.0, 0.1, 0.0]], sheet).unwrap();
        assert!(
            says.contains("accelerometers' biases, 0.00, 0.10"),
            "{says}"
        );
        assert!(says.contains("up to 5 times"), "{says}");
        let fine = [5.0, 0.0, 0.0].map(|dph: f64| dph.to_radians() / 3600.0);
        let says = large([fine, [0.0; 3]], [fine[0] / 10.0, 0.1]).unwrap();
        assert!(says.contains("5.00, 0.00 and 0.00 deg/h"), "{says}");
    }
}
