//! A delay by any number of samples, whole or not.

use nalgebra::Vector3;

/// Increments of delayed samples. The velocity is taken as linear within a sample, so no velocity
/// is lost.
#[derive(Debug, Clone)]
pub(super) struct Delay {
    part: f64,
    /// The last increments, the present one at `at`. Before the first sample all are equal to it.
    ring: Vec<Vector3<f64>>,
    at: usize,
    begun: bool,
}

impl Delay {
    /// A delay by `samples` samples, >= 0. `None` for no delay.
    pub fn new(samples: f64) -> Option<Self> {
        (samples > 0.0).then(|| Self {
            part: samples.fract(),
            ring: vec![Vector3::zeros(); samples as usize + 2],
            at: 0,
            begun: false,
        })
    }

    /// Accepts the present increment and gives the delayed one.
    pub fn next(&mut self, increment: Vector3<f64>) -> Vector3<f64> {
        if !self.begun {
            self.ring.fill(increment);
            self.begun = true;
        }
        let n = self.ring.len();
        self.at = (self.at + 1) % n;
        self.ring[self.at] = increment;
        // the oldest is whole + 1 samples old and follows the present one in the ring
        let (older, newer) = (self.ring[(self.at + 1) % n], self.ring[(self.at + 2) % n]);
        newer * (1.0 - self.part) + older * self.part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_comes_late_by_the_delay() {
        for samples in [0.25, 1.0, 2.75, 17.0] {
            let mut delay = Delay::new(samples).unwrap();
            for i in 0..60 {
                let late = delay.next(Vector3::repeat(f64::from(i)));
                if f64::from(i) > samples + 1.0 {
                    assert!(
                        (f64::from(i) - late.x - samples).abs() < 1e-12,
                        "{samples}: {i} {}",
                        late.x
                    );
                } else {
                    assert!(late.x >= 0.0);
                }
            }
        }
        assert!(Delay::new(0.0).is_none());
    }
}
