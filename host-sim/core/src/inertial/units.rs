//! Units of datasheets. Inside, everything is in SI: multiply by a constant to get SI, divide by it
//! to go back.

/// One degree in rad.
pub const DEG: f64 = std::f64::consts::PI / 180.0;
/// One arc second in rad.
pub const ARCSEC: f64 = DEG / 3600.0;
/// One degree per hour in rad/s.
pub const DEG_PER_H: f64 = DEG / 3600.0;
/// One degree per square root of an hour (angle random walk) in rad/sqrt(s).
pub const DEG_PER_SQRT_H: f64 = DEG / 60.0;
/// Standard gravity in m/s2; the `g` of accelerometer datasheets.
pub const G0: f64 = 9.806_65;
/// One micro-g in m/s2.
pub const UG: f64 = G0 * 1e-6;
/// One micro-g per square root of a hertz (velocity random walk) in m/s/sqrt(s).
pub const UG_PER_SQRT_HZ: f64 = UG;
/// One part per million.
pub const PPM: f64 = 1e-6;
/// One minute in s.
pub const MIN: f64 = 60.0;
