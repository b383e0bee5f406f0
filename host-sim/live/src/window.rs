//! Reduces many samples to few numbers, which a page draws for a sensor with thousands of samples a
//! second.

use crate::samples::Sample;
use serde::Serialize;

/// Least, mean and greatest value of each axis in a time, in the units of the page: deg/s, m/s2.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Window {
    /// Number of samples in it.
    pub n: u32,
    /// Least values.
    pub min: [f64; 6],
    /// Means.
    pub mean: [f64; 6],
    /// Greatest values.
    pub max: [f64; 6],
}

/// Gathers samples.
#[derive(Clone, Debug)]
pub struct Gather {
    n: u32,
    min: Sample,
    sum: Sample,
    max: Sample,
}

impl Gather {
    /// Without samples.
    pub const NOTHING: Self = Self {
        n: 0,
        min: [f64::INFINITY; 6],
        sum: [0.0; 6],
        max: [f64::NEG_INFINITY; 6],
    };

    /// Adds a sample.
    pub fn take(&mut self, sample: &Sample) {
        self.n += 1;
        for (axis, value) in sample.iter().enumerate() {
            self.min[axis] = self.min[axis].min(*value);
            self.max[axis] = self.max[axis].max(*value);
            self.sum[axis] += value;
        }
    }

    /// The window of the samples since the last call; `None` without samples.
    pub fn end(&mut self) -> Option<Window> {
        let Self { n, min, sum, max } = std::mem::replace(self, Self::NOTHING);
        (n > 0).then(|| Window {
            n,
            min: shown(min),
            mean: shown(sum.map(|sum| sum / f64::from(n))),
            max: shown(max),
        })
    }
}

/// A sample in the units of the page: rates in deg/s.
#[must_use]
pub fn shown(sample: Sample) -> Sample {
    let [a, b, c, x, y, z] = sample;
    let [a, b, c] = [a, b, c].map(f64::to_degrees);
    [a, b, c, x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_and_mean_of_what_came() {
        let mut gather = Gather::NOTHING;
        assert_eq!(gather.end(), None);
        gather.take(&[1f64.to_radians(), 0.0, 0.0, -1.0, 5.0, 9.0]);
        gather.take(&[3f64.to_radians(), 0.0, 0.0, 2.0, 5.0, 9.5]);
        let window = gather.end().expect("two samples");
        assert_eq!(window.n, 2);
        let [least, mean, greatest] = [window.min[0], window.mean[0], window.max[0]];
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(least, 1.0) && near(mean, 2.0) && near(greatest, 3.0));
        assert_eq!(
            [window.min[3], window.mean[3], window.max[3]],
            [-1.0, 0.5, 2.0]
        );
        assert_eq!(gather.end(), None);
    }
}
