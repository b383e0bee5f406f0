//! Reads the stream to the navigation computer and the sensor's line.
//!
//! Each line has a thread that reads. Another thread sends the samples to the pages twenty times a
//! second. A line that breaks is reopened after a second.

use crate::hub::Hub;
use crate::pairs::Pairs;
use crate::record::Record;
use crate::samples::{DecodedSample, Decoder, Sample};
use crate::window::{Gather, Window};
use firmware::configuration::{Configuration, Sensor, SerialLines};
use firmware::wire::{ImuFormat, Settings};
use host_device::device::Port;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Time between two events for the pages.
const TICK: Duration = Duration::from_millis(50);
/// Longest time for which bytes that have arrived are read after the end.
const REST: Duration = Duration::from_millis(200);
/// Time until a broken line is reopened.
const AGAIN: Duration = Duration::from_secs(1);

/// A tapped line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From the sensor.
    Raw,
    /// To the navigation computer.
    Corrected,
}

/// Settings of the lines and their decoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecoderSettings {
    settings: Settings,
    format: Option<ImuFormat>,
    lines: SerialLines,
}

impl DecoderSettings {
    /// The settings in a device's configuration.
    #[must_use]
    pub fn of(configuration: &Configuration) -> Self {
        Self {
            settings: configuration.wire_settings(),
            format: match &configuration.sensor {
                Some(Sensor::Stream(settings)) => Some(settings.format()),
                Some(Sensor::Spi(_)) | None => None,
            },
            lines: configuration.lines,
        }
    }
}

/// Readers of the lines: state that their threads share.
pub struct Taps {
    hub: Arc<Hub>,
    record: Arc<Record>,
    stop: Arc<AtomicBool>,
    state: Mutex<State>,
    /// Whether the sensor's line is read.
    has_sensor: bool,
}

struct State {
    /// From the device's configuration; replaced when the device is configured again.
    settings: DecoderSettings,
    raw: Gather,
    corrected: Gather,
    /// Samples of one line that wait for those of the other.
    pairs: Pairs,
    /// Correction in force, rad/s and m/s2; added to corrected samples it gives raw ones.
    in_force: Sample,
    /// Why a line cannot be read, for each [`Side`].
    broken: [Option<String>; 2],
}

/// An event for the pages.
#[derive(Serialize)]
struct TapEvent<'a> {
    t: f64,
    raw: Option<Window>,
    corrected: Option<Window>,
    /// Source of the raw values, in words.
    raw_from: &'static str,
    broken: Vec<&'a str>,
}

impl Taps {
    /// Lines that are not read yet.
    #[must_use]
    pub fn new(
        hub: &Arc<Hub>,
        record: &Arc<Record>,
        stop: &Arc<AtomicBool>,
        has_sensor: bool,
    ) -> Arc<Self> {
        let settings = DecoderSettings::of(&Configuration::default());
        Arc::new(Self {
            hub: Arc::clone(hub),
            record: Arc::clone(record),
            stop: Arc::clone(stop),
            has_sensor,
            state: Mutex::new(State {
                settings,
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

    /// Replaces the settings of the decoders.
    pub fn configure(&self, settings: DecoderSettings) {
        self.state().settings = settings;
    }

    /// Sets the correction in force, rad/s and m/s2.
    pub fn in_force(&self, correction: Sample) {
        self.state().in_force = correction;
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Reads a port until the server ends.
    pub fn listen(&self, side: Side, option: &str, name: &str) {
        while !self.stopped() {
            let settings = self.state().settings;
            let heard = Port::open_as(option, name, &settings.lines)
                .map_err(|error| error.to_string())
                .and_then(|mut port| self.hear(side, &mut port, settings));
            self.state().broken[side as usize] = heard.err().map(|why| match side {
                Side::Raw => format!("the sensor's line: {why}"),
                Side::Corrected => format!("the corrected stream: {why}"),
            });
            let mut waited = Duration::ZERO;
            while !self.stopped() && waited < AGAIN && self.state().settings == settings {
                thread::sleep(TICK);
                waited += TICK;
            }
        }
    }

    /// Reads until the server ends or the lines are configured again. Settings that concern the
    /// decoder alone replace it; the port stays open, so that no frame is lost.
    fn hear(
        &self,
        side: Side,
        port: &mut Port,
        mut settings: DecoderSettings,
    ) -> Result<(), String> {
        let mut decoder = Decoder::new(settings.settings, settings.format);
        let mut samples = Vec::new();
        let mut buffer = [0; 4096];
        self.state().broken[side as usize] = None;
        let mut stopped_at = None;
        loop {
            let len = port.receive(&mut buffer);
            let len = len.map_err(|error| format!("broke ({error}); it is opened again"))?;
            if self.stopped() {
                let at: &Instant = stopped_at.get_or_insert_with(Instant::now);
                if len == 0 || at.elapsed() > REST {
                    return Ok(());
                }
            }
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
            let now = state.settings;
            drop(state);
            for DecodedSample { sample, .. } in samples.drain(..) {
                self.record.sample(side, &sample);
                if !self.has_sensor {
                    let raw = std::array::from_fn(|i| sample[i] + in_force[i]);
                    self.record.sample(Side::Raw, &raw);
                }
            }
            if now.lines != settings.lines {
                return Ok(());
            }
            if now != settings {
                decoder = Decoder::new(now.settings, now.format);
                settings = now;
            }
        }
    }

    /// Sends the received samples to the pages, until the server ends.
    pub fn show(&self) {
        while !self.stopped() {
            thread::sleep(TICK);
            let mut state = self.state();
            let (raw, corrected) = (state.raw.end(), state.corrected.end());
            let broken = state.broken.clone();
            drop(state);
            self.hub.send(
                "samples",
                &TapEvent {
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
