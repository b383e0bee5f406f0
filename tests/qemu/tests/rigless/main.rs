//! Our STM32 images in a third-party emulator (`tests/rigless`). docs/BOARDS.md says what it
//! covers.

mod f4;
mod h743;
mod update;

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::Result;
use firmware::app::{Config, Hardware};
use firmware::wire::ImuFormat;
use qemu::drive::{Record, drive};
use qemu::emulator::{Outcome, RunRequest};
use qemu::replay::Input;
use qemu::software::on_desktop;

const MS: u64 = 1_000_000;
const BAUD: u64 = 921_600;
/// Time between two commands, ns: the longest packet, and the answer.
const COMMAND: u64 = 8 * MS;

/// UARTs of the sensor, navigation and command line.
struct Wires([&'static str; 3]);

/// The first frames of a drive.
fn frames(format: ImuFormat, count: usize) -> Vec<Record> {
    let records = drive(format, 1).expect("a drive").into_iter();
    let sensor = records.filter(|record| record.input == Input::Sensor);
    sensor.take(count).collect()
}

/// Output of the desktop for these requests and frames.
fn desktops(requests: &[Vec<u8>], frames: &[Record]) -> Vec<u8> {
    let mut input: Vec<_> = requests
        .iter()
        .map(|bytes| Record {
            input: Input::Command,
            at_us: 0,
            bytes: bytes.clone(),
        })
        .collect();
    input.extend_from_slice(frames);
    on_desktop(Config::unconfigured(Hardware::DESKTOP), &input).sent
}

impl Wires {
    /// Queues requests from a time on, then frames with a period, ns. Returns when each frame's
    /// last byte ends.
    fn feed(
        &self,
        run: &mut RunRequest,
        (begin, requests): (u64, &[Vec<u8>]),
        (period, baud): (u64, u64),
        frames: &[Record],
    ) -> Vec<u64> {
        let [sensor, navigation, command] = self.0;
        let mut at = begin;
        for request in requests {
            run.send(command, at, BAUD, request);
            at += COMMAND;
        }
        let ends = frames.iter().map(|frame| {
            run.send(sensor, at, baud, &frame.bytes);
            let end = at + frame.bytes.len() as u64 * 10_000_000_000 / baud;
            at += period;
            end
        });
        let ends = ends.collect();
        run.until = run.until.max(at + 5 * MS);
        run.listen.extend([navigation, command]);
        ends
    }

    /// Bytes sent to the navigation computer, and when each ended.
    fn sent<'t>(&self, outcome: &'t Outcome) -> &'t (Vec<u8>, Vec<u64>) {
        &outcome.left[self.0[1]]
    }

    /// From the last byte of a frame to the first byte sent, us: the median and the maximum. The
    /// first quarter of the frames, which is buffered until the format is known, does not count,
    /// nor do datagrams of another length, which wait for the main loop by design.
    fn latencies(&self, outcome: &Outcome, frames: &[Record], ends: &[u64]) -> [f64; 2] {
        let (_, times) = self.sent(outcome);
        let byte = times.windows(2).map(|two| two[1] - two[0]).min();
        let byte = byte.expect("two bytes");
        let (mut late, mut begin) = (Vec::new(), 0);
        let usual = frames.last().expect("a frame").bytes.len();
        for (n, (frame, end)) in frames.iter().zip(ends).enumerate() {
            if n >= frames.len() / 4 && frame.bytes.len() == usual {
                late.push((times[begin] - byte) as f64 / 1000.0 - *end as f64 / 1000.0);
            }
            begin += frame.bytes.len();
        }
        late.sort_by(f64::total_cmp);
        [late[late.len() / 2], late[late.len() - 1]]
    }
}

/// Builds an image and keeps a copy, since another test's build with other settings writes over it.
fn built_copy(name: &str, build: impl FnOnce() -> Result<PathBuf>) -> PathBuf {
    let folder = qemu::images::target_directory().expect("a folder");
    let folder = folder.join("rigless-images");
    std::fs::create_dir_all(&folder).expect("a folder");
    // each test is a process, and the next build replaces what this one copies
    let one = File::create(folder.join("lock")).expect("a file");
    one.lock().expect("builds");
    let copy = folder.join(name);
    std::fs::copy(build().expect("it builds"), &copy).expect("a copy");
    copy
}

/// Runs an image, and prints resets and what the emulator does not model.
fn run(emulator: &Path, request: &RunRequest) -> Outcome {
    let outcome = qemu::emulator::run(emulator, request).expect("it runs");
    println!("{:?} {:#?}", outcome.resets, outcome.lines);
    outcome
}
