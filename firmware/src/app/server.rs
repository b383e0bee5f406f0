//! The command link: requests in, answers out.
//!
//! `guard` decides who may change something, `wear` what may be stored, both with `bucket`. `take`
//! and `reports` carry out the requests.

mod bucket;
mod guard;
mod reports;
mod take;
mod update;
pub(super) mod wear;

use super::flow::Flow;
use super::phase::Machine;
use crate::configuration::record::Record;
use crate::control::Reason;
use crate::model::IMAGES_LEN;
use crate::wire::command::key::Key;
use crate::wire::command::seal::{Opened, open};
use crate::wire::command::{
    MAX_CHUNK, MAX_PACKET, Protection, Provision, Request, Reset, Response, StoreReport, encode,
};
use guard::{Guard, Ticket, Verdict};
use heapless::Vec;
pub(super) use reports::{counters, faults};
use take::{may_exchange, set_mode};
use update::{Asks, Updates};
use wear::Wear;

/// Slots of the store.
const SLOTS: u8 = 2;
/// Time after power-on in which a device takes its first key, microseconds.
const FIRST_KEY_US: u64 = 60_000_000;

/// Serves the command link. Every request may come twice, because its answer was lost. The second
/// one has no further effect, but for the exceptions in `docs/ICD.md`, section 7, "A lost answer".
#[derive(Debug)]
pub(super) struct Server {
    /// The image or record being received, from its beginning without gaps.
    received: Vec<u8, IMAGES_LEN>,
    answer: [u8; MAX_PACKET],
    waiting: Waiting,
    waiting_request: Option<WaitingRequest>,
    /// The configuration record in use; empty without one.
    pub record: Record,
    /// Whether that record is the stored one.
    pub stored: bool,
    /// Report on the store at power-on.
    pub store_report: StoreReport,
    /// Whether the application must restart with that record.
    pub renewal: Renewal,
    pub guard: Guard,
    pub wear: Wear,
    pub updates: Updates,
}

/// An answer that has not been given yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Waiting {
    None,
    /// A plain answer: its length in [`Server::answer`].
    Plain(usize),
    /// [`Guard::answer`]
    Sealed,
}

/// Progress of a configuration that was accepted while the device runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Renewal {
    /// The configuration in use stays.
    None,
    /// The application must restart with it.
    Taken,
    /// The application has restarted, and the board opens its lines. Then the answer may leave.
    Begun,
}

/// A request that waits for a verdict.
#[derive(Debug, Clone, Copy)]
struct WaitingRequest {
    number: u8,
    ticket: Option<Ticket>,
    whose: Asks,
}

/// Initial state of the server.
#[derive(Debug)]
pub(super) struct InitialState {
    /// See [`Server::record`].
    pub record: Record,
    /// See [`Server::stored`].
    pub stored: bool,
    pub key: Key,
    /// See [`Server::store_report`].
    pub store_report: StoreReport,
    pub wear: Wear,
}

impl InitialState {
    /// A configuration record and nothing else.
    pub fn record(record: Record, stored: bool) -> InitialState {
        InitialState {
            record,
            stored,
            key: Key::Unprovisioned,
            store_report: StoreReport::default(),
            wear: Wear::new(),
        }
    }
}

impl Server {
    /// A server with the state at power-on.
    pub fn new(initial: InitialState) -> Server {
        Server {
            received: Vec::new(),
            answer: [0; MAX_PACKET],
            waiting: Waiting::None,
            waiting_request: None,
            record: initial.record,
            stored: initial.stored,
            store_report: initial.store_report,
            renewal: Renewal::None,
            guard: Guard::new(initial.key),
            wear: initial.wear,
            updates: Updates::default(),
        }
    }

