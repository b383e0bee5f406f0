//! Updates of the board `h743` over power cycles: its loader, and its images for both slots. The
//! emulator has no USB, so the command link of these images is the probe's serial port (feature
//! `probe-line`); all else is as released.

use std::fs;
use std::sync::LazyLock;

use firmware::control::Reason;
use firmware::control::update::{Refusal, Report, Running};
use firmware::update::header::HEADER_LEN;
use firmware::update::slots::{Places, RECORD_LEN};
use firmware::update::{DEVELOPMENT_KEY, DEVELOPMENT_SEED, FIRMWARE};
use firmware::update::{Order, Piece, Slots, TakesUpdates, Updater};
use firmware::wire::command::key::Secret;
use firmware::wire::command::{MAX_CHUNK, Packets, Request, Response, decode};
use host_device::device::sign::signed;
use qemu::boards::{Updatable, build};
use qemu::emulator::{Chip, Conversation, RunRequest, build_or_skip};
use qemu::protocol::packet_of;
use test_bench::flash::Flash;
use xtask::load;

use super::*;

const WIRES: Wires = Wires(["USART6", "USART2", "USART3"]);
const BASE: u64 = 0x0800_0000;
/// As in the board and its loader.
const PLACES: Places = Places {
    base: 0x0800_0000,
    slots: [0x2_0000, 0x10_0000],
    len: 0xC_0000,
};
const LEN: usize = 0x20_0000;
const SECTOR: usize = 0x2_0000;
/// The core waits most of the time.
const INSTRUCTIONS: u64 = 40_000_000;
/// From power-on until the board is asked: the loader's digest of an update, and the start.
const STARTS: u64 = 2500 * MS;
/// An update comes within this time.
const COMES: u64 = 120_000 * MS;
/// A trial takes 10 s.
const TRIAL: u64 = 12_000 * MS;

/// A header and the image behind it.
type Sent = ([u8; HEADER_LEN], Vec<u8>);

/// What a probe writes, and the update of the second slot.
struct Images {
    loader: PathBuf,
    first: Vec<u8>,
    second: Sent,
}

static IMAGES: LazyLock<Images> = LazyLock::new(|| {
    let board = Updatable::named("h743").expect("it takes updates");
    let image = |nth: usize| {
        let slot = board.slots[nth];
        assert_eq!(slot, PLACES.address(nth), "as in the board");
        let name = format!("h743-{slot:x}");
        let elf = built_copy(&name, || board.build_with("probe-line", slot, None));
        let bin = elf.with_extension("bin");
        assert_eq!(load::bin(&elf, &bin).expect("a file"), Some(slot));
        fs::read(bin).expect("a file")
    };
    Images {
        loader: built_copy(board.loader, || build(board.loader, board.target)),
        first: image(0),
        second: signed_for_second(image(1)),
    }
});

fn signed_for_second(image: Vec<u8>) -> Sent {
    let linked = [(PLACES.address(1), image)];
    let file = signed("h743", FIRMWARE, &linked, &Secret(DEVELOPMENT_SEED)).expect("a name");
    let (header, image) = file.split_first_chunk().expect("a header");
    (*header, image.to_vec())
}

/// An update that never answers: a stack, an entry, and a branch to itself.
fn hangs() -> Sent {
    let mut image = 0x2000_4000_u32.to_le_bytes().to_vec();
    image.extend((PLACES.address(1) + 9).to_le_bytes());
    image.extend(0xE7FE_u16.to_le_bytes());
    image.resize(300, 0xFF);
    signed_for_second(image)
}

/// A board, by the flash that it keeps without power. The loader's sector is not in it.
struct Device {
    emulator: PathBuf,
    flash: Vec<u8>,
}

/// What happens from power-on until power fails.
struct Power {
    asked: RunRequest,
    at: u64,
    number: u8,
}

/// What the board has answered.
struct Answers {
    reports: Vec<Report>,
    refused: Vec<Reason>,
    done: usize,
    passed: Vec<u8>,
}

impl Device {
    /// A probe has written loader and first image. `None`: no emulator here.
    fn new() -> Option<Self> {
        let emulator = build_or_skip()?;
        let mut flash = vec![0xFF; LEN];
        let first = PLACES.slots[0] as usize;
        flash[first..][..IMAGES.first.len()].copy_from_slice(&IMAGES.first);
        Some(Self { emulator, flash })
    }

