//! Records that arrive at their own times, and a processor that takes time for its work.
//!
//! The clock of the application advances by the cost of its passes. Bytes that arrive during a pass
//! are handled by the next one. So coinciding work delays frames here as on a board. A learner at
//! its own priority gets the time that the passes leave.

use firmware::link::progress::Progress;
use heapless::Deque;

use super::{FIRST, Input, Replay};
use firmware::learn::exchange::Background;

/// Cycles that an instruction is taken to need. On a Cortex-M4F most need one, loads and branches
/// up to three, flash with an accelerator little more; measured on no chip.
pub const CYCLES: u64 = 2;
/// Instructions in 1000 ticks: SysTick counts with 168 MHz, an instruction is a nanosecond.
const PER_THOUSAND: u64 = 5952;
/// Cycles in a microsecond.
const MHZ: u64 = 168;

/// The processor's time, and the frames in progress.
#[derive(Debug, Default)]
pub(super) struct Timed {
    now_ns: u64,
    busy: bool,
    /// When the learner finishes its current work, if no pass interrupts it, ns.
    learns_until_ns: u64,
    /// Arrival times of the frames that have not left, ns, and their lengths.
    waiting: Deque<(u64, usize), 64>,
    /// Bytes of the oldest one that have left.
    left: usize,
}

fn ns_of(ticks: u32) -> u64 {
    u64::from(ticks) * PER_THOUSAND * CYCLES / MHZ
}

impl<S: Progress + Copy> Replay<'_, S> {
    /// Works until the record's time, then processes the record.
    pub(super) fn in_time(&mut self, input: Input, at_us: u32, bytes: &[u8]) {
        let at_ns = u64::from(at_us) * 1000;
        loop {
            if self.timed.busy && self.timed.now_ns < at_ns {
                self.timed_pass();
            } else if self.timed.learns_until_ns >= at_ns || !self.timed_learning() {
                break;
            }
        }
        self.timed.now_ns = self.timed.now_ns.max(at_ns);
        self.timed.busy = true;
        match input {
            Input::Sensor => {
                for byte in bytes {
                    self.wires.sensor.came(*byte);
                }
                self.cost.records += 1;
                let _ = self.timed.waiting.push_back((at_ns, bytes.len()));
            }
            Input::Gnss => self.lines.gnss.provide(bytes),
            Input::Command => self.lines.command.provide(bytes),
        }
    }

    /// Lets the learner carry out an order. False: none is pending.
    fn timed_learning(&mut self) -> bool {
        let ticks = self.wires.ticks;
        let begun = ticks();
        let turned = self.background.as_mut().is_some_and(Background::turn);
        let ns = ns_of(ticks().wrapping_sub(begun) & 0x00ff_ffff);
        let timed = &mut self.timed;
        timed.learns_until_ns = timed.learns_until_ns.max(timed.now_ns) + ns;
        timed.busy |= turned; // it may have answered
        turned
    }

    fn timed_pass(&mut self) {
        let ticks = self.wires.ticks;
        let since = |begun: u32, then: u32| then.wrapping_sub(begun) & 0x00ff_ffff;
        self.now.set(self.timed.now_ns / 1000);
        let begun = ticks();
        self.timed.busy = self.app.poll(&mut self.lines, &self.now);
        let pass = since(begun, ticks());
        if pass > self.cost.pass {
            (self.cost.pass, self.cost.pass_at) = (pass, self.cost.records);
        }
        let last_ns = self.timed.now_ns + ns_of(since(begun, self.lines.navigation.last));
        if self.timed.learns_until_ns > self.timed.now_ns {
            self.timed.learns_until_ns += ns_of(pass); // it was interrupted
        }
        self.timed.now_ns += ns_of(pass);
        while let Some(byte) = (self.wires.left)(self.wires.navigation) {
            let _ = self.sent.push(byte);
            self.timed.left += 1;
            let Some((at_ns, len)) = self.timed.waiting.front().copied() else {
                continue;
            };
            if self.timed.left == len {
                let late = u32::try_from(last_ns.saturating_sub(at_ns)).unwrap_or(u32::MAX);
                if late > self.cost.late && self.cost.records > FIRST {
                    (self.cost.late, self.cost.late_at) = (late, self.cost.records);
                }
                self.timed.waiting.pop_front();
                self.timed.left = 0;
            }
        }
    }

    /// Finishes the remaining work when the recording is over. Returns what is still sent.
    pub fn end(&mut self) -> &[u8] {
        self.sent.clear();
        while self.timed.busy || self.timed_learning() {
            self.timed_pass();
        }
        &self.sent
    }
}
