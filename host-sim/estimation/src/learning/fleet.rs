//! What many units of a type have in common: the shape of their errors, and its moments.

pub mod fit;
pub mod hidden_layers;
pub mod linear;
