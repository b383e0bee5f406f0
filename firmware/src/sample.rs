//! One IMU word: six integer counts, and what a count is worth.
//!
//! Corrections are made in counts and never in an f32 increment: at 100 deg/s and 100 Hz one f32 ulp of an increment is worth
//! 0.04 deg/h, several times the correction.

/// Increments of one word in output pulses of the sensor. Axes as the sensor sends them; sign as in the stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Delta-theta, counts.
    pub dtheta: [i32; 3],
    /// Delta-v, counts.
    pub dv: [i32; 3],
}

/// Value of one count. f64, because it is only used to set things up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lsb {
    /// Angle of one gyro count, rad, > 0.
    pub rad: f64,
    /// Velocity of one accelerometer count, m/s, > 0.
    pub mps: f64,
}
