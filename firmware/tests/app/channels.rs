//! One sensor that sends several kinds of frames on one line: each is corrected, each integrates
//! exactly, and a sample that comes in two of them counts once.

use crate::device::{Device, nets};
use crate::frames::{Fields, Kind, kinds, values};
use firmware::app::{Config, Phase, phase::Cause};
use firmware::compensator::Limit;
use firmware::control::Mode;
use firmware::wire::command::fault;
use firmware::wire::stim300::{Contents, Extra};
use firmware::wire::{ImuFormat, novatel, stim300};

/// rad/s and m/s2, less than a count a sample.
const ERROR: [f32; 6] = [4.848e-8, -1.6e-6, 0.0, 3.0e-4, 0.0, -2.2e-3];

fn config(kind: Kind) -> Config {
    let [gx, gy, gz, ax, ay, az] = ERROR;
    Config {
        mode: Mode::Frozen,
        nets: nets([gx, gy, gz], [ax, ay, az]),
        block: 0.1,
        limit: Limit {
            gyro: 1.0,
            accel: 1.0,
        },
        ..kind.config()
    }
}

/// Sum of the corrections of one kind of frame.
struct Log {
    kind: Kind,
    frames: u32,
    sum: [f64; 6],
    largest: [f64; 6],
    is_float: bool,
}

impl Log {
    fn of(kind: Kind) -> Log {
        Log {
            kind,
            frames: 0,
            sum: [0.0; 6],
            largest: [0.0; 6],
            is_float: false,
        }
    }

    /// The frame in, and the one that leaves.
    fn feed(&mut self, device: &mut Device, frame: &[u8]) {
        device.feed(frame);
        let sent = device.lines.navigation.sent.pop().expect("a frame");
        let [before, after] = [frame, &sent[..]].map(|frame| values(self.kind.format, frame));
        for axis in 0..6 {
            self.sum[axis] += before[axis] - after[axis];
            self.largest[axis] = self.largest[axis].max(after[axis].abs());
            self.is_float |= before[axis].fract() != 0.0;
        }
        self.frames += 1;
    }

    /// The correction begins with the first frame. `slack`: how often more than the last rounding
    /// is allowed.
    fn check(&self, slack: f64) {
        for (axis, error) in ERROR.into_iter().enumerate() {
            let unit = self.kind.sensor.unit[axis / 3];
            let samples = f64::from(self.frames);
            let exact = samples * f64::from(error) / self.kind.rate() / unit;
            let rounding = if self.is_float {
                1.01 * self.largest[axis] * f64::from(f32::EPSILON) / 2.0
            } else {
                0.5 + 1e-9
            };
            let off = (self.sum[axis] - exact).abs();
            let what = format!("{} axis {axis}: {off} of {exact}", self.kind.sensor.name);
            assert!(off <= slack * rounding + exact.abs() * 3e-7, "{what}");
        }
    }
}

fn fields(n: u32) -> Fields {
    Fields {
        gyro: [5, -3, n as i32 % 7],
        accel: [1, n as i32 % 5, 1000],
        rest: n,
        ..Fields::default()
    }
}

pub fn named(name: &str) -> Kind {
    let found = kinds().into_iter().find(|kind| kind.sensor.name == name);
    found.expect("a kind of this name")
}

/// RAWIMUS and RAWIMUSX of one IMU on one line. The order of their samples does not matter.
#[test]
fn two_logs_of_one_imu() {
    const SAMPLES: u32 = 20_000;
    for late in [0, 1, 3] {
        let mut logs = ["novatel RAWIMUS", "novatel RAWIMUSX"].map(|name| Log::of(named(name)));
        let mut device = Device::new(config(logs[0].kind));
        for n in 0..SAMPLES + late {
            for (log, late) in logs.iter_mut().zip([0, late]) {
                if let Some(n) = n.checked_sub(late)
                    && n < SAMPLES
                {
                    let frame = log.kind.frame(n, fields(n));
                    log.feed(&mut device, &frame);
                }
            }
        }
        logs.iter().for_each(|log| log.check(1.0));
        let counters = device.counters();
        assert_eq!(counters.frames, 2 * SAMPLES);
        assert_eq!(
            (counters.missed, counters.duplicates, counters.jumps),
            (0, 0, 0)
        );
        // the first sample makes the correction, and a block has 10 samples
        assert_eq!(
            (counters.blocks, counters.given_up),
            (SAMPLES / 10, 0),
            "{late}"
        );
        assert_eq!(device.app.faults(), 0);
    }
}

