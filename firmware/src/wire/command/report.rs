//! Answers about the board, its store and its receiver.

use serde::{Deserialize, Serialize};

/// Memory of the unit from earlier drives, in the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Remembered {
    /// Drives that it was learnt on; 0: nothing is remembered.
    pub drives: u16,
    /// Time learnt in them, minutes.
    pub minutes: u32,
    /// Least and most temperature of the sensor meanwhile, degrees C; `None`: not known.
    pub temperatures: Option<[i16; 2]>,
    /// The networks in use from power-on on, which are the stored ones unless others were uploaded,
    /// correct the samples.
    pub acts: bool,
    /// The memory found is of another sensor, or of networks with other inputs, and is not used.
    pub of_another: bool,
}

/// Content of the store when the device started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct StoreReport {
    /// Number of the record in use; `None`: nothing was found, or nothing that is used.
    pub generation: Option<u32>,
    /// Starts in the device's life until that record was stored, saturating.
    pub starts: u32,
    /// Number of these starts that followed a failure, saturating.
    pub failures: u32,
    /// Running time until that record was stored, saturating.
    pub minutes: u32,
    /// Times each of the two slots was erased.
    pub erased: [u32; 2],
    /// A newer record is damaged and was not used.
    pub damaged: bool,
    /// Newer good records were passed over, because the device had failed with them.
    pub passed: u8,
}

/// Lever arm and delay of the receiver's antenna: as configured, and from the first fixes in motion
/// on as estimated from them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Antenna {
    /// Lever arm from the IMU to the antenna, body axes (forward, right, down), m.
    pub lever_arm: [f32; 3],
    /// Its standard deviation along each axis, m; 0: known exactly.
    pub lever_arm_sigma: [f32; 3],
    /// Least age of a fix when it arrives, s.
    pub fix_delay: f32,
    /// Its standard deviation, s; 0: known exactly.
    pub fix_delay_sigma: f32,
}

/// The board, and what it is configured for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Board<'a> {
    /// Name of the board.
    pub name: &'a str,
    /// Clock of the sensor's, the navigation computer's and the receiver's UART, Hz; 0: not known.
    pub uart_clocks: [u32; 3],
    /// Bit rates that these lines have in fact, bit/s, rounded; 0: not known.
    pub bauds: [u32; 3],
    /// Sets of pins that it has.
    pub pin_sets: u8,
    /// The board can store configuration and weights.
    pub stores: bool,
    /// Schema of the configuration records it takes.
    pub schema: u16,
    /// The device has a configuration.
    pub configured: bool,
    /// The configuration in use is the stored one.
    pub stored: bool,
}
