//! Teaching the two networks from the teacher's references (window learning, LEARNING section 2,
//! way B).

use crate::learning::teacher::{Assumptions, Reference};
use firmware::compensator::{Block, Compensator, Limit, State};
use firmware::sample::Counts;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::Increment;
use host_unit::scenario::network::{NetworkSpec, Rule};
use lrnn_nostd::learn::{GaussNewton, Guarded, Learner, Paper, StepSizes};
use lrnn_nostd::{Net, Normalisation, Weights};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The paper's constants eps_1 = eps_2 = eps_3. The paper only states that they lie in [0, 1]
/// (assumed).
const PAPER_EPS: f64 = 0.1;

/// Inputs of the two networks, one a block of one epoch.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// Gyro network: rates, rad/s, unless the compensator has other inputs.
    pub rate: Vec<[f32; 3]>,
    /// Accelerometer network: specific forces, m/s2, unless the compensator has other inputs.
    pub force: Vec<[f32; 3]>,
}

impl Inputs {
    fn push(&mut self, compensator: &Compensator, block: &Block) {
        let [gyro, accel] = compensator.inputs();
        self.rate.push(block.sources.select(gyro));
        self.force.push(block.sources.select(accel));
    }
}

/// Input range of a land vehicle: about 0.2 rad/s, and 2 m/s2 beside gravity, become 1.
const RATE_SCALE: f32 = 5.0;
const FORCE_SCALE: f32 = 0.5;
const GRAVITY: f32 = 9.8;

/// Normalisation of the two networks: output in units of the biases' prior.
#[must_use]
pub fn normalisation(assumptions: &Assumptions) -> [Normalisation; 2] {
    let scale = |x: f64| [x as f32; 3];
    [
        Normalisation {
            input_offset: [0.0; 3],
            input_scale: [RATE_SCALE; 3],
            output_scale: scale(assumptions.prior.gyro_bias),
        },
        Normalisation {
            input_offset: [0.0, 0.0, -GRAVITY],
            input_scale: [FORCE_SCALE; 3],
            output_scale: scale(assumptions.prior.accel_bias),
        },
    ]
}

/// Time constants of the second layer's leaky units, s. Their transient from power-on spans warm-up
/// curves.
const TIME_CONSTANTS_S: [f64; 3] = [150.0, 500.0, 1500.0];

/// The start of learning, and the expected change of each weight.
#[derive(Debug, Clone)]
pub struct Start {
    /// First weights; the output is zero.
    pub weights: Weights,
    /// Standard deviation of each weight around them.
    pub sigma: Weights,
}

/// First weights, and the prior around them. `sigma` is the standard deviation of each path's
/// contribution to the output, in units of the output scale.
///
/// The second layer's units are slow: `y(k) = tanh((1 - leak) y(k-1) + leak a + ...)`. A unit goes
/// to `a` within its time constant only while `a^2 << 3 leak`, since the cubic term of tanh is
/// otherwise stronger than the leak. A slow unit therefore has a small amplitude, and the weights
/// of its output may be larger by the same factor.
#[must_use]
pub fn start(seed: u64, sigma: f32) -> Start {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut small = |size: f32| -> f32 { rng.random_range(-size..size) };
    let (mut w, mut s) = (Weights::zero(), Weights::zero());
    w.layers[0].w = [[0.0; 3]; 3].map(|row: [f32; 3]| row.map(|_| small(0.5)));
    w.layers[0].b = [0.0; 3].map(|_: f32| small(0.3));
    s.layers[0].w = [[0.3; 3]; 3];
    s.layers[0].r = [[0.2; 3]; 3];
    s.layers[0].b = [0.3; 3];
    for (i, tau) in TIME_CONSTANTS_S.iter().enumerate() {
        let leak = (EPOCH_S / tau) as f32;
        let amplitude = 0.5 * leak.sqrt();
        w.layers[1].r[i][i] = 1.0 - leak;
        w.layers[1].b[i] = leak * amplitude;
        w.layers[1].w[i] = [0.0; 3].map(|_: f32| small(leak * amplitude));
        s.layers[1].w[i] = [leak * amplitude; 3];
        s.layers[1].r[i] = [0.1 * leak; 3];
        s.layers[1].b[i] = 0.3 * leak * amplitude;
        for row in &mut s.layers[2].w {
            row[i] = sigma / amplitude;
        }
    }
    s.layers[2].r = [[0.05; 3]; 3];
    s.layers[2].b = [1.0; 3];
    Start {
        weights: w,
        sigma: s,
    }
}

/// Networks with zero output.
#[must_use]
pub fn silent(assumptions: &Assumptions) -> [Net; 2] {
    normalisation(assumptions).map(|n| Net::new(start(0, 1.0).weights, n))
}

