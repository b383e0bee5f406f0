//! The weight image: a network as bytes, for storage and transfer.
//!
//! Little-endian, 304 bytes:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 4 | magic `LRNN` |
//! | 4 | 1 | version of this format, 1 |
//! | 5 | 1 | hidden [`Activation::CODE`]: 0 identity, 1 tanh, 2 rational, 3 cubics, 4 `micromath` |
//! | 6 | 1 | output activation, likewise |
//! | 7 | 1 | feedback ([`Feedback::CODE`]): 0 full, 1 diagonal |
//! | 8 | 4 | total length, u32: 304 |
//! | 12 | 36 | input_offset, input_scale, output_scale: 9 f32 |
//! | 48 | 252 | weights in the order of [`crate::shape`]: 63 f32 |
//! | 300 | 4 | CRC-32 of bytes 0..300 ([`crc32`]), u32 |

use core::fmt;

use crate::activation::Activation;
use crate::infer::Net;
use crate::normalisation::Normalisation;
use crate::shape::{Feedback, NEURONS, PARAMS};
use crate::weights::Weights;

/// Length of an image in bytes.
pub const IMAGE_LEN: usize = HEADER_LEN + 4 * VALUES + 4;

const MAGIC: [u8; 4] = *b"LRNN";
/// Version of this format.
pub const VERSION: u8 = 1;
const HEADER_LEN: usize = 12;
/// Normalisation and weights.
const VALUES: usize = 9 + PARAMS;

/// Why bytes are not an image of the expected network. The conditions are checked in this order.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ImageError {
    /// The image has this many bytes instead of 304.
    Length(usize),
    /// The first four bytes are not `LRNN`.
    Magic([u8; 4]),
    /// An unknown version of the format.
    Version(u8),
    /// The length field is not 304.
    LengthField(u32),
    /// The bytes are damaged.
    Crc {
        /// The CRC in the image.
        stored: u32,
        /// The CRC of its bytes.
        computed: u32,
    },
    /// The hidden activation is not that of the expected network.
    HiddenActivation(u8),
    /// The output activation is not that of the expected network.
    OutputActivation(u8),
    /// The feedback is not that of the expected network.
    Feedback(u8),
    /// A scale of the normalisation is infinite or NaN. Indices: 0..3 input_offset, 3..6
    /// input_scale, 6..9 output_scale.
    NonFiniteScale(u8),
    /// The weight with this index is infinite or NaN.
    NonFiniteWeight(u8),
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Length(len) => write!(f, "weight image of {len} bytes, expected {IMAGE_LEN}"),
            Self::Magic(magic) => write!(f, "not a weight image: magic {magic:02x?}"),
            Self::Version(version) => {
                write!(f, "weight image of version {version}, expected {VERSION}")
            }
            Self::LengthField(len) => write!(
                f,
                "weight image says its length is {len}, expected {IMAGE_LEN}"
            ),
            Self::Crc { stored, computed } => write!(
                f,
                "weight image damaged: CRC {computed:08x}, stored {stored:08x}"
            ),
            Self::HiddenActivation(code) => write!(
                f,
                "weight image for another hidden activation (code {code})"
            ),
            Self::OutputActivation(code) => write!(
                f,
                "weight image for another output activation (code {code})"
            ),
            Self::Feedback(code) => {
                write!(f, "weight image for another kind of feedback (code {code})")
            }
            Self::NonFiniteScale(index) => write!(
                f,
                "weight image: scale {index} of the normalisation is not finite"
            ),
            Self::NonFiniteWeight(index) => write!(f, "weight image: weight {index} is not finite"),
        }
    }
}

impl core::error::Error for ImageError {}

