//! Writes records, a piece at a time.

use super::content::{self, Layout};
use super::find::Header;
use super::{
    CRC_LEN, Content, Error, Life, Memory, Newer, PADDED_LEN, PIECE, Progress, Step, Store, VERSION,
};
use crate::model::IMAGES_LEN;
use crate::wire::checksum::Zlib;
use crate::wire::field::{head, put};
use embedded_storage::nor_flash::NorFlash;

/// Places of a slot that are tried, where those before did not keep what was written.
const TRIES: u32 = 4;

/// A record that is being written.
#[derive(Debug)]
pub(super) struct Written {
    at: u32,
    header: Header,
    layout: Layout,
    life: Life,
    /// Bytes written.
    done: usize,
    sum: Zlib,
}

impl<F: NorFlash> Store<F> {
    /// Carries out a step of storing.
    pub fn carry_out(&mut self, step: Step, content: &Content) -> Progress {
        let done = match step {
            Step::Save => {
                let appended = self.append(content).is_ok();
                return (appended || self.save(content).is_ok()).into();
            }
            Step::Renew => return self.renew(content).unwrap_or(Progress::Failed),
            Step::Begin => self.begin(content).map(|()| Progress::GoesOn),
            Step::GoOn => self.go_on(content),
        };
        done.unwrap_or(Progress::Failed)
    }

    /// Stores a content beside the newest good record, which stays until this is complete. Erases.
    /// Where the slot does not retain the written bytes, the record goes to its next position, and
    /// at last behind the newest record. Gives the generation.
    ///
    /// # Errors
    /// [`Error::Flash`], [`Error::Verify`] or [`Error::Newer`]; the newest good record is then
    /// still the previous one.
    pub fn save(&mut self, content: &Content) -> Result<u32, Error<F::Error>> {
        let from = self.other_slot().map_err(Error::Newer)?;
        let erased = self.flash.erase(from, from + self.slot_len);
        let [first, second] = &mut self.since.erased;
        let times = if from == 0 { first } else { second };
        *times = times.saturating_add(1);
        let other = erased
            .map_err(Error::Flash)
            .and_then(|()| self.write_from(from, content));
        match (other, self.newest) {
            (Err(error), Some((newest, header))) => {
                let behind = newest + header.padded() as u32;
                self.write_from(behind, content).map_err(|_| error)
            }
            (other, _) => other,
        }
    }

    /// Stores a content with a changed key: [`Step::Renew`].
    fn renew(&mut self, content: &Content) -> Result<Progress, Error<F::Error>> {
        let generation = self.save(content)?;
        Ok(match self.beside(generation, &content.key).other_key {
            true => Progress::GoesOn,
            false => Progress::Done,
        })
    }

    /// Writes a record to the first position of a slot, from `from` on, that retains it. Gives the
    /// generation.
    fn write_from(&mut self, from: u32, content: &Content) -> Result<u32, Error<F::Error>> {
        let len = self.layout(content).padded();
        let (mut next, mut last) = (from, Error::Verify);
        for _ in 0..TRIES {
            let Some(at) = self.room(from, next, len) else {
                break;
            };
            next = at + len as u32; // even what still looks blank was written to
            let generation = self.start_record(at, content);
            last = loop {
                match self.go_on(content) {
                    Ok(Progress::GoesOn) => {}
                    Ok(_) => return Ok(generation),
                    Err(error) => break error,
                }
            };
        }
        Err(last)
    }

    /// Stores a content behind the newest good record at once, without erasing.
    ///
    /// # Errors
    /// As [`Store::begin`] and [`Store::go_on`].
    fn append(&mut self, content: &Content) -> Result<(), Error<F::Error>> {
        self.begin(content)?;
        // what is damaged goes when its slot is erased
        let (_, newest) = self.newest.ok_or(Error::Full)?;
        if self.beside(newest.generation, &content.key).damaged {
            return Err(Error::Full);
        }
        while self.go_on(content)? == Progress::GoesOn {}
        Ok(())
    }

    /// Begins to store a content behind the newest good record, without erasing. What was begun
    /// before and is not done is given up. [`Store::go_on`] does the work.
    ///
    /// # Errors
    /// [`Error::Newer`] and [`Error::Full`].
    pub fn begin(&mut self, content: &Content) -> Result<(), Error<F::Error>> {
        self.written = None;
        if self.newest.is_none() {
            self.load().map_err(Error::Newer)?;
        }
        let (newest, header) = self.newest.ok_or(Error::Full)?;
        let padded = self.layout(content).padded();
        let behind = newest + header.padded() as u32;
        let at = self.room(newest, behind, padded).ok_or(Error::Full)?;
        self.start_record(at, content);
        Ok(())
    }

