//! The navigator's pieces of work, measured in the same way as those of the networks.

use firmware::fix::Position;
use firmware::nav::{Config, Navigator, Noise, State};
use firmware::sample::{Counts, Lsb};

use crate::work::WorkResult;
/// Samples per second.
pub const RATE: usize = 200;
/// Value of a count: 1e-7 rad and 1e-6 m/s.
pub(crate) const LSB: Lsb = Lsb {
    rad: 1e-7,
    mps: 1e-6,
};
/// Counts of 1 g in a second.
const GRAVITY: i32 = -9_806_650;

/// One sample accumulated, without a step.
#[derive(Clone, Debug)]
pub struct NavSampleWork(Navigator);

/// One sample, and with it the most expensive end of a piece: a step of the equations with new
/// Earth terms, which at 300 m/s happens once a second. In one of twelve there is a step of the
/// error dynamics, too.
#[derive(Clone, Debug)]
pub struct NavPieceWork(Navigator);

/// One second: its samples, its 20 pieces, and the transition.
#[derive(Clone, Debug)]
pub struct NavSecondWork(Navigator);

/// A navigator at rest in middle latitudes, with `rate` samples per second.
pub(crate) fn navigator(rate: usize, piece_samples: Option<u16>) -> Option<Navigator> {
    let noise = Noise {
        gyro: 1e-6,
        accel: 1e-4,
    };
    let mut config = Config::new(LSB, 1.0 / rate as f64, noise);
    if let Some(samples) = piece_samples {
        config.piece_samples = samples;
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

/// A sample with rates of about 0.01 rad/s, whatever the sample rate.
pub(crate) fn sample([x, y, z]: [f32; 3], rate: usize) -> Counts {
    Counts {
        dtheta: [x as i32, y as i32, z as i32].map(|c| c * 5 * RATE as i32 / rate as i32),
        dv: [1, -1, GRAVITY / rate as i32],
    }
}

pub(crate) fn verdict(navigator: &Navigator, found: f32) -> WorkResult {
    let faults = navigator.faults();
    ([found; 3], !faults.lost && faults.samples == 0)
}

impl NavSampleWork {
    /// Never `None`: the configuration is valid.
    pub fn new() -> Option<Self> {
        navigator(RATE, Some(u16::MAX)).map(Self)
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.0.sample(&sample(input, RATE));
        verdict(&self.0, 0.0)
    }
}

impl NavPieceWork {
    /// Samples per second.
    const RATE: usize = 25;

    /// Never `None`: the configuration is valid.
    pub fn new() -> Option<Self> {
        let mut navigator = navigator(Self::RATE, Some(1))?;
        // in 40 ms so far north that the Earth terms are recomputed
        for _ in 0..10 {
            navigator.feed_back(&[0.0, 0.0, 0.0, -950.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        }
        Some(Self(navigator))
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.0.sample(&sample(input, Self::RATE));
        verdict(&self.0, self.0.state().velocity[2] as f32)
    }
}

impl NavSecondWork {
    /// Never `None`: the configuration is valid.
    pub fn new() -> Option<Self> {
        navigator(RATE, None).map(Self)
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        for _ in 0..RATE {
            self.0.sample(&sample(input, RATE));
        }
        let transition = self.0.take_transition();
        let (found, good) = verdict(&self.0, transition.phi[8][5]);
        (found, good && (transition.time - 1.0).abs() < 1e-3)
    }
}