/// The image of a network. Non-finite values are encoded unchanged; [`decode`] rejects them.
///
/// ```
/// use lrnn_nostd::image::{IMAGE_LEN, ImageError, decode, encode};
/// use lrnn_nostd::{Full, Identity, Net, Normalisation, Rational, Tanh, Weights};
///
/// let net: Net = Net::new(Weights::from_fn(|i| 0.01 * i as f32), Normalisation::identity());
/// let mut bytes = encode(&net);
/// assert_eq!(bytes.len(), IMAGE_LEN);
/// assert_eq!(decode::<Rational, Identity, Full>(&bytes), Ok(net));
/// // Of another kind, or damaged.
/// let other = decode::<Tanh, Identity, Full>(&bytes);
/// assert_eq!(other, Err(ImageError::HiddenActivation(2)));
/// bytes[100] ^= 1;
/// let damaged = decode::<Rational, Identity, Full>(&bytes);
/// assert!(matches!(damaged, Err(ImageError::Crc { .. })));
/// ```
pub fn encode<H: Activation, O: Activation, F: Feedback>(net: &Net<H, O, F>) -> [u8; IMAGE_LEN] {
    let mut image = [0; IMAGE_LEN];
    let scales = [
        net.normalisation.input_offset,
        net.normalisation.input_scale,
        net.normalisation.output_scale,
    ];
    let values = scales
        .as_flattened()
        .iter()
        .copied()
        .chain(net.weights.iter());
    let header = [
        MAGIC,
        [VERSION, H::CODE, O::CODE, F::CODE],
        (IMAGE_LEN as u32).to_le_bytes(),
    ];
    let words = header.into_iter().chain(values.map(f32::to_le_bytes));
    for (place, word) in image.as_chunks_mut::<4>().0.iter_mut().zip(words) {
        *place = word;
    }
    let [covered @ .., a, b, c, d] = &mut image;
    [*a, *b, *c, *d] = crc32(covered).to_le_bytes();
    image
}

/// Decodes an image of the expected kind of network; [`encode`] has an example.
///
/// # Errors
/// The first condition of [`ImageError`] that holds.
pub fn decode<H: Activation, O: Activation, F: Feedback>(
    bytes: &[u8],
) -> Result<Net<H, O, F>, ImageError> {
    let image: &[u8; IMAGE_LEN] = bytes
        .try_into()
        .map_err(|_| ImageError::Length(bytes.len()))?;
    let [magic, kinds, length, values @ .., stored] = image.as_chunks::<4>().0 else {
        return Err(ImageError::Length(bytes.len()));
    };
    let [version, hidden, output, feedback] = *kinds;
    let length = u32::from_le_bytes(*length);
    let stored = u32::from_le_bytes(*stored);
    let [covered @ .., _, _, _, _] = image;
    let computed = crc32(covered);
    if *magic != MAGIC {
        return Err(ImageError::Magic(*magic));
    } else if version != VERSION {
        return Err(ImageError::Version(version));
    } else if length != IMAGE_LEN as u32 {
        return Err(ImageError::LengthField(length));
    } else if stored != computed {
        return Err(ImageError::Crc { stored, computed });
    } else if hidden != H::CODE {
        return Err(ImageError::HiddenActivation(hidden));
    } else if output != O::CODE {
        return Err(ImageError::OutputActivation(output));
    } else if feedback != F::CODE {
        return Err(ImageError::Feedback(feedback));
    }
    let mut values = values.iter().map(|&word| f32::from_le_bytes(word));
    let mut scales = [[0.0; NEURONS]; 3];
    for (index, (scale, value)) in
        (0..).zip(scales.as_flattened_mut().iter_mut().zip(values.by_ref()))
    {
        *scale = finite(value).ok_or(ImageError::NonFiniteScale(index))?;
    }
    let mut weights = Weights::zero();
    for (index, (weight, value)) in (0..).zip(weights.iter_mut().zip(values)) {
        *weight = finite(value).ok_or(ImageError::NonFiniteWeight(index))?;
    }
    let [input_offset, input_scale, output_scale] = scales;
    Ok(Net::new(
        weights,
        Normalisation {
            input_offset,
            input_scale,
            output_scale,
        },
    ))
}

fn finite(value: f32) -> Option<f32> {
    value.is_finite().then_some(value)
}

/// CRC-32 (IEEE 802.3): polynomial 0x04C11DB7 reflected, initial value and final exclusive-or
/// 0xFFFFFFFF.
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc: u32 = !0;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..2 {
            crc = (crc >> 4) ^ NIBBLES[(crc & 15) as usize];
        }
    }
    !crc
}

/// Effect of four bits on the CRC.
const NIBBLES: [u32; 16] = {
    let mut table = [0; 16];
    let mut value = 0;
    while value < 16 {
        let (mut crc, mut bit) = (value as u32, 0);
        while bit < 4 {
            crc = (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
            bit += 1;
        }
        table[value] = crc;
        value += 1;
    }
    table
};
