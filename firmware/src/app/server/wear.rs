//! Storing by command, so that no flood of requests wears the flash out.
//!
//! What is stored already is not stored again. Else a request takes one of [`RECORDS`] records,
//! and one more may follow every ten minutes. A record goes behind the one before it, and a sector
//! is erased when it is full. On an STM32F405 a sector of 128 KiB has room for 32 of the longest
//! records and may be erased 10 000 times (DS8626 table 48), so that the two of the store last for
//! 640 000 records: 12 years of a flood that never ends, or 6 with a learner that stores as often
//! as it may besides.

use super::Server;
use super::bucket::Bucket;
use crate::app::flow::Flow;
use crate::control::{Alignment, Mode, Reason};
use crate::model::{IMAGES_LEN, Nets};
use crate::wire::command::Request;
use crate::wire::command::key::{Digest, Key};

/// Records that are stored in a row.
const RECORDS: u16 = 16;
/// After each of these times one more record is stored, microseconds.
const RECORD_US: u64 = 600_000_000;
/// Looks at what would be stored at once, and one more after each, microseconds: a look takes a
/// digest of all of it.
const LOOKS: u16 = 8;
const LOOK_US: u64 = 250_000;
/// Bytes of an image that the digest takes at a time.
const PIECE: usize = 128;

/// Budget of records that may still be stored.
#[derive(Debug)]
pub(in crate::app) struct Wear {
    /// Digest of what the newest record holds; `None`: not known.
    stored: Option<[u8; 16]>,
    records: Bucket,
    looks: Bucket,
}

impl Wear {
    pub const fn new() -> Wear {
        Wear {
            stored: None,
            records: Bucket::new(RECORDS, RECORD_US),
            looks: Bucket::new(LOOKS, LOOK_US),
        }
    }

    /// The newest record holds this; `None`: that is not known. What mode learn stores is not
    /// looked at.
    pub fn holds(&mut self, digest: Option<[u8; 16]>) {
        self.stored = digest;
    }

    /// Whether another record may be stored now.
    ///
    /// # Errors
    /// [`Reason::Wait`]
    pub(super) fn may_record(&mut self, now_us: u64) -> Result<(), Reason> {
        let (records, looks) = (&mut self.records, &mut self.looks);
        records
            .wait(now_us)
            .or_else(|| looks.wait(now_us))
            .map_or(Ok(()), |ms| Err(Reason::Wait(ms)))
    }

    /// Records that may be stored now.
    pub(super) fn left(&mut self, now_us: u64) -> u16 {
        self.records.left(now_us)
    }
}

/// Digest of what is stored, but for what is remembered of the unit.
#[inline(never)]
pub(in crate::app) fn digest(nets: &Nets, record: &[u8], key: &Key) -> [u8; 16] {
    let mut digest = Digest::new();
    let mut at = 0;
    while at < IMAGES_LEN {
        let mut piece = [0; PIECE];
        nets.write_images(at, &mut piece);
        digest.add(&piece);
        at += PIECE;
    }
    digest.add(record);
    digest.add(&key.to_bytes());
    digest.value()
}

/// Whether a request is refused while a record is stored by command: what changes its content, so
/// that what is called stored is what is in use; what ends it; and what the processor's halts would
/// disturb. [`Request::StoreImage`] shows so when it has ended.
pub(super) fn waits_for_the_store(request: &Request) -> bool {
    match request {
        Request::SetMode(mode) => *mode != Mode::Bypass,
        Request::CommitImage { .. }
        | Request::CommitLearnt
        | Request::CommitConfiguration { .. }
        | Request::StoreImage
        | Request::Provision(_)
        | Request::FinishUpdate
        | Request::Restart => true,
        _ => false,
    }
}

impl Server {
    /// Whether a record may be stored now.
    pub(super) fn may_store(flow: &Flow) -> Result<(), Reason> {
        if !flow.config.store {
            return Err(Reason::Unsupported);
        }
        if let Some(version) = flow.config.store_faults.newer {
            return Err(Reason::Newer(version));
        }
        if flow.session.mode != Mode::Bypass || flow.session.alignment == Some(Alignment::Started) {
            return Err(Reason::Mode);
        }
        Ok(())
    }

    /// Makes the board store the content in use, unless it is stored already.
    pub(super) fn store(&mut self, flow: &mut Flow, now_us: u64) -> Result<(), Reason> {
        Self::may_store(flow)?;
        self.wear.looks.take(now_us).map_err(Reason::Wait)?;
        let nets = flow.pending.nets(&flow.config.nets);
        let digest = digest(nets, &self.record, &self.guard.key);
        if self.wear.stored == Some(digest) && !flow.pending.unit_memory.has_learnt() {
            return Ok(());
        }
        self.wear.records.take(now_us).map_err(Reason::Wait)?;
        flow.pending.commanded = true;
        flow.take_down_now();
        Ok(())
    }
}
