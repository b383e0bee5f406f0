//! Whether a learnt network may be used: it must explain held-back fixes better than no correction does, by far more than chance.
//!
//! A nine-state filter that believes in perfect sensors runs over the held-back part, once with the words as they are and once corrected.
//! The difference of the two log-likelihoods of the fixes is the log-likelihood ratio of "the correction is right" against "there is
//! nothing to correct". When there is nothing to correct, a ratio above `k` comes with a probability below `1/k` (Ville's inequality),
//! whatever was learnt.

use crate::ekf::{Aided, ErrorModel, NAV, Noise};
use crate::session::Session;
use crate::sins::Increment;
use crate::teacher::Nominal;

/// Least log-likelihood ratio: less than one wrong promotion in a hundred.
pub const THRESHOLD: f64 = 4.6;

/// Log-likelihood of the fixes of epochs `from..to`, starting from the teacher's state at `from`.
#[must_use]
pub fn log_likelihood(session: &Session, words: &[Increment], nominal: &Nominal, noise: Noise, from: usize, to: usize) -> f64 {
    let Some(start) = nominal.records.get(from - nominal.first) else { return f64::NEG_INFINITY };
    let sigma = crate::ekf::InitialSigma { tilt: 0.0, heading: 0.0, velocity: 0.0, position: 0.0 };
    let mut filter = Aided::new(start.nav, &sigma, ErrorModel::default(), noise);
    filter.p = start.p.view((0, 0), (NAV, NAV)).into_owned();
    let n = session.words_per_epoch();
    let mut sum = 0.0;
    for k in from..to {
        for word in &words[k * n..(k + 1) * n] {
            filter.word(word, session.dt);
        }
        sum += filter.fix(&session.fixes[k + 1], &session.sigmas).log_likelihood;
    }
    sum
}
