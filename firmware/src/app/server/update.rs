//! Updates of the firmware: requests that the board's main thread carries out, and the trial of a
//! firmware that has just been updated.

use super::Server;
use crate::app::flow::Flow;
use crate::control::update::{Refusal, Report, Running};
use crate::control::{Alignment, Mode, Reason};
use crate::update::{Order, Outcome, Piece};
use crate::wire::command::Request;

/// A firmware on trial must do well for so long without a break, microseconds.
const WELL_US: u64 = 10_000_000;
/// Messages of the sensor, or bytes without a format, that must have left meanwhile.
const PASSED: u64 = 100;
/// From the answer to the restart, microseconds: the answer leaves.
const LEAVES_US: u64 = 100_000;

/// The frame path's side of the updates.
#[derive(Debug, Default)]
pub(in crate::app) struct Updates {
    /// State by the main thread; `None`: the board takes no updates.
    report: Option<Report>,
    /// Faults of the device before the update that is on trial.
    before: u32,
    /// What the main thread has to do next.
    order: Option<Order>,
    /// The main thread has one.
    given: bool,
    /// What became of a request.
    verdict: Option<Result<(), Reason>>,
    /// Since when the device does well, and what had left until then.
    well: Option<(u64, u64)>,
    restart_us: Option<u64>,
}

impl Updates {
    /// The board takes updates.
    pub fn begin(&mut self, report: &Report, before: u32) {
        (self.report, self.before) = (Some(*report), before);
    }

    /// State of the updates.
    ///
    /// # Errors
    /// [`Reason::Unsupported`]
    pub fn report(&self) -> Result<&Report, Reason> {
        self.report.as_ref().ok_or(Reason::Unsupported)
    }

    pub fn is_on_trial(&self) -> bool {
        self.report
            .as_ref()
            .is_some_and(|report| report.running == Running::Trial)
    }

    /// What is on trial changes nothing of what is stored: the firmware before could not read it.
    ///
    /// # Errors
    /// [`Refusal::Trial`]
    pub fn may_store(&self) -> Result<(), Reason> {
        match self.is_on_trial() {
            true => Err(Reason::Update(Refusal::Trial)),
            false => Ok(()),
        }
    }

    /// The next order for the main thread.
    pub fn order(&mut self) -> Option<Order> {
        let order = self.order.take_if(|_| !self.given);
        self.given |= order.is_some();
        order
    }

    /// What became of it.
    pub fn done(&mut self, outcome: &Outcome) {
        self.given = false;
        self.report = Some(outcome.report);
        self.verdict = Some(outcome.done.map_err(Reason::Update));
    }

    /// What became of a request, once.
    pub fn verdict(&mut self) -> Option<Result<(), Reason>> {
        self.verdict.take()
    }

    fn is_busy(&self) -> bool {
        self.given || self.order.is_some()
    }

    /// Whether the board is to restart now.
    pub fn restarts(&self, now_us: u64) -> bool {
        self.restart_us.is_some_and(|at| now_us >= at)
    }

    /// To be called in every turn of a firmware on trial. It is confirmed when bytes have passed,
    /// and nothing was wrong that was not wrong before it. `left`: what has left so far.
    pub fn watch(&mut self, well: bool, faults: u32, left: u64, now_us: u64) {
        if self.is_busy() {
            return;
        }
        if !well || faults & !self.before != 0 {
            self.well = None;
            return;
        }
        let (since, before) = *self.well.get_or_insert((now_us, left));
        let passed = left.wrapping_sub(before) >= PASSED;
        if passed && now_us.saturating_sub(since) >= WELL_US {
            self.well = None;
            self.order = Some(Order::Confirm);
        }
    }
}

impl Server {
    /// A request for the main thread, whose verdict follows.
    pub(super) fn update(
        &mut self,
        request: &Request,
        flow: &Flow,
        faults: u32,
        now_us: u64,
    ) -> Result<(), Reason> {
        self.updates.report()?;
        if flow.session.mode != Mode::Bypass || flow.session.alignment == Some(Alignment::Started) {
            return Err(Reason::Mode);
        }
        if self.updates.is_busy() {
            return Err(Reason::Busy);
        }
        self.updates.verdict = None;
        self.updates.order = Some(match *request {
            Request::BeginUpdate { header, older } => {
                let header = header.try_into();
                let header = header.map_err(|_| Reason::Update(Refusal::Header))?;
                Order::Begin { header, older }
            }
            Request::WriteUpdate { offset, bytes } => {
                let bytes = Piece::from_slice(bytes).map_err(|_| Reason::Range)?;
                Order::Piece { offset, bytes }
            }
            Request::Restart => {
                self.updates.restart_us = Some(now_us.saturating_add(LEAVES_US));
                return Ok(());
            }
            _ => Order::Finish { faults },
        });
        Ok(())
    }

    /// Whether the answer to a request comes later.
    pub(super) fn is_asked(request: &Request) -> Option<Asks> {
        match request {
            Request::Reference(_) | Request::Heading(_) => Some(Asks::Learner),
            Request::BeginUpdate { .. } | Request::WriteUpdate { .. } | Request::FinishUpdate => {
                Some(Asks::Updates)
            }
            _ => None,
        }
    }
}

/// Whose verdict a request waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asks {
    Learner,
    Updates,
}
