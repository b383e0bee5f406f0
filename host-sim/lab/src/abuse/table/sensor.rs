//! Cases of the sensor.

use super::super::act::Act;
use super::super::case::Row;
use super::super::sensor::Fault;
use super::super::times::Span;
use super::given;

/// The rows.
pub(super) const ROWS: &[Row] = &[
    Row {
        name: "noise-10",
        about: "The noise is ten times the datasheet's.",
        span: Span::Always,
        given: &[given("factor", 10.0)],
        acts: |v| vec![Act::Sensor(Fault::Noise(v[0]))],
    },
    Row {
        name: "noise-3",
        about: "The noise is three times the datasheet's.",
        span: Span::Always,
        given: &[given("factor", 3.0)],
        acts: |v| vec![Act::Sensor(Fault::Noise(v[0]))],
    },
    Row {
        name: "bias-inverted",
        about: "Biases change their sign in the middle of what is learnt from.",
        span: Span::Ends,
        given: &[given("gyro_dph", 0.3), given("accel_ug", 400.0)],
        acts: |v| vec![Act::Sensor(Fault::Inverted([v[0], v[1]]))],
    },
    Row {
        name: "bias-step",
        about: "Biases step by more than a standard deviation.",
        span: Span::Ends,
        given: &[given("gyro_dph", 0.5), given("accel_ug", 500.0)],
        acts: |v| vec![Act::Sensor(Fault::Step([v[0], v[1]]))],
    },
    Row {
        name: "bias-drift",
        about: "Biases drift, as when it grows warm.",
        span: Span::Always,
        given: &[given("gyro_dph_per_h", 0.5), given("accel_ug_per_h", 500.0)],
        acts: |v| vec![Act::Sensor(Fault::Drift([v[0], v[1]]))],
    },
    Row {
        name: "bias-swings",
        about: "Biases swing with the cycle of a heater.",
        span: Span::Always,
        given: &[
            given("gyro_dph", 0.5),
            given("accel_ug", 300.0),
            given("period_s", 400.0),
        ],
        acts: |v| vec![Act::Sensor(Fault::Swings([v[0], v[1], v[2]]))],
    },
    Row {
        name: "saturating",
        about: "The forward accelerometer saturates when the vehicle brakes.",
        span: Span::Always,
        given: &[given("gyro_dps", 60.0), given("accel_g", 0.2)],
        acts: |v| vec![Act::Sensor(Fault::Saturates([v[0], v[1]]))],
    },
    Row {
        name: "stuck-gyro",
        about: "The forward gyro keeps its value for 20 s.",
        span: Span::For(20),
        given: &[],
        acts: |_| vec![Act::Sensor(Fault::Stuck(0))],
    },
    Row {
        name: "stuck-accel",
        about: "The forward accelerometer keeps its value for 20 s.",
        span: Span::For(20),
        given: &[],
        acts: |_| vec![Act::Sensor(Fault::Stuck(3))],
    },
    Row {
        name: "dead-band",
        about: "Rates below 0.05 deg/s are reported as 0.",
        span: Span::Always,
        given: &[given("gyro_dps", 0.05)],
        acts: |v| vec![Act::Sensor(Fault::DeadBand(v[0]))],
    },
    Row {
        name: "coarse",
        about: "Values are rounded to 0.02 deg/s and 1 mg.",
        span: Span::Always,
        given: &[given("gyro_dps", 0.02), given("accel_g", 0.001)],
        acts: |v| vec![Act::Sensor(Fault::Coarse([v[0], v[1]]))],
    },
    Row {
        name: "axis-negated",
        about: "The gyro to the right has the wrong sign.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Sensor(Fault::Negated(1))],
    },
    Row {
        name: "spikes",
        about: "A sample in a thousand is off by 0.3 deg/s or 0.3 mg.",
        span: Span::Always,
        given: &[given("share", 0.001), given("gyro_dps", 0.3)],
        acts: |v| vec![Act::Sensor(Fault::Spikes([v[0], v[1]]))],
    },
    Row {
        name: "g-sensitivity",
        about: "The gyros feel specific force.",
        span: Span::Always,
        given: &[given("dph_per_g", 3.0)],
        acts: |v| vec![Act::Sensor(Fault::GSensitivity(v[0]))],
    },
    Row {
        name: "scale-1000ppm",
        about: "All scale factors are off by 1000 ppm.",
        span: Span::Always,
        given: &[given("share", 0.001)],
        acts: |v| vec![Act::Sensor(Fault::Scale(v[0]))],
    },
    Row {
        name: "late-accel",
        about: "Accelerometers are late by two samples.",
        span: Span::Always,
        given: &[given("samples", 2.0)],
        acts: |v| vec![Act::Sensor(Fault::LateAccel(v[0] as usize))],
    },
    Row {
        name: "hot-restart",
        about: "The next drive begins with the sensor still warm.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Sensor(Fault::HotRestart)],
    },
];
