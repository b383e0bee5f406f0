//! The table `[mounting]`: mounting of the sensor in the vehicle.

use super::finding::Finding;
use host_core::inertial::axes::Axes;
use host_core::inertial::rotation::{from_euler, to_euler};
use host_core::inertial::units::DEG;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Mounting of the sensor in the vehicle: either `axes`, or the three angles, or `matrix`. Without
/// any of them, the sensor's x, y, z point forward, right, down. Source: the drawing of the sensor
/// and where it is mounted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Mounting {
    /// Forward, right and down of the vehicle, each as an axis of the sensor with its sign: "y x
    /// -z" for a sensor whose x points right, y forward, z up. Right-handed. Default: "x y z".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<String>,
    /// Roll of the sensor in the vehicle, right side down, deg, -360 to 360. The three angles turn
    /// the vehicle's axes into the sensor's: first heading about down, then pitch, then roll.
    /// Default: 0.
    #[schemars(range(min = -360, max = 360))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_deg: Option<f64>,
    /// Pitch of the sensor in the vehicle, front up, deg, -360 to 360. Default: 0.
    #[schemars(range(min = -360, max = 360))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pitch_deg: Option<f64>,
    /// Heading of the sensor in the vehicle, clockwise from forward seen from above, deg, -360 to
    /// 360. Default: 0.
    #[schemars(range(min = -360, max = 360))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
    /// Three rows: forward, right and down of the vehicle, each as a vector in axes of the sensor,
    /// each number -1 to 1. The rows must be at right angles to each other, of length 1 (to 0.01)
    /// and right-handed; a remaining error is removed. Default: the unit matrix.
    #[schemars(inner(inner(range(min = -1, max = 1))))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 3]; 3]>,
}

/// Largest error of the rows of a matrix: of their lengths, and of the cosines between them.
const SQUARE: f64 = 0.01;

impl Mounting {
    /// Rotation of a vector from sensor axes to body axes.
    ///
    /// # Errors
    /// Axes that are no mounting, or axes and angles at once.
    pub fn rotation(&self) -> Result<UnitQuaternion<f64>, Finding> {
        let angles = [self.roll_deg, self.pitch_deg, self.heading_deg];
        if let Some(rows) = &self.matrix {
            if self.axes.is_some() || angles.iter().any(Option::is_some) {
                return Err(Finding::wrong(
                    "mounting.matrix",
                    "is given together with axes or angles",
                    "give one of them",
                ));
            }
            return rotation(rows).ok_or_else(|| {
                Finding::wrong(
                    "mounting.matrix",
                    format!("is {rows:?}, which is not a right-handed rotation"),
                    "give forward, right and down of the vehicle as rows, in axes of the sensor: \
                     [[0, 1, 0], [1, 0, 0], [0, 0, -1]] for x right, y forward, z up",
                )
            });
        }
        match &self.axes {
            Some(_) if angles.iter().any(Option::is_some) => Err(Finding::wrong(
                "mounting.axes",
                "is given together with angles",
                "give either axes, or roll_deg, pitch_deg and heading_deg",
            )),
            Some(text) => {
                let axes = Axes::parse(text).map_err(|why| {
                    Finding::wrong(
                        "mounting.axes",
                        format!("is '{text}' and {why}"),
                        "give forward, right and down in axes of the sensor, as in \"y x -z\" for \
                         x right, y forward, z up",
                    )
                })?;
                let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                let matrix = Matrix3::from_columns(&columns.map(|axis| axes.turn(axis)));
                let rotation = Rotation3::from_matrix_unchecked(matrix);
                Ok(UnitQuaternion::from_rotation_matrix(&rotation))
            }
            None => {
                let [roll, pitch, heading] = angles.map(|angle| angle.unwrap_or(0.0) * DEG);
                Ok(from_euler(roll, pitch, heading))
            }
        }
    }
}

/// The rotation that is nearest to a matrix of these rows, if it is near enough.
fn rotation(rows: &[[f64; 3]; 3]) -> Option<UnitQuaternion<f64>> {
    let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
    let off = matrix * matrix.transpose() - Matrix3::identity();
    let square = off.iter().all(|x| x.abs() <= SQUARE);
    (square && matrix.determinant() > 0.0).then(|| UnitQuaternion::from_matrix(&matrix))
}

impl Mounting {
    /// The mounting that becomes this quaternion (w, x, y, z) again, bit for bit: axes if it is one
    /// of theirs, else angles with as few decimals as possible.
    #[must_use]
    pub(super) fn of(q: [f32; 4]) -> Option<Self> {
        let same = |mounting: &Self| {
            let again = mounting.rotation().map(|r| [r.w, r.i, r.j, r.k]);
            again.is_ok_and(|again| again.map(|x| x as f32) == q)
        };
        if same(&Self::default()) {
            return Some(Self::default());
        }
        let names = ["x", "y", "z", "-x", "-y", "-z"];
        let axes = (0..216).map(|n: usize| Self {
            axes: Some(format!(
                "{} {} {}",
                names[n / 36],
                names[n / 6 % 6],
                names[n % 6]
            )),
            ..Self::default()
        });
        axes.into_iter().find(&same).or_else(|| angles(q, same))
    }
}