/// A sample that is lost in one of two logs is not missing.
#[test]
fn what_one_log_loses_the_other_has() {
    let logs = ["novatel RAWIMUS", "novatel RAWIMUSX"].map(named);
    let mut device = Device::new(config(logs[0]));
    for n in 0..1000u32 {
        for (which, kind) in (0..).zip(logs) {
            if n % 7 != which * 3 + 1 {
                device.feed(&kind.frame(n, fields(n)));
            }
        }
    }
    let counters = device.counters();
    assert_eq!(
        (counters.missed, counters.blocks, counters.given_up),
        (0, 100, 0)
    );
}

/// sbgECom's two messages have different units and rates. The more frequent one makes the blocks.
#[test]
fn two_messages_of_one_sensor() {
    for first in [0, 1] {
        let mut short = Log::of(named("sbgecom IMU_SHORT"));
        let mut data = Log::of(named("sbgecom IMU_DATA"));
        let mut device = Device::new(config(short.kind));
        let mut begun = 0;
        for n in 0..50_000u32 {
            let time = |kind: Kind, n: u32| kind.frame(n, fields(n));
            if n >= first {
                let frame = time(short.kind, n);
                if begun > 0 {
                    short.feed(&mut device, &frame);
                } else {
                    device.feed(&frame);
                }
            }
            if n % 5 == 0 {
                let frame = time(data.kind, n / 5);
                if begun > 0 {
                    data.feed(&mut device, &frame);
                } else {
                    device.feed(&frame);
                }
            }
            // where the slower one came first, the faster one soon replaces it
            if begun == 0 && n == 500 {
                begun = device.counters().blocks + 1;
                // both are counted from here on
                (short.frames, data.frames) = (0, 0);
            }
        }
        // over the rest no correction is lost; the remainders at its beginning are not zero
        short.check(2.0);
        data.check(2.0);
        let counters = device.counters();
        assert!(counters.blocks > 490, "{counters:?}");
        assert_eq!(device.app.faults(), 0);
    }
}

/// A VectorNav's increments over so many samples of its own IMU, at this time.
fn over(samples: u32, time: f64, fields: Fields) -> Vec<u8> {
    let kind = named("vectornav, increments");
    let mut frame = [0; 256];
    let fields = Fields { time, ..fields };
    let len = (kind.sensor.emit)(&fields, &mut frame).expect("room");
    let frame = &mut frame[..len];
    frame[32..36].copy_from_slice(&(samples as f32 / 800.0).to_le_bytes()); // DeltaTime
    kind.format.seal(frame);
    frame.to_vec()
}

/// Two outputs of a VectorNav have increments, one over 2 and one over 4 samples of its IMU, and
/// the configured rate is another one. Each is corrected by its own time, and the one that comes
/// more often makes the blocks. A time that comes seldom is no fault.
#[test]
fn two_outputs_with_increments() {
    let kind = named("vectornav, increments");
    let mut device = Device::new(config(kind));
    let mut sums = [[0.0; 6]; 2];
    let mut feed = |samples: u32, time: f64, n: u32| {
        let frame = over(samples, time, fields(n));
        device.feed(&frame);
        let sent = device.lines.navigation.sent.pop().expect("a frame");
        let [before, after] = [&frame, &sent].map(|frame| values(kind.format, frame));
        let sum = match samples {
            2 => &mut sums[0],
            4 => &mut sums[1],
            _ => return,
        };
        (0..6).for_each(|axis| sum[axis] += before[axis] - after[axis]);
    };
    const SAMPLES: u32 = 40_000;
    for n in 0..SAMPLES {
        let time = 1000.0 + f64::from(n) / 400.0;
        feed(2, time, n);
        if n % 2 == 0 {
            feed(4, time, n);
        }
        if n % 1000 == 999 {
            let seldom = [5, 8, 10, 16, 20, 25];
            feed(seldom[n as usize / 1000 % 6], time + 0.000_1, n);
        }
    }
    let seconds = f64::from(SAMPLES) / 400.0;
    for (axis, error) in ERROR.into_iter().enumerate() {
        let exact = seconds * f64::from(error) / kind.sensor.unit[axis / 3];
        for (which, sum) in sums.iter().enumerate() {
            let off = (sum[axis] - exact).abs();
            assert!(
                off <= 1e-3 * exact.abs() + 1e-6,
                "{which} {axis}: {off} of {exact}"
            );
        }
    }
    let counters = device.counters();
    assert_eq!(
        (counters.missed, counters.jumps, counters.given_up),
        (0, 0, 0)
    );
    assert_eq!((counters.blocks, device.app.faults()), (SAMPLES / 40, 0));
}

