//! The command link: requests in, answers out.

use super::config::Config;
use super::flow::Flow;
use super::phase::{Machine, Phase};
use crate::configuration::SCHEMA;
use crate::configuration::record::{self, Record};
use crate::control::{Alignment, Mode, Reason};
use crate::model::{IMAGES_LEN, Nets};
use crate::wire::command::{
    Antenna, Board, Counters, Health, Kept, MAX_CHUNK, MAX_PACKET, Request, Reset, Response,
    Version, WIRE_VERSION, decode, encode, fault,
};
use heapless::Vec;

/// Version of the weight image's format.
const IMAGE_VERSION: u16 = 1;

/// This firmware's version, from its manifest.
const FIRMWARE: [u16; 3] = [
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
];

const fn number(text: &str) -> u16 {
    match u16::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => panic!("the version is not a number"), // at compile time
    }
}

/// Serves the command link. Every request may come twice, because its answer was lost; the second
/// one has no further effect.
#[derive(Debug)]
pub(super) struct Server {
    /// The image or record being received, from its beginning without gaps.
    received: Vec<u8, IMAGES_LEN>,
    answer: [u8; MAX_PACKET],
    /// Bytes of the answer that have not been given yet.
    waiting: usize,
    /// The configuration record in use; empty without one.
    pub record: Record,
    /// That record is the stored one.
    pub stored: bool,
    /// What the store held at power-on.
    pub kept: Kept,
    /// Whether the application must begin anew with that record.
    pub renewal: Renewal,
}

/// How far a configuration is that was taken while the device runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Renewal {
    /// The one in use stays.
    None,
    /// The application must begin anew with it.
    Taken,
    /// The application has begun anew, and the board opens its lines. Then the answer may leave.
    Begun,
}

impl Server {
    /// With the configuration record in use; `stored`: it is the stored one.
    pub const fn new(record: Record, stored: bool) -> Server {
        Server {
            received: Vec::new(),
            answer: [0; MAX_PACKET],
            waiting: 0,
            record,
            stored,
            kept: Kept {
                generation: None,
                starts: 0,
                failures: 0,
                minutes: 0,
                erased: [0; 2],
                damaged: false,
                passed: 0,
            },
            renewal: Renewal::None,
        }
    }

    /// Carries out the request in a packet. [`Server::answer`] follows.
    pub fn serve(&mut self, packet: &mut [u8], flow: &mut Flow<'_>, machine: &mut Machine) {
        let Ok((number, request)) = decode::<Request>(packet) else {
            return;
        };
        let mut image = [0; MAX_CHUNK];
        let response = self.carry_out(&request, flow, machine, &mut image);
        let answer = encode(number, &response, &mut self.answer);
        self.waiting = answer.map_or(0, |answer| answer.len());
    }

    /// The answer to the last request, once; empty if there is none.
    pub fn answer(&mut self) -> &[u8] {
        let len = core::mem::take(&mut self.waiting);
        self.answer.get(..len).unwrap_or_default()
    }