/// Limits of the corrections: as given, else ten times the prior.
#[must_use]
pub fn limit(assumptions: &Assumptions) -> Limit {
    if let Some([gyro, accel]) = assumptions.limit {
        let (gyro, accel) = (gyro as f32, accel as f32);
        return Limit { gyro, accel };
    }
    Limit {
        gyro: 10.0 * assumptions.prior.gyro_bias as f32,
        accel: 10.0 * assumptions.prior.accel_bias as f32,
    }
}

/// The co-processor's compensator for a session: the firmware's own code. Limits: ten times the
/// prior.
///
/// # Panics
/// Never for sessions made here: scale and rate are checked when a scenario or recording is read.
#[must_use]
#[expect(
    clippy::expect_used,
    reason = "count values and rates are checked when a scenario or recording is read"
)]
pub fn compensator(session: &Session, nets: &[Net; 2], assumptions: &Assumptions) -> Compensator {
    let limit = limit(assumptions);
    let block = session.samples_per_epoch() as u16;
    let made = Compensator::new(nets[0], nets[1], session.lsb, session.dt, block, limit);
    let mut compensator = made.expect("checked");
    compensator.set_inputs(assumptions.inputs);
    compensator
}

/// The thermometers' reading in the epoch that begins with sample `k`, degrees C: the mean of their
/// three axes, as in the device. `None` within an epoch, and without a reading.
#[must_use]
pub fn temperature_at(session: &Session, k: usize) -> Option<f32> {
    let n = session.samples_per_epoch();
    let readings = session.readings.as_ref().filter(|_| k.is_multiple_of(n))?;
    Some(readings.get(k / n)?.axes.mean() as f32)
}

/// Gives the compensator the thermometers' reading before sample `k`.
pub fn read_temperature(session: &Session, k: usize, state: &mut State) {
    if let Some(celsius) = temperature_at(session, k) {
        state.read_temperature(celsius);
    }
}

/// The output of a compensator. The session has the corrected counts. The estimates are those of a
/// block, in force over the next one.
#[derive(Debug, Clone)]
pub struct Compensated {
    /// The session with corrected samples.
    pub session: Session,
    /// Network inputs.
    pub inputs: Inputs,
    /// Estimated errors of each block: rad/s and m/s2.
    pub estimates: Vec<[[f32; 3]; 2]>,
}

/// Runs a whole session through the compensator, from power-on.
#[must_use]
pub fn compensate(session: &Session, compensator: &Compensator) -> Compensated {
    let mut state = compensator.power_on(false);
    let mut out = Compensated {
        session: session.clone(),
        inputs: Inputs::default(),
        estimates: Vec::new(),
    };
    let mut all = session.counts.to_vec();
    for (k, counts) in all.iter_mut().enumerate() {
        read_temperature(session, k, &mut state);
        let (corrected, block) = compensator.process(&mut state, *counts);
        *counts = corrected;
        if let Some(b) = block {
            out.inputs.push(compensator, &b);
            out.estimates.push([b.rate_error, b.force_error]);
        }
    }
    out.session.counts = all.into();
    out
}

/// Corrected counts of some epochs. The compensator runs from power-on.
#[must_use]
pub fn corrected_counts(
    session: &Session,
    compensator: &Compensator,
    epochs: std::ops::Range<usize>,
) -> Vec<Counts> {
    let mut state = compensator.power_on(false);
    let n = session.samples_per_epoch();
    let counts = session.counts.part(0..epochs.end * n);
    let corrected = counts.each().enumerate().map(|(k, counts)| {
        read_temperature(session, k, &mut state);
        compensator.process(&mut state, counts).0
    });
    corrected.skip(epochs.start * n).collect()
}

/// [`corrected_counts`] in the form of [`Session::increments`]. Earlier increments are zero.
#[must_use]
pub fn corrected_increments(
    session: &Session,
    compensator: &Compensator,
    epochs: std::ops::Range<usize>,
) -> Vec<Increment> {
    let first = epochs.start;
    let counts = corrected_counts(session, compensator, epochs).into_iter();
    increments_from(session, first, counts)
}

/// The increments of a session whose counts from epoch `first` on are these, in the form of
/// [`Session::increments`]. Earlier increments are zero.
#[must_use]
pub fn increments_from(
    session: &Session,
    first: usize,
    counts: impl Iterator<Item = Counts>,
) -> Vec<Increment> {
    let mut out = vec![Increment::default(); first * session.steps_per_epoch()];
    out.extend(session.navigable(counts));
    out
}

/// Network inputs of the first `epochs`.
#[must_use]
pub fn inputs(session: &Session, compensator: &Compensator, epochs: usize) -> Inputs {
    let (mut state, mut out) = (compensator.power_on(false), Inputs::default());
    let samples = epochs * session.samples_per_epoch();
    let counts = session.counts.part(0..samples);
    for (k, counts) in counts.each().enumerate() {
        read_temperature(session, k, &mut state);
        if let Some(b) = compensator.process(&mut state, counts).1 {
            out.push(compensator, &b);
        }
    }
    out
}