    /// The same with an update in the second slot: the board's code has put it there, on the
    /// desktop.
    fn with_update(update: &Sent) -> Option<Self> {
        let mut device = Self::new()?;
        let slots = device.slots();
        let here = PLACES.address(0);
        let mut updater = Updater::new(slots, "h743", &DEVELOPMENT_KEY, here).expect("a slot");
        let begin = Order::Begin {
            header: update.0,
            older: false,
        };
        let pieces = update.1.chunks(MAX_CHUNK).enumerate();
        let pieces = pieces.map(|(n, bytes)| Order::Piece {
            offset: (n * MAX_CHUNK) as u32,
            bytes: Piece::from_slice(bytes).expect("short"),
        });
        let orders = [begin].into_iter().chain(pieces);
        for order in orders.chain([Order::Finish { faults: u32::MAX }]) {
            assert_eq!(updater.carry_out(&order).done, Ok(()), "{order:?}");
        }
        device.flash = updater.into_inner().bytes;
        Some(device)
    }

    fn slots(&self) -> Slots<Flash<SECTOR, 32>> {
        Slots::new(Flash::holding(self.flash.clone()), PLACES).expect("they fit")
    }

    /// The second slot was started, as its record has it; `None`: it has none.
    fn was_tried(&self) -> Option<bool> {
        self.slots().record(1).map(|record| record.tried)
    }

    /// Power on, and off at the end.
    fn runs(&mut self, power: Power) -> Answers {
        let Power { mut asked, at, .. } = power;
        asked.until = asked.until.max(at);
        let from = PLACES.slots[0] as usize;
        let digits = self.flash[from..].iter();
        let digits = digits.map(|byte| format!("{byte:02x}")).collect();
        asked.flash.push((BASE + from as u64, digits));
        asked.memory.push((BASE + from as u64, (LEN - from) as u64));
        asked.listen.extend([WIRES.0[1], WIRES.0[2]]);
        let outcome = run(&self.emulator, &asked);
        assert_eq!(outcome.all("refused").count(), 0, "{:?}", outcome.lines);
        self.flash[from..].copy_from_slice(&outcome.memory[0]);
        let mut answers = Answers {
            reports: Vec::new(),
            refused: Vec::new(),
            done: 0,
            passed: outcome.left[WIRES.0[1]].0.clone(),
        };
        let mut packets = Packets::new();
        for &byte in &outcome.left[WIRES.0[2]].0 {
            let Some(packet) = packets.push(byte) else {
                continue;
            };
            match decode::<Response>(packet).expect("a packet").1 {
                Response::Update(report) => answers.reports.push(report),
                Response::Refused(reason) => answers.refused.push(reason),
                Response::Done => answers.done += 1,
                other => panic!("{other:?}"),
            }
        }
        answers
    }

    /// Its state after power-on; `None`: it does not answer.
    fn report(&mut self) -> Option<Report> {
        let mut power = Power::on();
        power.ask(&Request::GetUpdate, 20 * MS);
        self.runs(power).reports.pop()
    }
}

impl Power {
    fn on() -> Self {
        let mut asked = RunRequest::new(&IMAGES.loader, Chip::H743);
        asked.instructions = INSTRUCTIONS;
        Self {
            asked,
            at: STARTS,
            number: 0,
        }
    }

    fn off_at(at: u64) -> Self {
        Self { at, ..Self::on() }
    }

    fn ask(&mut self, request: &Request, wait: u64) {
        let packet = packet_of(self.number, request).expect("a packet");
        self.number = self.number.wrapping_add(1);
        self.asked.send(WIRES.0[2], self.at, BAUD, &packet);
        self.at += wait;
    }

