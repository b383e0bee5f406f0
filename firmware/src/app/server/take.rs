//! Images, records and modes that are taken.

use super::{Renewal, Server};
use crate::app::flow::Flow;
use crate::app::phase::{Machine, Phase};
use crate::configuration::record::{self, Record};
use crate::control::{Alignment, Mode, Reason};
use crate::model::{IMAGES_LEN, NETS_LEN, Nets};

impl Server {
    /// Takes a piece that begins within what is there or directly after it: a piece may be sent
    /// again, but must not leave a gap.
    pub(super) fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Reason> {
        let offset = usize::try_from(offset).map_err(|_| Reason::Range)?;
        if offset > self.received.len() || offset + bytes.len() > IMAGES_LEN {
            return Err(Reason::Range);
        }
        self.received.truncate(offset);
        self.received
            .extend_from_slice(bytes)
            .map_err(|_| Reason::Range)
    }

    /// Uses the image received, both networks or none, between two samples. Like all functions here
    /// that hold networks it is not inlined: the stack then holds the largest of them, not all of
    /// them.
    #[inline(never)]
    pub(super) fn commit_image(&mut self, length: u32, flow: &mut Flow) -> Result<(), Reason> {
        let received = self.received.len();
        let whole = received == IMAGES_LEN || received == NETS_LEN;
        if usize::try_from(length) != Ok(received) || !whole {
            return Err(Reason::Range);
        }
        may_exchange(flow)?;
        let nets = Nets::from_images(&self.received).map_err(|_| Reason::Image)?;
        flow.set_nets(nets);
        Ok(())
    }

    /// Replaces the record in use by the received one, if all of it is good. The caller then
    /// restarts. Nothing else changes here, so that a refusal leaves everything as it was.
    ///
    /// Only in bypass, and not while a correction fades out: else the correction would jump.
    #[inline(never)]
    pub(super) fn commit_configuration(&mut self, length: u32, flow: &Flow) -> Result<(), Reason> {
        let bytes = self.received.as_slice();
        if usize::try_from(length) != Ok(bytes.len()) {
            return Err(Reason::Record);
        }
        if !bytes.is_empty() && bytes == self.record.as_slice() {
            return Ok(()); // asked again, since the answer was lost
        }
        if flow.session.alignment == Some(Alignment::Started) {
            return Err(Reason::Alignment);
        }
        if flow.session.mode != Mode::Bypass || flow.corrector.corrects() {
            return Err(Reason::Mode);
        }
        let configuration = record::decode(bytes)?;
        flow.config.hardware.check(&configuration.lines)?;
        configuration.bursts().map_err(Reason::Field)?;
        self.record = Record::from_slice(bytes).map_err(|_| Reason::Record)?;
        (self.renewal, self.stored) = (Renewal::Taken, false);
        Ok(())
    }
}

/// During the alignment no correction may change. Afterwards a fade covers the exchange of
/// networks.
pub(super) fn may_exchange(flow: &Flow) -> Result<(), Reason> {
    let aligned =
        flow.session.alignment == Some(Alignment::Finished) && flow.session.mode != Mode::Frozen;
    if flow.session.alignment.is_some() && !aligned {
        return Err(Reason::Alignment);
    }
    Ok(())
}

pub(super) fn set_mode(mode: Mode, flow: &mut Flow, machine: &mut Machine) -> Result<(), Reason> {
    if mode != Mode::Bypass && !flow.config.configured {
        return Err(Reason::NotConfigured);
    }
    if mode == Mode::Learn && !flow.learning.exists() {
        return Err(Reason::NotAvailable);
    }
    // asked again, since the answer was lost: nothing changes. In state Fault it is a new attempt.
    if mode == flow.session.mode && !matches!(machine.phase(), Phase::Fault(_)) {
        return Ok(());
    }
    // during an alignment a correction may be switched neither on nor off: either would be a jump
    if flow.session.alignment == Some(Alignment::Started) && mode != flow.session.mode {
        return Err(Reason::Alignment);
    }
    flow.set_mode(mode);
    match machine.phase() {
        Phase::Run(_) => machine.transition_to_run(mode),
        Phase::Fault(_) => {
            flow.forget();
            *machine = machine.restarted();
        }
        Phase::Start | Phase::Detect => {} // in force when the format is known
    }
    Ok(())
}
