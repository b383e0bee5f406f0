//! The device learns over a whole drive from the receiver's bytes; target and desktop agree bit for
//! bit.

use std::sync::OnceLock;
use std::time::Duration;

use firmware::align::{Align, Sensors};
use firmware::compensator::{Compensator, Limit};
use firmware::learn::{FixMemory, Settings};
use firmware::model::Nets;
use firmware::sample::{Lsb, Unit};
use firmware::wire::novatel::ImuType;
use firmware::wire::ubx::Pvt;
use firmware::wire::{Checked, ImuFormat};
use host_core::inertial::session::Session;
use host_estimation::learning::fix_learner::Device;
use qemu::drive::{Record, drive_from};
use qemu::images::REPLAY;
use qemu::machine::{Clock, NETDUINOPLUS2};
use qemu::replay::{Input, Pace, nets};
use qemu::software::{changed, learning_on_desktop, on_target};
use vectors::Digest;

const FORMAT: ImuFormat = ImuFormat::Stim300;
/// 150 s at rest, then half an hour of driving: to prove a correction, to settle, and to fade in.
const STANDSTILL_S: u32 = 150;
const SECONDS: u32 = STANDSTILL_S + 1800;

fn drive() -> &'static (Session, Vec<Record>) {
    static DRIVE: OnceLock<(Session, Vec<Record>)> = OnceLock::new();
    DRIVE.get_or_init(|| drive_from(FORMAT, SECONDS, STANDSTILL_S).expect("a drive"))
}

#[test]
fn a_whole_drive_teaches_the_target_the_same_weights() {
    let Some(image) = REPLAY.build_or_skip() else {
        return;
    };
    let (_, records) = drive();
    let here = learning_on_desktop(FORMAT, records);
    println!("{:?}, {} samples", here.learnt, here.samples);
    assert!(
        here.learnt.fixes > 900 && here.learnt.winner > 0,
        "{:?}",
        here.learnt
    );
    assert!(changed(records, &here.sent).expect("one length") > 10_000);
    let counted = (Pace::Record, Clock::Instructions, true);
    let limit = Duration::from_secs(500);
    let there = on_target(&image, NETDUINOPLUS2, FORMAT, counted, records, limit).expect("it runs");
    println!("{:?}", there.cost);
    assert_eq!(here.learnt, there.learnt);
    assert_eq!((here.samples, here.digest), (there.samples, there.digest));
    assert!(here.sent == there.sent);
    // the learner interrupts nothing (`deadlines`)
    let cost = there.cost.expect("counted");
    assert!(cost.pass < 27_000.0, "{cost:?}");
}

/// The estimate in force at the end is the sensor's error of that time, as far as it can be known.
/// The simulation knows the true error.
#[test]
fn what_is_taken_out_is_the_sensors_error() {
    let (session, records) = drive();
    let here = learning_on_desktop(FORMAT, records);
    let came: Vec<u8> = records.iter().flat_map(|r| r.bytes.clone()).collect();
    assert!(here.sent.len() < came.len());
    let truth = session.systematic.as_ref().expect("a simulation knows");
    let last = &truth[SECONDS as usize - 30..SECONDS as usize - 1];
    let n = last.len() as f64;
    let sums = |samples: &[[i64; 6]]| -> [i64; 6] {
        samples.iter().fold([0; 6], |sum, sample| {
            std::array::from_fn(|i| sum[i] + sample[i])
        })
    };
    // The correction of these seconds: the difference between the samples received and those sent.
    let rate = (1.0 / session.dt).round() as usize;
    let tail = last.len() * rate;
    let (before, after) = (words_of(records), words_sent(&here.sent));
    assert_eq!(before.len(), after.len());
    let cut = |all: &[[i64; 6]]| sums(&all[all.len() - rate - tail..all.len() - rate]);
    let (before, after) = (cut(&before), cut(&after));
    let lsb = [session.lsb.rad, session.lsb.mps];
    let prior = [1.63e-6, 4e-3];
    for axis in 0..6 {
        let triad = axis / 3;
        let taken = (before[axis] - after[axis]) as f64 * lsb[triad] / n;
        let error: f64 = last
            .iter()
            .map(|e| [e.dtheta, e.dv][triad][axis % 3])
            .sum::<f64>()
            / n;
        println!("{axis}: error {error:+.3e}, taken out {taken:+.3e}");
        // the vertical gyro affects only the heading, which only curves make observable
        let known = if axis == 2 { 0.5 } else { 0.35 };
        assert!(
            (taken - error).abs() < known * prior[triad],
            "{axis}: {error:e} {taken:e}"
        );
    }
}

fn words_of(records: &[Record]) -> Vec<[i64; 6]> {
    let sensor = records
        .iter()
        .filter(|r| r.input == qemu::replay::Input::Sensor);
    sensor.filter_map(|r| values(&r.bytes)).collect()
}

