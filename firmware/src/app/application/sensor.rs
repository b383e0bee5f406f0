//! Finds frames in the sensor's bytes, and makes the changes of state that they lead to.

use super::service::Service;
use super::{App, PIECE};
use crate::app::flow::Flow;
use crate::app::phase::{Cause, Phase};
use crate::app::reverse::Reverse;
use crate::link::cut::{Behind, Cut};
use crate::link::{Line, Lost};
use crate::wire::command::fault;
use crate::wire::field::head;
use crate::wire::framer::{Event, Kind, UNKNOWN_AFTER};
use crate::wire::{ImuFormat, Source};

/// A second, microseconds.
const SECOND_US: u64 = 1_000_000;
/// Bytes for so long without a frame are no known format, microseconds. The slowest sensor sends a
/// frame a second.
const FRAMELESS_US: u64 = 3 * SECOND_US;

impl App<'_> {
    /// Takes what the sensor has sent. True: there may be more.
    pub(super) fn receive(
        &mut self,
        sensor: &mut impl Line,
        out: &mut impl Line,
        now: u64,
    ) -> bool {
        let runs = matches!(self.machine.phase(), Phase::Run(_));
        let taken = if runs && !self.is_at_spi() {
            let blackbox = &mut self.flow.blackbox;
            let taken = self.link.framer.fill(PIECE, |room| {
                let taken = sensor.receive(room)?;
                blackbox.came(head(room, taken));
                Ok(taken)
            });
            self.link.taken = self.link.taken.wrapping_add(taken.unwrap_or(0) as u32);
            if matches!(taken, Ok(1..)) {
                self.heard(now);
                self.frames(out, now);
            }
            taken
        } else {
            self.receive_raw(sensor, out, now)
        };
        match taken {
            Ok(0) => self.watch_silence(now, out),
            Ok(_) => {}
            Err(_) => self.lost(),
        }
        taken != Ok(0) && sensor.has_more()
    }

    /// Data of the sensor was lost on its way: bytes, or a burst that the board could not hand to
    /// [`App::burst`].
    pub fn lost(&mut self) {
        self.flow.health.counters.lost.add(1);
        self.flow.gap();
    }

    #[cold]
    fn receive_raw(
        &mut self,
        sensor: &mut impl Line,
        out: &mut impl Line,
        now: u64,
    ) -> Result<usize, Lost> {
        let mut piece = [0; PIECE];
        let len = sensor.receive(&mut piece)?;
        let start = self.link.taken;
        self.link.taken = self.link.taken.wrapping_add(len as u32);
        self.flow.blackbox.came(head(&piece, len));
        if len > 0 {
            if !self.is_at_spi() {
                self.heard(now);
            }
            let bytes = piece.get(..len).unwrap_or_default();
            self.sensor((start, bytes), out, now);
        }
        Ok(len)
    }

    /// The sensor is not silent.
    #[inline(always)]
    pub(super) fn heard(&mut self, now: u64) {
        if self.flow.health.faults & fault::SILENT != 0 {
            self.heard_again(now);
        }
        self.link.heard_us = now;
    }

    #[cold]
    fn heard_again(&mut self, now: u64) {
        self.flow.health.flag(fault::SILENT, false);
        self.flow
            .heard_again(now.saturating_sub(self.link.heard_us));
        self.link.frameless_us = now;
    }

    /// Called once a second: bytes come, but no frame.
    #[cold]
    pub(super) fn look_for_frames(&mut self, now: u64) {
        let frames = self.flow.health.counters.frames;
        if core::mem::replace(&mut self.link.frames_seen, frames) != frames {
            self.link.frameless_us = now;
        }
        if now.saturating_sub(self.link.heard_us) >= SECOND_US {
            self.flow.rest();
        }
        let reads = !matches!(self.machine.phase(), Phase::Fault(_));
        let hears = reads && now.saturating_sub(self.link.heard_us) < SECOND_US;
        if hears && now.saturating_sub(self.link.frameless_us) >= FRAMELESS_US {
            self.flow.health.flag(fault::UNKNOWN_FORMAT, true);
        }
        self.look_for_settings();
    }

    /// The first pass.
    pub(super) fn start(&mut self, out: &mut impl Line, now: u64) {
        (self.link.heard_us, self.link.frameless_us) = (now, now);
        match self.flow.config.format {
            _ if self.is_at_spi() => {
                self.pass_rest(out);
                self.flow.health.flag(fault::UNKNOWN_FORMAT, false);
                self.machine.transition_to_run(self.flow.session.mode);
            }
            Some(format) => self.run(format),
            None => self.detect(),
        }
    }

    /// Whether the format is to be detected.
    fn detects(&self) -> bool {
        self.flow.config.format.is_none() && !self.is_at_spi()
    }

    /// Looks for the format, from the next byte on.
    pub(super) fn detect(&mut self) {
        self.flow.forget();
        self.link.detector.restart(&self.flow.config.sensor);
        self.link.undetected = 0;
        self.machine.transition_to_detect();
    }

    /// The sensor has been asked for its service mode: text instead of frames, and settings that
    /// may change. Frames that are still on their way do not bring Run back: see [`Service`]. A
    /// correction in force must not jump, so it goes on until the text comes: a sensor that does
    /// not obey sends frames of the same units.
    pub(super) fn serve(&mut self, out: &mut impl Line, now: u64) {
        self.link.service = Some(Service::new(now));
        if !self.flow.corrector.in_force() {
            self.pass_rest(out);
            self.detect();
        }
    }

    /// The sensor sends text after it was asked for its service mode.
    #[cold]
    fn obeyed(&mut self, out: &mut impl Line) {
        self.reverse.changes(&mut self.flow);
        self.pass_rest(out);
        self.detect();
        self.link.service = None;
    }

    /// The format is known.
    fn run(&mut self, format: ImuFormat) {
        let format = format.configured(&self.flow.config.sensor);
        if self.link.framer.format() != format {
            self.link.framer.restart(format);
        }
        self.flow.health.flag(fault::UNKNOWN_FORMAT, false);
        self.flow.prepare(Source::Stream(format));
        self.machine.transition_to_run(self.flow.session.mode);
    }

    /// A bit of the framer's memory has flipped: its pending bytes are lost. If that was a bit of
    /// its format, the configured format is used, or the format is detected again.
    #[cold]
    pub(super) fn reset_framer(&mut self) {
        let sensor = &self.flow.config.sensor;
        let configuration = self
            .flow
            .config
            .format
            .map(|format| format.configured(sensor));
        let format = self.link.framer.certain_format().or(configuration);
        self.link
            .framer
            .restart(format.unwrap_or(ImuFormat::Stim300));
        self.flow.gap();
        self.flow.health.mended();
        let runs = matches!(self.machine.phase(), Phase::Run(_));
        if format.is_none() && runs && !self.is_at_spi() {
            self.detect();
        }
    }

    /// Sends on the beginning of a frame whose rest will pass through raw.
    pub(super) fn pass_rest(&mut self, out: &mut impl Line) {
        let start = self.start_of_pending();
        if let Some(rest) = self.link.framer.flush() {
            let out = &mut whole(out, start, rest.bytes().len());
            pass(rest.bytes(), out, &mut self.flow);
            self.flow.health.counters.raw.add(rest.bytes().len() as u32);
        }
    }

    /// Bytes of the sensor, from a position of its stream on, while its frames are not being
    /// corrected.
    fn sensor(&mut self, (start, bytes): (u32, &[u8]), out: &mut impl Line, now: u64) {
        match self.machine.phase() {
            Phase::Detect => {
                // byte by byte: the frame that decides still passes raw, the next one does not
                let found = bytes.iter().enumerate().find_map(|(at, &byte)| {
                    let format = self.search(byte, now)?;
                    Some((at + 1, format))
                });
                let end = found.map_or(bytes.len(), |(at, _)| at);
                let (raw, rest) = bytes.split_at_checked(end).unwrap_or((bytes, &[]));
                self.raw(raw, &mut whole(out, start, raw.len()));
                if let Some((_, format)) = found {
                    self.run(format);
                    self.link.framer.push(rest); // it has room: PIECE is less than LONGEST
                    self.frames(out, now);
                }
            }
            Phase::Run(_) | Phase::Fault(_) | Phase::Start => {
                self.raw(bytes, &mut whole(out, start, bytes.len()));
            }
        }
    }

    /// One byte more to find the format by. Special datagrams of a STIM300 count already.
    fn search(&mut self, byte: u8, now: u64) -> Option<ImuFormat> {
        self.link.undetected = self.link.undetected.saturating_add(1);
        if self.link.undetected > UNKNOWN_AFTER {
            self.flow.health.flag(fault::UNKNOWN_FORMAT, true);
        }
        let (reverse, flow) = (&mut self.reverse, &mut self.flow);
        let found = self.link.detector.push(&[byte], |format, message| {
            if format == ImuFormat::Stim300 {
                reverse.special(message, flow, now);
            }
        });
        if let Some(service) = &mut self.link.service {
            if service.lasts(byte, now) {
                return None;
            }
            self.link.service = None;
            self.link.detector.restart(&self.flow.config.sensor);
            return None;
        }
        found
    }

    /// Sends bytes on unchanged.
    pub(super) fn raw(&mut self, bytes: &[u8], out: &mut Behind<impl Line>) {
        pass(bytes, out, &mut self.flow);
        self.flow.health.counters.raw.add(bytes.len() as u32);
    }

    /// Place in the sensor's stream of the framer's first byte.
    fn start_of_pending(&self) -> u32 {
        self.link
            .taken
            .wrapping_sub(self.link.framer.pending() as u32)
    }

    /// The frames that are now complete. All other bytes pass in order.
    #[inline(never)]
    fn frames(&mut self, out: &mut impl Line, now: u64) {
        let format = self.link.framer.format();
        self.flow.continuity.now_us = now;
        let mut obeyed = false;
        let mut next = self.start_of_pending();
        while let Some(mut event) = self.link.framer.next_event() {
            let bytes = event.bytes().len();
            let out = &mut Behind::of(out, next, bytes);
            next = next.wrapping_add(bytes as u32);
            if let Some(service) = &mut self.link.service {
                obeyed |= obeys(service, &event);
            }
            if event.kind() != Kind::Frame {
                between(&event, format, out, &mut self.flow, &mut self.reverse);
                continue;
            }
            match event.usual() {
                Some(frame) if !self.flow.cuts() => self.flow.usual(frame, out),
                _ => frame(event, next, out, &mut self.flow),
            }
            self.link.sampled_us = now;
            self.flow.health.flag(fault::UNKNOWN_FORMAT, false);
        }
        if obeyed {
            return self.obeyed(out);
        }
        self.after_frames(out);
    }

    /// Changes of state that frames have led to.
    #[inline(always)]
    pub(super) fn after_frames(&mut self, out: &mut impl Line) {
        if self.flow.may_change_state() {
            self.change_state(out);
        }
    }

    #[cold]
    #[inline(never)]
    fn change_state(&mut self, out: &mut impl Line) {
        if self.flow.health.faults & fault::UNKNOWN_FORMAT != 0 && self.detects() {
            self.pass_rest(out);
            return self.detect();
        }
        let cause = if self.flow.is_lost() {
            Cause::Units
        } else if self.flow.corrector.has_failed() {
            Cause::Network
        } else {
            return;
        };
        self.pass_rest(out);
        self.machine.transition_to_fault(cause);
    }

    /// Notices when the sensor falls silent. The beginning of a frame then passes unchanged.
    pub(super) fn watch_silence(&mut self, now: u64, out: &mut impl Line) {
        let silent =
            now.saturating_sub(self.link.heard_us) >= u64::from(self.flow.config.silence_us);
        if silent && self.flow.health.faults & fault::SILENT == 0 {
            self.flow.health.flag(fault::SILENT, true);
            self.flow.health.counters.silences.add(1);
            self.flow.silence();
            let start = self.start_of_pending();
            if let Some(rest) = self.link.framer.flush() {
                let out = &mut whole(out, start, rest.bytes().len());
                pass(rest.bytes(), out, &mut self.flow);
                self.flow
                    .health
                    .counters
                    .garbage
                    .add(rest.bytes().len() as u32);
            }
        }
    }
}

