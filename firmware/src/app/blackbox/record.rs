//! Recording. Nothing here waits or fails; where there is no memory, nothing is done.

use super::key::{Key, estimate_bytes};
use super::memory::{Head, PAGE_LEN, PAGES};
use super::read::{BREAK, BURST, ENTRY_LEN, ESTIMATE, FAULTS, MORE, PIECE, PRIMER_AT, TIME};
use super::{AppState, Cause, Event, EventKind, LEN, Memory, State};
use crate::control::recording::{Order, Recording};
use crate::control::{Alignment, Reason};
use crate::wire::command::fault;
use crate::wire::field::{copy, put};

/// Bytes of one entry at most. A longer piece has several.
const LONGEST: usize = 128;
/// A page ends before an entry that needs more room than the last one by this.
const RESERVE: usize = 64;
/// After a fault so many more pages are begun.
const FOLLOWING: u8 = 2;
/// The bits that make it hold. The others describe the configuration, not events.
const CAUSES: u32 = !(fault::NOT_CONFIGURED | fault::WEIGHTS);
/// A fix within this time after another one is no event, ms.
const FIXES_MS: u32 = 10_000;

/// The recorder.
#[derive(Debug, Default)]
pub struct BlackBox<'m> {
    memory: Option<&'m mut Memory>,
    head: Head,
    /// Whether there is memory, and it does not hold.
    records: bool,
    /// The next frame begins a page.
    wants: bool,
    /// The page in progress takes no more entries.
    full: bool,
    /// Pages to come until it holds.
    follow: u8,
    /// Position of the next entry.
    page: usize,
    at: usize,
    /// Length of the first frame of the page to come, once it is there.
    primer: usize,
    /// Pages were begun since the start.
    begun: bool,
    /// Time of this pass and of the last entry, microseconds.
    now_us: u64,
    last_us: u64,
    /// Hash of all that has left, and bytes that have left since the last piece came.
    hash: u32,
    left: u16,
    /// Last noted state.
    noted: Noted,
    fix_ms: u32,
}

/// State that is compared in every pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::app) struct Noted {
    /// Fault bits.
    pub faults: u32,
    /// Number of changes of the correction.
    pub changes: u32,
    /// Mode and stage.
    pub mode: u8,
    pub stage: u8,
    pub alignment: Option<Alignment>,
}

impl<'m> BlackBox<'m> {
    /// Over this memory. What it holds from before a reset stays until it is released.
    pub(in crate::app) fn begin(&mut self, memory: &'m mut Memory) {
        let before = Head::parse(&memory.head);
        let survived = before.is_some_and(|head| head.pages > 0);
        self.head = before.unwrap_or_default();
        if before.is_none() {
            *memory = Memory::ZEROED;
        }
        self.memory = Some(memory);
        // no page is in progress until a frame begins one
        (self.records, self.wants, self.full) = (true, true, true);
        self.event(EventKind::Start, survived.into());
        if survived && self.head.state == State::Records {
            (self.head.cause, self.head.at_us) = (Cause::Reset, 0);
            self.head.faults = 0;
        }
        if survived {
            self.hold();
        } else {
            self.write_head();
        }
    }

    /// The report for the command link; `None`: there is no memory.
    pub(in crate::app) fn reported(&self) -> Option<Recording> {
        self.memory.as_ref()?;
        let Head {
            state,
            cause,
            faults,
            at_us,
            pages,
            ..
        } = self.head;
        Some(Recording {
            state,
            cause,
            faults,
            at_us,
            pages,
            len: LEN as u32,
        })
    }

    /// Bytes of the recording from `start` on, while it holds.
    pub(in crate::app) fn read(&self, start: usize, piece: &mut [u8]) -> Option<usize> {
        let memory = self.memory.as_ref()?;
        (self.head.state == State::Holds).then(|| memory.read(start, piece))
    }

    /// Hash of all that has left.
    pub fn hash(&self) -> u32 {
        self.hash
    }

    /// A request.
    pub(in crate::app) fn order(&mut self, order: Order) -> Result<(), Reason> {
        if self.memory.is_none() {
            return Err(Reason::Unsupported);
        }
        match order {
            Order::Hold => self.freeze(),
            Order::Release => self.release(),
        }
        Ok(())
    }

