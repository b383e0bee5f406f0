use super::header::{HEADER_LEN, Header, SIGNED_LEN, board, digest, is_signed};
use super::slots::{PIECE, Places, Slots};
use super::{DEVELOPMENT_KEY, DEVELOPMENT_SEED, FIRMWARE, Order, Piece, TakesUpdates, Updater};
use crate::control::update::{Refusal, Running, Step};
use crate::wire::command::fault;
use core::ops::{Deref, DerefMut};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use salty::Keypair;
use test_bench::flash::{Failure, Flash};

/// As on an STM32H743, but small: words of 32 bytes. With `checks` one that was torn by a power cut
/// cannot be read until it is erased.
#[derive(Clone)]
struct Chip {
    flash: Flash<512, WORD, 1>,
    checks: bool,
    torn: Option<usize>,
}

const WORD: usize = 32;

impl Deref for Chip {
    type Target = Flash<512, WORD, 1>;

    fn deref(&self) -> &Self::Target {
        &self.flash
    }
}

impl DerefMut for Chip {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.flash
    }
}

impl ErrorType for Chip {
    type Error = Failure;
}

impl ReadNorFlash for Chip {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        let words = offset as usize / WORD..(offset as usize + bytes.len()).div_ceil(WORD);
        match self.torn.filter(|torn| words.contains(torn)) {
            Some(_) => Err(Failure::Misuse),
            None => self.flash.read(offset, bytes),
        }
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Chip {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = 512;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        let left = self.left;
        let done = self.flash.erase(from, to);
        let (from, len) = (from as usize, (to - from) as usize);
        if done.is_ok()
            && self
                .torn
                .is_some_and(|word| (from..from + len).contains(&(word * WORD)))
        {
            self.torn = None;
        }
        if done.is_err() && self.checks && left > 0 {
            self.torn = Some((from + (left - 1 + 256) % len) / WORD); // it begins in the middle
        }
        done
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let left = self.left;
        let done = self.flash.write(offset, bytes);
        if done == Err(Failure::PowerCut) && self.checks && left > 0 {
            self.torn = Some((offset as usize + left - 1) / WORD);
        }
        done
    }
}

const PLACES: Places = Places {
    base: 0x0800_0000,
    slots: [512, 3072],
    len: 2048,
};
const CAPACITY: usize = 6144;
/// Where neither slots nor loader are; the store is there.
const STORE: core::ops::Range<usize> = 5120..6144;
const NAME: &str = "mock";

/// An image that begins as one does, and differs from others by `fill`.
fn image(slot: usize, len: usize, fill: u8) -> Vec<u8> {
    let code = PLACES.address(slot) + 0x101;
    let mut image: Vec<u8> = (0..len).map(|at| (at * 7) as u8 ^ fill).collect();
    image[..4].copy_from_slice(&0x2000_4000_u32.to_le_bytes());
    image[4..8].copy_from_slice(&code.to_le_bytes());
    image
}

fn stated(slot: usize, image: &[u8]) -> Header {
    Header {
        version: FIRMWARE,
        address: PLACES.address(slot),
        length: image.len() as u32,
        board: board(NAME).unwrap(),
        digest: digest([image]),
    }
}

fn signed(header: &Header) -> [u8; HEADER_LEN] {
    let mut bytes = [0; HEADER_LEN];
    let body = header.signed();
    let key = Keypair::from(&DEVELOPMENT_SEED);
    bytes[..SIGNED_LEN].copy_from_slice(&body);
    bytes[SIGNED_LEN..].copy_from_slice(&key.sign(&body).to_bytes());
    bytes
}

/// A chip whose first slot was flashed by a probe, and whose store holds something.
fn chip() -> Chip {
    let mut chip = Chip {
        flash: Flash::blank(CAPACITY),
        checks: false,
        torn: None,
    };
    let first = image(0, 1400, 0);
    chip.bytes[512..512 + first.len()].copy_from_slice(&first);
    chip.written[512..512 + first.len()].fill(true);
    chip.bytes[STORE].fill(0x5C);
    chip.written[STORE].fill(true);
    chip
}

fn slots(chip: &Chip) -> Slots<Chip> {
    Slots::new(chip.clone(), PLACES).expect("they fit")
}

/// Starts: gives the slot and the chip afterwards. `None`: power failed in the loader.
fn starts(chip: &mut Chip) -> Option<usize> {
    let mut slots = slots(chip);
    let slot = slots.to_start();
    *chip = slots.into_inner();
    slot.filter(|_| chip.left > 0)
}

