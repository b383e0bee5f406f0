//! The host's end of the command link.

use super::port::Port;
use crate::error::Error;
use firmware::control::Mode;
use firmware::model::{IMAGES_LEN, Nets};
use firmware::wire::command::{
    Counters, Health, MAX_CHUNK, MAX_PACKET, Packets, Request, Response, Version, WIRE_VERSION,
    decode, encode,
};
use lrnn_nostd::image;
use std::time::{Duration, Instant};

/// How long an answer may take before the request is sent again.
const TIMEOUT: Duration = Duration::from_millis(500);
/// How often a request is sent.
const TRIES: u32 = 8;

/// A board at the other end of the command link.
#[derive(Debug)]
pub struct Link {
    port: Port,
    name: String,
    packets: Packets,
    /// Number of the last request.
    number: u8,
}

impl Link {
    /// Talks over an open port, which errors call `name`.
    #[must_use]
    pub fn new(port: Port, name: &str) -> Self {
        Self {
            port,
            name: name.to_owned(),
            packets: Packets::new(),
            number: 0,
        }
    }

    fn error(&self, problem: String, remedy: &str) -> Error {
        Error::Option {
            option: format!("--command {}", self.name),
            problem,
            remedy: remedy.into(),
        }
    }

    /// Sends a request until it is answered. `read` takes what is wanted from the answer, or
    /// returns `None` for an answer of another kind.
    ///
    /// # Errors
    /// The port is broken, there is no answer, or it is of another kind.
    pub fn ask<T>(
        &mut self,
        request: &Request,
        read: impl Fn(&Response) -> Option<T>,
    ) -> Result<T, Error> {
        self.number = self.number.wrapping_add(1);
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(self.number, request, &mut buffer)
            .map_err(|error| self.error(format!("{request:?}: {error:?}"), "report it"))?
            .to_vec();
        for _ in 0..TRIES {
            let sent = self.port.send(&packet, &|| false);
            sent.map_err(|error| self.error(error.to_string(), "check the cable"))?;
            let start = Instant::now();
            while start.elapsed() < TIMEOUT {
                if let Some(answer) = self.answer(&read)? {
                    return answer.map_err(|other| {
                        let remedy = "restart the board: after alignment it refuses many requests";
                        self.error(format!("{request:?} is answered {other}"), remedy)
                    });
                }
            }
        }
        let remedy = "check that it is the board's command line and its bit rate";
        Err(self.error(format!("no answer to {request:?}"), remedy))
    }

    /// The answer to the last request, if it has arrived: what `read` took from it, or the answer
    /// in words.
    fn answer<T>(
        &mut self,
        read: &impl Fn(&Response) -> Option<T>,
    ) -> Result<Option<Result<T, String>>, Error> {
        let mut buffer = [0; 256];
        let len = self.port.receive(&mut buffer);
        let len = len.map_err(|error| self.error(error.to_string(), "check the cable"))?;
        let mut answer = None;
        for &byte in buffer.get(..len).unwrap_or_default() {
            if let Some(packet) = self.packets.push(byte)
                && let Ok((number, response)) = decode::<Response>(packet)
                && number == self.number
            {
                answer = Some(read(&response).ok_or_else(|| format!("{response:?}")));
            }
        }
        Ok(answer)
    }

    /// Sends a request that is answered by [`Response::Done`].
    ///
    /// # Errors
    /// As [`Link::ask`], or the board refuses.
    pub fn order(&mut self, request: &Request) -> Result<(), Error> {
        self.ask(request, |answer| (*answer == Response::Done).then_some(()))
    }

    /// Version of the firmware. Its version of the link must be this program's.
    ///
    /// # Errors
    /// As [`Link::ask`], or the link has another version.
    pub fn version(&mut self) -> Result<Version, Error> {
        let version = self.ask(&Request::GetVersion, |answer| match answer {
            Response::Version(version) => Some(*version),
            _ => None,
        })?;
        if version.wire == WIRE_VERSION {
            return Ok(version);
        }
        let spoken = version.wire;
        let problem = format!("speaks version {spoken} of the link, not {WIRE_VERSION}");
        Err(self.error(
            problem,
            "flash the firmware of this program's version: cargo xtask flash",
        ))
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

    /// The weight images in use.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn images(&mut self) -> Result<Vec<u8>, Error> {
        let mut images = Vec::new();
        while images.len() < IMAGES_LEN {
            let request = Request::ReadImage {
                offset: images.len() as u32,
                length: MAX_CHUNK as u16,
            };
            let piece = self.ask(&request, |answer| match answer {
                Response::Image { bytes, .. } if !bytes.is_empty() => Some(bytes.to_vec()),
                _ => None,
            })?;
            images.extend(piece);
        }
        Ok(images)
    }

    /// Sends requests that are answered by [`Response::Done`].
    ///
    /// # Errors
    /// As [`Link::order`].
    pub fn orders(&mut self, requests: &[Request]) -> Result<(), Error> {
        requests.iter().try_for_each(|request| self.order(request))
    }
}

/// The image of both networks as the link carries it.
#[must_use]
pub fn images(nets: &Nets) -> Vec<u8> {
    [image::encode(&nets.gyro), image::encode(&nets.accel)].concat()
}

/// Requests that load weights and set a mode.
#[must_use]
pub fn set_up(images: &[u8], mode: Mode) -> Vec<Request<'_>> {
    let piece = |(index, bytes)| Request::WriteImage {
        offset: (index * MAX_CHUNK) as u32,
        bytes,
    };
    let mut requests: Vec<Request> = images.chunks(MAX_CHUNK).enumerate().map(piece).collect();
    let length = images.len() as u32;
    requests.extend([Request::CommitImage { length }, Request::SetMode(mode)]);
    requests
}
