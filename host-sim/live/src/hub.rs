//! Sends events to all open pages, and retains what a page needs that opens later.
//!
//! No sender waits for a page. Events are in a ring; a page that reads too slowly misses some.

use crate::history::{History, Point};
use serde::Serialize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tokio::sync::broadcast;

/// Events that wait for a slow page.
const WAITING: usize = 64;

/// An event for the pages, as JSON.
#[derive(Clone, Debug)]
pub struct Event {
    /// Its name: `samples`, `status`, `info` or `lost`.
    pub name: &'static str,
    /// Its content, a JSON object.
    pub json: Arc<str>,
}

/// Distributes events to the pages.
pub struct Hub {
    /// When the server began.
    pub begun: Instant,
    sender: broadcast::Sender<Event>,
    retained: Mutex<Retained>,
}

/// What a page gets first when it opens.
#[derive(Default)]
struct Retained {
    /// The last event of each name.
    last: Vec<Event>,
    history: History<Point>,
}

impl Default for Hub {
    fn default() -> Self {
        Self {
            begun: Instant::now(),
            sender: broadcast::channel(WAITING).0,
            retained: Mutex::default(),
        }
    }
}

impl Hub {
    /// Time since the server began, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Sends an event to all pages.
    pub fn send(&self, name: &'static str, what: &impl Serialize) {
        let json = serde_json::to_string(what).unwrap_or_default().into();
        let event = Event { name, json };
        if name != "samples" {
            let mut retained = self.retained();
            // both report whether the device is there, so each replaces the other
            let alike = |of: &str| of == name || ["status", "lost"].contains(&of);
            let replaces = ["status", "lost"].contains(&name);
            retained
                .last
                .retain(|event| event.name != name && !(replaces && alike(event.name)));
            retained.last.push(event.clone());
        }
        let _ = self.sender.send(event); // there may be no page
    }

    /// Adds a point to the history of slow values.
    pub fn keep(&self, point: Point) {
        self.retained().history.push(point);
    }

    /// The events retained so far, and a receiver of all later ones.
    #[must_use]
    pub fn listen(&self) -> (Vec<Event>, broadcast::Receiver<Event>) {
        let retained = self.retained();
        let receiver = self.sender.subscribe();
        let history = serde_json::to_string(retained.history.points());
        let mut first = vec![Event {
            name: "history",
            json: history.unwrap_or_default().into(),
        }];
        first.extend(retained.last.iter().cloned());
        (first, receiver)
    }

    fn retained(&self) -> MutexGuard<'_, Retained> {
        self.retained.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_opens_later_knows_what_is() {
        let hub = Hub::default();
        hub.send("status", &1);
        hub.send("info", &2);
        hub.send("samples", &3);
        hub.send("lost", &4);
        let names = |hub: &Hub| hub.listen().0.iter().map(|of| of.name).collect::<Vec<_>>();
        assert_eq!(names(&hub), ["history", "info", "lost"]);
        hub.send("status", &5);
        assert_eq!(names(&hub), ["history", "info", "status"]);
    }

    #[test]
    fn a_slow_page_costs_no_memory_and_loses_the_oldest() {
        let hub = Hub::default();
        let (_, mut receiver) = hub.listen();
        for number in 0..1000 {
            hub.send("samples", &number);
        }
        assert!(matches!(
            receiver.try_recv(),
            Err(broadcast::error::TryRecvError::Lagged(936))
        ));
        assert_eq!(&*receiver.try_recv().expect("one").json, "936");
    }
}
