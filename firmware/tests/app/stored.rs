//! The content of the store comes back at power-on, weights and configuration together.

use crate::device::{Device, constant, nets};
use crate::frames::Kind;
use crate::record::{HARDWARE, board, configure, configured, read, record, sealed, unconfigured};
use firmware::app::{App, Config, Phase};
use firmware::configuration::SCHEMA;
use firmware::configuration::record::encode;
use firmware::control::{Field, Mode, Reason};
use firmware::model::Nets;
use firmware::store::{self, Content, Store};
use firmware::wire::checksum::crc32_zlib;
use firmware::wire::command::{Provision, Request, Response, StoreReport, fault};
use lrnn_nostd::image;

const STIM: Kind = Kind::STIM;

/// Bytes of a slot: room for some fifteen records.
const SLOT: usize = 8 * 8192;

/// Flash of two slots in memory.
pub type Flash = test_bench::flash::Flash<SLOT>;

/// Empty flash.
pub fn blank() -> Flash {
    Flash::blank(2 * SLOT)
}

/// A device after power-on with this flash.
fn powered(flash: &Flash) -> Device {
    let mut store = Store::new(flash.clone()).expect("room");
    let mut device = unconfigured();
    device.app = App::power_on(HARDWARE, Some(store.load()), None);
    device
}

/// Stores what is in use, as a board does.
fn stores(device: &mut Device, flash: &mut Flash) -> Response<'static> {
    let response = device.ask(&Request::StoreImage, |answer| match answer {
        Response::Done => Response::Done,
        Response::Refused(reason) => Response::Refused(reason),
        other => panic!("{other:?}"),
    });
    let mut store = Store::new(flash.clone()).expect("room");
    device
        .app
        .store(|step, content| store.carry_out(step, content));
    *flash = store.into_inner();
    response
}

/// While a record is being stored by command, what it holds stays in use, so that what is called
/// stored is there after a power cycle. Nor may the device restart: the record would be lost.
#[test]
fn nothing_changes_while_a_record_is_stored() {
    let mut device = powered(&blank());
    let mut first = configured(STIM);
    first.correction.mode = Mode::Bypass;
    assert_eq!(configure(&mut device, &record(&first)), Ok(()));
    device.order(&Request::StoreImage);
    let job = device.app.job().expect("a record");
    let mut other = first.clone();
    other.identity.serial = "N2".try_into().expect("short");
    assert_eq!(configure(&mut device, &encode(&other)), Err(Reason::Busy));
    for request in [
        Request::CommitImage { length: 0 },
        Request::CommitLearnt,
        Request::StoreImage,
        Request::Provision(Provision::OpenByChoice),
        Request::SetMode(Mode::Frozen),
        Request::Restart,
    ] {
        let busy = Response::Refused(Reason::Busy);
        device.ask(&request, |answer| assert_eq!(answer, busy, "{request:?}"));
    }
    device.order(&Request::SetMode(Mode::Bypass));
    assert!(board(&mut device, |board| !board.stored));
    device.app.stored(&job.done(store::Progress::Done));
    assert!(board(&mut device, |board| board.stored));
    assert_eq!(read(&mut device), record(&first));
    // what was refused is possible again; the same is not stored a second time
    device.order(&Request::StoreImage);
    assert!(device.app.job().is_none());
    assert_eq!(configure(&mut device, &encode(&other)), Ok(()));
    assert!(board(&mut device, |board| !board.stored));
    device.order(&Request::StoreImage);
    assert!(device.app.job().is_some());
}

