//! A device without hardware: the application of the firmware with its store in (simulated) flash,
//! a simulated drive at its sensor's and receiver's line, and its other lines at sockets, as those
//! of a board in QEMU.
//!
//! At the end of the drive it is switched off and on, and drives again with what it has stored.

mod socket;
#[cfg(test)]
mod update_tests;

use super::{Drive, Input, MemoryFlash, MemoryLine, SetClock, drive_configured};
use firmware::app::{App, Hardware, Lines};
use firmware::configuration::Configuration;
use firmware::configuration::record::encode;
use firmware::control::update::Running;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::model::Nets;
use firmware::store::{Content, Progress, Step, Store, unit};
use firmware::update::slots::{Places, Slots};
use firmware::update::{DEVELOPMENT_KEY, TakesUpdates, Updater};
use firmware::wire::ImuFormat;
use host_core::error::Error;
use host_unit::Unit;
use socket::Socket;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Standstill before each drive, s.
const STANDS_S: u32 = 60;
/// Time that the thread sleeps between two runs of the application.
const SLEEP: Duration = Duration::from_millis(1);

const HARDWARE: Hardware = Hardware {
    name: "simulated",
    ..Hardware::DESKTOP
};

/// The slots of its program's flash, as on an STM32H743.
const PLACES: Places = Places {
    base: 0x0800_0000,
    slots: [0x2_0000, 0x10_0000],
    len: 0xC_0000,
};

/// What lasts over a power cycle.
struct Chip {
    store: MemoryFlash,
    program: MemoryFlash,
}

/// Why the device restarts.
enum Ended {
    Drive,
    Restart,
}

/// Settings of a simulation.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The unit, whose errors the sensor has.
    pub unit: Unit,
    /// Length of a drive, s.
    pub seconds: u32,
    /// Simulated time over real time.
    pub speed: f64,
    /// When lines are cut.
    pub cuts: Cuts,
    /// Address of the command link. The stream to the navigation computer has the next port, or any
    /// that is free where this port is 0.
    pub listen: SocketAddr,
}

/// Seconds of each drive from which on a line carries nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cuts {
    /// The sensor's.
    pub sensor_s: Option<u32>,
    /// The receiver's.
    pub receiver_s: Option<u32>,
}

impl Cuts {
    /// Whether the line of this input is cut at this time.
    fn cut(&self, input: Input, at_us: u64) -> bool {
        let from = match input {
            Input::Sensor => self.sensor_s,
            Input::Gnss => self.receiver_s,
        };
        from.is_some_and(|s| at_us >= u64::from(s) * 1_000_000)
    }
}

/// A device that runs.
pub struct Simulated {
    /// Ports of its command link and of its stream to the navigation computer.
    pub ports: [String; 2],
    configuration: Configuration,
    drive: Drive,
    speed: f64,
    cuts: Cuts,
    listeners: [TcpListener; 2],
}

impl Simulated {
    /// Opens the ports and simulates the drive.
    ///
    /// # Errors
    /// The unit cannot be simulated; a port is taken.
    pub fn new(of: &Simulation) -> Result<Self, Error> {
        let listeners = ports(of.listen)?;
        let configuration = of.unit.configuration().map_err(|wrong| Error::Option {
            option: format!("--unit: {}", wrong.key),
            problem: wrong.problem,
            remedy: wrong.remedy,
        })?;
        let format = of.unit.sensor.imu_format().unwrap_or(ImuFormat::Stim300);
        let seconds = [of.seconds, STANDS_S];
        let drive = drive_configured(&configuration, format, &of.unit.simulated(), seconds)?;
        let port = |listener: &TcpListener| {
            let at = listener.local_addr().map(|at| format!("tcp:{at}"));
            at.map_err(|error| taken(of.listen, &error))
        };
        let [command, stream] = &listeners;
        Ok(Self {
            ports: [port(command)?, port(stream)?],
            // the axes of the simulated sensor are the vehicle's
            configuration: configuration.in_body_axes(),
            drive,
            speed: of.speed,
            cuts: of.cuts,
            listeners,
        })
    }

