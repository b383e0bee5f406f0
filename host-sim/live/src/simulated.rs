//! A device without hardware: the application of the firmware in a thread, a simulated drive at its
//! sensor's and receiver's line, and its other lines at sockets, as those of a board in QEMU.
//!
//! At the end of the drive it is switched off and on, and drives again with what it has stored.

mod lines;

use firmware::app::{App, Config, Hardware, Lines};
use firmware::configuration::Configuration;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::link::rates::Clock as Rates;
use firmware::model::Nets;
use firmware::wire::ImuFormat;
use host_core::error::Error;
use host_device::hil::{Drive, Input, MemoryLine, SetClock, drive_configured};
use host_unit::Unit;
use lines::Socket;
use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Standstill before each drive, s.
const STANDS_S: u32 = 60;
/// Time that the thread sleeps between two runs of the application.
const SLEEP: Duration = Duration::from_millis(1);

/// A board with clocks as those of an MPS2.
const HARDWARE: Hardware = Hardware {
    name: "simulated",
    clocks: [Rates::cmsdk(25_000_000); 3],
    parity: false,
    pin_sets: 1,
    reset: None,
};

/// Settings of a simulation.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The unit, whose errors the sensor has.
    pub unit: Unit,
    /// Length of a drive, s.
    pub seconds: u32,
    /// Simulated time over real time.
    pub speed: f64,
}

/// A device that runs.
pub struct Simulated {
    /// Ports of its command link and of its stream to the navigation computer.
    pub ports: [String; 2],
    configuration: Configuration,
    drive: Drive,
    speed: f64,
    listeners: [TcpListener; 2],
}

impl Simulated {
    /// Simulates the drive and opens the ports.
    ///
    /// # Errors
    /// The unit cannot be simulated; the system has no ports left.
    pub fn new(of: &Simulation) -> Result<Self, Error> {
        let configuration = of.unit.configuration().map_err(|wrong| Error::Option {
            option: format!("--unit: {}", wrong.key),
            problem: wrong.problem,
            remedy: wrong.remedy,
        })?;
        let format = of.unit.sensor.imu_format().unwrap_or(ImuFormat::Stim300);
        let seconds = [of.seconds, STANDS_S];
        let drive = drive_configured(&configuration, format, &of.unit.simulated(), seconds)?;
        let opened = || -> io::Result<_> {
            let open = || -> io::Result<TcpListener> {
                let listener = TcpListener::bind("127.0.0.1:0")?;
                listener.set_nonblocking(true)?;
                Ok(listener)
            };
            let listeners = [open()?, open()?];
            let [a, b] = &listeners;
            let port = |of: &TcpListener| of.local_addr().map(|at| format!("tcp:{at}"));
            Ok(([port(a)?, port(b)?], listeners))
        };
        let (ports, listeners) = opened().map_err(|error| Error::Option {
            option: "--simulate".into(),
            problem: format!("no port on this computer ({error})"),
            remedy: "end programs that hold many".into(),
        })?;
        Ok(Self {
            ports,
            // the axes of the simulated sensor are the vehicle's
            configuration: configuration.in_body_axes(),
            drive,
            speed: of.speed,
            listeners,
        })
    }

    /// Runs until it is stopped.
    pub fn run(self, stop: &AtomicBool) {
        let [command, stream] = self.listeners.map(Socket::new);
        let mut outside = Outside { command, stream };
        let mut stored = Nets::NONE;
        while !stop.load(Ordering::Relaxed) {
            let config = Config {
                nets: stored,
                store: true,
                hardware: HARDWARE,
                ..Config::of(&self.configuration)
            };
            power_on(
                config,
                &self.drive,
                self.speed,
                &mut outside,
                &mut stored,
                stop,
            );
        }
    }
}

/// The sockets.
struct Outside {
    command: Socket,
    stream: Socket,
}

/// One drive, from power-on to its end.
fn power_on(
    config: Config,
    drive: &Drive,
    speed: f64,
    outside: &mut Outside,
    stored: &mut Nets,
    stop: &AtomicBool,
) {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut references = Box::new(WindowLearner::new());
    let mut learner = CombinedLearner {
        references: &mut *references,
        fixes: FixLearner::new(&mut memory, Settings::MEDIUM), // until it is configured
    };
    let mut app = Box::new(App::with_learner(config, Some(&mut learner)));
    let mut lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine> = Lines::default();
    let mut clock = SetClock(0);
    let begun = Instant::now();
    let mut records = drive.records.iter().peekable();
    while records.peek().is_some() && !stop.load(Ordering::Relaxed) {
        let now_us = (begun.elapsed().as_secs_f64() * speed * 1e6) as u64;
        let mut poll = |lines: &mut Lines<_, _, _, _>, clock: &SetClock| {
            while app.poll(lines, clock) {}
            if app.wants_to_store() {
                app.store(|_, content| {
                    *stored = *content.nets;
                    true
                });
            }
            app.to_open();
        };
        while let Some(record) = records.next_if(|of| u64::from(of.at_us) <= now_us) {
            clock.0 = record.at_us.into();
            match record.input {
                Input::Sensor => lines.sensor.received.extend(&record.bytes),
                Input::Gnss => lines.gnss.received.extend(&record.bytes),
            }
            poll(&mut lines, &clock);
            outside.stream.send(&lines.navigation.sent);
            lines.navigation.sent.clear();
            lines.sensor.sent.clear();
        }
        clock.0 = clock.0.max(now_us);
        outside.command.receive(&mut lines.command.received);
        poll(&mut lines, &clock);
        outside.command.send(&lines.command.sent);
        lines.command.sent.clear();
        outside.stream.send(&lines.navigation.sent);
        lines.navigation.sent.clear();
        thread::sleep(SLEEP);
    }
}

/// Starts the device in a thread of its own.
pub fn start(simulated: Simulated, stop: &Arc<AtomicBool>) -> thread::JoinHandle<()> {
    let stop = Arc::clone(stop);
    thread::spawn(move || simulated.run(&stop))
}
