//! The shape 3x3x3x3 (an input layer and three layers of three neurons) and the order of the
//! parameters.
//!
//! Parameter theta of layer l (counted from 0) has the index
//!
//! | parameter | index | |
//! |---|---|---|
//! | W_pq | 21 l + 3 p + q | from unit q of the layer below (layer 0: from input q) to unit p |
//! | R_pq | 21 l + 9 + 3 p + q | from unit q of the same layer, one step earlier, to unit p |
//! | b_p | 21 l + 18 + p | bias of unit p |

use core::fmt::Debug;

/// Number of neuron layers; the input layer is not counted.
pub const LAYERS: usize = 3;
/// Number of neurons in a layer, and of inputs of the network.
pub const NEURONS: usize = 3;
/// Number of parameters of one layer: W 3x3, R 3x3, b 3.
pub const PARAMS_PER_LAYER: usize = 2 * NEURONS * NEURONS + NEURONS;
/// Number of parameters of the network.
pub const PARAMS: usize = LAYERS * PARAMS_PER_LAYER;

/// Offset of R in the parameters of a layer.
pub(crate) const R: usize = NEURONS * NEURONS;
/// Offset of b in the parameters of a layer.
pub(crate) const B: usize = 2 * NEURONS * NEURONS;

/// The kind of a parameter. The paper gives each kind its own step size (eq. 7-9).
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// R: from unit to unit of the same layer, one step later (step size eta).
    Feedback,
    /// W: from layer to layer (step size gamma).
    FeedForward,
    /// b (step size zeta).
    Bias,
}

impl Kind {
    /// The kind of the parameter with this index (see the module's table).
    #[inline]
    #[must_use]
    pub const fn of(index: usize) -> Self {
        match index % PARAMS_PER_LAYER {
            0..R => Self::FeedForward,
            R..B => Self::Feedback,
            _ => Self::Bias,
        }
    }
}

/// The entries of R that exist: [`Full`] or [`Diagonal`].
pub trait Feedback: Copy + Debug + Default + PartialEq + 'static {
    /// Whether every unit feeds back to every unit of its layer; otherwise each feeds back to
    /// itself only.
    const FULL: bool;
    /// Number of parameters in use.
    const ACTIVE: usize;
    /// Code of this kind in the weight image.
    const CODE: u8;

    /// Whether the parameter with this index is in use.
    #[inline]
    #[must_use]
    fn is_active(index: usize) -> bool {
        let within = index % PARAMS_PER_LAYER;
        let off_diagonal = (R..B).contains(&within) && !(within - R).is_multiple_of(NEURONS + 1);
        index < PARAMS && (Self::FULL || !off_diagonal)
    }
}

/// R is a full 3x3 matrix, as in the paper: 63 parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Full;

/// R is diagonal: 45 parameters, and |r| < 1 makes each unit stable by itself.
///
/// The off-diagonal entries of [`crate::Layer::r`] are neither used nor learned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Diagonal;

impl Feedback for Full {
    const FULL: bool = true;
    const ACTIVE: usize = PARAMS;
    const CODE: u8 = 0;
}

impl Feedback for Diagonal {
    const FULL: bool = false;
    const ACTIVE: usize = PARAMS - LAYERS * NEURONS * (NEURONS - 1);
    const CODE: u8 = 1;
}
