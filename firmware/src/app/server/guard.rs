//! Authorisation: sessions of sealed requests.
//!
//! The device gives a challenge, a number that is never repeated. The host seals each request with
//! the key, the challenge and a counter. The first sealed request begins the session and ends the
//! one before. Nothing of it is stored, so a session ends with the power at the latest.
//!
//! **Replay.** Only the next counter is taken. The last request may come again, byte for byte,
//! because its answer was lost: it gets the same answer, byte for byte, and has no further effect.
//! All others are refused.
//!
//! **Flood.** What cannot be from the right user costs next to nothing. A packet of no session, or
//! with a wrong counter, is refused by comparing numbers. So is one with a wrong door, a word that
//! is computed beforehand and that only who has the key can foretell. Only somebody who changes the
//! right user's packets on their way, or hears one that never arrived, knows a door that is still
//! good. Then a code is computed, and that is limited ([`TRIES`]) within each session: a new one
//! begins with all tries, and its door nobody has heard. So a flood without the key neither takes
//! time from the stream nor keeps the right user out. Asking for challenges does not end a session
//! either.

use super::bucket::Bucket;
use crate::control::Reason;
use crate::wire::command::key::{Challenge, Direction, Key, Secret};
use crate::wire::command::seal::{Seal, Sealer, encode_sealed};
use crate::wire::command::{MAX_PACKET, Protection, Provision, Response};

/// Wrong codes behind a right door that are accepted in a row.
pub(super) const TRIES: u16 = 8;
/// After each of these times one more wrong code is accepted, microseconds.
const TRY_US: u64 = 250_000;
/// Lifetime of an unused challenge, microseconds. Later it is replaced: requests that an attacker
/// had the right host seal are of no use then.
const OFFER_US: u64 = 10_000_000;
/// A session in which nothing comes for so long is over, microseconds.
const IDLE_US: u64 = 60_000_000;

/// A challenge that was given and not used.
#[derive(Debug)]
struct Offer {
    challenge: Challenge,
    door: [u8; 4],
    at_us: u64,
    tries: Bucket,
}

#[derive(Debug)]
struct Session {
    challenge: Challenge,
    /// Counter and code of the last request.
    counter: u32,
    tag: [u8; 16],
    /// Door of the next request; `None`: the session is over, and only the last answer is given
    /// again.
    door: Option<[u8; 4]>,
    used_us: u64,
    tries: Bucket,
}

impl Session {
    /// Whether a seal is that of the last request.
    fn is_last(&self, seal: &Seal) -> bool {
        seal.counter == self.counter && seal.tag == self.tag
    }
}

/// Data that seals the answer to a request.
#[derive(Debug, Clone, Copy)]
pub(in crate::app) struct Ticket {
    secret: Secret,
    challenge: Challenge,
    counter: u32,
}

/// Kind of a packet that is carried out.
#[derive(Debug)]
pub(in crate::app) enum Verdict {
    /// Not sealed, and need not be.
    Plain,
    /// A new request of the right user.
    Fresh(Ticket),
    /// The last one again: [`Guard::answer`] is its answer.
    Again,
}

/// The key and the session.
#[derive(Debug)]
pub(in crate::app) struct Guard {
    pub key: Key,
    /// Random bytes of the board.
    random: Option<[u8; 32]>,
    /// Challenges made.
    made: u32,
    offer: Option<Offer>,
    session: Option<Session>,
    /// Requests refused because of door or code.
    pub forged: u32,
    answer: [u8; MAX_PACKET],
    answer_len: usize,
}

impl Guard {
    pub const fn new(key: Key) -> Guard {
        Guard {
            key,
            random: None,
            made: 0,
            offer: None,
            session: None,
            forged: 0,
            answer: [0; MAX_PACKET],
            answer_len: 0,
        }
    }

    /// Random bytes of the board, for the challenges.
    pub fn seed(&mut self, random: [u8; 32]) {
        self.random = Some(random);
        self.offer = None;
    }

    pub fn is_random(&self) -> bool {
        self.random.is_some()
    }

    pub fn needs_key(&self) -> bool {
        matches!(self.key, Key::Secret(_))
    }

    pub fn protection(&self) -> Protection {
        Protection::from(&self.key)
    }

