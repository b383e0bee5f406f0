//! The command link and the receiver.

use crate::device::{Device, constant, nets};
use crate::frames::{Fields, Kind, values};
use crate::record::read_all;
use firmware::app::{Config, Phase};
use firmware::compensator::Limit;
use firmware::control::{Alignment, Mode, Reason, Window};
use firmware::model::{IMAGES_LEN, Nets};
use firmware::store::Step;
use firmware::wire::ImuFormat;
use firmware::wire::checksum::crc32_zlib;
use firmware::wire::command::{MAX_CHUNK, Request, Response, WIRE_VERSION};
use firmware::wire::ubx::Pvt;
use lrnn_nostd::image;

const STIM: Kind = Kind::STIM;

fn refused(device: &mut Device, request: &Request, reason: Reason) {
    device.ask(request, |answer| {
        assert_eq!(answer, Response::Refused(reason))
    });
}

fn images(nets: &Nets) -> Vec<u8> {
    let maps = [0; 72];
    let sum = crc32_zlib(&maps).to_le_bytes();
    let nets = [image::encode(&nets.gyro), image::encode(&nets.accel)].concat();
    [nets.as_slice(), &maps, &sum].concat()
}

fn upload(device: &mut Device, bytes: &[u8]) {
    for (n, piece) in bytes.chunks(MAX_CHUNK).enumerate() {
        let offset = (n * MAX_CHUNK) as u32;
        device.order(&Request::WriteImage {
            offset,
            bytes: piece,
        });
    }
}

fn download(device: &mut Device) -> Vec<u8> {
    read_all(device, |offset, length| Request::ReadImage {
        offset,
        length,
    })
}

const COMMIT: Request = Request::CommitImage {
    length: IMAGES_LEN as u32,
};

#[test]
fn version_health_counters() {
    let mut device = Device::new(STIM.config());
    let mut frames = STIM.stream(0, 10);
    frames[4][7] ^= 1;
    device.feed(&frames.concat());
    device.ask(&Request::GetVersion, |answer| match answer {
        Response::Version(version) => {
            assert_eq!((version.wire, version.image), (WIRE_VERSION, 1));
            assert_eq!(
                version.firmware.map(|n| n.to_string()).join("."),
                env!("CARGO_PKG_VERSION")
            );
        }
        other => panic!("{other:?}"),
    });
    let counters = device.counters();
    assert_eq!(
        (counters.frames, counters.missed, counters.bad_checksums),
        (9, 1, 1)
    );
    device.ask(&Request::GetCounters, |answer| {
        assert_eq!(answer, Response::Counters(counters))
    });
    device.ask(&Request::GetHealth, |answer| match answer {
        Response::Health(health) => {
            assert_eq!((health.mode, health.faults), (Mode::Bypass, 0));
            assert_eq!((health.frames, health.missed, health.garbage), (9, 1, 27));
        }
        other => panic!("{other:?}"),
    });
}

#[test]
fn weights_go_up_and_down_and_take_effect_whole() {
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        block: 0.01,
        limit: Limit {
            gyro: 1.0,
            accel: 1.0,
        },
        ..STIM.config()
    });
    assert_eq!(download(&mut device), images(&Nets::NONE));
    let new = nets([1e-3, 0.0, 0.0], [0.0; 3]);
    let good = images(&new);
    let frame = |n| STIM.frame(n, Fields::default());
    let first = |device: &Device| {
        values(
            ImuFormat::Stim300,
            device.lines.navigation.sent.last().expect("one"),
        )[0]
    };
    (0..25).for_each(|n| device.feed(&frame(n)));

    // damaged: refused, the networks stay
    let mut damaged = good.clone();
    damaged[400] ^= 1;
    upload(&mut device, &damaged);
    refused(&mut device, &COMMIT, Reason::Image);
    // too short, with a gap, too long
    upload(&mut device, &good[..600]);
    refused(&mut device, &COMMIT, Reason::Range);
    refused(
        &mut device,
        &Request::CommitImage { length: 600 },
        Reason::Range,
    );
    refused(
        &mut device,
        &Request::WriteImage {
            offset: 601,
            bytes: &[0],
        },
        Reason::Range,
    );
    refused(
        &mut device,
        &Request::WriteImage {
            offset: 600,
            bytes: &[0; 85],
        },
        Reason::Range,
    );
    refused(
        &mut device,
        &Request::ReadImage {
            offset: 685,
            length: 1,
        },
        Reason::Range,
    );
    refused(
        &mut device,
        &Request::ReadImage {
            offset: 0,
            length: 129,
        },
        Reason::Range,
    );
    assert_eq!(*device.app.nets(), Nets::NONE);

    upload(&mut device, &good);
    // a piece whose answer was lost is sent again, and so are those after it
    device.order(&Request::WriteImage {
        offset: 512,
        bytes: &good[512..],
    });
    device.order(&COMMIT);
    device.order(&COMMIT);
    assert_eq!(download(&mut device), good);
    // the block restarts with the new networks; the estimate changes at its end
    (25..35).for_each(|n| device.feed(&frame(n)));
    assert!(first(&device) == 0.0);
    device.feed(&frame(35));
    assert!(first(&device) < -100.0);
    assert_eq!(device.counters().given_up, 1);
}

