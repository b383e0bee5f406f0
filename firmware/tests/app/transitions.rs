//! The table "Transitions of the correction" of the interface control document, row by row: every
//! state of a correction and every event, measured in the bytes that come out.

mod events;

pub use events::State;
use events::{EVENTS, Event, STATES};

use crate::device::{broken, nets};
use crate::frames::Kind;
use crate::record::{configure, configured, record};
use crate::taught::{Bench, with};
use firmware::app::{Activation, App, Config};
use firmware::configuration::{Configuration, VehicleKind};
use firmware::control::{Alignment, Mode, Reason};
use firmware::learn::Resting;
use firmware::model::{IMAGES_LEN, Nets};
use firmware::wire::command::{Request, Response};
use firmware::wire::stim300::config::Config as Stim300;

/// Errors in the store, proved by the learner, and uploaded, m/s2.
pub const STORED: f32 = 0.05;
const PROVED: f32 = 0.04;
const UPLOADED: f32 = -0.03;
/// Errors of the gyros that the first rest shows, and shows later, rad/s; and what is doubtful.
const AT_REST: f32 = 4e-3;
const AT_REST_LATER: f32 = 5e-3;
const DOUBT: f32 = 1e-4;
/// Fastest change, m/s2 per s and rad/s per s, and the time between two changes, s.
pub const SLEW: f32 = 0.01;
const GYRO_SLEW: f32 = 2e-4;
pub const BLOCK: f32 = 0.1;

/// Allowed change of a correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rule {
    Holds,
    Slow,
    Jumps,
}

fn unit(kind: Kind, activation: Activation, mode: Mode) -> Configuration {
    let mut unit = configured(kind);
    unit.vehicle.kind = VehicleKind::Ship; // whose rest is not judged
    let correction = &mut unit.correction;
    (correction.mode, correction.activation) = (mode, activation);
    (correction.limit.accel, correction.slew.accel) = (1.0, SLEW);
    (correction.limit.gyro, correction.slew.gyro) = (0.1, GYRO_SLEW);
    correction.block = BLOCK;
    correction.silence_us = 100_000;
    unit
}

fn bench(kind: Kind, state: State) -> Bench {
    let (activation, mode) = match state {
        State::Frozen => (Activation::NextPowerOn, Mode::Frozen),
        State::Stored => (Activation::NextPowerOn, Mode::Learn),
        State::AtRest => (Activation::FirstRest, Mode::Learn),
        _ => (Activation::Faded, Mode::Learn),
    };
    let mut config = Config {
        nets: with(STORED),
        ..Config::of(&unit(kind, activation, mode))
    };
    config.sensor.stim300.ask = false;
    let mut bench = Bench::of(kind, |learner| App::with_learner(config, Some(learner)));
    bench.fixes = true;
    bench
}

/// A device whose correction is in this state in this part of an alignment.
pub fn begun(kind: Kind, state: State, phase: Option<Alignment>) -> Bench {
    let mut bench = bench(kind, state);
    bench.run(1.0);
    if phase == Some(Alignment::Finished) {
        bench.device.order(&Request::Alignment(Alignment::Finished));
    }
    match state {
        State::Nothing | State::Frozen | State::Stored => {}
        State::AtRest => rests(&bench, AT_REST),
        _ => bench.says.winner.set(Some(PROVED)),
    }
    bench.run(match state {
        State::FadingIn => 2.0,
        _ => 6.0,
    });
    if state == State::FadingOut {
        bench.says.winner.set(None);
        bench.run(2.0);
    }
    if phase == Some(Alignment::Started) {
        bench.device.order(&Request::Alignment(Alignment::Started));
        bench.run(1.0);
    }
    bench
}

/// The vehicle rests, and shows this error of each gyro.
fn rests(bench: &Bench, error: f32) {
    bench.says.rest.set(Some(Resting {
        gyro: [error; 3],
        doubt: DOUBT,
    }));
}

