//! The run.
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use rigless::emulator::{
    AccessKind, Driver, Finished, Host, Settled, Start, Stop, run as emulate,
};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;

use crate::asked::{Asked, bytes, hex};
use crate::board::Ours;

struct Clock {
    instants: BTreeSet<u64>,
    resets: BTreeSet<u64>,
    until: u64,
    memory: Vec<(u64, u64)>,
    trace: Vec<(u64, u64)>,
    told: String,
    count: u64,
}

impl Driver<Ours> for Clock {
    fn on_settled(&mut self, session: &mut Session<Ours>, _: &mut dyn Host, settled: Settled) {
        let Settled::Access { access, value } = settled else {
            return;
        };
        let writes = access.kind == AccessKind::Write;
        if writes {
            session.board_mut().written(access.address, access.value);
        }
        let within = |(from, length): &(u64, u64)| {
            (*from..from + length).contains(&access.address)
        };
        if self.trace.iter().any(within) {
            let _ = writeln!(
                self.told,
                "access {} {} {:#010x} {value:#x} pc {:#x}",
                access.virtual_time.0,
                if writes { "write" } else { "read" },
                access.address,
                access.program_counter.unwrap_or(0),
            );
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Ours>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        self.count = stop.instruction_count;
        if self.resets.remove(&stop.at.0) {
            session.reset_by_pin(stop.at, stop.instruction_count, host);
        }
        if stop.at.0 >= self.until {
            for (address, length) in &self.memory {
                let read = |at| host.read(at, Width::W8).map_or(0, |byte| byte as u8);
                let held: Vec<u8> = (*address..address + length).map(read).collect();
                let _ = writeln!(self.told, "memory {address} {}", hex(&held));
            }
            return None;
        }
        let next = self.instants.range(stop.at.0 + 1..).next();
        Some(VirtualNanos(next.map_or(self.until, |at| *at)))
    }
}

pub fn run(asked: &Asked) -> Result<String> {
    let mut board = Ours::new(asked.chip, asked.crystal, asked.instructions)?;
    let mut clock = Clock {
        instants: asked.resets.iter().copied().collect(),
        resets: asked.resets.iter().copied().collect(),
        until: asked.until,
        memory: asked.memory.clone(),
        trace: asked.trace.clone(),
        told: String::new(),
        count: 0,
    };
    for (name, bursts) in &asked.lines {
        let line = board.line(name)?;
        for (at, baud, text) in bursts {
            for (n, byte) in (0..).zip(bytes(text)?) {
                let begins = at + n * 10_000_000_000 / baud;
                line.coming.push_back((begins, byte));
                clock.instants.insert(begins);
            }
        }
    }
    clock.instants.insert(asked.until);
    let first = clock.instants.first().copied().unwrap_or(asked.until);
    let session = Session::new(Box::new(board), 0, VirtualNanos(first))?;
    let mut images = vec![Image::read(&asked.image, None)?];
    for (address, text) in &asked.flash {
        images.push(Image::new(Path::new("flash"), bytes(text)?, Some(*address))?);
    }
    let finished = emulate(session, &Start::new(&images), clock)?;
    told(asked, finished)
}

fn told(asked: &Asked, finished: Finished<Ours, Clock>) -> Result<String> {
    let Finished {
        mut session,
        driver,
        ..
    } = finished;
    if let Some(error) = session.take_error() {
        return Err(error.into());
    }
    let mut text = driver.told;
    for name in &asked.listen {
        let line = session.board_mut().line(name)?;
        let sent: Vec<u8> = line.left.iter().map(|(_, word)| *word as u8).collect();
        let times: Vec<String> = line.left.iter().map(|(at, _)| at.to_string()).collect();
        writeln!(text, "left {name} {}", hex(&sent))?;
        writeln!(text, "times {name} {}", times.join(" "))?;
    }
    writeln!(text, "instructions {}", driver.count)?;
    for reset in session.resets() {
        writeln!(text, "reset {} {:?}", reset.at.0, reset.cause)?;
    }
    for unmapped in session.unmapped() {
        writeln!(text, "unmapped {unmapped}")?;
    }
    for (address, fault) in session.refused() {
        writeln!(text, "refused {address:#010x} {fault}")?;
    }
    for (address, seen) in session.unimplemented() {
        writeln!(
            text,
            "unimplemented {} {} {address:#010x} pc {:#010x} {} {} {:x?}",
            seen.instance, seen.register, seen.program_counter, seen.reads, seen.writes, seen.written
        )?;
    }
    for (address, seen) in session.undefined() {
        writeln!(text, "undefined {} {address:#010x} pc {:#010x}", seen.instance, seen.program_counter)?;
    }
    for (instance, interrupt) in session.unrouted() {
        writeln!(text, "unrouted {instance} {interrupt}")?;
    }
    for said in session.told() {
        writeln!(text, "told {} {} {} {}", said.instance, said.register, said.at.0, said.reason)?;
    }
    Ok(text)
}
