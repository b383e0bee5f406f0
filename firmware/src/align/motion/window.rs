//! The last minute of the drive: what the sensors gained from fix to fix, and the fixes.

use crate::nav::gather::Piece;
use crate::nav::vector::{Q, V, V32, add, from_rotvec, narrow, product, rotated, scale};

/// Intervals between fixes that are kept.
pub const NODES: usize = 40;
/// Pieces that wait for a fix: 1.2 s.
const PIECES: usize = 24;
/// The shortest interval between two fixes that are used, s.
const LEAST_S: f32 = 0.3;

/// Fixes after which a standstill is believed.
const LATE: usize = 2;

/// An interval between two fixes, and the fix at its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Rotation vector, rad, in the sensor's axes at its beginning, as are the next two.
    pub turn: V32,
    /// Velocity by the specific force, m/s.
    pub gain: V32,
    /// The way by it, m.
    pub way: V32,
    /// Length, s.
    pub time: f32,
    /// The fix, north, east, down from the origin, m.
    pub place: V32,
    /// Its standard deviations, horizontal and down, m; infinite where it is not measured.
    pub sigma: [f32; 2],
    /// Its velocity, m/s.
    pub velocity: V32,
    /// Standard deviations of it, horizontal and down; infinite where it is not measured.
    pub speed_sigma: [f32; 2],
    /// Its validity after the end of the interval, s.
    pub late: f32,
    /// The vehicle stands: standard deviation of its velocity, m/s. Infinite while it moves.
    pub rest: f32,
}

impl Node {
    /// Nothing.
    pub const EMPTY: Node = Node {
        turn: [0.0; 3],
        gain: [0.0; 3],
        way: [0.0; 3],
        time: 0.0,
        place: [0.0; 3],
        sigma: [0.0; 2],
        velocity: [0.0; 3],
        speed_sigma: [f32::INFINITY; 2],
        late: 0.0,
        rest: f32::INFINITY,
    };
}

/// A fix as the window takes it.
#[derive(Debug, Clone, Copy)]
pub struct WindowFix {
    /// North, east, down from the origin, m.
    pub at: V32,
    /// Standard deviations, horizontal and down, m.
    pub sigma: [f32; 2],
    /// Velocity, m/s, and its standard deviations.
    pub velocity: V32,
    pub speed_sigma: [f32; 2],
    /// Its age at the last sample, s.
    pub age: f32,
    /// See [`Node::rest`].
    pub rest: f32,
}

/// Rotation, velocity and way of the pieces so far, in the axes at their beginning.
#[derive(Debug, Clone, Copy)]
struct Sum {
    turn: Q,
    gain: V,
    way: V,
    time: f32,
}

impl Sum {
    const ZERO: Sum = Sum {
        turn: [1.0, 0.0, 0.0, 0.0],
        gain: [0.0; 3],
        way: [0.0; 3],
        time: 0.0,
    };

    #[inline(never)]
    fn add(&mut self, piece: &Short) {
        let wide = |v: V32| v.map(f64::from);
        let (turn, time) = (wide(piece.turn), f64::from(piece.time));
        let gain = rotated(self.turn, wide(piece.gain));
        let way = add(self.gain, scale(gain, 0.5));
        self.way = add(self.way, scale(way, time));
        self.gain = add(self.gain, gain);
        self.turn = product(self.turn, from_rotvec(turn));
        self.time += piece.time;
    }

    #[inline(never)]
    fn node(&self) -> Node {
        let [w, x, y, z] = self.turn;
        let size = libm::sqrt(x * x + y * y + z * z);
        let k = if size < 1e-9 {
            2.0
        } else {
            2.0 * libm::atan2(size, w) / size
        };
        Node {
            turn: narrow([x, y, z].map(|part| part * k)),
            gain: narrow(self.gain),
            way: narrow(self.way),
            time: self.time,
            ..Node::EMPTY
        }
    }
}

/// A piece of some 50 ms.
#[derive(Debug, Clone, Copy)]
struct Short {
    turn: V32,
    gain: V32,
    time: f32,
}

/// The window, and the pieces after its last fix.
#[derive(Debug, Clone)]
pub struct Window {
    nodes: [Node; NODES],
    count: usize,
    /// The fix at its beginning.
    first: Node,
    begun: bool,
    /// Standstills of the last fixes, newest first: one counts when the vehicle stands at those
    /// after it too, since a departure shows late.
    rests: [f32; LATE],
    /// Pieces after the last fix that are older than those of the ring.
    open: Sum,
    ring: [Short; PIECES],
    /// The oldest of the ring, and how many there are.
    oldest: usize,
    waiting: usize,
}