    /// Carries out the request in a packet. [`Server::answer`] follows.
    pub fn serve(
        &mut self,
        packet: &mut [u8],
        flow: &mut Flow<'_>,
        machine: &mut Machine,
        now_us: u64,
    ) {
        let Ok(opened) = open::<Request>(packet) else {
            return;
        };
        let Opened {
            number, message, ..
        } = opened;
        let ticket = match self.admit(&opened, now_us) {
            Ok(Verdict::Plain) => None,
            Ok(Verdict::Fresh(ticket)) => Some(ticket),
            Ok(Verdict::Again) => {
                self.waiting = Waiting::Sealed;
                return;
            }
            Err(reason) => {
                self.answer_plainly(number, &Response::Refused(reason));
                return;
            }
        };
        let mut image = [0; MAX_CHUNK];
        let by = ticket.as_ref();
        let response = self.carry_out(&message, by, flow, machine, now_us, &mut image);
        if let (Some(whose), Response::Done) = (Server::is_asked(&message), response) {
            self.waiting_request = Some(WaitingRequest {
                number,
                ticket,
                whose,
            });
            return self.take_verdict(flow);
        }
        self.respond(number, by, &response);
    }

    fn respond(&mut self, number: u8, ticket: Option<&Ticket>, response: &Response) {
        match ticket {
            None => self.answer_plainly(number, response),
            Some(ticket) => {
                self.guard.seal(ticket, number, response);
                self.waiting = Waiting::Sealed;
            }
        }
    }

    /// A request waits for the verdict of the learner or of what takes updates, and others wait
    /// behind it.
    pub fn is_waiting(&self) -> bool {
        self.waiting_request.is_some()
    }

    /// Answers the request that waits for a verdict, if that is there.
    pub fn take_verdict(&mut self, flow: &mut Flow<'_>) {
        let verdict = match self
            .waiting_request
            .map(|waiting_request| waiting_request.whose)
        {
            Some(Asks::Learner) => flow.verdict(),
            Some(Asks::Updates) => self.updates.verdict(),
            None => None,
        };
        let Some(verdict) = verdict else {
            return;
        };
        if let Some(WaitingRequest { number, ticket, .. }) = self.waiting_request.take() {
            self.respond(number, ticket.as_ref(), &done(verdict));
        }
    }

    /// Whether the request is carried out at all.
    fn admit(&mut self, opened: &Opened<Request>, now_us: u64) -> Result<Verdict, Reason> {
        match &opened.seal {
            Some(seal) => self.guard.check(opened.coded, seal, now_us),
            None if opened.message.changes() && self.guard.needs_key() => Err(Reason::KeyNeeded),
            None => Ok(Verdict::Plain),
        }
    }

    #[inline(never)]
    fn answer_plainly(&mut self, number: u8, response: &Response) {
        let answer = encode(number, response, &mut self.answer);
        self.waiting = answer.map_or(Waiting::None, |answer| Waiting::Plain(answer.len()));
    }

    /// The answer to the last request, once; empty if there is none.
    pub fn answer(&mut self) -> &[u8] {
        match core::mem::replace(&mut self.waiting, Waiting::None) {
            Waiting::None => &[],
            Waiting::Plain(len) => self.answer.get(..len).unwrap_or_default(),
            Waiting::Sealed => self.guard.answer(),
        }
    }