fn updater(chip: &Chip, runs: usize) -> Updater<Chip> {
    let runs = PLACES.address(runs) + 8;
    Updater::new(slots(chip), NAME, &DEVELOPMENT_KEY, runs).expect("it runs in a slot")
}

/// Gives the orders of an update until one is refused.
fn update(
    updater: &mut Updater<Chip>,
    header: &[u8; HEADER_LEN],
    image: &[u8],
) -> Result<(), Refusal> {
    let begin = Order::Begin {
        header: *header,
        older: false,
    };
    updater.carry_out(&begin).done?;
    pieces(updater, image, 0)?;
    updater.carry_out(&Order::Finish { faults: 3 }).done
}

fn piece(offset: usize, bytes: &[u8]) -> Order {
    Order::Piece {
        offset: offset as u32,
        bytes: Piece::from_slice(bytes).expect("short"),
    }
}

fn pieces(updater: &mut Updater<Chip>, image: &[u8], from: usize) -> Result<(), Refusal> {
    for (n, bytes) in image[from..].chunks(128).enumerate() {
        updater.carry_out(&piece(from + n * 128, bytes)).done?;
    }
    Ok(())
}

/// Whether a slot holds this image.
fn holds(chip: &Chip, slot: usize, image: &[u8]) -> bool {
    let at = PLACES.slots[slot] as usize;
    chip.bytes[at..at + image.len()] == *image
}

#[test]
fn the_development_key_is_that_of_its_seed() {
    let key = Keypair::from(&DEVELOPMENT_SEED);
    assert_eq!(key.public.to_bytes(), DEVELOPMENT_KEY);
}

#[test]
fn an_update_is_tried_confirmed_and_followed_by_the_next() {
    let mut chip = chip();
    assert_eq!(starts(&mut chip), Some(0));
    let mut runs = 0;
    for n in 1..5_u8 {
        let free = 1 - runs;
        let image = image(free, 1000 + usize::from(n), n);
        let mut updater = updater(&chip, runs);
        assert_eq!(updater.report().slot, PLACES.address(free));
        let header = signed(&stated(free, &image));
        assert_eq!(update(&mut updater, &header, &image), Ok(()));
        assert_eq!(updater.report().step, Step::Ready);
        chip = updater.into_inner();
        assert_eq!(starts(&mut chip), Some(free));
        let mut updater = self::updater(&chip, free);
        assert_eq!(updater.report().running, Running::Trial);
        // those before, and those that the bypass hides in which it was finished
        assert_eq!(updater.faults(), 3 | fault::UNITS | fault::PASS_THROUGH);
        // on trial no other one is taken: it would go over the one that works
        let other = signed(&stated(runs, &image));
        let begin = Order::Begin {
            header: other,
            older: false,
        };
        assert_eq!(updater.carry_out(&begin).done, Err(Refusal::Trial));
        for _ in 0..2 {
            assert_eq!(updater.carry_out(&Order::Confirm).done, Ok(()));
        }
        chip = updater.into_inner();
        assert_eq!(starts(&mut chip), Some(free));
        let report = *self::updater(&chip, free).report();
        assert_eq!(report.running, Running::Confirmed);
        runs = free;
    }
    assert!(chip.bytes[STORE].iter().all(|byte| *byte == 0x5C));
}

#[test]
fn without_a_confirmation_the_one_before_comes_back_and_a_new_one_may_follow() {
    let mut chip = chip();
    let image = image(1, 900, 1);
    let header = signed(&stated(1, &image));
    for _ in 0..2 {
        let mut updater = updater(&chip, 0);
        update(&mut updater, &header, &image).expect("taken");
        chip = updater.into_inner();
        assert_eq!([starts(&mut chip), starts(&mut chip)], [Some(1), Some(0)]);
        assert_eq!(starts(&mut chip), Some(0));
        let failed = self::updater(&chip, 0).report().failed;
        assert_eq!(failed, Some(FIRMWARE), "said");
    }
}

/// An update that was ready is not started once another one was begun in its place.
#[test]
fn what_was_replaced_is_not_started() {
    let (mut chip, images) = (chip(), [1, 2].map(|fill| image(1, 900, fill)));
    let headers = images.each_ref().map(|image| signed(&stated(1, image)));
    let mut updater = updater(&chip, 0);
    update(&mut updater, &headers[0], &images[0]).expect("taken");
    let (header, older) = (headers[1], false);
    let begun = updater.carry_out(&Order::Begin { header, older });
    assert_eq!(begun.done, Ok(()));
    chip = updater.into_inner();
    assert_eq!(starts(&mut chip), Some(0));
    let mut updater = self::updater(&chip, 0);
    update(&mut updater, &headers[1], &images[1]).expect("taken");
    assert_eq!(starts(&mut updater.into_inner()), Some(1));
}