/// Whether these bytes show that the sensor has obeyed a request for its service mode.
#[cold]
#[inline(never)]
fn obeys(service: &mut Service, event: &Event<ImuFormat>) -> bool {
    let is_frame = event.kind() == Kind::Frame;
    let text = event.bytes().iter().filter(|_| !is_frame);
    // a byte that is no character stands for a frame
    let mut heard = text.copied().chain(is_frame.then_some(0));
    heard.any(|byte| service.obeyed(byte))
}

/// A frame, before this position of the stream.
#[inline(never)]
fn frame(event: Event<ImuFormat>, next: u32, out: &mut Behind<impl Line>, flow: &mut Flow) {
    if let Some(frame) = event.frame() {
        if flow.cuts() {
            flow.frame_and_plan(frame, next, out);
        } else {
            flow.frame(frame, out);
        }
    }
}

/// Bytes that are no frame. They pass in their place.
#[cold]
#[inline(never)]
fn between(
    event: &Event<ImuFormat>,
    format: ImuFormat,
    out: &mut Behind<impl Line>,
    flow: &mut Flow,
    reverse: &mut Reverse,
) {
    let bytes = event.bytes();
    let len = bytes.len();
    match event.kind() {
        Kind::Frame => {}
        Kind::Other => {
            let sent = out.send(bytes).is_ok();
            flow.blackbox.left(bytes);
            flow.health.counters.others.add(1);
            flow.health.counters.dropped.add(u32::from(!sent));
            if format == ImuFormat::Stim300 {
                let now = flow.continuity.now_us;
                reverse.special(bytes, flow, now);
            } else if format.starts_up(bytes) {
                flow.start_message();
            }
        }
        Kind::Long => {
            pass(bytes, out, flow);
            flow.health.counters.raw.add(len as u32);
        }
        Kind::BadChecksum => {
            pass(bytes, out, flow);
            flow.health.counters.bad_checksums.add(1);
            flow.unframed(len);
        }
        kind @ (Kind::Garbage | Kind::Unknown) => {
            pass(bytes, out, flow);
            flow.health.counters.garbage.add(len as u32);
            flow.unframed(len);
            if kind == Kind::Unknown {
                flow.health.flag(fault::UNKNOWN_FORMAT, true);
            }
        }
    }
}

/// The line for bytes from this position of the stream on that are the loop's: no frame is cut any
/// more, and what has left of them does not leave again.
fn whole<L: Line>(out: &mut L, start: u32, len: usize) -> Behind<'_, L> {
    out.cut(&mut Cut::end);
    Behind::of(out, start, len)
}

/// Sends bytes on that are no message, in pieces, so that little is lost where there is little
/// room.
fn pass(bytes: &[u8], out: &mut Behind<impl Line>, flow: &mut Flow) {
    for piece in bytes.chunks(PIECE) {
        let sent = out.send(piece).is_ok();
        flow.blackbox.left(piece);
        flow.health.counters.dropped.add(u32::from(!sent));
    }
}
