//! The run: its events and its output.
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use rigless::device::Level;
use rigless::emulator::{
    Access, AccessKind, Driver, Finished, Host, Settled, Start, Stop, run as emulate,
};
use rigless::image::Image;
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;

use crate::board::Ours;
use crate::request::{RunRequest, bytes, hex};

/// Time for which data-ready is high, ns.
const HIGH: u64 = 20_000;
/// How often the other end of a conversation looks whether an answer has come, ns.
const LOOK: u64 = 100_000;

/// An external event.
#[derive(Clone, Debug)]
enum Event {
    /// The pin of the reset is pulled.
    Reset,
    /// A register is written to, though not by the core.
    Write(u64, u64),
    /// Conversations go on, if the answers have come.
    Look,
    /// A burst is ready.
    Ready(Vec<u8>),
    /// Data-ready falls.
    Taken,
}

/// What the other end of a line still has to ask.
struct Asker<'a> {
    line: &'a str,
    baud: u64,
    sent: usize,
    packets: VecDeque<Vec<u8>>,
    rest: u64,
}

struct World<'a> {
    request: &'a RunRequest,
    /// When the start bits of bytes begin, at which a UART samples its line.
    begins: BTreeSet<u64>,
    events: BTreeMap<u64, Vec<Event>>,
    askers: Vec<Asker<'a>>,
    until: u64,
    output: String,
    count: u64,
}

impl Driver<Ours> for World<'static> {
    fn on_settled(&mut self, session: &mut Session<Ours>, _: &mut dyn Host, settled: Settled) {
        session.board_mut().mend();
        if let Settled::Access { access, value } = settled {
            if access.kind == AccessKind::Write {
                session.board_mut().written(access.address, access.value);
            }
            self.trace(&access, value);
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Ours>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        self.count = stop.instruction_count;
        // a stop comes with the first instruction that ends after its time
        let later = self.events.split_off(&(stop.at.0 + 1));
        for event in std::mem::replace(&mut self.events, later).into_values() {
            for event in event {
                self.happens(event, session, stop, host);
            }
        }
        if stop.at.0 >= self.until {
            for (address, length) in &self.request.memory {
                let read = |at| host.read(at, Width::W8).map_or(0, |byte| byte as u8);
                let content: Vec<u8> = (*address..address + length).map(read).collect();
                let _ = writeln!(self.output, "memory {address} {}", hex(&content));
            }
            return None;
        }
        Some(VirtualNanos(self.next(stop.at.0 + 1)))
    }
}

impl World<'_> {
    fn next(&self, from: u64) -> u64 {
        let begin = self.begins.range(from..).next();
        let event = self.events.range(from..).next().map(|(at, _)| at);
        let next = begin.into_iter().chain(event).min();
        next.map_or(self.until, |at| *at).min(self.until)
    }

    fn happens(
        &mut self,
        event: Event,
        session: &mut Session<Ours>,
        stop: Stop,
        host: &mut dyn Host,
    ) {
        let level = match event {
            Event::Reset => return session.reset_by_pin(stop.at, stop.instruction_count, host),
            Event::Write(address, value) => {
                let mcu = session.mcu();
                let done = mcu.write(stop.at, address, Width::W32, value);
                let _ = done.map_err(|error| writeln!(self.output, "not written: {error}"));
                return;
            }
            Event::Look => return self.converse(session, stop.at.0),
            Event::Ready(burst) => {
                if let Some((adis, _)) = &session.board().adis {
                    adis.ready(&burst);
                }
                Level::High
            }
            Event::Taken => Level::Low,
        };
        if let Some((_, pin)) = session.board().adis.clone() {
            session.board_mut().drive(stop.at, &pin, level);
        }
    }

    fn converse(&mut self, session: &mut Session<Ours>, now: u64) {
        let mut asking = Vec::new();
        for mut asker in self.askers.drain(..) {
            // the board has this line: `run` has asked it for it
            let Ok(line) = session.board_mut().line(asker.line) else {
                continue;
            };
            if line.answers < asker.sent {
                asking.push(asker);
            } else if let Some(packet) = asker.packets.pop_front() {
                asker.sent += 1;
                self.begins
                    .extend(line.send(now + LOOK, asker.baud, &packet));
                asking.push(asker);
            } else {
                self.until = self.until.min(now + asker.rest);
            }
        }
        self.askers = asking;
        if !self.askers.is_empty() {
            self.events.entry(now + LOOK).or_default().push(Event::Look);
        }
    }

    fn trace(&mut self, access: &Access, value: u64) {
        let within = |(from, length): &(u64, u64)| (*from..from + length).contains(&access.address);
        if self.request.trace.iter().any(within) {
            let _ = writeln!(
                self.output,
                "access {} {:?} {:#010x} {value:#x} {:#x}",
                access.virtual_time.0,
                access.kind,
                access.address,
                access.program_counter.unwrap_or(0),
            );
        }
    }
}

