//! A term is one number of a datasheet with its key, range and group of errors, how it acts on a
//! triad, and the parameters of a filter that models it. The tables are in [`super::datasheet`].

use super::triad::Sigmas;
use crate::inertial::ekf::{Parameter, Regressor, Triad};

/// The group of errors that a number belongs to. An [`super::ErrorModelName`] switches and scales
/// whole groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// White noise and pulses. They are always there.
    Noise,
    /// A condition of other numbers: when, how fast or at which rate. It is no error by itself.
    Condition,
    /// Constant over a turn-on and linear: bias, scale factor, misalignment.
    Constant,
    /// A bias that changes at random during a turn-on.
    Wander,
    /// Follows the temperature.
    Thermal,
    /// Not linear in the input.
    Nonlinear,
    /// All others: magnetic field, size effect, delay.
    Other,
}

/// The values that a number may take. All are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// At least zero.
    NotNegative,
    /// Above zero: something is divided by it.
    Positive,
    /// From zero to this value.
    UpTo(f64),
}

/// One axis of one triad.
#[derive(Debug, Clone, Copy)]
pub struct At {
    /// The triad.
    pub triad: Triad,
    /// The axis, 0 to 2.
    pub axis: usize,
}

impl At {
    /// A parameter of this axis that does not change.
    pub(super) fn constant(self, regressor: Regressor, sigma: f64) -> Parameter {
        Parameter::constant(self.triad, self.axis, regressor, sigma)
    }
}

/// Meaning of a number, independent of its key. `S` is its datasheet.
#[derive(Debug, Clone, Copy)]
pub struct Kind<S> {
    group: Group,
    range: Range,
    acts: fn(&S, &mut Sigmas),
    parameters: fn(&S, At) -> Vec<Parameter>,
    bias: Option<fn(&S) -> f64>,
    large: Option<f64>,
}

impl<S> Kind<S> {
    /// A number of this group without effect.
    pub(super) const fn of(group: Group) -> Self {
        Self {
            group,
            range: Range::NotNegative,
            acts: |_, _| {},
            parameters: |_, _| Vec::new(),
            bias: None,
            large: None,
        }
    }

    /// Sets another range.
    pub(super) const fn within(self, range: Range) -> Self {
        Self { range, ..self }
    }

    /// Sets its effect: the number of the triad that it sets, in SI.
    pub(super) const fn acts(self, acts: fn(&S, &mut Sigmas)) -> Self {
        Self { acts, ..self }
    }

    /// Sets the parameters of a filter that models the error: those of one axis, with their exact
    /// statistics.
    pub(super) const fn parameters(self, parameters: fn(&S, At) -> Vec<Parameter>) -> Self {
        Self { parameters, ..self }
    }

    /// Sets the standard deviation, in the unit of the datasheet, that it adds to the bias that a
    /// filter must expect if it does not model the error.
    pub(super) const fn bias(self, sigma: fn(&S) -> f64) -> Self {
        Self {
            bias: Some(sigma),
            ..self
        }
    }

    /// Sets a value so large that a filter fails that does not model the error. Errors that only
    /// change at random have none.
    pub(super) const fn large(self, value: f64) -> Self {
        Self {
            large: Some(value),
            ..self
        }
    }
}

/// One number of a datasheet.
#[derive(Debug, Clone, Copy)]
pub struct Term<S> {
    /// Key in presets and scenario files. Its ending is the unit.
    pub key: &'static str,
    value: fn(&mut S) -> &mut f64,
    kind: Kind<S>,
}

impl<S: Clone> Term<S> {
    pub(super) const fn new(
        key: &'static str,
        value: fn(&mut S) -> &mut f64,
        kind: Kind<S>,
    ) -> Self {
        Self { key, value, kind }
    }

    /// Its group of errors.
    #[must_use]
    pub fn group(&self) -> Group {
        self.kind.group
    }

    /// A value so large that a filter must model the error, if there is one.
    #[must_use]
    pub fn large(&self) -> Option<f64> {
        self.kind.large
    }

