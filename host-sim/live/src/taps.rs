//! The lines that are listened to: the stream to the navigation computer, and the sensor's.
//!
//! Each has a thread that reads, and one thread tells the pages twenty times a second what came. A
//! line that breaks is opened again once a second.

use crate::hub::Hub;
use crate::pairs::Pairs;
use crate::record::Record;
use crate::samples::{Decoder, Found, Sample};
use crate::window::{Gather, Window};
use firmware::configuration::{Configuration, Sensor, SerialLines};
use firmware::wire::{ImuFormat, Settings};
use host_device::device::Port;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// How often the pages are told.
const TICK: Duration = Duration::from_millis(50);
/// A line that broke is opened again after this time.
const AGAIN: Duration = Duration::from_secs(1);

/// Which line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From the sensor.
    Raw,
    /// To the navigation computer.
    Corrected,
}

/// What a decoder must know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecoderSettings {
    settings: Settings,
    format: Option<ImuFormat>,
    lines: SerialLines,
}

impl DecoderSettings {
    /// Of a device's configuration.
    #[must_use]
    pub fn of(told: &Configuration) -> Self {
        Self {
            settings: told.wire_settings(),
            format: match &told.sensor {
                Some(Sensor::Stream(settings)) => Some(settings.format()),
                Some(Sensor::Spi(_)) | None => None,
            },
            lines: told.lines,
        }
    }
}

/// What the threads share.
pub struct Taps {
    hub: Arc<Hub>,
    record: Arc<Record>,
    stop: Arc<AtomicBool>,
    state: Mutex<State>,
    /// The sensor's line is listened to.
    has_sensor: bool,
}

struct State {
    /// What the device was told; changes when it is told anew.
    told: DecoderSettings,
    raw: Gather,
    corrected: Gather,
    /// Samples of one line that wait for those of the other.
    pairs: Pairs,
    /// Correction in force, rad/s and m/s2: what makes raw samples of corrected ones.
    in_force: Sample,
    /// Why a line is not heard.
    broken: [Option<String>; 2],
}

/// What the pages are told.
#[derive(Serialize)]
struct Shown<'a> {
    t: f64,
    raw: Option<Window>,
    corrected: Option<Window>,
    /// Where the raw values come from.
    raw_from: &'static str,
    broken: Vec<&'a str>,
}

impl Taps {
    /// Of lines that nobody listens to yet.
    #[must_use]
    pub fn new(
        hub: &Arc<Hub>,
        record: &Arc<Record>,
        stop: &Arc<AtomicBool>,
        has_sensor: bool,
    ) -> Arc<Self> {
        let told = DecoderSettings::of(&Configuration::default());
        Arc::new(Self {
            hub: Arc::clone(hub),
            record: Arc::clone(record),
            stop: Arc::clone(stop),
            has_sensor,
            state: Mutex::new(State {
                told,
                raw: Gather::NOTHING,
                corrected: Gather::NOTHING,
                pairs: Pairs::default(),
                in_force: [0.0; 6],
                broken: [None, None],
            }),
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The device was told this.
    pub fn tell(&self, told: DecoderSettings) {
        self.state().told = told;
    }

    /// The correction in force, rad/s and m/s2.
    pub fn in_force(&self, correction: Sample) {
        self.state().in_force = correction;
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Listens to a port until the server ends.
    pub fn listen(&self, side: Side, option: &str, name: &str) {
        while !self.stopped() {
            let told = self.state().told;
            let heard = Port::open_as(option, name, &told.lines)
                .map_err(|error| error.to_string())
                .and_then(|mut port| self.hear(side, &mut port, told));
            self.state().broken[side as usize] = heard.err().map(|why| match side {
                Side::Raw => format!("the sensor's line: {why}"),
                Side::Corrected => format!("the corrected stream: {why}"),
            });
            let mut waited = Duration::ZERO;
            while !self.stopped() && waited < AGAIN && self.state().told == told {
                thread::sleep(TICK);
                waited += TICK;
            }
        }
    }

    /// Reads until the server ends or the device is told something else.
    fn hear(&self, side: Side, port: &mut Port, told: DecoderSettings) -> Result<(), String> {
        let mut decoder = Decoder::new(told.settings, told.format);
        let mut samples = Vec::new();
        let mut buffer = [0; 4096];
        self.state().broken[side as usize] = None;
        while !self.stopped() {
            let len = port.receive(&mut buffer);
            let len = len.map_err(|error| format!("broke ({error}); it is opened again"))?;
            decoder.push(buffer.get(..len).unwrap_or_default(), |sample| {
                samples.push(sample);
            });
            let mut state = self.state();
            let State {
                raw,
                corrected,
                pairs,
                in_force,
                ..
            } = &mut *state;
            for found in &samples {
                if self.has_sensor {
                    pairs.push(side, *found, |side, sample| match side {
                        Side::Raw => raw.take(sample),
                        Side::Corrected => corrected.take(sample),
                    });
                } else {
                    corrected.take(&found.sample);
                    raw.take(&std::array::from_fn(|i| found.sample[i] + in_force[i]));
                }
            }
            let in_force = state.in_force;
            let changed = state.told != told;
            drop(state);
            for Found { sample, .. } in samples.drain(..) {
                self.record.sample(side, &sample);
                if !self.has_sensor {
                    let raw = std::array::from_fn(|i| sample[i] + in_force[i]);
                    self.record.sample(Side::Raw, &raw);
                }
            }
            if changed {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Tells the pages what came, until the server ends.
    pub fn show(&self) {
        while !self.stopped() {
            thread::sleep(TICK);
            let mut state = self.state();
            let (raw, corrected) = (state.raw.end(), state.corrected.end());
            let broken = state.broken.clone();
            drop(state);
            self.hub.tell(
                "samples",
                &Shown {
                    t: self.hub.time_s(),
                    raw,
                    corrected,
                    raw_from: if self.has_sensor {
                        "the sensor's line"
                    } else {
                        "the corrected stream and the correction in force"
                    },
                    broken: broken.iter().flatten().map(String::as_str).collect(),
                },
            );
        }
    }
}