    /// Holds by request. The first cause stays.
    fn freeze(&mut self) {
        if self.head.state == State::Records {
            self.head.cause = Cause::Request;
            (self.head.faults, self.head.at_us) = (self.noted.faults, self.now_us);
        }
        if self.head.state != State::Holds {
            self.hold();
        }
    }

    /// Records again.
    fn release(&mut self) {
        if self.head.state == State::Records {
            return;
        }
        self.head.state = State::Records;
        (self.head.cause, self.head.faults, self.head.at_us) = (Cause::None, 0, 0);
        self.records = true;
        self.part();
        self.event(EventKind::Released, 0);
    }

    fn hold(&mut self) {
        self.head.state = State::Holds;
        self.records = false;
        self.write_head();
    }

    fn write_head(&mut self) {
        if let Some(memory) = &mut self.memory {
            memory.head = self.head.bytes();
        }
    }

    /// A pass begins.
    #[inline(always)]
    pub(in crate::app) fn pass(&mut self, now: u64) {
        self.now_us = now;
    }

    /// Start of the present pass, microseconds.
    pub(in crate::app) fn now_us(&self) -> u64 {
        self.now_us
    }

    /// Bytes of the sensor have come.
    #[inline(always)]
    pub(in crate::app) fn came(&mut self, bytes: &[u8]) {
        if self.records {
            self.piece(PIECE, bytes);
        }
    }

    /// A burst has come.
    pub(in crate::app) fn burst(&mut self, now: u64, bytes: &[u8]) {
        self.now_us = now;
        if self.records {
            self.piece(BURST, bytes);
        }
    }

    #[inline(never)]
    fn piece(&mut self, kind: u8, bytes: &[u8]) {
        if bytes.len() > LONGEST {
            return self.pieces(kind, bytes);
        }
        self.short(kind, bytes);
    }

    /// Writes bytes as one entry.
    #[inline(always)]
    fn short(&mut self, kind: u8, bytes: &[u8]) {
        let hash = (self.hash as u16).to_le_bytes();
        self.left = 0;
        self.entry(kind, &hash, bytes);
    }

    /// Writes bytes as several entries.
    #[cold]
    #[inline(never)]
    fn pieces(&mut self, kind: u8, bytes: &[u8]) {
        let (first, more) = bytes.split_at_checked(LONGEST).unwrap_or((bytes, &[]));
        self.short(kind, first);
        more.chunks(LONGEST).for_each(|more| self.short(MORE, more));
    }

    /// Bytes leave for the navigation computer, or would if there were room.
    #[inline(always)]
    pub(in crate::app) fn left(&mut self, bytes: &[u8]) {
        if self.records {
            self.hash = hashed(self.hash, bytes);
            self.left = self.left.saturating_add(bytes.len() as u16);
        }
    }

    /// Whether the next frame begins a page.
    #[inline(always)]
    pub(in crate::app) fn wants_frame(&self) -> bool {
        self.wants && self.records
    }

    /// A frame that has just left: the first of the next page, if it stays the last one.
    #[inline(never)]
    pub(in crate::app) fn frame(&mut self, bytes: &[u8]) {
        let next = self.next();
        let page = self.memory.as_mut().and_then(|m| m.pages.get_mut(next));
        let Some(page) = page else { return };
        put(page, 0, [0; 8]); // from now on it is none
        self.primer = 0;
        if let Some(place) = page.get_mut(PRIMER_AT..PRIMER_AT + bytes.len()) {
            for (place, byte) in place.iter_mut().zip(bytes) {
                *place = *byte;
            }
            self.primer = bytes.len();
        }
    }

    /// Whether [`BlackBox::begin_page`] is due, if the framer is empty.
    #[inline(always)]
    pub(in crate::app) fn has_frame(&self) -> bool {
        self.primer > 0 && self.records
    }

