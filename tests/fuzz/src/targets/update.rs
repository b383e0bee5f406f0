//! An update's file, and anybody at the command link who sends updates in any order and with any
//! content, while power fails at any byte of the flash. Nothing outside the free slot is erased or
//! written, a slot with a record holds an image that is signed with the right key, and what starts
//! is always whole.

use std::path::Path;
use std::sync::LazyLock;

use arbitrary::Arbitrary;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use firmware::app::{App, Config, Lines};
use firmware::control::Mode;
use firmware::control::update::Step;
use firmware::update::header::{HEADER_LEN, Header};
use firmware::update::slots::{Places, RECORD_LEN};
use firmware::update::{
    DEVELOPMENT_KEY, DEVELOPMENT_SEED, FIRMWARE, Order, Slots, TakesUpdates, Updater,
};
use firmware::wire::cobs;
use firmware::wire::command::key::Secret;
use firmware::wire::command::{MAX_CHUNK, MAX_PACKET, Packets, Request, Response, decode, encode};
use host_device::device::Update;
use host_device::device::sign::signed;
use host_device::hil::{MemoryLine, SetClock};
use test_bench::flash::{Failure, Flash};

const SECTOR: usize = 512;
const PLACES: Places = Places {
    base: 0x0800_0000,
    slots: [512, 3072],
    len: 2048,
};
const CAPACITY: usize = 6144;
const NAME: &str = "mock";

