//! Requests of a navigation computer to a STIM300 in normal mode, on the reverse link.
//!
//! Source: datasheet TS1524 rev 31, section 8. Commands are in upper case, ended by CR, and never
//! echoed. The sensor obeys only a complete correct command. The requested datagram replaces the
//! next measurement, whose increments are then lost.

use super::config::{
    BIAS_TRIM_ID, CONFIGURATION_ID, EXTENDED_ERROR_ID, PART_NUMBER_ID, SERIAL_NUMBER_ID,
};

/// A complete command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// `N`
    PartNumber,
    /// `I`
    SerialNumber,
    /// `C`: a client that starts with the wrong format (`vortexntnu/stim300-driver`) understands
    /// nothing before the answer.
    Configuration,
    /// `T`
    BiasTrim,
    /// `E`: its errors are cleared by the answer.
    ExtendedError,
    /// `R`
    Reset,
    /// `SERVICEMODE`: text from here on, no measurements.
    ServiceMode,
    /// `UTILITYMODE`: likewise.
    UtilityMode,
    /// Anything else: the device would not answer.
    Unknown,
}

impl Request {
    /// The identifier of the datagram that answers, in the form without CR LF.
    pub fn answer_id(self) -> Option<u8> {
        match self {
            Request::PartNumber => Some(PART_NUMBER_ID),
            Request::SerialNumber => Some(SERIAL_NUMBER_ID),
            Request::Configuration => Some(CONFIGURATION_ID),
            Request::BiasTrim => Some(BIAS_TRIM_ID),
            Request::ExtendedError => Some(EXTENDED_ERROR_ID),
            _ => None,
        }
    }
}

/// The longest command, `SERVICEMODE`.
const MAX_LEN: usize = 11;

/// Gathers the reverse link's bytes into requests. Whether the bytes are passed on is up to the
/// caller.
#[derive(Debug, Clone, Copy, Default)]
pub struct Requests {
    line: [u8; MAX_LEN],
    /// Bytes since the last CR; beyond `MAX_LEN` the line cannot be a command any more.
    len: usize,
}

impl Requests {
    /// Receives one byte. A CR completes a request.
    pub fn push(&mut self, byte: u8) -> Option<Request> {
        if byte != b'\r' {
            // LF after CR is not in the datasheet but is what a terminal sends
            if !(byte == b'\n' && self.len == 0) {
                if let Some(place) = self.line.get_mut(self.len) {
                    *place = byte;
                }
                self.len = self.len.saturating_add(1);
            }
            return None;
        }
        let request = match self.line.get(..self.len) {
            Some(b"N") => Request::PartNumber,
            Some(b"I") => Request::SerialNumber,
            Some(b"C") => Request::Configuration,
            Some(b"T") => Request::BiasTrim,
            Some(b"E") => Request::ExtendedError,
            Some(b"R") => Request::Reset,
            Some(b"SERVICEMODE") => Request::ServiceMode,
            Some(b"UTILITYMODE") => Request::UtilityMode,
            _ => Request::Unknown,
        };
        self.len = 0;
        Some(request)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heapless::Vec;

    fn requests(bytes: &[u8]) -> Vec<Request, 8> {
        let mut line = Requests::default();
        bytes.iter().filter_map(|&byte| line.push(byte)).collect()
    }

    #[test]
    fn all_commands() {
        assert_eq!(
            requests(b"N\rI\rC\rT\rE\rR\rSERVICEMODE\rUTILITYMODE\r"),
            [
                Request::PartNumber,
                Request::SerialNumber,
                Request::Configuration,
                Request::BiasTrim,
                Request::ExtendedError,
                Request::Reset,
                Request::ServiceMode,
                Request::UtilityMode,
            ]
        );
    }

    #[test]
    fn only_complete_and_correct_ones() {
        assert_eq!(requests(b"C"), []);
        assert_eq!(
            requests(b"c\rCC\r\r\nC\rSERVICEMODEC\r"),
            [
                Request::Unknown,
                Request::Unknown,
                Request::Unknown,
                Request::Configuration,
                Request::Unknown
            ]
        );
        let mut long = Requests::default();
        for _ in 0..1000 {
            assert_eq!(long.push(b'C'), None);
        }
        assert_eq!(long.push(b'\r'), Some(Request::Unknown));
        assert_eq!(long.push(b'C'), None);
        assert_eq!(long.push(b'\r'), Some(Request::Configuration));
        assert_eq!(Request::Configuration.answer_id(), Some(0xBC));
    }
}
