//! Modes shadow and learn: samples pass through unchanged, the copy learns from references, and
//! only a command brings it into use.

use crate::device::{Device, nets};
use crate::frames::{Fields, Kind};
use crate::record::{HARDWARE, configure, configured, record};
use firmware::app::{Activation, Config, Phase};
use firmware::compensator::Limit;
use firmware::control::{Alignment, Mode, Reason, Window};
use firmware::learn::{BLOCKS, WindowLearner};
use firmware::model::{IMAGES_LEN, Nets};
use firmware::units::DEGREE;
use firmware::wire::command::{Estimate, MAX_CHUNK, Request, Response};
use lrnn_nostd::{Net, Normalisation, Weights};

const STIM: Kind = Kind::STIM;
/// Counts of a sample, at 1 kHz: 1e-3 rad/s and 0.01 m/s2.
const ERROR: [[i32; 3]; 2] = [[120, -60, 30], [42, 0, -21]];
const GRAVITY: i32 = 41_000;
const RAD: f64 = DEGREE / 2_097_152.0;
const MPS: f64 = 1.0 / 4_194_304.0;
/// Blocks of 10 samples, so windows of 100.
const SAMPLES: u32 = 10 * BLOCKS as u32;

/// Networks to begin with: slow units in the middle, and an output of zero.
fn start() -> Nets {
    let net = |input_offset: [f32; 3], input_scale: f32, output_scale: f32| -> Net {
        let mut weights = Weights::from_fn(|i| {
            if i < 21 {
                ((i * 37 + 11) % 65) as f32 / 64.0 - 0.5
            } else {
                0.0
            }
        });
        weights.layers[0].r = [[0.0; 3]; 3];
        for (i, blocks) in [30.0, 100.0, 300.0].into_iter().enumerate() {
            let leak: f32 = 1.0 / blocks;
            weights.layers[1].r[i][i] = 1.0 - leak;
            weights.layers[1].b[i] = 0.5 * leak * leak.sqrt();
        }
        Net::new(
            weights,
            Normalisation {
                input_offset,
                input_scale: [input_scale; 3],
                output_scale: [output_scale; 3],
            },
        )
    };
    Nets {
        gyro: net([0.0; 3], 5.0, 1e-3),
        accel: net([0.0, 0.0, 9.8], 0.5, 1e-2),
        ..Nets::NONE
    }
}

fn config() -> Config {
    Config {
        block: 0.01,
        limit: Limit {
            gyro: 1.0,
            accel: 1.0,
        },
        nets: start(),
        ..STIM.config()
    }
}

/// Frames `from..to` at rest with the sensor's error, and a noise of one count whose mean over two
/// frames is zero.
fn frames(from: u32, to: u32) -> Vec<Vec<u8>> {
    let [gyro, [x, y, z]] = ERROR;
    let accel = [x, y, z + GRAVITY];
    let rest = 0;
    let frame = |n: u32| {
        let [x, y, z] = gyro;
        let fields = Fields {
            gyro: [x + 1 - 2 * (n % 2) as i32, y, z],
            accel,
            rest,
            ..Fields::default()
        };
        STIM.frame(n, fields)
    };
    (from..to).map(frame).collect()
}

fn estimate(device: &mut Device) -> Estimate {
    device.ask(&Request::GetEstimate, |answer| match answer {
        Response::Estimate(estimate) => estimate,
        other => panic!("{other:?}"),
    })
}

/// The truth over a window.
fn reference((first, last): (u32, u32)) -> Window {
    let count = f64::from(last - first + 1);
    Window {
        first,
        last,
        angle: [0.0; 3],
        velocity: [0.0, 0.0, f64::from(GRAVITY) * MPS * count],
        angle_sigma: 1e-6,
        velocity_sigma: 1e-5,
    }
}

fn refused(device: &mut Device, request: &Request, reason: Reason) {
    device.ask(request, |answer| {
        assert_eq!(answer, Response::Refused(reason))
    });
}

