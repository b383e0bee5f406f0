//! The way back: requests of the navigation computer to the sensor, and their answers.
//!
//! The bytes go to the sensor unchanged, whatever the format, and the sensor's answers go back with
//! the stream. Only requests to a STIM300 are also understood. A client may wait for the answer to
//! `C` before it starts, and a sensor whose receiving side is not wired never gives that answer.
//! The device then answers from what the sensor itself has said since its last start. A request for
//! anything else is not answered.

use super::counts::Count;
use super::flow::{Flow, Units};
use crate::link::Line;
use crate::wire::stim300::config::{
    self, BIAS_TRIM_ID, CONFIGURATION_ID, EXTENDED_ERROR_ID, PART_NUMBER_ID, SERIAL_NUMBER_ID,
    special_len,
};
use crate::wire::stim300::request::{Request, Requests};
use heapless::Vec;

/// A stored special datagram, without CR LF.
type Datagram = Vec<u8, { config::LEN }>;

/// A datagram that comes within this time after it was asked for is the answer, microseconds. One
/// that comes by itself shows a start of the sensor.
const ANSWER_US: u64 = 1_000_000;

/// The sensor is asked again for its configuration after this time, microseconds.
const AGAIN_US: u64 = 1_000_000;

/// One kind of datagram that can be asked for.
#[derive(Debug, Clone, Copy)]
struct Question {
    /// Identifier of the request.
    id: u8,
    /// Time at which the device answers from stored datagrams, microseconds.
    due_us: Option<u64>,
    /// Until when the sensor's datagram counts as an answer, microseconds.
    expected_us: u64,
}

/// Requests of the navigation computer on the way to a STIM300.
#[derive(Debug)]
pub(super) struct Reverse {
    requests: Requests,
    questions: [Question; 5],
    /// An answer is due.
    is_due: bool,
    /// Part number and serial number, as the sensor sent them, and the number of its start then.
    stored: [(Datagram, Count); 2],
    /// Time of the device's last request, microseconds.
    asked_us: Option<u64>,
}