impl Event {
    fn happens(self, bench: &mut Bench, phase: Option<Alignment>, mode: Mode) {
        // whether a request is refused does not matter here
        let ask = |bench: &mut Bench, request: &Request| bench.device.ask(request, |_| {});
        match self {
            Event::Mode(mode) => ask(bench, &Request::SetMode(mode)),
            Event::SameMode => ask(bench, &Request::SetMode(mode)),
            Event::Alignment(alignment) => ask(bench, &Request::Alignment(alignment)),
            Event::SameAlignment => {
                if let Some(alignment) = phase {
                    ask(bench, &Request::Alignment(alignment));
                }
            }
            Event::Images => commit(bench, &with(UPLOADED)),
            Event::Broken => commit(
                bench,
                &Nets {
                    gyro: broken(),
                    ..nets([0.0; 3], [0.0; 3])
                },
            ),
            Event::CommitLearnt => ask(bench, &Request::CommitLearnt),
            Event::Configuration => {
                let unit = unit(bench.kind, Activation::Commanded, Mode::Frozen);
                let _ = configure(&mut bench.device, &record(&unit));
            }
            Event::Proves => bench.says.winner.set(Some(UPLOADED)),
            Event::GivesUp => bench.says.winner.set(None),
            Event::Rests => rests(bench, AT_REST_LATER),
            Event::DrivesOff => bench.says.rest.set(None),
            Event::Harms => bench.says.stored_harms.set(true),
            Event::Gap => bench.n += 20,
            Event::Silence => bench.silence(0.3),
            Event::Restart => bench.silence(2.0),
            Event::Rate => {
                for _ in 0..(8.0 * bench.kind.rate()) as u32 {
                    bench.step(2.0); // twice as many samples a second
                }
            }
            Event::Damage => damaged(bench, 5.0),
            Event::Noise => noise(bench, 10_000),
            Event::Service => bench.device.lines.navigation.input.extend(b"SERVICEMODE\r"),
        }
    }

    /// The rule that the table gives.
    fn rule(self, state: State, phase: Option<Alignment>) -> Rule {
        let started = phase == Some(Alignment::Started);
        let free = phase.is_none() && state == State::Frozen;
        match self {
            Event::Restart => Rule::Jumps,
            Event::Rests if state == State::AtRest && phase.is_none() => Rule::Jumps,
            Event::Rests | Event::DrivesOff => Rule::Holds,
            Event::SameMode | Event::SameAlignment | Event::Gap | Event::Silence => Rule::Holds,
            Event::Damage | Event::Noise | Event::Service => Rule::Holds,
            Event::Harms | Event::Configuration => Rule::Holds,
            Event::Alignment(Alignment::Started) if started => Rule::Holds,
            Event::Alignment(Alignment::Started) => Rule::Jumps,
            Event::Alignment(Alignment::Finished) => Rule::Slow,
            Event::Rate if free => Rule::Jumps,
            Event::Rate => Rule::Slow,
            _ if started => Rule::Holds,
            Event::Mode(Mode::Learn) => Rule::Slow,
            _ if free => Rule::Jumps,
            _ => Rule::Slow,
        }
    }
}

/// Sends frames with wrong checksums for this time, s.
pub fn damaged(bench: &mut Bench, seconds: f64) {
    for _ in 0..(seconds * bench.kind.rate()) as u32 {
        let mut frame = bench.frame();
        let middle = frame.len() / 2;
        frame[middle] ^= 0x10;
        bench.n += 1;
        bench.sends(&frame);
        bench.device.pass_us((1e6 / bench.kind.rate()) as u64);
        bench.device.lines.navigation.sent.clear();
    }
}

/// Sends this number of bytes of no format on the sensor's line.
pub fn noise(bench: &mut Bench, bytes: u32) {
    let of = |n: u32| (n.wrapping_mul(2_654_435_761) >> 24) as u8 & 0x7F;
    for piece in (0..bytes).map(of).collect::<Vec<_>>().chunks(50) {
        bench.device.feed(piece);
        bench.device.pass_us(500);
    }
    bench.device.lines.navigation.sent.clear();
}

