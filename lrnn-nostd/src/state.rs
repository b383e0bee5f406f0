//! The state of a network: what it remembers from one step to the next, apart from its weights.

use crate::real::Real;
use crate::shape::{LAYERS, NEURONS};

/// The outputs y_1, y_2, y_3 of the last step: 9 values, 36 bytes in `f32`.
///
/// A copy of the state is enough to replay or fork a run. All values are always finite: with the
/// feature `serde` a state that is not is refused.
///
/// ```
/// use lrnn_nostd::{Net, Normalisation, State, Weights};
///
/// let net: Net = Net::new(Weights::from_fn(|_| 0.2), Normalisation::identity());
/// let mut state = State::new();
/// let first = net.step(&mut state, [0.1; 3]);
/// let mut fork = state;
/// let second = net.step(&mut state, [0.1; 3]);
/// assert_eq!(second, net.step(&mut fork, [0.1; 3]));
/// assert_ne!(second, first); // the network remembers
/// ```
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)] // the kernel reads it
pub struct State<T = f32> {
    pub(crate) y: [[T; NEURONS]; LAYERS],
}

impl<T: Real> State<T> {
    /// All outputs 0, the state before the first step.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            y: [[T::ZERO; NEURONS]; LAYERS],
        }
    }

    /// Resets to [`State::new`].
    pub fn reset(&mut self) {
        *self = Self::new();
    }

    /// y_1, y_2, y_3 of the last step.
    pub fn layers(&self) -> &[[T; NEURONS]; LAYERS] {
        &self.y
    }

    /// y_3 of the last step, which a faulty step repeats.
    pub fn output(&self) -> [T; NEURONS] {
        let [_, _, output] = self.y;
        output
    }
}

#[cfg(feature = "serde")]
impl<'de, T: Real + serde::Deserialize<'de>> serde::Deserialize<'de> for State<T> {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        #[derive(serde::Deserialize)]
        struct State<T> {
            y: [[T; NEURONS]; LAYERS],
        }
        let State { y } = State::deserialize(from)?;
        match y.as_flattened().iter().all(|value: &T| value.is_finite()) {
            true => Ok(Self { y }),
            false => Err(serde::de::Error::custom("a state that is not finite")),
        }
    }
}
