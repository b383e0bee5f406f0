//! Feeds the lines and gathers the stream, in real time or as fast as the lines accept it.

use super::drive::{Input, Record};
use crate::device::Port;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// A board that has sent nothing for this long is done or has fallen silent.
const QUIET: Duration = Duration::from_secs(3);

/// The board's lines.
#[derive(Debug)]
pub struct Lines {
    /// Port that replaces the sensor.
    pub imu: Port,
    /// Port that replaces the navigation computer.
    pub nav: Port,
    /// Port that replaces the receiver, if the board has one.
    pub gnss: Option<Port>,
}

impl Lines {
    /// Discards what arrived earlier.
    ///
    /// # Errors
    /// A port is broken.
    pub fn drain(&mut self) -> io::Result<()> {
        let mut buffer = [0; 4096];
        let start = Instant::now();
        for port in [&mut self.imu, &mut self.nav] {
            while port.receive(&mut buffer)? > 0 && start.elapsed() < QUIET {}
        }
        Ok(())
    }
}

/// The data that a run received.
#[derive(Debug, Default)]
pub struct Gathered {
    /// The bytes that the board sent to the navigation computer.
    pub bytes: Vec<u8>,
    /// Number of bytes received, and the time.
    pub received: Vec<(usize, Instant)>,
    /// Time at which each record of the sensor had been handed to the port. Shorter after an
    /// interruption.
    pub sent: Vec<Instant>,
}

/// Settings of a run.
pub struct Run<'a> {
    /// Whether to send as fast as the lines accept it instead of in real time.
    pub fast: bool,
    /// Ends the run after the present record when set.
    pub stop: &'a AtomicBool,
    /// Called with the number of bytes received.
    pub progress: &'a (dyn Fn(usize) + Sync),
}

impl Run<'_> {
    /// Whether the run is to end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Sends `records` and gathers what the board sends, until `expected` bytes have been received
    /// or the board falls silent.
    ///
    /// # Errors
    /// A port is broken.
    pub fn through(
        &self,
        lines: &mut Lines,
        records: &[Record],
        expected: usize,
    ) -> io::Result<Gathered> {
        let mut gnss = lines.gnss.as_ref().map(Port::duplicate).transpose()?;
        let mut imu = lines.imu.duplicate()?;
        let mut answers = lines.imu.duplicate()?;
        let (fed, over) = (AtomicBool::new(false), AtomicBool::new(false));
        let start = Instant::now();
        thread::scope(|scope| {
            let receiver = scope.spawn(|| match &mut gnss {
                Some(port) => self
                    .feed(port, records, (Input::Gnss, start), &over)
                    .map(drop),
                None => Ok(()),
            });
            let sensor = scope.spawn(|| {
                let sent = self.feed(&mut imu, records, (Input::Sensor, start), &over);
                fed.store(true, Ordering::Release);
                sent
            });
            // the board may ask the sensor for its configuration, which the drive contains anyway:
            // discard the requests
            scope.spawn(|| {
                let mut buffer = [0; 256];
                while !fed.load(Ordering::Acquire) {
                    if answers.receive(&mut buffer).is_err() {
                        break; // the sender reports it
                    }
                }
            });
            let gathered = self.gather(&mut lines.nav, expected, &fed);
            // a board that fell silent is sent nothing more; one that has sent everything may still
            // be receiving the last fix
            let whole = matches!(&gathered, Ok(gathered) if gathered.bytes.len() >= expected);
            over.store(!whole, Ordering::Relaxed);
            let mut gathered = gathered?;
            gathered.sent = joined(sensor)?;
            joined(receiver)?;
            Ok(gathered)
        })
    }

    fn feed(
        &self,
        port: &mut Port,
        records: &[Record],
        (input, start): (Input, Instant),
        over: &AtomicBool,
    ) -> io::Result<Vec<Instant>> {
        let from = records.first().map_or(0, |record| record.at_us);
        let mut sent = Vec::new();
        let stopped = || self.stopped() || over.load(Ordering::Relaxed);
        for record in records.iter().filter(|record| record.input == input) {
            if !self.fast {
                let due = start + Duration::from_micros(u64::from(record.at_us - from));
                while !stopped()
                    && let Some(left) = due.checked_duration_since(Instant::now())
                {
                    thread::sleep(left.min(Duration::from_millis(50)));
                }
            }
            if stopped() || !port.send(&record.bytes, &stopped)? {
                break;
            }
            sent.push(Instant::now());
        }
        Ok(sent)
    }

    fn gather(&self, nav: &mut Port, expected: usize, fed: &AtomicBool) -> io::Result<Gathered> {
        let mut gathered = Gathered::default();
        let mut buffer = [0; 4096];
        let mut last = Instant::now();
        while gathered.bytes.len() < expected {
            let len = nav.receive(&mut buffer)?;
            if len > 0 {
                last = Instant::now();
                gathered
                    .bytes
                    .extend_from_slice(buffer.get(..len).unwrap_or_default());
                gathered.received.push((gathered.bytes.len(), last));
                (self.progress)(gathered.bytes.len());
            } else if last.elapsed() > QUIET || (self.stopped() && fed.load(Ordering::Acquire)) {
                break;
            }
        }
        Ok(gathered)
    }
}

fn joined<T>(thread: thread::ScopedJoinHandle<'_, io::Result<T>>) -> io::Result<T> {
    thread
        .join()
        .unwrap_or_else(|_| Err(io::Error::other("a sender panicked")))
}