    /// A host sends an update and waits for each answer, as `host-sim device update` does. Power
    /// fails a time after the last, or at the end of `at`.
    fn update((header, image): &Sent, at: u64, restart: bool) -> Self {
        let begin = Request::BeginUpdate {
            header,
            older: false,
        };
        let pieces = image.chunks(MAX_CHUNK).enumerate();
        let pieces = pieces.map(|(n, bytes)| Request::WriteUpdate {
            offset: (n * MAX_CHUNK) as u32,
            bytes,
        });
        let requests = [begin].into_iter().chain(pieces);
        let requests = requests.chain([Request::FinishUpdate]);
        let requests = requests.chain(restart.then_some(Request::Restart));
        let numbered = (0_u8..=255).cycle().zip(requests);
        let packets = numbered.map(|(number, request)| packet_of(number, &request));
        let packets: Vec<Vec<u8>> = packets.map(|packet| packet.expect("a packet")).collect();
        let mut power = Self::off_at(at);
        let rest = if restart { STARTS } else { 0 };
        let host = Conversation::new(STARTS, BAUD, &packets, rest);
        power.asked.conversations.insert(WIRES.0[2], host);
        power
    }

    /// The sensor sends for so long.
    fn drive(&mut self, ns: u64) -> Vec<u8> {
        let frames = frames(ImuFormat::Stim300, 200);
        let mut all = Vec::new();
        for frame in frames.iter().cycle().take((ns / (10 * MS)) as usize) {
            self.asked.send(WIRES.0[0], self.at, BAUD, &frame.bytes);
            self.at += 10 * MS;
            all.extend(&frame.bytes);
        }
        all
    }
}

/// Where the board runs from, by the slot that is free.
fn runs_in(report: &Report) -> usize {
    1 - PLACES.slot_of(report.slot).expect("a slot")
}

/// An update that proves itself is confirmed, and stays.
#[test]
fn an_update_that_proves_itself_stays() {
    let Some(mut device) = Device::with_update(&IMAGES.second) else {
        return;
    };
    let mut power = Power::on();
    power.ask(&Request::GetUpdate, 20 * MS);
    let frames = power.drive(TRIAL);
    power.ask(&Request::GetUpdate, 20 * MS);
    let answers = device.runs(power);
    let states = answers.reports.iter();
    let states: Vec<_> = states.map(|r| (runs_in(r), r.running)).collect();
    assert_eq!(states, [(1, Running::Trial), (1, Running::Confirmed)]);
    assert!(answers.passed == frames, "bytes pass");
    let report = device.report().expect("an answer");
    assert_eq!((runs_in(&report), report.running), (1, Running::Confirmed));
}

/// A whole image comes over the command link into the flash, and the loader starts it.
#[test]
fn a_whole_image_comes_over_the_link() {
    let Some(mut device) = Device::new() else {
        return;
    };
    let image = &IMAGES.second.1;
    let answers = device.runs(Power::update(&IMAGES.second, COMES, false));
    let pieces = image.len().div_ceil(MAX_CHUNK);
    assert_eq!((answers.refused, answers.done), (vec![], 1 + pieces + 1));
    let slot = PLACES.slots[1] as usize;
    assert!(device.flash[slot..].starts_with(image));
    let report = device.report().expect("an answer");
    assert_eq!((runs_in(&report), report.running), (1, Running::Trial));
}

/// An update that does not run is left at the next reset, and the device reports that.
#[test]
fn an_update_that_hangs_is_left_at_the_next_reset() {
    let Some(mut device) = Device::new() else {
        return;
    };
    let answers = device.runs(Power::update(&hangs(), COMES, true));
    assert_eq!((answers.refused, answers.done), (vec![], 1 + 3 + 2));
    assert_eq!(device.was_tried(), Some(true), "it restarts with it");
    let mut power = Power::on();
    power.asked.resets.push(power.at);
    power.at += STARTS;
    power.ask(&Request::GetUpdate, 20 * MS);
    let answers = device.runs(power);
    let [report] = answers.reports[..] else {
        panic!("{:?}", answers.reports);
    };
    assert_eq!((runs_in(&report), report.failed), (0, Some(FIRMWARE)));
}

