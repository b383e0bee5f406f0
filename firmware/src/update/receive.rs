//! Takes an update into the free slot.

use super::FIRMWARE;
use super::header::{HEADER_LEN, Header, board, is_signed};
use super::slots::{Mark, PIECE, Slots};
use crate::control::update::{Refusal, Report, Running, Step};
use crate::wire::command::{MAX_CHUNK, fault};
use crate::wire::field::{head, take};
use core::convert::Infallible;
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;

/// Faults that bypass hides, in which the update is finished: the new firmware is not to blame.
const OF_MODE: u32 = fault::UNITS | fault::PASS_THROUGH;
/// An older firmware may find a newer store, and leave it alone.
const OF_OLDER: u32 = fault::STORE | fault::NOT_CONFIGURED;

/// A piece of an image.
pub type Piece = Vec<u8, MAX_CHUNK>;

/// An order of the frame path. Each may come twice.
#[derive(Debug, Clone)]
pub enum Order {
    /// An update begins. One in progress with the same header goes on.
    Begin {
        /// Its header.
        header: [u8; HEADER_LEN],
        /// It may be older than the firmware that runs.
        older: bool,
    },
    /// A piece of its image.
    Piece {
        /// Offset in the image: a multiple of 64.
        offset: u32,
        /// The piece: a multiple of 64 long, but for the last one.
        bytes: Piece,
    },
    /// The image is whole. `faults`: those of the device now.
    Finish {
        /// Bits of [`crate::wire::command::fault`].
        faults: u32,
    },
    /// The firmware that runs has proved itself.
    Confirm,
}

/// Result of an order.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    /// It was carried out, or why not.
    pub done: Result<(), Refusal>,
    /// State afterwards.
    pub report: Report,
}

/// Carries out orders, on any flash.
pub trait TakesUpdates {
    /// State of the updates.
    fn report(&self) -> &Report;

    /// Faults of the device before the update that is on trial.
    fn faults(&self) -> u32;

    /// Carries out an order. Erasing may take seconds.
    fn carry_out(&mut self, order: &Order) -> Outcome;
}

/// A board without slots. Its image has nothing that checks signatures.
impl TakesUpdates for Infallible {
    fn report(&self) -> &Report {
        match *self {}
    }

    fn faults(&self) -> u32 {
        match *self {}
    }

    fn carry_out(&mut self, _: &Order) -> Outcome {
        match *self {}
    }
}

/// Takes updates into a board's slots.
#[derive(Debug)]
pub struct Updater<F> {
    slots: Slots<F>,
    board: &'static str,
    signer: [u8; 32],
    /// The slot that runs.
    runs: usize,
    /// The update in progress.
    header: Option<([u8; HEADER_LEN], Header)>,
    /// Bytes of the slot that are erased and may be written to.
    erased: u32,
    /// Faults before the update that is on trial.
    faults: u32,
    report: Report,
}

impl<F: NorFlash> Updater<F> {
    /// For the image at the address `runs`, signed for the public key `signer`. `None`: it takes no
    /// updates, since it is in no slot, or in the second one without a record: the loader would not
    /// come back to it.
    pub fn new(
        mut slots: Slots<F>,
        board: &'static str,
        signer: &[u8; 32],
        runs: u32,
    ) -> Option<Updater<F>> {
        let runs = slots.places.slot_of(runs)?;
        let record = slots.record(runs);
        let running = match record {
            None if runs == 1 => return None,
            None => Running::Flashed,
            Some(record) if record.confirmed => Running::Confirmed,
            Some(_) => Running::Trial,
        };
        let free = 1 - runs;
        let other = slots.record(free);
        let failed = other.filter(|other| other.tried && !other.confirmed);
        let places = slots.places;
        Some(Updater {
            slots,
            board,
            signer: *signer,
            runs,
            header: None,
            erased: 0,
            faults: record.map_or(0, |record| record.faults),
            report: Report {
                running,
                slot: places.address(free),
                room: places.room(),
                signer: u64::from_be_bytes(take(signer, 0)),
                failed: failed.map(|failed| failed.header.version),
                ..Report::default()
            },
        })
    }

    /// The flash.
    pub fn into_inner(self) -> F {
        self.slots.into_inner()
    }

