//! The application over a drive of 75 s, at rest for 48 s: it aligns itself, navigates and learns
//! from fixes, with stored networks in force, while the fuzzer disturbs samples, fixes, lines,
//! requests and time. Nothing panics or hangs, corrections stay within their limit, and all numbers
//! that the device reports are finite. With `FUZZ_LONG` the drive has 1200 s, in which a learnt
//! correction is promoted.

use arbitrary::Arbitrary;
use firmware::app::{App, Config, Lines};
use firmware::control::{Alignment, Mode};
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::model::Nets;
use firmware::sample::RawSample;
use firmware::wire::command::{MAX_PACKET, Packets, Request, Response, decode, encode};
use firmware::wire::{Framer, ImuFormat, ubx::Pvt};
use host_device::hil::{Input as Line, MemoryLine, Record, SetClock, drive_from};
use lrnn_nostd::{Net, Normalisation, Weights};
use std::collections::HashMap;
use std::sync::OnceLock;

const FORMAT: ImuFormat = ImuFormat::Novatel;
/// Length of the drive, and of the long one, in which a learnt correction is promoted, s.
const SECONDS: [u32; 2] = [75, 1200];
/// Time at rest at its start, s.
const STANDSTILL_S: u32 = 48;
/// When the alignment is reported to begin and to end, us.
const ALIGN: [u32; 2] = [3_000_000, 46_000_000];

#[derive(Arbitrary, Debug, Clone, Copy)]
enum Act {
    /// This number of records is lost.
    Lose(u8),
    /// A wrong bit.
    Flip(u8, u8),
    /// Additional bytes on one of the lines.
    Bytes(u8, [u8; 8]),
    /// The record arrives twice.
    Again,
    /// This record and all later ones arrive later, by this number times 10 ms.
    Late(u8),
    /// Offsets added to the counts, for this number of frames; 255: to the end.
    Values([i16; 6], u8),
    /// The next fixes have another position and velocity: offsets in cm and mm/s, number of fixes.
    Fix([i16; 3], [i16; 3], u8),
    /// The next fix has another time: offset, ms.
    Time(i16),
    /// The next fix states this accuracy, mm.
    Accuracy(u16),
    /// A request.
    Request(u8),
    /// The learnt state is stored, and recalled with this byte changed.
    Recall(u16, u8),
}

#[derive(Arbitrary, Debug)]
struct Input {
    /// When in the drive, as a share of 65 536, and what.
    acts: Vec<(u16, Act)>,
}

fn records(long: bool) -> &'static [Record] {
    static DRIVES: [OnceLock<Vec<Record>>; 2] = [const { OnceLock::new() }; 2];
    let index = usize::from(long);
    DRIVES[index].get_or_init(|| {
        let drive = drive_from(FORMAT, SECONDS[index], STANDSTILL_S);
        drive.unwrap_or_else(|error| panic!("{error}")).records
    })
}

/// Networks as they may be stored: an offset, so that there is a correction from the first block
/// on.
fn stored() -> Nets {
    let net = |size: f32| {
        let mut weights = Weights::zero();
        weights.iter_mut().for_each(|weight| *weight = size);
        Net::new(weights, Normalisation::identity())
    };
    Nets {
        gyro: net(1e-6),
        accel: net(1e-3),
        ..Nets::NONE
    }
}

/// State of the device at the end.
#[derive(Debug, Default, Clone, Copy)]
pub struct End {
    /// Whether it navigates.
    pub navigates: bool,
    /// Fixes that it learnt from.
    pub fixes: u32,
    /// How often what was learnt was promoted.
    pub promotions: u32,
    /// Whether a correction is in force.
    pub corrected: bool,
}

struct Device<'m> {
    app: App<'m>,
    lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine>,
    clock: SetClock,
    framer: Framer,
    /// Samples sent to the device, by their time.
    inside: HashMap<u64, RawSample>,
    packets: Packets,
    end: End,
    /// Largest correction of a sample, counts.
    most: [f64; 2],
}

/// Time and sample of a frame, to find it in the output.
fn time_and_sample(bytes: &mut [u8]) -> Option<(u64, RawSample)> {
    let checked = firmware::wire::Checked::new(FORMAT, bytes).ok()?;
    let reading = checked.read().ok()?;
    Some((reading.time?.to_bits(), reading.sample))
}