/// Runs what is asked. Returns the output.
pub fn run(request: &'static RunRequest) -> Result<String> {
    let mut board = Ours::new(request)?;
    let mut world = World {
        request,
        begins: BTreeSet::new(),
        askers: Vec::new(),
        until: request.until,
        events: BTreeMap::new(),
        output: String::new(),
        count: 0,
    };
    let mut event = |at, event| world.events.entry(at).or_default().push(event);
    request
        .resets
        .iter()
        .for_each(|at| event(*at, Event::Reset));
    for (at, address, value) in &request.writes {
        event(*at, Event::Write(*address, *value));
    }
    for (at, burst) in request.adis.iter().flat_map(|adis| &adis.bursts) {
        event(*at, Event::Ready(bytes(burst)?));
        event(at + HIGH, Event::Taken);
    }
    for (name, bursts) in &request.lines {
        let line = board.line(name)?;
        for (at, baud, text) in bursts {
            world.begins.extend(line.send(*at, *baud, &bytes(text)?));
        }
    }
    for (name, conversation) in &request.conversations {
        let _ = board.line(name)?;
        let packets = conversation.packets.iter().map(|text| bytes(text));
        world.askers.push(Asker {
            line: name,
            baud: conversation.baud,
            sent: 0,
            packets: packets.collect::<Result<_>>()?,
            rest: conversation.rest,
        });
        event(conversation.from, Event::Look);
    }
    let first = VirtualNanos(world.next(0));
    let session = Session::new(Box::new(board), 0, first)?;
    let mut images = vec![Image::read(&request.image, None)?];
    for (address, text) in &request.flash {
        images.push(Image::new(
            Path::new("flash"),
            bytes(text)?,
            Some(*address),
        )?);
    }
    outcome(request, emulate(session, &Start::new(&images), world)?)
}

fn outcome(request: &RunRequest, finished: Finished<Ours, World>) -> Result<String> {
    let Finished {
        mut session,
        driver,
        ..
    } = finished;
    if let Some(error) = session.take_error() {
        return Err(error.into());
    }
    let mut text = driver.output;
    for name in &request.listen {
        let line = session.board_mut().line(name)?;
        let sent: Vec<u8> = line.left.iter().map(|(_, word)| *word as u8).collect();
        let times: Vec<String> = line.left.iter().map(|(at, _)| at.to_string()).collect();
        writeln!(text, "left {name} {}", hex(&sent))?;
        writeln!(text, "times {name} {}", times.join(" "))?;
    }
    if let Some((adis, _)) = &session.board().adis {
        let (bursts, wrong) = adis.outcome();
        writeln!(text, "bursts {bursts}")?;
        wrong
            .iter()
            .try_for_each(|wrong| writeln!(text, "adis {wrong}"))?;
    }
    writeln!(text, "instructions {}", driver.count)?;
    gaps(&session, &mut text)?;
    Ok(text)
}

/// Writes the resets of the chip, the registers without a model in rigless, and the accesses that
/// its models report as forbidden.
fn gaps(session: &Session<Ours>, text: &mut String) -> Result<()> {
    for reset in session.resets() {
        writeln!(text, "reset {} {:?}", reset.at.0, reset.cause)?;
    }
    for unmapped in session.unmapped() {
        writeln!(text, "{unmapped}")?;
    }
    for (address, fault) in session.refused() {
        writeln!(text, "refused {address:#010x} {fault}")?;
    }
    for register_use in session.unimplemented().values() {
        let (instance, register) = (register_use.instance, register_use.register);
        let (reads, writes) = (register_use.reads, register_use.writes);
        writeln!(text, "unimplemented {instance} {register} {reads} {writes}")?;
    }
    for (address, access) in session.undefined() {
        writeln!(text, "undefined {} {address:#010x}", access.instance)?;
    }
    for (instance, interrupt) in session.unrouted() {
        writeln!(text, "unrouted {instance} {interrupt}")?;
    }
    for said in session.told() {
        let (instance, register, at) = (said.instance, said.register, said.at.0);
        writeln!(text, "told {instance} {register} {at} {}", said.reason)?;
    }
    Ok(())
}
