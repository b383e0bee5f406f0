//! Short files, and what they become.

use super::*;
use crate::inertial::units::{DEG_PER_H, UG};
use firmware::configuration::record::{decode, encode};

/// All that a file must say.
pub(super) const SHORT: &str = "\
name = 'short'
[sensor]
format = 'stim300'
[gyro]
bias_turn_on_dph = 10
bias_in_run_dph = 0.5
angle_random_walk_dpsqrth = 0.15
[accel]
bias_turn_on_ug = 2000
bias_in_run_ug = 50
velocity_random_walk_ugpsqrthz = 60
";

#[test]
fn a_short_file_is_a_whole_configuration() {
    let unit: Unit = toml::from_str(SHORT).unwrap();
    let told = unit.configuration().unwrap();
    assert_eq!(told.identity.name, "short");
    assert_eq!(told.lines.sensor_baud, 921_600);
    assert_eq!((told.rate, told.mounting), (1000.0, [1.0, 0.0, 0.0, 0.0]));
    let near = |a: f32, b: f64| (f64::from(a) / b - 1.0).abs() < 1e-6;
    assert!(near(told.gyro.bias_turn_on, 10.0 * DEG_PER_H));
    assert!(near(told.gyro.bias_in_run, 0.5 * DEG_PER_H));
    // 0.15 deg/sqrt(h) in rad/sqrt(s); 60 ug in m/s2
    assert!(near(told.gyro.white_noise, 4.363_323e-5));
    assert!(near(told.accel.white_noise, 5.883_99e-4));
    assert!(near(told.correction.limit.gyro, 100.0 * DEG_PER_H));
    assert!(near(told.correction.limit.accel, 20_000.0 * UG));
    assert!(near(told.correction.slew.accel, 20.0 * UG));
    assert!(near(told.receiver.fix_delay, 0.1));
    assert_eq!(told.correction.silence_us, 100_000);
    assert_eq!(decode(&encode(&told)), Ok(told));
}