    /// Writes the next 64 bytes of what was begun, and reads them back. The content must be the
    /// same until it is done.
    ///
    /// # Errors
    /// [`Error::Flash`], [`Error::Verify`] or [`Error::NotBegun`]; the newest good record is then
    /// still the previous one.
    #[inline(never)]
    pub fn go_on(&mut self, content: &Content) -> Result<Progress, Error<F::Error>> {
        let mut written = self.written.take().ok_or(Error::NotBegun)?;
        let layout = written.layout;
        let mut piece = self.piece(&written, content).ok_or(Error::NotBegun)?;
        let end = layout.end();
        let covered = end.saturating_sub(written.done);
        written.sum.add(head(&piece, covered));
        if covered < PIECE {
            // the end of a piece may cut the checksum, so that it is needed twice
            let bytes = written.sum.clone().value().to_le_bytes();
            content::part(&mut piece, written.done, end, CRC_LEN, |start, place| {
                for (place, byte) in place.iter_mut().zip(bytes.iter().skip(start)) {
                    *place = *byte;
                }
            });
        }
        let at = written.at + written.done as u32;
        self.flash.write(at, &piece).map_err(Error::Flash)?;
        let mut back = [0; PIECE];
        self.flash.read(at, &mut back).map_err(Error::Flash)?;
        if back != piece {
            return Err(Error::Verify);
        }
        written.done += PIECE;
        if written.done < layout.padded() {
            self.written = Some(written);
            return Ok(Progress::GoesOn);
        }
        self.newest = Some((written.at, written.header));
        Ok(Progress::Done)
    }

    /// The piece that is written next, but for the checksum. `None`: the content is another one.
    fn piece(&mut self, written: &Written, content: &Content) -> Option<[u8; PIECE]> {
        let (layout, done) = (written.layout, written.done);
        if self.layout(content).end() != layout.end() {
            return None;
        }
        let mut piece = [0xFF; PIECE];
        if done == 0 {
            put(&mut piece, 0, written.header.bytes());
        }
        content::fill(content, &written.life, &layout, done, &mut piece);
        if let Memory::Same = content.memory
            && let Some((from, _)) = self.memory_place()
        {
            let (at, len) = (layout.memory_at(), layout.memory);
            content::part(&mut piece, done, at, len, |start, place| {
                // what cannot be read is noticed by nobody but the learner, which has a look too
                let _ = self.read_bytes(from + start as u32, place);
            });
        }
        Some(piece)
    }

    fn layout(&mut self, content: &Content) -> Layout {
        let same = self.memory_place().map_or(0, |(_, len)| len);
        Layout::of(content, same)
    }

    fn start_record(&mut self, at: u32, content: &Content) -> u32 {
        let generation = self.next;
        self.next = generation.wrapping_add(1);
        let layout = self.layout(content);
        let since = Life {
            minutes: content.minutes,
            ..self.since
        };
        self.written = Some(Written {
            life: self.before.unwrap_or_default().and(&since),
            at,
            header: Header {
                version: VERSION,
                generation,
                parts: [IMAGES_LEN, layout.rest()],
            },
            layout,
            done: 0,
            sum: Zlib::new(),
        });
        generation
    }

    /// Sees to it that there is room for [`Store::begin`], for half of the records that a slot
    /// can hold, since the next drive may be a long one, and that the newest record is of this
    /// version: if not, the newest record is saved once more, which erases.
    ///
    /// # Errors
    /// As [`Store::save`].
    #[inline(never)] // its copy of the record is gone from the stack afterwards
    pub fn make_room(&mut self) -> Result<(), Error<F::Error>> {
        let Some(stored) = self.load().map_err(Error::Newer)? else {
            return Ok(());
        };
        let Some((at, header)) = self.newest else {
            return Ok(());
        };
        let behind = at + header.padded() as u32;
        let spare = (self.places() as usize / 2).max(1) * PADDED_LEN;
        let full = self.room(at, behind, spare).is_none() && self.places() > 1;
        // an older firmware looks for records of its own length, and so finds the first of a slot
        if full || header.version < VERSION {
            self.save(&Content {
                nets: &stored.nets,
                record: &stored.record,
                memory: Memory::Same,
                unit: stored.unit.unwrap_or(0),
                minutes: 0,
                key: stored.key,
            })?;
        }
        Ok(())
    }

    /// Records of the greatest length that [`Store::begin`] still has room for, after
    /// [`Store::load`]; fewer if power failed while one was written.
    pub fn left(&self) -> u32 {
        let Some((at, header)) = self.newest else {
            return 0;
        };
        let end = self.start(usize::from(at >= self.slot_len)) + self.slot_len;
        end.saturating_sub(at + header.padded() as u32) / PADDED_LEN as u32
    }

    /// Address of the slot that the next record erases.
    #[inline(never)]
    fn other_slot(&mut self) -> Result<u32, Newer> {
        let newest = self.load()?;
        let first = newest.is_none_or(|newest| newest.at >= self.slot_len);
        let start = self.start(usize::from(!first));
        for at in (start..start + self.slot_len).step_by(PIECE) {
            match self.header(at) {
                Some(header) if header.version > VERSION => return Err(Newer(header.version)),
                _ => {}
            }
        }
        Ok(start)
    }

    /// Records of the greatest length that a slot has room for, at least 1.
    fn places(&self) -> u32 {
        self.slot_len / PADDED_LEN as u32
    }

    /// The first position from `next` on, in the slot of a record, at which so many bytes are not
    /// written.
    #[inline(never)]
    fn room(&mut self, record: u32, mut next: u32, len: usize) -> Option<u32> {
        let end = self.start(usize::from(record >= self.slot_len)) + self.slot_len;
        let mut blank = next;
        while next + len as u32 <= end {
            if blank >= next + len as u32 {
                return Some(next);
            }
            if !self.is_blank(blank) {
                next = blank + PIECE as u32;
            }
            blank += PIECE as u32;
        }
        None
    }

    fn is_blank(&mut self, at: u32) -> bool {
        let mut piece = [0; PIECE];
        self.flash.read(at, &mut piece).is_ok() && piece.iter().all(|&byte| byte == 0xFF)
    }
}
