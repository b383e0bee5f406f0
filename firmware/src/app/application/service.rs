//! The time after a sensor was asked for its service mode.

/// After this time the sensor has not obeyed, microseconds.
const OBEYS_US: u64 = 500_000;

/// Length of a run of characters that counts as text. Frames have bytes that are no characters.
const TEXT: u8 = 16;

/// Frames that are still on their way do not show that the sensor is in its normal mode.
#[derive(Debug)]
pub(super) struct Service {
    /// Time of the request, microseconds.
    asked_us: u64,
    /// Characters in a row.
    text: u8,
}

impl Service {
    pub fn new(now: u64) -> Service {
        Service {
            asked_us: now,
            text: 0,
        }
    }

    /// Takes a byte of the sensor. False: frames count again, because text has come, or none for so
    /// long that the sensor did not obey.
    pub fn lasts(&mut self, byte: u8, now: u64) -> bool {
        !self.obeyed(byte) && now.saturating_sub(self.asked_us) < OBEYS_US
    }

    /// Takes a byte of the sensor, or any byte of a frame. True: text has come.
    pub fn obeyed(&mut self, byte: u8) -> bool {
        self.text = match byte {
            b' '..=b'~' | b'\r' | b'\n' => self.text + 1,
            _ => 0,
        };
        self.text >= TEXT
    }
}