impl Window {
    /// Empty.
    pub const EMPTY: Window = Window {
        nodes: [Node::EMPTY; NODES],
        count: 0,
        first: Node::EMPTY,
        begun: false,
        rests: [f32::INFINITY; LATE],
        open: Sum::ZERO,
        ring: [Short {
            turn: [0.0; 3],
            gain: [0.0; 3],
            time: 0.0,
        }; PIECES],
        oldest: 0,
        waiting: 0,
    };

    /// The intervals, oldest first.
    pub fn nodes(&self) -> &[Node] {
        self.nodes.get(..self.count).unwrap_or_default()
    }

    /// The fix at the beginning of the first interval.
    pub fn first(&self) -> &Node {
        &self.first
    }

    /// Time since the last fix that was used, s.
    pub fn open_s(&self) -> f32 {
        self.open.time + self.waiting_s()
    }

    /// Takes a piece.
    #[inline(never)]
    pub fn piece(&mut self, piece: &Piece) {
        if self.waiting == PIECES {
            self.release();
        }
        let at = (self.oldest + self.waiting) % PIECES;
        if let Some(slot) = self.ring.get_mut(at) {
            *slot = Short {
                turn: narrow(piece.phi()),
                gain: narrow(piece.velocity()),
                time: piece.time() as f32,
            };
            self.waiting += 1;
        }
    }

    /// Takes a fix. False: it is too close to the last one, or the window is full.
    pub fn fix(&mut self, place: &WindowFix) -> bool {
        let late = self.close(place.age);
        let mut node = self.open.node();
        (node.place, node.sigma, node.late) = (place.at, place.sigma, late);
        (node.velocity, node.speed_sigma) = (place.velocity, place.speed_sigma);
        if !self.begun {
            self.begun = true;
            self.first = node;
        } else if node.time < LEAST_S {
            return false;
        } else if let Some(slot) = self.nodes.get_mut(self.count) {
            *slot = node;
            self.count += 1;
        } else {
            return false;
        }
        self.open = Sum::ZERO;
        self.stands(place.rest);
        true
    }

    /// The vehicle stands at the last fix, or not.
    fn stands(&mut self, rest: f32) {
        let stood = self.rests.iter().all(|rest| rest.is_finite()) && rest.is_finite();
        let before = (self.count.checked_sub(1 + LATE)).and_then(|at| self.nodes.get_mut(at));
        if let (true, Some(node)) = (stood, before) {
            node.rest = self.rests[LATE - 1];
        }
        self.rests.copy_within(..LATE - 1, 1);
        self.rests[0] = rest;
    }

    /// The first interval is forgotten, and given back.
    pub fn slide(&mut self) -> Option<Node> {
        let gone = *self.nodes().first()?;
        self.first = gone;
        self.nodes.copy_within(1.., 0);
        self.count -= 1;
        Some(gone)
    }

    /// Whether no further interval has room.
    pub fn is_full(&self) -> bool {
        self.count == NODES
    }

    /// The interval from the last fix to the last sample.
    #[inline(never)]
    pub fn rest(&self) -> Node {
        let mut sum = self.open;
        for k in 0..self.waiting {
            if let Some(piece) = self.ring.get((self.oldest + k) % PIECES) {
                sum.add(piece);
            }
        }
        sum.node()
    }

    /// The pieces that are older than `age` s become part of the interval. Gives by how much later
    /// than its end that was.
    #[inline(never)]
    fn close(&mut self, age: f32) -> f32 {
        while let Some(oldest) = self.ring.get(self.oldest).filter(|_| self.waiting > 0) {
            if self.waiting_s() - 0.5 * oldest.time <= age {
                break;
            }
            self.release();
        }
        self.waiting_s() - age
    }

    fn waiting_s(&self) -> f32 {
        (0..self.waiting).fold(0.0, |sum, k| {
            let piece = self.ring.get((self.oldest + k) % PIECES);
            sum + piece.map_or(0.0, |piece| piece.time)
        })
    }

    /// The oldest piece becomes part of the interval.
    fn release(&mut self) {
        if let Some(piece) = self.ring.get(self.oldest) {
            self.open.add(piece);
        }
        self.oldest = (self.oldest + 1) % PIECES;
        self.waiting = self.waiting.saturating_sub(1);
    }
}
