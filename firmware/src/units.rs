//! Units that sensors and settings use, in SI.

/// Standard gravity, m/s^2 (CGPM 1901): what a sensor means by 1 g.
pub const G: f64 = 9.806_65;
/// One degree, rad.
pub const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// The international foot, m.
pub const FOOT: f64 = 0.3048;
