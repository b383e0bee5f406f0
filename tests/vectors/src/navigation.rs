//! The navigator's pieces of work, measured as those of the networks are.

use firmware::nav::{Config, Navigator, Noise, Position, State};
use firmware::sample::{Counts, Lsb};

/// Words a second.
pub const RATE: usize = 200;
/// Counts of 1 g in a word.
const GRAVITY: i32 = -49_033;

/// One word gathered, and no step.
#[derive(Clone, Debug)]
pub struct NavWordWork(Navigator);

/// One word, and with it a whole piece: a step of the equations and of the error dynamics.
#[derive(Clone, Debug)]
pub struct NavPieceWork(Navigator);

/// One second: its words, its 20 pieces, and the transition taken.
#[derive(Clone, Debug)]
pub struct NavSecondWork(Navigator);

/// At rest in middle latitudes; counts of 1e-7 rad and 1e-6 m/s.
fn navigator(piece_words: Option<u16>) -> Option<Navigator> {
    let lsb = Lsb {
        rad: 1e-7,
        mps: 1e-6,
    };
    let noise = Noise {
        gyro: 1e-6,
        accel: 1e-4,
    };
    let mut config = Config::new(lsb, 1.0 / RATE as f64, noise);
    if let Some(words) = piece_words {
        config.piece_words = words;
    }
    let state = State {
        position: Position {
            latitude: 0.8,
            longitude: 0.1,
            height: 300.0,
        },
        velocity: [0.0; 3],
        q_bn: [1.0, 0.0, 0.0, 0.0],
    };
    Navigator::new(config, state).ok()
}

/// Rates of up to 2e-4 rad/s.
fn word([x, y, z]: [f32; 3]) -> Counts {
    Counts {
        dtheta: [x as i32, y as i32, z as i32].map(|c| c * 5),
        dv: [1, -1, GRAVITY],
    }
}

fn verdict(navigator: &Navigator, found: f32) -> ([f32; 3], bool) {
    let faults = navigator.faults();
    ([found; 3], !faults.lost && faults.words == 0)
}

impl NavWordWork {
    /// `None` never: the configuration is good.
    pub fn new() -> Option<Self> {
        navigator(Some(u16::MAX)).map(Self)
    }

    /// One repetition, and whether it was good.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> ([f32; 3], bool) {
        self.0.word(&word(input));
        verdict(&self.0, 0.0)
    }
}

impl NavPieceWork {
    /// `None` never: the configuration is good.
    pub fn new() -> Option<Self> {
        navigator(Some(1)).map(Self)
    }

    /// One repetition, and whether it was good.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> ([f32; 3], bool) {
        self.0.word(&word(input));
        verdict(&self.0, self.0.state().velocity[2] as f32)
    }
}

impl NavSecondWork {
    /// `None` never: the configuration is good.
    pub fn new() -> Option<Self> {
        navigator(None).map(Self)
    }

    /// One repetition, and whether it was good.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> ([f32; 3], bool) {
        for _ in 0..RATE {
            self.0.word(&word(input));
        }
        let transition = self.0.take_transition();
        let (found, good) = verdict(&self.0, transition.phi[8][5]);
        (found, good && (transition.time - 1.0).abs() < 1e-3)
    }
}