    fn carry_out<'b>(
        &mut self,
        request: &Request,
        ticket: Option<&Ticket>,
        flow: &mut Flow,
        machine: &mut Machine,
        now_us: u64,
        buffer: &'b mut [u8; MAX_CHUNK],
    ) -> Response<'b> {
        if flow.pending.commanded && wear::waits_for_the_store(request) {
            return Response::Refused(Reason::Busy);
        }
        let done = match *request {
            Request::GetVersion => return Response::Version(reports::VERSION),
            Request::GetHealth => return Response::Health(reports::health(flow, machine)),
            Request::GetCounters => return Response::Counters(counters(flow, machine)),
            Request::ReadImage { offset, length } => {
                return reports::read_image(&flow.config.nets, offset, length, buffer);
            }
            Request::SetMode(mode) => set_mode(mode, flow, machine),
            Request::WriteImage { offset, bytes } => self.write(offset, bytes),
            Request::CommitImage { length } => self.commit_image(length, flow),
            Request::Reference(window) => flow.reference(&window),
            Request::GetEstimate => return Response::Estimate(flow.estimate()),
            Request::WriteConfiguration { offset, bytes } => self.write(offset, bytes),
            Request::CommitConfiguration { length } => self.commit_configuration(length, flow),
            Request::ReadConfiguration { offset, length } => {
                return reports::read_record(&self.record, offset, length, buffer);
            }
            Request::GetAntenna => match reports::antenna(flow) {
                Some(antenna) => return Response::Antenna(antenna),
                None => Err(Reason::NotAvailable),
            },
            Request::GetSolution => match reports::solution(flow) {
                Some(solution) => return Response::Solution(solution),
                None => Err(Reason::NotAvailable),
            },
            Request::GetTrials => match reports::trials(flow) {
                Some(trials) => return Response::Trials(trials),
                None => Err(Reason::NotAvailable),
            },
            Request::GetProgress => match reports::progress(flow) {
                Some(progress) => return Response::Progress(progress),
                None => Err(Reason::NotAvailable),
            },
            Request::GetTimes => return Response::Times(flow.clock.times(now_us)),
            Request::GetBoard => return Response::Board(self.board(flow)),
            Request::GetReceiver => return Response::Receiver(flow.receiver_status),
            Request::GetStore => return Response::Kept(self.store_report),
            Request::GetReset => match flow.config.hardware.reset {
                Some(reset) => {
                    return Response::Reset(Reset {
                        uptime_ms: (flow.blackbox.now_us() / 1000) as u32,
                        ..reset
                    });
                }
                None => Err(Reason::NotAvailable),
            },
            Request::GetMemory => return Response::Remembered(flow.remembered()),
            Request::GetRecording => match flow.blackbox.reported() {
                Some(recording) => return Response::Recording(recording),
                None => Err(Reason::Unsupported),
            },
            Request::Record(order) => flow.blackbox.order(order),
            Request::ReadRecording { offset, length } => {
                return reports::read_recording(&flow.blackbox, offset, length, buffer);
            }
            Request::ReadLearnt { offset, length } => {
                return reports::read_learnt(flow, offset, length, buffer);
            }
            Request::GetSecurity => return Response::Security(self.security(now_us)),
            Request::GetChallenge => match self.guard.challenge(now_us) {
                Ok(challenge) => return Response::Challenge(challenge),
                Err(reason) => Err(reason),
            },
            Request::Provision(with) => self.provision(&with, ticket, flow, now_us),
            Request::CommitLearnt => may_exchange(flow).and_then(|()| flow.commit_learnt()),
            Request::Heading(heading) => flow.heading(heading),
            Request::WheelSpeed(speed) => flow.wheel_speed(speed),
            Request::StoreImage => {
                (self.updates.may_store()).and_then(|()| self.store(flow, now_us))
            }
            Request::GetUpdate => match self.updates.report() {
                Ok(report) => return Response::Update(*report),
                Err(reason) => Err(reason),
            },
            Request::BeginUpdate { .. }
            | Request::WriteUpdate { .. }
            | Request::FinishUpdate
            | Request::Restart => self.update(request, flow, faults(flow, machine), now_us),
            Request::Alignment(alignment) => {
                flow.align(alignment);
                Ok(())
            }
        };
        self::done(done)
    }

    /// Takes another key, which the board stores at once with what is in use. A device without one
    /// takes its first key for a minute after power-on: later anybody at the command link could
    /// lock its owner out. No record from before is left: else a device whose newest record is
    /// damaged would go back to another key or none.
    fn provision(
        &mut self,
        with: &Provision,
        ticket: Option<&Ticket>,
        flow: &mut Flow,
        now_us: u64,
    ) -> Result<(), Reason> {
        let first = self.guard.protection() != Protection::Keyed;
        let reset = flow.config.hardware.reset.as_ref();
        if first && (now_us > FIRST_KEY_US || reset.is_some_and(Reset::is_by_software)) {
            return Err(Reason::TooLate);
        }
        Self::may_store(flow)?;
        self.updates.may_store()?;
        self.wear.may_record(now_us)?;
        self.guard.provision(with, ticket)?;
        self.store(flow, now_us)?;
        flow.pending.renewals = if flow.pending.commanded { SLOTS } else { 0 };
        Ok(())
    }
}

fn done(result: Result<(), Reason>) -> Response<'static> {
    match result {
        Ok(()) => Response::Done,
        Err(reason) => Response::Refused(reason),
    }
}