/// A taught network and its cost in each pass.
#[derive(Debug, Clone)]
pub struct Taught {
    /// The network with the best weights.
    pub net: Net,
    /// Cost of the weights of each accepted pass on the part learnt from, per window and axis, in
    /// units of the output scale.
    pub cost: Vec<f64>,
}

/// A reference over a window: its epochs, the required sum of the output, and its weight.
struct Target {
    epochs: std::ops::Range<usize>,
    sum: [f32; 3],
    weight: f32,
}

/// Windows of consecutive references. `pick` takes the triad's error and its standard deviation out
/// of a reference.
fn targets(
    spec: &NetworkSpec,
    scale: f64,
    references: &[Reference],
    pick: impl Fn(&Reference) -> (Vector3<f64>, Vector3<f64>),
) -> Vec<Target> {
    let length = spec.window_s as usize;
    let time = length as f64 * EPOCH_S;
    let target = |piece: &[Reference]| {
        let sum: Vector3<f64> = piece.iter().map(|r| pick(r).0 * EPOCH_S).sum();
        let variance: f64 = piece.iter().map(|r| pick(r).1.norm_squared() / 3.0).sum();
        let sigma = (variance / length as f64).sqrt() * time / scale;
        Target {
            epochs: piece[0].epoch..piece[0].epoch + length,
            sum: [sum.x as f32, sum.y as f32, sum.z as f32],
            weight: ((time / spec.correlation_s).min(1.0) / (sigma * sigma)) as f32,
        }
    };
    references.chunks_exact(length).map(target).collect()
}

/// Teaches one network. `references` are those of consecutive epochs. `pick` takes the triad's
/// error and its standard deviation out of a reference.
#[must_use]
pub fn teach(
    spec: &NetworkSpec,
    normalisation: Normalisation,
    inputs: &[[f32; 3]],
    references: &[Reference],
    pick: impl Fn(&Reference) -> (Vector3<f64>, Vector3<f64>),
) -> Taught {
    let begin = start(spec.seed, spec.weight_sigma as f32);
    let net = Net::new(begin.weights, normalisation);
    let targets = targets(
        spec,
        f64::from(normalisation.output_scale[0]),
        references,
        pick,
    );
    let total: f64 = targets.iter().map(|t| f64::from(t.weight)).sum();
    // the gradient rules' step belongs to a mean over windows
    let steps = |eta: f64| StepSizes {
        feedback: eta as f32,
        feed_forward: eta as f32,
        bias: eta as f32,
    };
    let eta = spec.first_step / total.max(f64::MIN_POSITIVE) / f64::from(spec.window_s).powi(2);
    match spec.rule {
        Rule::GaussNewton => {
            let ridges = begin.sigma.to_array().map(|s| 1.0 / (s * s));
            passes(
                spec,
                &net,
                GaussNewton::with_ridges(&begin.weights, ridges),
                inputs,
                &targets,
            )
        }
        Rule::Guarded => passes(spec, &net, Guarded::new(steps(eta)), inputs, &targets),
        Rule::Paper => passes(
            spec,
            &net,
            Paper::new(steps(eta), steps(PAPER_EPS)),
            inputs,
            &targets,
        ),
    }
}

/// All passes by one rule.
fn passes<U: lrnn_nostd::learn::Rule<f32>>(
    spec: &NetworkSpec,
    net: &Net,
    rule: U,
    inputs: &[[f32; 3]],
    targets: &[Target],
) -> Taught {
    let mut learner: Learner<U> = Learner::new(net, rule);
    let windows = targets
        .iter()
        .map(|t| f64::from(t.weight) * 3.0 * (t.epochs.len() as f64 * EPOCH_S).powi(2));
    let norm: f64 = windows.sum::<f64>().max(f64::MIN_POSITIVE);
    let mut cost = Vec::new();
    for _ in 0..spec.passes {
        learner.begin_pass();
        let mut epoch = 0;
        for target in targets {
            // inputs before a window only change the state
            for input in &inputs[epoch..target.epochs.start] {
                let _ = learner.step(*input, EPOCH_S as f32);
            }
            learner.skip();
            for input in &inputs[target.epochs.clone()] {
                let _ = learner.step(*input, EPOCH_S as f32);
            }
            epoch = target.epochs.end;
            learner.reference(target.sum, target.weight);
        }
        let pass = learner.end_pass();
        if pass.accepted {
            cost.push(2.0 * f64::from(pass.cost) / norm);
        }
    }
    Taught {
        net: Net::new(learner.proposal(), net.normalisation),
        cost,
    }
}
