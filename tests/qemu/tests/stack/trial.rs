//! A trial: where the board is stopped, which bit flips, and what becomes of it.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use host_device::hil::Input;
use qemu::protocol::{counters, health, reset};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use upsets::device::DeviceOutput;
use upsets::judge::{Judge, Verdict};

use crate::board::{Moment, PATIENCE, Running, patiently};

/// What the board does when it is stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Work {
    /// The frame path, for a frame.
    Frame,
    /// The frame path and the learner, for the frame that ends a block.
    Block,
    /// The learner, for a fix.
    Fix,
    /// The frame path, which has interrupted the learner.
    Both,
}

/// A record, and the functions that are called for it, each with the number of its calls.
#[derive(Default)]
struct Called {
    record: usize,
    functions: BTreeMap<u32, u32>,
    /// Those that only the main thread calls.
    thread: BTreeMap<u32, u32>,
}

/// Trials from one moment on.
pub struct Trials<'m> {
    moment: &'m Moment,
    names: BTreeMap<u32, String>,
    sleeps: Vec<u32>,
    called: [Called; 3],
    judge: Judge,
}

/// A board that has been stopped, and how many bytes of the frame after it have come already.
struct Stopped<'m> {
    running: Running<'m>,
    record: usize,
    both: bool,
    function: u32,
}

/// Number of the record that is a frame like most.
const FRAME: usize = 20;
/// Of the program status: the number of the exception, 0 in the main thread.
const EXCEPTION: u32 = 0x1FF;
/// Calls of a function that are counted.
const CALLS: u32 = 16;

impl<'m> Trials<'m> {
    /// Finds what the board does for some records.
    pub fn new(moment: &'m Moment) -> Result<Self> {
        let names = moment.functions()?;
        let fix = moment.records.iter().position(|r| r.input == Input::Gnss);
        let mut trials = Self {
            moment,
            names,
            sleeps: moment.sleeps()?,
            called: Default::default(),
            judge: judge(moment, DeviceOutput::default())?,
        };
        let records = [FRAME, trials.end_of_block()?, fix.context("no fix")?];
        for (number, record) in records.into_iter().enumerate() {
            trials.called[number] = trials.called(record)?;
        }
        // a busy machine may lose a frame, or make the learner late
        patiently(0..3, |_| {
            let judge = judge(moment, trials.without(Work::Frame)?)?;
            for work in [Work::Block, Work::Fix, Work::Both] {
                let left = trials.without(work)?;
                let verdict = judge.judge(came(moment), &left);
                ensure!(
                    verdict == Verdict::Same,
                    "without a flip, {work:?}: {verdict:?}, faults {:#x}",
                    left.faults
                );
            }
            Ok(judge)
        })
        .map(|judge| Self { judge, ..trials })
    }

    /// A trial without a flip.
    fn without(&self, work: Work) -> Result<DeviceOutput> {
        let stopped = self.stopped(work, &mut ChaCha8Rng::seed_from_u64(0))?;
        Ok(self.after(stopped)?.0)
    }

    /// The first frame that ends a block.
    fn end_of_block(&self) -> Result<usize> {
        let name = |name: &str| name.contains("ompensator") && name.ends_with("end_block");
        let place = self.names.iter().find(|(_, text)| name(text));
        let place = *place.context("no end of a block")?.0;
        let mut running = self.moment.board()?;
        running.debugger()?.stop_at(place, true)?;
        running.debugger()?.run()?;
        for record in 0..self.moment.records.len() {
            running.record(record, 0)?;
            if running.debugger()?.wait(Duration::from_millis(1))? {
                return Ok(record);
            }
        }
        anyhow::bail!("no block ends")
    }

    /// What is called for a record until the board sleeps.
    fn called(&self, record: usize) -> Result<Called> {
        let mut running = self.moment.board()?;
        running.up_to(record)?;
        running.ticks(false)?;
        running.last_byte(record)?;
        let debugger = running.debugger()?;
        debugger.step()?; // wakes up
        let all = self.names.keys().copied();
        for place in all.chain(self.sleeps.iter().copied()) {
            debugger.stop_at(place, true)?;
        }
        let (mut functions, mut interrupts) = (BTreeMap::new(), BTreeSet::new());
        loop {
            debugger.run()?;
            ensure!(debugger.wait(PATIENCE)?, "it does not sleep any more");
            let place = debugger.get(15)?;
            if self.sleeps.contains(&place) {
                let mut thread = functions.clone();
                thread.retain(|place, _| !interrupts.contains(place));
                return Ok(Called {
                    record,
                    functions,
                    thread,
                });
            }
            if debugger.get(25)? & EXCEPTION != 0 {
                interrupts.insert(place);
            }
            let calls = functions.entry(place).or_insert(0);
            *calls += 1;
            if *calls == CALLS {
                debugger.stop_at(place, false)?;
            }
            debugger.step()?;
        }
    }

