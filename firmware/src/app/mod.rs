//! The whole flow in one pass: link -> wire -> sample -> compensator -> wire -> link.
//!
//! A board calls [`App::poll`] whenever an interrupt has moved a byte and at least once a millisecond. No hardware, no
//! waiting and nothing that can fail is in here.
//!
//! **Latency.** The correction in force is known before a frame arrives, so between its last byte in and its first byte out
//! there are one check, six subtractions and one change of the checksum, the same for all axes. Networks, counters, the
//! command link and the receiver come after the frame has left, and the last two only while no frame is arriving.
//!
//! **Holes.** Frames that are missing, damaged or called invalid are never made up. The networks do not step over a hole: the
//! block in progress is given up, the estimate in force is held until the next whole block.

mod config;
mod flow;
mod lines;
mod load;
pub mod phase;
mod reverse;
mod server;
mod setup;

pub use config::{Activation, Adis, Config, Kvh};
pub use lines::Lines;
pub use phase::Phase;

use crate::compensator::Block;
use crate::fix::Fix;
use crate::learn::{Learner, Report};
use crate::link::{Clock, Line, Lost};
use crate::model::Nets;
use crate::wire::command::{Counters, Packets, fault};
use crate::wire::framer::{Framer, Kind};
use crate::wire::ubx::Pvt;
use crate::wire::{Checked, Detector, Error, Format};
use flow::{Flow, count};
use phase::{Cause, Machine};
use reverse::Reverse;
use server::Server;

/// Bytes taken from a line in one pass.
const PIECE: usize = 64;

/// The command link and the receiver wait no longer than this for a pause between frames, microseconds.
pub const PATIENCE_US: u64 = 20_000;

/// The application.
#[derive(Debug)]
pub struct App<'m> {
    machine: Machine,
    framer: Framer,
    detector: Detector,
    flow: Flow<'m>,
    reverse: Reverse,
    packets: Packets,
    server: Server,
    receiver: Framer,
    fix: Option<Fix>,
    /// When the sensor's last byte came, microseconds.
    heard_us: u64,
    /// When the command link and the receiver last had their turn, microseconds.
    served_us: u64,
}

