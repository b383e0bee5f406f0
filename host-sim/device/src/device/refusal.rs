//! Why a device refuses a request, in words, with the remedy.

use firmware::configuration::SCHEMA;
use firmware::control::update::Refusal;
use firmware::control::{Field, Reason};
use firmware::wire::command::Request;
use host_unit::key;

/// Problem and remedy of a refused request.
#[must_use]
pub fn explain(request: &Request, reason: Reason) -> (String, String) {
    let (problem, remedy) = because(request, reason);
    (
        format!("the device refuses to {}: {problem}", purpose(request)),
        remedy,
    )
}

/// Purpose of a request, in words.
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
        Request::Heading(_) => "take the heading",
        Request::WheelSpeed(_) => "take the speed of the wheels",
        Request::GetRecording | Request::Record(_) | Request::ReadRecording { .. } => {
            "give its black box"
        }
        Request::Provision(_) => "take the key",
        Request::GetChallenge => "begin a session",
        Request::BeginUpdate { .. } | Request::WriteUpdate { .. } | Request::FinishUpdate => {
            "take the update"
        }
        Request::Restart => "restart",
        Request::GetVersion
        | Request::GetHealth
        | Request::GetCounters
        | Request::GetEstimate
        | Request::GetAntenna
        | Request::GetBoard
        | Request::GetMemory
        | Request::GetStore
        | Request::GetSecurity
        | Request::GetReceiver
        | Request::GetReset
        | Request::GetSolution
        | Request::GetTrials
        | Request::GetProgress
        | Request::GetUpdate
        | Request::GetTimes => "report its state",
    }
}

#[expect(clippy::too_many_lines, reason = "a list of cases")]
fn because(request: &Request, reason: Reason) -> (String, String) {
    let (problem, remedy) = match (reason, request) {
        (Reason::Range, Request::Heading(_)) => (
            "the heading or its standard deviation is out of range",
            "give -360 to 360 deg, and a standard deviation above 0 and up to 57 deg",
        ),
        (Reason::Alignment, Request::Heading(_)) => (
            "its navigator is aligned already",
            "give the heading before that, while `device watch` says that it does not navigate",
        ),
        (Reason::NotAvailable, Request::Heading(_)) => (
            "it does not align itself: it does not learn, or there has been no fix yet",
            "set the mode shadow or learn, wait for a fix, and give the heading again",
        ),
        (Reason::TooLate, _) => (
            "it takes its first key only in the first minute after power-on",
            "switch it off and on, and give the key within a minute",
        ),
        (Reason::NotConfigured, Request::WheelSpeed(_)) => (
            "its configuration has no wheels",
            "write the table [wheels] into the unit file, then host-sim device configure",
        ),
        (Reason::NotAvailable, Request::WheelSpeed(_)) => (
            "it does not learn",
            "set the mode shadow or learn, and send the speed again",
        ),
        (Reason::Range, Request::Provision(_)) => (
            "all bytes of the key are the same",
            "let the program make the key: give --key-file the name of a new file",
        ),
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
        (Reason::Unsupported, Request::GetUpdate | Request::BeginUpdate { .. }) => (
            "it takes no updates over the command link: this board has no room for two images, or \
             its image is not one for a slot",
            "flash it with a probe; docs/BOARDS.md lists the boards that take updates",
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
            "the bytes are not a whole configuration record",
            "send it again; if that does not help, check the line",
        ),
        (Reason::NotConfigured, _) => (
            "it has no configuration, so it only passes bytes",
            "configure it first: host-sim device configure FILE",
        ),
        (Reason::KeyNeeded, _) => (
            "it asks for a key",
            "give the device's key: --key FILE, or the variable LRNN_KEY",
        ),
        (Reason::NoKey, _) => (
            "it has no key",
            "leave out --key (and the variable LRNN_KEY), or give it one: \
             host-sim device provision --key-file FILE",
        ),
        (Reason::Key, _) => (
            "the key is another one than the device's, or something on the line changes requests",
            "give the file of this device: --key FILE",
        ),
        (Reason::Session | Reason::Counter, _) => (
            "its session ends again and again",
            "let no other program use the device at the same time, and check the line",
        ),
        (Reason::Wait(ms), _) => return wait(ms),
        (Reason::Update(refusal), _) => return update(refusal),
        (Reason::Schema(taken), _) => return schema(taken),
        (Reason::Field(field), _) => return out_of_range(field),
        (Reason::Baud(nearest), _) => return baud(nearest),
        (Reason::Pins(sets), _) => return pins(sets),
        (Reason::Busy, _) => (
            "it has other work to finish first",
            "try again; the device was asked several times",
        ),
        (Reason::Newer(version), _) => {
            let problem = format!("its store holds something of a newer firmware ({version})");
            let remedy = "flash the newer firmware again, or erase the last two sectors of flash";
            return (problem, remedy.into());
        }
    };
    (problem.into(), remedy.into())
}

