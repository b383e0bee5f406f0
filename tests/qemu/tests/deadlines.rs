//! No frame is late, and no pass of the frame path is longer than its budget: at the highest rate
//! of each format, while the device learns, whatever work coincides.

use std::time::Duration;

use firmware::control::{Alignment, Mode};
use firmware::fix::Heading;
use firmware::wire::ImuFormat;
use firmware::wire::command::{MAX_CHUNK, Request};
use qemu::budget::Budgets;
use qemu::drive::{Record, drive_configured};
use qemu::images::REPLAY;
use qemu::machine::NETDUINOPLUS2;
use qemu::protocol::{packet_of, set_up_configured};
use qemu::replay::{Input, configured};
use qemu::software::{configured_on_desktop, timed_on_target};

/// Length of a drive that begins in motion, s.
const SECONDS: u32 = 60;
/// Bytes per second on a line at 921 600 bit/s.
const LINE: f64 = 92_160.0;
/// Rates that are configured, Hz, highest first. Some formats have a rate of their own.
const RATES: [u16; 9] = [2000, 1000, 800, 500, 400, 250, 200, 125, 100];

/// Format, variant of its sensor and configured rate; and the actual rate of its frames, Hz.
type Sensor = ((ImuFormat, u8, u16), f64);

/// Rate of the frames, Hz, and whether a serial line can carry them.
fn rate(records: &[Record]) -> Option<(f64, bool)> {
    let mut frames = (records.iter())
        .filter(|r| r.input == Input::Sensor)
        .skip(10);
    let (first, last) = (frames.next()?, frames.nth(49)?);
    let rate = 50e6 / f64::from(last.at_us - first.at_us);
    Some((rate, rate * (first.bytes.len() as f64) < LINE))
}

/// The highest rate of this variant that the line carries.
fn highest(format: ImuFormat, variant: u8) -> Option<Sensor> {
    for rate_configured in RATES {
        let configuration = configured(format, variant, rate_configured)?;
        let Ok(records) = drive_configured(&configuration, format, [1, 0]) else {
            continue; // not a rate of this sensor
        };
        let (rate, fits) = rate(&records)?;
        if fits {
            return Some(((format, variant, rate_configured), rate));
        }
        if (rate - f64::from(rate_configured)).abs() > 1.0 {
            return None; // its frames state the rate
        }
    }
    None
}

/// The sensor of this format with the highest rate that the line carries.
fn fastest(format: ImuFormat) -> Sensor {
    let variants = 0..format.simulated().len() as u8;
    let sensors = variants.filter_map(|variant| highest(format, variant));
    let fastest = sensors.max_by(|(_, a), (_, b)| a.total_cmp(b));
    fastest.expect("a sensor")
}

/// Time between two requests, us. They arrive from the third second on.
const ASKED_US: u32 = 97_000;
const ASKED: [Request; 11] = [
    Request::GetHealth,
    Request::ReadLearnt {
        offset: 0,
        length: MAX_CHUNK as u16,
    },
    Request::GetEstimate,
    Request::GetCounters,
    Request::ReadImage {
        offset: 0,
        length: MAX_CHUNK as u16,
    },
    Request::GetAntenna,
    Request::GetRecording,
    Request::GetBoard,
    Request::GetSolution,
    Request::GetTrials,
    Request::GetProgress,
];

/// A drive with this sensor. The fixes arrive at the end of a block, from 20 ms before it to 20 ms
/// after it; each seventh comes together with the next one, and each eleventh is damaged.
fn drive((format, variant, rate): (ImuFormat, u8, u16)) -> Vec<Record> {
    let configuration = configured(format, variant, rate).expect("a sensor");
    let mut records = drive_configured(&configuration, format, [SECONDS, 0]).expect("a drive");
    let fixes = records
        .iter_mut()
        .filter(|record| record.input == Input::Gnss);
    for (number, fix) in fixes.enumerate() {
        let second = fix.at_us / 1_000_000 + 1 + u32::from(number % 7 == 6);
        fix.at_us = second * 1_000_000 + (number as u32 * 7 % 41) * 1000 - 20_000;
        if number % 11 == 10 {
            let middle = fix.bytes.len() / 2;
            fix.bytes[middle] ^= 0x10;
        }
    }
    for number in 0..(SECONDS - 5) * 1_000_000 / ASKED_US {
        let request = &ASKED[number as usize % ASKED.len()];
        records.push(Record {
            input: Input::Command,
            at_us: 3_000_000 + number * ASKED_US,
            bytes: packet_of(number as u8, request).expect("a packet"),
        });
    }
    records.sort_by_key(|record| record.at_us);
    records
}