impl<'m> App<'m> {
    /// From its configuration; nothing happens before the first [`App::poll`].
    pub fn new(config: Config) -> App<'m> {
        App::with_learner(config, None)
    }

    /// The same with something that learns, in the mode of that name.
    pub fn with_learner(config: Config, learner: Option<&'m mut dyn Learner>) -> App<'m> {
        App {
            machine: Machine::new(),
            framer: Framer::new(config.format.unwrap_or(Format::Stim300)),
            detector: Detector::new(),
            flow: Flow::new(config, learner),
            reverse: Reverse::default(),
            packets: Packets::new(),
            server: Server::new(),
            receiver: Framer::new(Format::Ubx),
            fix: None,
            heard_us: 0,
            served_us: 0,
        }
    }

    /// Where the state machine is.
    pub fn phase(&self) -> Phase {
        self.machine.phase()
    }

    /// What was counted since power-on.
    pub fn counters(&self) -> Counters {
        server::counters(&self.flow, &self.machine)
    }

    /// What is wrong now: bits of [`fault`].
    pub fn faults(&self) -> u32 {
        server::faults(&self.flow, &self.machine)
    }

    /// The latest fix that the receiver vouches for.
    pub fn fix(&self) -> Option<&Fix> {
        self.fix.as_ref()
    }

    /// What the networks said of the latest block.
    pub fn block(&self) -> Option<&Block> {
        self.flow.block.as_ref()
    }

    /// What the learner tells.
    pub fn learning(&self) -> Report {
        self.flow.report()
    }

    /// The weights learnt; what was put off is done first.
    pub fn learnt(&mut self) -> Option<Nets> {
        self.flow.learnt().map(|(nets, _)| nets)
    }

    /// The networks in use.
    pub fn nets(&self) -> &Nets {
        &self.flow.config.nets
    }

    /// Weights that the board is to store now ([`crate::store`]), once each; it then tells [`App::stored`].
    pub fn to_store(&mut self) -> Option<Nets> {
        let wanted = core::mem::take(&mut self.flow.to_store);
        wanted.then_some(self.flow.config.nets)
    }

    /// Whether there is something [`App::to_store`].
    pub fn wants_to_store(&self) -> bool {
        self.flow.to_store
    }

    /// Whether the weights of [`App::to_store`] were stored.
    pub fn stored(&mut self, done: bool) {
        self.flow.flag(fault::STORE, !done);
    }

    /// A burst of an ADIS that the board has just fetched over SPI (`wire::adis::spi`), in place of the sensor's line: its
    /// corrected reply goes to `out` at once. Time and the other lines remain [`App::poll`]'s, which comes after it.
    ///
    /// # Errors
    /// What is wrong with the reply, which is then counted and not sent; [`Error::Content`] when no ADIS is
    /// configured.
    pub fn burst(
        &mut self,
        reply: &mut [u8],
        out: &mut impl Line,
        clock: &impl Clock,
    ) -> Result<(), Error> {
        let form = self.flow.config.adis.ok_or(Error::Content)?.form;
        self.heard_us = clock.now_us();
        self.flow.flag(fault::SILENT, false);
        if self.machine.phase() == Phase::Start {
            self.machine.transition_to_run(self.flow.mode);
        }
        if let Phase::Fault(_) = self.machine.phase() {
            self.raw(reply, out);
            return Ok(());
        }
        match Checked::burst(form, reply) {
            Ok(frame) => self.flow.frame(frame, out),
            Err(error) => {
                count(&mut self.flow.counters.bad_checksums, 1);
                self.flow.gap();
                return Err(error);
            }
        }
        self.after_frames(out);
        Ok(())
    }

    /// Bytes of the sensor without which the next pass finds no work on its line, at least 1: so many need not wake a board. Time and
    /// the other lines do.
    pub fn needs(&self) -> usize {
        match self.machine.phase() {
            Phase::Run(_) => self.framer.needs(),
            _ => 1,
        }
    }

    /// One pass. True: there may be more work, call again at once; false: sleep until the next interrupt.
    pub fn poll<S: Line, N: Line, C: Line, G: Line>(
        &mut self,
        lines: &mut Lines<S, N, C, G>,
        clock: &impl Clock,
    ) -> bool {
        let now = clock.now_us();
        self.flow.load.look(now, clock);
        if self.machine.phase() == Phase::Start {
            self.start(now);
        }
        let mut busy = false;
        let blocks = self.flow.counters.blocks;
        if lines.sensor.is_idle() {
            self.watch_silence(now);
        } else {
            busy = self.receive(&mut lines.sensor, &mut lines.navigation, now);
        }
        lines.navigation.poll();
        lines.sensor.poll();
        lines.command.poll();
        let waited = now.saturating_sub(self.served_us) >= PATIENCE_US;
        if self.framer.pending() == 0 || waited {
            self.served_us = now;
            busy |= self.back(&mut lines.navigation, &mut lines.sensor, now);
            busy |= !lines.command.is_idle() && self.command(&mut lines.command);
            busy |= !lines.gnss.is_idle() && self.gnss(&mut lines.gnss, now);
            // the end of a block is work enough for a pass
            busy |= blocks != self.flow.counters.blocks || self.flow.work();
        }
        busy
    }

    /// What the sensor has sent; whether there may be more.
    fn receive(&mut self, sensor: &mut impl Line, out: &mut impl Line, now: u64) -> bool {
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

    fn heard(&mut self, now: u64) {
        self.heard_us = now;
        self.flow.flag(fault::SILENT, false);
    }

    fn start(&mut self, now: u64) {
        self.heard_us = now;
        match (self.flow.config.format, self.flow.config.adis) {
            (_, Some(_)) => self.machine.transition_to_run(self.flow.mode),
            (Some(format), None) => self.run(format),
            (None, None) => self.detect(),
        }
    }

    fn detect(&mut self) {
        self.flow.forget();
        self.detector = Detector::new();
        self.machine.transition_to_detect();
    }

    /// The beginning of a frame whose rest will go through raw.
    fn pass_rest(&mut self, out: &mut impl Line) {
        let Some(rest) = self.framer.flush() else {
            return;
        };
        let counters = &mut self.flow.counters;
        match out.send(rest.bytes()) {
            Ok(()) => count(&mut counters.raw, rest.bytes().len() as u32),
            Err(_) => count(&mut counters.dropped, 1),
        }
    }

    fn run(&mut self, format: Format) {
        self.framer = Framer::new(format);
        self.flow.flag(fault::UNKNOWN_FORMAT, false);
        self.machine.transition_to_run(self.flow.mode);
    }

    /// Bytes of the sensor while its frames are not being corrected.
    fn sensor(&mut self, bytes: &[u8], out: &mut impl Line) {
        match self.machine.phase() {
            Phase::Detect => {
                // byte by byte: the frame that decides still goes through raw, the next one does not
                let found = bytes.iter().enumerate().find_map(|(at, &byte)| {
                    let format = self.detector.push(&[byte])?;
                    Some((at + 1, format))
                });
                let end = found.map_or(bytes.len(), |(at, _)| at);
                let (raw, rest) = bytes.split_at_checked(end).unwrap_or((bytes, &[]));
                self.raw(raw, out);
                if let Some((_, format)) = found {
                    self.run(format);
                    self.framer.push(rest); // all of it finds room: PIECE is less than LONGEST
                    self.frames(out);
                }
            }
            Phase::Run(_) | Phase::Fault(_) | Phase::Start => self.raw(bytes, out),
        }
    }

    /// As if nothing were here.
    fn raw(&mut self, bytes: &[u8], out: &mut impl Line) {
        let counters = &mut self.flow.counters;
        match out.send(bytes) {
            Ok(()) => count(&mut counters.raw, bytes.len() as u32),
            Err(_) => count(&mut counters.dropped, 1),
        }
    }

    /// What the framer now has.
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
                    if format == Format::Stim300 {
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
    fn after_frames(&mut self, out: &mut impl Line) {
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

    fn watch_silence(&mut self, now: u64) {
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

    /// From the navigation computer to the sensor.
    fn back(&mut self, navigation: &mut impl Line, sensor: &mut impl Line, now: u64) -> bool {
        if navigation.is_idle() {
            return self.reverse(&[], navigation, sensor, now);
        }
        let mut piece = [0; PIECE];
        let len = navigation.receive(&mut piece).unwrap_or(0);
        let bytes = piece.get(..len).unwrap_or_default();
        if len > 0 && sensor.send(bytes).is_err() {
            count(&mut self.flow.counters.dropped, 1);
        }
        self.reverse(bytes, navigation, sensor, now) || len > 0
    }

    #[inline(never)]
    fn command(&mut self, line: &mut impl Line) -> bool {
        let mut piece = [0; PIECE];
        let len = line.receive(&mut piece).unwrap_or(0);
        for &byte in piece.get(..len).unwrap_or_default() {
            if let Some(packet) = self.packets.push(byte)
                && let Some(answer) = self.server.serve(packet, &mut self.flow, &mut self.machine)
                && line.send(answer).is_err()
            {
                count(&mut self.flow.counters.dropped, 1);
            }
        }
        len > 0
    }

    #[inline(never)]
    fn gnss(&mut self, line: &mut impl Line, now: u64) -> bool {
        let mut piece = [0; PIECE];
        let len = line.receive(&mut piece).unwrap_or(0);
        self.receiver.push(piece.get(..len).unwrap_or_default());
        while let Some(event) = self.receiver.next_event() {
            if event.kind() != Kind::Frame {
                continue;
            }
            let Ok(pvt) = Pvt::parse(event.bytes()) else {
                continue;
            };
            count(&mut self.flow.counters.fixes, 1);
            if pvt.is_good() {
                count(&mut self.flow.counters.good_fixes, 1);
                let fix = pvt.to_fix(now);
                self.flow.fix(&fix);
                self.fix = Some(fix);
            }
        }
        len > 0
    }
}
