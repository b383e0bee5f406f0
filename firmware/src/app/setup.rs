//! A compensator for the samples of a stream.

use super::config::Config;
use crate::compensator::{Compensator, Limit};
use crate::sample::Lsb;
use crate::wire::Stream;

/// A compensator for these samples, or `None` when they are of a kind that cannot be corrected.
pub(super) fn compensator(
    stream: &Stream,
    config: &Config,
    slew: Option<Limit>,
) -> Option<Compensator> {
    let period = 1.0 / stream.rate;
    let lsb = lsb(stream, period)?;
    // rounds, and saturates at 1 and 65535
    let samples = (config.block * stream.rate + 0.5) as u16;
    let nets = config.nets;
    let made = Compensator::new(
        nets.gyro,
        nets.accel,
        lsb,
        period,
        samples.max(1),
        config.limit,
    );
    made.ok().map(|mut compensator| {
        compensator.set_slew(slew);
        if let Some(told) = &config.told {
            compensator.set_inputs(told.inputs);
        }
        compensator
    })
}

/// What a count of these samples is worth as an increment, or `None` where they are of a kind that
/// cannot be corrected.
pub(super) fn lsb(stream: &Stream, period: f64) -> Option<Lsb> {
    Some(Lsb {
        rad: stream.units.gyro.increment(period)?,
        mps: stream.units.accel.increment(period)?,
    })
}