    /// Begins a page with its frame and the state after it.
    #[inline(never)]
    pub(in crate::app) fn begin_page(&mut self, key: &Key) {
        if self.head.state == State::Follows {
            if self.follow == 0 {
                return self.hold();
            }
            self.follow -= 1;
        }
        let next = self.next();
        self.head.pages = self.head.pages.wrapping_add(1);
        let number = self.head.pages;
        let primer = core::mem::take(&mut self.primer);
        if let Some(page) = self.memory.as_mut().and_then(|m| m.pages.get_mut(next)) {
            put(page, 8, (primer as u16).to_le_bytes());
            put(page, 10, [0; 2]);
            put(page, 12, key.bytes());
            put(page, 0, number.to_le_bytes());
        }
        (self.page, self.at) = (next, PRIMER_AT + primer);
        (self.wants, self.full, self.begun) = (false, false, true);
        (self.last_us, self.left) = (key.at_us, 0);
        self.write_used();
        self.write_head();
    }

    fn next(&self) -> usize {
        (self.page + 1) % PAGES
    }

    fn write_used(&mut self) {
        let memory = self.memory.as_mut();
        if let Some(page) = memory.and_then(|m| m.pages.get_mut(self.page)) {
            put_used(page, self.at);
        }
    }

    /// One entry: kind, length, time since the last one, then `first` and `bytes`.
    #[inline(always)]
    fn entry<const N: usize>(&mut self, kind: u8, first: &[u8; N], bytes: &[u8]) {
        let mut since = self.now_us.wrapping_sub(self.last_us);
        if since > 0xFFFF {
            self.time(since);
            since = 0;
        }
        self.last_us = self.now_us;
        let len = ENTRY_LEN + N + bytes.len();
        if self.full {
            return;
        }
        let memory = self.memory.as_mut();
        let Some(page) = memory.and_then(|m| m.pages.get_mut(self.page)) else {
            return self.end();
        };
        // the room behind it is that of the entry that ends the page
        let Some(place) = page.get_mut(self.at..self.at + len + ENTRY_LEN) else {
            return self.end();
        };
        let [low, high] = (since as u16).to_le_bytes();
        put(place, 0, [kind, (N + bytes.len()) as u8, low, high]);
        put(place, ENTRY_LEN, *first);
        copy(place.get_mut(ENTRY_LEN + N..len).unwrap_or_default(), bytes);
        self.at += len;
        self.wants |= PAGE_LEN - self.at.min(PAGE_LEN) < len + RESERVE;
        put_used(page, self.at);
    }

    /// The page in progress ends here: what comes has no room, or what leaves does not follow from
    /// its key any more.
    #[cold]
    #[inline(never)]
    fn end(&mut self) {
        (self.wants, self.full) = (true, true);
        let since = self.now_us.wrapping_sub(self.last_us);
        let [low, high] = u16::try_from(since).unwrap_or(u16::MAX).to_le_bytes();
        let page = self
            .memory
            .as_mut()
            .and_then(|m| m.pages.get_mut(self.page));
        if let Some(place) = page.and_then(|page| page.get_mut(self.at..self.at + ENTRY_LEN)) {
            put(place, 0, [BREAK, 0, low, high]);
            self.at += ENTRY_LEN;
            self.write_used();
        }
    }

    /// Notes a time that is longer than an entry can hold.
    #[cold]
    fn time(&mut self, since: u64) {
        self.last_us = self.now_us;
        let since = u32::try_from(since).unwrap_or(u32::MAX);
        self.entry(TIME, &since.to_le_bytes(), &[]);
    }

    /// The stage noted last.
    pub(in crate::app) fn stage(&self) -> u8 {
        self.noted.stage
    }

    /// Whether there is something to note.
    #[inline(always)]
    pub(in crate::app) fn differs(&self, now: &Noted) -> bool {
        self.records && *now != self.noted
    }