/// Weights, configuration and line settings that were stored are in use after a power cycle. What
/// was only committed is gone.
#[test]
fn a_power_cycle_brings_back_what_was_stored() {
    let mut flash = blank();
    let mut device = powered(&flash);
    assert!(board(&mut device, |board| board.stores && !board.configured));
    let mut first = configured(STIM);
    first.identity.serial = "N1".try_into().expect("short");
    first.lines.sensor_baud = 460_800;
    first.correction.mode = Mode::Shadow;
    let record = record(&first);
    assert_eq!(configure(&mut device, &record), Ok(()));
    assert_eq!(device.app.to_open(), Some(first.lines));
    assert!(board(&mut device, |board| board.configured && !board.stored));
    let refused = Response::Refused(Reason::Mode);
    assert_eq!(stores(&mut device, &mut flash), refused);
    device.order(&Request::SetMode(Mode::Bypass));
    assert_eq!(stores(&mut device, &mut flash), Response::Done);
    assert!(board(&mut device, |board| board.stored));
    let mut other = first.clone();
    other.identity.serial = "N2".try_into().expect("short");
    assert_eq!(configure(&mut device, &encode(&other)), Ok(()));
    assert!(board(&mut device, |board| board.configured && !board.stored));

    let mut device = powered(&flash);
    assert_eq!(read(&mut device), record);
    assert!(board(&mut device, |board| board.configured && board.stored));
    assert_eq!(device.app.to_open(), Some(first.lines));
    assert_eq!(device.app.faults() & !fault::SILENT, 0);
    device.feed(&STIM.stream(0, 10).concat());
    assert_eq!(device.app.phase(), Phase::Run(Mode::Shadow));
    assert_eq!(device.lines.navigation.sent, STIM.stream(0, 10));
}

/// What the store reports: its state, and that a newer record is damaged, until something is stored
/// again. Weights of another unit than the configuration's are not used.
#[test]
fn the_store_reports_what_it_found() {
    let store_report = |device: &mut Device| {
        device.ask(&Request::GetStore, |answer| match answer {
            Response::Kept(store_report) => store_report,
            other => panic!("{other:?}"),
        })
    };
    let mut flash = blank();
    let mut device = powered(&flash);
    assert_eq!(store_report(&mut device), StoreReport::default());
    let record = record(&configured(STIM));
    assert_eq!(configure(&mut device, &record), Ok(()));
    device.order(&Request::SetMode(Mode::Bypass));
    assert_eq!(stores(&mut device, &mut flash), Response::Done);
    // the same is not stored again, something else behind it
    assert_eq!(stores(&mut device, &mut flash), Response::Done);
    assert_eq!(store_report(&mut powered(&flash)).generation, Some(1));
    let mut other = configured(STIM);
    other.identity.name = "other".try_into().expect("short");
    assert_eq!(configure(&mut device, &encode(&other)), Ok(()));
    device.order(&Request::SetMode(Mode::Bypass));
    assert_eq!(stores(&mut device, &mut flash), Response::Done);
    let mut device = powered(&flash);
    let found = store_report(&mut device);
    assert_eq!(
        (found.generation, found.damaged, found.passed),
        (Some(2), false, 0)
    );
    assert_eq!(found.erased, [1, 0]);
    let starts = |flash: &Flash| -> Vec<usize> {
        let places = (0..flash.bytes.len()).step_by(64);
        places
            .filter(|at| flash.bytes[*at..].starts_with(b"LRNS"))
            .collect()
    };
    let [_, newest] = starts(&flash)[..] else {
        panic!("two records");
    };
    let mut rotten = flash.clone();
    rotten.bytes[newest + 700] ^= 1;
    let mut device = powered(&rotten);
    let found = store_report(&mut device);
    assert_eq!((found.generation, found.damaged), (Some(1), true));
    assert_eq!(read(&mut device), record);
    assert_ne!(device.app.faults() & fault::STORE, 0);
    device.order(&Request::SetMode(Mode::Bypass));
    assert_eq!(stores(&mut device, &mut rotten), Response::Done);
    assert_eq!(device.app.faults() & fault::STORE, 0);
    assert!(!store_report(&mut powered(&rotten)).damaged);
    // all words are rotten: like a new device
    for start in starts(&rotten) {
        if start != newest {
            rotten.bytes[start + 700] ^= 1;
        }
    }
    assert_eq!(store_report(&mut powered(&rotten)), StoreReport::default());
}

/// A record whose weights are of another unit than its configuration, with a right checksum.
#[test]
fn weights_of_another_unit_are_not_used() {
    let record = encode(&configured(STIM));
    let nets = Nets {
        gyro: constant([1e-4; 3]),
        ..Nets::NONE
    };
    for (unit, used) in [
        (0, true),
        (store::unit(&configured(STIM)), true),
        (17, false),
    ] {
        let mut store = Store::new(blank()).expect("room");
        let content = Content::new(&nets, &record);
        store.save(&Content { unit, ..content }).expect("room");
        let device = powered(&store.into_inner());
        assert_eq!(*device.app.nets() == nets, used, "{unit}");
        assert_eq!(device.app.faults() & fault::WEIGHTS == 0, used);
    }
}

