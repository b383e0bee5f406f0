//! Learns the error of a gyro triad on a desktop, from a reference that is late: the sum of the
//! true error over each second. Then it estimates the error of new data. Run it with `cargo run
//! --release --example learn`.

use lrnn_nostd::learn::{GaussNewton, Learner};
use lrnn_nostd::{Net, Normalisation, State, Weights};

/// rad/s in a degree an hour.
const DEG_PER_HOUR: f32 = std::f32::consts::PI / (180.0 * 3600.0);
/// Time from sample to sample, s.
const DT: f32 = 0.01;
const SECOND: usize = 100;

/// True rates of a vehicle that turns this way and that, rad/s.
fn rate(sample: usize) -> [f32; 3] {
    let t = DT * sample as f32;
    [
        0.02 * (2.1 * t).sin(),
        0.03 * (1.3 * t).cos(),
        0.25 * (0.2 * t).sin(),
    ]
}

/// Error that the gyros add, rad/s: a bias, a scale factor, an asymmetry, and some of a neighbour's
/// rate.
fn error([_, y, z]: [f32; 3]) -> [f32; 3] {
    let unit = DEG_PER_HOUR;
    [
        unit * 2.0,
        unit * 20.0 * z,
        unit * (-1.0 + 30.0 * z.abs() + 10.0 * y),
    ]
}

fn main() {
    let normalisation = Normalisation {
        input_scale: [20.0, 20.0, 4.0],
        output_scale: [5.0 * DEG_PER_HOUR; 3],
        ..Normalisation::identity()
    };
    let weights = Weights::from_fn(|i| 0.3 * (1.7 * i as f32).sin());
    let mut net: Net = Net::new(weights, normalisation);

    let mut learner: Learner<_> = Learner::new(&net, GaussNewton::new(&net.weights, 1e-3));
    for pass in 0..20 {
        learner.begin_pass();
        let mut sum = [0.0; 3]; // rad
        for sample in 0..120 * SECOND {
            let truth = rate(sample);
            let wrong = error(truth);
            let measured = [0, 1, 2].map(|axis| truth[axis] + wrong[axis]);
            let _ = learner.step(measured, DT);
            for (sum, wrong) in sum.iter_mut().zip(wrong) {
                *sum += wrong * DT;
            }
            if sample % SECOND == SECOND - 1 {
                learner.reference(sum, 1.0);
                sum = [0.0; 3];
            }
        }
        let done = learner.end_pass();
        // A pass that raises the cost is undone, and the next step is shorter.
        let verdict = if done.accepted { "accepted" } else { "undone" };
        println!("pass {pass:>2}: cost {:.5}, {verdict}", done.cost);
    }
    net.weights = learner.proposal();

    // Another minute.
    let mut state = State::new();
    let (mut before, mut after) = (0.0, 0.0);
    let unseen = 200 * SECOND..260 * SECOND;
    let samples = unseen.len() as f32;
    for sample in unseen {
        let truth = rate(sample);
        let wrong = error(truth);
        let measured = [0, 1, 2].map(|axis| truth[axis] + wrong[axis]);
        let step = net.step(&mut state, measured);
        for (wrong, found) in wrong.iter().zip(step.error) {
            before += wrong.powi(2);
            after += (wrong - found).powi(2);
        }
    }
    let [before, after] = [before, after].map(|sum| (sum / samples / 3.0).sqrt() / DEG_PER_HOUR);
    println!("rms error of a gyro: {before:.2} deg/h, corrected {after:.2} deg/h");
    assert!(after < 0.3 * before, "it has not learnt");
}