/// A STIM300 measurement in increments.
fn stim(id: u8, n: u32) -> Vec<u8> {
    let cluster = |values| stim300::Cluster { values, status: 0 };
    let repr = stim300::Repr {
        contents: Contents::from_id(id).expect("an identifier"),
        gyro: cluster(fields(n).gyro),
        accel: cluster(fields(n).accel),
        incl: cluster([1, 2, 3]),
        temperatures: [stim300::Temperatures::default(); 3],
        extra: (n, 0),
        counter: (2 * n) as u8,
        latency_us: 120,
    };
    let mut buffer = [0; stim300::MAX_LEN];
    let len = repr.emit(&mut buffer).expect("room");
    buffer[..len].to_vec()
}

/// Datagrams with and without temperatures in turn: one stream of samples.
#[test]
fn contents_in_turn() {
    let mut log = Log::of(Kind::STIM);
    let mut device = Device::new(config(Kind::STIM));
    for n in 0..30_000 {
        let id = if n % 2 == 0 { 0x91 } else { 0xA5 };
        log.feed(&mut device, &stim(id, n));
    }
    log.check(1.0);
    let counters = device.counters();
    assert_eq!(
        (counters.missed, counters.blocks, counters.given_up),
        (0, 300, 0)
    );
}

/// The identifier of the other family is written, and the samples are corrected all the same.
#[test]
fn another_family_is_corrected() {
    let mut config = config(Kind::STIM);
    config.sensor.stim300.family = Some(Extra::Aux);
    let mut device = Device::new(config);
    let (mut sum, samples) = ([0.0; 6], 30_000);
    for n in 0..samples {
        device.feed(&stim(0xF7, n));
        let sent = device.lines.navigation.sent.pop().expect("a frame");
        assert_eq!(sent[0], 0xAF);
        let [before, after] = [&stim(0xF7, n), &sent].map(|f| values(ImuFormat::Stim300, f));
        (0..6).for_each(|axis| sum[axis] += before[axis] - after[axis]);
    }
    for axis in 0..6 {
        let unit = Kind::STIM.sensor.unit[axis / 3];
        let exact = f64::from(samples) * f64::from(ERROR[axis]) / 1000.0 / unit;
        assert!(
            (sum[axis] - exact).abs() <= 0.5 + exact.abs() * 3e-7,
            "{axis}: {} {exact}",
            sum[axis]
        );
    }
    assert_eq!(device.app.faults(), 0);
}

/// A RAWIMUSX log of another IMU type.
fn of_type(kind: u8, n: u32) -> Vec<u8> {
    let mut frame = Kind::RAWIMUSX.frame(n, fields(n));
    frame[12 + 1] = kind;
    ImuFormat::Novatel.seal(&mut frame);
    frame
}

/// More kinds of frames than the device can distinguish, or one whose units are not known: a fault
/// reports it, and everything passes.
#[test]
fn more_kinds_than_there_is_room_for() {
    let known = [11, 26, 8, 13, 31];
    assert!(
        known
            .iter()
            .all(|kind| novatel::ImuType(*kind).units().is_some())
    );
    for (types, is_lost) in [(&known[..4], false), (&known[..], true), (&[11, 99], true)] {
        let mut device = Device::new(config(Kind::RAWIMUSX));
        let mut came = Vec::new();
        for n in 0..200 {
            for kind in types {
                let frame = of_type(*kind, n);
                device.feed(&frame);
                came.push(frame);
            }
        }
        let lost = device.app.phase() == Phase::Fault(Cause::Units);
        assert_eq!(lost, is_lost, "{types:?}");
        assert_eq!(
            device.app.faults() & fault::UNITS != 0,
            is_lost,
            "{types:?}"
        );
        if lost {
            let last = came.len() - 100;
            assert_eq!(
                device.lines.navigation.bytes()[last * 56..],
                came[last..].concat()
            );
        }
    }
}
