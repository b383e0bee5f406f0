//! A device in the middle of a drive.

use crate::memory::Region;
use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use firmware::app::{App, Config, Lines};
use firmware::configuration::{Activation, Configuration, Sensor};
use firmware::control::Mode;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::link::NoLine;
use firmware::link::uart::{Port, Uart};
use firmware::wire::{ImuFormat, Settings as Configured};
use host_core::simulator::imu::ImuSpec;
use host_device::hil::{Input, Record, drive_configured, networks};
use std::cell::Cell;

/// State of the device under test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scenario {
    /// It passes samples.
    Bypass,
    /// It corrects by two networks.
    Frozen,
    /// It learns from fixes and corrects by what it has learnt.
    Learn,
}

/// Name of the memory that holds the bytes of the lines, and their counts.
pub const RINGS: &str = "rings of the lines";
/// Length of a drive before the first flip, s.
const LEAD_S: u32 = 1500;
/// Bytes of a line that come between two passes: less than its ring has room for.
const PIECE: usize = 256;
/// Time at rest at its start, s.
const STANDS_S: u32 = 120;

/// Output of the device in a trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceOutput {
    /// Bytes sent to the navigation computer after each frame of the sensor.
    pub after: Vec<Vec<u8>>,
    /// Faults that the device reports at the end.
    pub faults: u32,
    /// How often it repaired its memory.
    pub mended: u32,
}

/// The lines of sensor, navigation computer and receiver, with the rings between interrupt and
/// frame path.
type Uarts = [Uart; 3];
/// The frame path's ends of them.
type Ports = Lines<Port<'static>, Port<'static>, NoLine, Port<'static>>;

/// A device, its lines and its drive.
pub struct Device {
    app: *mut App<'static>,
    uarts: *mut Uarts,
    lines: *mut Ports,
    now: Cell<u64>,
    /// Records after the lead.
    rest: Vec<Record>,
    /// Memory whose bits may be flipped.
    pub regions: Vec<Region>,
    before: Vec<Vec<u8>>,
    before_us: u64,
}

/// The device's configuration: a STIM300 as it is delivered.
#[must_use]
pub fn configured(scenario: Scenario) -> Configuration {
    let format = ImuFormat::Stim300;
    let mut wire = Configured::DEFAULT;
    (format.simulated()[0].settings)(&mut wire);
    let mut configuration = Configuration {
        sensor: Some(Sensor::Stream(format.settings(&wire))),
        rate: f64::from(format.simulated()[0].rate),
        ..Configuration::default()
    };
    configuration.identity.serial = "N25581".try_into().unwrap_or_default();
    configuration.correction.mode = match scenario {
        Scenario::Bypass => Mode::Bypass,
        Scenario::Frozen => Mode::Frozen,
        Scenario::Learn => Mode::Learn,
    };
    configuration.correction.activation = Activation::Faded;
    configuration.correction.mark = false; // so that only values may change
    configuration
}

