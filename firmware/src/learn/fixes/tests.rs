//! The learner from fixes with a vehicle that drives: late fixes, and a start from a known state.

mod motion;
mod parked;
mod trial;
mod version;

use super::*;
use crate::compensator::{Compensator, Limit};
use crate::control::Reason;
use crate::fix::{Fix, Heading, OBSERVATIONS};
use crate::learn::Learner;
use crate::nav::Navigator;
use crate::nav::tests::{LSB, SAMPLE_S, Steady, state};
use crate::sample::RawSample;

const RATE: u32 = 200;
/// Turn-on biases of a drive, rad/s and m/s2.
const BIASES: [[f64; 3]; 2] = [[2e-6, -1.5e-6, 1e-6], [3e-3, -4e-3, 2e-3]];
const SPEED_MPS: f64 = 20.0;
const SIGMAS: [f32; OBSERVATIONS] = [5.0, 5.0, 5.0, 0.1, 0.1, 0.1];

/// A vehicle that drives north at a constant speed, and its learner.
struct Drive<'m> {
    learner: FixLearner<'m>,
    compensator: (Compensator, crate::compensator::State),
    truth: Navigator,
    steady: Steady,
    number: u32,
    /// Number of the sample before the first.
    begins: u32,
    /// Receiver's time at the start, ms of the week.
    time_ms: u32,
    /// Fixes a second.
    hz: u32,
    /// Fixes under way: the sample number of their arrival.
    under_way: Vec<(u32, Fix)>,
}

