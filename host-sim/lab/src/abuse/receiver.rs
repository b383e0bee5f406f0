//! The device's receiver: its fixes with the faults of a case, as bytes of UBX-NAV-PVT.

use host_core::inertial::gnss::Fix;
use host_core::inertial::sins::NavState;
use host_core::simulator::gnss::{Coloured, Gaps, GnssSpec};
use host_core::simulator::truth::Truth;
use host_device::hil;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Configured delay of fixes from validity to arrival by default, s.
pub const DELAY_S: f64 = 0.1;
/// Streams of random numbers beside those of the usual errors.
const DIRECTION: u64 = 40;
const CHANCE: u64 = 41;
/// Time of the week of the first fix, ms.
const FIRST_MS: i64 = 3_600_000;
/// A GPS week, ms.
const WEEK_MS: i64 = 604_800_000;

/// Faults of a receiver. Lengths in m, speeds in m/s, times in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Delay of fixes from validity to arrival, instead of [`DELAY_S`].
    Late(f64),
    /// A random additional delay of each fix, up to this.
    Jitter(f64),
    /// The antenna is here: forward, right, down.
    Arm([f64; 3]),
    /// Coloured errors: those of the position, their correlation time, those of the velocity, their
    /// correlation time.
    Coloured([f64; 4]),
    /// The reported accuracy is multiplied by this.
    Configured(f64),
    /// The errors are this many times as large as reported.
    Noise(f64),
    /// The same in intervals: the factor, and the durations with and without it, s.
    Bouts([f64; 2]),
    /// It reports this accuracy of the speed.
    SpeedAccuracy(f64),
    /// The position is off by this in a constant direction. The velocity is right.
    Shift(f64),
    /// The position drifts with this speed, and the velocity agrees with it.
    Drift(f64),
    /// The same with an acceleration, m/s2.
    Accelerates(f64),
    /// It repeats one fix, with new times.
    Frozen,
    /// Times without satellites, in which the receiver extrapolates on a straight line: their mean
    /// interval and length.
    Extrapolates([f64; 2]),
    /// A component of the velocity (0 north, 1 east, 2 down) has the wrong sign.
    Negated(usize),
    /// The velocity has a low-pass filter of this time constant.
    VelocityLag(f64),
    /// The velocity is the difference of the last two positions.
    VelocityOfPositions,
    /// The velocity is missing: it is reported as 0, with an accuracy of 20 m/s.
    NoVelocity,
    /// It reports the velocity 0 with its usual accuracy.
    VelocityZero,
    /// The time of validity jumps by this.
    TimeJump(f64),
    /// The week ends.
    Rollover,
    /// The height is multiplied by this, as by a wrong unit.
    HeightFactor(f64),
    /// The height is off by this, as by another reference surface.
    HeightOffset(f64),
    /// No fixes at random times: their mean interval and length.
    Gaps([f64; 2]),
    /// No fixes.
    Outage,
    /// Only each fix of this number is sent.
    Each(usize),
    /// Pairs of fixes arrive in the wrong order.
    Swapped,
    /// This share of the fixes is off by the second number.
    Outliers([f64; 2]),
    /// Position and velocity are rounded to this, m and m/s.
    Coarse([f64; 2]),
    /// It never sends.
    Silent,
    /// It is the receiver of another vehicle.
    Elsewhere,
}

impl Fault {
    /// Whether the fixes of its span are those of another simulated receiver.
    fn is_of_drive(self) -> bool {
        matches!(
            self,
            Self::Arm(_)
                | Self::Coloured(_)
                | Self::Gaps(_)
                | Self::Configured(_)
                | Self::Elsewhere
        )
    }
}

/// A fix with its times.
#[derive(Debug, Clone, Copy)]
struct Sent {
    fix: Fix,
    /// When it is valid and when it arrives, s after power-on.
    valid_s: f64,
    arrives_s: f64,
    /// The time that the message states, ms.
    stated_ms: i64,
}

/// A message of the receiver: when it arrives, microseconds after power-on, and its bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    pub at_us: u64,
    pub bytes: Vec<u8>,
}

/// The messages of a drive until its fixes end. Each fault acts in the span beside it. Drives with
/// the same seed share the random numbers of the usual errors, whatever the faults.
pub fn messages(
    faults: &[(Fault, [f64; 2])],
    truth: &Truth,
    elsewhere: impl Fn() -> Truth,
    seed: u64,
    until_s: u32,
) -> Vec<Message> {
    let usual = GnssSpec::default();
    let mut sent = received(&usual, truth, seed, until_s);
    let mut states = truth.epochs.clone();
    // in the spans of such faults, the fixes are those of the other receiver
    let others: Vec<[f64; 2]> = faults
        .iter()
        .filter(|(fault, _)| fault.is_of_drive())
        .map(|(_, span)| *span)
        .collect();
    if !others.is_empty() {
        let elsewhere = faults
            .iter()
            .any(|(fault, _)| *fault == Fault::Elsewhere)
            .then(elsewhere);
        let there = elsewhere.as_ref().unwrap_or(truth);
        let within = |s: f64| others.iter().any(|[from, to]| (*from..*to).contains(&s));
        sent.retain(|one| !within(one.valid_s));
        let disturbed = received(&spec(faults), there, seed, until_s);
        sent.extend(disturbed.iter().filter(|one| within(one.valid_s)));
        sent.sort_by(|a, b| a.valid_s.total_cmp(&b.valid_s));
        for (k, (state, other)) in states.iter_mut().zip(&there.epochs).enumerate() {
            if within(k as f64) {
                *state = *other;
            }
        }
    }
    for (fault, span) in faults {
        apply(*fault, *span, &mut sent, &states, seed);
    }
    sent.sort_by(|a, b| a.arrives_s.total_cmp(&b.arrives_s));
    sent.iter().map(message).collect()
}

