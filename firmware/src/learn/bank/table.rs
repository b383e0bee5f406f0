//! The hypotheses, one row each. Their memory, their names and all loops over them follow from this
//! table, so that a new hypothesis is a new row.

use super::hypothesis::Hypothesis;
use crate::learn::prior::{Datasheet, Layers, LearnerNet, NAV, Shapes, weights};
use lrnn_nostd::learn::kalman::{
    FixedWeights, Kalman, Maps, NoParameters, OutputWeights, ParameterSet, Prior, TRIADS,
    UnitBiases, UnitMap, UnitOutput,
};
use lrnn_nostd::{Net, Rational, Real};

/// The filter of a hypothesis with `N` parameters, whose packed covariance has `PACKED` elements.
type Filter<L, const N: usize, const PACKED: usize, T> = Kalman<L, NAV, N, PACKED, Rational, T>;

/// Networks that a hypothesis begins with: see [`Layers`].
enum StartingNetworks {
    Time,
    Driven,
    Curved,
}

macro_rules! hypotheses {
    ($(
        $slot:ident: $learnt:ty, $parameters:literal, $shape:ident $output:literal, $key:literal,
            $name:literal;
    )+) => {
        /// Number of hypotheses.
        pub const HYPOTHESES: usize = NAMES.len();
        /// Their names in reports.
        pub const NAMES: [&str; [$($name),+].len()] = [$($name),+];
        /// Their names as keys, for options and tables.
        pub const KEYS: [&str; HYPOTHESES] = [$($key),+];

        /// Hypotheses with networks, one bit each.
        pub const WITH_NETWORKS: u8 = bits(&[$($output),+]);

        /// The filters of all hypotheses.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Hypotheses<T: Real> {
            $($slot: Filter<$learnt, $parameters, { $parameters * ($parameters + 1) / 2 }, T>,)+
        }

        impl<T: Real> Hypotheses<T> {
            /// To be begun.
            pub const ZEROED: Self = Self { $($slot: Kalman::ZEROED,)+ };

            /// Restarts those in the bits `which`, in place: they should not move over the stack.
            pub fn begin(
                &mut self,
                which: u8,
                (sheet, shapes, block_s): (&Datasheet<T>, &Shapes<T>, f64),
                error_sigma: [T; NAV],
                error_floor: [T; NAV],
            ) {
                let [first, of_time] = weights(block_s, 1.0);
                let time = sheet.normalisation().map(|scales| Net::new(first, scales));
                let Shapes { driven, curved, .. } = shapes;
                let [of_driven, of_curved] = shapes.reaches();
                let mut bits = which;
                $(
                    if bits & 1 == 1 {
                        let (nets, layers) = match StartingNetworks::$shape {
                            StartingNetworks::Time => (&time, Layers::Time(&of_time)),
                            StartingNetworks::Driven => (driven, Layers::Driven(driven, of_driven)),
                            StartingNetworks::Curved => (curved, Layers::Driven(curved, of_curved)),
                        };
                        begin(&mut self.$slot, nets, || {
                            sheet.prior::<$learnt, $parameters>(
                                layers,
                                $output,
                                error_sigma,
                                error_floor,
                            )
                        });
                    }
                    bits >>= 1;
                )+
                let _ = bits;
            }

            /// Gives [`REMEMBERING`] what is known of the unit. False: a value cannot be, and those
            /// that it belongs to stay as they were.
            pub fn recall(&mut self, values: &[T], ages: T, has_map: bool) -> bool {
                let [of_biases, of_driven, of_curved, _] = REMEMBERED;
                let Some((biases, rest)) = values.split_at_checked(of_biases) else {
                    return false;
                };
                let Some((driven, rest)) = rest.split_at_checked(of_driven) else {
                    return false;
                };
                let Some((curved, map)) = rest.split_at_checked(of_curved) else {
                    return false;
                };
                let stepped = ages + T::from_f64(STEP * STEP);
                self.driven.recall(driven.iter().copied(), ages)
                    && self.curved.recall(curved.iter().copied(), ages)
                    && (!has_map || self.map.recall(map.iter().copied(), ages))
                    && self.biases.recall(biases.iter().copied(), ages)
                    && self.stepped.recall(biases.iter().copied(), stepped)
            }

            /// Begins the one that believes these networks and maps.
            pub fn begin_stored(
                &mut self,
                nets: &[LearnerNet<T>; TRIADS],
                maps: &Maps<T>,
                prior: impl FnOnce() -> Prior<NAV, 0, T>,
            ) {
                self.stored.init(nets, &prior());
                self.stored.set_maps(maps);
            }

            /// One of them; the zero correction for a number that is none.
            pub fn get(&self, index: usize) -> &dyn Hypothesis<T> {
                let all: [&dyn Hypothesis<T>; HYPOTHESES] = [$(&self.$slot),+];
                all.get(index).copied().unwrap_or(&self.zero_correction)
            }

            /// Those whose bit is set.
            pub fn each_of(&mut self, bits: u8, mut act: impl FnMut(&mut dyn Hypothesis<T>)) {
                let all: [&mut dyn Hypothesis<T>; HYPOTHESES] = [$(&mut self.$slot),+];
                for (index, hypothesis) in all.into_iter().enumerate() {
                    if bits >> index & 1 == 1 {
                        act(hypothesis);
                    }
                }
            }
        }
    };
}