    /// The state after a pass, or where a correction has changed within one.
    #[cold]
    #[inline(never)]
    pub(in crate::app) fn note(&mut self, now: Noted, estimate: &[[f32; 3]; 2]) {
        let before = core::mem::replace(&mut self.noted, now);
        let left = self.left.to_le_bytes();
        let events = self.head.events;
        if now.changes != before.changes {
            self.entry(ESTIMATE, &left, &estimate_bytes(estimate));
        }
        if now.faults != before.faults {
            let [a, b, c, d] = now.faults.to_le_bytes();
            let [low, high] = left;
            self.entry(FAULTS, &[low, high, a, b, c, d], &[]);
            self.list(EventKind::Faults, now.faults);
        }
        if now.stage != before.stage {
            self.list(EventKind::Stage, now.stage.into());
        }
        if now.mode != before.mode {
            self.list(EventKind::Mode, now.mode.into());
        }
        if now.alignment != before.alignment {
            let number = match now.alignment {
                None => 0,
                Some(Alignment::Started) => 1,
                Some(Alignment::Finished) => 2,
            };
            self.list(EventKind::Alignment, number);
        }
        if (now.mode, now.stage) != (before.mode, before.stage) {
            self.part();
        }
        let risen = now.faults & !before.faults & CAUSES;
        let failed = now.stage != before.stage && now.stage >= AppState::FaultUnits as u8;
        if (risen != 0 || failed) && self.begun && self.head.state == State::Records {
            (self.head.state, self.head.cause) = (State::Follows, Cause::Fault);
            (self.head.faults, self.head.at_us) = (now.faults, self.now_us);
            self.follow = FOLLOWING;
            self.write_head();
        } else if self.head.events != events {
            self.write_head();
        }
    }

    /// The output no longer follows from the page's key. The next frame begins a page.
    #[cold]
    pub(in crate::app) fn part(&mut self) {
        if self.records {
            self.wants = true;
            if !self.full {
                self.end();
            }
        }
    }

    /// An event.
    #[cold]
    #[inline(never)]
    pub(in crate::app) fn event(&mut self, what: EventKind, value: u32) {
        if self.records {
            self.list(what, value);
            self.write_head();
        }
    }

    /// Puts an event on the list; the head is written afterwards.
    fn list(&mut self, what: EventKind, value: u32) {
        let event = Event {
            number: self.head.events,
            at_ms: (self.now_us / 1000) as u32,
            value,
            what,
        };
        if let Some(memory) = &mut self.memory {
            let place = self.head.events as usize % memory.events.len();
            if let Some(place) = memory.events.get_mut(place) {
                *place = event.bytes();
            }
        }
        self.head.events = self.head.events.wrapping_add(1);
    }

    /// A good fix has come.
    #[inline(never)]
    pub(in crate::app) fn fix(&mut self, time_ms: u32) {
        let now = (self.now_us / 1000) as u32;
        let late = now.wrapping_sub(core::mem::replace(&mut self.fix_ms, now)) >= FIXES_MS;
        if late {
            self.event(EventKind::Fix, time_ms);
        }
    }

    /// Sets the hash that a page begins with, for a replay.
    pub(in crate::app) fn set_hash(&mut self, hash: u32) {
        self.hash = hash;
    }

    /// Acts as [`BlackBox::left`] without memory, for a replay.
    pub(in crate::app) fn only_hashes(&mut self) {
        self.records = true;
        (self.wants, self.full) = (false, true);
    }
}

/// Notes in a page how many bytes of it are in use.
#[inline(always)]
fn put_used(page: &mut [u8; PAGE_LEN], used: usize) {
    let [low, high] = (used as u16).to_le_bytes();
    put(page, 4, [low, high, !low, !high]);
}

/// A hash that no single change of a bit leaves as it is: each word is exclusive-ored to the hash
/// turned by five bits.
fn hashed(hash: u32, bytes: &[u8]) -> u32 {
    let (words, rest) = bytes.as_chunks::<4>();
    let mut hash = words.iter().fold(hash, |hash, word| {
        hash.rotate_left(5) ^ u32::from_le_bytes(*word)
    });
    if !rest.is_empty() {
        let mut last = [0; 4];
        for (place, byte) in last.iter_mut().zip(rest) {
            *place = *byte;
        }
        hash = hash.rotate_left(5) ^ u32::from_le_bytes(last);
    }
    hash
}

// the longest frame and a piece after it have room
const _: () = assert!(PRIMER_AT + 256 + ENTRY_LEN + 2 + LONGEST + ENTRY_LEN < PAGE_LEN);
