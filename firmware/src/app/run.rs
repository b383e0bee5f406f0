//! The run loop of every board: one turn of the frame path ([`turn`]), and the main thread
//! ([`MainThread`]), which the frame path interrupts.

use super::job::{Gives, Job, Stores};
use super::{App, GivesUpdates, Lines, UpdatesThread};
use crate::configuration::SerialLines;
use crate::learn::exchange::Background;
use crate::link::{Clock, Line};
use crate::store::{Progress, Store};
use crate::wire::adis::spi::LONGEST;
use crate::wire::adis::{DetectedSensor, Rate};
use crate::wire::command::LoopPhase;
use embedded_storage::nor_flash::NorFlash;

/// A board as the frame path sees it. What a board does not have keeps its default.
pub trait Board {
    /// The sensor's line.
    type Sensor: Line;
    /// The navigation computer's line.
    type Navigation: Line;
    /// The command link.
    type Command: Line;
    /// The receiver's line.
    type Gnss: Line;
    /// Time since start.
    type Time: Clock;

    /// The lines, and the time.
    #[expect(clippy::type_complexity, reason = "four lines")]
    fn lines(
        &mut self,
    ) -> (
        &mut Lines<Self::Sensor, Self::Navigation, Self::Command, Self::Gnss>,
        &Self::Time,
    );

    /// Reopens the lines with these settings. The command link goes on.
    fn open(&mut self, lines: &SerialLines);

    /// The turn is over. The watchdog is fed where `unhealthy` is 0, bits of
    /// [`unwell`](crate::wire::command::unwell). `erases`: a record is stored that may have halted
    /// the processor for long.
    fn turned(&mut self, unhealthy: u8, erases: bool);

    /// The frame path begins this phase, for the record of a crash.
    fn during(&mut self, _: LoopPhase) {}

    /// A new burst of the ADIS at the SPI.
    fn burst<'f>(&mut self, _: &'f mut [u8; LONGEST]) -> Option<&'f mut [u8]> {
        None
    }

    /// Whether a burst was lost; true once for each.
    fn has_lost(&mut self) -> bool {
        false
    }

    /// Looks for an ADIS from time to time, until one is found, and sets it to the rate that is
    /// asked for.
    fn look_for_adis(&mut self, _: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor> {
        None
    }

    /// The ADIS is looked for again, and set up again.
    fn forget_adis(&mut self) {}

    /// Whether so many bytes of the sensor are here already; else an interrupt comes with the last
    /// of them.
    fn has(&mut self, _bytes: usize) -> bool {
        false
    }

    /// When the receiver's time pulse rose, if it did since the last turn, microseconds.
    fn pulse(&mut self) -> Option<u64> {
        None
    }

    /// The queue to what takes updates, where the board has slots.
    fn updates(&mut self) -> Option<&mut GivesUpdates<'static>> {
        None
    }

    /// Restarts, as was asked for.
    fn restart(&mut self) {}

    /// A job that may halt the processor for long was given to the main thread.
    fn long_work(&mut self) {}

    /// Whether the supply is too low for writing flash, and how often the navigation line was
    /// reopened since it did not send.
    fn state(&self) -> (bool, u16) {
        (false, 0)
    }
}

/// One turn of the frame path. True: there may be more to do, call again at once; false: wait for
/// the next interrupt, but at most one millisecond. `gives`: the queue to the store, if the board
/// has one.
pub fn turn<B: Board>(
    app: &mut App,
    board: &mut B,
    gives: Option<&mut Gives>,
    frame: &mut [u8; LONGEST],
) -> bool {
    take_burst(app, board, frame);
    if let Some(at_us) = board.pulse() {
        app.pulse(at_us);
    }
    board.during(LoopPhase::Poll);
    let (lines, time) = board.lines();
    let busy = app.poll(lines, time);
    if let Some(lines) = app.to_open() {
        board.during(LoopPhase::Open);
        board.open(&lines);
    }
    board.during(LoopPhase::Look);
    let halts = app.may_halt();
    if gives.is_some_and(|gives| gives.turn(app)) && halts {
        board.long_work();
    }
    if app.must_detect_again() {
        board.forget_adis();
    }
    if let Some(found) = board.look_for_adis(|| app.burst_rate()) {
        app.detected(&found);
    }
    let (supply_low, reopened) = board.state();
    app.board_is(supply_low, reopened);
    board.during(LoopPhase::Sleep);
    let now_us = board.lines().1.now_us();
    let unhealthy = app.unwell(now_us);
    board.turned(unhealthy, halts && app.is_storing());
    if let Some(updates) = board.updates() {
        updates.turn(app);
        app.watch_trial(unhealthy, now_us);
        if app.restarts(now_us) {
            board.restart();
        }
    }
    busy || board.has(app.needs())
}

fn take_burst<B: Board>(app: &mut App, board: &mut B, frame: &mut [u8; LONGEST]) {
    board.during(LoopPhase::Burst);
    if let Some(reply) = board.burst(frame) {
        let (lines, time) = board.lines();
        // an error has been counted
        let _ = app.burst(reply, &mut lines.navigation, time);
    }
    while board.has_lost() {
        app.lost();
    }
}

/// A store on any flash.
pub trait CarriesOut {
    /// Carries out a step of a job.
    fn carry_out(&mut self, job: &Job, background: Option<&Background>) -> Progress;
}

impl<F: NorFlash> CarriesOut for Store<F> {
    /// Not inlined, so that its stack is free again afterwards.
    #[inline(never)]
    fn carry_out(&mut self, job: &Job, background: Option<&Background>) -> Progress {
        let content = job.content(background.map(Background::learner));
        Store::carry_out(self, job.step, &content)
    }
}

/// The main thread: the learner and the store.
pub struct MainThread<'m, 's> {
    /// The learner.
    pub background: Option<Background<'m>>,
    /// The jobs of the frame path; `None`: the board has no store.
    pub stores: Option<Stores<'m>>,
    /// The store; `None`: it does not fit the flash, and every job fails.
    pub store: Option<&'s mut dyn CarriesOut>,
    /// What takes updates; `None`: the board has no slots.
    pub updates: Option<UpdatesThread<'m>>,
}

impl MainThread<'_, '_> {
    /// Does what waits. False: nothing did. `during`: the thread begins this phase, for the record
    /// of a crash.
    pub fn turn(&mut self, during: impl Fn(LoopPhase)) -> bool {
        let Self {
            background,
            stores,
            store,
            updates,
        } = self;
        during(LoopPhase::Learn);
        let learned = background.as_mut().is_some_and(Background::turn);
        during(LoopPhase::Store);
        let carry_out = |job: &Job| match store {
            Some(store) => store.carry_out(job, background.as_ref()),
            None => Progress::Failed,
        };
        let stored = stores.as_mut().is_some_and(|stores| stores.turn(carry_out));
        let updated = updates.as_mut().is_some_and(UpdatesThread::turn);
        during(LoopPhase::Sleep);
        learned || stored || updated
    }

    /// Something waits.
    pub fn waits(&self) -> bool {
        self.background.as_ref().is_some_and(Background::waits)
            || self.stores.as_ref().is_some_and(Stores::waits)
            || self.updates.as_ref().is_some_and(UpdatesThread::waits)
    }
}
