//! The board in the middle of a drive: its memory, which is put into a board that has just started.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use firmware::configuration::{Activation, Configuration, Sensor};
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use host_core::simulator::imu::ImuSpec;
use host_device::hil::{Input, Record, drive_configured, not_in_real_time};
use qemu::debugger::Debugger;
use qemu::images::BOARDS;
use qemu::live::{Live, through};
use qemu::memory::{RAM_START, address};
use qemu::protocol::{counters, health, obey, set_up_configured};
use upsets::device::{Scenario, configured};

/// Seconds after each flip.
const SECONDS: u32 = 3;
/// Bytes of RAM.
const RAM: usize = 192 * 1024;
/// Time of the board: the count of timer 2.
const TIMER: u32 = 0x4000_0024;
/// SysTick's control, with and without its interrupt.
const SYSTICK: (u32, u32, u32) = (0xE000_E010, 7, 5);
/// ICSR, and its bit that clears a SysTick that is pending.
const PENDING_SYSTICK: (u32, u32) = (0xE000_ED04, 1 << 25);
/// Status of the UARTs of sensor and receiver; this bit is set while a byte waits there.
const STATUS: [u32; 2] = [0x4001_1000, 0x4000_4800];
const WAITS: u8 = 1 << 5;
/// How long the board may run until it stops.
pub const PATIENCE: Duration = Duration::from_secs(120);
/// Frames after which a board that sends nothing is given up.
const GIVEN_UP: usize = 6;

/// The board's memory at a moment of a drive at which it sleeps, and the drive's rest.
pub struct Moment {
    pub scenario: Scenario,
    pub configuration: Configuration,
    pub records: Vec<Record>,
    image: PathBuf,
    elf: Vec<u8>,
    ram: Vec<u8>,
    registers: String,
    time: u32,
    fixes: u32,
}

/// A board after that moment.
pub struct Running<'m> {
    moment: &'m Moment,
    pub live: Live,
    pub debugger: Option<Debugger>,
    /// What left after each frame.
    pub after: Vec<Vec<u8>>,
    fixes: u32,
    gets_fixes: bool,
    silent: usize,
}

impl Moment {
    /// Drives up to it. The learner of a board on a busy machine may fall behind, and then the
    /// drive begins again, slower.
    pub fn driven(scenario: Scenario, image: &Path) -> Result<Self> {
        let pauses = [150, 600, 2400].map(Duration::from_millis);
        patiently(pauses, |pause| Self::driven_with(scenario, image, pause))
    }

    /// Drives up to it, with pauses in which the learner computes.
    fn driven_with(scenario: Scenario, image: &Path, pause: Duration) -> Result<Self> {
        let mut configuration = slow(configured(scenario));
        not_in_real_time(&mut configuration);
        if scenario == Scenario::Learn {
            // what fixes teach proves itself only after more driving than QEMU has time for
            configuration.correction.activation = Activation::FirstRest;
        }
        let errors = ImuSpec::preset("medium").context("no preset")?;
        // a drive before the first flip, and how much of it is at rest, s
        let [lead, rest] = match scenario {
            Scenario::Learn => [160, 60],
            _ => [20, 10],
        };
        let seconds = [lead + SECONDS, rest];
        let drive = drive_configured(&configuration, ImuFormat::Stim300, &errors, seconds)?;
        let mut records = drive.records;
        let later = records.split_off(records.partition_point(|r| r.at_us < lead * 1_000_000));
        let mut live = Live::start(BOARDS[0], image)?;
        let mode = match scenario {
            Scenario::Bypass => Mode::Bypass,
            Scenario::Frozen => Mode::Frozen,
            Scenario::Learn => Mode::Learn,
        };
        obey(&mut live, &set_up_configured(&configuration, mode)?)?;
        let (mut fixes, mut changed) = (0, false);
        for group in records.chunk_by(|a, b| a.input == b.input) {
            let bytes: Vec<u8> = group.iter().flat_map(|r| r.bytes.clone()).collect();
            if group[0].input == Input::Sensor {
                let sent = through(&live.sensor, &bytes, &live.navigation, bytes.len())?;
                ensure!(sent.len() == bytes.len(), "{} bytes left", sent.len());
                changed = sent != bytes;
            } else {
                live.gnss.write_all(&bytes)?;
                fixes += group.len() as u32;
                fix(&mut live, fixes, 60)?;
                sleep(pause);
            }
        }
        let health = health(&mut live.command)?;
        ensure!(changed, "it does not correct: {health:?}");
        ensure!(
            scenario != Scenario::Learn || health.navigates,
            "{health:?}"
        );
        let elf = std::fs::read(image)?;
        let mut debugger = live.debugger()?;
        idle(&mut debugger, &elf)?;
        Ok(Self {
            scenario,
            configuration,
            records: later,
            image: image.to_owned(),
            ram: debugger.read(RAM_START as u32, RAM)?,
            registers: debugger.registers()?,
            time: u32::from_le_bytes(debugger.read(TIMER, 4)?.try_into().ok().context("a word")?),
            elf,
            fixes,
        })
    }