    /// The challenge of the next session.
    ///
    /// # Errors
    /// [`Reason::NoKey`]
    pub fn challenge(&mut self, now_us: u64) -> Result<Challenge, Reason> {
        let Key::Secret(secret) = self.key else {
            return Err(Reason::NoKey);
        };
        if let Some(offer) = &self.offer
            && is_young(offer.at_us, now_us, OFFER_US)
        {
            return Ok(offer.challenge);
        }
        let random = self.random.unwrap_or_default();
        self.made = self.made.wrapping_add(1);
        let challenge = secret.challenge(&random, self.made, now_us);
        self.offer = Some(Offer {
            challenge,
            door: secret.door(&challenge, 1),
            at_us: now_us,
            tries: Bucket::new(TRIES, TRY_US),
        });
        Ok(challenge)
    }

    /// Whether a sealed packet is to be carried out. `coded`: number and message as encoded.
    ///
    /// # Errors
    /// Why not. Nothing has changed then but [`Guard::forged`] and the tries left.
    pub fn check(&mut self, coded: &[u8], seal: &Seal, now_us: u64) -> Result<Verdict, Reason> {
        let session = self.session.as_mut().filter(|session| {
            session.challenge.session() == seal.session
                && is_young(session.used_us, now_us, IDLE_US)
        });
        // the code was on the line already, so that comparing it reveals nothing
        if session.as_ref().is_some_and(|s| s.is_last(seal)) {
            return Ok(Verdict::Again);
        }
        let Key::Secret(secret) = self.key else {
            return Err(Reason::NoKey);
        };
        let offer = self.offer.as_mut().filter(|offer| {
            offer.challenge.session() == seal.session && is_young(offer.at_us, now_us, OFFER_US)
        });
        let (challenge, door, before, tries) = match (session, offer) {
            (Some(session), _) => {
                let door = session.door.ok_or(Reason::Session)?;
                (session.challenge, door, session.counter, &mut session.tries)
            }
            (None, Some(offer)) => (offer.challenge, offer.door, 0, &mut offer.tries),
            (None, None) => return Err(Reason::Session),
        };
        // the counter never comes round within a session
        if before.checked_add(1) != Some(seal.counter) {
            return Err(Reason::Counter);
        }
        if u32::from_le_bytes(door) != u32::from_le_bytes(seal.door) {
            return Err(self.forgery());
        }
        tries.take(now_us).map_err(Reason::Wait)?;
        let (counter, tag) = (seal.counter, &seal.tag);
        if !secret.verifies(Direction::Request, &challenge, counter, coded, tag) {
            return Err(self.forgery());
        }
        if before == 0 {
            self.offer = None;
        }
        self.session = Some(Session {
            challenge,
            counter,
            tag: seal.tag,
            door: Some(secret.door(&challenge, counter.wrapping_add(1))),
            used_us: now_us,
            tries: Bucket::new(TRIES, TRY_US),
        });
        self.answer_len = 0;
        Ok(Verdict::Fresh(Ticket {
            secret,
            challenge,
            counter,
        }))
    }

    fn forgery(&mut self) -> Reason {
        self.forged = self.forged.saturating_add(1);
        Reason::Key
    }

    /// Seals the answer to a request. [`Guard::answer`] gives it, also when it is asked again.
    pub fn seal(&mut self, ticket: &Ticket, number: u8, response: &Response) {
        let sealer = Sealer {
            secret: &ticket.secret,
            challenge: &ticket.challenge,
            counter: ticket.counter,
            direction: Direction::Answer,
        };
        let sealed = encode_sealed(number, response, &mut self.answer, Some(&sealer));
        self.answer_len = sealed.map_or(0, |packet| packet.len());
    }

    /// The answer to the last sealed request.
    pub fn answer(&self) -> &[u8] {
        self.answer.get(..self.answer_len).unwrap_or_default()
    }

    /// Takes another key. The session ends, but for its last answer. `ticket`: of the request that
    /// brings it, if it is sealed.
    ///
    /// # Errors
    /// [`Reason::Range`] for a secret whose bytes are all the same.
    pub fn provision(&mut self, with: &Provision, ticket: Option<&Ticket>) -> Result<(), Reason> {
        self.key = match with {
            Provision::OpenByChoice => Key::OpenByChoice,
            Provision::Secret(secret) => {
                let secret = match ticket {
                    Some(t) => t.secret.veiled(&t.challenge, t.counter, secret),
                    None => *secret,
                };
                let [first, rest @ ..] = &secret.0;
                if rest.iter().all(|byte| byte == first) {
                    return Err(Reason::Range);
                }
                Key::Secret(secret)
            }
        };
        self.offer = None;
        if let Some(session) = &mut self.session {
            session.door = None;
        }
        Ok(())
    }
}

/// Whether no more than `most` microseconds have passed.
fn is_young(since_us: u64, now_us: u64, most: u64) -> bool {
    now_us.saturating_sub(since_us) <= most
}
