//! Teaching the two networks from the teacher's references (window learning, LEARNING section 4).

use crate::session::{EPOCH_S, Session};
use crate::teacher::{Assumptions, Reference};
use firmware::compensator::{Compensator, Limit, State};
use lrnn_nostd::learn::{GaussNewton, Learner};
use lrnn_nostd::{Net, Normalisation, Weights};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// How the networks are taught.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NetworkSpec {
    /// Epochs (s) in a reference window, >= 1.
    pub window_s: u32,
    /// Passes over the learning part, >= 1.
    pub passes: u32,
    /// Standard deviation of each weight around its start: the prior that keeps 63 parameters from fitting noise. > 0
    pub weight_sigma: f64,
    /// The references of neighbouring windows share their errors over about this time, s, > 0.
    pub correlation_s: f64,
    /// Share of the learning session, at its end, that no network learns from and that decides whether one is used; 0.05 to 0.5.
    pub held_back: f64,
    /// Seed of the first weights.
    pub seed: u64,
}

impl Default for NetworkSpec {
    fn default() -> Self {
        Self {
            window_s: 10,
            passes: 12,
            weight_sigma: 0.3,
            correlation_s: 300.0,
            held_back: 0.2,
            seed: 1,
        }
    }
}

/// Mean inputs of the two networks, one a block of one epoch.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// Rates, rad/s.
    pub rate: Vec<[f32; 3]>,
    /// Specific forces, m/s2.
    pub force: Vec<[f32; 3]>,
}

/// Input range of a land vehicle: the networks' units are about 0.2 rad/s and 2 m/s2, gravity taken out.
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

/// Time constants of the second layer's leaky units, s: their transient from power-on spans warm-up curves.
const TIME_CONSTANTS_S: [f64; 3] = [150.0, 500.0, 1500.0];

/// Where learning starts and how far each weight may be expected to go from there.
#[derive(Debug, Clone)]
pub struct Start {
    /// First weights; the output is zero.
    pub weights: Weights,
    /// Standard deviation of each weight around them.
    pub sigma: Weights,
}

/// First weights, and the prior around them. `sigma` is what each path may add to the output, in units of the output scale.
///
/// The second layer's units are slow: `y(k) = tanh((1 - leak) y(k-1) + leak a + ...)` goes to `a` within its time constant only while
/// `a^2 << 3 leak`, since the cubic term of tanh otherwise pulls harder than the leak. So a slow unit lives at a small amplitude, and
/// the weights that read it are allowed to be as much larger.
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

/// Networks that say nothing.
#[must_use]
pub fn silent(assumptions: &Assumptions) -> [Net; 2] {
    normalisation(assumptions).map(|n| Net::new(start(0, 1.0).weights, n))
}

/// The co-processor's compensator for a session, with the product's own code. Limits: ten times the prior.
///
/// # Panics
/// Never for sessions made here: their count values and rates are checked when a scenario or recording is read.
#[must_use]
#[expect(
    clippy::expect_used,
    reason = "count values and rates are checked when a scenario or recording is read"
)]
pub fn compensator(session: &Session, nets: &[Net; 2], assumptions: &Assumptions) -> Compensator {
    let limit = Limit {
        gyro: 10.0 * assumptions.prior.gyro_bias as f32,
        accel: 10.0 * assumptions.prior.accel_bias as f32,
    };
    let block = session.words_per_epoch() as u16;
    Compensator::new(
        nets[0].clone(),
        nets[1].clone(),
        session.lsb,
        session.dt,
        block,
        limit,
    )
    .expect("checked")
}

/// What came out of a compensator: corrected counts are in the session; the estimates are a block's, in force over the next one.
#[derive(Debug, Clone)]
pub struct Compensated {
    /// The session with corrected words.
    pub session: Session,
    /// Network inputs.
    pub inputs: Inputs,
    /// Estimated errors of each block: rad/s and m/s2.
    pub estimates: Vec<[[f32; 3]; 2]>,
}

/// Runs a whole session through the compensator, from power-on.
#[must_use]
pub fn compensate(session: &Session, compensator: &Compensator) -> Compensated {
    let mut state = State::default();
    let mut out = Compensated {
        session: session.clone(),
        inputs: Inputs::default(),
        estimates: Vec::new(),
    };
    for word in &mut out.session.counts {
        let (corrected, block) = compensator.process(&mut state, *word);
        *word = corrected;
        if let Some(b) = block {
            out.inputs.rate.push(b.rate);
            out.inputs.force.push(b.force);
            out.estimates.push([b.rate_error, b.force_error]);
        }
    }
    out
}

/// A taught network and its costs by pass.
#[derive(Debug, Clone)]
pub struct Taught {
    /// The network with the best weights.
    pub net: Net,
    /// Cost of the accepted passes' weights on the part learnt from, per window and axis, in units of the output scale.
    pub cost: Vec<f64>,
}

/// Teaches one network. `references` are consecutive epochs; `pick` takes the triad's error out of a reference.
#[must_use]
pub fn teach(
    spec: &NetworkSpec,
    normalisation: Normalisation,
    inputs: &[[f32; 3]],
    references: &[Reference],
    pick: impl Fn(&Reference) -> (Vector3<f64>, Vector3<f64>),
) -> Taught {
    let begin = start(spec.seed, spec.weight_sigma as f32);
    let first_net = Net::new(begin.weights, normalisation);
    let window = spec.window_s as usize;
    let scale = f64::from(normalisation.output_scale[0]);
    let ridges = begin.sigma.to_array().map(|s| 1.0 / (s * s));
    let mut learner: Learner<GaussNewton> =
        Learner::new(&first_net, GaussNewton::with_ridges(&begin.weights, ridges));
    let mut cost = Vec::new();
    for _ in 0..spec.passes {
        learner.begin_pass();
        let first = references.first().map_or(inputs.len(), |r| r.epoch);
        for input in &inputs[..first] {
            let _ = learner.step(*input, EPOCH_S as f32);
        }
        learner.skip();
        let mut weights = 0.0;
        for piece in references.chunks_exact(window) {
            let mut sum = Vector3::zeros();
            let mut variance = 0.0;
            for r in piece {
                let _ = learner.step(inputs[r.epoch], EPOCH_S as f32);
                let (error, sigma) = pick(r);
                sum += error * EPOCH_S;
                variance += sigma.norm_squared() / 3.0;
            }
            let time = window as f64 * EPOCH_S;
            let sigma = (variance / window as f64).sqrt() * time / scale;
            let weight = (time / spec.correlation_s).min(1.0) / (sigma * sigma);
            weights += weight * 3.0 * time * time;
            learner.reference([sum.x as f32, sum.y as f32, sum.z as f32], weight as f32);
        }
        let pass = learner.end_pass();
        if pass.accepted {
            cost.push(2.0 * f64::from(pass.cost) / weights);
        }
    }
    Taught {
        net: Net::new(learner.proposal(), normalisation),
        cost,
    }
}