impl Device<'_> {
    fn settle(&mut self) {
        let mut passes = 0;
        while self.app.poll(&mut self.lines, &self.clock) {
            passes += 1;
            assert!(passes < 5000, "it never rests");
        }
        for byte in std::mem::take(&mut self.lines.command.sent) {
            let Some(packet) = self.packets.push(byte) else {
                continue;
            };
            match decode::<Response>(packet).expect("our own packet").1 {
                Response::Health(health) => {
                    self.end.navigates = health.navigates;
                    self.end.fixes = health.used_fixes;
                    self.end.promotions = health.promotions;
                }
                Response::Estimate(estimate) => {
                    let values = [estimate.in_force, estimate.network_output, estimate.learnt];
                    let mut values = values.as_flattened().as_flattened().iter();
                    assert!(values.all(|value| value.is_finite()), "{estimate:?}");
                    let mut in_force = estimate.in_force.as_flattened().iter();
                    self.end.corrected |= in_force.any(|value| *value != 0.0);
                }
                Response::Antenna(antenna) => {
                    let arm = antenna.lever_arm.iter().chain(&antenna.lever_arm_sigma);
                    let mut delay = [antenna.fix_delay, antenna.fix_delay_sigma].into_iter();
                    assert!(arm.copied().all(f32::is_finite), "{antenna:?}");
                    assert!(delay.all(f32::is_finite), "{antenna:?}");
                }
                _ => {}
            }
        }
        let sent = std::mem::take(&mut self.lines.navigation.sent);
        for piece in sent.chunks(64) {
            self.framer.push(piece);
            while let Some(event) = self.framer.next_event() {
                let mut bytes = event.bytes().to_vec();
                if let Some((time, out)) = time_and_sample(&mut bytes)
                    && let Some(was) = self.inside.get(&time)
                {
                    let off = difference(*was, out);
                    for triad in 0..2 {
                        assert!(
                            off[triad] <= self.most[triad],
                            "{off:?} beyond {:?}",
                            self.most
                        );
                    }
                }
            }
        }
    }

    fn ask(&mut self, request: &Request<'_>) {
        let mut packet = [0; MAX_PACKET];
        let packet = encode(7, request, &mut packet).expect("room");
        self.lines.command.received.extend(&*packet);
        self.settle();
    }

    fn pass_to(&mut self, until: u64) {
        while self.clock.0 + 10_000 < until {
            self.clock.0 += 10_000;
            self.settle();
        }
        self.clock.0 = until.max(self.clock.0);
    }

    fn request(&mut self, kind: u8) {
        self.ask(&match kind % 16 {
            0 => Request::SetMode(Mode::Bypass),
            1 => Request::SetMode(Mode::Frozen),
            2 => Request::SetMode(Mode::Shadow),
            3 => Request::SetMode(Mode::Learn),
            4 => Request::Alignment(Alignment::Started),
            5 => Request::Alignment(Alignment::Finished),
            6 => Request::StoreImage,
            7 => Request::CommitLearnt,
            8 => Request::GetMemory,
            9 => Request::GetAntenna,
            10 => Request::GetEstimate,
            11 => Request::GetSolution,
            12 => Request::GetTrials,
            13 => Request::GetProgress,
            _ => Request::GetHealth,
        });
    }
}

/// The largest difference of each triad, counts.
fn difference(a: RawSample, b: RawSample) -> [f64; 2] {
    let (RawSample::Counts { gyro: g, accel: f }, RawSample::Counts { gyro, accel }) = (a, b)
    else {
        return [0.0; 2];
    };
    let largest = |a: [i32; 3], b: [i32; 3]| {
        let pairs = a.into_iter().zip(b);
        pairs
            .map(|(a, b)| (f64::from(a) - f64::from(b)).abs())
            .fold(0.0, f64::max)
    };
    [largest(g, gyro), largest(f, accel)]
}

/// Adds to the counts of a frame and updates its checksum.
fn other_values(bytes: &mut [u8], add: [i16; 6]) {
    use firmware::wire::{Change, Checked, Settings};
    let Ok(mut checked) = Checked::new(FORMAT, bytes) else {
        return;
    };
    let Ok(RawSample::Counts { gyro, accel }) = checked.read().map(|reading| reading.sample) else {
        return;
    };
    let [a, b, c, d, e, f] = add.map(|count| i32::from(count) * 64);
    let plus = |x: [i32; 3], y: [i32; 3]| [0, 1, 2].map(|k| x[k].wrapping_add(y[k]));
    let sample = &RawSample::Counts {
        gyro: plus(gyro, [a, b, c]),
        accel: plus(accel, [d, e, f]),
    };
    let settings = &Settings::DEFAULT;
    let _ = checked.change(&Change {
        sample,
        mark: false,
        settings,
    });
}

/// Whether it navigates at the end, and learnt from fixes.
pub fn run(bytes: &[u8]) -> bool {
    let long = std::env::var_os("FUZZ_LONG").is_some();
    drive(bytes, long).is_some_and(|end| end.navigates && end.fixes > 10)
}