fn learnt(device: &mut Device) -> Vec<u8> {
    let mut all = Vec::new();
    while all.len() < IMAGES_LEN {
        let request = Request::ReadLearnt {
            offset: all.len() as u32,
            length: MAX_CHUNK as u16,
        };
        device.ask(&request, |answer| match answer {
            Response::Image { bytes, .. } => all.extend_from_slice(bytes),
            other => panic!("{other:?}"),
        });
    }
    all
}

/// Sends windows and their references, each `late` samples into the next window.
fn teach(device: &mut Device, windows: std::ops::Range<u32>, late: u32) {
    for window in windows {
        let end = (window + 1) * SAMPLES;
        device.feed(&frames(window * SAMPLES + if window > 0 { late } else { 0 }, end).concat());
        let report = estimate(device);
        assert_eq!(
            (report.sample, report.counter),
            (end - 1, Some(((end - 1) * 2 % 256) as u16))
        );
        let ends = report.window.expect("a window is over");
        assert_eq!(ends, (window * SAMPLES, end - 1));
        device.feed(&frames(end, end + late).concat());
        device.order(&Request::Reference(reference(ends)));
    }
}

/// Distance of an estimate from the sensor's error, as a share of that error.
fn off(estimate: [[f32; 3]; 2]) -> f64 {
    let mut worst: f64 = 0.0;
    for (side, count) in [RAD, MPS].into_iter().enumerate() {
        for axis in 0..3 {
            let error = f64::from(ERROR[side][axis]) * count * 1e3;
            let largest = f64::from(ERROR[side][0]) * count * 1e3;
            worst = worst.max((f64::from(estimate[side][axis]) - error).abs() / largest);
        }
    }
    worst
}

#[test]
fn learns_from_references_and_is_used_by_command_only() {
    let mut device = Device::learning(config());
    device.order(&Request::SetMode(Mode::Learn));
    teach(&mut device, 0..30, 0);
    let report = estimate(&mut device);
    assert!(
        off(report.learnt) < 0.01,
        "{} {:?}",
        off(report.learnt),
        report.learnt
    );
    assert_eq!((report.used, report.doubted), (30, 0));
    assert_eq!(
        (report.network_output, report.in_force),
        ([[0.0; 3]; 2], [[0.0; 3]; 2])
    );
    assert_eq!(*device.app.nets(), start());
    assert_eq!(device.lines.navigation.sent, frames(0, 30 * SAMPLES));

    let weights = learnt(&mut device);
    device.order(&Request::SetMode(Mode::Bypass)); // from mode learn on it would fade in
    device.order(&Request::CommitLearnt);
    device.order(&Request::SetMode(Mode::Frozen));
    assert_eq!(
        weights[..304],
        lrnn_nostd::image::encode(&device.app.nets().gyro)
    );
    device.lines.navigation.sent.clear();
    device.feed(&frames(30 * SAMPLES, 32 * SAMPLES).concat());
    let report = estimate(&mut device);
    assert!(
        report.in_force == report.network_output && off(report.in_force) < 0.2,
        "{report:?}"
    );
    assert_ne!(
        device.lines.navigation.sent,
        frames(30 * SAMPLES, 32 * SAMPLES)
    );
}

/// A reference that comes at once and one that comes at the end of the next window give the same
/// bits.
#[test]
fn when_a_reference_comes_does_not_matter() {
    let weights = [0, 37, SAMPLES - 1].map(|late| {
        let mut device = Device::learning(config());
        device.order(&Request::SetMode(Mode::Learn));
        teach(&mut device, 0..5, late);
        device.feed(&frames(5 * SAMPLES + late, 6 * SAMPLES + 20).concat());
        learnt(&mut device)
    });
    assert_eq!(weights[0], weights[1]);
    assert_eq!(weights[0], weights[2]);
    let untaught = {
        let mut device = Device::learning(config());
        device.order(&Request::SetMode(Mode::Learn));
        device.feed(&frames(0, SAMPLES).concat());
        learnt(&mut device)
    };
    assert_ne!(weights[0], untaught);
}