fn commit(bench: &mut Bench, nets: &Nets) {
    let mut bytes = vec![0; IMAGES_LEN];
    nets.write_images(0, &mut bytes);
    for (n, piece) in bytes.chunks(100).enumerate() {
        bench.device.order(&Request::WriteImage {
            offset: (n * 100) as u32,
            bytes: piece,
        });
    }
    let length = IMAGES_LEN as u32;
    bench.device.ask(&Request::CommitImage { length }, |_| {});
}

/// Largest change from one word to the next.
pub fn fastest(seen: &[f64]) -> f64 {
    let changes = seen.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    changes.fold(0.0, f64::max)
}

/// No event moves a correction faster than its row allows.
#[test]
fn every_state_and_every_event() {
    every_event(Kind::RAWIMUSX);
}

/// As `every_state_and_every_event`, with an ADIS at the SPI.
#[test]
fn every_state_and_every_event_at_the_spi() {
    every_event(Kind::SPI);
}

fn every_event(kind: Kind) {
    let phases = [None, Some(Alignment::Started), Some(Alignment::Finished)];
    for state in STATES {
        let mode = if state == State::Frozen {
            Mode::Frozen
        } else {
            Mode::Learn
        };
        for phase in phases {
            for event in EVENTS {
                let mut bench = begun(kind, state, phase);
                let what = format!("{} {state:?} {phase:?} {event:?}", kind.sensor.name);
                let from = [bench.take(), bench.take_turns()];
                let last = from.map(|from| *from.last().expect("words"));
                event.happens(&mut bench, phase, mode);
                bench.run(8.0);
                let seen = [bench.take(), bench.take_turns()];
                let counts = [bench.count(), bench.count_of_gyro()].map(|count| 1.01 * count);
                let moves = matches!(state, State::FadingIn | State::FadingOut);
                for (i, slew) in [SLEW, GYRO_SLEW].into_iter().enumerate() {
                    let change = fastest(&[&[last[i]][..], &seen[i]].concat());
                    let step = f64::from(slew * BLOCK) * 1.001 + counts[i];
                    match event.rule(state, phase) {
                        Rule::Holds if moves && phase != Some(Alignment::Started) => {
                            assert!(change <= step, "{what}: {change}");
                        }
                        Rule::Holds => assert!(change <= counts[i], "{what}: {change}"),
                        Rule::Slow => assert!(change <= step, "{what}: {change}"),
                        Rule::Jumps => {}
                    }
                }
            }
        }
    }
}

/// Final value of a correction. The first column is the event, then the state, then the correction
/// after ten seconds.
#[test]
fn where_it_goes() {
    let finished = Some(Alignment::Finished);
    let begins = Event::Alignment(Alignment::Started);
    let rows = [
        (Event::Mode(Mode::Bypass), State::Live, 0.0),
        (Event::Mode(Mode::Bypass), State::Stored, 0.0),
        (Event::Mode(Mode::Shadow), State::Stored, 0.0),
        (Event::Mode(Mode::Frozen), State::Live, STORED),
        (Event::Mode(Mode::Frozen), State::Stored, STORED),
        (Event::Mode(Mode::Learn), State::Frozen, STORED),
        (Event::SameMode, State::Live, PROVED),
        (begins, State::FadingIn, PROVED),
        (begins, State::FadingOut, 0.0),
        (begins, State::Live, PROVED),
        (begins, State::Stored, STORED),
        (Event::Images, State::Live, PROVED),
        (Event::Images, State::Stored, UPLOADED),
        (Event::CommitLearnt, State::Live, PROVED),
        (Event::GivesUp, State::Live, 0.0),
        (Event::GivesUp, State::Stored, STORED),
        (Event::Proves, State::Live, UPLOADED),
        (Event::Proves, State::Stored, STORED),
        (Event::Harms, State::Stored, STORED),
        (Event::Silence, State::Live, PROVED),
        (Event::Restart, State::Stored, STORED),
        (Event::Restart, State::Frozen, STORED),
        (Event::Rate, State::Live, 0.0),
        (Event::Rate, State::Stored, 0.0),
    ];
    for (event, state, error) in rows {
        let mode = if state == State::Frozen {
            Mode::Frozen
        } else {
            Mode::Learn
        };
        let mut bench = begun(Kind::RAWIMUSX, state, finished);
        event.happens(&mut bench, finished, mode);
        if event == Event::Rate {
            for _ in 0..500 {
                bench.step(2.0);
            }
        } else {
            bench.run(10.0);
        }
        let last = *bench.take().last().expect("words");
        let near = (last - f64::from(error)).abs() < 1.01 * bench.count();
        assert!(near, "{event:?} {state:?}: {last} instead of {error}");
    }
}