    fn begin(&mut self, bytes: &[u8; HEADER_LEN], older: bool) -> Result<(), Refusal> {
        if self.report.running == Running::Trial {
            return Err(Refusal::Trial);
        }
        let header = Header::parse(bytes).ok_or(Refusal::Header)?;
        if Some(header.board) != board(self.board) {
            return Err(Refusal::Board);
        }
        if !is_signed(bytes, &self.signer) {
            return Err(Refusal::Signature);
        }
        if header.address != self.report.slot {
            return Err(Refusal::Slot);
        }
        if header.length == 0 || header.length > self.report.room {
            return Err(Refusal::Length);
        }
        if header.version < FIRMWARE && !older {
            return Err(Refusal::Older);
        }
        if self.header.is_some_and(|(begun, _)| begun == *bytes) {
            return Ok(()); // it goes on
        }
        if self.report.step == Step::Ready {
            // what was ready is not to be started any more, not even if power fails here
            let free = 1 - self.runs;
            (self.slots.mark(free, Mark::Tried)).map_err(|_| Refusal::Flash)?;
        }
        self.header = Some((*bytes, header));
        self.erased = 0;
        self.report.step = Step::Receives;
        self.report.received = 0;
        self.report.digest = u64::from_be_bytes(take(&header.digest, 0));
        Ok(())
    }

    fn piece(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let (_, header) = self.header.ok_or(Refusal::NotBegun)?;
        let received = self.report.received;
        let end = offset.saturating_add(bytes.len() as u32);
        if end <= received {
            return Ok(()); // it comes again, since the answer was lost
        }
        let last = end == header.length;
        let whole = last || bytes.len().is_multiple_of(PIECE);
        if offset != received || end > header.length || !whole {
            return Err(Refusal::Order(received));
        }
        let from = self.slots.places.offset(1 - self.runs);
        while self.erased < end {
            self.erase(from).map_err(|_| Refusal::Flash)?;
        }
        for (piece, at) in bytes.chunks(PIECE).zip((from + offset..).step_by(PIECE)) {
            let mut padded = [0xFF; PIECE];
            for (place, byte) in padded.iter_mut().zip(piece) {
                *place = *byte;
            }
            (self.slots.flash.write(at, &padded)).map_err(|_| Refusal::Flash)?;
        }
        self.report.received = end;
        self.report.failed = None;
        Ok(())
    }

    /// Erases the next part of the free slot.
    fn erase(&mut self, from: u32) -> Result<(), F::Error> {
        let unit = F::ERASE_SIZE as u32;
        let begin = from + self.erased;
        self.slots.flash.erase(begin, begin + unit)?;
        self.erased += unit;
        Ok(())
    }

    fn finish(&mut self, faults: u32) -> Result<(), Refusal> {
        let (bytes, header) = self.header.ok_or(Refusal::NotBegun)?;
        if self.report.step == Step::Ready {
            return Ok(()); // asked again
        }
        if self.report.received != header.length {
            return Err(Refusal::Order(self.report.received));
        }
        let free = 1 - self.runs;
        let from = self.slots.places.offset(free);
        while self.erased < self.slots.places.len {
            self.erase(from).map_err(|_| Refusal::Flash)?;
        }
        if !self.slots.holds(free, &header) {
            self.give_up();
            return Err(Refusal::Digest);
        }
        let running = self.slots.record(self.runs);
        let number = running.map_or(0, |record| record.number).wrapping_add(1);
        let before = match header.version < FIRMWARE {
            true => faults | OF_MODE | OF_OLDER,
            false => faults | OF_MODE,
        };
        let written = self.slots.write_record(free, &bytes, [number, before]);
        let kept = self.slots.record(free).map(|record| record.header);
        if written.is_err() || kept != Some(header) {
            self.give_up();
            return Err(Refusal::Flash);
        }
        self.report.step = Step::Ready;
        Ok(())
    }

    /// The update must come from its beginning.
    fn give_up(&mut self) {
        self.header = None;
        self.report.step = Step::Idle;
        self.report.received = 0;
    }

    fn confirm(&mut self) -> Result<(), Refusal> {
        if self.report.running == Running::Trial {
            let marked = self.slots.mark(self.runs, Mark::Confirmed);
            marked.map_err(|_| Refusal::Flash)?;
            self.report.running = Running::Confirmed;
        }
        Ok(())
    }
}

impl<F: NorFlash> TakesUpdates for Updater<F> {
    fn report(&self) -> &Report {
        &self.report
    }

    fn faults(&self) -> u32 {
        self.faults
    }

    #[inline(never)] // its stack is free again afterwards
    fn carry_out(&mut self, order: &Order) -> Outcome {
        let done = match order {
            Order::Begin { header, older } => self.begin(header, *older),
            Order::Piece { offset, bytes } => self.piece(*offset, head(bytes, MAX_CHUNK)),
            Order::Finish { faults } => self.finish(*faults),
            Order::Confirm => self.confirm(),
        };
        if done == Err(Refusal::Flash) {
            self.give_up();
        }
        Outcome {
            done,
            report: self.report,
        }
    }
}
