//! The host's end of the command link.

mod sealed;

use super::port::Port;
use super::refusal;
use firmware::control::{Mode, Reason};
use firmware::model::{IMAGES_LEN, NETS_LEN, Nets};
use firmware::wire::command::key::Secret;
use firmware::wire::command::seal::{Opened, open};
use firmware::wire::command::{
    Antenna, Counters, Estimate, Health, MAX_CHUNK, MAX_PACKET, Packets, Remembered, Request,
    Response, Security, StoreReport, Version, WIRE_VERSION, encode,
};
use host_core::error::Error;
use std::time::{Duration, Instant};

/// Timeout of an answer, after which the request is repeated.
const TIMEOUT: Duration = Duration::from_millis(500);
/// Time until a request to a busy device is repeated, and how long it is. A device is busy while it
/// stores by command: an STM32F405 halts for 4 s when it stores another key.
const BUSY: Duration = Duration::from_millis(20);
const PATIENCE: Duration = Duration::from_secs(20);
/// Number of times that a request is sent.
const TRIES: u32 = 8;

/// A device at the other end of the command link.
#[derive(Debug)]
pub struct Link {
    port: Port,
    name: String,
    packets: Packets,
    /// Number of the last request.
    number: u8,
    tries: u32,
    /// Key that seals the requests that change something.
    key: Option<Secret>,
    session: Option<sealed::Session>,
}

impl Link {
    /// A link over an open port. Errors name it `name`, for example `--port /dev/ttyUSB0`.
    #[must_use]
    pub fn new(port: Port, name: impl Into<String>) -> Self {
        Self {
            port,
            name: name.into(),
            packets: Packets::new(),
            number: 0,
            tries: TRIES,
            key: None,
            session: None,
        }
    }

    /// Opens the port that was given by `option`. Sockets ignore `baud`.
    ///
    /// # Errors
    /// As [`Port::open`].
    pub fn open(option: &str, name: &str, baud: u32) -> Result<Self, Error> {
        let port = Port::open(option, name, baud)?;
        Ok(Self::new(port, format!("{option} {name}")))
    }

    /// Sends each request at most `tries` times, half a second apart. 8 by default.
    #[must_use]
    pub fn with_tries(mut self, tries: u32) -> Self {
        self.tries = tries;
        self
    }

    /// As [`Link::with_tries`].
    pub fn set_tries(&mut self, tries: u32) {
        self.tries = tries;
    }

    /// Seals each request that changes something with this key.
    #[must_use]
    pub fn with_key(mut self, key: Option<Secret>) -> Self {
        self.set_key(key);
        self
    }

    /// Replaces the key; `None`: requests are not sealed.
    pub fn set_key(&mut self, key: Option<Secret>) {
        (self.key, self.session) = (key, None);
    }