fn words_sent(bytes: &[u8]) -> Vec<[i64; 6]> {
    let mut framer = firmware::wire::Framer::new(FORMAT);
    let mut samples = Vec::new();
    for piece in bytes.chunks(32) {
        framer.push(piece);
        while let Some(event) = framer.next_event() {
            samples.extend(values(event.bytes()));
        }
    }
    samples
}

fn values(frame: &[u8]) -> Option<[i64; 6]> {
    let mut frame = frame.to_vec();
    let frame = Checked::new(FORMAT, &mut frame).ok()?;
    let reading = frame.read().ok()?;
    let firmware::sample::RawSample::Counts { gyro, accel } = reading.sample else {
        return None;
    };
    let [a, b, c] = gyro.map(i64::from);
    let [d, e, f] = accel.map(i64::from);
    Some([a, b, c, d, e, f])
}

/// The application, bytes in, and the desktop's driver of the same learner: the same samples and
/// fixes teach the same weights, bit for bit.
#[test]
fn the_desktops_driver_learns_what_the_application_learns() {
    let format = ImuFormat::Novatel;
    let (_, records) = drive_from(format, 450, STANDSTILL_S).expect("a drive");
    let here = learning_on_desktop(format, &records);
    assert!(here.learnt.fixes > 300, "{:?}", here.learnt);
    let mut memory = Box::new(FixMemory::ZEROED);
    let first = nets(); // what the application begins with
    let mut device = Device::with_nets(&first, &mut memory, Settings::MEDIUM, compensator());
    for record in &records {
        match record.input {
            Input::Sensor => {
                let mut frame = record.bytes.clone();
                let frame = Checked::new(format, &mut frame).expect("a frame");
                device.sample(&frame.read().expect("a sample").sample);
            }
            _ => {
                let pvt = Pvt::parse(&record.bytes).expect("a message");
                device.fix(&pvt.to_fix(record.at_us.into()));
            }
        }
    }
    let learnt = device.learnt().expect("it navigates");
    let mut digest = Digest::new();
    for net in [&learnt.nets.gyro, &learnt.nets.accel] {
        digest.numbers(net.weights.to_array());
    }
    assert_eq!(digest.value(), here.learnt.weights);
    assert_eq!(learnt.running as u32, here.learnt.winner);
    assert_eq!(device.report().fixes, here.learnt.fixes);
}

/// The scale and timing that the application finds for an ISA-100C; blocks of a second.
fn compensator() -> Compensator {
    let kind = ImuType(26);
    let units = kind.units().expect("known");
    let rate = kind.rate().expect("known");
    let period = 1.0 / f64::from(rate);
    let of = |unit: Unit| unit.increment(period).expect("increments");
    let lsb = Lsb {
        rad: of(units.gyro),
        mps: of(units.accel),
    };
    let limit = Limit {
        gyro: 0.0,
        accel: 0.0,
    };
    let Nets { gyro, accel, .. } = Nets::NONE;
    Compensator::new(gyro, accel, lsb, period, rate, limit).expect("in range")
}

/// The device's alignment, sample by sample, compared with the desktop's over the stored samples of
/// the same standstill.
#[test]
fn the_alignment_is_the_desktops() {
    let (session, _) = drive();
    let samples = &session.counts[..120 * (1.0 / session.dt).round() as usize];
    let position = session.reference[0].position;
    let si: Vec<_> = samples
        .iter()
        .map(|c| host_core::inertial::session::to_si(c, &session.lsb))
        .collect();
    let want =
        host_core::inertial::align::inertial_frame(&si, session.dt, session.samples(), position)
            .expect("aligned");
    let sensors = Sensors {
        noise: [1.46e-6, 1.96e-4],
        bias: [1.63e-6, 4e-3],
        walk: 0.0,
    };
    let mut align = Align::new(sensors, session.lsb, session.dt);
    samples.iter().for_each(|sample| align.sample(sample));
    assert_eq!(
        align.gathered().round() as u32,
        120,
        "it has noticed the standstill by itself"
    );
    let got = align.finish(position.lat, position.h).expect("aligned");
    let [w, i, j, k] = got.q_bn;
    let got_q = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, i, j, k));
    let apart = got_q.angle_to(&want);
    println!("apart {apart:e} rad");
    assert!(apart < 1e-6, "{apart:e}");
    // Its distance from the truth agrees with its covariance.
    let truth = session.reference[120].q_bn;
    let off = (got_q * truth.inverse()).scaled_axis();
    let p = got.covariance(sensors.bias);
    for axis in 0..3 {
        let sigma = f64::from(p[axis][axis]).sqrt();
        assert!(
            off[axis].abs() < 4.0 * sigma,
            "{axis}: {:e}, sigma {sigma:e}",
            off[axis]
        );
    }
}