/// Power fails while an update comes: the device starts as before, and takes it again.
#[test]
fn power_may_fail_while_an_update_comes() {
    let Some(whole) = Device::new() else {
        return;
    };
    let copy = || Device {
        emulator: whole.emulator.clone(),
        flash: whole.flash.clone(),
    };
    for cut in [1, 40, 300, 1100, 4000] {
        let mut device = copy();
        device.runs(Power::update(&hangs(), STARTS + cut * MS, false));
        let Some(report) = device.report() else {
            assert_eq!(device.was_tried(), Some(true), "it was whole: {cut} ms");
            continue;
        };
        let state = (runs_in(&report), report.running);
        assert_eq!(state, (0, Running::Flashed), "{cut} ms");
        let answers = device.runs(Power::update(&hangs(), COMES, false));
        assert_eq!((answers.refused, answers.done), (vec![], 1 + 3 + 1));
    }
}

/// An update that has not proved itself is left at the next power-on, and may be sent again.
#[test]
fn without_a_confirmation_the_loader_goes_back() {
    let Some(mut device) = Device::with_update(&IMAGES.second) else {
        return;
    };
    let report = device.report().expect("an answer");
    assert_eq!((runs_in(&report), report.running), (1, Running::Trial));
    for _ in 0..2 {
        let report = device.report().expect("an answer");
        assert_eq!((runs_in(&report), report.running), (0, Running::Flashed));
        assert_eq!(report.failed, Some(FIRMWARE));
    }
}

/// Power fails while the loader looks at an update, marks it and starts it: it is tried at the next
/// power-on, or it has been.
#[test]
fn power_may_fail_in_the_loader() {
    let Some(whole) = Device::with_update(&hangs()) else {
        return;
    };
    let (mut before, mut after) = (0, 0);
    let mut cut = 20_000;
    while cut < 20 * MS {
        let mut device = Device {
            emulator: whole.emulator.clone(),
            flash: whole.flash.clone(),
        };
        device.runs(Power::off_at(cut));
        if device.was_tried().expect("a record") {
            after += 1;
        } else {
            before += 1;
            assert!(device.report().is_none(), "it hangs");
            assert_eq!(device.was_tried(), Some(true));
        }
        let report = device.report().expect("an answer");
        assert_eq!((runs_in(&report), report.failed), (0, Some(FIRMWARE)));
        cut *= 2;
    }
    assert!(before > 0 && after > 0, "{before} {after}");
}

/// A damaged image is not started. Nor is one whose mark or slot power has left half written.
#[test]
fn what_is_damaged_is_not_started() {
    let Some(whole) = Device::with_update(&IMAGES.second) else {
        return;
    };
    let slot = PLACES.slots[1] as usize;
    let record = slot + PLACES.len as usize - RECORD_LEN as usize;
    type Damage = (&'static str, fn(&mut [u8]), std::ops::Range<usize>);
    let damage: [Damage; 5] = [
        (
            "a bit of the image",
            |at| at[0] ^= 1,
            slot + 400_000..slot + 400_001,
        ),
        (
            "a bit of the record",
            |at| at[0] ^= 1,
            record + 16..record + 17,
        ),
        ("a mark begun", |at| at.fill(0), record + 192..record + 200),
        (
            "an erasure begun",
            |at| at.fill(0xFF),
            slot..slot + SECTOR / 2,
        ),
        (
            "an erasure begun in the middle",
            |at| at.fill(0xFF),
            slot + SECTOR..slot + 2 * SECTOR,
        ),
    ];
    for (what, damage, place) in damage {
        let mut device = Device {
            emulator: whole.emulator.clone(),
            flash: whole.flash.clone(),
        };
        damage(&mut device.flash[place]);
        let report = device.report().expect("an answer");
        assert_eq!(
            (runs_in(&report), report.running),
            (0, Running::Flashed),
            "{what}"
        );
    }
}

/// The board itself refuses what is signed with another key, before it erases anything.
#[test]
fn another_signature_is_refused() {
    let Some(mut device) = Device::new() else {
        return;
    };
    let before = device.flash.clone();
    let (mut header, image) = hangs();
    header[HEADER_LEN - 1] ^= 1;
    let answers = device.runs(Power::update(&(header, image), COMES, false));
    let not_begun = Reason::Update(Refusal::NotBegun);
    let first = Reason::Update(Refusal::Signature);
    assert_eq!(answers.refused[0], first);
    assert!(
        answers.refused[1..]
            .iter()
            .all(|reason| *reason == not_begun)
    );
    assert!(device.flash == before);
}
