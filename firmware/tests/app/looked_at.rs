//! What the learner knows and what its rehearsals have shown, as reported over the command link:
//! `GetSolution`, `GetTrials` and `GetProgress`.

use crate::activation::PLACE;
use crate::device::{Device, Mock};
use crate::fixes::{Bench, config};
use firmware::app::{App, Config};
use firmware::compensator::Block;
use firmware::control::{Mode, Reason};
use firmware::fix::Position;
use firmware::learn::rehearsal::Standing;
use firmware::learn::{Learner, Report, Solution, Trial, Trials};
use firmware::model::Nets;
use firmware::nav::State;
use firmware::sample::StreamScale;
use firmware::units::DEGREE;
use firmware::wire::command::{self, Request, Response};

fn solution(device: &mut Device<Mock>) -> Result<command::Solution, Reason> {
    device.ask(&Request::GetSolution, |answer| match answer {
        Response::Solution(solution) => Ok(solution),
        Response::Refused(reason) => Err(reason),
        other => panic!("{other:?}"),
    })
}

fn trials(device: &mut Device<Mock>) -> Result<command::Trials, Reason> {
    device.ask(&Request::GetTrials, |answer| match answer {
        Response::Trials(trials) => Ok(trials),
        Response::Refused(reason) => Err(reason),
        other => panic!("{other:?}"),
    })
}

fn progress(device: &mut Device<Mock>) -> Result<command::Progress, Reason> {
    device.ask(&Request::GetProgress, |answer| match answer {
        Response::Progress(progress) => Ok(progress),
        Response::Refused(reason) => Err(reason),
        other => panic!("{other:?}"),
    })
}

/// A learner that knows what it was made with.
#[derive(Debug)]
struct Knows(Option<Solution>, Option<Trials>);

impl Learner for Knows {
    fn begin(&mut self, _: &Nets, _: StreamScale) {}
    fn restart(&mut self) {}
    fn block(&mut self, _: u32, _: &Block) {}
    fn gap(&mut self) {}
    fn learnt(&mut self) -> (Nets, [lrnn_nostd::State; 2]) {
        (Nets::NONE, [lrnn_nostd::State::new(); 2])
    }
    fn report(&self) -> Report {
        Report::default()
    }
    fn solution(&self) -> Option<Solution> {
        self.0
    }
    fn trials(&self) -> Option<Trials> {
        self.1
    }
}

fn device(knows: Knows) -> Device<Mock> {
    let mut device = Device::new(Config::default());
    device.app = App::with_learner(config(), Some(Box::leak(Box::new(knows))));
    device
}

/// Every value has its own field in the answer.
#[test]
fn each_value_is_reported_in_its_field() {
    let position = Position {
        latitude: 0.843_210_987_654_321,
        longitude: -1.234_567_890_123_456,
        height: 321.0625,
    };
    let known = Solution {
        state: State {
            position,
            velocity: [1.25, -2.5, 3.75],
            q_bn: [0.5, -0.25, 0.125, -0.0625],
        },
        estimate: [[1e-5, 2e-5, 3e-5], [4e-3, 5e-3, 6e-3]],
        sigma: [[7e-6, 8e-6, 9e-6], [1e-3, 2e-3, 3e-3]],
    };
    let each = core::array::from_fn(|k| {
        let value = k as f32;
        Trial {
            enabled: k % 3 != 1,
            proved: k % 4 == 2,
            evidence: f64::from(value) * 1.5 - 2.0,
            standing: Standing {
                proof: value + 100.5,
                check: -value - 0.25,
                longest: 1e9,
                score: -1e9,
            },
        }
    });
    let ended = [600, 500, 400, 300, 200, 100];
    let tried = Trials {
        leading: 6,
        ended,
        each,
    };
    let mut device = device(Knows(Some(known), Some(tried)));
    let expected = command::Solution {
        place: [position.latitude, position.longitude], // to the last bit: 1e-9 rad are 6 mm
        height: 321.0625,
        velocity: [1.25, -2.5, 3.75],
        attitude: [0.5, -0.25, 0.125, -0.0625],
        estimate: known.estimate,
        sigma: known.sigma,
    };
    assert_eq!(solution(&mut device), Ok(expected));
    let expected = command::Trials {
        leading: 6,
        enabled: 0b0110_1101,
        proved: 0b0100_0100,
        ended,
        evidence: [-2.0, -0.5, 1.0, 2.5, 4.0, 5.5, 7.0, 8.5],
        proof: [100.5, 101.5, 102.5, 103.5, 104.5, 105.5, 106.5, 107.5],
        check: [-0.25, -1.25, -2.25, -3.25, -4.25, -5.25, -6.25, -7.25],
    };
    assert_eq!(trials(&mut device), Ok(expected));
    // 2 and 6 have proved themselves; 7 has more capital, but no proof
    let near = progress(&mut device).expect("it has a learner");
    assert_eq!(
        (near.nearest, near.proof, near.proved),
        (6, 106.5, true),
        "{near:?}"
    );
}