#[test]
fn no_frame_is_late() {
    let Some(image) = REPLAY.build_or_skip() else {
        return;
    };
    let longest = Budgets::read().expect("budgets.toml").longest_pass;
    for format in ImuFormat::ALL {
        let (sensor, rate) = fastest(format);
        let records = drive(sensor);
        let here = configured_on_desktop(
            &configured(sensor.0, sensor.1, sensor.2).expect("a sensor"),
            &records,
        );
        let limit = Duration::from_secs(300);
        let there = timed_on_target(&image, NETDUINOPLUS2, sensor, &records, limit);
        let there = there.expect("it runs");
        let cost = there.cost.expect("counted");
        println!(
            "{:10} {rate:5.0} Hz: {:5.0} us after sample {:6}, pass {:7.0} after {:6}, {} fixes",
            format.name(),
            cost.late_us,
            cost.late_at,
            cost.pass,
            cost.pass_at,
            there.learnt.fixes
        );
        assert!(
            here.learnt.fixes > SECONDS / 3,
            "{format:?} {:?}",
            here.learnt
        );
        assert!(
            cost.pass <= longest,
            "{format:?}: a pass of {:.0} instructions after sample {}, budget {longest:.0}",
            cost.pass,
            cost.pass_at
        );
        assert_eq!(here.learnt, there.learnt, "{format:?}");
        assert!(here.sent == there.sent, "{format:?}");
    }
}

/// The second drive: its length, and how much of it is at rest, s.
const EVENTFUL: [u32; 2] = [200, 75];
/// Its sensor's rate, Hz.
const SLOW: u16 = 250;
/// Times without frames in it: a few frames, many, and so long that the sensor has restarted.
const MISSING_US: [[u32; 2]; 4] = [
    [90_000_000, 90_030_000],
    [95_100_000, 95_500_000],
    [100_000_000, 100_900_000],
    [105_000_000, 106_600_000],
];
/// Requests in this drive, and when they arrive, s. Then the device is configured again.
const EVENTS: [(u32, Request); 10] = [
    (
        110,
        Request::Heading(Heading {
            angle: 0.7,
            sigma: 0.2,
        }),
    ),
    (140, Request::CommitLearnt),
    (142, Request::Alignment(Alignment::Started)),
    (144, Request::Alignment(Alignment::Finished)),
    (146, Request::SetMode(Mode::Shadow)),
    (148, Request::SetMode(Mode::Learn)),
    (150, Request::SetMode(Mode::Bypass)),
    (151, Request::StoreImage),
    (152, Request::SetMode(Mode::Learn)),
    (154, Request::CommitLearnt),
];
const CONFIGURED_AGAIN_S: u32 = 160;

/// A drive with other events: an uncertain lever arm and fix age, a start after a standstill and
/// one in motion, missing samples, a sensor restart, other weights, modes, alignments, and a new
/// configuration while the device learns.
fn eventful(sensor: (ImuFormat, u8, u16)) -> Vec<Record> {
    let mut configuration = configured(sensor.0, sensor.1, sensor.2).expect("a sensor");
    configuration.receiver.lever_arm_sigma = 0.5;
    configuration.receiver.fix_delay_sigma = 0.05;
    let mut records = drive_configured(&configuration, sensor.0, EVENTFUL).expect("a drive");
    let missing = |at: u32| (MISSING_US.iter()).any(|[from, to]| (*from..*to).contains(&at));
    records.retain(|record| record.input != Input::Sensor || !missing(record.at_us));
    let packets = set_up_configured(&configuration, Mode::Learn).expect("packets");
    let command = |at_us: u32, bytes: Vec<u8>| Record {
        input: Input::Command,
        at_us,
        bytes,
    };
    for from_s in [1, CONFIGURED_AGAIN_S] {
        for (number, bytes) in packets.iter().enumerate() {
            let at_us = from_s * 1_000_000 + number as u32 * 30_000;
            records.push(command(at_us, bytes.clone()));
        }
    }
    for (number, (at_s, request)) in EVENTS.iter().enumerate() {
        let bytes = packet_of(number as u8, request).expect("a packet");
        records.push(command(at_s * 1_000_000 + 3000, bytes));
    }
    records.sort_by_key(|record| record.at_us);
    records
}

#[test]
fn no_pass_is_long_whatever_happens() {
    let Some(image) = REPLAY.build_or_skip() else {
        return;
    };
    let longest = Budgets::read().expect("budgets.toml").longest_pass;
    let sensor = (ImuFormat::Kvh, 0, SLOW);
    let records = eventful(sensor);
    let limit = Duration::from_secs(300);
    let there = timed_on_target(&image, NETDUINOPLUS2, sensor, &records, limit);
    let there = there.expect("it runs");
    let cost = there.cost.expect("counted");
    println!(
        "{:.0} us after sample {}, pass {:.0} after {}, {} fixes",
        cost.late_us, cost.late_at, cost.pass, cost.pass_at, there.learnt.fixes
    );
    assert!(there.learnt.fixes > 5, "{:?}", there.learnt);
    assert!(
        cost.pass <= longest,
        "a pass of {:.0} instructions after sample {}, budget {longest:.0}",
        cost.pass,
        cost.pass_at
    );
}
