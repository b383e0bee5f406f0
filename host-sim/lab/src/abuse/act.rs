//! The acts of a case.

use super::motion::Motion;
use super::times::{Span, Times};
use super::{configured, line, receiver, sensor};
use firmware::control::{Alignment, Mode};
use firmware::wire::command::Request;

/// One act of a case: a disturbance, or a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Act {
    /// The vehicle moves differently.
    Motion(Motion),
    /// The device's receiver has a fault.
    Receiver(receiver::Fault),
    /// The sensor has a fault.
    Sensor(sensor::Fault),
    /// The sensor's line has a fault.
    Line(line::Fault),
    /// The device's configuration is wrong.
    Configured(configured::Fault),
    /// The navigation computer sends requests.
    Asked(HostRequest),
}

/// Requests of the navigation computer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HostRequest {
    /// It reports an alignment that starts this long, s, after the start of the span and lasts 30
    /// s.
    Aligns(f64),
    /// It aligns itself during the standstill and reports this.
    AlignsAtRest,
    /// It sets mode learn again at this interval, s.
    LearnAgain(f64),
    /// It alternates between modes frozen and learn at this interval, s.
    Toggles(f64),
}

impl HostRequest {
    /// The requests and their times, microseconds after power-on.
    pub(super) fn requests(self, span: Span, times: &Times) -> Vec<(u64, Request<'static>)> {
        let [from, to] = span.seconds(times);
        let to = to.min(times.until().into());
        let at = |s: f64| (s * 1e6) as u64 + 333;
        let every = |step: f64| {
            let n = ((to - from) / step.max(1.0)) as u32;
            (0..n).map(move |k| from + f64::from(k) * step)
        };
        let mode = |mode| Request::SetMode(mode);
        match self {
            Self::Aligns(after) => vec![
                (at(from + after), Request::Alignment(Alignment::Started)),
                (
                    at(from + after + 30.0),
                    Request::Alignment(Alignment::Finished),
                ),
            ],
            Self::AlignsAtRest => vec![
                (at(0.5), Request::Alignment(Alignment::Started)),
                (
                    at(times.standstill_s.into()),
                    Request::Alignment(Alignment::Finished),
                ),
            ],
            Self::LearnAgain(step) => every(step).map(|s| (at(s), mode(Mode::Learn))).collect(),
            Self::Toggles(step) => {
                let modes = [Mode::Frozen, Mode::Learn].into_iter().cycle();
                every(step)
                    .zip(modes)
                    .map(|(s, which)| (at(s), mode(which)))
                    .collect()
            }
        }
    }
}