impl<'m> Drive<'m> {
    fn new(memory: &'m mut Memory) -> Drive<'m> {
        let start = state(0.8, [SPEED_MPS, 0.0, 0.0]);
        let limit = Limit {
            gyro: 1.0,
            accel: 1.0,
        };
        let nets = Nets::NONE;
        let compensator =
            Compensator::new(nets.gyro, nets.accel, LSB, SAMPLE_S, RATE as u16, limit).unwrap();
        let mut learner = FixLearner::new(memory, Settings::MEDIUM);
        learner.begin(&nets, compensator.scale());
        let sigmas = [1e-4, 1e-4, 1e-3, 0.1, 0.1, 0.1, 5.0, 5.0, 5.0];
        learner.navigate_from(start, &sigmas).unwrap();
        let config = nav::Config::new(LSB, SAMPLE_S, Settings::MEDIUM.noise);
        Drive {
            learner,
            compensator: (compensator, crate::compensator::State::default()),
            truth: Navigator::new(config, start).unwrap(),
            steady: Steady::default(),
            number: 0,
            begins: 0,
            time_ms: 0,
            hz: 1,
            under_way: Vec::new(),
        }
    }

    /// A second; the fix of its beginning, and of each further part, arrives after this many
    /// samples.
    fn second(&mut self, delay: u32) {
        for n in 0..RATE {
            if n.is_multiple_of(RATE / self.hz) {
                self.measure(delay);
            }
            let counts = self.steady.sample(&self.truth.state());
            self.truth.sample(&counts);
            let sample = RawSample::Counts {
                gyro: counts.dtheta,
                accel: counts.dv,
            };
            self.number += 1;
            let number = self.begins.wrapping_add(self.number);
            self.learner.sample(number, &sample);
            let (compensator, state) = &mut self.compensator;
            if let Some(block) = compensator.accumulate(state, &sample) {
                self.learner.block(number, &block);
            }
            self.arrivals();
        }
    }

    /// A fix goes on its way.
    fn measure(&mut self, delay: u32) {
        let fix = Fix {
            position: self.truth.state().position,
            velocity: self.truth.state().velocity,
            sigmas: SIGMAS,
            heading: None,
            time_ms: (self.time_ms + self.number * (1000 / RATE)) % 604_800_000,
            arrived_us: 0,
            waited: 0,
            age: None,
        };
        self.under_way.push((self.number + delay, fix));
    }

    fn arrivals(&mut self) {
        let now = self.number;
        self.under_way.retain(|(number, fix)| {
            if *number == now {
                self.learner.fix(self.begins.wrapping_add(now), fix);
            }
            *number != now
        });
    }

    /// Error of the learner's position, m.
    fn error_m(&mut self) -> f64 {
        let at = self.learner.nav().unwrap().position;
        let [n, e, d] = at.ned_from(&self.truth.state().position);
        (n * n + e * e + d * d).sqrt()
    }
}

/// FNV-1a over words, or over bytes.
fn fnv(words: impl IntoIterator<Item = u64>) -> u64 {
    words
        .into_iter()
        .fold(0xcbf2_9ce4_8422_2325, |digest, word| {
            (digest ^ word).wrapping_mul(0x100_0000_01b3)
        })
}

fn memory() -> Box<Memory> {
    Box::new(Memory::ZEROED)
}

#[test]
fn late_fixes_do_not_pull_the_navigator() {
    let mut memory = memory();
    let mut drive = Drive::new(&mut memory);
    for second in 0..60 {
        // each fifth fix is half a second late
        drive.second(if second % 5 == 4 { 120 } else { 20 });
        assert!(drive.error_m() < 0.2, "{second}: {}", drive.error_m());
    }
    let report = drive.learner.report();
    assert_eq!((report.refused, report.late), (0, 0));
    assert!(report.fixes >= 59);
}

#[test]
fn a_fix_beyond_the_range_is_counted_and_changes_nothing() {
    let (mut one, mut other) = (memory(), memory());
    let (mut late, mut lost) = (Drive::new(&mut one), Drive::new(&mut other));
    for second in 0..20 {
        late.second(if second == 10 { 250 } else { 20 });
        // this one never arrives
        lost.second(if second == 10 { 1_000_000 } else { 20 });
    }
    assert_eq!(late.learner.report().late, 1);
    assert_eq!(lost.learner.report().late, 0);
    assert_eq!(late.learner.nav(), lost.learner.nav());
    assert_eq!(late.learner.report().fixes, lost.learner.report().fixes);
}

/// With fixes once or ten times a second, the receiver's week may end, and the numbers of the
/// samples may be anywhere.
#[test]
fn the_end_of_a_week_does_not_change_a_bit() {
    for hz in [1, 5, 10] {
        let (mut one, mut other) = (memory(), memory());
        let (mut one, mut other) = (Drive::new(&mut one), Drive::new(&mut other));
        (one.hz, other.hz) = (hz, hz);
        other.time_ms = 604_790_000;
        other.begins = u32::MAX - 20 * RATE;
        for second in 0..30 {
            one.second(20);
            other.second(20);
            assert_eq!(one.learner.nav(), other.learner.nav(), "{hz} {second}");
        }
        assert!(one.learner.nav().is_some());
        assert_eq!(one.learner.report(), other.learner.report(), "{hz}");
        let [one, other] = [&one, &other].map(|of| of.learner.bank().score(1).to_bits());
        assert_eq!(one, other, "{hz}");
    }
}

#[test]
fn a_known_state_needs_a_stream_and_a_range() {
    let mut memory = memory();
    let mut learner = FixLearner::new(&mut memory, Settings::MEDIUM);
    let start = state(0.8, [0.0; 3]);
    let sigmas = [1e-3; NAV];
    assert_eq!(
        learner.navigate_from(start, &sigmas),
        Err(Reason::NotAvailable)
    );
    let scale = StreamScale {
        lsb: LSB,
        period_s: SAMPLE_S,
        block_samples: 200,
    };
    learner.begin(&Nets::NONE, scale);
    assert!(learner.nav().is_none());
    let beyond = state(2.0, [0.0; 3]);
    assert_eq!(learner.navigate_from(beyond, &sigmas), Err(Reason::Range));
    assert_eq!(learner.navigate_from(start, &sigmas), Ok(()));
    assert_eq!(learner.nav().map(|nav| nav.position), Some(start.position));
}

/// Lever arm and delay are known exactly, and the sensors have no scale factor errors: every bit is
/// as without the filter that estimates the former, and without noise for the latter. The digest is
/// that of the present hypotheses.
#[test]
fn what_is_configured_exactly_keeps_every_bit() {
    use super::drive::{Drive, Receiver, Road};
    let mut memory = memory();
    let mut settings = Settings {
        lever_arm: [1.5, 0.7, -1.1],
        ..Settings::MEDIUM
    };
    (settings.sheet.scale, settings.sheet.misalignment) = ([0.0; 2], [0.0; 2]);
    let receiver = Receiver {
        arm: [1.2, 0.7, -1.1],
        delay: 0.13,
        ..Receiver::GOOD
    };
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, receiver, BIASES, 11);
    drive.seconds(60);
    let nav = drive.learner.nav().unwrap();
    let position = [
        nav.position.latitude,
        nav.position.longitude,
        nav.position.height,
    ];
    let all = position.into_iter().chain(nav.velocity).chain(nav.q_bn);
    let mut bits: Vec<u64> = all.map(f64::to_bits).collect();
    let bank = drive.learner.bank();
    use crate::learn::bank::{HYPOTHESES, STORED};
    for index in (0..HYPOTHESES).filter(|index| *index != STORED) {
        bits.extend(bank.estimate_of(index).map(|e| u64::from(e.to_bits())));
        bits.push(bank.evidence(index).to_bits());
    }
    let digest = fnv(bits);
    let expected = (3, 0xe119_67dd_0276_85e8);
    let found = (crate::learn::VERSION, digest);
    assert_eq!(found, expected, "{digest:#x}: raise the version, too");
}