/// A record of a newer firmware is reported and retained, and so is a configuration that cannot be
/// read.
#[test]
fn what_cannot_be_read_is_reported_and_not_used() {
    let sealed_store = |version: u32, record: &[u8]| {
        let images = [image::encode(&constant([1e-4; 3])); 2].concat();
        let mut bytes = b"LRNS".to_vec();
        bytes.extend(version.to_le_bytes());
        bytes.extend(1u32.to_le_bytes());
        bytes.extend((images.len() as u16).to_le_bytes());
        bytes.extend((record.len() as u16).to_le_bytes());
        bytes.extend(images);
        bytes.extend(record);
        let sum = crc32_zlib(&bytes);
        bytes.extend(sum.to_le_bytes());
        let mut flash = blank();
        flash.bytes[..bytes.len()].copy_from_slice(&bytes);
        flash.written[..bytes.len()].fill(true);
        flash
    };
    let good = record(&configured(STIM));
    let mut newer = good.clone();
    newer[4] += 1;
    let mut bad = configured(STIM);
    bad.rate = -1.0;
    let cases = [
        (6, good.clone(), Some(6)),
        (2, sealed(newer), Some(SCHEMA + 1)),
        (2, record(&bad), None),
        (2, vec![1; 30], None),
    ];
    for (version, bytes, store_report) in cases {
        let mut flash = sealed_store(version, &bytes);
        let before = flash.bytes.clone();
        let mut device = powered(&flash);
        let faults = device.app.faults();
        assert_eq!(faults & fault::STORE, fault::STORE, "{version}");
        assert_eq!(faults & fault::NOT_CONFIGURED, fault::NOT_CONFIGURED);
        assert_eq!(*device.app.nets(), Nets::NONE);
        assert_eq!(configure(&mut device, &good), Ok(()));
        let answer = stores(&mut device, &mut flash);
        if let Some(version) = store_report {
            assert_eq!(answer, Response::Refused(Reason::Newer(version)));
            assert!(flash.bytes == before);
        } else {
            assert_eq!(answer, Response::Done);
            assert_eq!(read(&mut powered(&flash)), good);
        }
    }
    // a configuration of schema 1, with its weights
    let old = include_bytes!("../../src/configuration/schema_1.bin");
    let mut device = powered(&sealed_store(2, old));
    let bad = fault::STORE | fault::NOT_CONFIGURED;
    assert_eq!(device.app.faults() & bad, 0);
    assert!(board(&mut device, |board| board.configured && board.stored));
    assert_ne!(*device.app.nets(), Nets::NONE);
    assert_eq!(read(&mut device), old);
    // weights of version 1, without a configuration
    let mut device = powered(&sealed_store(1, &[]));
    assert_eq!(device.app.faults() & fault::STORE, 0);
    assert_ne!(device.app.faults() & fault::NOT_CONFIGURED, 0);
    assert_ne!(*device.app.nets(), Nets::NONE);
    assert_eq!(configure(&mut device, &good), Ok(()));
    assert_ne!(*device.app.nets(), Nets::NONE, "they are this sensor's");
}

/// A configuration that would lock the device is not used, though it was stored: the device passes
/// bytes and takes another one.
#[test]
fn what_would_lock_the_device_is_not_used() {
    let mut unit = configured(Kind::RAWIMUSX);
    unit.correction.mode = Mode::Learn;
    unit.correction.slew.accel = 0.0;
    let (nets, record) = (nets([0.0; 3], [1e-3; 3]), encode(&unit));
    let mut store = Store::new(blank()).expect("room");
    store.save(&Content::new(&nets, &record)).expect("stored");
    let mut device = Device::new(Config::default());
    device.app = App::power_on(HARDWARE, Some(store.load()), None);
    let faults = device.app.faults();
    assert_ne!(faults & fault::NOT_CONFIGURED, 0);
    assert_ne!(faults & fault::STORE, 0);
    for frame in Kind::RAWIMUSX.stream(0, 100) {
        device.feed(&frame);
        assert_eq!(device.lines.navigation.sent.pop(), Some(frame));
    }
    assert_eq!(
        configure(&mut device, &record),
        Err(Reason::Field(Field::Slew))
    );
    unit.correction.slew.accel = 1e-3;
    assert_eq!(configure(&mut device, &encode(&unit)), Ok(()));
}