    /// An error at this link.
    pub fn error(&self, problem: impl Into<String>, remedy: &str) -> Error {
        Error::Option {
            option: self.name.clone(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// Sends a request until it is answered. `read` takes what is wanted from the answer, or
    /// returns `None` for an answer of another kind. The inner result is the device's refusal.
    ///
    /// # Errors
    /// The port is broken, there is no answer, or it is of another kind.
    pub fn request<T>(
        &mut self,
        request: &Request,
        read: impl Fn(&Response) -> Option<T>,
    ) -> Result<Result<T, Reason>, Error> {
        let begun = Instant::now();
        loop {
            let answer = self.request_once(request, &read)?;
            if !matches!(answer, Err(Reason::Busy)) || begun.elapsed() > PATIENCE {
                return Ok(answer);
            }
            std::thread::sleep(BUSY);
        }
    }

    /// As [`Link::request`], repeated only when there is no answer.
    fn request_once<T>(
        &mut self,
        request: &Request,
        read: &impl Fn(&Response) -> Option<T>,
    ) -> Result<Result<T, Reason>, Error> {
        if let Some(key) = self.key.filter(|_| request.changes()) {
            return self.request_sealed(&key, request, read);
        }
        self.number = self.number.wrapping_add(1);
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(self.number, request, &mut buffer)
            .map_err(|error| self.error(format!("{request:?}: {error:?}"), "report it"))?;
        self.exchange(packet, request, read, &|opened| opened.seal.is_none())
    }

    /// Sends a packet until it is answered. `ours`: whether a packet with its number is its answer.
    fn exchange<T>(
        &mut self,
        packet: &[u8],
        request: &Request,
        read: &impl Fn(&Response) -> Option<T>,
        ours: &impl Fn(&Opened<Response>) -> bool,
    ) -> Result<Result<T, Reason>, Error> {
        // the zero in front separates the packet from noise on the line
        let packet = [&[0], packet].concat();
        let mut came = 0;
        for _ in 0..self.tries {
            let sent = self.port.send(&packet, &|| false);
            sent.map_err(|error| self.broken(&error))?;
            let start = Instant::now();
            while start.elapsed() < TIMEOUT {
                if let Some(answer) = self.answer(read, ours, &mut came)? {
                    return answer.map_err(|other| {
                        let remedy = "use the host-sim of the device's version";
                        self.error(format!("{request:?} is answered {other}"), remedy)
                    });
                }
            }
        }
        Err(self.no_answer(request, came))
    }

    fn broken(&self, error: &std::io::Error) -> Error {
        let remedy = "check the cable and that the device has power";
        self.error(format!("the line broke ({error})"), remedy)
    }

    fn no_answer(&self, request: &Request, came: usize) -> Error {
        let received = match came {
            0 => "nothing comes".to_owned(),
            _ => format!("{came} bytes came that are not an answer"),
        };
        let remedy = "check that it is the device's command link and its bit rate (--baud), and \
                      that the device runs";
        self.error(format!("no answer to {request:?}, {received}"), remedy)
    }

    /// The answer to the last request, if it has arrived: what `read` took from it, a refusal, or
    /// the answer in words. Adds the bytes that arrived to `came`.
    #[allow(clippy::type_complexity, reason = "one private function")]
    fn answer<T>(
        &mut self,
        read: &impl Fn(&Response) -> Option<T>,
        ours: &impl Fn(&Opened<Response>) -> bool,
        came: &mut usize,
    ) -> Result<Option<Result<Result<T, Reason>, String>>, Error> {
        let mut buffer = [0; 256];
        let len = self.port.receive(&mut buffer);
        let len = len.map_err(|error| self.broken(&error))?;
        *came += len;
        let mut answer = None;
        for &byte in buffer.get(..len).unwrap_or_default() {
            if let Some(packet) = self.packets.push(byte)
                && let Ok(opened) = open::<Response>(packet)
                && opened.number == self.number
                && ours(&opened)
            {
                answer = Some(match opened.message {
                    Response::Refused(reason) => Ok(Err(reason)),
                    other => read(&other).map(Ok).ok_or_else(|| format!("{other:?}")),
                });
            }
        }
        Ok(answer)
    }

    /// As [`Link::request`]; a refusal is an error too, in words.
    ///
    /// # Errors
    /// As [`Link::request`], or the device refuses.
    pub fn ask<T>(
        &mut self,
        request: &Request,
        read: impl Fn(&Response) -> Option<T>,
    ) -> Result<T, Error> {
        self.request(request, read)?
            .map_err(|reason| self.refused(request, reason))
    }

    /// A refusal in words.
    #[must_use]
    pub fn refused(&self, request: &Request, reason: Reason) -> Error {
        let (problem, remedy) = refusal::explain(request, reason);
        self.error(problem, &remedy)
    }

    /// Sends a request that is answered by [`Response::Done`].
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn order(&mut self, request: &Request) -> Result<(), Error> {
        self.ask(request, done)
    }

    /// As [`Link::order`], with the refusal for the caller to judge.
    ///
    /// # Errors
    /// As [`Link::request`].
    pub fn try_order(&mut self, request: &Request) -> Result<Result<(), Reason>, Error> {
        self.request(request, done)
    }

    /// Sends requests that are answered by [`Response::Done`].
    ///
    /// # Errors
    /// As [`Link::order`].
    pub fn orders(&mut self, requests: &[Request]) -> Result<(), Error> {
        requests.iter().try_for_each(|request| self.order(request))
    }

    /// Versions of the device. Its version of the link must be this program's.
    ///
    /// # Errors
    /// As [`Link::ask`], or the link has another version.
    pub fn version(&mut self) -> Result<Version, Error> {
        let version = self.ask(&Request::GetVersion, |answer| match answer {
            Response::Version(version) => Some(*version),
            _ => None,
        })?;
        let spoken = version.wire;
        let remedy = match spoken.cmp(&WIRE_VERSION) {
            std::cmp::Ordering::Equal => return Ok(version),
            std::cmp::Ordering::Less => {
                "flash the firmware of this program's version: cargo xtask flash"
            }
            std::cmp::Ordering::Greater => "use the host-sim of the device's version",
        };
        let [major, minor, patch] = version.firmware;
        let problem = format!(
            "the device has firmware {major}.{minor}.{patch}, which speaks version {spoken} of \
             the command link, not {WIRE_VERSION}"
        );
        Err(self.error(problem, remedy))
    }

    /// Health.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn health(&mut self) -> Result<Health, Error> {
        self.ask(&Request::GetHealth, |answer| match answer {
            Response::Health(health) => Some(*health),
            _ => None,
        })
    }

    /// Correction in force, and what was learnt from references.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn estimate(&mut self) -> Result<Estimate, Error> {
        self.ask(&Request::GetEstimate, |answer| match answer {
            Response::Estimate(estimate) => Some(*estimate),
            _ => None,
        })
    }

    /// Lever arm and delay of the receiver's fixes; `None` from a board without a learner.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn antenna(&mut self) -> Result<Option<Antenna>, Error> {
        let request = Request::GetAntenna;
        let answer = self.request(&request, |answer| match answer {
            Response::Antenna(antenna) => Some(*antenna),
            _ => None,
        })?;
        match answer {
            Err(Reason::NotAvailable) => Ok(None),
            // a device without a configuration reports no antenna
            Ok(antenna) if !antenna.fix_delay_sigma.is_finite() => Ok(None),
            other => other
                .map(Some)
                .map_err(|reason| self.refused(&request, reason)),
        }
    }

