//! Which weights learning from references changes, and how far each may be expected to move.
//!
//! 45 of the 63 weights are learnt; feedback between different units is not. Their covariance takes
//! 4 140 bytes a network instead of 8 064. Only that way do both networks fit into 32 KiB.

use lrnn_nostd::{Diagonal, Feedback, PARAMS, Weights};

/// Number of weights that are learnt.
pub const LEARNT: usize = Diagonal::ACTIVE;

/// The values of the weights that are learnt, out of all.
pub fn pick(all: &[f32; PARAMS]) -> [f32; LEARNT] {
    let mut picked = [0.0; LEARNT];
    let active = all.iter().enumerate().filter(|(i, _)| active(*i));
    for (place, (_, value)) in picked.iter_mut().zip(active) {
        *place = *value;
    }
    picked
}

/// Adds to the weights that are learnt.
pub fn add(weights: &mut Weights, delta: &[f32; LEARNT]) {
    let mut all = weights.to_array();
    let places = all.iter_mut().enumerate().filter(|(i, _)| active(*i));
    for ((_, weight), delta) in places.zip(delta) {
        *weight += delta;
    }
    weights.set_all(&all);
}

fn active(index: usize) -> bool {
    Diagonal::is_active(index)
}

/// Standard deviation of each weight around `weights`, as the desktop's teacher has it: what each
/// path may add to the output, in units of the output scale.
///
/// A unit of the second layer with feedback 1 - leak follows its input within 1/leak steps only
/// while it is much smaller than sqrt(leak); otherwise the cubic term of the activation pulls
/// harder than the leak. So the unit works at half of sqrt(leak), and the weights that read it may
/// be correspondingly larger.
pub fn sigma(weights: &Weights) -> Weights {
    const OUTPUT: f32 = 0.3;
    let mut sigma = Weights::zero();
    let [first, second, output] = &mut sigma.layers;
    first.w = [[0.3; 3]; 3];
    first.r = [[0.2; 3]; 3];
    first.b = [0.3; 3];
    output.r = [[0.05; 3]; 3];
    output.b = [1.0; 3];
    let [_, slow, _] = &weights.layers;
    for (i, row) in slow.r.iter().enumerate() {
        let leak = row.get(i).map_or(1.0, |r| 1.0 - r.abs()).clamp(1e-4, 1.0);
        let amplitude = 0.5 * lrnn_nostd::Real::sqrt(leak);
        for (of, size) in [
            (second.w.get_mut(i), leak * amplitude),
            (second.r.get_mut(i), 0.1 * leak),
        ] {
            if let Some(of) = of {
                *of = [size; 3];
            }
        }
        if let Some(bias) = second.b.get_mut(i) {
            *bias = 0.3 * leak * amplitude;
        }
        for row in &mut output.w {
            if let Some(weight) = row.get_mut(i) {
                *weight = OUTPUT / amplitude;
            }
        }
    }
    sigma
}
