//! Cases of the configuration, of the wiring, and of the navigation computer's requests.

use super::super::act::{Act, HostRequest};
use super::super::case::Row;
use super::super::configured::Fault;
use super::super::times::Span;
use super::given;

/// The rows.
pub(super) const ROWS: &[Row] = &[
    Row {
        name: "sheet-0.1",
        about: "The datasheet's biases are configured ten times too small.",
        span: Span::Always,
        given: &[given("factor", 0.1)],
        acts: |v| vec![Act::Configured(Fault::Biases(v[0]))],
    },
    Row {
        name: "sheet-10",
        about: "The datasheet's biases are configured ten times too large.",
        span: Span::Always,
        given: &[given("factor", 10.0)],
        acts: |v| vec![Act::Configured(Fault::Biases(v[0]))],
    },
    Row {
        name: "sheet-noise-0.1",
        about: "The datasheet's noise is configured ten times too small.",
        span: Span::Always,
        given: &[given("factor", 0.1)],
        acts: |v| vec![Act::Configured(Fault::Noise(v[0]))],
    },
    Row {
        name: "sheet-noise-10",
        about: "The datasheet's noise is configured ten times too large.",
        span: Span::Always,
        given: &[given("factor", 10.0)],
        acts: |v| vec![Act::Configured(Fault::Noise(v[0]))],
    },
    Row {
        name: "sheet-other-class",
        about: "The datasheet of another class of sensors: everything 30 times.",
        span: Span::Always,
        given: &[given("factor", 30.0)],
        acts: |v| {
            vec![
                Act::Configured(Fault::Biases(v[0])),
                Act::Configured(Fault::Noise(v[0])),
                Act::Configured(Fault::Scale(v[0])),
            ]
        },
    },
    Row {
        name: "sheet-better-class",
        about: "The datasheet of a far better sensor: everything a thirtieth.",
        span: Span::Always,
        given: &[given("factor", 0.03)],
        acts: |v| {
            vec![
                Act::Configured(Fault::Biases(v[0])),
                Act::Configured(Fault::Noise(v[0])),
                Act::Configured(Fault::Scale(v[0])),
            ]
        },
    },
    Row {
        name: "mounted-3",
        about: "The sensor is turned by 3 degrees against the configured mounting.",
        span: Span::Always,
        given: &[given("yaw_deg", 3.0)],
        acts: |v| vec![Act::Configured(Fault::Mounting([0.0, 0.0, v[0]]))],
    },
    Row {
        name: "mounted-90",
        about: "The sensor is turned by 90 degrees about the vertical.",
        span: Span::Always,
        given: &[given("yaw_deg", 90.0)],
        acts: |v| vec![Act::Configured(Fault::Mounting([0.0, 0.0, v[0]]))],
    },
    Row {
        name: "mounted-on-side",
        about: "The sensor is configured as lying on its side.",
        span: Span::Always,
        given: &[given("roll_deg", 90.0)],
        acts: |v| vec![Act::Configured(Fault::Mounting([v[0], 0.0, 0.0]))],
    },
    Row {
        name: "lever-arm-told-wrong",
        about: "A lever arm is configured; the antenna is at the sensors.",
        span: Span::Always,
        given: &[
            given("forward_m", 3.0),
            given("right_m", -1.0),
            given("down_m", 1.5),
        ],
        acts: |v| vec![Act::Configured(Fault::LeverArm([v[0], v[1], v[2]]))],
    },
    Row {
        name: "delay-told-wrong",
        about: "Fixes are configured as 0.4 s late; they are 0.1 s late.",
        span: Span::Always,
        given: &[given("delay_s", 0.4)],
        acts: |v| vec![Act::Configured(Fault::Delay(v[0]))],
    },
    Row {
        name: "unmeasured",
        about: "Lever arm and delay are not configured, as in a file that leaves them out.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Configured(Fault::Unmeasured)],
    },
    Row {
        name: "told-ship",
        about: "The car is configured as a ship.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Configured(Fault::Ship)],
    },
    Row {
        name: "told-aircraft",
        about: "The car is configured as an aircraft.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Configured(Fault::Aircraft)],
    },
    Row {
        name: "aligns-at-rest",
        about: "The navigation computer reports its alignment at rest, as it should.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Asked(HostRequest::AlignsAtRest)],
    },
    Row {
        name: "learn-again",
        about: "Mode learn is set again every minute.",
        span: Span::Drive,
        given: &[given("every_s", 60.0)],
        acts: |v| vec![Act::Asked(HostRequest::LearnAgain(v[0]))],
    },
    Row {
        name: "mode-toggles",
        about: "Modes frozen and learn take turns.",
        span: Span::Drive,
        given: &[given("every_s", 45.0)],
        acts: |v| vec![Act::Asked(HostRequest::Toggles(v[0]))],
    },
];
