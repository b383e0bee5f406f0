//! Speed by the vehicle's wheels, as a host reports it.

use serde::{Deserialize, Serialize};

/// Speed of an axle: the mean over its wheels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WheelSpeed {
    /// m/s, negative in reverse, -200 to 200. 0: the wheels do not turn.
    pub speed: f32,
    /// Time between its validity and this message, ms, 0 to 1000.
    pub age_ms: u16,
}

/// Greatest speed of wheels, m/s.
const MOST: f32 = 200.0;
/// Greatest age of a speed, ms.
const OLDEST_MS: u16 = 1000;

impl WheelSpeed {
    /// Whether both values are in their ranges.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        self.speed.abs() <= MOST && self.age_ms <= OLDEST_MS
    }
}