/// Scale factors and misalignments that are a few times the datasheet's are learnt as such, to a
/// fraction of themselves, where a vehicle turns, sways and brakes. Beside them the biases are
/// those of the sensors, and navigation without fixes is better than with biases alone.
#[test]
fn maps_are_learnt() {
    use super::drive::{Drive, Receiver, Road};
    use crate::learn::bank::{MAP, SIX_BIASES};
    let mut memory = memory();
    let mut settings = Settings::MEDIUM;
    (settings.sheet.scale, settings.sheet.misalignment) = ([1e-3; 2], [1e-3; 2]);
    let road = Road {
        sway: 0.3,
        axle: 0.0,
        ..Road::TOWN
    };
    let mut drive = Drive::new(&mut memory, settings, road, Receiver::GOOD, BIASES, 5);
    let true_maps = [
        [[2e-3, 0.0, 0.0], [0.0, -1.5e-3, 0.0], [0.0, 0.0, 1e-3]],
        [[-2e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 0.0]],
    ];
    (drive.ratios[0], drive.ratios[2]) = (true_maps[0], true_maps[1]);
    drive.seconds(1500);
    let bank = drive.learner.bank();
    let maps = bank.maps_of(MAP);
    // the turns about each axis of the gyros, and the gains of velocity ahead
    for (k, i, share) in [(0, 0, 0.15), (0, 1, 0.2), (0, 2, 0.1), (1, 0, 0.1)] {
        let (is, right) = (f64::from(maps[k][i][i]), true_maps[k][i][i]);
        assert!(
            (is - right).abs() < share * right.abs(),
            "{k} {i}: {is} of {right}, {maps:?}"
        );
    }
    let more = bank.evidence(MAP) - bank.evidence(SIX_BIASES);
    assert!(more > 100.0, "{more}");
    let rehearsal = drive.learner.rehearsal();
    let of = |h| rehearsal.standing(h);
    assert!(
        of(MAP).proof > of(SIX_BIASES).proof && !of(MAP).harms(),
        "{:?}",
        of(MAP)
    );
    let winner = drive.learner.winner().expect("proved");
    assert_eq!(winner.nets.maps, maps);
}

