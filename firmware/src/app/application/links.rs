//! The way back to the sensor, the command link, and the receiver.

use super::{App, PIECE};
use crate::app::flow::Flow;
use crate::app::phase::{Cause, Phase};
use crate::app::reverse::Notice;
use crate::app::server::Renewal;
use crate::control::Mode;
use crate::fix::Fix;
use crate::link::Line;
use crate::wire::ImuFormat;
use crate::wire::receiver::epoch::Arrival;

/// Bytes of the command link that have come and are not read yet.
#[derive(Debug)]
pub(super) struct UnreadBytes {
    bytes: [u8; PIECE],
    next: usize,
    end: usize,
}

impl UnreadBytes {
    pub const NOTHING: UnreadBytes = UnreadBytes {
        bytes: [0; PIECE],
        next: 0,
        end: 0,
    };

    /// Also where `end` cannot be, after an upset of memory.
    pub fn is_empty(&self) -> bool {
        self.next >= self.end || self.end > PIECE
    }

    fn byte(&mut self) -> Option<u8> {
        let left = self.bytes.get(self.next..self.end)?;
        self.next += usize::from(!left.is_empty());
        left.first().copied()
    }
}

impl App<'_> {
    /// Bytes from the navigation computer to the sensor. True: there may be more work.
    pub(super) fn back(
        &mut self,
        navigation: &mut impl Line,
        sensor: &mut impl Line,
        now: u64,
    ) -> bool {
        if navigation.is_idle() {
            return !self.reverse.rests(&self.flow) && self.reverse(&[], navigation, sensor, now);
        }
        let mut piece = [0; PIECE];
        let len = navigation.receive(&mut piece).unwrap_or(0);
        let bytes = piece.get(..len).unwrap_or_default();
        if len > 0 && sensor.send(bytes).is_err() {
            self.flow.health.counters.dropped.add(1);
        }
        let rests = bytes.is_empty() && self.reverse.rests(&self.flow);
        (!rests && self.reverse(bytes, navigation, sensor, now)) || len > 0
    }

    /// Serves the command link: at most one request. True: there may be more.
    ///
    /// The answer to an accepted configuration is sent in the next pass. Between the two the board
    /// reopens the lines, so a client that has the answer may send on them. No request is taken
    /// while one waits for a verdict.
    #[inline(never)]
    pub(super) fn command(&mut self, line: &mut impl Line, now: u64) -> bool {
        if self.commands.server.is_waiting() {
            self.commands.server.take_verdict(&mut self.flow);
            send(self.commands.server.answer(), line, &mut self.flow);
        }
        if self.commands.server.is_waiting() || self.commands.unread.is_empty() && line.is_idle() {
            return false;
        }
        if self.commands.unread.is_empty() {
            let len = line.receive(&mut self.commands.unread.bytes).unwrap_or(0);
            (self.commands.unread.next, self.commands.unread.end) = (0, len);
        }
        let more = !self.commands.unread.is_empty();
        while let Some(byte) = self.commands.unread.byte() {
            if let Some(packet) = self.commands.packets.push(byte) {
                // one that waits goes first
                send(self.commands.server.answer(), line, &mut self.flow);
                self.commands
                    .server
                    .serve(packet, &mut self.flow, &mut self.machine, now);
                if self.commands.server.renewal == Renewal::None {
                    send(self.commands.server.answer(), line, &mut self.flow);
                }
                break;
            }
        }
        more
    }

    /// Another configuration comes into use, and in the next pass its answer leaves.
    #[inline(never)]
    pub(super) fn renew(&mut self, navigation: &mut impl Line, command: &mut impl Line, now: u64) {
        if self.commands.server.renewal == Renewal::Taken {
            self.commands.server.renewal = Renewal::Begun;
            self.reconfigure(navigation, now);
        } else {
            self.commands.server.renewal = Renewal::None;
            send(self.commands.server.answer(), command, &mut self.flow);
        }
    }

    /// The receiver. True: something came.
    #[inline(never)]
    pub(super) fn gnss(&mut self, line: &mut impl Line, now: u64) -> bool {
        let mut piece = [0; PIECE];
        let len = line.receive(&mut piece).unwrap_or(0);
        let arrival = Arrival {
            us: now,
            sample: self.flow.sample(),
        };
        self.gnss
            .receiver
            .push(piece.get(..len).unwrap_or_default(), arrival);
        while self.solved() {}
        self.flow.receiver_status.format = self.gnss.receiver.format();
        len > 0
    }

    /// Takes a fix that is complete; false: there is none.
    #[inline(never)]
    fn solved(&mut self) -> bool {
        let Some(solution) = self.gnss.receiver.next_fix() else {
            return false;
        };
        self.flow.health.counters.fixes.add(1);
        let Some(mut fix) = solution.fix else {
            return true;
        };
        fix.waited = self.flow.sample().wrapping_sub(solution.arrival.sample);
        let configuration = self
            .flow
            .config
            .configuration
            .as_ref()
            .map(|configuration| &configuration.receiver);
        fix.age = (self.gnss.pulse).age(
            fix.time_ms,
            fix.arrived_us,
            self.link.sampled_us,
            configuration,
        );
        self.take_fix(fix);
        true
    }

    /// A fix that the receiver vouches for.
    pub(super) fn take_fix(&mut self, mut fix: Fix) {
        self.flow.health.counters.good_fixes.add(1);
        if let Some(heading) = &mut fix.heading {
            heading.angle -= self.flow.config.heading_offset();
        }
        self.flow.receiver_status.time_ms = Some(fix.time_ms);
        self.flow.receiver_status.age_us = fix.age.map(|age| (age * 1e6) as u32);
        self.flow.fix(&fix);
        self.gnss.fix = Some(fix);
    }

    /// Understands and answers requests to the sensor. True: they have changed the state.
    #[inline(never)]
    fn reverse(
        &mut self,
        bytes: &[u8],
        navigation: &mut impl Line,
        sensor: &mut impl Line,
        now: u64,
    ) -> bool {
        let phase = self.machine.phase();
        let stim300 = match phase {
            _ if self.is_at_spi() => false,
            Phase::Run(_) => self.link.framer.format() == ImuFormat::Stim300,
            _ => (self.flow.config.format).is_none_or(|format| format == ImuFormat::Stim300),
        };
        if !stim300 {
            return false;
        }
        let notice = self.reverse.watch(bytes, &mut self.flow, now);
        if notice == Some(Notice::Service) && phase != Phase::Fault(Cause::Network) {
            self.serve(navigation, now);
            return true;
        }
        let Phase::Run(mode) = phase else {
            self.reverse.give_up();
            return false;
        };
        self.reverse.answer(&mut self.flow, navigation, now);
        // only a sensor that sends frames: one that has just started reports it by itself, and in
        // service mode the question would be a command
        let sends = !self.flow.health.counters.frames.is_zero() && self.link.framer.is_aligned();
        if mode != Mode::Bypass && sends {
            self.reverse.ask(&self.flow, sensor, now);
        }
        false
    }
}

/// Sends an answer of the command link, if there is one.
#[inline(never)]
fn send(answer: &[u8], line: &mut impl Line, flow: &mut Flow) {
    if !answer.is_empty() && line.send(answer).is_err() {
        flow.health.counters.dropped.add(1);
    }
}