    fn carry_out<'b>(
        &mut self,
        request: &Request,
        flow: &mut Flow,
        machine: &mut Machine,
        buffer: &'b mut [u8; MAX_CHUNK],
    ) -> Response<'b> {
        let done = match *request {
            Request::GetVersion => {
                return Response::Version(Version {
                    wire: WIRE_VERSION,
                    firmware: FIRMWARE,
                    image: IMAGE_VERSION,
                });
            }
            Request::GetHealth => return Response::Health(health(flow, machine)),
            Request::GetCounters => return Response::Counters(counters(flow, machine)),
            Request::ReadImage { offset, length } => {
                return read_image(&flow.config.nets, offset, length, buffer);
            }
            Request::SetMode(mode) => set_mode(mode, flow, machine),
            Request::WriteImage { offset, bytes } => self.write(offset, bytes),
            Request::CommitImage { length } => self.commit_image(length, flow),
            Request::Reference(window) => flow.reference(&window),
            Request::GetEstimate => return Response::Estimate(flow.estimate()),
            Request::ReadLearnt { offset, length } => {
                return read_learnt(flow, offset, length, buffer);
            }
            Request::WriteConfiguration { offset, bytes } => self.write(offset, bytes),
            Request::CommitConfiguration { length } => self.commit_configuration(length, flow),
            Request::ReadConfiguration { offset, length } => {
                return read_record(&self.record, offset, length, buffer);
            }
            Request::GetAntenna => match antenna(flow) {
                Some(antenna) => return Response::Antenna(antenna),
                None => Err(Reason::NotAvailable),
            },
            Request::GetBoard => return Response::Board(self.board(flow)),
            Request::GetReceiver => return Response::Receiver(flow.heard),
            Request::GetStore => return Response::Kept(self.kept),
            Request::GetReset => match flow.config.hardware.reset {
                Some(reset) => {
                    return Response::Reset(Reset {
                        uptime_ms: (flow.turn_us / 1000) as u32,
                        ..reset
                    });
                }
                None => Err(Reason::NotAvailable),
            },
            Request::GetMemory => return Response::Remembered(flow.remembered()),
            Request::CommitLearnt => may_exchange(flow).and_then(|()| flow.commit_learnt()),
            Request::Heading(heading) => flow.heading(heading),
            Request::StoreImage => store_image(flow),
            Request::Alignment(alignment) => {
                flow.align(alignment);
                Ok(())
            }
        };
        match done {
            Ok(()) => Response::Done,
            Err(reason) => Response::Refused(reason),
        }
    }

    /// Takes a piece that begins within what is there or directly after it: a piece may be sent
    /// again, but must not leave a gap.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Reason> {
        let offset = usize::try_from(offset).map_err(|_| Reason::Range)?;
        if offset > self.received.len() || offset + bytes.len() > IMAGES_LEN {
            return Err(Reason::Range);
        }
        self.received.truncate(offset);
        self.received
            .extend_from_slice(bytes)
            .map_err(|_| Reason::Range)
    }

    /// Uses the image received, both networks or none, between two samples. Like all functions here
    /// that hold networks it is not inlined: the stack then holds the largest of them, not all of
    /// them.
    #[inline(never)]
    fn commit_image(&mut self, length: u32, flow: &mut Flow) -> Result<(), Reason> {
        if usize::try_from(length) != Ok(IMAGES_LEN) || self.received.len() != IMAGES_LEN {
            return Err(Reason::Range);
        }
        may_exchange(flow)?;
        let nets = Nets::from_images(&self.received).map_err(|_| Reason::Image)?;
        flow.set_nets(nets);
        Ok(())
    }

    /// Takes the record received in place of the one in use, if all of it is good. The caller then
    /// begins anew. Nothing else changes here, so that a refusal leaves everything as it was.
    ///
    /// In bypass only, and not while a correction still fades out: else the correction would jump.
    #[inline(never)]
    fn commit_configuration(&mut self, length: u32, flow: &Flow) -> Result<(), Reason> {
        let bytes = self.received.as_slice();
        if usize::try_from(length) != Ok(bytes.len()) {
            return Err(Reason::Record);
        }
        if !bytes.is_empty() && bytes == self.record.as_slice() {
            return Ok(()); // asked again, since the answer was lost
        }
        if flow.alignment == Some(Alignment::Started) {
            return Err(Reason::Alignment);
        }
        if flow.mode != Mode::Bypass || flow.corrects() {
            return Err(Reason::Mode);
        }
        let told = record::decode(bytes)?;
        flow.config.hardware.check(&told.lines)?;
        self.record = Record::from_slice(bytes).map_err(|_| Reason::Record)?;
        (self.renewal, self.stored) = (Renewal::Taken, false);
        Ok(())
    }

    fn board(&self, flow: &Flow) -> Board<'static> {
        let Config {
            hardware, store, ..
        } = &flow.config;
        Board {
            name: hardware.name,
            uart_clocks: hardware.clocks.map(|clock| clock.hz),
            bauds: hardware.bauds(&flow.config.lines()),
            pin_sets: hardware.pin_sets,
            stores: *store,
            schema: SCHEMA,
            configured: flow.config.configured,
            stored: self.stored,
        }
    }
}

/// During the alignment no correction may change. Afterwards a fade covers the exchange of
/// networks.
fn may_exchange(flow: &Flow) -> Result<(), Reason> {
    let aligned = flow.alignment == Some(Alignment::Finished) && flow.mode != Mode::Frozen;
    if flow.alignment.is_some() && !aligned {
        return Err(Reason::Alignment);
    }
    Ok(())
}

fn set_mode(mode: Mode, flow: &mut Flow, machine: &mut Machine) -> Result<(), Reason> {
    if mode != Mode::Bypass && !flow.config.configured {
        return Err(Reason::NotConfigured);
    }
    if mode == Mode::Learn && !flow.can_learn() {
        return Err(Reason::NotAvailable);
    }
    // asked again, since the answer was lost: nothing changes. In state Fault it is a new attempt.
    if mode == flow.mode && !matches!(machine.phase(), Phase::Fault(_)) {
        return Ok(());
    }
    // during an alignment a correction may be switched neither on nor off: either would be a jump
    if flow.alignment == Some(Alignment::Started) && mode != flow.mode {
        return Err(Reason::Alignment);
    }
    flow.set_mode(mode);
    match machine.phase() {
        Phase::Run(_) => machine.transition_to_run(mode),
        Phase::Fault(_) => {
            flow.forget();
            *machine = machine.restarted();
        }
        Phase::Start | Phase::Detect => {} // in force when the format is known
    }
    Ok(())
}