/// The scale error that a wrong time base gives all gyros is reported, and is not learnt: what is
/// remembered of the map is what is known of a new unit's. Errors of sensors are learnt, even where
/// the axes agree in their sign.
#[test]
fn a_wrong_time_base_is_not_learnt() {
    use super::drive::{Drive, Receiver, Road};
    use crate::learn::bank::{MAP, REMEMBERED};
    let after = |scales: [f64; 3]| {
        let mut memory = memory();
        let mut settings = Settings::MEDIUM;
        (settings.sheet.scale, settings.sheet.misalignment) = ([1e-2; 2], [1e-3; 2]);
        let road = Road {
            sway: 0.3,
            axle: 0.0,
            ..Road::TOWN
        };
        let mut drive = Drive::new(&mut memory, settings, road, Receiver::GOOD, BIASES, 5);
        for (i, scale) in scales.into_iter().enumerate() {
            drive.ratios[0][i][i] = scale;
        }
        drive.seconds(1500);
        let learner = &mut drive.learner;
        assert!(learner.remember() > 0);
        let (equal, took_part) = (
            learner.report().equal_scales,
            learner.bank().takes_part(MAP),
        );
        assert_ne!(equal, took_part);
        let [biases, driven, curved, _] = REMEMBERED;
        let map = &learner.remembered.unit.values()[biases + driven + curved..][..24];
        (equal, map.iter().all(|value| *value == 0.0))
    };
    for of_clock in [1e-2, -8e-3] {
        assert_eq!(after([of_clock; 3]), (true, true), "{of_clock}");
    }
    for of_sensors in [[1e-2, 6e-3, 3e-3], [1e-2, -1e-2, 1e-2], [3e-3; 3]] {
        assert_eq!(after(of_sensors), (false, false), "{of_sensors:?}");
    }
}

/// What was known at power-on is judged by what is known at the end of a drive: memory that was
/// right is less wrong than none, which is wrong by the whole estimate.
#[test]
fn memory_is_judged_by_what_the_next_drive_shows() {
    use super::drive::{Drive, Receiver, Road};
    use super::judged::Judged;
    let mut memory = memory();
    let settings = Settings::MEDIUM;
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, Receiver::GOOD, BIASES, 5);
    drive.seconds(2400);
    let learner = &mut drive.learner;
    assert!(learner.remember() > 0);
    let right = learner.remembered.unit.values().to_vec();
    let (bank, shapes) = (learner.bank(), &learner.shapes);
    let sheet = &settings.sheet;
    let judge = |values: Option<&[f32]>, blocks: u32| {
        let mut judged = Judged::NONE;
        judged.begin([1.0, 2.0, 3.0], values);
        for _ in 0..blocks {
            judged.block(bank, shapes, sheet);
        }
        judged.so_far()
    };
    let squares: f32 = (bank.estimate().iter())
        .zip(
            [sheet.gyro_bias, sheet.accel_bias]
                .map(|bias| [bias; 3])
                .as_flattened(),
        )
        .map(|(e, bias)| (e / bias) * (e / bias))
        .sum();
    let nothing = vec![0.0; right.len()];
    for (wrong, before) in judge(Some(&nothing), 1000).into_iter().zip([1.0, 2.0, 3.0]) {
        let of_drive = wrong - 0.8 * before;
        assert!(
            (of_drive / squares - 1.0).abs() < 1e-3,
            "{of_drive} {squares}"
        );
    }
    let [of_biases, of_driven, _] = judge(Some(&right), 1000);
    assert!(of_biases - 0.8 < 0.1 * squares, "{of_biases} {squares}");
    assert!(of_driven - 1.6 < 0.1 * squares, "{of_driven} {squares}");
    // nothing was known, or the drive was too short
    assert_eq!(judge(None, 1000), [1.0, 2.0, 3.0]);
    assert_eq!(judge(Some(&nothing), 599), [1.0, 2.0, 3.0]);
}

/// However often the learner begins in a drive, what one turn-on shows counts once. The next drive
/// counts as a second one.
#[test]
fn a_drive_counts_once_however_often_the_learner_begins() {
    use super::drive::{Drive, Receiver, Road};
    let mut memory = memory();
    let settings = Settings::MEDIUM;
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, Receiver::GOOD, BIASES, 5);
    drive.seconds(2400);
    assert!(drive.learner.remember() > 0);
    let once = drive.learner.remembered.unit.head;
    let stream = drive.learner.samples.stream.expect("begun");
    let again = |drive: &mut Drive| {
        drive.learner.begin(&Nets::NONE, stream);
        drive.seconds(2400);
        assert!(drive.learner.remember() > 0);
        drive.learner.remembered.unit.head
    };
    for _ in 0..2 {
        let head = again(&mut drive);
        assert_eq!((head.drives, head.count), (1, 3.0));
        let [before, now] = [once, head].map(|head| head.turn_on(&settings.sheet));
        for (before, now) in before.into_iter().zip(now) {
            assert!((now / before - 1.0).abs() < 0.05, "{now} {before}");
        }
    }
    drive.learner.next_drive();
    let head = again(&mut drive);
    assert_eq!((head.drives, head.count), (2, 6.0));
}

