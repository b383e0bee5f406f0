//! Requests that are sealed with the device's key.

use super::Link;
use firmware::control::Reason;
use firmware::wire::command::key::{Challenge, Direction, Secret};
use firmware::wire::command::seal::{Opened, Sealer, encode_sealed};
use firmware::wire::command::{MAX_PACKET, Provision, Request, Response};
use host_core::error::Error;
use std::time::Duration;

/// Largest number of sessions that are begun for one request.
const SESSIONS: u32 = 20;
/// Longest wait that the device may ask for; a longer one counts as a refusal.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// A session with the device.
#[derive(Debug, Clone, Copy)]
pub(super) struct Session {
    challenge: Challenge,
    /// Counter of the last request.
    counter: u32,
}

impl Link {
    /// As [`Link::request`], sealed. Begins a session if there is none.
    pub(super) fn request_sealed<T>(
        &mut self,
        secret: &Secret,
        request: &Request,
        read: impl Fn(&Response) -> Option<T>,
    ) -> Result<Result<T, Reason>, Error> {
        let mut refused = Reason::Session;
        for _ in 0..SESSIONS {
            let session = match self.begin()? {
                Ok(session) => session,
                Err(reason) => return Ok(Err(reason)),
            };
            match self.send_sealed(secret, session, request, &read)? {
                // these are not sealed, so anybody may have sent them: none is trusted at once
                Err(reason @ (Reason::Session | Reason::Counter | Reason::Key)) => {
                    self.session = None;
                    if refused == reason && reason == Reason::Key {
                        return Ok(Err(reason));
                    }
                    refused = reason;
                }
                Err(Reason::Wait(ms)) if Duration::from_millis(ms.into()) <= LONGEST_WAIT => {
                    self.session = None;
                    refused = Reason::Wait(ms);
                    std::thread::sleep(Duration::from_millis(ms.into()));
                }
                answer => return Ok(answer),
            }
        }
        Ok(Err(refused))
    }

    /// The session with the counter of the next request.
    fn begin(&mut self) -> Result<Result<Session, Reason>, Error> {
        let before = match self.session {
            Some(session) => session,
            None => {
                let challenge = self.request(&Request::GetChallenge, |answer| match answer {
                    Response::Challenge(challenge) => Some(*challenge),
                    _ => None,
                })?;
                match challenge {
                    Ok(challenge) => Session {
                        challenge,
                        counter: 0,
                    },
                    Err(reason) => return Ok(Err(reason)),
                }
            }
        };
        let session = Session {
            counter: before.counter + 1,
            ..before
        };
        self.session = Some(session);
        Ok(Ok(session))
    }

    fn send_sealed<T>(
        &mut self,
        secret: &Secret,
        session: Session,
        request: &Request,
        read: impl Fn(&Response) -> Option<T>,
    ) -> Result<Result<T, Reason>, Error> {
        let Session { challenge, counter } = session;
        let veiled = match request {
            Request::Provision(Provision::Secret(new)) => {
                let veiled = secret.veiled(&challenge, counter, new);
                Request::Provision(Provision::Secret(veiled))
            }
            other => *other,
        };
        self.number = self.number.wrapping_add(1);
        let mut buffer = [0; MAX_PACKET];
        let sealer = Sealer {
            secret,
            challenge: &challenge,
            counter,
            direction: Direction::Request,
        };
        let packet = encode_sealed(self.number, &veiled, &mut buffer, Some(&sealer))
            .map_err(|error| self.error(format!("{request:?}: {error:?}"), "report it"))?;
        let ours = |opened: &Opened<Response>| match &opened.seal {
            // only a refusal may be unsealed: of a request whose seal the device rejects
            None => matches!(opened.message, Response::Refused(_)),
            Some(seal) => {
                let (message, tag) = (opened.coded, &seal.tag);
                seal.counter == counter
                    && secret.verifies(Direction::Answer, &challenge, counter, message, tag)
            }
        };
        self.exchange(packet, request, &read, &ours)
    }
}
