//! Standard normal numbers that an IMU draws while it runs. IMUs of one turn-on with different
//! errors draw the same numbers. A campaign measures every drive with several groups of errors, so
//! it draws the numbers once and stores them.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Numbers of the random streams of a turn-on, one for each purpose.
const NOISE: u64 = 1;
const GYRO: u64 = 2;
const ACCEL: u64 = 3;

/// The random numbers of one turn-on.
#[derive(Debug, Clone)]
pub struct Draws {
    /// Both triads draw from it alternately.
    pub(super) noise: Normals,
    /// One stream for each triad, for all that is not drawn from the common noise. An error that
    /// draws from it does not shift the numbers of the others.
    pub(super) separate: [Normals; 2],
}

impl Draws {
    /// The random numbers of the turn-on with this seed. With `keep` they can be read again after
    /// [`Self::rewind`], at 8 bytes each.
    #[must_use]
    pub fn of(turn_on: u64, keep: bool) -> Self {
        let stream = |stream| Normals::new(turn_on, stream, keep);
        Self {
            noise: stream(NOISE),
            separate: [stream(GYRO), stream(ACCEL)],
        }
    }

    /// Back to the start, for the next IMU of this turn-on.
    ///
    /// # Panics
    /// The numbers were drawn without `keep`.
    pub fn rewind(&mut self) {
        self.noise.rewind();
        self.separate.iter_mut().for_each(Normals::rewind);
    }
}

/// One stream of standard normal numbers. Nothing else is drawn from it, so only their order
/// matters.
#[derive(Debug, Clone)]
pub(super) struct Normals {
    rng: ChaCha8Rng,
    /// Numbers drawn ahead, in blocks of [`BLOCK`], if they are stored.
    stored: Option<Vec<Vec<f64>>>,
    /// The block that is read, and how many of its numbers have been read.
    block: usize,
    read: usize,
}

/// Number of draws at once where they are stored: a multiple of three.
const BLOCK: usize = 3 << 12;

impl Normals {
    fn new(seed: u64, stream: u64, keep: bool) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self {
            rng,
            stored: keep.then(Vec::new),
            block: 0,
            read: 0,
        }
    }

    fn rewind(&mut self) {
        assert!(self.stored.is_some(), "nothing was stored");
        (self.block, self.read) = (0, 0);
    }

    /// Three numbers.
    #[inline(always)]
    pub fn three(&mut self) -> Vector3<f64> {
        let stored = self.stored.as_ref();
        let block = stored.and_then(|stored| stored.get(self.block));
        let Some([x, y, z]) = block.and_then(|block| block.get(self.read..self.read + 3)) else {
            return self.drawn();
        };
        self.read += 3;
        Vector3::new(*x, *y, *z)
    }

    /// Three numbers that are not in the present block.
    #[inline(never)]
    fn drawn(&mut self) -> Vector3<f64> {
        let Some(stored) = &mut self.stored else {
            return normal3(&mut self.rng);
        };
        if self.read == BLOCK {
            (self.block, self.read) = (self.block + 1, 0);
        }
        if self.block == stored.len() {
            let numbers = StandardNormal.sample_iter(&mut self.rng);
            stored.push(numbers.take(BLOCK).collect());
        }
        let block = &stored[self.block][self.read..];
        self.read += 3;
        Vector3::new(block[0], block[1], block[2])
    }
}

pub(super) fn normal3(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::sins::Increment;
    use crate::simulator::imu::{ErrorModelName, Imu, ImuSpec};

    #[test]
    fn stored_draws_are_those_that_would_be_drawn() {
        let (mut stored, mut drawn) = (Draws::of(3, true), Draws::of(3, false));
        let first: Vec<_> = (0..5).map(|_| stored.noise.three()).collect();
        stored.rewind();
        for k in 0..9 {
            let three = stored.noise.three();
            assert_eq!(three, drawn.noise.three());
            assert!(k >= first.len() || three == first[k]);
        }
        assert_ne!(stored.separate[0].three(), stored.separate[1].three());
    }

    /// Groups with and without errors that draw from streams of their own, one after the other over
    /// the same numbers.
    #[test]
    fn an_imu_over_stored_draws_is_the_imu_alone() {
        let preset = ImuSpec::preset("medium").unwrap();
        let increment = |k: i32| Increment {
            dtheta: Vector3::new(1e-4, -2e-4, 3e-6 * f64::from(k)),
            dv: Vector3::new(0.01, 1e-4 * f64::from(k), -0.05),
        };
        let mut draws = Draws::of(8, true);
        for model in ErrorModelName::every() {
            let spec = preset.error_model(model);
            let mut alone = Imu::new(&spec, 7, 8);
            let mut imu = Imu::with_draws(&spec, 7, 8, draws);
            for k in 0..1500 {
                assert_eq!(
                    imu.measure(&increment(k)),
                    alone.measure(&increment(k)),
                    "{model}"
                );
            }
            draws = imu.into_draws();
        }
    }
}