/// Drives for 75 s, or for 400; `None`: the bytes are no input.
#[expect(clippy::too_many_lines, reason = "the script of one drive")]
pub fn drive(bytes: &[u8], long: bool) -> Option<End> {
    let input = crate::structured::<Input>(bytes)?;
    let mut windows = WindowLearner::new();
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut learner = CombinedLearner {
        references: &mut windows,
        fixes: FixLearner::new(&mut memory, Settings::MEDIUM),
    };
    let sensor = &FORMAT.simulated()[0];
    let config = Config {
        format: Some(FORMAT),
        sensor: sensor.settings(),
        mode: Mode::Learn,
        nets: stored(),
        block: 1.0,
        store: true,
        ..Config::default()
    };
    let limit = [config.limit.gyro, config.limit.accel];
    let most = [0, 1].map(|triad| {
        f64::from(limit[triad]) * 1.001 / (sensor.unit[triad] * f64::from(sensor.rate)) + 2.0
    });
    let mut device = Device {
        app: App::with_learner(config, Some(&mut learner)),
        lines: Lines::default(),
        clock: SetClock(0),
        framer: Framer::new(FORMAT),
        inside: HashMap::new(),
        packets: Packets::new(),
        end: End::default(),
        most,
    };
    let mut acts = input.acts.clone();
    acts.truncate(40);
    acts.sort_by_key(|(at, _)| *at);
    let mut acts = acts.iter().peekable();
    let records = records(long);
    let (mut lost, mut late_us, mut values, mut aligned) = (0, 0, ([0; 6], 0), 0);
    let mut fix: Vec<Act> = Vec::new();
    for (k, record) in records.iter().enumerate() {
        let now = u64::from(record.at_us) + late_us;
        device.pass_to(now);
        if ALIGN.get(aligned).is_some_and(|at| record.at_us >= *at) {
            let alignment = [Alignment::Started, Alignment::Finished][aligned];
            aligned += 1;
            device.ask(&Request::Alignment(alignment));
        }
        let mut bytes = record.bytes.clone();
        let mut times = 1;
        let share = k as u64 * 65_536 / records.len() as u64;
        while let Some((_, act)) = acts.next_if(|(at, _)| u64::from(*at) <= share) {
            match *act {
                Act::Lose(count) => lost = u32::from(count),
                Act::Flip(at, bit) => {
                    let at = usize::from(at) % bytes.len();
                    bytes[at] ^= 1 << (bit % 8);
                }
                Act::Bytes(line, noise) => match line % 4 {
                    0 => device.lines.sensor.received.extend(noise),
                    1 => device.lines.navigation.received.extend(noise),
                    2 => device.lines.gnss.received.extend(noise),
                    _ => device.lines.command.received.extend(noise),
                },
                Act::Again => times = 2,
                Act::Late(by) => late_us += u64::from(by) * 10_000,
                Act::Values(add, count) => {
                    let frames = if count == u8::MAX {
                        u32::MAX
                    } else {
                        count.into()
                    };
                    values = (add, frames);
                }
                Act::Fix(..) | Act::Time(_) | Act::Accuracy(_) => fix.push(*act),
                Act::Request(kind) => device.request(kind),
                Act::Recall(at, with) => {
                    let mut memory = vec![0; 64];
                    let position = usize::from(at) % memory.len();
                    memory[position] = with;
                    device.app.recall(&memory);
                }
            }
        }
        if lost > 0 {
            lost -= 1;
            continue;
        }
        match record.input {
            Line::Sensor => {
                if values.1 > 0 {
                    values.1 -= 1;
                    other_values(&mut bytes, values.0);
                }
                if let Some((time, sample)) = time_and_sample(&mut bytes) {
                    device.inside.insert(time, sample);
                }
                for _ in 0..times {
                    device.lines.sensor.received.extend(&bytes);
                    device.settle();
                }
            }
            _ => {
                if let Some(mut pvt) = Pvt::parse(&bytes).ok().filter(|_| !fix.is_empty()) {
                    fix.retain_mut(|act| disturb(&mut pvt, act));
                    bytes = pvt.emit().to_vec();
                }
                for _ in 0..times {
                    device.lines.gnss.received.extend(&bytes);
                    device.settle();
                }
            }
        }
    }
    for request in [
        Request::GetHealth,
        Request::GetEstimate,
        Request::GetAntenna,
    ] {
        device.ask(&request);
    }
    let end = device.end;
    if input.acts.is_empty() {
        assert!(end.navigates && end.fixes > 10, "{end:?}");
    }
    Some(end)
}

/// Whether it disturbs the next fix, too.
fn disturb(pvt: &mut Pvt, act: &mut Act) -> bool {
    match act {
        Act::Fix([north, east, up], velocity, count) => {
            pvt.latitude = pvt.latitude.wrapping_add(i32::from(*north));
            pvt.longitude = pvt.longitude.wrapping_add(i32::from(*east));
            pvt.height = pvt.height.wrapping_add(i32::from(*up) * 10);
            for (value, add) in pvt.velocity.iter_mut().zip(velocity) {
                *value = value.wrapping_add(i32::from(*add));
            }
            *count = count.saturating_sub(1);
            *count > 0
        }
        Act::Time(by) => {
            pvt.time_of_week = pvt.time_of_week.wrapping_add_signed(i32::from(*by));
            false
        }
        Act::Accuracy(mm) => {
            pvt.horizontal_accuracy = u32::from(*mm);
            pvt.vertical_accuracy = u32::from(*mm);
            pvt.speed_accuracy = u32::from(*mm);
            false
        }
        _ => false,
    }
}