#[test]
fn references_that_cannot_be_used() {
    let mut device = Device::learning(config());
    let good = reference((0, SAMPLES - 1));
    refused(&mut device, &Request::Reference(good), Reason::Mode);
    refused(&mut device, &Request::CommitLearnt, Reason::NotAvailable);
    device.order(&Request::SetMode(Mode::Learn));
    device.feed(&frames(0, SAMPLES - 1).concat());
    refused(&mut device, &Request::Reference(good), Reason::Window); // not over yet
    device.feed(&frames(SAMPLES - 1, SAMPLES).concat());
    for wrong in [
        Window { first: 1, ..good },
        Window {
            last: SAMPLES,
            ..good
        },
    ] {
        refused(&mut device, &Request::Reference(wrong), Reason::Window);
    }
    let [nan, inf] = [f64::NAN, f64::INFINITY];
    for wrong in [
        Window {
            angle: [0.0, nan, 0.0],
            ..good
        },
        Window {
            velocity: [inf, 0.0, 0.0],
            ..good
        },
        Window {
            angle_sigma: 0.0,
            ..good
        },
        Window {
            velocity_sigma: -1.0,
            ..good
        },
        Window {
            velocity_sigma: f32::NAN,
            ..good
        },
    ] {
        refused(&mut device, &Request::Reference(wrong), Reason::Range);
    }
    device.order(&Request::Reference(good));
    // the weights learnt are those before the last block
    device.feed(&frames(SAMPLES, SAMPLES + 20).concat());
    let once = learnt(&mut device);
    device.order(&Request::Reference(good)); // its answer was lost
    assert_eq!(estimate(&mut device).used, 1);
    device.feed(&frames(SAMPLES + 20, SAMPLES + 40).concat());
    assert_eq!(learnt(&mut device), once);
    // an outlier is counted and refused
    device.feed(&frames(SAMPLES + 40, 2 * SAMPLES).concat());
    let far = Window {
        angle: [1.0; 3],
        velocity: [9.0; 3],
        ..reference((SAMPLES, 2 * SAMPLES - 1))
    };
    device.order(&Request::Reference(far));
    let report = estimate(&mut device);
    assert_eq!((report.used, report.doubted), (2, 1));
    device.feed(&frames(2 * SAMPLES, 2 * SAMPLES + 20).concat());
    assert_eq!(learnt(&mut device), once);
    // too late
    device.feed(&frames(2 * SAMPLES + 20, 4 * SAMPLES).concat());
    let late = reference((2 * SAMPLES, 3 * SAMPLES - 1));
    refused(&mut device, &Request::Reference(late), Reason::Window);
}

#[test]
fn a_window_has_no_hole() {
    let mut device = Device::learning(config());
    device.order(&Request::SetMode(Mode::Learn));
    device.feed(&frames(0, 55).concat());
    device.feed(&frames(58, 158).concat()); // three frames are missing
    let report = estimate(&mut device);
    assert_eq!((report.sample, report.window), (157, Some((58, 157))));
    // a damaged frame is missing too
    let mut bad = frames(158, 170);
    bad[5][10] ^= 1;
    device.feed(&bad.concat());
    device.feed(&frames(170, 264).concat());
    assert_eq!(estimate(&mut device).window, Some((164, 263)));
    // silence ends a window, and so does a sample that the sensor marks invalid
    device.wait_ms(200);
    device.feed(&frames(264, 300).concat());
    let mut invalid = frames(300, 301).remove(0);
    invalid[10] = 0x11; // overload of x
    let crc = firmware::wire::checksum::crc32_mpeg2_padded(&invalid[..24]);
    invalid[24..].copy_from_slice(&crc.to_be_bytes());
    device.feed(&invalid);
    device.feed(&frames(301, 401).concat());
    assert_eq!(estimate(&mut device).window, Some((301, 400)));
}

#[test]
fn shadow_tells_and_does_not_touch() {
    let error = [1e-5, 0.0, 0.0];
    let mut device = Device::new(Config {
        nets: nets(error, [0.0; 3]),
        ..config()
    });
    refused(
        &mut device,
        &Request::SetMode(Mode::Learn),
        Reason::NotAvailable,
    );
    device.order(&Request::SetMode(Mode::Shadow));
    let sent = STIM.stream(0, 200);
    device.feed(&sent.concat());
    assert_eq!(device.app.phase(), Phase::Run(Mode::Shadow));
    assert_eq!(device.lines.navigation.sent, sent);
    let report = estimate(&mut device);
    assert_eq!(
        (report.network_output[0], report.in_force),
        (error, [[0.0; 3]; 2])
    );
    refused(
        &mut device,
        &Request::ReadLearnt {
            offset: 0,
            length: 1,
        },
        Reason::NotAvailable,
    );
    device.order(&Request::SetMode(Mode::Frozen));
    device.feed(&STIM.stream(200, 230).concat());
    assert_eq!(estimate(&mut device).in_force[0], error);
}