#[test]
fn what_is_wrong_is_refused_by_name_before_anything_is_erased() {
    let image = image(1, 900, 1);
    let good = stated(1, &image);
    let mut newer = signed(&good);
    newer[6] ^= 1;
    let mut other = [0xFF; HEADER_LEN];
    other[64..].copy_from_slice(&signed(&good)[64..]);
    let cases = [
        (newer, Refusal::Signature),
        (other, Refusal::Header),
        (
            signed(&Header {
                board: board("mocks").unwrap(),
                ..good
            }),
            Refusal::Board,
        ),
        (
            signed(&Header {
                version: [0, 0, 9],
                ..good
            }),
            Refusal::Older,
        ),
        (signed(&stated(0, &image)), Refusal::Slot),
        (
            signed(&Header {
                length: 1537,
                ..good
            }),
            Refusal::Length,
        ),
        (signed(&Header { length: 0, ..good }), Refusal::Length),
    ];
    let chip = chip();
    let mut updater = updater(&chip, 0);
    for (header, refusal) in cases {
        assert_eq!(update(&mut updater, &header, &image), Err(refusal));
        assert_eq!(updater.report().step, Step::Idle);
    }
    let finish = Order::Finish { faults: 0 };
    for order in [&finish, &piece(0, &image[..64])] {
        assert_eq!(updater.carry_out(order).done, Err(Refusal::NotBegun));
    }
    // an older one if it is asked for
    let begin = Order::Begin {
        header: signed(&Header {
            version: [0, 0, 9],
            ..good
        }),
        older: true,
    };
    assert_eq!(updater.carry_out(&begin).done, Ok(()));
    assert_eq!(
        updater.into_inner().work,
        0,
        "nothing was erased or written"
    );
    // every bit of a header is signed
    for bit in 0..HEADER_LEN * 8 {
        let mut changed = signed(&good);
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(!is_signed(&changed, &DEVELOPMENT_KEY), "bit {bit}");
    }
}

#[test]
fn pieces_in_order_and_resumed_or_refused() {
    let image = image(1, 900, 1);
    let header = signed(&stated(1, &image));
    let begin = Order::Begin {
        header,
        older: false,
    };
    let chip = chip();
    let mut updater = updater(&chip, 0);
    let mut order = |order: &Order| updater.carry_out(order).done;
    assert_eq!(order(&begin), Ok(()));
    assert_eq!(order(&piece(0, &image[..128])), Ok(()));
    assert_eq!(order(&piece(0, &image[..128])), Ok(()), "again");
    assert_eq!(
        order(&piece(256, &image[256..384])),
        Err(Refusal::Order(128)),
        "a gap"
    );
    assert_eq!(
        order(&piece(64, &image[64..192])),
        Err(Refusal::Order(128)),
        "half of it known"
    );
    assert_eq!(
        order(&piece(128, &image[128..150])),
        Err(Refusal::Order(128)),
        "not whole units"
    );
    assert_eq!(
        order(&Order::Finish { faults: 0 }),
        Err(Refusal::Order(128)),
        "truncated"
    );
    assert_eq!(order(&begin), Ok(()), "begun again, it goes on");
    assert_eq!(updater.report().received, 128);
    pieces(&mut updater, &image, 128).expect("the rest");
    let beyond = updater.carry_out(&piece(900, &[0; 64])).done;
    assert_eq!(beyond, Err(Refusal::Order(900)));
    for _ in 0..2 {
        let finish = Order::Finish { faults: 0 };
        assert_eq!(updater.carry_out(&finish).done, Ok(()));
    }
    assert!(holds(&updater.into_inner(), 1, &image));
}