#[derive(Arbitrary, Debug)]
enum Act<'i> {
    /// An update begins: one of [`UPDATES`], with a byte of its header changed.
    Begin(u8, Option<(u8, u8)>, bool),
    /// So many pieces of it, as they should be.
    Pieces(u8),
    /// A piece of any content.
    Piece(u16, &'i [u8]),
    Finish,
    Confirm,
    /// A message of any kind and content.
    Message(u8, &'i [u8]),
    /// From now on power fails after so many bytes of flash, the last of which is this.
    Cut(u16, u8),
    /// Power off and on.
    Restart,
}

/// A signed header, its image, and whether the device may take it.
struct Sent {
    header: [u8; HEADER_LEN],
    image: Vec<u8>,
    good: bool,
}

/// Updates of each slot and of several lengths, the last ones for another board and with another
/// key.
static UPDATES: LazyLock<Vec<Sent>> = LazyLock::new(|| {
    let own = Secret(DEVELOPMENT_SEED);
    let other = Secret([7; 32]);
    let all = [
        (NAME, &own, FIRMWARE),
        (NAME, &own, [0, 0, 1]),
        ("mocks", &own, FIRMWARE),
        (NAME, &other, FIRMWARE),
    ];
    let mut updates = Vec::new();
    for (n, (name, key, version)) in all.into_iter().enumerate() {
        for len in [64, 700, PLACES.room() as usize] {
            for slot in 0..2 {
                let linked = [(PLACES.address(slot), image(slot, len, n as u8))];
                let file = signed(name, version, &linked, key).expect("a short name");
                let (header, image) = file.split_first_chunk().expect("a header");
                updates.push(Sent {
                    header: *header,
                    image: image.to_vec(),
                    good: n < 2,
                });
            }
        }
    }
    updates
});

/// An image that begins as one does.
fn image(slot: usize, len: usize, fill: u8) -> Vec<u8> {
    let mut image: Vec<u8> = (0..len).map(|at| (at * 7) as u8 ^ fill).collect();
    image[..4].copy_from_slice(&0x2000_4000_u32.to_le_bytes());
    image[4..8].copy_from_slice(&(PLACES.address(slot) + 0x31).to_le_bytes());
    image
}

/// Flash of which only the free slot, and the last mark of the one that runs, may change.
struct Guarded {
    flash: Flash<SECTOR, 32>,
    runs: usize,
}

impl Guarded {
    fn check(&self, done: Result<(), Failure>) -> Result<(), Failure> {
        assert_ne!(done, Err(Failure::Misuse), "the flash is misused");
        done
    }

    fn is_free(&self, from: u32, to: u32) -> bool {
        let slot = PLACES.slots[1 - self.runs];
        (slot..=slot + PLACES.len).contains(&from) && to <= slot + PLACES.len
    }
}

impl ErrorType for Guarded {
    type Error = Failure;
}

impl ReadNorFlash for Guarded {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        let done = self.flash.read(offset, bytes);
        self.check(done)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Guarded {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        assert!(self.is_free(from, to), "{from} to {to} is erased");
        let done = self.flash.erase(from, to);
        self.check(done)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let (end, len) = (offset + bytes.len() as u32, bytes.len());
        let confirmed = PLACES.slots[self.runs] + PLACES.len - RECORD_LEN + 256;
        let marks = offset == confirmed && len == 64;
        assert!(
            self.is_free(offset, end) || marks,
            "{len} bytes at {offset}"
        );
        let done = self.flash.write(offset, bytes);
        self.check(done)
    }
}

struct Device {
    app: App<'static>,
    lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine>,
    clock: SetClock,
    updater: Updater<Guarded>,
    number: u8,
    begun: usize,
}

impl Device {
    /// After power-on.
    fn on(flash: Flash<SECTOR, 32>) -> Self {
        let mut slots = Slots::new(flash, PLACES).expect("they fit");
        let slot = slots.to_start().expect("something starts");
        let flash = slots.into_inner();
        let runs = Guarded { flash, runs: slot };
        assert!(is_whole(&runs.flash, slot), "slot {slot} is started");
        let slots = Slots::new(runs, PLACES).expect("they fit");
        let updater = Updater::new(slots, NAME, &DEVELOPMENT_KEY, PLACES.address(slot));
        let updater = updater.expect("it can go back");
        let config = Config {
            mode: Mode::Bypass,
            ..Config::default()
        };
        let mut app = App::with_learner(config, None);
        app.takes_updates(updater.report(), updater.faults());
        Self {
            app,
            lines: Lines::default(),
            clock: SetClock(0),
            updater,
            number: 0,
            begun: 0,
        }
    }

    fn off(self) -> Flash<SECTOR, 32> {
        let mut flash = self.updater.into_inner().flash;
        flash.left = usize::MAX;
        flash
    }

    fn ask(&mut self, request: &Request) {
        self.number = self.number.wrapping_add(1);
        let mut buffer = [0; MAX_PACKET];
        if let Ok(packet) = encode(self.number, request, &mut buffer) {
            self.lines.command.received.extend(&*packet);
        }
        self.settle();
    }

    fn message(&mut self, kind: u8, content: &[u8]) {
        self.number = self.number.wrapping_add(1);
        let mut plain = vec![self.number, kind];
        plain.extend(&content[..content.len().min(150)]);
        plain.extend(crate::crc32(&plain).to_le_bytes());
        let mut packet = [0; 256];
        let len = cobs::encode(&plain, &mut packet).expect("room");
        self.lines.command.received.extend(&packet[..len]);
        self.settle();
    }

    /// Turns of the frame path and the main thread, until nothing is left to do.
    fn settle(&mut self) {
        for turn in 0.. {
            assert!(turn < 2000, "it never rests");
            self.clock.0 += 1000;
            let busy = self.app.poll(&mut self.lines, &self.clock);
            let order = self.app.update_order();
            if let Some(order) = &order {
                let outcome = self.updater.carry_out(order);
                self.app.updated(&outcome);
            }
            if !busy && order.is_none() {
                break;
            }
        }
        let mut packets = Packets::new();
        for byte in std::mem::take(&mut self.lines.command.sent) {
            if let Some(packet) = packets.push(byte) {
                decode::<Response>(packet).expect("our own packet");
            }
        }
    }

    fn act(&mut self, act: &Act) {
        match *act {
            Act::Begin(which, change, older) => {
                self.begun = usize::from(which) % UPDATES.len();
                let mut header = UPDATES[self.begun].header;
                if let Some((at, bits)) = change {
                    header[usize::from(at) % HEADER_LEN] ^= bits;
                }
                let header = &header;
                self.ask(&Request::BeginUpdate { header, older });
            }
            Act::Pieces(count) => {
                let from = self.updater.report().received as usize;
                let image = UPDATES[self.begun].image.get(from..).unwrap_or_default();
                let pieces = image.chunks(MAX_CHUNK).take(usize::from(count));
                for (bytes, offset) in pieces.zip((from as u32..).step_by(MAX_CHUNK)) {
                    self.ask(&Request::WriteUpdate { offset, bytes });
                }
            }
            Act::Piece(offset, bytes) => {
                let offset = u32::from(offset);
                self.ask(&Request::WriteUpdate { offset, bytes });
            }
            Act::Finish => self.ask(&Request::FinishUpdate),
            Act::Confirm => drop(self.updater.carry_out(&Order::Confirm)),
            Act::Message(kind, content) => self.message(kind % 48, content),
            Act::Cut(..) | Act::Restart => {}
        }
    }
}

/// Whether a slot holds what a probe has flashed, or an image of a good signature.
fn is_whole(flash: &Flash<SECTOR, 32>, slot: usize) -> bool {
    let at = &flash.bytes[PLACES.slots[slot] as usize..];
    let good = UPDATES.iter().filter(|update| update.good);
    let good = good.map(|update| &update.image);
    let flashed = image(0, 1400, 99);
    good.chain([&flashed]).any(|image| at.starts_with(image))
}

/// Checks the records of a flash.
fn check(flash: &Flash<SECTOR, 32>) {
    let mut slots = Slots::new(flash.clone(), PLACES).expect("they fit");
    for slot in 0..2 {
        let Some(record) = slots.record(slot) else {
            continue;
        };
        let stated = |update: &&Sent| Header::parse(&update.header) == Some(record.header);
        let signed = UPDATES.iter().find(stated).expect("one that was signed");
        assert!(signed.good, "{record:?}");
    }
}

/// Whether it is a file with an image, or an update was ready to start.
pub fn run(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else {
        return false;
    };
    if kind & 1 == 0 {
        return match Update::parse(Path::new("fuzz.update"), rest) {
            Ok(update) => !update.version().is_empty(),
            Err(error) => crate::refused(&error),
        };
    }
    let Some(acts) = crate::structured::<Vec<Act>>(rest) else {
        return false;
    };
    let mut flash = Flash::blank(CAPACITY);
    let first = image(0, 1400, 99);
    let at = PLACES.slots[0] as usize;
    flash.bytes[at..at + first.len()].copy_from_slice(&first);
    flash.written[at..at + first.len()].fill(true);
    let mut device = Device::on(flash);
    let mut ready = false;
    for act in acts.iter().take(32) {
        device.act(act);
        ready |= device.updater.report().step == Step::Ready;
        if matches!(act, Act::Restart | Act::Cut(..)) {
            let mut flash = device.off();
            check(&flash);
            if let Act::Cut(left, torn) = *act {
                (flash.left, flash.torn) = (usize::from(left) % 8192 + 1, torn);
            }
            device = Device::on(flash);
        }
    }
    let flash = device.off();
    check(&flash);
    Device::on(flash);
    ready
}