    /// Runs until it is stopped. `says` gets a line at each power-on but the first.
    pub fn run(self, stop: &AtomicBool, says: &mut dyn FnMut(&str)) {
        let [command, stream] = self.listeners.map(Socket::new);
        let mut outside = Outside { command, stream };
        let pace = (self.speed, self.cuts);
        let mut chip = Chip {
            store: configured(&self.configuration),
            program: flashed(),
        };
        for number in 1.. {
            let ended = power_on(&mut chip, &self.drive, pace, &mut outside, stop);
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let what = match ended {
                Ended::Drive => {
                    format!("drive {number} is over: the device is switched off and on")
                }
                Ended::Restart => {
                    format!("the device restarts in drive {number}, as it was asked to")
                }
            };
            says(&format!(
                "{what}, and what it has stored acts in drive {}",
                number + 1
            ));
        }
    }
}

/// Listeners for the command link and for the stream.
fn ports(listen: SocketAddr) -> Result<[TcpListener; 2], Error> {
    let open = |at: SocketAddr| {
        let listener = TcpListener::bind(at).and_then(|listener| {
            listener.set_nonblocking(true)?;
            Ok(listener)
        });
        listener.map_err(|error| taken(at, &error))
    };
    let mut next = listen;
    if listen.port() != 0 {
        next.set_port(listen.port().checked_add(1).ok_or_else(|| Error::Option {
            option: format!("--listen {listen}"),
            problem: "there is no next port for the stream".into(),
            remedy: "give a port from 1 to 65534, or 0 for any that is free".into(),
        })?);
    }
    Ok([open(listen)?, open(next)?])
}

fn taken(at: SocketAddr, error: &io::Error) -> Error {
    let problem = match error.kind() {
        io::ErrorKind::AddrInUse => "another program has this port".to_owned(),
        io::ErrorKind::PermissionDenied => "ports below 1024 are the system's".to_owned(),
        _ => format!("this port does not open ({error})"),
    };
    Error::Option {
        option: format!("--listen {at}"),
        problem,
        remedy: "end that program, or give --listen ADDRESS:PORT with another port; it and the \
                 next one must be free, and 0 is any that is free"
            .into(),
    }
}

/// The flash of a device that was configured and has stored its configuration.
fn configured(configuration: &Configuration) -> MemoryFlash {
    let Ok(mut store) = Store::new(MemoryFlash::default()) else {
        return MemoryFlash::default();
    };
    let record = encode(configuration);
    let content = Content {
        unit: unit(configuration),
        ..Content::new(&Nets::NONE, &record)
    };
    let _ = store.carry_out(Step::Save, &content); // erased flash with room
    store.into_inner()
}

/// The flash of a device whose first slot holds an image.
fn flashed() -> MemoryFlash {
    let [first, second] = PLACES.slots;
    let mut bytes = vec![0xFF; (second + PLACES.len) as usize];
    let vectors = [0x2000_0000, PLACES.address(0) + 0x201].map(u32::to_le_bytes);
    let first = first as usize;
    bytes[first..first + 8].copy_from_slice(vectors.as_flattened());
    MemoryFlash(bytes)
}

/// The sockets.
struct Outside {
    command: Socket,
    stream: Socket,
}