/// Of hypotheses that are not proved the richest is the nearest, but not the zero correction, and
/// none that does not take part.
#[test]
fn the_richest_hypothesis_is_the_nearest_to_its_proof() {
    let standing = |proof| Standing {
        proof,
        check: 1.0,
        longest: 1.0,
        score: 0.0,
    };
    let mut tried = Trials {
        leading: 0,
        ended: [0; 6],
        each: [80.0, 3.0, 20.0, 90.0, 20.0, 1.0, 1.0, 19.0].map(|proof| Trial {
            enabled: proof < 85.0,
            proved: false,
            evidence: 0.0,
            standing: standing(proof),
        }),
    };
    let near = |tried| {
        let of = progress(&mut device(Knows(None, Some(tried)))).expect("it has a learner");
        (of.nearest, of.proof, of.proved)
    };
    assert_eq!(near(tried), (2, 20.0, false));
    for trial in &mut tried.each[1..] {
        trial.enabled = false;
    }
    assert_eq!(near(tried), (0, 0.0, false));
}

/// A board without a learner has neither, nor has a learner that only knows references, nor one
/// that knows nothing yet.
#[test]
fn what_is_not_known_is_not_reported() {
    let none = progress(&mut Device::new(config()));
    assert_eq!(none, Err(Reason::NotAvailable));
    for mut device in [
        Device::new(config()),
        Device::learning(config()),
        device(Knows(None, None)),
    ] {
        assert_eq!(solution(&mut device), Err(Reason::NotAvailable));
        assert_eq!(trials(&mut device), Err(Reason::NotAvailable));
    }
}

/// The learner of the device: trials from the first request on, a solution from the alignment on,
/// in shadow and learn only. The vehicle stands at a known position.
#[test]
fn the_learner_tells_its_solution_once_it_navigates() {
    let mut bench = Bench::new(config());
    let at_first = trials(&mut bench.device).expect("it has a learner");
    assert_eq!((at_first.ended, at_first.proved), ([0; 6], 0));
    assert_eq!(solution(&mut bench.device), Err(Reason::NotAvailable));
    bench.run(95, None);
    assert!(!bench.health().navigates);
    assert_eq!(solution(&mut bench.device), Err(Reason::NotAvailable));
    bench.run(65, None);
    assert!(bench.health().navigates);
    let first = solution(&mut bench.device).expect("it navigates");
    let off = |a: f64, b: f64| ((a - b) * 6.4e6).abs();
    assert!(off(first.place[0], PLACE.latitude) < 1.0, "{first:?}");
    assert!(off(first.place[1], PLACE.longitude) < 1.0, "{first:?}");
    assert!((first.height - 200.0).abs() < 2.0, "{first:?}");
    assert!(first.velocity.iter().all(|of| of.abs() < 0.05), "{first:?}");
    let [q0, q1, q2, q3] = first.attitude.map(f64::from);
    assert!(((q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3) - 1.0).abs() < 1e-6);
    // level, and to the north within what an unaided gyrocompass knows
    assert!(
        q1.abs().max(q2.abs()) < 1e-3 && q3.abs() < 2.0 * DEGREE,
        "{first:?}"
    );
    assert!(first.sigma.as_flattened().iter().all(|of| *of > 0.0));
    let tried = trials(&mut bench.device).expect("it has a learner");
    assert_eq!((at_first.enabled, tried.enabled & 1), (0, 1), "{tried:?}");
    assert_eq!(tried.evidence[0], 0.0, "relative to itself");
    assert!(tried.ended[0] >= tried.ended[5]);
    // an error of a gyro shows in the estimate and its evidence
    bench.errs_north();
    bench.run(1500, None);
    let health = bench.health();
    let (later, tried) = (solution(&mut bench.device), trials(&mut bench.device));
    let (later, tried) = (
        later.expect("it navigates"),
        tried.expect("it has a learner"),
    );
    assert!(health.winner > 0, "{health:?}");
    assert!(
        tried.proved >> health.winner & 1 == 1,
        "{tried:?} {health:?}"
    );
    assert!(
        tried.proof[usize::from(health.winner)] >= 100.0,
        "{tried:?}"
    );
    assert!(
        tried.evidence[usize::from(tried.leading)] > 0.0,
        "{tried:?}"
    );
    assert!(
        tried.ended[0] > 0 && tried.ended[0] >= tried.ended[5],
        "{tried:?}"
    );
    assert!((later.estimate[0][0] - 1e-5).abs() < 3e-6, "{later:?}");
    assert!(later.sigma[0][0] < first.sigma[0][0], "{later:?} {first:?}");
}

/// Without learning there is no solution, with a board that has a learner or not.
#[test]
fn a_learner_that_was_not_begun_has_no_solution() {
    for mode in [Mode::Bypass, Mode::Frozen] {
        let mut bench = Bench::new(Config { mode, ..config() });
        bench.run(115, None);
        assert_eq!(solution(&mut bench.device), Err(Reason::NotAvailable));
        let tried = trials(&mut bench.device).expect("it has a learner");
        assert_eq!((tried.ended, tried.proved), ([0; 6], 0), "{mode:?}");
    }
}
