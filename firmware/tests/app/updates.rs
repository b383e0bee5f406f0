//! Updates of the firmware over the command link, and the trial of one.

use crate::device::Device;
use crate::frames::Kind;
use crate::record::{HARDWARE, configured};
use crate::stored::{Flash, blank};
use firmware::app::{App, Config};
use firmware::configuration::record::encode;
use firmware::control::update::{Refusal, Report, Running, Step};
use firmware::control::{Mode, Reason};
use firmware::model::{IMAGES_LEN, Nets};
use firmware::store::Store;
use firmware::update::header::{HEADER_LEN, Header, board, digest};
use firmware::update::slots::Places;
use firmware::update::{DEVELOPMENT_KEY, DEVELOPMENT_SEED, FIRMWARE, Slots, TakesUpdates, Updater};
use firmware::wire::checksum::crc32_zlib;
use firmware::wire::command::key::{Key, Secret};
use firmware::wire::command::{Packets, Request, Response, decode, encode as packed};
use salty::Keypair;

const STIM: Kind = Kind::STIM;
const PLACES: Places = Places {
    base: 0x0800_0000,
    slots: [0, 8192],
    len: 8192,
};
type Program = test_bench::flash::Flash<4096, 32>;
const NAME: &str = "a board";

/// A device that takes updates, and its slots.
struct Updatable {
    device: Device,
    updater: Updater<Program>,
    number: u8,
}

impl Updatable {
    /// After power-on, with the slot that the loader starts.
    fn on(program: Program, app: App<'static>) -> Updatable {
        let mut slots = Slots::new(program, PLACES).expect("they fit");
        let slot = slots.to_start().expect("an image");
        let runs = PLACES.address(slot);
        let updater = Updater::new(slots, NAME, &DEVELOPMENT_KEY, runs).expect("a slot");
        let mut device = Device::new(Config::default());
        device.app = app;
        device.app.takes_updates(updater.report(), updater.faults());
        Updatable {
            device,
            updater,
            number: 0,
        }
    }

    fn ask<T>(&mut self, request: &Request, check: impl FnOnce(Response) -> T) -> T {
        self.number += 1;
        let mut buffer = [0; 190];
        let packet = packed(self.number, request, &mut buffer).expect("a packet");
        self.device.lines.command.input.extend(&*packet);
        for _ in 0..100 {
            self.turn();
            let mut packets = Packets::new();
            for byte in self.device.lines.command.bytes() {
                if let Some(packet) = packets.push(byte) {
                    let (number, response) = decode::<Response>(packet).expect("our own packet");
                    assert_eq!(number, self.number);
                    self.device.lines.command.sent.clear();
                    return check(response);
                }
            }
        }
        panic!("no answer");
    }

    fn done(&mut self, request: &Request) -> Result<(), Reason> {
        self.ask(request, |answer| match answer {
            Response::Done => Ok(()),
            Response::Refused(reason) => Err(reason),
            other => panic!("{other:?}"),
        })
    }

    fn report(&mut self) -> Report {
        self.ask(&Request::GetUpdate, |answer| match answer {
            Response::Update(report) => report,
            other => panic!("{other:?}"),
        })
    }

    /// A turn of a millisecond, as a board's.
    fn turn(&mut self) {
        let app = &mut self.device.app;
        if let Some(order) = app.update_order() {
            let outcome = self.updater.carry_out(&order);
            app.updated(&outcome);
        }
        self.device.wait_ms(1);
        let now = self.device.time.get();
        let unwell = self.device.app.unwell(now);
        self.device.app.watch_trial(unwell, now);
    }

    /// Frames of the sensor for so long, at 1000 Hz.
    fn drives(&mut self, from: u32, ms: u32) {
        for frame in STIM.stream(from, from + ms) {
            self.device.lines.sensor.input.extend(&frame);
            self.turn();
        }
    }