/// After the alignment the correction fades out for learning and in again with the weights learnt;
/// learning continues meanwhile.
#[test]
fn modes_and_alignment() {
    let limit = Limit {
        gyro: 1e-2,
        accel: 1e-1,
    };
    let mut device = Device::learning(Config {
        slew: limit,
        activation: Activation::Commanded,
        ..config()
    });
    device.order(&Request::Alignment(Alignment::Finished));
    device.order(&Request::SetMode(Mode::Learn));
    teach(&mut device, 0..6, 0);
    assert_eq!(device.lines.navigation.sent, frames(0, 6 * SAMPLES));
    device.order(&Request::SetMode(Mode::Frozen));
    refused(&mut device, &Request::CommitLearnt, Reason::Alignment);
    device.order(&Request::SetMode(Mode::Shadow));
    device.order(&Request::CommitLearnt);
    device.order(&Request::SetMode(Mode::Frozen));
    device.feed(&frames(6 * SAMPLES, 6 * SAMPLES + 10).concat());
    // 1e-2 rad/s per s over a block of 10 ms, in force from the next sample on
    let report = estimate(&mut device);
    assert!((report.in_force[0][0] - 1e-4).abs() < 1e-8, "{report:?}");
    device.feed(&frames(6 * SAMPLES + 10, 9 * SAMPLES).concat());
    let full = estimate(&mut device);
    assert!(off(full.in_force) < 0.2, "{full:?}");
    // back to learning: the correction fades; the weights learnt stay and learning continues
    device.order(&Request::SetMode(Mode::Learn));
    device.feed(&frames(9 * SAMPLES, 9 * SAMPLES + 10).concat());
    let fading = estimate(&mut device);
    assert!(
        (full.in_force[0][0] - fading.in_force[0][0] - 1e-4).abs() < 1e-5,
        "{fading:?}"
    );
    device.feed(&frames(9 * SAMPLES + 10, 11 * SAMPLES).concat());
    assert_eq!(estimate(&mut device).in_force, [[0.0; 3]; 2]);
    let ends = estimate(&mut device).window.expect("a window");
    device.order(&Request::Reference(reference(ends)));
    assert_eq!(estimate(&mut device).doubted, 0);
}

/// Twice the memory of `lrnn-nostd` for 45 weights, and the sums.
#[test]
fn memory() {
    let size = size_of::<WindowLearner>();
    assert!(size <= 16_128, "{size} bytes");
}

/// A new configuration restarts the numbers of the samples, so a window may have the numbers of one
/// whose reference was taken before. Its reference is used all the same.
#[test]
fn a_window_of_a_new_configuration_is_a_new_one() {
    let mut device = Device::learning(Config::unconfigured(HARDWARE));
    let mut ends = Vec::new();
    for (used, name) in (1..).zip(["one", "two"]) {
        let mut unit = configured(STIM);
        unit.correction.mode = Mode::Bypass;
        unit.identity.name = name.try_into().expect("short");
        assert_eq!(configure(&mut device, &record(&unit)), Ok(()));
        device.feed(&frames(0, 10).concat());
        device.order(&Request::SetMode(Mode::Learn));
        device.feed(&frames(10, 12 * SAMPLES * 10).concat());
        let window = estimate(&mut device).window.expect("a window is over");
        device.order(&Request::Reference(reference(window)));
        assert_eq!(estimate(&mut device).used, used, "{name}");
        // once: it may come again
        device.order(&Request::Reference(reference(window)));
        assert_eq!(estimate(&mut device).used, used, "{name}");
        ends.push(window);
        device.order(&Request::SetMode(Mode::Bypass));
    }
    assert_eq!(ends[0], ends[1], "the case is none");
}