    /// A board that is stopped at random in this work.
    fn stopped(&self, work: Work, random: &mut ChaCha8Rng) -> Result<Stopped<'m>> {
        let [frame, block, fix] = &self.called;
        let (at, functions) = match work {
            Work::Frame => (frame, &frame.functions),
            Work::Block => (block, &block.functions),
            Work::Fix => (fix, &fix.functions),
            Work::Both => (block, &block.thread),
        };
        let mut running = self.moment.board()?;
        running.up_to(at.record)?;
        running.ticks(false)?;
        running.last_byte(at.record)?;
        running.debugger()?.step()?; // wakes up
        let mut function = self.stop_in(&mut running, functions, random)?;
        let both = work == Work::Both;
        if both {
            running.interrupted(at.record + 1)?;
            running.last_byte(at.record + 1)?;
            function = self.stop_in(&mut running, &frame.functions, random)?;
        }
        running.ticks(true)?;
        Ok(Stopped {
            running,
            record: at.record,
            both,
            function,
        })
    }

    /// Stops at one of the first calls of one of these functions, and some instructions later; or
    /// where the board sleeps, if there are not so many calls.
    fn stop_in(
        &self,
        running: &mut Running,
        functions: &BTreeMap<u32, u32>,
        random: &mut ChaCha8Rng,
    ) -> Result<u32> {
        let number = random.random_range(0..functions.len());
        let (&function, &calls) = functions.iter().nth(number).context("no function")?;
        let (calls, later) = (random.random_range(1..=calls), random.random_range(0..200));
        let debugger = running.debugger()?;
        let stops = || self.sleeps.iter().copied().chain([function]);
        for place in stops() {
            debugger.stop_at(place, true)?;
        }
        let mut sleeps = false;
        for call in 0..calls {
            if call > 0 {
                debugger.step()?;
            }
            debugger.run()?;
            ensure!(debugger.wait(PATIENCE)?, "it does not sleep any more");
            sleeps = debugger.get(15)? != function;
            if sleeps {
                break;
            }
        }
        for place in stops() {
            debugger.stop_at(place, false)?;
        }
        for _ in 0..if sleeps { 0 } else { later } {
            debugger.step()?;
            if self.sleeps.contains(&debugger.get(15)?) {
                break;
            }
        }
        Ok(function)
    }

    /// A trial: what was flipped, and the verdict. Half of the flips are at most 256 bytes from the
    /// stack pointer.
    pub fn flipped(&self, number: u64) -> Result<(String, Verdict)> {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let works = [Work::Frame, Work::Block, Work::Fix, Work::Both];
        let work = works[number as usize % works.len()];
        let mut stopped = self.stopped(work, &mut random)?;
        let top = self.moment.symbol("_stack_start")?;
        let debugger = stopped.running.debugger()?;
        let sp = debugger.get(13)?;
        let live = top.checked_sub(sp).context("no stack")?;
        let near = if random.random() { live } else { live.min(256) };
        let address = sp + random.random_range(0..near);
        let bit = random.random_range(0..8);
        let flip = format!(
            "{work:?}, pc {:#x} in exception {}, after {}: {address:#x}, {} bytes above the stack \
             pointer, bit {bit}",
            debugger.get(15)?,
            debugger.get(25)? & EXCEPTION,
            self.names[&stopped.function],
            address - sp
        );
        let byte = debugger.read(address, 1)?[0];
        debugger.write(address, &[byte ^ 1 << bit])?;
        let (left, restarted) = self.after(stopped)?;
        let verdict = match (self.judged(&left), restarted) {
            (harm @ (Verdict::Beyond | Verdict::Forged), _) => harm,
            (_, None) => Verdict::Hang,
            (_, Some(true)) => Verdict::Fault,
            (judged, Some(false)) => judged,
        };
        Ok((flip, verdict))
    }

    fn judged(&self, left: &DeviceOutput) -> Verdict {
        self.judge.judge(came(self.moment), left)
    }

    /// Lets it go on to the drive's end: what left, and whether it has restarted; `None`: nothing
    /// leaves any more.
    fn after(&self, stopped: Stopped) -> Result<(DeviceOutput, Option<bool>)> {
        let Stopped {
            mut running,
            record,
            both,
            ..
        } = stopped;
        running.debugger.take().context("it has left")?.go_on()?;
        let bytes = |record: usize| self.moment.records[record].bytes.len();
        running.record(record, bytes(record))?;
        for next in record + 1..self.moment.records.len() {
            let has_come = both && next == record + 1;
            running.record(next, if has_come { bytes(next) } else { 0 })?;
        }
        let mut left = DeviceOutput {
            after: std::mem::take(&mut running.after),
            ..DeviceOutput::default()
        };
        if !running.sends() {
            return Ok((left, None));
        }
        let line = &mut running.live.command;
        left.faults = health(line)?.faults;
        let counters = counters(line)?;
        left.mended = counters.mended;
        let all = self.moment.records.len() as u32;
        let restarted = reset(line)?.crash.is_some() || counters.frames < all;
        Ok((left, Some(restarted)))
    }
}

fn judge(moment: &Moment, without: DeviceOutput) -> Result<Judge> {
    Judge::new(moment.scenario, &moment.configuration, without).context("no such stream")
}

fn came(moment: &Moment) -> impl Iterator<Item = &[u8]> {
    let frames = moment.records.iter().filter(|r| r.input == Input::Sensor);
    frames.map(|r| r.bytes.as_slice())
}
