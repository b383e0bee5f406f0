//! The pair of networks, and its weight image: the bytes by which weights are sent and stored.
//!
//! The image of the pair is the gyro network's image followed by the accelerometer network's, each
//! in the format of [`lrnn_nostd::image`].

use lrnn_nostd::image::{self, IMAGE_LEN, ImageError};
use lrnn_nostd::{Net, Normalisation, Weights};

/// Bytes of the pair's weight image.
pub const IMAGES_LEN: usize = 2 * IMAGE_LEN;

/// The gyro network and the accelerometer network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nets {
    /// Rate in rad/s to rate error in rad/s.
    pub gyro: Net,
    /// Specific force in m/s2 to its error in m/s2.
    pub accel: Net,
}

impl Nets {
    /// Networks whose output is zero for every input: the built-in fallback.
    pub const NONE: Nets = {
        let net = Net::new(Weights::zero(), Normalisation::identity());
        Nets {
            gyro: net,
            accel: net,
        }
    };

    /// Both networks of a weight image.
    ///
    /// # Errors
    /// What is wrong with the first bad image; a wrong length counts as one.
    pub fn from_images(images: &[u8]) -> Result<Nets, ImageError> {
        let (gyro, accel) = images.split_at_checked(IMAGE_LEN).unwrap_or((images, &[]));
        Ok(Nets {
            gyro: image::decode(gyro)?,
            accel: image::decode(accel)?,
        })
    }

    /// Copies the weight image from byte `start` on into `piece`; bytes beyond the image's end stay
    /// as they are. Only one network's image is on the stack at a time.
    pub fn write_images(&self, start: usize, piece: &mut [u8]) {
        for (number, net) in [&self.gyro, &self.accel].into_iter().enumerate() {
            let (first, end) = (number * IMAGE_LEN, (number + 1) * IMAGE_LEN);
            if start >= end || start.saturating_add(piece.len()) <= first {
                continue;
            }
            let image = image::encode(net);
            for (place, byte) in piece.iter_mut().enumerate() {
                let at = (start + place).wrapping_sub(first);
                if let Some(of_image) = image.get(at) {
                    *byte = *of_image;
                }
            }
        }
    }

    /// Whether both have the same weight image: equality bit for bit, also of values that are not
    /// numbers.
    #[must_use]
    #[inline(never)]
    pub fn same_images(&self, other: &Nets) -> bool {
        image::encode(&self.gyro) == image::encode(&other.gyro)
            && image::encode(&self.accel) == image::encode(&other.accel)
    }
}
