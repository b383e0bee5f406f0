//! The device at its command link: polled twice a second, given the orders of the page's buttons,
//! and looked for again when it is lost.
//!
//! One thread owns the link. The key never leaves this program.

mod order;

pub use order::{Order, PendingOrder, Reply};

use crate::history::Point;
use crate::hub::Hub;
use crate::record::Record;
use crate::taps::{DecoderSettings, Taps};
use firmware::configuration::{Activation, Configuration};
use firmware::wire::command::key::Secret;
use host_core::error::Error;
use host_device::device::{Info, Last, Link, Status, Trials, configuration, info, usual};
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Time between two polls of the device.
const PERIOD: Duration = Duration::from_millis(500);
/// Number of polls after which its identity and configuration are read again.
const INFO_EVERY: u32 = 20;
/// Number of tries of a request before the device counts as lost.
const TRIES: u32 = 3;
/// Time between two attempts to reach a lost device.
const LOOK: Duration = Duration::from_secs(1);

/// Access to the device.
pub struct Device {
    /// Port of its command link.
    pub port: String,
    /// Bit rate.
    pub baud: u32,
    /// Its key.
    pub key: Option<Secret>,
}

/// Connections of the device's thread.
pub struct Channels {
    /// Sends events to the pages.
    pub hub: Arc<Hub>,
    /// Readers of the sensor's and the navigation line.
    pub taps: Arc<Taps>,
    /// The recording.
    pub record: Arc<Record>,
    /// Orders of the page's buttons.
    pub orders: Receiver<PendingOrder>,
    /// Ends the thread when set.
    pub stop: Arc<AtomicBool>,
}

/// Status of the device, sent to the pages twice a second.
#[derive(Serialize)]
pub struct Now {
    /// Time of the server, s.
    pub t: f64,
    /// Mode, faults, counters, learner with its solution and hypotheses, error bound.
    #[serde(flatten)]
    pub status: Status,
    /// Correction in force, deg/h and mg.
    pub in_force: [f64; 6],
    /// Output of the networks in use, deg/h and mg.
    pub network: [f64; 6],
}

/// Identity and configuration of the device, sent to the pages when they change.
#[derive(Serialize)]
struct DeviceIdentity {
    #[serde(flatten)]
    info: Info,
    /// When corrections come into force.
    activation: Option<&'static str>,
    port: String,
    has_key: bool,
}

#[derive(Serialize)]
struct Lost {
    t: f64,
    problem: String,
}

/// An open link, and the state of polling its device.
struct OpenDevice {
    link: Link,
    rounds: u32,
}

impl Device {
    /// Opens the link to a device of this program's version.
    ///
    /// # Errors
    /// As [`Link::open`] and [`Link::version`].
    pub fn open(&self) -> Result<Link, Error> {
        let link = Link::open("--device", &self.port, self.baud)?;
        let mut link = link.with_key(self.key).with_tries(TRIES);
        link.version()?;
        Ok(link)
    }

    /// Watches the device until the server ends. `link`: an open link, if there is one.
    pub fn watch(&self, link: Option<Link>, channels: &Channels) {
        let fresh = |link| OpenDevice { link, rounds: 0 };
        let mut open = link.map(fresh);
        let mut last = Last::default();
        let mut was_lost = false;
        while !channels.stop.load(Ordering::Relaxed) {
            let begun = Instant::now();
            let looked = match open.take() {
                Some(open) => Ok(open),
                None => self.open().map(fresh),
            };
            let looked = looked.and_then(|mut open| {
                self.look(&mut open, &mut last, channels)?;
                Ok(open)
            });
            let wait = match looked {
                Ok(polled) => {
                    if was_lost {
                        channels.record.log("the device is found again", false);
                    }
                    (open, was_lost) = (Some(polled), false);
                    PERIOD
                }
                Err(error) => {
                    last.lost();
                    let problem = error.to_string();
                    if !was_lost {
                        channels.record.log(&problem, true);
                    }
                    let t = channels.hub.time_s();
                    channels.hub.send("lost", &Lost { t, problem });
                    was_lost = true;
                    LOOK
                }
            };
            let due = begun + wait;
            if !serve(due, &mut open, channels) {
                return;
            }
        }
    }

    /// Polls the device and sends its state to the pages.
    fn look(
        &self,
        open: &mut OpenDevice,
        last: &mut Last,
        channels: &Channels,
    ) -> Result<(), Error> {
        let OpenDevice { link, rounds } = open;
        let had = last.answered();
        if *rounds == 0 {
            last.reread(); // an order may have changed the configuration
        }
        let status = Status::ask(link, channels.hub.begun, last)?;
        let restarted = had && status.per_second.is_none();
        if rounds.is_multiple_of(INFO_EVERY) || restarted {
            let configuration = configuration(link)?;
            channels.taps.configure(DecoderSettings::of(
                &configuration.clone().unwrap_or_default(),
            ));
            channels
                .hub
                .send("info", &self.identity(info(link)?, configuration.as_ref()));
        }
        *rounds += 1;
        let estimate = link.estimate()?;
        let (in_force, network) = (estimate.in_force, estimate.network_output);
        let [gyro, accel] = in_force.map(|triad| triad.map(f64::from));
        let [[a, b, c], [x, y, z]] = [gyro, accel];
        channels.taps.in_force([a, b, c, x, y, z]);
        let now = Now {
            t: channels.hub.time_s(),
            status,
            in_force: usual(in_force),
            network: usual(network),
        };
        let proof = |trials: &Trials| trials.each.iter().map(|trial| trial.proof).collect();
        channels.hub.keep(Point {
            t: now.t,
            estimate: now.status.solution.as_ref().map(|of| of.estimate),
            sigma: now.status.solution.as_ref().map(|of| of.sigma),
            in_force: now.in_force,
            proof: now.status.trials.as_ref().map(proof),
            place: now.status.solution.as_ref().map(|of| of.place_deg),
        });
        channels.record.now(&now);
        channels.hub.send("status", &now);
        Ok(())
    }

    fn identity(&self, info: Info, configuration: Option<&Configuration>) -> DeviceIdentity {
        DeviceIdentity {
            info,
            activation: configuration.map(|of| match of.correction.activation {
                Activation::Commanded => "commanded",
                Activation::Standstill => "standstill",
                Activation::Faded => "faded",
                Activation::NextPowerOn => "next-power-on",
                Activation::FirstRest => "first-rest",
            }),
            port: self.port.clone(),
            has_key: self.key.is_some(),
        }
    }
}

/// Waits until the next poll is due, or carries out an order of a button. False: the server ends.
fn serve(due: Instant, open: &mut Option<OpenDevice>, channels: &Channels) -> bool {
    let left = due.saturating_duration_since(Instant::now());
    let given = match channels.orders.recv_timeout(left) {
        Ok(given) => given,
        Err(RecvTimeoutError::Timeout) => return true,
        Err(RecvTimeoutError::Disconnected) => return false,
    };
    let done = match open {
        Some(open) => {
            open.rounds = 0; // its configuration may have changed
            given.order.carry_out(&mut open.link)
        }
        None => Err("the device is lost; remedy: wait until it is found again".into()),
    };
    let words = done.as_ref().map_or_else(Clone::clone, Clone::clone);
    channels.record.log(&words, done.is_err());
    let _ = given.reply.send(done); // the page may be gone
    true
}