#[test]
fn modes() {
    let mut device = Device::new(Config {
        nets: nets([1e-5, 0.0, 0.0], [0.0; 3]),
        block: 0.01,
        ..STIM.config()
    });
    device.feed(&STIM.stream(0, 30).concat());
    assert_eq!(device.counters().blocks, 0);
    refused(
        &mut device,
        &Request::SetMode(Mode::Learn),
        Reason::NotAvailable,
    );
    let reference = Window {
        first: 0,
        last: 1,
        angle: [0.0; 3],
        velocity: [0.0; 3],
        angle_sigma: 1.0,
        velocity_sigma: 1.0,
    };
    refused(
        &mut device,
        &Request::Reference(reference),
        Reason::NotAvailable,
    );
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    device.order(&Request::SetMode(Mode::Frozen));
    assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
    device.feed(&STIM.stream(30, 60).concat());
    assert_ne!(device.lines.navigation.sent[59], STIM.stream(59, 60)[0]);
    assert!(
        device
            .app
            .block()
            .is_some_and(|block| block.rate_error == [1e-5, 0.0, 0.0])
    );
    device.order(&Request::SetMode(Mode::Bypass));
    device.feed(&STIM.stream(60, 90).concat());
    assert_eq!(device.lines.navigation.sent[60..], STIM.stream(60, 90));
}

