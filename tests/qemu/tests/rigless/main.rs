//! Our STM32 images in an emulator that others wrote (`tests/rigless`). docs/BOARDS.md says what it
//! vouches for.

mod f4;
mod h743;

use std::path::Path;

use firmware::app::{Config, Hardware};
use firmware::wire::ImuFormat;
use qemu::drive::{Record, drive};
use qemu::emulator::{Asked, Outcome};
use qemu::replay::Input;
use qemu::software::on_desktop;

const MS: u64 = 1_000_000;
const BAUD: u64 = 921_600;
/// Between two commands: the longest packet, and the answer.
const COMMAND: u64 = 8 * MS;

/// Sensor, navigation and command line.
struct Wires([&'static str; 3]);

/// The first frames of a drive.
fn frames(format: ImuFormat, count: usize) -> Vec<Record> {
    let records = drive(format, 1).expect("a drive").into_iter();
    let sensor = records.filter(|record| record.input == Input::Sensor);
    sensor.take(count).collect()
}

/// What the desktop sends for these requests and frames.
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
    /// Requests from a time on, then frames with a period. Gives when each frame's last byte ends.
    fn feed(
        &self,
        asked: &mut Asked,
        (begin, requests): (u64, &[Vec<u8>]),
        (period, baud): (u64, u64),
        frames: &[Record],
    ) -> Vec<u64> {
        let [sensor, navigation, command] = self.0;
        let mut at = begin;
        for request in requests {
            asked.send(command, at, BAUD, request);
            at += COMMAND;
        }
        let ends = frames.iter().map(|frame| {
            asked.send(sensor, at, baud, &frame.bytes);
            let end = at + frame.bytes.len() as u64 * 10_000_000_000 / baud;
            at += period;
            end
        });
        let ends = ends.collect();
        asked.until = asked.until.max(at + 5 * MS);
        asked.listen.extend([navigation, command]);
        ends
    }

    /// What left for the navigation computer.
    fn sent<'t>(&self, told: &'t Outcome) -> &'t (Vec<u8>, Vec<u64>) {
        &told.left[self.0[1]]
    }

    /// From the last byte of a frame to the first byte sent, us: the median and the greatest.
    /// The first quarter of the frames, which is held until the format is known, does not count,
    /// nor do datagrams of another length, which wait for the loop's turn by design.
    fn latencies(&self, told: &Outcome, frames: &[Record], ends: &[u64]) -> [f64; 2] {
        let (_, times) = self.sent(told);
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

/// A run, with what the emulator does not model printed.
fn run(emulator: &Path, asked: &Asked) -> Outcome {
    let told = qemu::emulator::run(emulator, asked).expect("it runs");
    println!("{:?} {:#?}", told.resets, told.lines);
    told
}