/// The fixes of a receiver until `until_s`, with the default delay.
fn received(spec: &GnssSpec, truth: &Truth, seed: u64, until_s: u32) -> Vec<Sent> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    spec.of_drive(truth, &mut rng)
        .into_iter()
        .skip(1)
        .take_while(|(at_s, _)| *at_s <= f64::from(until_s))
        .filter_map(|(at_s, fix)| Some((at_s, fix?)))
        .map(|(valid_s, fix)| Sent {
            fix: reported_as_white(fix, spec),
            valid_s,
            arrives_s: valid_s + DELAY_S,
            stated_ms: FIRST_MS + (valid_s * 1e3).round() as i64,
        })
        .collect()
}

/// The receiver of the simulator with the errors of a case.
fn spec(faults: &[(Fault, [f64; 2])]) -> GnssSpec {
    let mut spec = GnssSpec::default();
    for (fault, _) in faults {
        match *fault {
            Fault::Arm(arm) => spec.lever_arm_m = Some(arm),
            Fault::Coloured([position, time, velocity, velocity_time]) => {
                spec.coloured = Coloured {
                    horizontal_m: position,
                    vertical_m: 1.5 * position,
                    velocity_mps: velocity,
                    time_s: time,
                    velocity_time_s: velocity_time,
                };
            }
            Fault::Gaps([interval, length]) => {
                spec.gaps = Gaps {
                    mean_interval_s: interval,
                    mean_length_s: length,
                };
            }
            Fault::Configured(factor) => spec.told_factor = factor,
            _ => {}
        }
    }
    spec
}

/// Sets the reported accuracy to that of the white noise alone.
fn reported_as_white(fix: Fix, spec: &GnssSpec) -> Fix {
    let sigmas = spec.sigmas().map(|sigma| sigma * spec.told_factor);
    Fix { sigmas, ..fix }
}

fn direction(seed: u64) -> Vector3<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(DIRECTION);
    let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
    Vector3::new(angle.cos(), angle.sin(), 0.0)
}

/// Adds to position and velocity.
fn moved(fix: &mut Fix, position: Vector3<f64>, velocity: Vector3<f64>) {
    fix.position = fix.position.displaced(&position);
    fix.velocity += velocity;
}

/// One fault on all fixes of its span. `truth`: the true states at the epochs.
fn apply(fault: Fault, [from, to]: [f64; 2], sent: &mut Vec<Sent>, truth: &[NavState], seed: u64) {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    chance.set_stream(CHANCE);
    let away = direction(seed);
    let within = |one: &Sent| (from..to).contains(&one.valid_s);
    match fault {
        Fault::Outage | Fault::Silent => sent.retain(|one| !within(one)),
        Fault::Each(n) => {
            sent.retain(|one| !within(one) || (one.valid_s as usize).is_multiple_of(n.max(1)));
        }
        Fault::Swapped => swap(sent, from, to),
        Fault::Frozen | Fault::VelocityOfPositions | Fault::VelocityLag(_) => {
            remember(fault, sent, within);
        }
        Fault::Extrapolates(means) => extrapolate(means, sent, within, &mut chance),
        _ => {
            for one in sent.iter_mut().filter(|one| within(one)) {
                let since = one.valid_s - from;
                let at = truth.get(one.valid_s.round() as usize);
                each(fault, one, since, away, at, &mut chance);
            }
        }
    }
}

