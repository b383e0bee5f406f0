//! From the sensor's bytes to its frames, and the changes of state that they lead to.

use super::{App, PIECE};
use crate::app::flow::count;
use crate::app::phase::{Cause, Phase};
use crate::link::{Line, Lost};
use crate::wire::ImuFormat;
use crate::wire::command::fault;
use crate::wire::framer::{Framer, Kind};

impl App<'_> {
    /// Takes what the sensor has sent. True: there may be more.
    pub(super) fn receive(
        &mut self,
        sensor: &mut impl Line,
        out: &mut impl Line,
        now: u64,
    ) -> bool {
        let taken = if let Phase::Run(_) = self.machine.phase() {
            let taken = self.framer.fill(PIECE, |room| sensor.receive(room));
            if matches!(taken, Ok(1..)) {
                self.heard(now);
                self.frames(out);
            }
            taken
        } else {
            self.receive_raw(sensor, out, now)
        };
        match taken {
            Ok(0) => self.watch_silence(now),
            Ok(_) => {}
            Err(_) => {
                count(&mut self.flow.counters.lost, 1);
                self.flow.gap();
            }
        }
        taken != Ok(0) && !sensor.is_idle()
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
        if len > 0 {
            self.heard(now);
            self.sensor(piece.get(..len).unwrap_or_default(), out);
        }
        Ok(len)
    }

    /// The sensor is not silent.
    fn heard(&mut self, now: u64) {
        self.heard_us = now;
        self.flow.flag(fault::SILENT, false);
    }

    /// The first pass.
    pub(super) fn start(&mut self, now: u64) {
        self.heard_us = now;
        match (self.flow.config.format, self.flow.config.sensor.adis) {
            (_, Some(_)) => self.machine.transition_to_run(self.flow.mode),
            (Some(format), None) => self.run(format),
            (None, None) => self.detect(),
        }
    }

    /// Looks for the format, from the next byte on.
    pub(super) fn detect(&mut self) {
        self.flow.forget();
        self.detector.restart(&self.flow.config.sensor);
        self.machine.transition_to_detect();
    }

    /// The format is known.
    fn run(&mut self, format: ImuFormat) {
        let format = format.told(&self.flow.config.sensor);
        if self.framer.format() != format {
            self.framer = Framer::new(format);
        }
        self.flow.flag(fault::UNKNOWN_FORMAT, false);
        self.machine.transition_to_run(self.flow.mode);
    }

    /// Sends on the beginning of a frame whose rest will pass through raw.
    pub(super) fn pass_rest(&mut self, out: &mut impl Line) {
        let Some(rest) = self.framer.flush() else {
            return;
        };
        let counters = &mut self.flow.counters;
        match out.send(rest.bytes()) {
            Ok(()) => count(&mut counters.raw, rest.bytes().len() as u32),
            Err(_) => count(&mut counters.dropped, 1),
        }
    }

    /// Bytes of the sensor while its frames are not being corrected.
    fn sensor(&mut self, bytes: &[u8], out: &mut impl Line) {
        match self.machine.phase() {
            Phase::Detect => {
                // byte by byte: the frame that decides still passes raw, the next one does not
                let found = bytes.iter().enumerate().find_map(|(at, &byte)| {
                    let format = self.detector.push(&[byte])?;
                    Some((at + 1, format))
                });
                let end = found.map_or(bytes.len(), |(at, _)| at);
                let (raw, rest) = bytes.split_at_checked(end).unwrap_or((bytes, &[]));
                self.raw(raw, out);
                if let Some((_, format)) = found {
                    self.run(format);
                    self.framer.push(rest); // it has room: PIECE is less than LONGEST
                    self.frames(out);
                }
            }
            Phase::Run(_) | Phase::Fault(_) | Phase::Start => self.raw(bytes, out),
        }
    }

    /// Sends bytes on unchanged.
    pub(super) fn raw(&mut self, bytes: &[u8], out: &mut impl Line) {
        let counters = &mut self.flow.counters;
        match out.send(bytes) {
            Ok(()) => count(&mut counters.raw, bytes.len() as u32),
            Err(_) => count(&mut counters.dropped, 1),
        }
    }

    /// The frames that are now complete.
    fn frames(&mut self, out: &mut impl Line) {
        let format = self.framer.format();
        while let Some(event) = self.framer.next_event() {
            match event.kind() {
                Kind::Frame => {
                    if let Some(frame) = event.frame() {
                        self.flow.frame(frame, out);
                        self.flow.flag(fault::UNKNOWN_FORMAT, false);
                    }
                }
                Kind::Other => {
                    let sent = out.send(event.bytes()).is_ok();
                    count(&mut self.flow.counters.others, 1);
                    count(&mut self.flow.counters.dropped, u32::from(!sent));
                    if format == ImuFormat::Stim300 {
                        self.reverse.special(event.bytes(), &mut self.flow);
                    }
                }
                Kind::BadChecksum => {
                    count(&mut self.flow.counters.bad_checksums, 1);
                    self.flow.gap();
                }
                kind @ (Kind::Garbage | Kind::Unknown) => {
                    count(&mut self.flow.counters.garbage, event.bytes().len() as u32);
                    self.flow.gap();
                    self.flow.flag(fault::UNKNOWN_FORMAT, kind == Kind::Unknown);
                }
            }
        }
        self.after_frames(out);
    }

    /// Changes of state that frames have led to.
    pub(super) fn after_frames(&mut self, out: &mut impl Line) {
        if self.flow.faults & fault::UNKNOWN_FORMAT != 0 && self.flow.config.format.is_none() {
            self.pass_rest(out);
            return self.detect();
        }
        let cause = if self.flow.is_lost() {
            Cause::Units
        } else if self.flow.has_failed() {
            Cause::Network
        } else {
            return;
        };
        self.pass_rest(out);
        self.machine.transition_to_fault(cause);
    }

    /// Notices when the sensor falls silent.
    pub(super) fn watch_silence(&mut self, now: u64) {
        let silent = now.saturating_sub(self.heard_us) >= u64::from(self.flow.config.silence_us);
        if silent && self.flow.faults & fault::SILENT == 0 {
            self.flow.flag(fault::SILENT, true);
            count(&mut self.flow.counters.silences, 1);
            self.flow.silence();
            if let Some(rest) = self.framer.flush() {
                count(&mut self.flow.counters.garbage, rest.bytes().len() as u32);
            }
        }
    }
}
