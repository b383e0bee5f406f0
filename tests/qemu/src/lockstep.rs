//! A running board and the application on the desktop, step by step: a piece of the sensor's
//! stream goes in, and nothing else is sent before all of its corrected frames have come out. So
//! which sample a fix follows does not depend on the speed of sockets.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use firmware::app::{App, Config, Lines};
use firmware::configuration::Configuration;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::wire::command::{self, Health, MAX_PACKET, Request, Response};
use host_device::device::{Link, images};
use host_device::hil::{Input, MemoryLine, Record, SetClock};

use crate::listening::Listening;

/// How long a board may be silent.
const PATIENCE: Duration = Duration::from_secs(120);

/// The application on the desktop, with the learners of the board.
pub struct Twin {
    app: App<'static>,
    lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine>,
    now: SetClock,
}

impl Twin {
    /// A device that has just been configured. The memory of its learners is never freed.
    #[must_use]
    pub fn new(configuration: &Configuration) -> Self {
        let memory = Box::leak(Box::new(FixMemory::ZEROED));
        let references = Box::leak(Box::new(WindowLearner::new()));
        let learner = Box::leak(Box::new(CombinedLearner {
            references,
            fixes: FixLearner::new(memory, Settings::MEDIUM), // until it is configured
        }));
        Self {
            app: App::with_learner(Config::of(configuration), Some(learner)),
            lines: Lines::default(),
            now: SetClock(0),
        }
    }

    /// Receives a record. Returns what goes to the navigation computer.
    pub fn record(&mut self, record: &Record) -> Vec<u8> {
        self.now.0 = record.at_us.into();
        let line = match record.input {
            Input::Sensor => &mut self.lines.sensor,
            Input::Gnss => &mut self.lines.gnss,
        };
        line.received.extend(&record.bytes);
        self.settle();
        std::mem::take(&mut self.lines.navigation.sent)
    }

    /// Carries out requests and discards the answers.
    pub fn orders(&mut self, requests: &[Request]) {
        for request in requests {
            let mut packet = [0; MAX_PACKET];
            if let Ok(packet) = command::encode(0, request, &mut packet) {
                self.lines.command.received.extend(&*packet);
            }
            self.settle();
        }
        self.lines.command.sent.clear();
    }

    fn settle(&mut self) {
        while self.app.poll(&mut self.lines, &self.now) {}
    }

    /// The answer to `GetHealth`.
    ///
    /// # Errors
    /// There is no answer.
    pub fn health(&mut self) -> Result<Health> {
        let mut packet = [0; MAX_PACKET];
        let packet = command::encode(0, &Request::GetHealth, &mut packet);
        let packet = packet.map_err(|error| anyhow::anyhow!("{error:?}"))?;
        self.lines.command.received.extend(&*packet);
        self.settle();
        let mut answer = std::mem::take(&mut self.lines.command.sent);
        match command::decode::<Response>(&mut answer) {
            Ok((_, Response::Health(health))) => Ok(health),
            other => bail!("{other:?}"),
        }
    }

    /// The weights learnt, as the command link carries them.
    ///
    /// # Errors
    /// Nothing was learnt.
    pub fn learnt(&mut self) -> Result<Vec<u8>> {
        Ok(images(&self.app.learnt().context("no learner")?))
    }
}

/// A board in QEMU, with its sensor, navigation and receiver lines.
pub struct Board {
    sensor: TcpStream,
    navigation: TcpStream,
    receiver: TcpStream,
    /// Its command link.
    pub link: Link,
}

impl Board {
    /// Connects.
    ///
    /// # Errors
    /// QEMU does not listen.
    pub fn connect(listening: &Listening) -> Result<Self> {
        let [sensor, navigation, receiver, command] = &listening.ports;
        let open = |name: &str| -> Result<TcpStream> {
            let stream = TcpStream::connect(name.strip_prefix("tcp:").unwrap_or(name))?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            Ok(stream)
        };
        Ok(Self {
            sensor: open(sensor)?,
            navigation: open(navigation)?,
            receiver: open(receiver)?,
            link: Link::open("--port", command, 0)?,
        })
    }

    /// Sends bytes on the sensor line and reads `expected` bytes from the navigation line.
    ///
    /// # Errors
    /// A line breaks, or fewer bytes arrive in time.
    pub fn through(&mut self, bytes: &[u8], expected: usize) -> Result<Vec<u8>> {
        // QEMU takes what fits and the rest as the board reads it: write from another thread
        let mut sensor = self.sensor.try_clone()?;
        let navigation = &mut self.navigation;
        let mut came = vec![0; expected];
        std::thread::scope(|scope| {
            let sent = scope.spawn(move || sensor.write_all(bytes));
            let read = navigation.read_exact(&mut came);
            sent.join()
                .unwrap_or_else(|_| Err(ErrorKind::Other.into()))?;
            read.context("the board sends less than the desktop")
        })?;
        Ok(came)
    }

    /// Sends a fix and waits until the board has it as its `number`th.
    ///
    /// # Errors
    /// A line breaks, or the board does not get it.
    pub fn fix(&mut self, bytes: &[u8], number: u32) -> Result<()> {
        self.receiver.write_all(bytes)?;
        let begun = Instant::now();
        while self.link.counters()?.good_fixes < number {
            ensure!(begun.elapsed() < PATIENCE, "fix {number} does not arrive");
        }
        Ok(())
    }
}

/// Sends the records to the twin and, if there is one, to a board, in step. Fails where the board
/// sends anything else. Returns the number of the sensor's bytes that were changed.
///
/// # Errors
/// A line breaks, or the streams differ.
pub fn in_step(twin: &mut Twin, mut board: Option<&mut Board>, records: &[Record]) -> Result<u32> {
    let (mut fixes, mut changed, mut at) = (0, 0, 0);
    let same_line = |a: &Record, b: &Record| a.input == b.input;
    for group in records.chunk_by(same_line) {
        let mut expected = Vec::new();
        for record in group {
            expected.extend(twin.record(record));
        }
        let bytes: Vec<u8> = group.iter().flat_map(|r| r.bytes.clone()).collect();
        if group.first().is_some_and(|r| r.input == Input::Gnss) {
            for record in group {
                fixes += 1;
                if let Some(board) = &mut board {
                    board.fix(&record.bytes, fixes)?;
                }
            }
            continue;
        }
        changed += bytes.iter().zip(&expected).filter(|(a, b)| a != b).count() as u32;
        if let Some(board) = &mut board {
            let came = board.through(&bytes, expected.len())?;
            if let Some(byte) = came.iter().zip(&expected).position(|(a, b)| a != b) {
                bail!("the stream differs from byte {} on", at + byte);
            }
        }
        at += expected.len();
    }
    Ok(changed)
}