    /// Sends an update; the sensor goes on meanwhile.
    fn update(&mut self, header: &[u8; HEADER_LEN], image: &[u8]) -> Result<(), Reason> {
        let header = &header[..];
        self.done(&Request::BeginUpdate {
            header,
            older: false,
        })?;
        for (n, bytes) in image.chunks(128).enumerate() {
            let offset = (n * 128) as u32;
            self.done(&Request::WriteUpdate { offset, bytes })?;
        }
        self.done(&Request::FinishUpdate)
    }
}

/// The first slot has an image that a probe has flashed.
fn flashed() -> Program {
    let mut program = Program::blank(16_384);
    program.bytes[..8].copy_from_slice(&image(0)[..8]);
    program.written[..8].fill(true);
    program
}

fn image(slot: usize) -> Vec<u8> {
    let mut image: Vec<u8> = (0..5000).map(|at| (at / 3) as u8).collect();
    image[..4].copy_from_slice(&0x2000_4000_u32.to_le_bytes());
    image[4..8].copy_from_slice(&(PLACES.address(slot) + 0x101).to_le_bytes());
    image
}

fn header(slot: usize) -> [u8; HEADER_LEN] {
    let image = image(slot);
    let signed = Header {
        version: FIRMWARE,
        address: PLACES.address(slot),
        length: image.len() as u32,
        board: board(NAME).expect("short"),
        digest: digest([&image[..]]),
    }
    .signed();
    let key = Keypair::from(&DEVELOPMENT_SEED);
    let mut bytes = [0; HEADER_LEN];
    bytes[..64].copy_from_slice(&signed);
    bytes[64..].copy_from_slice(&key.sign(&signed).to_bytes());
    bytes
}

/// A store with a record of version 3, as an older firmware has left it: one that this firmware
/// stores once more in its own version at power-on.
fn older_store() -> Flash {
    let mut images = vec![0; IMAGES_LEN];
    Nets::NONE.write_images(0, &mut images);
    let configuration = encode(&configured(STIM));
    let mut record = b"LRNS".to_vec();
    record.extend(3_u32.to_le_bytes());
    record.extend(1_u32.to_le_bytes());
    record.extend(608_u16.to_le_bytes());
    record.extend((configuration.len() as u16 + 2).to_le_bytes());
    record.extend(&images[..608]);
    record.extend((configuration.len() as u16).to_le_bytes());
    record.extend(&configuration);
    record.extend(crc32_zlib(&record).to_le_bytes());
    let mut flash = blank();
    flash.bytes[..record.len()].copy_from_slice(&record);
    flash.written[..record.len()].fill(true);
    flash
}

/// Power-on with a store. `trial`: as a board does with a firmware on trial.
fn power_on(store: Flash, trial: bool) -> (App<'static>, Flash) {
    let mut store = Store::new(store).ok();
    let app = App::start_up(HARDWARE, &mut store, !trial, None);
    (app, store.expect("room").into_inner())
}

#[test]
fn bytes_go_on_while_an_update_comes_and_the_trial_ends_after_ten_good_seconds() {
    let (_, store) = power_on(older_store(), false);
    let renewed = store.bytes.windows(5).any(|bytes| bytes == b"LRNS\x05");
    assert!(renewed, "this firmware writes its own version");
    let mut device = Updatable::on(flashed(), power_on(store, false).0);
    assert_eq!(device.report().running, Running::Flashed);
    device.done(&Request::SetMode(Mode::Bypass)).expect("done");
    device.drives(0, 50);
    let before = device.device.lines.navigation.sent.len();
    let bytes = image(1);
    device
        .done(&Request::BeginUpdate {
            header: &header(1),
            older: false,
        })
        .expect("a good header");
    for (n, bytes) in bytes.chunks(128).enumerate() {
        let offset = (n * 128) as u32;
        device.drives(50 + n as u32, 1);
        device
            .done(&Request::WriteUpdate { offset, bytes })
            .expect("a piece");
    }
    assert_eq!(device.report().step, Step::Receives);
    device.done(&Request::FinishUpdate).expect("whole");
    let left = &device.device.lines.navigation.sent;
    assert_eq!(left.len() - before, bytes.len().div_ceil(128), "each frame");
    assert!(!device.device.app.restarts(device.device.time.get()));
    device.done(&Request::Restart).expect("in bypass");
    (0..101).for_each(|_| device.turn());
    assert!(device.device.app.restarts(device.device.time.get()));

    // the new firmware finds a store that the old one has written, and leaves it alone
    let program = device.updater.into_inner();
    let old = older_store();
    let (app, store) = power_on(old.clone(), true);
    assert_eq!(store.bytes, old.bytes);
    let mut device = Updatable::on(program, app);
    assert_eq!(device.report().running, Running::Trial);
    device.done(&Request::SetMode(Mode::Bypass)).expect("done");
    let trial = Err(Reason::Update(Refusal::Trial));
    assert_eq!(device.done(&Request::StoreImage), trial);
    assert_eq!(device.update(&header(0), &image(0)), trial);
    assert!(!device.device.app.wants_to_store());
    device.drives(0, 9_900);
    assert_eq!(device.report().running, Running::Trial, "not yet");
    device.drives(9_900, 300);
    assert_eq!(device.report().running, Running::Confirmed);
    assert_eq!(device.done(&Request::StoreImage), Ok(()));
}