impl Default for Reverse {
    fn default() -> Reverse {
        let question = |id| Question {
            id,
            due_us: None,
            expected_us: 0,
        };
        Reverse {
            requests: Requests::default(),
            questions: [
                PART_NUMBER_ID,
                SERIAL_NUMBER_ID,
                CONFIGURATION_ID,
                BIAS_TRIM_ID,
                EXTENDED_ERROR_ID,
            ]
            .map(question),
            is_due: false,
            stored: Default::default(),
            asked_us: None,
        }
    }
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
            flow.health.counters.requests.add(1);
            if let Some(question) = self.question(request.answer_id()) {
                let wait = flow.config.sensor.stim300.answer_us;
                question.due_us = wait.map(|wait| now.saturating_add(wait.into()));
                question.expected_us = now.saturating_add(ANSWER_US);
                self.is_due |= wait.is_some();
            }
            match request {
                Request::ServiceMode | Request::UtilityMode => {
                    notice = Some(Notice::Service);
                    if flow.corrector.in_force() {
                        continue; // until the sensor obeys
                    }
                }
                Request::Reset => {}
                _ => continue,
            }
            self.changes(flow);
        }
        notice
    }

    /// The sensor's settings may now change, and it may restart.
    pub fn changes(&mut self, flow: &mut Flow) {
        flow.forget_units();
        self.forget();
    }

    /// Stored datagrams of the sensor are no longer answered, and nothing is due.
    fn forget(&mut self) {
        for (datagram, _) in &mut self.stored {
            datagram.clear();
        }
        for question in &mut self.questions {
            question.expected_us = 0;
        }
        self.asked_us = None;
        self.give_up();
    }

    /// No answer is due any more.
    pub fn give_up(&mut self) {
        for question in &mut self.questions {
            question.due_us = None;
        }
        self.is_due = false;
    }

    fn question(&mut self, id: Option<u8>) -> Option<&mut Question> {
        self.questions
            .iter_mut()
            .find(|question| Some(question.id) == id)
    }

    /// Reads a special datagram of the sensor, which has been sent on.
    pub fn special(&mut self, bytes: &[u8], flow: &mut Flow, now: u64) {
        let Some(id) = bytes.first().and_then(|&id| plain(id)) else {
            return;
        };
        if let Some(question) = self.question(Some(id)) {
            question.due_us = None;
            let asked = question.expected_us >= now && question.expected_us > 0;
            // part number, serial number and bias trim come by themselves at a start only
            if !asked && !matches!(id, CONFIGURATION_ID | EXTENDED_ERROR_ID) {
                flow.restarted();
            }
        }
        match id {
            CONFIGURATION_ID => {
                if let Ok(config) = config::Config::parse(bytes) {
                    flow.configured(config);
                }
            }
            PART_NUMBER_ID | SERIAL_NUMBER_ID => {
                let [part, serial] = &mut self.stored;
                let place = if id == PART_NUMBER_ID { part } else { serial };
                place.0.clear();
                let _ = place.0.extend_from_slice(bytes); // 20 bytes always fit
                place.1 = flow.health.counters.restarts;
            }
            _ => {}
        }
    }

    /// Answers in the sensor's place when its time is over, from what the sensor itself has said
    /// since its last start.
    pub fn answer(&mut self, flow: &mut Flow, out: &mut impl Line, now: u64) {
        let due = |question: &Question| question.due_us.is_some_and(|due| now >= due);
        let Some(question) = self.questions.iter_mut().find(|question| due(question)) else {
            self.is_due = self.questions.iter().any(|q| q.due_us.is_some());
            return;
        };
        question.due_us = None;
        let id = question.id;
        let configuration = flow.config.sensor.stim300.config.emit();
        let [part, serial] = &self.stored;
        let said = |stored: &(Datagram, Count)| stored.1 == flow.health.counters.restarts;
        let datagram: &[u8] = match id {
            CONFIGURATION_ID if flow.continuity.units == Units::Reported => &configuration,
            PART_NUMBER_ID if said(part) => &part.0,
            SERIAL_NUMBER_ID if said(serial) => &serial.0,
            _ => &[],
        };
        if datagram.is_empty() {
            return;
        }
        let mut message: Vec<u8, { config::LEN + 2 }> = Vec::new();
        let _ = message.extend_from_slice(datagram); // with CR LF it fits exactly
        if datagram.first() != Some(&id) {
            let _ = message.extend_from_slice(b"\r\n");
        }
        let sent = out.send(&message).is_ok();
        flow.health.counters.answered.add(u32::from(sent));
        flow.health.counters.dropped.add(u32::from(!sent));
    }

    /// Whether no answer is due and no question pending.
    #[inline(always)]
    pub fn rests(&self, flow: &Flow) -> bool {
        !self.is_due && !self.wants_to_ask(flow)
    }

    #[inline(always)]
    fn wants_to_ask(&self, flow: &Flow) -> bool {
        flow.config.sensor.stim300.ask
            && match flow.continuity.units {
                Units::AsConfigured => self.asked_us.is_none(),
                Units::Unknown => true,
                Units::Reported => false,
            }
    }

    /// Asks for the configuration before samples are corrected by it: once while it is believed to
    /// be as configured, else again and again.
    pub fn ask(&mut self, flow: &Flow, sensor: &mut impl Line, now: u64) {
        let again = |asked: u64| now.saturating_sub(asked) >= AGAIN_US;
        if !self.wants_to_ask(flow) || !self.asked_us.is_none_or(again) {
            return;
        }
        if sensor.send(b"C\r").is_ok() {
            self.asked_us = Some(now);
            if let Some(question) = self.question(Some(CONFIGURATION_ID)) {
                question.expected_us = now.saturating_add(ANSWER_US);
            }
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
