//! Answers of the server: state, counters, images and records.

use super::Server;
use crate::app::blackbox::BlackBox;
use crate::app::config::Config;
use crate::app::counts::Counts;
use crate::app::flow::Flow;
use crate::app::phase::{Machine, Phase};
use crate::configuration::SCHEMA;
use crate::control::Reason;
use crate::model::{IMAGES_LEN, Nets};
use crate::nav::State;
use crate::update::FIRMWARE;
use crate::wire::command::{
    Antenna, Board, Counters, Health, MAX_CHUNK, Progress, Response, Security, Solution, Trials,
    Version, WIRE_VERSION, fault,
};

pub(super) const VERSION: Version = Version {
    wire: WIRE_VERSION,
    firmware: FIRMWARE,
    image: lrnn_nostd::image::VERSION as u16,
};

impl Server {
    pub(super) fn board(&self, flow: &Flow) -> Board<'static> {
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

    pub(super) fn security(&mut self, now_us: u64) -> Security {
        Security {
            protection: self.guard.protection(),
            random: self.guard.is_random(),
            forged: self.guard.forged,
            stores: self.wear.left(now_us),
        }
    }
}

/// Antenna of the receiver; `None` without a learner.
pub(super) fn antenna(flow: &Flow) -> Option<Antenna> {
    let known = flow.learning.report().antenna;
    flow.learning.exists().then_some(Antenna {
        lever_arm: known.lever_arm,
        lever_arm_sigma: known.lever_arm_sigma,
        fix_delay: known.fix_delay,
        fix_delay_sigma: known.fix_delay_sigma,
    })
}

/// Solution of a learner that navigates.
#[inline(never)]
pub(super) fn solution(flow: &Flow) -> Option<Solution> {
    let known = flow.learning.solution()?;
    let State {
        position,
        velocity,
        q_bn,
    } = known.state;
    Some(Solution {
        place: [position.latitude, position.longitude],
        height: position.height as f32,
        velocity: velocity.map(|of| of as f32),
        attitude: q_bn.map(|of| of as f32),
        estimate: known.estimate,
        sigma: known.sigma,
    })
}

/// Trials; `None` without a learner.
#[inline(never)]
pub(super) fn trials(flow: &Flow) -> Option<Trials> {
    let known = flow.learning.trials()?;
    let mut report = Trials {
        leading: known.leading as u8,
        ended: known.ended,
        ..Trials::default()
    };
    let places = (report.evidence.iter_mut()).zip(report.proof.iter_mut().zip(&mut report.check));
    for ((k, trial), (evidence, (proof, check))) in known.each.iter().enumerate().zip(places) {
        report.enabled |= u8::from(trial.enabled) << k;
        report.proved |= u8::from(trial.proved) << k;
        *evidence = trial.evidence as f32;
        (*proof, *check) = (trial.standing.proof, trial.standing.check);
    }
    Some(report)
}

/// How far the learner is on its way to a correction; `None` without a learner.
#[inline(never)]
pub(super) fn progress(flow: &Flow) -> Option<Progress> {
    let report = flow.learning.report();
    let mut progress = Progress {
        navigates: report.navigates,
        used_fixes: report.fixes,
        stored: flow.pending.holds_next(),
        in_force: flow.corrector.in_force(),
        ..Progress::default()
    };
    let trials = flow.learning.trials();
    let each = trials.iter().flat_map(|known| &known.each);
    // the first is the zero correction
    for (trial, number) in each.zip(0..).skip(1).filter(|(trial, _)| trial.enabled) {
        let (proof, proved) = (trial.standing.proof, trial.proved);
        let nearer = proved == progress.proved && proof > progress.proof;
        if progress.nearest == 0 || proved && !progress.proved || nearer {
            (progress.nearest, progress.proof, progress.proved) = (number, proof, proved);
        }
    }
    flow.learning.exists().then_some(progress)
}

pub(super) fn health(flow: &Flow, machine: &Machine) -> Health {
    let all = counters(flow, machine);
    let report = flow.learning.report();
    Health {
        mode: flow.session.mode,
        faults: faults(flow, machine),
        frames: all.frames,
        bad_checksums: all.bad_checksums,
        garbage: all.garbage,
        missed: all.missed,
        saturated: all.saturated,
        bounded: flow.corrector.clipped().saturated(),
        error_bound_m: flow.error_bound_m(),
        winner: report.winner,
        navigates: report.navigates,
        used_fixes: report.fixes,
        refused_fixes: report.refused.saturating_add(report.late),
        promotions: report.promotions,
        rollbacks: report.rollbacks,
        busy: flow.health.load.last,
        busiest: flow.health.load.most,
        way: report.way,
        heading_sigma: rounded(report.heading_sigma * 1e3),
        residual: rounded(report.residual * 100.0).unwrap_or(u16::MAX),
        refused_alignments: report.refused_alignments,
        rests: report.rests,
        rest_s: report.rest_s,
    }
}

/// A value >= 0 rounded up, so that a small standard deviation is not none; `None` when it does not
/// fit.
fn rounded(value: f32) -> Option<u16> {
    let value = libm::ceilf(value);
    // `as` of a value in range
    (0.0..65_535.0).contains(&value).then_some(value as u16)
}

pub(in crate::app) fn faults(flow: &Flow, machine: &Machine) -> u32 {
    let unconfigured = if flow.config.configured {
        0
    } else {
        fault::NOT_CONFIGURED
    };
    let other_key = if flow.config.store_faults.other_key {
        fault::KEY
    } else {
        0
    };
    flow.health.all()
        | unconfigured
        | other_key
        | flow.config.hardware.faults(&flow.config.lines())
        | match machine.phase() {
            Phase::Fault(_) => fault::PASS_THROUGH,
            _ => 0,
        }
}

pub(in crate::app) fn counters(flow: &Flow, machine: &Machine) -> Counters {
    let counters = Counts {
        entered: machine.entered(),
        ..flow.counted()
    };
    counters.saturated()
}

#[inline(never)]
pub(super) fn read_learnt<'b>(
    flow: &Flow,
    offset: u32,
    length: u16,
    buffer: &'b mut [u8; MAX_CHUNK],
) -> Response<'b> {
    match flow.learning.answer() {
        Some(answer) => read_image(&answer.learnt.0, offset, length, buffer),
        None => Response::Refused(Reason::NotAvailable),
    }
}

#[inline(never)]
pub(super) fn read_image<'b>(
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

pub(super) fn read_record<'b>(
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

pub(super) fn read_recording<'b>(
    blackbox: &BlackBox,
    offset: u32,
    length: u16,
    buffer: &'b mut [u8; MAX_CHUNK],
) -> Response<'b> {
    let start = usize::try_from(offset).unwrap_or(usize::MAX);
    let Some(place) = buffer.get_mut(..length.into()) else {
        return Response::Refused(Reason::Range);
    };
    let Some(len) = blackbox.read(start, place) else {
        return Response::Refused(Reason::NotAvailable);
    };
    Response::Image {
        offset,
        bytes: place.get(..len).unwrap_or_default(),
    }
}