#[test]
fn a_trial_without_bytes_or_with_a_new_fault_is_not_confirmed_and_the_old_firmware_finds_its_store()
{
    let (app, store) = power_on(older_store(), true);
    let mut device = Updatable::on(flashed(), app);
    device.done(&Request::SetMode(Mode::Bypass)).expect("done");
    device.drives(0, 10);
    device.update(&header(1), &image(1)).expect("good");
    // silent: no byte has passed
    let mut device = Updatable::on(device.updater.into_inner(), power_on(store.clone(), true).0);
    (0..15_000).for_each(|_| device.turn());
    assert_eq!(device.report().running, Running::Trial);
    // the store is lost to it: a fault that was not there before
    let mut lost = store.clone();
    lost.bytes[700] ^= 1;
    device.device.app = power_on(lost, true).0;
    let updater = &device.updater;
    (device.device.app).takes_updates(updater.report(), updater.faults());
    device.drives(0, 15_000);
    assert_eq!(device.report().running, Running::Trial);
    // the next start goes back, with the store as it was
    let device = Updatable::on(
        device.updater.into_inner(),
        power_on(store.clone(), false).0,
    );
    assert_eq!(device.updater.report().running, Running::Flashed);
    assert_eq!(device.updater.report().failed, Some(FIRMWARE));
    assert_eq!(store.bytes, older_store().bytes);
}

#[test]
fn only_in_bypass_only_with_slots_and_only_with_the_key() {
    let app = App::new(Config::of(&configured(STIM)));
    let mut device = Updatable::on(flashed(), app);
    device.drives(0, 10);
    device.done(&Request::SetMode(Mode::Frozen)).expect("done");
    let all = [
        Request::BeginUpdate {
            header: &header(1),
            older: false,
        },
        Request::WriteUpdate {
            offset: 0,
            bytes: &[0; 64],
        },
        Request::FinishUpdate,
        Request::Restart,
    ];
    for request in &all {
        assert_eq!(device.done(request), Err(Reason::Mode), "{request:?}");
    }
    device.done(&Request::SetMode(Mode::Bypass)).expect("done");
    let short = Request::BeginUpdate {
        header: &[0; 127],
        older: false,
    };
    let refused = Err(Reason::Update(Refusal::Header));
    assert_eq!(device.done(&short), refused);
    let early = Err(Reason::Update(Refusal::NotBegun));
    assert_eq!(device.done(&all[2]), early);
    device.device.app.set_key(Key::Secret(Secret([3; 32])));
    for request in &all {
        assert_eq!(device.done(request), Err(Reason::KeyNeeded), "{request:?}");
    }
    assert_eq!(device.report().running, Running::Flashed, "reading is open");
    let mut none = Device::new(Config::of(&configured(STIM)));
    for request in all.iter().chain([&Request::GetUpdate]) {
        none.ask(request, |answer| {
            assert_eq!(answer, Response::Refused(Reason::Unsupported));
        });
    }
}