#[test]
fn an_image_that_is_not_the_signed_one_is_never_started() {
    let mut chip = chip();
    let image = image(1, 900, 1);
    let mut other = image.clone();
    other[500] ^= 1;
    let mut updater = updater(&chip, 0);
    let header = signed(&stated(1, &image));
    assert_eq!(update(&mut updater, &header, &other), Err(Refusal::Digest));
    chip = updater.into_inner();
    assert_eq!(starts(&mut chip), Some(0));
    // flash that does not keep a byte
    chip.stuck = vec![3072 + 700];
    let mut updater = self::updater(&chip, 0);
    assert_eq!(update(&mut updater, &header, &image), Err(Refusal::Digest));
    // a record whose image was changed since
    chip = updater.into_inner();
    chip.stuck.clear();
    let mut updater = self::updater(&chip, 0);
    update(&mut updater, &header, &image).expect("good");
    chip = updater.into_inner();
    chip.bytes[3072 + 100] ^= 8;
    assert_eq!(starts(&mut chip), Some(0));
}

#[test]
fn an_image_outside_the_slots_takes_no_updates() {
    let chip = chip();
    let at = |runs| Updater::new(slots(&chip), NAME, &DEVELOPMENT_KEY, runs);
    assert!(at(PLACES.base).is_none());
    assert!(
        at(PLACES.address(1)).is_none(),
        "the loader would not come back to it"
    );
    assert!(at(PLACES.address(0)).is_some());
    let misplaced = Places {
        slots: [512, 2048],
        ..PLACES
    };
    assert!(Slots::new(chip.clone(), misplaced).is_none());
}

/// A signed header and its image.
type Sent = ([u8; HEADER_LEN], Vec<u8>);

/// A whole life: two updates, the second one rolled back and sent again. Power fails after `left`
/// bytes. Gives the chip, and whether power failed.
fn life(mut chip: Chip, images: &[Sent; 3], left: usize) -> (Chip, bool) {
    chip.left = left;
    let go = |chip: &mut Chip| -> Option<()> {
        for (n, confirms) in [(0, true), (1, false), (2, true)] {
            let runs = starts(chip)?;
            let (header, image) = &images[n];
            let mut updater = updater(chip, runs);
            let done = update(&mut updater, header, image);
            *chip = updater.into_inner();
            done.ok().filter(|()| chip.left > 0)?;
            let runs = starts(chip)?;
            if confirms {
                let mut updater = self::updater(chip, runs);
                let done = updater.carry_out(&Order::Confirm).done;
                *chip = updater.into_inner();
                done.ok()?;
            }
        }
        Some(())
    };
    let cut = go(&mut chip).is_none();
    (chip, cut)
}

/// Power fails at each byte of receiving, recording, marking, confirming and going back. Afterwards
/// a whole image starts, the store is as it was, and an update can be taken.
#[test]
fn power_may_fail_at_any_byte() {
    let sent = |slot, len, seed| -> Sent {
        let image = image(slot, len, seed);
        (signed(&stated(slot, &image)), image)
    };
    let images = [sent(1, 700, 1), sent(0, 900, 2), sent(0, 600, 3)];
    let flashed = image(0, 1400, 0);
    let whole = |chip: &Chip, slot| {
        let all = [&flashed]
            .into_iter()
            .chain(images.iter().map(|(_, image)| image));
        all.into_iter().any(|image| holds(chip, slot, image))
    };
    let (full, cut) = life(chip(), &images, usize::MAX);
    assert!(!cut && holds(&full, 0, &images[2].1));
    for (n, torn) in [0x00, 0xFF, 0x5A].into_iter().enumerate() {
        for left in (1..=full.work).filter(|left| (left + n) % 3 == 0) {
            let mut chip = chip();
            (chip.flash.torn, chip.checks) = (torn, n == 2);
            let (mut chip, cut) = life(chip, &images, left);
            assert!(cut, "{left}");
            chip.left = usize::MAX;
            let slot = starts(&mut chip).expect("something starts");
            assert!(whole(&chip, slot), "cut at {left}, torn {torn:#x}");
            assert!(chip.bytes[STORE].iter().all(|byte| *byte == 0x5C));
            if left % 97 != 0 {
                continue;
            }
            // on trial it must be confirmed first
            let mut updater = updater(&chip, slot);
            updater.carry_out(&Order::Confirm);
            let next = image(1 - slot, 800, 9);
            let done = update(&mut updater, &signed(&stated(1 - slot, &next)), &next);
            assert_eq!(done, Ok(()), "cut at {left}");
            chip = updater.into_inner();
            assert_eq!(starts(&mut chip), Some(1 - slot));
        }
    }
}

/// Pieces of 64 bytes are good for the flash of all boards.
#[test]
fn units_of_writing() {
    assert!(PIECE.is_multiple_of(Chip::READ_SIZE) && PIECE.is_multiple_of(32));
}
