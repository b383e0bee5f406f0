//! Cases of the sensor's line and of the clocks.

use super::super::act::Act;
use super::super::case::Row;
use super::super::line::Fault;
use super::super::times::Span;
use super::given;

/// The rows.
pub(super) const ROWS: &[Row] = &[
    Row {
        name: "rate-1",
        about: "The sensor's clock is slow by 1 %.",
        span: Span::Always,
        given: &[given("slow_by", 0.01)],
        acts: |v| vec![Act::Line(Fault::SlowSensor(v[0]))],
    },
    Row {
        name: "rate-2",
        about: "The sensor's clock is slow by nearly 2 %, just not noticed as a wrong rate.",
        span: Span::Always,
        given: &[given("slow_by", 0.019)],
        acts: |v| vec![Act::Line(Fault::SlowSensor(v[0]))],
    },
    Row {
        name: "rate-fast-3",
        about: "The sensor's clock is fast by 3 %.",
        span: Span::Always,
        given: &[given("slow_by", -0.03)],
        acts: |v| vec![Act::Line(Fault::SlowSensor(v[0]))],
    },
    Row {
        name: "board-clock",
        about: "The board's clock is fast by 1 %.",
        span: Span::Always,
        given: &[given("fast_by", 0.01)],
        acts: |v| vec![Act::Line(Fault::FastBoard(v[0]))],
    },
    Row {
        name: "no-counter",
        about: "Frames without counter and time (HG4930), none of them lost.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Line(Fault::NoCounter)],
    },
    Row {
        name: "holes-unseen",
        about: "Frames without counter and time; six are lost every 10 s.",
        span: Span::Always,
        given: &[given("frames", 6.0), given("every_s", 10.0)],
        acts: |v| {
            vec![
                Act::Line(Fault::NoCounter),
                Act::Line(Fault::Holes([v[0], v[1]])),
            ]
        },
    },
    Row {
        name: "holes",
        about: "Six frames are lost every 10 s; the time stamps show it.",
        span: Span::Always,
        given: &[given("frames", 6.0), given("every_s", 10.0)],
        acts: |v| vec![Act::Line(Fault::Holes([v[0], v[1]]))],
    },
    Row {
        name: "lost-1",
        about: "1 % of the frames is lost.",
        span: Span::Always,
        given: &[given("share", 0.01)],
        acts: |v| vec![Act::Line(Fault::Lost(v[0]))],
    },
    Row {
        name: "lost-unseen",
        about: "Frames without counter and time; 1 % is lost.",
        span: Span::Always,
        given: &[given("share", 0.01)],
        acts: |v| vec![Act::Line(Fault::NoCounter), Act::Line(Fault::Lost(v[0]))],
    },
    Row {
        name: "twice",
        about: "1 % of the frames comes twice.",
        span: Span::Always,
        given: &[given("share", 0.01)],
        acts: |v| vec![Act::Line(Fault::Twice(v[0]))],
    },
    Row {
        name: "twice-unseen",
        about: "Frames without counter and time; 1 % comes twice.",
        span: Span::Always,
        given: &[given("share", 0.01)],
        acts: |v| vec![Act::Line(Fault::NoCounter), Act::Line(Fault::Twice(v[0]))],
    },
    Row {
        name: "damaged",
        about: "1 % of the frames has a damaged byte.",
        span: Span::Always,
        given: &[given("share", 0.01)],
        acts: |v| vec![Act::Line(Fault::Damaged(v[0]))],
    },
    Row {
        name: "bursts",
        about: "Frames come eight at a time, as through a USB adapter.",
        span: Span::Always,
        given: &[given("frames", 8.0)],
        acts: |v| vec![Act::Line(Fault::Bursts(v[0]))],
    },
    Row {
        name: "silences",
        about: "The sensor is silent for half a second every minute.",
        span: Span::Drive,
        given: &[given("length_s", 0.5), given("every_s", 60.0)],
        acts: |v| vec![Act::Line(Fault::Silences([v[0], v[1]]))],
    },
    Row {
        name: "sensor-restart",
        about: "The sensor is off for 3 s and counts anew.",
        span: Span::Ends,
        given: &[given("length_s", 3.0)],
        acts: |v| vec![Act::Line(Fault::Restart(v[0]))],
    },
];
