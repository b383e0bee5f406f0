//! Runs against boards that are threads: the application at sockets, intact or with one fault.

use super::*;
use firmware::app::{App, Config};
use firmware::link::{Clock, Full, Line, Lost};
use firmware::wire::command::key::{Key, SECRET_LEN};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::Ordering;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Fault of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// It sends nothing more after this number of bytes.
    SilentAfter(usize),
    /// Its navigation line has another bit rate, so its bytes are corrupted.
    Baud,
    /// One bit of the byte with this number is wrong.
    Bit(usize),
    /// Nothing answers at the command link.
    Deaf,
}

struct Socket {
    stream: TcpStream,
    fault: Fault,
    sent: usize,
}

impl Line for Socket {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        Ok(self.stream.read(buffer).unwrap_or(0))
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        let mut bytes = message.to_vec();
        match self.fault {
            Fault::SilentAfter(limit) if self.sent + bytes.len() > limit => return Ok(()),
            Fault::Baud => bytes.iter_mut().for_each(|byte| *byte = *byte << 1 | 0x80),
            Fault::Bit(at) if (self.sent..self.sent + bytes.len()).contains(&at) => {
                bytes[at - self.sent] ^= 1;
            }
            Fault::Deaf => return Ok(()),
            _ => {}
        }
        self.sent += bytes.len();
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            match self.stream.write(rest) {
                Ok(taken) => rest = &rest[taken..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => thread::yield_now(),
                Err(_) => break, // the other end has gone
            }
        }
        Ok(())
    }
}

/// A slowed host clock, so that a busy computer does not look like a silent sensor.
struct Slow(Instant);

impl Clock for Slow {
    fn now_us(&self) -> u64 {
        self.0.elapsed().as_micros() as u64 / 100
    }
}

struct Board {
    ports: [String; 4],
    stop: std::sync::Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Board {
    fn new(fault: Fault) -> Self {
        Self::with_key(fault, Key::Unprovisioned)
    }

    fn with_key(fault: Fault, key: Key) -> Self {
        let listeners = [0; 4].map(|_| TcpListener::bind("127.0.0.1:0").expect("a port"));
        let ports = [0, 1, 2, 3]
            .map(|at: usize| format!("tcp:{}", listeners[at].local_addr().expect("bound")));
        let stop = std::sync::Arc::new(AtomicBool::new(false));
        let ended = std::sync::Arc::clone(&stop);
        let thread = thread::spawn(move || {
            let [sensor, navigation, gnss, command] = listeners.map(|listener| {
                let (stream, _) = listener.accept().expect("somebody connects");
                stream.set_nonblocking(true).expect("a socket");
                stream
            });
            let line = |stream, fault| Socket {
                stream,
                fault,
                sent: 0,
            };
            let deaf = if fault == Fault::Deaf {
                fault
            } else {
                Fault::None
            };
            let torn = if fault == Fault::Deaf {
                Fault::None
            } else {
                fault
            };
            let mut lines = firmware::app::Lines {
                sensor: line(sensor, Fault::None),
                navigation: line(navigation, torn),
                gnss: line(gnss, Fault::None),
                command: line(command, deaf),
            };
            let mut app = App::new(Config::default());
            app.set_key(key);
            app.seed([7; 32]);
            let clock = Slow(Instant::now());
            while !ended.load(Ordering::Relaxed) {
                if !app.poll(&mut lines, &clock) {
                    thread::sleep(Duration::from_micros(200));
                }
            }
        });
        Self {
            ports,
            stop,
            thread: Some(thread),
        }
    }

    /// Sends four seconds of drive through the board.
    fn run(&self) -> Result<Report, Error> {
        self.run_as(None)
    }

    fn run_as(&self, key: Option<Secret>) -> Result<Report, Error> {
        let [imu, nav, gnss, command] = self.ports.clone();
        let setup = Setup {
            imu,
            nav,
            gnss: Some(gnss),
            command: Some(command),
            key,
            baud: 921_600,
            configuration: Configuration::default(),
            format: ImuFormat::Stim300,
            errors: None,
            seconds: 4,
            fast: true,
        };
        let control = Control {
            stop: &AtomicBool::new(false),
            progress: &|_, _| {},
        };
        run(&setup, control)
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Bytes of the first second: the configuration twice, and frames of 28 bytes.
fn lead() -> usize {
    2 * firmware::wire::stim300::config::LEN + 249 * 28
}

#[test]
fn a_good_board_is_equal_and_can_be_run_again() {
    let board = Board::new(Fault::None);
    let report = board.run().expect("it runs");
    let verdict = &report.verdict;
    report.check("nav").expect("equal");
    assert!(
        verdict.equal && verdict.navigation_equal && report.corrected,
        "{report:?}"
    );
    assert_eq!((verdict.expected, verdict.received), (750, 750));
    assert_eq!(
        (
            verdict.counter_errors,
            verdict.bad_checksums,
            verdict.garbage_bytes
        ),
        (0, 0, 0)
    );
    assert!(verdict.stream_error_m < 5.0, "{verdict:?}");
    assert_eq!((report.silences, report.fixes), (Some(0), Some(4)));
}

#[test]
fn a_board_with_a_key_needs_it() {
    let secret = Secret(core::array::from_fn(|k| k as u8));
    let board = Board::with_key(Fault::None, Key::Secret(secret));
    let report = board.run_as(Some(secret)).expect("it runs");
    report.check("nav").expect("equal");
    assert!(report.verdict.equal && report.corrected, "{report:?}");
    for key in [None, Some(Secret([9; SECRET_LEN]))] {
        let board = Board::with_key(Fault::None, Key::Secret(secret));
        let error = board.run_as(key).expect_err("refused").to_string();
        assert!(error.contains("--key FILE"), "{error}");
    }
}

#[test]
fn one_bit_of_the_stream_is_found() {
    let at = lead() + 10 * 28 + 7;
    let report = Board::new(Fault::Bit(at)).run().expect("it runs");
    assert!(report.check("nav").is_err());
    let verdict = report.verdict;
    assert_eq!(verdict.first_difference, Some(10 * 28 + 7));
    assert_eq!(
        (verdict.bad_checksums, verdict.received),
        (1, verdict.expected - 1)
    );
    assert!(!verdict.equal && !verdict.navigation_equal);
}

#[test]
fn a_board_that_falls_silent_is_reported() {
    let report = Board::new(Fault::SilentAfter(lead() + 28 * 100))
        .run()
        .expect("it runs");
    assert_eq!(report.verdict.received, 100);
    let error = report.check("tcp:x").expect_err("silent").to_string();
    assert!(
        error.starts_with("--nav tcp:x: the board fell silent after 100 of 750 samples"),
        "{error}"
    );
}

#[test]
fn silence_or_noise_from_the_start_is_reported_with_its_remedy() {
    for (fault, what) in [
        (
            Fault::SilentAfter(0),
            "nothing arrives although frames go into",
        ),
        (Fault::Baud, "bytes arrived that are not the Stim300 frames"),
        (Fault::Deaf, "no answer to GetVersion"),
    ] {
        let error = Board::new(fault)
            .run()
            .expect_err("it cannot run")
            .to_string();
        assert!(
            error.contains(what) && error.contains("bit rate"),
            "{fault:?}: {error}"
        );
    }
}