    /// A board that has just started, with this memory. It stands still.
    pub fn board(&self) -> Result<Running<'_>> {
        let mut live = Live::start(BOARDS[0], &self.image)?;
        health(&mut live.command)?;
        let mut debugger = live.debugger()?;
        idle(&mut debugger, &self.elf)?;
        debugger.write(RAM_START as u32, &self.ram)?;
        debugger.set_registers(&self.registers)?;
        self.store(&mut debugger, TIMER, self.time)?;
        Ok(Running {
            moment: self,
            live,
            debugger: Some(debugger),
            after: Vec::new(),
            fixes: self.fixes,
            gets_fixes: true,
            silent: 0,
        })
    }

    /// The address of a symbol.
    pub fn symbol(&self, name: &str) -> Result<u32> {
        Ok(address(&self.elf, name)? as u32)
    }

    /// Where the board sleeps.
    pub fn sleeps(&self) -> Result<Vec<u32>> {
        sleeps(&self.elf)
    }

    /// Its functions: where each begins, and its name.
    pub fn functions(&self) -> Result<std::collections::BTreeMap<u32, String>> {
        use object::{Object, ObjectSymbol, SymbolKind};
        let elf = object::File::parse(&*self.elf)?;
        let functions = elf.symbols().filter(|s| s.kind() == SymbolKind::Text);
        let functions = functions.filter(|s| s.size() > 0);
        let named = |s: object::Symbol| {
            let name = format!(
                "{:#}",
                rustc_demangle::demangle(s.name().unwrap_or_default())
            );
            (s.address() as u32 & !1, name)
        };
        Ok(functions.map(named).collect())
    }

    /// The core itself stores a word: the debugger cannot write to peripherals.
    fn store(&self, debugger: &mut Debugger, to: u32, word: u32) -> Result<()> {
        const STR_R1_R0: u16 = 0x6001;
        let place = *places(&self.elf, STR_R1_R0)?.first().context("no store")?;
        let registers = debugger.registers()?;
        for (register, value) in [(0, to), (1, word), (25, 1 << 24), (15, place)] {
            debugger.set(register, value)?;
        }
        debugger.step()?;
        debugger.set_registers(&registers)
    }
}

/// The first attempt that is right, or the last one.
pub fn patiently<A, T>(
    attempts: impl IntoIterator<Item = A>,
    attempt: impl Fn(A) -> Result<T>,
) -> Result<T> {
    let mut last = Err(anyhow::anyhow!("no attempt"));
    for of in attempts {
        last = attempt(of);
        match &last {
            Ok(_) => break,
            Err(error) => println!("once more: {error:#}"),
        }
    }
    last
}

/// The same with frames at 125 Hz, since QEMU passes only some hundred a second.
fn slow(mut configuration: Configuration) -> Configuration {
    let mut settings = configuration.wire_settings();
    settings.stim300.config = settings.stim300.config.with_sample_rate_code(0);
    configuration.sensor = Some(Sensor::Stream(ImuFormat::Stim300.settings(&settings)));
    configuration.rate = 125.0;
    configuration
}

/// Where this halfword is in the program.
fn places(elf: &[u8], halfword: u16) -> Result<Vec<u32>> {
    use object::{Object, ObjectSection};
    let elf = object::File::parse(elf)?;
    let text = elf.section_by_name(".text").context("no program")?;
    let halfwords = text.data()?.chunks(2).enumerate();
    let found = halfwords.filter(|(_, bytes)| *bytes == halfword.to_le_bytes());
    Ok(found
        .map(|(n, _)| text.address() as u32 + 2 * n as u32)
        .collect())
}

/// Where the board sleeps.
fn sleeps(elf: &[u8]) -> Result<Vec<u32>> {
    places(elf, 0xBF30)
}

/// Lets the board run until it sleeps.
fn idle(debugger: &mut Debugger, elf: &[u8]) -> Result<()> {
    for stops in [true, false] {
        for place in sleeps(elf)? {
            debugger.stop_at(place, stops)?;
        }
        if stops {
            debugger.run()?;
            ensure!(debugger.wait(Duration::from_secs(60))?, "it never sleeps");
        }
    }
    Ok(())
}

/// Waits until the board has got so many fixes.
fn fix(live: &mut Live, number: u32, limit_s: u64) -> Result<()> {
    let begun = Instant::now();
    while counters(&mut live.command)?.good_fixes < number {
        ensure!(begun.elapsed().as_secs() < limit_s, "fix {number}");
    }
    Ok(())
}