/// One drive, from power-on to its end.
fn power_on(
    chip: &mut Chip,
    drive: &Drive,
    (speed, cuts): (f64, Cuts),
    outside: &mut Outside,
    stop: &AtomicBool,
) -> Ended {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut references = Box::new(WindowLearner::new());
    let mut learner = CombinedLearner {
        references: &mut *references,
        fixes: FixLearner::new(&mut memory, Settings::MEDIUM), // until it is configured
    };
    let mut updater = started(std::mem::take(&mut chip.program));
    let on_trial = updater
        .as_ref()
        .is_some_and(|updater| updater.report().running == Running::Trial);
    let mut store = Store::new(std::mem::take(&mut chip.store)).ok();
    let app = App::start_up(HARDWARE, &mut store, !on_trial, Some(&mut learner));
    let mut app = Box::new(app);
    if let Some(updater) = &updater {
        app.takes_updates(updater.report(), updater.faults());
    }
    let mut lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine> = Lines::default();
    let mut clock = SetClock(0);
    let mut random = [0; 32];
    if getrandom::fill(&mut random).is_ok() {
        app.seed(random); // else a device with a key has no challenges
    }
    let begun = Instant::now();
    let mut records = drive.records.iter().peekable();
    while records.peek().is_some() && !stop.load(Ordering::Relaxed) && !app.restarts(clock.0) {
        let now_us = (begun.elapsed().as_secs_f64() * speed * 1e6) as u64;
        let mut poll = |lines: &mut Lines<_, _, _, _>, clock: &SetClock| {
            while app.poll(lines, clock) {}
            while app.wants_to_store() {
                app.store(|step, content| match &mut store {
                    Some(store) => store.carry_out(step, content),
                    None => Progress::Failed,
                });
            }
            app.to_open();
            if let Some(updater) = &mut updater {
                while let Some(order) = app.update_order() {
                    app.updated(&updater.carry_out(&order));
                    while app.poll(lines, clock) {}
                }
                let unwell = app.unwell(clock.0);
                app.watch_trial(unwell, clock.0);
            }
        };
        while let Some(record) = records.next_if(|of| u64::from(of.at_us) <= now_us) {
            clock.0 = record.at_us.into();
            match record.input {
                input if cuts.cut(input, record.at_us.into()) => {}
                Input::Sensor => lines.sensor.received.extend(&record.bytes),
                Input::Gnss => lines.gnss.received.extend(&record.bytes),
            }
            poll(&mut lines, &clock);
            outside.stream.send(&lines.navigation.sent);
            lines.navigation.sent.clear();
            lines.sensor.sent.clear();
        }
        clock.0 = clock.0.max(now_us);
        // what a driver asks the sensor; the simulated one does not answer, but the device does,
        // with what the sensor has said at its start
        for client in outside.stream.clients() {
            client.receive(&mut lines.navigation.received);
        }
        poll(&mut lines, &clock);
        // the learner runs within the pass, so an answer is there at once, for who asked
        for client in outside.command.clients() {
            if client.receive(&mut lines.command.received) {
                poll(&mut lines, &clock);
                client.send(&lines.command.sent);
            }
            lines.command.sent.clear();
        }
        outside.stream.send(&lines.navigation.sent);
        lines.navigation.sent.clear();
        thread::sleep(SLEEP);
    }
    let restarts = app.restarts(clock.0);
    drop(app);
    chip.store = store.map(Store::into_inner).unwrap_or_default();
    chip.program = updater.map_or_else(flashed, Updater::into_inner);
    if restarts {
        Ended::Restart
    } else {
        Ended::Drive
    }
}

