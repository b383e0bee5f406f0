//! The streams of the page for other programs: by Foxglove's protocol, live, and as an MCAP file.
//!
//! Topics: `/imu/raw`, `/imu/corrected` (every sample), `/errors`, `/health`, `/rehearsals` (JSON
//! with a schema), `/track` (foxglove.LocationFix) and `/log` (foxglove.Log).

mod messages;

use crate::device::Now;
use crate::samples::Sample;
use crate::taps::Side;
use foxglove::messages::location_fix::PositionCovarianceType;
use foxglove::messages::log::Level;
use foxglove::messages::{LocationFix, Log, Timestamp};
use foxglove::{
    Channel, Context, McapCompression, McapWriteOptions, McapWriterHandle, WebSocketServerHandle,
};
use host_core::error::Error;
use host_device::device::faults::Fault;
use messages::{Errors, Health, Imu, Rehearsals};
use std::fs::File;
use std::io::BufWriter;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Messages that wait for a slow program.
const WAITING: usize = 1024;

/// Outputs of the measured data: Foxglove's protocol and an MCAP file.
pub struct Record {
    context: Arc<Context>,
    imu: [Channel<Imu>; 2],
    errors: Channel<Errors>,
    health: Channel<Health>,
    rehearsals: Channel<Rehearsals>,
    track: Channel<LocationFix>,
    log: Channel<Log>,
    /// Faults that are set.
    faults: Mutex<Vec<Fault>>,
    file: Mutex<Option<McapWriterHandle<BufWriter<File>>>>,
}

impl Default for Record {
    fn default() -> Self {
        let context = Context::new();
        Self {
            imu: ["/imu/raw", "/imu/corrected"].map(|of| context.channel_builder(of).build()),
            errors: context.channel_builder("/errors").build(),
            health: context.channel_builder("/health").build(),
            rehearsals: context.channel_builder("/rehearsals").build(),
            track: context.channel_builder("/track").build(),
            log: context.channel_builder("/log").build(),
            context,
            faults: Mutex::default(),
            file: Mutex::default(),
        }
    }
}

impl Record {
    /// Starts recording to a new file, which is complete after [`Record::end`].
    ///
    /// # Errors
    /// The file exists already or cannot be written.
    pub fn begin(&self, file: &Path) -> Result<(), Error> {
        let refused = |problem: String, remedy: &str| Error::Option {
            option: format!("--mcap {}", file.display()),
            problem,
            remedy: remedy.into(),
        };
        let out = File::create_new(file).map_err(|error| {
            let remedy = "give the name of a new file, in a folder that you may write";
            refused(format!("cannot be made ({error})"), remedy)
        })?;
        // without a compressor, which would be a C library
        let options = McapWriteOptions::new().compression(None::<McapCompression>);
        let writer = self.context.mcap_writer_with_options(options);
        let handle = writer
            .create(BufWriter::new(out))
            .map_err(|error| refused(error.to_string(), "report it"))?;
        *self.file.lock().unwrap_or_else(PoisonError::into_inner) = Some(handle);
        Ok(())
    }

    /// Serves Foxglove's protocol until the handle is dropped.
    ///
    /// # Errors
    /// The address is not available.
    pub fn serve(&self, at: SocketAddr) -> Result<WebSocketServerHandle, Error> {
        let server = self.context.websocket_server().name("host-sim serve");
        let server = server.bind(at.ip().to_string(), at.port());
        let server = server.message_backlog_size(WAITING).start_blocking();
        server.map_err(|error| Error::Option {
            option: format!("--foxglove {at}"),
            problem: format!("cannot be had ({error})"),
            remedy: "end the program that has the port, or give --foxglove ADDRESS:PORT".into(),
        })
    }

    /// Records a sample.
    pub fn sample(&self, side: Side, sample: &Sample) {
        let channel = &self.imu[side as usize];
        if channel.has_sinks() {
            channel.log(&Imu::of(sample));
        }
    }

    /// Records the status of the device.
    pub fn now(&self, now: &Now) {
        self.health.log(&Health::of(now));
        if let Some(errors) = Errors::of(now) {
            self.errors.log(&errors);
        }
        if let Some(trials) = &now.status.trials {
            self.rehearsals.log(&Rehearsals::of(trials));
        }
        if let Some(solution) = &now.status.solution {
            let [latitude, longitude] = solution.place_deg;
            self.track.log(&LocationFix {
                timestamp: Some(Timestamp::now()),
                frame_id: "imu".into(),
                latitude,
                longitude,
                altitude: solution.height_m,
                position_covariance: vec![0.0; 9],
                position_covariance_type: PositionCovarianceType::Unknown.into(),
                heading: Some(solution.attitude_deg[2].to_radians()),
                ..LocationFix::default()
            });
        }
        self.tell_faults(&now.status.faults);
    }

    /// Logs faults that were set or cleared.
    fn tell_faults(&self, now: &[Fault]) {
        let mut before = self.faults.lock().unwrap_or_else(PoisonError::into_inner);
        for fault in now.iter().filter(|of| !before.contains(of)) {
            let Fault {
                name, says, remedy, ..
            } = fault;
            self.log(&format!("{name}: {says}; remedy: {remedy}"), true);
        }
        for fault in before.iter().filter(|of| !now.contains(of)) {
            self.log(&format!("{} is over", fault.name), false);
        }
        *before = now.to_vec();
    }

    /// Records a sentence of the log.
    pub fn log(&self, message: &str, wrong: bool) {
        let level = if wrong { Level::Error } else { Level::Info };
        self.log.log(&Log {
            timestamp: Some(Timestamp::now()),
            level: level.into(),
            message: message.into(),
            name: "device".into(),
            ..Log::default()
        });
    }

    /// Completes the file.
    ///
    /// # Errors
    /// The disk is full or not available.
    pub fn end(&self) -> Result<(), Error> {
        let file = self
            .file
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        let closed = file.map(McapWriterHandle::close).transpose();
        closed.map(drop).map_err(|error| Error::Option {
            option: "--mcap".into(),
            problem: format!("cannot be finished ({error})"),
            remedy: "make room on the disk; `mcap recover` mends the file".into(),
        })
    }
}
