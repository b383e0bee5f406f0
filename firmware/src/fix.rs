//! A fix of a satellite receiver: position and velocity with their accuracy, and when they were
//! valid.

/// Values that a fix observes: position (north, east, down, m), then velocity (m/s).
pub const OBSERVATIONS: usize = 6;

/// Geodetic position on the WGS-84 ellipsoid.
///
/// One unit in the last place of an f64 longitude is 3 nm. Even if each of the 1.7 million
/// navigation steps of 24 h rounded the same way, that would amount to 2.5 mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Position {
    /// Latitude, rad, positive north.
    pub latitude: f64,
    /// Longitude, rad, positive east, -pi to pi.
    pub longitude: f64,
    /// Ellipsoidal height, m.
    pub height: f64,
}

/// A fix that the receiver vouches for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fix {
    /// Position.
    pub position: Position,
    /// Velocity over ground, north, east, down, m/s.
    pub velocity: [f64; 3],
    /// Standard deviations along an axis, in the order of [`OBSERVATIONS`], > 0. `None` when the
    /// receiver gives none.
    pub sigmas: Option<[f32; OBSERVATIONS]>,
    /// Time of validity, ms of the GPS week.
    pub time_ms: u32,
    /// Time of arrival by the board's clock, microseconds.
    pub arrived_us: u64,
}