/// Angles for which `accepted` holds. The same attitude has two sets of angles, and a full turn
/// changes the quaternion's sign.
fn angles(q: [f32; 4], accepted: impl Fn(&Mounting) -> bool) -> Option<Mounting> {
    let [w, x, y, z] = q.map(f64::from);
    let unit = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    let (roll, pitch, heading) = to_euler(&unit);
    let [roll, pitch, heading] = [roll, pitch, heading].map(|angle| angle / DEG);
    let other = [roll + 180.0, 180.0 - pitch, heading + 180.0];
    let turns = [0.0, -360.0, 360.0];
    (0..=12).find_map(|decimals| {
        let rounded = |angle: f64| format!("{angle:.decimals$}").parse().ok();
        let sets = [[roll, pitch, heading], other].into_iter();
        let mut turned = sets.flat_map(|[roll, pitch, heading]| {
            turns.map(|turn| [roll, pitch, heading + turn].map(rounded))
        });
        turned.find_map(|[roll_deg, pitch_deg, heading_deg]| {
            let in_range = heading_deg.is_some_and(|heading: f64| heading.abs() <= 360.0);
            let mounting = Mounting {
                axes: None,
                roll_deg,
                pitch_deg,
                heading_deg,
                matrix: None,
            };
            (in_range && accepted(&mounting)).then_some(mounting)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn axes(text: &str) -> Mounting {
        Mounting {
            axes: Some(text.into()),
            ..Mounting::default()
        }
    }

    #[test]
    fn all_orthogonal_mountings_turn_as_they_say() {
        let names = ["x", "y", "z", "-x", "-y", "-z"];
        let unit = |name: &str| {
            let k = ["x", "y", "z"]
                .iter()
                .position(|n| name.ends_with(n))
                .unwrap();
            let sign = if name.starts_with('-') { -1.0 } else { 1.0 };
            Vector3::from_fn(|i, _| if i == k { sign } else { 0.0 })
        };
        let mut right_handed = 0;
        for forward in names {
            for right in names {
                for down in names {
                    let text = format!("{forward} {right} {down}");
                    let Ok(q) = axes(&text).rotation() else {
                        continue;
                    };
                    right_handed += 1;
                    for (name, body) in [(forward, "x"), (right, "y"), (down, "z")] {
                        let turned = q * unit(name);
                        assert!((turned - unit(body)).norm() < 1e-12, "{text}: {name}");
                    }
                }
            }
        }
        assert_eq!(right_handed, 24);
    }

    #[test]
    fn angles_say_where_the_sensor_points() {
        let turned = |roll: f64, pitch: f64, heading: f64, v: [f64; 3]| {
            let mounting = Mounting {
                axes: None,
                roll_deg: Some(roll),
                pitch_deg: Some(pitch),
                heading_deg: Some(heading),
                matrix: None,
            };
            mounting.rotation().unwrap() * Vector3::from(v)
        };
        // heading 90: the sensor's x points right; pitch 90: up; roll 90: its y points down
        let near = |a: Vector3<f64>, b: [f64; 3]| (a - Vector3::from(b)).norm() < 1e-12;
        assert!(near(
            turned(0.0, 0.0, 90.0, [1.0, 0.0, 0.0]),
            [0.0, 1.0, 0.0]
        ));
        assert!(near(
            turned(0.0, 90.0, 0.0, [1.0, 0.0, 0.0]),
            [0.0, 0.0, -1.0]
        ));
        assert!(near(
            turned(90.0, 0.0, 0.0, [0.0, 1.0, 0.0]),
            [0.0, 0.0, 1.0]
        ));
        // upside down, seen both ways
        let both = axes("x -y -z").rotation().unwrap();
        let angles = Mounting {
            roll_deg: Some(180.0),
            ..Mounting::default()
        };
        assert!(both.angle_to(&angles.rotation().unwrap()) < 1e-12);
    }

    #[test]
    fn a_matrix_is_the_axes_that_it_spells() {
        let matrix = |rows: [[f64; 3]; 3]| Mounting {
            matrix: Some(rows),
            ..Mounting::default()
        };
        let rows = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
        let given = matrix(rows).rotation().unwrap();
        assert!(given.angle_to(&axes("y x -z").rotation().unwrap()) < 1e-12);
        // turned by 3 deg about down, written with three decimals
        let (sin, cos) = (0.052, 0.999);
        let turned = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
        let forward = matrix(turned).rotation().unwrap().inverse() * Vector3::x();
        assert!(
            (forward.y.atan2(forward.x) / DEG - 2.98).abs() < 0.01,
            "{forward}"
        );
        for wrong in [
            [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            [[1.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [[0.9, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [[f64::NAN, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        ] {
            let finding = matrix(wrong).rotation().unwrap_err();
            assert_eq!(finding.key, "mounting.matrix");
        }
        let both = Mounting {
            roll_deg: Some(1.0),
            ..matrix(rows)
        };
        assert!(both.rotation().unwrap_err().problem.contains("together"));
    }

    #[test]
    fn what_is_no_mounting_is_refused() {
        let both = Mounting {
            roll_deg: Some(1.0),
            ..axes("x y z")
        };
        assert!(both.rotation().unwrap_err().problem.contains("angles"));
        let mirrored = axes("y x z").rotation().unwrap_err();
        assert!(mirrored.problem.contains("left-handed"), "{mirrored:?}");
    }
}