// Slot; what is learnt, and the number of its parameters (biases and weights); what the hidden
// layers are; greatest contribution of the networks, in units of the bias; key; name. The first
// believes the sensors.
hypotheses! {
    zero_correction: NoParameters, 0, Time 0.0, "zero-correction", "zero correction";
    biases: UnitBiases, 12, Driven 0.0, "biases", "biases";
    output: OutputWeights, 24, Time 0.3, "output", "output weights, by time";
    stepped: UnitBiases, 12, Driven 0.0, "stepped", "biases, stepped since the last drive";
    driven: UnitOutput, 30, Driven 0.5, "driven", "output layer, by the inputs";
    curved: UnitOutput, 30, Curved 5.0, "curved", "output layer, by a curve of temperature";
    stored: FixedWeights, 0, Time 0.0, "stored", "stored networks";
    map: UnitMap, 30, Driven 0.0, "map", "biases and a map";
}

/// Values that each of [`REMEMBERING`] remembers over power-off.
pub const REMEMBERED: [usize; 4] = {
    let layer = Filter::<UnitOutput, 30, 465, f32>::REMEMBERED;
    [
        Filter::<UnitBiases, 12, 78, f32>::REMEMBERED,
        layer,
        layer,
        Filter::<UnitMap, 30, 465, f32>::REMEMBERED,
    ]
};

/// Begins one of them. By itself, so that the stack holds one prior at a time.
#[inline(never)]
fn begin<L: ParameterSet, const N: usize, const PACKED: usize, T: Real>(
    filter: &mut Filter<L, N, PACKED, T>,
    nets: &[LearnerNet<T>; TRIADS],
    prior: impl FnOnce() -> Prior<NAV, N, T>,
) {
    filter.init(nets, &prior());
}

/// One bit for each value above zero.
const fn bits(values: &[f64]) -> u8 {
    let (mut bits, mut index) = (0, 0);
    while index < values.len() {
        if values[index] > 0.0 {
            bits |= 1 << index;
        }
        index += 1;
    }
    bits
}

/// The hypothesis that believes the sensors.
pub const ZERO_CORRECTION: usize = 0;

/// The hypothesis that knows six biases and nothing else: those of the unit, and what is new in
/// them at this turn-on.
pub const SIX_BIASES: usize = 1;

/// The same, for a unit whose biases have stepped since the last drive, by [`STEP`] of the
/// datasheet's. Before the first fix it has the odds [`STEPS`].
pub const STEPPED: usize = 3;

/// Standard deviation of a step of a bias between two drives, as a share of the datasheet's. (Of
/// five units of one type, four stepped at once, by 0.12 to 0.2 of it, on different axes.)
pub const STEP: f64 = 0.2;

/// Odds that the biases have stepped between two drives: one to nine (assumed).
pub const STEPS: f64 = 1.0 / 9.0;

/// The hypothesis that knows the biases and the maps of both triads.
pub const MAP: usize = 7;

/// The hypothesis whose networks are driven by their inputs: the output layer belongs to the unit,
/// and six biases to this turn-on.
pub const DRIVEN: usize = 4;

/// The same with a curve of the temperature and a wide prior: where temperature rules. It takes
/// part where a network has that input.
pub const CURVED: usize = 5;

/// Hypotheses that remember the unit over power-off. What the others know is of this turn-on.
pub const REMEMBERING: [usize; 4] = [SIX_BIASES, DRIVEN, CURVED, MAP];

/// Hypotheses that extend the six biases, one bit each: they must not be worse than these.
pub const EXTENDING: u8 = 1 << MAP | 1 << DRIVEN | 1 << CURVED;

/// Hypotheses whose networks begin in the steady state of their inputs, one bit each.
pub const SETTLING: u8 = 1 << DRIVEN | 1 << CURVED | 1 << STORED;

/// The hypothesis that believes the networks that were stored: they correct this drive, and learn
/// nothing. It takes part when there are any.
pub const STORED: usize = 6;

/// All hypotheses, one bit each.
pub const ALL: u8 = u8::MAX >> (u8::BITS as usize - HYPOTHESES);
