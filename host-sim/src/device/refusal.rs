//! Why a device refuses a request, in words, with the remedy.

use firmware::configuration::SCHEMA;
use firmware::control::{Field, Reason};
use firmware::wire::command::Request;

/// Problem and remedy of a refused request.
#[must_use]
pub fn explain(request: &Request, reason: Reason) -> (String, String) {
    let (problem, remedy) = because(request, reason);
    (
        format!("the device refuses to {}: {problem}", purpose(request)),
        remedy,
    )
}

/// What a request is for.
fn purpose(request: &Request) -> &'static str {
    match request {
        Request::SetMode(_) => "set the mode",
        Request::WriteImage { .. } | Request::CommitImage { .. } => "take the weights",
        Request::ReadImage { .. } => "give the weights",
        Request::ReadLearnt { .. } => "give what it has learnt",
        Request::CommitLearnt => "use what it has learnt",
        Request::StoreImage => "store",
        Request::WriteConfiguration { .. } | Request::CommitConfiguration { .. } => {
            "take the configuration"
        }
        Request::ReadConfiguration { .. } => "give its configuration",
        Request::Reference(_) => "learn from the reference",
        Request::Alignment(_) => "take note of the alignment",
        Request::GetVersion
        | Request::GetHealth
        | Request::GetCounters
        | Request::GetEstimate
        | Request::GetBoard => "tell its state",
    }
}

fn because(request: &Request, reason: Reason) -> (String, String) {
    let (problem, remedy) = match (reason, request) {
        (Reason::Range, _) => (
            "a piece does not follow the one before it, or is too long",
            "send it again; if that does not help, use the host-sim of the device's version",
        ),
        (
            Reason::Mode,
            Request::WriteConfiguration { .. } | Request::CommitConfiguration { .. },
        ) => (
            "the mode is not bypass, or a correction is still fading out",
            "wait until it has faded out, no faster than the slew limit, or restart the device",
        ),
        (Reason::Mode, _) => (
            "not in this mode",
            "set the mode bypass first: host-sim device mode bypass",
        ),
        (Reason::Image, _) => (
            "the weight image is damaged, or has another shape or version",
            "give a file that `device weights get` of the same version has written",
        ),
        (Reason::Window, _) => (
            "the window is not known, or not yet",
            "send the reference of the window that the device announces",
        ),
        (Reason::Alignment, _) => (
            "the navigation computer's alignment is in progress or done",
            "wait until it is done and set the mode bypass, or restart the device",
        ),
        (Reason::Unsupported, Request::StoreImage) => (
            "this board has no place to store weights and configuration",
            "configure it after each start, or use a board with flash for it",
        ),
        (Reason::Unsupported, _) => (
            "this board does not have the function",
            "use another board, or the firmware of this program's version",
        ),
        (Reason::NotAvailable, Request::CommitLearnt | Request::ReadLearnt { .. }) => (
            "it has learnt nothing",
            "let it learn first: host-sim device mode learn",
        ),
        (Reason::NotAvailable, Request::SetMode(_)) => (
            "this firmware has no learner",
            "flash the image with the learner, or choose the mode frozen",
        ),
        (Reason::NotAvailable, _) => (
            "it is not available",
            "try again later, or use another board",
        ),
        (Reason::Record, _) => (
            "the bytes are no whole configuration record",
            "send it again; if that does not help, check the line",
        ),
        (Reason::NotConfigured, _) => (
            "it has no configuration, so it only passes bytes",
            "configure it first: host-sim device configure FILE",
        ),
        (Reason::Schema(taken), _) => return schema(taken),
        (Reason::Field(field), _) => return out_of_range(field),
        (Reason::Baud(nearest), _) => return baud(nearest),
        (Reason::Pins(sets), _) => return pins(sets),
    };
    (problem.into(), remedy.into())
}

/// The device takes records of another schema.
pub(super) fn schema(taken: u16) -> (String, String) {
    let remedy = if taken < SCHEMA {
        "flash the firmware of this program's version: cargo xtask flash"
    } else {
        "use the host-sim of the device's version"
    };
    (
        format!("it takes configurations of schema {taken}, and this one has another"),
        format!("{remedy} (this program writes schema {SCHEMA})"),
    )
}

fn out_of_range(field: Field) -> (String, String) {
    let (name, range) = in_unit_file(field);
    (
        format!("{name} is out of its range"),
        format!("in the unit's file, give {range}"),
    )
}

fn baud(nearest: u32) -> (String, String) {
    (
        "its clock cannot make this bit rate".into(),
        format!(
            "the nearest possible bit rate is {nearest} bit/s: set sensor and unit's file to it"
        ),
    )
}

fn pins(sets: u8) -> (String, String) {
    let last = sets.saturating_sub(1);
    let remedy = match sets {
        0 | 1 => "set lines.pins = 0, which is all this board has".into(),
        _ => format!("set lines.pins from 0 to {last}"),
    };
    (format!("the board has {sets} sets of pins"), remedy)
}

/// Name of a field in the unit's file, and its range.
#[must_use]
pub fn in_unit_file(field: Field) -> (&'static str, &'static str) {
    match field {
        Field::Name => ("name", "1 to 32 ASCII characters"),
        Field::Serial => ("serial", "at most 24 ASCII characters"),
        Field::SensorBaud => ("lines.sensor_baud", "1200 to 12 000 000 bit/s"),
        Field::Parity => (
            "lines.parity",
            "\"none\", and one stop bit: this board has no other lines",
        ),
        Field::ReceiverBaud => ("lines.receiver_baud", "1200 to 12 000 000 bit/s"),
        Field::Rate => ("rate_hz", "1 to 20 000 Hz"),
        Field::Mounting => ("mounting", "a rotation"),
        Field::Gyro => (
            "gyro",
            "numbers that are not negative; bias, noise and range above 0",
        ),
        Field::Accel => (
            "accel",
            "numbers that are not negative; bias, noise and range above 0",
        ),
        Field::LeverArm => ("receiver.lever_arm_m", "-100 to 100 m on each axis"),
        Field::FixDelay => ("receiver.fix_delay_ms", "0 to 1000 ms"),
        Field::Speed => ("vehicle.speed_mps", "more than 0, at most 1000 m/s"),
        Field::Limit => ("correction.limit", "numbers that are not negative"),
        Field::Slew => ("correction.slew", "numbers that are not negative"),
        Field::Block => ("correction.block_s", "0.1 to 10 s"),
        Field::Align => ("correction.align_s", "30 to 3600 s"),
        Field::Silence => ("correction.silence_ms", "1 to 10 000 ms"),
    }
}