    /// The device's memory of its unit.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn remembered(&mut self) -> Result<Remembered, Error> {
        self.ask(&Request::GetMemory, |answer| match answer {
            Response::Remembered(remembered) => Some(*remembered),
            _ => None,
        })
    }

    /// State of the device's store at the start.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn store_report(&mut self) -> Result<StoreReport, Error> {
        self.ask(&Request::GetStore, |answer| match answer {
            Response::Kept(store_report) => Some(*store_report),
            _ => None,
        })
    }

    /// Whether the device needs a key.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn security(&mut self) -> Result<Security, Error> {
        self.ask(&Request::GetSecurity, |answer| match answer {
            Response::Security(security) => Some(*security),
            _ => None,
        })
    }

    /// Counters.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn counters(&mut self) -> Result<Counters, Error> {
        self.ask(&Request::GetCounters, |answer| match answer {
            Response::Counters(counters) => Some(*counters),
            _ => None,
        })
    }

    /// The weight image in use.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn images(&mut self) -> Result<Vec<u8>, Error> {
        let images = self.read(IMAGES_LEN, |offset, length| Request::ReadImage {
            offset,
            length,
        })?;
        if [IMAGES_LEN, NETS_LEN].contains(&images.len()) {
            return Ok(images);
        }
        let problem = format!("a weight image of {} bytes came", images.len());
        Err(self.error(problem, "use the host-sim of the device's version"))
    }

    /// The weight image that was learnt. It changes while samples arrive.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn learnt_images(&mut self) -> Result<Vec<u8>, Error> {
        self.read(IMAGES_LEN, |offset, length| Request::ReadLearnt {
            offset,
            length,
        })
    }

    /// Reads pieces until one is shorter than its maximum, `most` bytes in total at most.
    pub(super) fn read(
        &mut self,
        most: usize,
        request: impl Fn(u32, u16) -> Request<'static>,
    ) -> Result<Vec<u8>, Error> {
        let mut all = Vec::new();
        while all.len() < most {
            let request = request(all.len() as u32, MAX_CHUNK as u16);
            let piece = self.ask(&request, |answer| match answer {
                Response::Image { bytes, .. } => Some(bytes.to_vec()),
                _ => None,
            })?;
            all.extend_from_slice(&piece);
            if piece.len() < MAX_CHUNK {
                break;
            }
        }
        Ok(all)
    }
}

fn done(answer: &Response) -> Option<()> {
    (*answer == Response::Done).then_some(())
}

/// The image of networks and maps as the link carries it.
#[must_use]
pub fn images(nets: &Nets) -> Vec<u8> {
    let mut bytes = vec![0; IMAGES_LEN];
    nets.write_images(0, &mut bytes);
    bytes
}

/// Requests that load weights.
#[must_use]
pub fn load(images: &[u8]) -> Vec<Request<'_>> {
    let piece = |(index, bytes)| Request::WriteImage {
        offset: (index * MAX_CHUNK) as u32,
        bytes,
    };
    let mut requests: Vec<Request> = images.chunks(MAX_CHUNK).enumerate().map(piece).collect();
    let length = images.len() as u32;
    requests.push(Request::CommitImage { length });
    requests
}

/// Requests that load weights and set a mode.
#[must_use]
pub fn set_up(images: &[u8], mode: Mode) -> Vec<Request<'_>> {
    let mut requests = load(images);
    requests.push(Request::SetMode(mode));
    requests
}
