//! Colours and line styles of the report: each scheme has one look, in every picture and table.
//!
//! The hues are those of Okabe and Ito ("Color Universal Design", 2008), which people with any kind
//! of colour blindness can distinguish. Dashes distinguish the schemes in grey print as well.

/// A colour on white paper and its counterpart on a dark screen.
///
/// Both are `#RRGGBB` in upper case, as the SVG writes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Colour {
    /// Name of the CSS variable.
    pub name: &'static str,
    /// On white.
    pub light: &'static str,
    /// On a dark screen.
    pub dark: &'static str,
}

impl Colour {
    const fn new(name: &'static str, light: &'static str, dark: &'static str) -> Self {
        Self { name, light, dark }
    }

    /// Red, green and blue on white, each 0..=255.
    pub fn rgb(self) -> (u8, u8, u8) {
        let part = |at: usize| u8::from_str_radix(&self.light[at..at + 2], 16).unwrap_or(0);
        (part(1), part(3), part(5))
    }
}

/// Background.
pub const PAPER: Colour = Colour::new("paper", "#FFFFFF", "#15181C");
/// Text, frames, and the true sensor error.
pub const INK: Colour = Colour::new("ink", "#1B1F24", "#E7EAEE");
/// Tick labels and captions.
pub const SOFT: Colour = Colour::new("soft", "#59616B", "#A4ADB8");
/// Grid lines.
pub const GRID: Colour = Colour::new("grid", "#E4E7EB", "#2C3138");
/// The reference track.
pub const REFERENCE: Colour = Colour::new("reference", "#9BA3AD", "#6C7580");
/// The teacher's error estimates: faint.
pub const TEACHER: Colour = Colour::new("teacher", "#C3C9D1", "#4C545E");
/// No correction.
pub const RAW: Colour = Colour::new("raw", "#D55E00", "#FF8B3D");
const LS_BIAS: Colour = Colour::new("ls-bias", "#CC79A7", "#E79CC6");
const LS_3X3: Colour = Colour::new("ls-3x3", "#009E73", "#2CC99B");
/// The network, also in the learning curves and sensor-error panels.
pub const RNN: Colour = Colour::new("rnn", "#0072B2", "#56B4F2");
/// The learner from satellite fixes.
pub const DEVICE: Colour = Colour::new("device", "#8B1E3F", "#FF8FAB");
const EKF6: Colour = Colour::new("ekf6", "#56B4E9", "#8FD0F7");
const EKF12: Colour = Colour::new("ekf12", "#B58900", "#E6C34D");
const EKF24: Colour = Colour::new("ekf24", "#6F5BB5", "#AE9DF0");

/// All colours, for the style sheet.
pub fn all() -> [Colour; 14] {
    [
        PAPER, INK, SOFT, GRID, REFERENCE, TEACHER, RAW, LS_BIAS, LS_3X3, EKF6, EKF12, EKF24, RNN,
        DEVICE,
    ]
}

/// Line style of a curve; lengths in CSS pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Colour of line and mark.
    pub colour: Colour,
    /// Width of the line.
    pub width: f64,
    /// Lengths of dash and gap; `None` for a solid line.
    pub dash: Option<(f64, f64)>,
    /// Mark at single values.
    pub sign: Option<Sign>,
}

/// A mark at a value, distinguishable from the others without its colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sign {
    /// A filled circle.
    Disc,
    /// A circle.
    Ring,
    /// A filled triangle.
    Triangle,
}

impl Look {
    /// Dashes and gaps of these lengths.
    pub const fn dashed(colour: Colour, width: f64, dash: (f64, f64)) -> Self {
        Self {
            colour,
            width,
            dash: Some(dash),
            sign: None,
        }
    }

    /// A solid line.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            dash: None,
            sign: None,
        }
    }
}

/// Look of a scheme or of the reference.
pub fn scheme(name: &str) -> Look {
    match name {
        "reference" => Look::solid(REFERENCE, 4.0),
        "raw" => Look::solid(RAW, 1.8),
        "ls-bias" => Look::dashed(LS_BIAS, 1.8, (10.0, 5.0)),
        "ls-3x3" => Look::dashed(LS_3X3, 1.8, (5.0, 3.0)),
        "ekf6" => Look::dashed(EKF6, 1.8, (2.5, 2.5)),
        "ekf12" => Look::dashed(EKF12, 1.8, (7.0, 2.0)),
        "ekf24" => Look::dashed(EKF24, 1.8, (2.0, 4.0)),
        "rnn" => Look::solid(RNN, 2.4),
        // `run` has the device twice, and neither `device` nor `ekf12`
        "device" | "device-4" => Look::dashed(DEVICE, 2.4, (14.0, 3.0)),
        "device-1" => Look::dashed(EKF12, 2.0, (4.0, 2.0)),
        _ => Look::dashed(SOFT, 1.8, (3.0, 6.0)),
    }
}

/// Look of a comparison with a better result.
pub const BETTER: Look = Look {
    sign: Some(Sign::Disc),
    ..Look::solid(RNN, 2.4)
};
/// Look of a comparison with a worse result.
pub const WORSE: Look = Look {
    sign: Some(Sign::Triangle),
    ..Look::solid(RAW, 2.4)
};
/// Look of a comparison without a decision.
pub const UNDECIDED: Look = Look {
    sign: Some(Sign::Ring),
    ..Look::solid(SOFT, 1.2)
};

/// Look of a curve that is no scheme's, by its number `index`.
pub fn numbered(index: usize) -> Look {
    const COLOURS: [Colour; 4] = [RNN, RAW, LS_3X3, LS_BIAS];
    Look::solid(COLOURS[index % COLOURS.len()], 2.0)
}

/// Look of a learning curve `network: part`: a colour for each network, dashes for data held back.
///
/// `index` is the number of the network.
pub fn learning(name: &str, index: usize) -> Look {
    Look {
        dash: name.contains("held back").then_some((7.0, 4.0)),
        ..numbered(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scheme_differs_in_colour_and_in_grey_print() {
        let looks = [
            "raw",
            "ls-bias",
            "ls-3x3",
            "ekf6",
            "ekf12",
            "ekf24",
            "rnn",
            "device",
            "reference",
            "another",
        ]
        .map(scheme);
        for (i, a) in looks.iter().enumerate() {
            for b in &looks[..i] {
                assert_ne!(a.colour, b.colour);
                assert!(a.dash != b.dash || a.width != b.width);
            }
        }
    }

    #[test]
    fn the_schemes_of_a_run_differ() {
        let names = [
            "raw",
            "ls-bias",
            "ls-3x3",
            "rnn",
            "device-1",
            "device-4",
            "reference",
        ];
        let looks = names.map(scheme);
        for (i, a) in looks.iter().enumerate() {
            for b in &looks[..i] {
                assert!(a.colour != b.colour && (a.dash != b.dash || a.width != b.width));
            }
        }
    }

    #[test]
    fn colours_are_distinct_and_spelt_as_the_svg_spells_them() {
        let all = all();
        for (i, colour) in all.iter().enumerate() {
            let (r, g, b) = colour.rgb();
            assert_eq!(colour.light, format!("#{r:02X}{g:02X}{b:02X}"));
            assert!(
                all[..i]
                    .iter()
                    .all(|other| other.light != colour.light && other.name != colour.name)
            );
        }
    }
}
