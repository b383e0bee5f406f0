//! The way back: requests of the navigation computer to the sensor, and their answers.
//!
//! The bytes go to the sensor unchanged, whatever the format, and the sensor's answers go back with
//! the stream. Only requests to a STIM300 are also understood. A client may wait for the answer to
//! `C` before it starts, and a sensor whose receiving side is not wired never gives that answer.
//! The device then answers from the datagrams stored here; a request without a stored datagram is
//! not answered.

use super::config::Config;
use super::flow::{Flow, count};
use crate::link::Line;
use crate::wire::stim300::config::{
    self, CONFIGURATION_ID, PART_NUMBER_ID, SERIAL_NUMBER_ID, special_len,
};
use crate::wire::stim300::request::{Request, Requests};
use heapless::Vec;

/// A stored special datagram, without CR LF.
type Datagram = Vec<u8, { config::LEN }>;

/// Requests of the navigation computer on the way to a STIM300.
#[derive(Debug, Default)]
pub(super) struct Reverse {
    requests: Requests,
    /// The identifier of the expected answer, and until when the sensor may give it, microseconds.
    due: Option<(u8, u64)>,
    /// Part number and serial number, as the sensor sent them after its power-on.
    stored: [Datagram; 2],
    /// The sensor has sent its configuration.
    configured: bool,
    asked: bool,
}

/// A request that changes what the sensor sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Notice {
    /// From now on the sensor sends text instead of frames.
    Service,
}

impl Reverse {
    /// Reads bytes on their way to the sensor.
    pub fn watch(&mut self, bytes: &[u8], flow: &mut Flow, now: u64) -> Option<Notice> {
        let mut notice = None;
        for &byte in bytes {
            let Some(request) = self.requests.push(byte) else {
                continue;
            };
            count(&mut flow.counters.requests, 1);
            if let (Some(id), Some(wait)) =
                (request.answer_id(), flow.config.sensor.stim300.answer_us)
            {
                self.due = Some((id, now.saturating_add(u64::from(wait))));
            }
            match request {
                Request::ServiceMode | Request::UtilityMode => notice = Some(Notice::Service),
                Request::Reset => self.configured = false,
                _ => {}
            }
        }
        notice
    }

    /// Reads a special datagram of the sensor, which has been sent on.
    pub fn special(&mut self, bytes: &[u8], flow: &mut Flow) {
        let Some(id) = bytes.first().and_then(|&id| plain(id)) else {
            return;
        };
        if self.due.is_some_and(|(due, _)| due == id) {
            self.due = None;
        }
        match id {
            CONFIGURATION_ID => {
                if let Ok(config) = config::Config::parse(bytes) {
                    self.configured = true;
                    flow.configured(config);
                }
            }
            PART_NUMBER_ID | SERIAL_NUMBER_ID => {
                let [part, serial] = &mut self.stored;
                let place = if id == PART_NUMBER_ID { part } else { serial };
                place.clear();
                let _ = place.extend_from_slice(bytes); // 20 bytes always fit
            }
            _ => {}
        }
    }

    /// Answers in the sensor's place when its time is over.
    pub fn answer(&mut self, flow: &mut Flow, out: &mut impl Line, now: u64) {
        let Some((id, _)) = self.due.filter(|(_, until)| now >= *until) else {
            return;
        };
        let configuration = flow.config.sensor.stim300.config.emit();
        let [part, serial] = &self.stored;
        let datagram: &[u8] = match id {
            CONFIGURATION_ID => &configuration,
            PART_NUMBER_ID => part,
            SERIAL_NUMBER_ID => serial,
            _ => &[],
        };
        self.due = None;
        if datagram.is_empty() {
            return;
        }
        let mut message: Vec<u8, { config::LEN + 2 }> = Vec::new();
        let _ = message.extend_from_slice(datagram); // with CR LF it fits exactly
        if datagram.first() != Some(&id) {
            let _ = message.extend_from_slice(b"\r\n");
        }
        let sent = out.send(&message).is_ok();
        count(&mut flow.counters.answered, u32::from(sent));
        count(&mut flow.counters.dropped, u32::from(!sent));
    }

    /// Whether no answer is due and no question pending.
    #[inline(always)]
    pub fn rests(&self, config: &Config) -> bool {
        self.due.is_none() && !self.wants_to_ask(config)
    }

    #[inline(always)]
    fn wants_to_ask(&self, config: &Config) -> bool {
        config.sensor.stim300.ask && !self.configured && !self.asked
    }

    /// Asks for the configuration, once, before samples are corrected by it.
    pub fn ask(&mut self, config: &Config, sensor: &mut impl Line) {
        if self.wants_to_ask(config) {
            self.asked = sensor.send(b"C\r").is_ok();
        }
    }
}

/// The identifier of a special datagram in its form without CR LF.
fn plain(id: u8) -> Option<u8> {
    special_len(id)?;
    Some(match id {
        0xB3 | 0xB7 => id - 2,
        0xBD | 0xBF | 0xD2 => id - 1,
        _ => id,
    })
}