fn store_image(flow: &mut Flow) -> Result<(), Reason> {
    if !flow.config.store {
        return Err(Reason::Unsupported);
    }
    if let Some(version) = flow.config.newer {
        return Err(Reason::Newer(version));
    }
    if flow.mode != Mode::Bypass || flow.alignment == Some(Alignment::Started) {
        return Err(Reason::Mode);
    }
    flow.keep.commanded = true;
    Ok(())
}

/// Of a board with a learner.
fn antenna(flow: &Flow) -> Option<Antenna> {
    let known = flow.report().antenna;
    flow.can_learn().then_some(Antenna {
        lever_arm: known.lever_arm,
        lever_arm_sigma: known.lever_arm_sigma,
        fix_delay: known.fix_delay,
        fix_delay_sigma: known.fix_delay_sigma,
    })
}

fn health(flow: &Flow, machine: &Machine) -> Health {
    let all = counters(flow, machine);
    let report = flow.report();
    Health {
        mode: flow.mode,
        faults: faults(flow, machine),
        frames: all.frames,
        bad_checksums: all.bad_checksums,
        garbage: all.garbage,
        missed: all.missed,
        saturated: all.saturated,
        bounded: flow.blocks().1,
        error_bound_m: flow.error_bound_m(),
        winner: report.winner,
        navigates: report.navigates,
        used_fixes: report.fixes,
        refused_fixes: report.refused.saturating_add(report.late),
        promotions: report.promotions,
        rollbacks: report.rollbacks,
        busy: flow.load.last,
        busiest: flow.load.most,
        way: report.way,
        heading_sigma: rounded(report.heading_sigma * 1e3),
        residual: rounded(report.residual * 100.0).unwrap_or(u16::MAX),
        refused_alignments: report.refused_alignments,
    }
}

/// A value >= 0 rounded up, so that a small standard deviation is not none; `None` when it does not
/// fit.
fn rounded(value: f32) -> Option<u16> {
    let value = libm::ceilf(value);
    // `as` of a value in range
    (0.0..65_535.0).contains(&value).then_some(value as u16)
}

pub(super) fn faults(flow: &Flow, machine: &Machine) -> u32 {
    let untold = if flow.config.configured {
        0
    } else {
        fault::NOT_CONFIGURED
    };
    flow.faults
        | flow.other_sensor
        | untold
        | flow.config.hardware.faults(&flow.config.lines())
        | match machine.phase() {
            Phase::Fault(_) => fault::PASS_THROUGH,
            _ => 0,
        }
}

pub(super) fn counters(flow: &Flow, machine: &Machine) -> Counters {
    Counters {
        given_up: flow.blocks().0,
        mended: flow.times_mended(),
        entered: machine.entered(),
        ..flow.counters
    }
}

#[inline(never)]
fn read_learnt<'b>(
    flow: &mut Flow,
    offset: u32,
    length: u16,
    buffer: &'b mut [u8; MAX_CHUNK],
) -> Response<'b> {
    match flow.learnt() {
        Some((nets, _)) => read_image(&nets, offset, length, buffer),
        None => Response::Refused(Reason::NotAvailable),
    }
}

#[inline(never)]
fn read_image<'b>(
    nets: &Nets,
    offset: u32,
    length: u16,
    buffer: &'b mut [u8; MAX_CHUNK],
) -> Response<'b> {
    let start = usize::try_from(offset).unwrap_or(usize::MAX);
    if start > IMAGES_LEN || usize::from(length) > MAX_CHUNK {
        return Response::Refused(Reason::Range);
    }
    let len = (IMAGES_LEN - start).min(usize::from(length));
    nets.write_images(start, buffer);
    Response::Image {
        offset,
        bytes: buffer.get(..len).unwrap_or_default(),
    }
}

fn read_record<'b>(
    record: &[u8],
    offset: u32,
    length: u16,
    buffer: &'b mut [u8; MAX_CHUNK],
) -> Response<'b> {
    let start = usize::try_from(offset).unwrap_or(usize::MAX);
    let (Some(rest), true) = (record.get(start..), usize::from(length) <= MAX_CHUNK) else {
        return Response::Refused(Reason::Range);
    };
    let len = rest.len().min(usize::from(length));
    for (place, byte) in buffer.iter_mut().zip(rest) {
        *place = *byte;
    }
    Response::Image {
        offset,
        bytes: buffer.get(..len).unwrap_or_default(),
    }
}
