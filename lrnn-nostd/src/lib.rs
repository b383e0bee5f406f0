#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]
// Matrix and vector elements are written with their indices, as in the equations.
#![allow(clippy::needless_range_loop)]

#[cfg(test)]
extern crate std;

pub mod activation;
pub mod gradient;
pub mod image;
pub mod infer;
pub mod kernel;
pub mod learn;
pub mod normalisation;
pub mod real;
mod settle;
pub mod shape;
pub mod state;
pub mod weights;

#[cfg(feature = "micromath")]
pub use activation::MicroMath;
pub use activation::{Activation, Cubic, Identity, Rational, Tanh};
pub use gradient::Sensitivities;
pub use infer::{Fault, Net, Step};
pub use normalisation::Normalisation;
pub use real::Real;
pub use shape::{Diagonal, Feedback, Full, Kind, LAYERS, NEURONS, PARAMS, PARAMS_PER_LAYER};
pub use state::State;
pub use weights::{Layer, Weights};
