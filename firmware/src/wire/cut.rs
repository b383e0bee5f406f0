//! Which formats can be cut through ([`crate::link::cut`]), and how their frames are changed then.
//!
//! A format can if its frames have one length a kind, no byte but values, checksum and marks
//! changes, and the checksum stands behind all of these and is a CRC-32. The interface control
//! document says of each format whether it does.

use super::novatel::Frame as Log;
use super::stim300::{Contents, Extra};
use super::{ImuFormat, Settings, kvh, novatel};
use crate::link::cut::{CHECKS, NOWHERE, Plan, Word};
use crate::remainder::Owed;

impl ImuFormat {
    /// Whether frames of this format can be cut through.
    pub const fn can_be_cut(self) -> bool {
        matches!(
            self,
            ImuFormat::Stim300 | ImuFormat::Kvh | ImuFormat::Novatel
        )
    }

    /// Plan for frames like this good one; `None`: they cannot be cut. `mark`: with the mark of our
    /// own fault.
    pub fn plan(self, frame: &[u8], mark: bool, settings: &Settings) -> Option<Plan> {
        let mut plan = match self {
            ImuFormat::Stim300 => stim300(frame, settings.stim300.family),
            ImuFormat::Kvh => kvh(frame, mark),
            ImuFormat::Novatel => novatel(frame, mark),
            _ => None,
        }?;
        plan.len = u8::try_from(frame.len()).ok()?;
        Some(plan)
    }
}

/// Gyros and accelerometers in the order in which a plan's values come, and back.
pub fn in_order<T: Copy>(word: Word, values: [T; 6]) -> [T; 6] {
    let [a, b, c, d, e, f] = values;
    match word {
        Word::I24 | Word::F32 => values,
        Word::I32 => [f, e, d, c, b, a],
    }
}

/// Corrections owed, in that order; zeros where nothing is corrected.
pub fn owed_in_order(word: Word, owed: Option<[Owed; 6]>) -> [Owed; 6] {
    in_order(word, owed.unwrap_or_default())
}

/// Positions of the check bytes in a frame, and their values.
fn checks(frame: &[u8], places: &[u8]) -> [(u8, u8); CHECKS] {
    let mut checks = [(NOWHERE, 0); CHECKS];
    for (check, at) in checks.iter_mut().zip(places) {
        *check = (
            *at,
            frame.get(usize::from(*at)).copied().unwrap_or_default(),
        );
    }
    checks
}

/// The identifier determines the layout.
fn stim300(frame: &[u8], family: Option<Extra>) -> Option<Plan> {
    let id = *frame.first()?;
    let contents = Contents::from_id(id)?;
    let mut sent = contents;
    if let Some(family) = family.filter(|family| ![contents.extra, *family].contains(&Extra::None))
    {
        sent.extra = family;
    }
    let far = |at| if contents.accel { at } else { NOWHERE };
    Some(Plan {
        word: Word::I24,
        zeros: (4 - (frame.len() % 4) as u8) % 4,
        at: [1, 4, 7, far(11), far(14), far(17)],
        checks: checks(frame, &[0]),
        first: sent.id() ^ id,
        ..Plan::NONE
    })
}

/// The header's last byte gives the format, and so where the status is.
fn kvh(frame: &[u8], mark: bool) -> Option<Plan> {
    let status = kvh::Frame::over(frame)?.layout().status() as u8;
    Some(Plan {
        word: Word::F32,
        at: [4, 8, 12, 16, 20, 24],
        checks: checks(frame, &[0, 1, 2, 3]),
        mark: if mark {
            (status, kvh::OWN_FAULT)
        } else {
            Plan::NONE.mark
        },
        ..Plan::NONE
    })
}

/// The header's lengths, the message, and the type of the IMU: on it depends what a count is worth.
fn novatel(frame: &[u8], mark: bool) -> Option<Plan> {
    let log = Log::over(frame)?.log();
    let payload = log.header_len() as u8;
    let values = payload + 16;
    let kind = if log.is_extended() {
        payload + 1
    } else {
        NOWHERE
    };
    let places: &[u8] = if payload == 28 {
        &[0, 1, 2, 3, 4, 5, 8, 9, kind]
    } else {
        &[0, 1, 2, 3, 4, 5, kind]
    };
    Some(Plan {
        word: Word::I32,
        at: [0, 4, 8, 12, 16, 20].map(|at| values + at),
        checks: checks(frame, places),
        mark: if mark && log.is_extended() {
            (payload, novatel::OWN_FAULT)
        } else {
            Plan::NONE.mark
        },
        ..Plan::NONE
    })
}
