//! Signed permutations of axes, which turn the axes of a sensor or file into forward-right-down.

use nalgebra::Vector3;

/// Each of forward, right, down as one of the file's axes, with a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axes([(usize, bool); 3]);

impl Axes {
    /// The file is already in forward-right-down.
    pub const FORWARD_RIGHT_DOWN: Self = Self([(0, false), (1, false), (2, false)]);
    /// The file is in right-forward-up.
    pub const RIGHT_FORWARD_UP: Self = Self([(1, false), (0, false), (2, true)]);
    /// The file is in forward-left-up.
    pub const FORWARD_LEFT_UP: Self = Self([(0, false), (1, true), (2, true)]);

    /// Parses forward, right and down in axes of the file. `"x -y -z"` means that forward is x,
    /// right is minus y and down is minus z.
    ///
    /// # Errors
    /// The fault of `text`, as the rest of a sentence that begins with it.
    pub fn parse(text: &str) -> Result<Self, &'static str> {
        let mut axes = [(0, false); 3];
        let names: Vec<&str> = text.split_whitespace().collect();
        if names.len() != 3 {
            return Err("must name three axes");
        }
        for (axis, name) in axes.iter_mut().zip(&names) {
            let (name, minus) = match name.strip_prefix('-') {
                Some(name) => (name, true),
                None => (name.strip_prefix('+').unwrap_or(name), false),
            };
            let index = ["x", "y", "z"].iter().position(|n| *n == name);
            *axis = (index.ok_or("may name x, y and z only")?, minus);
        }
        let [a, b, c] = axes.map(|(index, _)| index);
        if a == b || b == c || a == c {
            return Err("names an axis twice");
        }
        let axes = Self(axes);
        // a left-handed set is a mirror image, which no mounting can be
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| axes.turn(e));
        if x.cross(&y).dot(&z) < 0.0 {
            return Err("is left-handed");
        }
        Ok(axes)
    }

    /// Turns a triad of the file into forward-right-down.
    #[must_use]
    pub fn turn(&self, file: [f64; 3]) -> Vector3<f64> {
        Vector3::from(
            self.0
                .map(|(i, minus)| if minus { -file[i] } else { file[i] }),
        )
    }

    /// Turns a triad of counts into forward-right-down. The negative of `i32::MIN` saturates.
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
    fn text_and_constants_agree() {
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
    fn axes_that_are_no_mounting_are_refused() {
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
