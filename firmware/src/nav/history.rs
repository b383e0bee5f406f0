//! History of the navigator over the last second: its position, motion and attitude when a fix was
//! valid that arrives now.
//!
//! The pieces are added up to links of 40 ms or more. Within a link the acceleration over ground
//! and the rate count as constant, and beyond the oldest link they go on as they were there.

use super::vector::{Q, V32, add, from_rotvec, matrix32, product, scale, widen};

/// A link that is this long is complete, s.
const LINK_S: f32 = 0.04;
/// Number of links: 1.25 s at least.
const LINKS: usize = 32;

/// Changes over a link.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Link {
    /// Velocity over ground, north, east, down, m/s.
    velocity: V32,
    /// Rotation vector in body axes, rad.
    turn: V32,
    /// Duration, s.
    time: f32,
}

impl Link {
    const EMPTY: Link = Link {
        velocity: [0.0; 3],
        turn: [0.0; 3],
        time: 0.0,
    };
}

/// The links, as a ring.
#[derive(Debug, Clone)]
pub struct History {
    links: [Link; LINKS],
    /// Index of the newest one.
    newest: usize,
}

/// An earlier state, as differences from that at the end of the last piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PastState {
    /// Position then minus position now, north, east, down, m.
    pub position: V32,
    /// Velocity then minus velocity now, m/s.
    pub velocity: V32,
    /// Rotation vector from the attitude now to that then, body axes, rad. It is the sum of the
    /// links' vectors: the order of small rotations about different axes is left out.
    pub turn: V32,
    /// Rate then, body axes, rad/s.
    pub rate: V32,
}

impl History {
    pub const fn new() -> History {
        History {
            links: [Link::EMPTY; LINKS],
            newest: 0,
        }
    }

    /// A piece over which velocity and attitude have changed by this.
    pub fn piece(&mut self, velocity: V32, turn: V32, time: f32) {
        let complete = |link: &Link| link.time >= LINK_S;
        if self.links.get(self.newest).is_some_and(complete) {
            self.newest = (self.newest + 1) % LINKS;
            if let Some(link) = self.links.get_mut(self.newest) {
                *link = Link::EMPTY;
            }
        }
        if let Some(link) = self.links.get_mut(self.newest) {
            link.velocity = add(link.velocity, velocity);
            // within 40 ms the order of the rotations does not matter
            link.turn = add(link.turn, turn);
            link.time += time;
        }
    }

    /// The state `age` seconds before the end of the last piece, where the velocity is `now`. After
    /// that end (a negative age) the newest link goes on.
    pub fn before(&self, age: f32, now: V32) -> PastState {
        let mut then = PastState {
            position: [0.0; 3],
            velocity: [0.0; 3],
            turn: [0.0; 3],
            rate: [0.0; 3],
        };
        let mut left = age;
        for back in 0..LINKS {
            let at = (self.newest + LINKS - back) % LINKS;
            let older = (self.newest + LINKS - back - 1) % LINKS;
            let Some(link) = self.links.get(at).filter(|link| link.time > 0.0) else {
                break;
            };
            // the oldest one goes on
            let oldest = back + 1 == LINKS || self.links.get(older).is_none_or(|l| l.time <= 0.0);
            let time = if oldest { left } else { link.time.min(left) };
            let share = time / link.time;
            let change = scale(link.velocity, -share);
            let velocity = add(now, then.velocity);
            let mean = add(velocity, scale(change, 0.5));
            then.position = add(then.position, scale(mean, -time));
            then.velocity = add(then.velocity, change);
            then.turn = add(then.turn, scale(link.turn, -share));
            then.rate = scale(link.turn, 1.0 / link.time);
            left -= time;
            if left <= 0.0 {
                break;
            }
        }
        then
    }
}

impl PastState {
    /// Body axes then to north, east, down; `q_bn` is the attitude now.
    pub fn matrix(&self, q_bn: Q) -> [V32; 3] {
        let q = product(q_bn, from_rotvec(widen(self.turn)));
        matrix32(q.map(|x| x as f32))
    }
}