/// Before the alignment a correction may jump, during it it must not change, after it it changes no
/// faster than the slew limit.
#[test]
fn alignment_ends_jumps() {
    let kind = Kind::KVH;
    let error = 4e-5f32;
    let config = Config {
        nets: nets([error, 0.0, 0.0], [0.0; 3]),
        block: 0.01,
        // 4e-5 rad/s takes 40 blocks
        slew: Limit {
            gyro: 1e-4,
            accel: 1e-4,
        },
        ..kind.config()
    };
    let mut device = Device::new(config);
    let mut n = 0;
    let mut run = |device: &mut Device, blocks: u32| {
        for _ in 0..10 * blocks {
            let fields = Fields {
                accel: [0, 0, n as i32 % 3], // no sensor's values are constant
                ..Fields::default()
            };
            device.feed(&kind.frame(n, fields));
            n += 1;
        }
        let sent = device.lines.navigation.sent.last().expect("a frame");
        -values(ImuFormat::Kvh, sent)[0] / 1e-3 // rad/s
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-7;
    assert!(run(&mut device, 3) == 0.0);
    device.order(&Request::SetMode(Mode::Frozen));
    assert!(near(run(&mut device, 3), 4e-5)); // at once
    device.order(&Request::Alignment(Alignment::Started));
    refused(
        &mut device,
        &Request::SetMode(Mode::Bypass),
        Reason::Alignment,
    );
    upload(&mut device, &images(&Nets::NONE));
    refused(&mut device, &COMMIT, Reason::Alignment);
    device.order(&Request::Alignment(Alignment::Finished));
    refused(&mut device, &COMMIT, Reason::Alignment);
    device.order(&Request::SetMode(Mode::Bypass));
    assert!(near(run(&mut device, 21), 2e-5)); // half way after 20 blocks
    assert!(run(&mut device, 30) == 0.0);
    let blocks = device.counters().blocks;
    run(&mut device, 10);
    assert_eq!(device.counters().blocks, blocks); // faded out, the networks rest
    device.order(&Request::SetMode(Mode::Frozen));
    assert!(near(run(&mut device, 11), 1e-5));
    assert!(near(run(&mut device, 40), 4e-5));
    device.order(&Request::SetMode(Mode::Bypass));
    assert!(near(run(&mut device, 6), 3.5e-5));
    device.order(&COMMIT); // in bypass other networks may come, while the old estimate fades
    assert_eq!(device.app.nets().gyro, constant([0.0; 3]));
    assert!(near(run(&mut device, 15), 2e-5));
    // an alignment that begins meanwhile must not see the fade: what is left goes at once
    device.order(&Request::Alignment(Alignment::Started));
    assert!(run(&mut device, 1) == 0.0);
}

/// Bytes that are no packet are not answered; noise in front of a packet does no damage.
#[test]
fn damaged_packets_are_not_answered() {
    use firmware::wire::command::{MAX_PACKET, encode};
    let mut device = Device::new(STIM.config());
    let mut buffer = [0; MAX_PACKET];
    let packet = encode(1, &Request::SetMode(Mode::Frozen), &mut buffer)
        .expect("a packet")
        .to_vec();
    for bit in 0..8 * (packet.len() - 1) {
        let mut damaged = packet.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        device.lines.command.input.extend(&damaged);
        device.wait_ms(1);
    }
    device.lines.command.input.extend([0x55; 700]);
    device.lines.command.input.push_back(0);
    device.wait_ms(1);
    assert!(device.lines.command.sent.is_empty());
    device.ask(&Request::GetHealth, |answer| {
        assert!(matches!(answer, Response::Health(health) if health.mode == Mode::Bypass));
    });
}

/// A packet that asks for the version.
fn version_packet() -> Vec<u8> {
    use firmware::wire::command::{MAX_PACKET, encode};
    let mut buffer = [0; MAX_PACKET];
    let packet = encode(9, &Request::GetVersion, &mut buffer);
    packet.expect("a packet").to_vec()
}

/// The command link is served even when the sensor's line never pauses, and no frame is lost by it.
#[test]
fn a_busy_line_starves_nobody() {
    let mut device = Device::new(STIM.config());
    let stream = STIM.stream(0, 3000).concat();
    device.feed(&stream[..5]);
    device.lines.command.input.extend(version_packet());
    device.lines.sensor.piece = 28; // every pass ends within a frame
    device.feed(&stream[5..stream.len() - 23]);
    assert_eq!(device.lines.command.sent.len(), 1);
    assert_eq!(device.lines.navigation.sent.len(), 2999);
}

/// While a frame arrives the command link waits: an answer must not delay it.
#[test]
fn frames_come_first() {
    let mut device = Device::new(STIM.config());
    let frame = &STIM.stream(0, 1)[0];
    device.wait_ms(5);
    device.feed(&frame[..20]);
    device.lines.command.input.extend(version_packet());
    device.wait_ms(10);
    assert!(device.lines.command.sent.is_empty());
    device.feed(&frame[20..]);
    assert_eq!(device.lines.command.sent.len(), 1);
}

#[test]
fn the_latest_good_fix_is_kept() {
    let mut device = Device::new(STIM.config());
    let fix = |time_of_week, flags| Pvt {
        time_of_week,
        flags,
        fix: 3,
        latitude: 527_654_321,
        velocity: [-1234, 5678, -91],
        speed_accuracy: 60,
        ..Pvt::default()
    };
    let good = fix(1000, 1);
    let mut damaged = fix(1500, 1).emit();
    damaged[50] ^= 4;
    for message in [&good.emit()[..], &damaged, b"noise", &fix(2000, 0).emit()] {
        device.lines.gnss.input.extend(message);
        device.wait_ms(100);
    }
    assert_eq!(
        (device.counters().fixes, device.counters().good_fixes),
        (2, 1)
    );
    let kept = device.app.fix().expect("a fix");
    assert_eq!(*kept, good.to_fix(kept.arrived_us));
    assert!((1000..2000).contains(&kept.arrived_us));
}

/// Storing halts the processor: on command, in bypass, not during the alignment, and only where
/// there is a store.
#[test]
fn storing_is_asked_of_the_board_once() {
    use firmware::wire::command::fault;
    let mut device = Device::new(STIM.config());
    refused(&mut device, &Request::StoreImage, Reason::Unsupported);
    let new = nets([1e-3, 0.0, 0.0], [0.0; 3]);
    let mut device = Device::new(Config {
        store: true,
        nets: new,
        mode: Mode::Frozen,
        ..STIM.config()
    });
    refused(&mut device, &Request::StoreImage, Reason::Mode);
    device.order(&Request::SetMode(Mode::Bypass));
    device.order(&Request::Alignment(Alignment::Started));
    refused(&mut device, &Request::StoreImage, Reason::Mode);
    device.app.store::<bool>(|_, _| panic!("not asked for"));
    device.order(&Request::Alignment(Alignment::Finished));
    device.order(&Request::StoreImage);
    for done in [false, true] {
        assert!(device.app.wants_to_store());
        device.app.store(|step, content| {
            assert!(*content.nets == new && content.record.is_empty());
            assert_eq!(step, Step::Save);
            done
        });
        assert_eq!(device.app.faults() & fault::STORE == 0, done);
        device.app.store::<bool>(|_, _| panic!("once"));
        device.order(&Request::StoreImage);
    }
}
