//! The receiver's time pulse on a chip with a timer that captures it: the board's own image in a
//! model written from the reference manual (`judges/stm32f405.py`). And on the board `f405`, which
//! uses an external interrupt instead of the timer.

use std::path::Path;

use firmware::configuration::{Configuration, ReceiverProtocol};
use firmware::wire::ImuFormat;
use firmware::wire::command::{MAX_PACKET, Packets, Request, Response, decode, encode};
use firmware::wire::receiver::{ReceiverFormat, ReceiverStatus};
use qemu::boards::Family;
use qemu::drive::{drive, hex};
use qemu::images::STM32F405;
use qemu::judges::{ask, python};
use qemu::protocol::configure;
use qemu::replay::Input;

/// Cycles in a millisecond.
const MS: u64 = 168_000;

fn bytes(hex: &str) -> Vec<u8> {
    let digits = hex.as_bytes().chunks(2);
    let byte = |pair| u8::from_str_radix(std::str::from_utf8(pair).expect("text"), 16);
    digits.map(|pair| byte(pair).expect("hex")).collect()
}

fn sentence(text: &str) -> String {
    let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${text}*{sum:02X}\r\n")
}

/// The receiver's second 43 200 + `second`, in two sentences.
fn fix(second: u64) -> Vec<u8> {
    let time = format!("1200{second:02}.00");
    let rmc = format!("GNRMC,{time},A,4717.11399,N,00833.91590,E,0.010,90.00,221126,,,A");
    let gga = format!("GNGGA,{time},4717.11399,N,00833.91590,E,1,12,1.0,499.6,M,48.1,M,,");
    (sentence(&rmc) + &sentence(&gga)).into_bytes()
}

/// What the board reports of its receiver after `seconds`, with pulses at `pulses`, cycles, and
/// fixes that arrive `delay_ms` after their time of validity.
fn reported(pulse: bool, pulses: &[u64], seconds: u64, delay_ms: u64) -> Option<ReceiverStatus> {
    reported_by(
        &STM32F405.build_or_skip()?,
        pulse,
        pulses,
        (seconds, delay_ms, MS / 10),
    )
}

/// As [`reported`], for an image, with pulses of a width in cycles.
fn reported_by(
    image: &Path,
    pulse: bool,
    pulses: &[u64],
    (seconds, delay_ms, width): (u64, u64, u64),
) -> Option<ReceiverStatus> {
    let python = python()?;
    let mut configuration = Configuration::default();
    configuration.receiver.protocol = ReceiverProtocol::Nmea;
    configuration.receiver.fix_delay = 0.1;
    configuration.receiver.pulse = pulse;
    configuration.correction.check_rate = false;
    let command: Vec<_> = configure(&configuration).expect("packets");
    let command: Vec<_> = command.iter().map(|packet| hex(packet)).collect();
    let records = drive(ImuFormat::Stim300, 2).expect("a drive").into_iter();
    let frames = records.filter(|record| record.input == Input::Sensor);
    let sensor: Vec<_> = frames.map(|record| hex(&record.bytes)).collect();
    let count = (seconds * 1000 / 4) as usize; // every 4 ms
    let sensor: Vec<_> = sensor.iter().cycle().take(count).collect();
    let gnss: Vec<_> = (1..seconds)
        .map(|second| (MS * (1000 * second + delay_ms), hex(&fix(second))))
        .filter(|(at, _)| *at < MS * 1000 * seconds)
        .collect();
    let mut buffer = [0; MAX_PACKET];
    let request = encode(99, &Request::GetReceiver, &mut buffer).expect("a packet");
    let asked = serde_json::json!({
        "image": image, "command": command, "sensor": sensor, "period": 4 * MS,
        "gnss": gnss, "pulses": pulses, "width": width, "ask": [hex(request)],
    });
    let output = ask(&python, "stm32f405.py", asked.to_string().as_bytes()).expect("it runs");
    let sent = output.iter().find_map(|line| line.strip_prefix("command "));
    let mut packets = Packets::new();
    let mut status = None;
    for byte in bytes(sent.expect("a line").trim()) {
        if let Some(packet) = packets.push(byte)
            && let Ok((99, Response::Receiver(receiver))) = decode(packet)
        {
            status = Some(receiver);
        }
    }
    status
}

/// The configured delay is 0.1 s, the actual one 0.6 s plus 13 ms until the last byte.
#[test]
fn the_pulse_is_captured_and_the_age_is_exact() {
    let seconds = 7;
    // a glitch of a loose contact in between, which is captured too
    let mut pulses: Vec<u64> = (1..seconds).map(|second| MS * 1000 * second + 77).collect();
    pulses.insert(3, pulses[2] + 123 * MS);
    let Some(receiver) = reported(true, &pulses, seconds, 600) else {
        return;
    };
    assert_eq!(receiver.format, Some(ReceiverFormat::Nmea));
    assert_eq!(receiver.pulses, 7);
    assert_eq!(receiver.time_ms, Some((43_200 + 6) * 1000)); // a Sunday
    let age = receiver.age_us.expect("a pulse");
    assert!(age.abs_diff(613_000) < 5000, "{age} us");
}

/// The same by an external interrupt, over the drivers of `embassy-stm32`. A glitch that is over
/// before the interrupt reads the pin does not count.
#[test]
fn the_pulse_interrupts_a_board_over_embassy() {
    let board = Family::named("f405").expect("a board");
    let Some(image) = python().map(|_| board.build().expect("it builds")) else {
        return;
    };
    let pulses: Vec<u64> = (1..7).map(|second| MS * 1000 * second + 77).collect();
    let receiver = reported_by(&image, true, &pulses, (7, 600, MS / 10)).expect("an answer");
    assert_eq!(receiver.pulses, 6);
    let age = receiver.age_us.expect("a pulse");
    assert!(age.abs_diff(613_000) < 5000, "{age} us");
    let receiver = reported_by(&image, true, &pulses[..2], (3, 600, 0)).expect("an answer");
    assert_eq!((receiver.age_us, receiver.pulses), (None, 0));
}

#[test]
fn without_a_wired_pulse_the_age_is_not_known() {
    let pulses: Vec<u64> = (1..4).map(|second| MS * 1000 * second).collect();
    let Some(receiver) = reported(false, &pulses, 3, 100) else {
        return;
    };
    assert_eq!((receiver.age_us, receiver.pulses), (None, 0));
    assert!(receiver.time_ms.is_some());
}