/// An update is refused.
fn update(refusal: Refusal) -> (String, String) {
    let (problem, remedy) = match refusal {
        Refusal::Header => (
            "it is no update that this firmware knows",
            "give the update of a release that this firmware can be updated to (docs/RELEASES.md)",
        ),
        Refusal::Signature => (
            "it is signed with another key than the device expects, or was changed afterwards",
            "give the update of the same maker as the device's firmware (`device info` shows the \
             key), and compare its checksum",
        ),
        Refusal::Board => (
            "it is an update of another board",
            "give the update of the board that `device info` shows",
        ),
        Refusal::Slot => (
            "it is an image for the slot that runs",
            "make the update again with `cargo xtask sign`, which makes both images",
        ),
        Refusal::Length => (
            "its image is longer than a slot",
            "build it smaller, or flash it with a probe",
        ),
        Refusal::Older => (
            "it is older than the firmware that runs, which may hold what the older one cannot \
             read",
            "give --older, if it is what you want",
        ),
        Refusal::Trial => (
            "its firmware is itself on trial",
            "let the sensor send for some ten seconds until it is confirmed (`device info`), or \
             switch the device off and on to go back",
        ),
        Refusal::NotBegun => (
            "no update was begun: the device has restarted",
            "give the command again; it begins anew",
        ),
        Refusal::Order(received) => {
            let problem = format!("its pieces are not in order; it has {received} bytes");
            let remedy = "let no other program update it, and give the command again";
            return (problem, remedy.into());
        }
        Refusal::Digest => (
            "what its flash holds is not what was signed",
            "give the command again; if that does not help, the file or the flash is damaged",
        ),
        Refusal::Flash => (
            "its flash does not erase, or does not keep what is written",
            "give the command again; if that does not help, replace the board",
        ),
    };
    (problem.into(), remedy.into())
}

/// The request came too often.
fn wait(ms: u32) -> (String, String) {
    let seconds = ms.div_ceil(1000);
    (
        "it was asked for it too often, and its flash is to last".into(),
        format!("ask again in {seconds} s"),
    )
}

/// The device accepts records of another schema.
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
    let remedy = match field {
        Field::CutThrough => {
            "give sensor.cut_through = false, or sensor.format = stim300, kvh or novatel".into()
        }
        Field::Parity => "give parity = \"none\" and stop_bits = 1, or use another board".into(),
        _ => "see the field's range in `host-sim unit schema`".into(),
    };
    let problem = match field {
        Field::CutThrough => "frames of this format cannot be cut through".into(),
        Field::Parity => "this board's lines have neither parity nor a second stop bit".into(),
        _ => format!("{} of the unit file is out of its range", key(field)),
    };
    (problem, remedy)
}

fn baud(nearest: u32) -> (String, String) {
    (
        "its clock cannot make a bit rate of the unit file (sensor.baud, receiver.baud)".into(),
        format!("the nearest possible one is {nearest} bit/s: set the sensor and the file to it"),
    )
}

fn pins(sets: u8) -> (String, String) {
    let remedy = match sets {
        0 | 1 => "give sensor.pins = 0 in the unit file".into(),
        _ => format!("give sensor.pins from 0 to {} in the unit file", sets - 1),
    };
    (
        format!("the board has fewer sets of pins ({sets}) than the unit file asks for"),
        remedy,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(reason: Reason) -> String {
        let (problem, remedy) = explain(&Request::CommitConfiguration { length: 1 }, reason);
        format!("{problem}; {remedy}")
    }

    #[test]
    fn refusals_name_the_field_and_what_is_possible() {
        assert!(text(Reason::Field(Field::Speed)).contains("vehicle.largest_speed_mps"));
        assert!(text(Reason::Baud(1_562_500)).contains("1562500 bit/s"));
        assert!(text(Reason::Pins(2)).contains("sensor.pins from 0 to 1"));
        assert!(text(Reason::Pins(1)).contains("sensor.pins = 0"));
        assert!(text(Reason::Schema(SCHEMA - 1)).contains("flash"));
        assert!(text(Reason::Schema(SCHEMA + 1)).contains("host-sim of the device's"));
        assert!(text(Reason::Record).contains("not a whole configuration record"));
        assert!(text(Reason::Alignment).contains("alignment"));
        assert!(text(Reason::Mode).contains("bypass"));
    }
}