/// A gap that is bridged makes every error of the navigator less certain, and one of twice the
/// length so by more: attitude by twice the angle, the way by more than that.
#[test]
fn what_a_gap_hides_is_not_known() {
    let after = |missing: u32| {
        let mut memory = memory();
        let mut drive = Drive::new(&mut memory);
        (0..30).for_each(|_| drive.second(20));
        let of = |learner: &FixLearner| {
            core::array::from_fn::<f64, 9, _>(|i| {
                let sigma = f64::from(learner.memory.bank.error_sigma(i));
                sigma * sigma
            })
        };
        let before = of(&drive.learner);
        assert_eq!(drive.learner.bridge(missing), missing);
        let after = of(&drive.learner);
        core::array::from_fn::<f64, 9, _>(|i| after[i] - before[i])
    };
    let (short, long) = (after(20), after(40));
    for (i, (short, long)) in short.into_iter().zip(long).enumerate() {
        assert!(short > 0.0, "{i}: {short}");
        let least = if i < 3 { 3.5 } else { 3.9 };
        assert!(long > least * short, "{i}: {short} {long}");
    }
}

/// The same drive with a sensor that has an error in proportion, and without: the navigator's
/// errors differ by that error times what the bank says of it, for each kind of such errors.
#[test]
fn errors_in_proportion_do_what_the_bank_considers() {
    use super::drive::{Drive, Receiver, Road};
    use crate::learn::bank::{SIX_BIASES, ZERO_CORRECTION};
    /// Of each kind, so small that no fix is refused.
    const SIZES: [f64; 3] = [1e-4, 1e-6, 1e-4];
    for followed in [ZERO_CORRECTION, SIX_BIASES] {
        let mut settings = Settings::MEDIUM;
        settings.gates.enabled = 1 << followed;
        let road = Road {
            sway: 0.3,
            axle: 0.0,
            ..Road::TOWN
        };
        let run = |constant: Option<[usize; 3]>| {
            let mut memory = memory();
            let mut drive = Drive::new(&mut memory, settings, road, Receiver::GOOD, NO_BIAS, 7);
            if let Some([kind, i, j]) = constant {
                drive.ratios[kind][i][j] = SIZES[kind];
            }
            drive.seconds(100);
            let considered = drive.learner.memory.bank.considered().clone();
            (drive.learner.nav().unwrap(), considered)
        };
        let (without, considered) = run(None);
        for (kind, size) in SIZES.into_iter().enumerate() {
            let compared = [(0, 0), (1, 0), (2, 1), (0, 2), (2, 2)].map(|(i, j)| {
                let (with, _) = run(Some([kind, i, j]));
                let [w, x, y, z] = without.q_bn;
                let [_, a, b, c] =
                    nav::vector::product(with.q_bn, [w, -x, -y, -z]).map(|part| -2.0 * part);
                let [d, e, f] = core::array::from_fn(|i| with.velocity[i] - without.velocity[i]);
                let says = considered.errors_by(kind, 3 * i + j);
                let says = core::array::from_fn(|i| -f64::from(says[i]) * size);
                ([a, b, c, d, e, f], says)
            });
            // of turns and of velocities, by the largest: within 7 % when this was written, and
            // nearly all within 1 %
            for of in [0..3, 3..6] {
                let length = |v: &[f64; 6], from: &[f64; 6]| {
                    let squares = of.clone().map(|i| (v[i] - from[i]).powi(2));
                    squares.sum::<f64>().sqrt()
                };
                let most = (compared.iter())
                    .fold(0.0_f64, |most, (is, _)| most.max(length(is, &[0.0; 6])));
                for (is, says) in &compared {
                    let off = length(is, says) / most;
                    assert!(off < 0.1, "{followed} {kind} {of:?}: {off} {is:?} {says:?}");
                }
            }
        }
    }
}

const NO_BIAS: [[f64; 3]; 2] = [[0.0; 3]; 2];
