//! A compensator for the samples of a stream.

use super::config::Config;
use crate::compensator::{Compensator, Limit, of_nets};
use crate::sample::Lsb;
use crate::wire::Stream;

/// A compensator for these samples, or `None` when they are of a kind that cannot be corrected.
pub(super) fn compensator(
    stream: &Stream,
    config: &Config,
    slew: Option<Limit>,
) -> Option<Compensator> {
    let mut made = Compensator::BLANK;
    renew(&mut made, stream, (config, of_nets(&config.nets)), slew)?;
    Some(made)
}

/// Rebuilds the compensator in the memory of `place`, for networks with this check. `None`: the
/// settings are of no use.
pub(super) fn renew(
    place: &mut Compensator,
    stream: &Stream,
    (config, nets_sum): (&Config, u32),
    slew: Option<Limit>,
) -> Option<()> {
    let period = 1.0 / stream.rate;
    let lsb = lsb(stream, period)?;
    // rounds, and saturates at 1 and 65535
    let samples = (config.block * stream.rate + 0.5) as u16;
    let timing = (lsb, period, samples.max(1));
    let inputs = config
        .configuration
        .as_ref()
        .map(|configuration| configuration.inputs);
    place
        .renew(
            (&config.nets, nets_sum),
            timing,
            (config.limit, config.map_limit),
            (inputs, slew),
        )
        .ok()
}

/// Value of a count of these samples as an increment, or `None` where they are of a kind that
/// cannot be corrected.
pub(super) fn lsb(stream: &Stream, period: f64) -> Option<Lsb> {
    Some(Lsb {
        rad: stream.units.gyro.increment(period)?,
        mps: stream.units.accel.increment(period)?,
    })
}