/// Final value of what the first rest has added to the gyros' correction: before an alignment, and
/// after ten seconds.
#[test]
fn where_the_first_rest_goes() {
    let started = Event::Alignment(Alignment::Started);
    let finished = Event::Alignment(Alignment::Finished);
    for (phase, event, error) in [
        (None, Event::SameMode, AT_REST),
        (None, Event::Rests, AT_REST_LATER),
        (None, Event::DrivesOff, AT_REST),
        (None, started, AT_REST),
        (None, finished, AT_REST),
        (None, Event::Images, AT_REST),
        (None, Event::Gap, AT_REST),
        (None, Event::Silence, AT_REST),
        (None, Event::Harms, AT_REST),
        (None, Event::Damage, AT_REST),
        (None, Event::Restart, AT_REST),
        (None, Event::Mode(Mode::Frozen), AT_REST - 10.0 * GYRO_SLEW),
        (None, Event::Mode(Mode::Bypass), AT_REST - 10.0 * GYRO_SLEW),
        (None, Event::Mode(Mode::Shadow), AT_REST - 10.0 * GYRO_SLEW),
        (Some(Alignment::Started), Event::Rests, AT_REST),
        (Some(Alignment::Started), Event::Mode(Mode::Frozen), AT_REST),
        (Some(Alignment::Started), finished, AT_REST),
        // aligned before the rest
        (Some(Alignment::Finished), Event::SameMode, 0.0),
        (Some(Alignment::Finished), Event::Rests, 0.0),
        (Some(Alignment::Finished), Event::Restart, 0.0),
    ] {
        let mut bench = begun(Kind::RAWIMUSX, State::AtRest, phase);
        event.happens(&mut bench, phase, Mode::Learn);
        bench.run(10.0);
        let last = *bench.take_turns().last().expect("words");
        let near = (last - f64::from(error)).abs() < 3.0 * bench.count_of_gyro() + 2e-5;
        assert!(near, "{phase:?} {event:?}: {last} instead of {error}");
    }
}

/// A live correction that came into force with an alignment.
fn commanded() -> Bench {
    let unit = unit(Kind::RAWIMUSX, Activation::Commanded, Mode::Learn);
    let config = Config::of(&unit);
    let mut bench = Bench::of(Kind::RAWIMUSX, |learner| {
        App::with_learner(config, Some(learner))
    });
    bench.says.winner.set(Some(PROVED));
    bench.run(1.0);
    bench.device.order(&Request::Alignment(Alignment::Started));
    bench.run(1.0);
    bench
}

/// An error proved since an alignment began does not come into force when the request is sent
/// again, since its answer was lost.
#[test]
fn an_alignment_reported_twice_changes_nothing() {
    let mut bench = commanded();
    bench.says.winner.set(Some(UPLOADED));
    bench.device.order(&Request::Alignment(Alignment::Started));
    bench.run(2.0);
    let seen = bench.take();
    assert!(fastest(&seen[150..]) <= 1.01 * bench.count());
    let last = *seen.last().expect("words");
    assert!(
        (last - f64::from(PROVED)).abs() < 1.01 * bench.count(),
        "{last}"
    );
}

