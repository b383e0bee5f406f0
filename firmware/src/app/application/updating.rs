//! Updates of the firmware, for the board.

use super::App;
use crate::control::update::{Report, Running};
use crate::update::{Order, Outcome};

impl App<'_> {
    /// The board takes updates, after [`App::boot`]. `before`: faults of the device before the
    /// update that is on trial ([`crate::update::Updater`]).
    pub fn takes_updates(&mut self, report: &Report, before: u32) {
        self.commands.server.updates.begin(report, before);
    }

    /// The image that runs; `None`: the board takes no updates.
    pub fn running(&self) -> Option<Running> {
        let report = self.commands.server.updates.report();
        report.ok().map(|report| report.running)
    }

    /// The next order for what takes updates. [`App::updated`] must follow.
    pub fn update_order(&mut self) -> Option<Order> {
        self.commands.server.updates.order()
    }

    /// What became of the order.
    pub fn updated(&mut self, outcome: &Outcome) {
        self.commands.server.updates.done(outcome);
    }

    /// Whether the board is to restart now, as was asked for.
    pub fn restarts(&self, now_us: u64) -> bool {
        self.commands.server.updates.restarts(now_us)
    }

    /// Watches a firmware on trial. To be called in every turn where the board takes updates, with
    /// the value of [`App::unwell`].
    pub fn watch_trial(&mut self, unwell: u8, now_us: u64) {
        if self.commands.server.updates.is_on_trial() {
            let (faults, left) = (self.faults(), self.flow.health.left());
            let updates = &mut self.commands.server.updates;
            updates.watch(unwell == 0, faults, left, now_us);
        }
    }
}
