//! History for pages that open later; its size is bounded, however long the server runs.

use serde::Serialize;

/// Largest number of points.
const MOST: usize = 1024;

/// Points at even intervals since the beginning. When there are too many, every second one is
/// dropped, and from then on only every second new one is stored.
#[derive(Debug)]
pub struct History<T> {
    points: Vec<T>,
    /// One point in this many is stored.
    stride: usize,
    count: usize,
}

impl<T> Default for History<T> {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            stride: 1,
            count: 0,
        }
    }
}

impl<T> History<T> {
    /// Adds a point.
    pub fn push(&mut self, point: T) {
        if self.count.is_multiple_of(self.stride) {
            if self.points.len() == MOST {
                let mut number = 0;
                self.points.retain(|_| {
                    number += 1;
                    number % 2 == 1
                });
                self.stride *= 2;
            }
            if self.count.is_multiple_of(self.stride) {
                self.points.push(point);
            }
        }
        self.count += 1;
    }

    /// The stored points, oldest first.
    #[must_use]
    pub fn points(&self) -> &[T] {
        &self.points
    }
}

/// Slowly changing values at one time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Time of the server, s.
    pub t: f64,
    /// Estimated sensor errors, deg/h and mg, while the learner navigates.
    pub estimate: Option<[f64; 6]>,
    /// Their standard deviations, deg/h and mg.
    pub sigma: Option<[f64; 6]>,
    /// Correction in force, deg/h and mg.
    pub in_force: [f64; 6],
    /// How near the proof of each hypothesis is, of 100.
    pub proof: Option<Vec<u8>>,
    /// Latitude and longitude, deg.
    pub place: Option<[f64; 2]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_bounded_and_even() {
        let mut history = History::default();
        for n in 0..100_000 {
            history.push(n);
            assert!(history.points().len() <= MOST);
        }
        let points = history.points();
        assert!(points.len() > MOST / 2 && points[0] == 0);
        let step = points[1];
        assert!(points.windows(2).all(|pair| pair[1] - pair[0] == step));
        assert!(points.last().is_some_and(|last| *last > 99_000));
    }
}