/// Networks that are uploaded while a live correction is in force are for mode frozen: the
/// correction fades out, and not into them.
#[test]
fn an_upload_ends_a_live_correction() {
    let mut bench = commanded();
    bench.device.order(&Request::Alignment(Alignment::Finished));
    bench.take();
    commit(&mut bench, &with(UPLOADED));
    bench.run(10.0);
    let seen = bench.take();
    let step = f64::from(SLEW * BLOCK) * 1.001 + 1.01 * bench.count();
    assert!(fastest(&seen) <= step);
    assert_eq!(seen.last(), Some(&0.0));
}

/// The networks fail for good: the correction fades, and only then everything passes through.
#[test]
fn failing_networks_fade_out() {
    let mut bench = begun(Kind::RAWIMUSX, State::Stored, Some(Alignment::Finished));
    commit(
        &mut bench,
        &Nets {
            gyro: broken(),
            ..with(STORED)
        },
    );
    bench.take();
    bench.run(3.0);
    assert!(bench.device.app.phase() == firmware::app::Phase::Run(Mode::Learn));
    bench.run(10.0);
    let seen = bench.take();
    let step = f64::from(SLEW * BLOCK) * 1.001 + 1.01 * bench.count();
    assert!(fastest(&seen) <= step, "{}", fastest(&seen));
    assert_eq!(seen.last(), Some(&0.0));
    let cause = firmware::app::phase::Cause::Network;
    assert_eq!(bench.device.app.phase(), firmware::app::Phase::Fault(cause));
}

/// A STIM300 that does not obey goes on with its correction. The text of one that does ends it.
#[test]
fn service_mode() {
    for state in [State::Frozen, State::Stored, State::Live] {
        let mut bench = begun(Kind::STIM, state, Some(Alignment::Finished));
        bench.device.lines.navigation.input.extend(b"SERVICEMODE\r");
        bench.run(3.0);
        let count = 1.01 * bench.count();
        let seen = bench.take();
        assert!(fastest(&seen[6500..]) <= count, "{state:?}");
        bench.device.feed(&b"STIM300 SERVICE MODE\r\n>".repeat(3));
        bench.run(1.0);
        assert!(bench.take().iter().all(|c| *c == 0.0), "{state:?}");
    }
}

/// The sensor sends other units from now on. The correction is the same in SI units, and no word
/// leaves without it.
#[test]
fn another_stream_keeps_it() {
    for state in [State::Frozen, State::Stored, State::Live] {
        let mut bench = begun(Kind::STIM, state, Some(Alignment::Finished));
        let before = *bench.take().last().expect("words");
        let rates = Stim300::DEFAULT.with_unit_codes(0, 0).emit();
        bench.device.feed(&rates);
        bench.step(1.0);
        let words = bench.take();
        let in_force = bench
            .device
            .ask(&Request::GetEstimate, |answer| match answer {
                Response::Estimate(estimate) => estimate.in_force[1][0],
                other => panic!("{other:?}"),
            });
        assert!((f64::from(in_force) - before).abs() < 1.01 * bench.count());
        assert!(words.iter().all(|c| *c != 0.0), "{state:?} {words:?}");
    }
}

/// A correction that fades out in bypass has gone after a second without samples, so that a silent
/// device can be configured.
#[test]
fn a_silent_sensor_ends_the_fade() {
    let mut bench = begun(Kind::RAWIMUSX, State::Live, Some(Alignment::Finished));
    bench.device.order(&Request::SetMode(Mode::Bypass));
    bench.run(0.5);
    let unit = unit(bench.kind, Activation::Commanded, Mode::Bypass);
    let encoded = record(&unit);
    assert_eq!(configure(&mut bench.device, &encoded), Err(Reason::Mode));
    bench.silence(2.5);
    assert_eq!(configure(&mut bench.device, &encoded), Ok(()));
    // in other modes it stays
    let mut bench = begun(Kind::RAWIMUSX, State::Frozen, Some(Alignment::Finished));
    bench.silence(2.5);
    bench.step(1.0);
    let last = *bench.take().last().expect("words");
    assert!(
        (last - f64::from(STORED)).abs() < 1.01 * bench.count(),
        "{last}"
    );
}