/// A fault that acts on each fix independently. `since`: seconds since it began.
fn each(
    fault: Fault,
    one: &mut Sent,
    since: f64,
    away: Vector3<f64>,
    truth: Option<&NavState>,
    chance: &mut ChaCha8Rng,
) {
    let none = Vector3::zeros();
    let fix = &mut one.fix;
    match fault {
        Fault::Late(by) => one.arrives_s = one.valid_s + by,
        Fault::Jitter(up_to) => one.arrives_s += chance.random_range(0.0..=up_to),
        Fault::SpeedAccuracy(reported) => fix.sigmas[3..].fill(reported / 3.0_f64.sqrt()),
        Fault::Bouts([factor, length]) if (since / length) as u64 % 2 == 1 => {
            enlarge(fix, truth, factor);
        }
        Fault::Noise(factor) => enlarge(fix, truth, factor),
        Fault::Shift(by) => moved(fix, away * by, none),
        Fault::Drift(speed) => moved(fix, away * (speed * since), away * speed),
        Fault::Accelerates(rate) => {
            moved(
                fix,
                away * (0.5 * rate * since * since),
                away * (rate * since),
            );
        }
        Fault::Negated(axis) => fix.velocity[axis] = -fix.velocity[axis],
        Fault::NoVelocity => {
            fix.velocity = none;
            fix.sigmas[3..].fill(20.0 / 3.0_f64.sqrt());
        }
        Fault::VelocityZero => fix.velocity = none,
        Fault::TimeJump(by) => one.stated_ms += (by * 1e3) as i64,
        Fault::Rollover => one.stated_ms += WEEK_MS - FIRST_MS - 700_000,
        Fault::HeightFactor(factor) => fix.position.h *= factor,
        Fault::HeightOffset(by) => fix.position.h += by,
        Fault::Outliers([share, size]) => {
            let angle: f64 = chance.random_range(0.0..std::f64::consts::TAU);
            if chance.random_bool(share.clamp(0.0, 1.0)) {
                moved(
                    fix,
                    Vector3::new(angle.cos(), angle.sin(), 0.0) * size,
                    none,
                );
            }
        }
        Fault::Coarse([metres, speed]) => {
            let round = |x: f64, step: f64| (x / step).round() * step;
            let degrees = metres / 6_371_000.0;
            fix.position.lat = round(fix.position.lat, degrees);
            fix.position.lon = round(fix.position.lon, degrees);
            fix.velocity = fix.velocity.map(|v| round(v, speed));
        }
        _ => {} // faults of the whole drive
    }
}

/// Multiplies the errors of a fix.
fn enlarge(fix: &mut Fix, truth: Option<&NavState>, factor: f64) {
    if let Some(truth) = truth {
        let error = fix.position.ned_from(&truth.position) * (factor - 1.0);
        let slip = (fix.velocity - truth.velocity) * (factor - 1.0);
        moved(fix, error, slip);
    }
}

/// Faults that depend on earlier fixes.
fn remember(fault: Fault, sent: &mut [Sent], within: impl Fn(&Sent) -> bool) {
    let mut before: Option<Fix> = None;
    for one in sent.iter_mut() {
        let own = one.fix;
        match (fault, before.filter(|_| within(one))) {
            (Fault::Frozen, Some(frozen)) => {
                one.fix = frozen;
                continue;
            }
            (Fault::VelocityOfPositions, Some(last)) => {
                one.fix.velocity = own.position.ned_from(&last.position);
            }
            (Fault::VelocityLag(time), Some(last)) => {
                one.fix.velocity = last.velocity.lerp(&own.velocity, 1.0 - (-1.0 / time).exp());
                before = Some(one.fix);
                continue;
            }
            _ => {}
        }
        before = Some(own);
    }
}

/// Times without satellites: extrapolates the last good fix with its velocity.
fn extrapolate(
    [interval, length]: [f64; 2],
    sent: &mut [Sent],
    within: impl Fn(&Sent) -> bool,
    chance: &mut ChaCha8Rng,
) {
    let mut bad = false;
    let mut last: Option<Fix> = None;
    for one in sent.iter_mut().filter(|one| within(one)) {
        let mean = if bad { length } else { interval };
        bad ^= chance.random_bool((1.0 / mean).clamp(0.0, 1.0));
        if let Some(before) = last.filter(|_| bad) {
            let position = before.position.displaced(&before.velocity);
            one.fix = Fix { position, ..before };
        }
        last = Some(one.fix);
    }
}

/// Swaps the fixes of a span in pairs.
fn swap(sent: &mut [Sent], from: f64, to: f64) {
    let first = sent.partition_point(|one| one.valid_s < from);
    let last = sent.partition_point(|one| one.valid_s < to);
    for pair in sent[first..last].chunks_exact_mut(2) {
        let [a, b] = [pair[0].arrives_s, pair[1].arrives_s];
        (pair[0].arrives_s, pair[1].arrives_s) = (b, b - 0.5 * (b - a).min(0.1));
    }
}

/// The message of a fix.
fn message(sent: &Sent) -> Message {
    let Sent { fix, .. } = sent;
    let [north, _, down, speed, ..] = fix.sigmas;
    let millimetres = |sigma: f64| (sigma * 1e3).round().clamp(1.0, 4e9) as u32;
    let mut pvt = hil::pvt(0, fix);
    pvt.time_of_week = sent.stated_ms.rem_euclid(WEEK_MS) as u32;
    pvt.horizontal_accuracy = millimetres(north * 2.0_f64.sqrt());
    pvt.vertical_accuracy = millimetres(down);
    pvt.speed_accuracy = millimetres(speed * 3.0_f64.sqrt());
    Message {
        at_us: (sent.arrives_s * 1e6).round() as u64,
        bytes: pvt.emit().to_vec(),
    }
}