    /// Whether something is divided by it.
    pub(super) fn is_positive(&self) -> bool {
        self.kind.range == Range::Positive
    }

    /// Its value in a datasheet.
    pub(super) fn of<'a>(&self, sheet: &'a mut S) -> &'a mut f64 {
        (self.value)(sheet)
    }
}

/// A datasheet that is a table of terms.
pub(super) trait Datasheet: Clone + 'static {
    /// Its name in files.
    const NAME: &'static str;
    /// All its numbers, in the order of the filters' parameters.
    const TERMS: &'static [Term<Self>];

    /// The numbers of a triad in SI.
    fn sigmas(&self) -> Sigmas {
        let mut out = Sigmas::default();
        self.act(&mut out);
        out
    }

    /// Sets the numbers of a triad that this sheet has.
    fn act(&self, to: &mut Sigmas) {
        Self::TERMS.iter().for_each(|t| (t.kind.acts)(self, to));
    }

    /// Parameters of exactly the errors that are present.
    fn parameters(&self, at: At) -> Vec<Parameter> {
        let all = Self::TERMS
            .iter()
            .flat_map(|t| (t.kind.parameters)(self, at));
        all.filter(|p| p.sigma > 0.0 || p.walk > 0.0).collect()
    }

    /// Root sum of squares of all contributions to the bias, in the datasheet's unit.
    fn expected_bias(&self) -> f64 {
        let biases = Self::TERMS.iter().filter_map(|t| t.kind.bias);
        biases.map(|sigma| sigma(self).powi(2)).sum::<f64>().sqrt()
    }

    /// Multiplies each number by the factor of its group.
    fn scale(&mut self, factor: impl Fn(Group) -> f64) {
        for term in Self::TERMS {
            *term.of(self) *= factor(term.group());
        }
    }

    /// Checks the ranges; the error names the first number out of its range.
    fn check(&self) -> Result<(), String> {
        let mut sheet = self.clone();
        for term in Self::TERMS {
            let x = *term.of(&mut sheet);
            check(&format!("{}.{}", Self::NAME, term.key), x, term.kind.range)?;
        }
        Ok(())
    }
}

/// Checks that a number is in its range.
pub(super) fn check(key: &str, x: f64, range: Range) -> Result<(), String> {
    let (bound, is_low) = match range {
        Range::Positive => ("> 0", x <= 0.0),
        Range::NotNegative | Range::UpTo(_) => (">= 0", x < 0.0),
    };
    if is_low || !x.is_finite() {
        return Err(format!("{key} = {x}: must be a finite number {bound}"));
    }
    match range {
        Range::UpTo(most) if x > most => Err(format!("{key} = {x}: must be 0 to {most}")),
        _ => Ok(()),
    }
}

/// Declares a datasheet. An entry is at the same time the field with its documentation, the key in
/// files, and the term.
macro_rules! datasheet {
    (
        $(#[$outer:meta])*
        $sheet:ident in $name:literal {
            $( $(#[$meta:meta])* $key:ident: $kind:expr, )*
            $( ; $( $(#[$part_meta:meta])* $part:ident: $part_type:ty ),+ )?
        }
    ) => {
        $(#[$outer])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $sheet {
            $( $(#[$meta])* pub $key: f64, )*
            $( $( $(#[$part_meta])* pub $part: $part_type, )+ )?
        }

        impl $sheet {
            /// No errors; times, pulses and rates that others refer to are 1.
            #[must_use]
            pub fn none() -> Self {
                let mut sheet = Self {
                    $( $key: 0.0, )*
                    $( $( $part: Default::default(), )+ )?
                };
                for term in <Self as $crate::simulator::imu::term::Datasheet>::TERMS {
                    if term.is_positive() {
                        *term.of(&mut sheet) = 1.0;
                    }
                }
                sheet
            }
        }

        impl $crate::simulator::imu::term::Datasheet for $sheet {
            const NAME: &'static str = $name;
            const TERMS: &'static [Term<Self>] =
                &[$( Term::new(stringify!($key), |s| &mut s.$key, $kind), )*];
        }
    };
}
pub(super) use datasheet;
