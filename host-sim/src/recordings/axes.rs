//! Signed permutations of axes: how a sensor or file is turned into forward-right-down.

use nalgebra::Vector3;

/// Each of forward, right, down as one of the file's axes, with a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axes([(usize, bool); 3]);

impl Axes {
    /// The file already has forward-right-down.
    pub const FORWARD_RIGHT_DOWN: Self = Self([(0, false), (1, false), (2, false)]);
    /// The file has right, forward, up.
    pub const RIGHT_FORWARD_UP: Self = Self([(1, false), (0, false), (2, true)]);
    /// The file has forward, left, up.
    pub const FORWARD_LEFT_UP: Self = Self([(0, false), (1, true), (2, true)]);

    /// From the three of them in words, forward, right, down: `"x -y -z"` means that forward is x, right is minus y and down is minus z.
    ///
    /// # Errors
    /// Says what is wrong, as the rest of a sentence.
    pub fn parse(text: &str) -> Result<Self, &'static str> {
        let mut axes = [(0, false); 3];
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.len() != 3 {
            return Err("must name three axes");
        }
        for (axis, word) in axes.iter_mut().zip(&words) {
            let (name, minus) = match word.strip_prefix('-') {
                Some(name) => (name, true),
                None => (word.strip_prefix('+').unwrap_or(word), false),
            };
            let index = ["x", "y", "z"].iter().position(|n| *n == name);
            *axis = (index.ok_or("may name x, y and z only")?, minus);
        }
        let [a, b, c] = axes.map(|(index, _)| index);
        if a == b || b == c || a == c {
            return Err("names an axis twice");
        }
        let axes = Self(axes);
        // a left-handed set is a mirror, never a mounting
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| axes.turn(e));
        if x.cross(&y).dot(&z) < 0.0 {
            return Err("is left-handed");
        }
        Ok(axes)
    }

    /// A triad of the file in forward-right-down.
    #[must_use]
    pub fn turn(&self, file: [f64; 3]) -> Vector3<f64> {
        Vector3::from(
            self.0
                .map(|(i, minus)| if minus { -file[i] } else { file[i] }),
        )
    }

    /// A triad of counts in forward-right-down; the opposite of `i32::MIN` is `i32::MAX`.
    #[must_use]
    pub fn turn_counts(&self, file: [i32; 3]) -> [i32; 3] {
        self.0.map(|(i, minus)| {
            if minus {
                file[i].saturating_neg()
            } else {
                file[i]
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_constants_agree() {
        for (text, axes) in [
            ("x y z", Axes::FORWARD_RIGHT_DOWN),
            ("y x -z", Axes::RIGHT_FORWARD_UP),
            ("+x -y  -z", Axes::FORWARD_LEFT_UP),
        ] {
            assert_eq!(Axes::parse(text), Ok(axes));
        }
        let v = Axes::RIGHT_FORWARD_UP.turn([1.0, 2.0, 3.0]);
        assert_eq!(v, Vector3::new(2.0, 1.0, -3.0));
        assert_eq!(
            Axes::FORWARD_LEFT_UP.turn_counts([1, i32::MIN, 3]),
            [1, i32::MAX, -3]
        );
    }

    #[test]
    fn what_is_no_mounting_is_refused() {
        for (text, why) in [
            ("x y", "three"),
            ("x y z x", "three"),
            ("x y w", "only"),
            ("x --y z", "only"),
            ("x y -y", "twice"),
            ("y x z", "left-handed"),
            ("-x -y -z", "left-handed"),
        ] {
            assert!(Axes::parse(text).unwrap_err().contains(why), "{text}");
        }
    }
}