impl Running<'_> {
    pub fn debugger(&mut self) -> Result<&mut Debugger> {
        self.debugger.as_mut().context("it has left")
    }

    /// Runs up to a record, all of which but the last byte has then come, and stops while it
    /// sleeps.
    pub fn up_to(&mut self, record: usize) -> Result<()> {
        self.debugger()?.run()?;
        for before in 0..record {
            self.record(before, 0)?;
        }
        let Record { bytes, input, .. } = &self.moment.records[record];
        let line = match input {
            Input::Sensor => &mut self.live.sensor,
            Input::Gnss => &mut self.live.gnss,
        };
        line.write_all(&bytes[..bytes.len() - 1])?;
        self.all_came()?;
        let moment = self.moment;
        let debugger = self.debugger()?;
        debugger.interrupt()?;
        idle(debugger, &moment.elf)
    }

    /// Waits until the board has taken every byte.
    fn all_came(&mut self) -> Result<()> {
        let mut looks = 0;
        while looks < 5 {
            sleep(Duration::from_millis(10)); // QEMU takes the next byte
            looks += 1;
            for status in STATUS {
                let text = self.live.monitor(&format!("xp /1wx {status:#x}"))?;
                let word = text.split("0x").last().and_then(|word| word.get(..8));
                let word = u32::from_str_radix(word.context("no word")?, 16)?;
                if word & u32::from(WAITS) != 0 {
                    looks = 0;
                }
            }
        }
        Ok(())
    }

    /// SysTick interrupts, or not: the time that the debugger takes would bring it at random.
    pub fn ticks(&mut self, ticks: bool) -> Result<()> {
        let moment = self.moment;
        let debugger = self.debugger()?;
        let (control, on, off) = SYSTICK;
        moment.store(debugger, control, if ticks { on } else { off })?;
        let (state, clear) = PENDING_SYSTICK;
        moment.store(debugger, state, clear)
    }

    /// The last byte of a record comes while the board stands still.
    pub fn last_byte(&mut self, record: usize) -> Result<()> {
        let Record { bytes, input, .. } = &self.moment.records[record];
        let (line, status) = match input {
            Input::Sensor => (&mut self.live.sensor, STATUS[0]),
            Input::Gnss => (&mut self.live.gnss, STATUS[1]),
        };
        line.write_all(&bytes[bytes.len() - 1..])?;
        self.waits(status)
    }

    fn waits(&mut self, status: u32) -> Result<()> {
        let begun = Instant::now();
        while self.debugger()?.read(status, 4)?[0] & WAITS == 0 {
            ensure!(begun.elapsed() < Duration::from_secs(5), "no byte comes");
        }
        Ok(())
    }

    /// All of a frame but its last byte comes; otherwise the board stands still.
    pub fn interrupted(&mut self, record: usize) -> Result<()> {
        let moment = self.moment;
        let bytes = &moment.records[record].bytes;
        for byte in &bytes[..bytes.len() - 1] {
            self.live.sensor.write_all(&[*byte])?;
            self.waits(STATUS[0])?;
            let debugger = self.debugger()?;
            loop {
                let place = debugger.get(15)?;
                debugger.stop_at(place, true)?;
                debugger.run()?;
                ensure!(debugger.wait(PATIENCE)?, "no return from an interrupt");
                debugger.stop_at(place, false)?;
                if debugger.read(STATUS[0], 4)?[0] & WAITS == 0 {
                    break;
                }
                debugger.step()?; // interrupts are masked here
            }
        }
        Ok(())
    }

    /// A record comes, without its first `sent` bytes, and what it causes leaves.
    pub fn record(&mut self, record: usize, sent: usize) -> Result<()> {
        let Record { bytes, input, .. } = &self.moment.records[record];
        if *input == Input::Gnss {
            self.fixes += 1;
            // a board that is gone, or restarted, is judged by its frames
            let well = self.gets_fixes && self.silent == 0;
            if well && self.live.gnss.write_all(&bytes[sent..]).is_ok() {
                self.gets_fixes = fix(&mut self.live, self.fixes, 3).is_ok();
            }
            return Ok(());
        }
        let mut left = Vec::new();
        if self.silent < GIVEN_UP && self.live.sensor.write_all(&bytes[sent..]).is_ok() {
            left = self.leaves(bytes)?;
        }
        self.silent = if left.is_empty() { self.silent + 1 } else { 0 };
        self.after.push(left);
        Ok(())
    }

    /// Whether it sends.
    pub fn sends(&self) -> bool {
        self.silent == 0
    }

    /// What leaves until it is a frame as long as this one, or until nothing comes any more.
    fn leaves(&mut self, frame: &[u8]) -> Result<Vec<u8>> {
        let (mut left, mut buffer) = (Vec::new(), [0; 4096]);
        let mut limit = Duration::from_secs(2);
        while left.len() != frame.len() || left[0] != frame[0] {
            self.live.navigation.set_read_timeout(Some(limit))?;
            // the frame after it may have left, too
            let missing = frame.len().saturating_sub(left.len());
            let most = if missing > 0 { missing } else { buffer.len() };
            match self.live.navigation.read(&mut buffer[..most]) {
                Ok(0) | Err(_) => break,
                Ok(n) => left.extend(&buffer[..n]),
            }
            if left.len() >= frame.len() {
                limit = Duration::from_millis(200);
            }
        }
        Ok(left)
    }
}
