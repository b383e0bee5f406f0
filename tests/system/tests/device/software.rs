//! A device in a thread: the application of the firmware with a command link at a socket, and a
//! sensor that sends in real time.

use firmware::app::{App, Config, Hardware, Lines};
use firmware::configuration::Configuration;
use firmware::learn::{FixLearner, FixMemory, Learner, Settings};
use firmware::link::rates::Clock as Rates;
use firmware::link::{Clock, Full, Line, Lost, NoLine};
use firmware::wire::framer::LONGEST;
use firmware::wire::{Fields, ImuFormat};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Properties of a simulated device.
#[derive(Clone)]
pub struct Kind {
    /// Its configuration, if it has been configured.
    pub configuration: Option<Configuration>,
    /// It has flash to store in.
    pub stores: bool,
    /// Its flash is worn, so that storing fails.
    pub worn: bool,
    /// It has a learner.
    pub learns: bool,
}

impl Kind {
    /// A device as delivered.
    pub const NEW: Self = Self {
        configuration: None,
        stores: true,
        worn: false,
        learns: true,
    };
}

/// A board with the clocks of the mps2 in QEMU.
const HARDWARE: Hardware = Hardware {
    name: "software",
    clocks: [Rates::cmsdk(25_000_000); 3],
    parity: false,
    pin_sets: 2,
    reset: None,
};

/// A running device; ended when dropped.
pub struct Device {
    /// Its command link: `tcp:HOST:PORT`.
    pub port: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The command link: the peer that connected last.
struct Command {
    listener: TcpListener,
    stream: Option<TcpStream>,
}

impl Line for Command {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        if let Ok((stream, _)) = self.listener.accept() {
            let _ = stream.set_nonblocking(true);
            self.stream = Some(stream);
        }
        let stream = self.stream.as_mut();
        Ok(stream.and_then(|s| s.read(buffer).ok()).unwrap_or(0))
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        let stream = self.stream.as_mut().ok_or(Full)?;
        stream.write_all(message).map_err(|_| Full)
    }
}

/// A sensor at rest, 250 frames a second. What the device sends is discarded.
struct Sensor {
    begun: Instant,
    sent: u32,
}

impl Line for Sensor {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let due = (self.begun.elapsed().as_millis() / 4) as u32;
        if self.sent >= due || buffer.len() < 32 {
            return Ok(0);
        }
        let sensor = &ImuFormat::Stim300.simulated()[0];
        let wobble = (self.sent * 37 % 11) as i32 - 5;
        let fields = Fields {
            index: self.sent,
            time: f64::from(self.sent + 1) * 0.004,
            gyro: [wobble; 3],
            accel: [0, 0, (-9.81 * 0.004 * 2f64.powi(22)) as i32 + wobble],
            rest: sensor.rest,
        };
        self.sent += 1;
        let mut frame = [0; LONGEST];
        let len = (sensor.emit)(&fields, &mut frame).unwrap_or(0);
        buffer[..len].copy_from_slice(&frame[..len]);
        Ok(len)
    }

    fn send(&mut self, _: &[u8]) -> Result<(), Full> {
        Ok(())
    }
}

struct Real(Instant);

impl Clock for Real {
    fn now_us(&self) -> u64 {
        self.0.elapsed().as_micros() as u64
    }
}

impl Device {
    /// Starts one on a free port.
    pub fn start(kind: &Kind) -> Self {
        Self::at(TcpListener::bind("127.0.0.1:0").expect("a port"), kind)
    }

    /// Starts one on the port of an earlier one.
    pub fn again(port: &str, kind: &Kind) -> Self {
        let address = port.strip_prefix("tcp:").expect("tcp");
        Self::at(TcpListener::bind(address).expect("free again"), kind)
    }

    fn at(listener: TcpListener, kind: &Kind) -> Self {
        listener.set_nonblocking(true).expect("a socket");
        let port = format!("tcp:{}", listener.local_addr().expect("bound"));
        let stop = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&stop);
        let kind = kind.clone();
        let stream = None;
        let thread = thread::spawn(move || run(&kind, Command { listener, stream }, &ended));
        Self {
            port,
            stop,
            thread: Some(thread),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(kind: &Kind, command: Command, ended: &AtomicBool) {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut learner = FixLearner::new(&mut memory, Settings::MEDIUM);
    let learner = kind.learns.then_some(&mut learner as &mut dyn Learner);
    let configured = kind.configuration.as_ref().map(Config::of);
    let config = Config {
        store: kind.stores,
        hardware: HARDWARE,
        ..configured.unwrap_or_else(|| Config::unconfigured(HARDWARE))
    };
    let mut app = App::with_learner(config, learner);
    let begun = Instant::now();
    let mut lines = Lines {
        sensor: Sensor { begun, sent: 0 },
        navigation: NoLine,
        gnss: NoLine,
        command,
    };
    let clock = Real(begun);
    while !ended.load(Ordering::Relaxed) {
        let busy = app.poll(&mut lines, &clock);
        if app.wants_to_store() {
            app.store(|_, _| !kind.worn);
        }
        if !busy {
            thread::sleep(Duration::from_micros(500));
        }
    }
}