impl Device {
    /// Drives until samples are corrected, and saves the memory; the drive goes on for `seconds`
    /// more.
    ///
    /// # Errors
    /// The drive cannot be simulated, or the device does not reach the state under test.
    pub fn driven(scenario: Scenario, seconds: u32) -> Result<Device> {
        let configuration = configured(scenario);
        let errors = ImuSpec::preset("medium").context("no such errors")?;
        let drive = drive_configured(
            &configuration,
            ImuFormat::Stim300,
            &errors,
            [LEAD_S + seconds, STANDS_S],
        )?;
        let memory = Box::into_raw(Box::new(FixMemory::ZEROED));
        let settings = Settings::MEDIUM;
        let learner: &'static mut CombinedLearner<'static, _, _> =
            Box::leak(Box::new(CombinedLearner {
                references: Box::leak(Box::new(WindowLearner::new())),
                fixes: FixLearner::new(crate::memory::lent(memory), settings),
            }));
        let mut regions = vec![
            Region::of("learner from fixes", memory),
            Region::of("learner, frame", &raw mut *learner),
        ];
        let mut config = Config::of(&configuration);
        config.nets = networks();
        let app = Box::into_raw(Box::new(App::with_learner(config, Some(learner))));
        regions.insert(0, Region::of("application", app));
        let uarts: *mut Uarts = Box::into_raw(Box::new([const { Uart::new() }; 3]));
        let [sensor, navigation, gnss] = crate::memory::lent(uarts);
        let lines = Box::into_raw(Box::new(Lines {
            sensor: sensor.port(|| ()),
            navigation: navigation.port(|| ()),
            command: NoLine,
            gnss: gnss.port(|| ()),
        }));
        regions.push(Region::of(RINGS, uarts));
        let split = drive
            .records
            .partition_point(|r| r.at_us < LEAD_S * 1_000_000);
        let (lead, rest) = drive.records.split_at(split);
        let mut device = Device {
            app,
            uarts,
            lines,
            now: Cell::new(0),
            rest: rest.to_vec(),
            regions,
            before: Vec::new(),
            before_us: 0,
        };
        let mut changed = 0;
        for record in lead {
            let sent = device.take(record);
            changed += usize::from(record.input == Input::Sensor && sent != record.bytes);
        }
        let corrects = scenario != Scenario::Bypass;
        ensure!(
            (changed > 1000) == corrects,
            "{changed} frames were changed: {:?}",
            crate::memory::lent(app).learning()
        );
        let learning = crate::memory::lent(app).learning();
        ensure!(
            scenario != Scenario::Learn || learning.navigates,
            "it does not navigate"
        );
        device.before = device.regions.iter().map(Region::copy).collect();
        device.before_us = device.now.get();
        Ok(device)
    }

    /// The sensor's frames in a trial.
    pub fn came(&self) -> impl Iterator<Item = &[u8]> {
        let sensor = self
            .rest
            .iter()
            .filter(|record| record.input == Input::Sensor);
        sensor.map(|record| record.bytes.as_slice())
    }

    /// A trial: flips bits of regions, continues the drive, and restores the memory.
    pub fn trial(&mut self, flips: &[(usize, usize)]) -> DeviceOutput {
        for (region, bit) in flips {
            self.regions[*region].flip(*bit);
        }
        let mut left = DeviceOutput::default();
        let rest = std::mem::take(&mut self.rest);
        for record in &rest {
            let sent = self.take(record);
            if record.input == Input::Sensor {
                left.after.push(sent);
            }
        }
        self.rest = rest;
        let app = crate::memory::lent(self.app);
        (left.faults, left.mended) = (app.faults(), app.counters().mended);
        self.put_back();
        left
    }

    /// Restores the memory after a trial that ended early.
    pub fn put_back(&mut self) {
        for (region, copy) in self.regions.iter_mut().zip(&self.before) {
            region.put_back(copy);
        }
        self.now.set(self.before_us);
    }

    /// Receives a record, and returns the output.
    fn take(&mut self, record: &Record) -> Vec<u8> {
        self.now.set(record.at_us.into());
        let [sensor, navigation, gnss] = crate::memory::lent(self.uarts);
        let line = match record.input {
            Input::Sensor => &*sensor,
            Input::Gnss => &*gnss,
        };
        let mut bytes = record.bytes.iter();
        let mut sent = Vec::new();
        // interrupts come between the passes: those of the line, and of that to the computer
        loop {
            for byte in bytes.by_ref().take(PIECE) {
                line.came(*byte);
            }
            let (app, lines) = (
                crate::memory::lent(self.app),
                crate::memory::lent(self.lines),
            );
            let busy = app.poll(lines, &self.now);
            while let Some(byte) = navigation.next() {
                sent.push(byte);
            }
            while sensor.next().is_some() {}
            if !busy && bytes.len() == 0 {
                return sent;
            }
        }
    }
}
