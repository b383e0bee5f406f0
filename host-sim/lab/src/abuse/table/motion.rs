//! Cases of the motion.

use super::super::act::{Act, HostRequest};
use super::super::case::Row;
use super::super::motion::Motion;
use super::super::receiver::Fault;
use super::super::times::Span;
use super::given;
use host_core::simulator::truth::VehicleName;

/// The rows.
pub(super) const ROWS: &[Row] = &[
    Row {
        name: "creep",
        about: "The vehicle creeps with 0.15 m/s for five minutes.",
        span: Span::Ends,
        given: &[given("speed_mps", 0.15)],
        acts: |v| vec![Act::Motion(Motion::Creep(v[0]))],
    },
    Row {
        name: "creep-slow",
        about: "The vehicle creeps with 0.05 m/s for five minutes.",
        span: Span::Ends,
        given: &[given("speed_mps", 0.05)],
        acts: |v| vec![Act::Motion(Motion::Creep(v[0]))],
    },
    Row {
        name: "creep-fast",
        about: "The vehicle creeps with 0.5 m/s for five minutes.",
        span: Span::Ends,
        given: &[given("speed_mps", 0.5)],
        acts: |v| vec![Act::Motion(Motion::Creep(v[0]))],
    },
    Row {
        name: "slow-departure",
        about: "The vehicle reaches 0.5 m/s in a minute.",
        span: Span::Ends,
        given: &[given("speed_mps", 0.5), given("time_s", 60.0)],
        acts: |v| vec![Act::Motion(Motion::Departure(v[0], v[1]))],
    },
    Row {
        name: "cruise",
        about: "A smooth cruise while the receiver states a speed accuracy of 4 m/s.",
        span: Span::Ends,
        given: &[given("speed_mps", 10.0), given("speed_accuracy_mps", 4.0)],
        acts: |v| {
            vec![
                Act::Motion(Motion::Cruise(v[0])),
                Act::Receiver(Fault::SpeedAccuracy(v[1])),
            ]
        },
    },
    Row {
        name: "straight",
        about: "A straight road at one speed all the time.",
        span: Span::Always,
        given: &[given("speed_mps", 25.0)],
        acts: |v| vec![Act::Motion(Motion::Straight(v[0]))],
    },
    Row {
        name: "u-turns",
        about: "The vehicle turns back every half minute.",
        span: Span::Always,
        given: &[given("every_s", 30.0)],
        acts: |v| vec![Act::Motion(Motion::TurnsBack(v[0]))],
    },
    Row {
        name: "circles",
        about: "The vehicle drives in circles.",
        span: Span::Always,
        given: &[given("period_s", 40.0)],
        acts: |v| vec![Act::Motion(Motion::Circles(v[0]))],
    },
    Row {
        name: "stop-and-go",
        about: "The vehicle stops for 6 s every half minute.",
        span: Span::Always,
        given: &[given("every_s", 20.0)],
        acts: |v| vec![Act::Motion(Motion::StopsAndGoes(v[0]))],
    },
    Row {
        name: "rough-road",
        about: "The road shakes five times as much as usual.",
        span: Span::Always,
        given: &[given("factor", 5.0)],
        acts: |v| vec![Act::Motion(Motion::Rough(v[0]))],
    },
    Row {
        name: "traffic",
        about: "A car in queues.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Motion(Motion::In(VehicleName::Traffic))],
    },
    Row {
        name: "city",
        about: "A car in a town.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Motion(Motion::In(VehicleName::City))],
    },
    Row {
        name: "train",
        about: "A train.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Motion(Motion::In(VehicleName::Train))],
    },
    Row {
        name: "aircraft",
        about: "An aircraft, configured as a land vehicle.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Motion(Motion::In(VehicleName::Aircraft))],
    },
    Row {
        name: "ship",
        about: "A ship in waves, configured as a land vehicle.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Motion(Motion::In(VehicleName::Ship))],
    },
    Row {
        name: "hand-held",
        about: "A walk with the sensor in the hand.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Motion(Motion::In(VehicleName::HandHeld))],
    },
    Row {
        name: "standing",
        about: "The vehicle never moves.",
        span: Span::Always,
        given: &[],
        acts: |_| vec![Act::Motion(Motion::In(VehicleName::Standing))],
    },
    Row {
        name: "align-moving",
        about: "The navigation computer reports an alignment while the vehicle drives.",
        span: Span::Ends,
        given: &[given("after_s", 60.0)],
        acts: |v| vec![Act::Asked(HostRequest::Aligns(v[0]))],
    },
];
