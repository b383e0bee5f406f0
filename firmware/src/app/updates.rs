//! Orders of updates that the application gives to the board's main thread.

use super::App;
use crate::link::spsc::{Consumer, Producer, Queue};
use crate::update::{Order, Outcome, TakesUpdates};

/// The queues between the frame path and the main thread, to be static.
#[derive(Debug)]
pub struct Updates {
    orders: Queue<Order, 1>,
    outcomes: Queue<Outcome, 1>,
}

impl Updates {
    /// Empty.
    #[expect(clippy::new_without_default, reason = "it is for statics")]
    pub const fn new() -> Updates {
        Updates {
            orders: Queue::new(),
            outcomes: Queue::new(),
        }
    }

    /// The frame path's side, and the main thread's with what takes the updates.
    pub fn split<'m>(
        &'m mut self,
        updater: &'m mut dyn TakesUpdates,
    ) -> (GivesUpdates<'m>, UpdatesThread<'m>) {
        let (orders_in, orders_out) = self.orders.split();
        let (outcomes_in, outcomes_out) = self.outcomes.split();
        let gives = GivesUpdates {
            orders: orders_in,
            outcomes: outcomes_out,
        };
        let thread = UpdatesThread {
            orders: orders_out,
            outcomes: outcomes_in,
            updater,
        };
        (gives, thread)
    }
}

/// The frame path's side.
pub struct GivesUpdates<'m> {
    orders: Producer<'m, Order, 1>,
    outcomes: Consumer<'m, Outcome, 1>,
}

impl GivesUpdates<'_> {
    /// To be called in every turn.
    pub fn turn(&mut self, app: &mut App) {
        if let Some(outcome) = self.outcomes.take() {
            app.updated(&outcome);
        }
        if let Some(order) = app.update_order() {
            let _ = self.orders.put(order); // there is one at a time
        }
    }
}

/// The main thread's side.
pub struct UpdatesThread<'m> {
    orders: Consumer<'m, Order, 1>,
    outcomes: Producer<'m, Outcome, 1>,
    updater: &'m mut dyn TakesUpdates,
}

impl UpdatesThread<'_> {
    /// Carries out an order. False: there is none.
    pub fn turn(&mut self) -> bool {
        let Some(order) = self.orders.take() else {
            return false;
        };
        let _ = self.outcomes.put(self.updater.carry_out(&order)); // there is one at a time
        true
    }

    /// An order waits.
    pub fn waits(&self) -> bool {
        self.orders.waits()
    }
}