/// What takes updates, with the image that the loader starts.
fn started(program: MemoryFlash) -> Option<Updater<MemoryFlash>> {
    let mut slots = Slots::new(program, PLACES)?;
    let slot = slots.to_start()?;
    Updater::new(slots, HARDWARE.name, &DEVELOPMENT_KEY, PLACES.address(slot))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Link, Port, configuration, info};
    use firmware::wire::command::fault;
    use firmware::wire::stim300::config::{Config, LEN};
    use std::io::{Read as _, Write as _};
    use std::net::TcpStream;
    use std::sync::Arc;

    pub(super) fn simulation(seconds: u32, listen: SocketAddr) -> Simulation {
        Simulation {
            unit: Unit::load("stim300").expect("a preset"),
            seconds,
            speed: 100.0,
            cuts: Cuts::default(),
            listen,
        }
    }

    pub(super) const ANY: SocketAddr =
        SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 0);

    /// It answers as the unit's device, keeps what is stored over its power cycle, and ends.
    #[test]
    fn it_is_the_unit_and_keeps_its_store_over_a_power_cycle() {
        let device = Simulated::new(&simulation(20, ANY)).expect("a device");
        let command = device.ports[0].clone();
        let stop = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&stop);
        let (says, said) = std::sync::mpsc::channel();
        let thread = thread::spawn(move || {
            device.run(&ends, &mut |line| {
                let _ = says.send(line.to_owned());
            });
        });
        let port = Port::open("--port", &command, 0).expect("it listens");
        let mut link = Link::new(port, "--port");
        let known = info(&mut link).expect("it answers");
        assert_eq!(known.name.as_deref(), Some("STIM300"));
        assert!(known.stored && known.stores, "{known:?}");
        let held = configuration(&mut link).expect("it answers");
        let line = said.recv().expect("a power cycle");
        assert!(line.starts_with("drive 1 is over"), "{line}");
        assert_eq!(configuration(&mut link).expect("it answers"), held);
        stop.store(true, Ordering::Relaxed);
        thread.join().expect("it ends");
    }

    /// A cut line is silent, and the device says so.
    #[test]
    fn a_cut_sensor_is_a_fault() {
        let mut of = simulation(20, ANY);
        of.cuts.sensor_s = Some(1);
        let device = Simulated::new(&of).expect("a device");
        let command = device.ports[0].clone();
        let stop = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&stop);
        let thread = thread::spawn(move || device.run(&ends, &mut |_| {}));
        let port = Port::open("--port", &command, 0).expect("it listens");
        let mut link = Link::new(port, "--port");
        let mut silent = || link.health().expect("it answers").faults & fault::SILENT != 0;
        assert!((0..10_000).any(|_| silent()), "no fault");
        stop.store(true, Ordering::Relaxed);
        thread.join().expect("it ends");
    }

    /// A driver that asks at any time how the sensor is set up gets its datagram.
    #[test]
    fn a_driver_gets_the_configuration_of_the_sensor() {
        let device = Simulated::new(&simulation(20, ANY)).expect("a device");
        let asked = device.configuration.wire_settings().stim300.config;
        let stream = device.ports[1].clone();
        let stop = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&stop);
        let thread = thread::spawn(move || device.run(&ends, &mut |_| {}));
        let mut driver = TcpStream::connect(&stream["tcp:".len()..]).expect("it listens");
        let mut stream = Vec::new();
        let mut answer = None;
        while answer.is_none() {
            driver.write_all(b"C\r").expect("it takes questions");
            let mut bytes = [0; 1 << 14];
            let len = driver.read(&mut bytes).expect("it sends");
            stream.extend(&bytes[..len]);
            answer = stream.windows(LEN).find_map(|at| Config::parse(at).ok());
            assert!(stream.len() < 20 << 20, "no answer");
        }
        assert_eq!(answer, Some(asked));
        stop.store(true, Ordering::Relaxed);
        thread.join().expect("it ends");
    }

    #[test]
    fn a_line_is_cut_from_its_second_on() {
        let cuts = Cuts {
            sensor_s: None,
            receiver_s: Some(3),
        };
        let cut = |input| [2_999_999, 3_000_000].map(|at| cuts.cut(input, at));
        assert_eq!(cut(Input::Sensor), [false, false]);
        assert_eq!(cut(Input::Gnss), [false, true]);
    }

    #[test]
    fn a_port_that_is_taken_is_refused_by_name() {
        let taken = TcpListener::bind(ANY).expect("a port");
        let at = taken.local_addr().expect("its address");
        let error = Simulated::new(&simulation(2, at)).err().expect("taken");
        let text = error.to_string();
        assert!(
            text.starts_with(&format!("--listen {at}: another program")),
            "{text}"
        );
        let last = SocketAddr::new(ANY.ip(), u16::MAX);
        let error = Simulated::new(&simulation(2, last)).err().expect("none");
        assert!(error.to_string().contains("65534"), "{error}");
    }
}
