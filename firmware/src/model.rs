//! The pair of networks, and its weight image: the bytes by which weights are sent and stored.
//!
//! The image of the pair is the gyro network's image followed by the accelerometer network's, each
//! in the format of [`lrnn_nostd::image`], and by the maps: 18 f32, little endian, and their
//! CRC-32. An image without maps is read too: they are zero.

use lrnn_nostd::image::{self, IMAGE_LEN, ImageError, crc32};
use lrnn_nostd::learn::kalman::{Maps, PROPORTIONAL};
use lrnn_nostd::{Net, Normalisation, Weights};

/// Bytes of the pair's weight image.
pub const IMAGES_LEN: usize = NETS_LEN + MAPS_LEN;
/// Bytes of an image without maps.
pub const NETS_LEN: usize = 2 * IMAGE_LEN;
const MAPS_LEN: usize = 4 * PROPORTIONAL + 4;

/// The gyro network, the accelerometer network, and what both triads' errors are in proportion to
/// their samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nets {
    /// Rate in rad/s to rate error in rad/s.
    pub gyro: Net,
    /// Specific force in m/s2 to its error in m/s2.
    pub accel: Net,
    /// Errors in proportion to each sample, gyros and accelerometers, axis by cause, as ratios.
    pub maps: Maps<f32>,
}

impl Nets {
    /// Networks whose output is zero for every input: the built-in fallback.
    pub const NONE: Nets = {
        let net = Net::new(Weights::zero(), Normalisation::identity());
        Nets {
            gyro: net,
            accel: net,
            maps: [[[0.0; 3]; 3]; 2],
        }
    };

    /// Both networks of a weight image.
    ///
    /// # Errors
    /// What is wrong with the first bad image; a wrong length counts as one.
    pub fn from_images(images: &[u8]) -> Result<Nets, ImageError> {
        let (nets, maps) = images.split_at_checked(NETS_LEN).unwrap_or((images, &[]));
        let (gyro, accel) = nets.split_at_checked(IMAGE_LEN).unwrap_or((nets, &[]));
        Ok(Nets {
            gyro: image::decode(gyro)?,
            accel: image::decode(accel)?,
            maps: read_maps(maps)?,
        })
    }

    /// Copies the weight image from byte `start` on into `piece`; bytes beyond the image's end stay
    /// as they are. Only one network's image is on the stack at a time.
    pub fn write_images(&self, start: usize, piece: &mut [u8]) {
        for (number, net) in [&self.gyro, &self.accel].into_iter().enumerate() {
            let (first, end) = (number * IMAGE_LEN, (number + 1) * IMAGE_LEN);
            if start < end && start.saturating_add(piece.len()) > first {
                put(&image::encode(net), first, start, piece);
            }
        }
        put(&self.maps_image(), NETS_LEN, start, piece);
    }

    fn maps_image(&self) -> [u8; MAPS_LEN] {
        let mut image = [0; MAPS_LEN];
        let (values, sum) = image.split_at_mut(MAPS_LEN - 4);
        let maps = self.maps.as_flattened().as_flattened();
        for (place, value) in values.chunks_exact_mut(4).zip(maps) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        sum.copy_from_slice(&crc32(values).to_le_bytes());
        image
    }

    /// Whether both have the same weight image: equality bit for bit, also of values that are not
    /// numbers.
    #[must_use]
    #[inline(never)]
    pub fn same_images(&self, other: &Nets) -> bool {
        image::encode(&self.gyro) == image::encode(&other.gyro)
            && image::encode(&self.accel) == image::encode(&other.accel)
            && self.maps_image() == other.maps_image()
    }
}

/// Copies the bytes of `image`, which begins at byte `first` of the whole, into the `piece` of the
/// whole that begins at `start`.
fn put(image: &[u8], first: usize, start: usize, piece: &mut [u8]) {
    for (place, byte) in piece.iter_mut().enumerate() {
        let at = (start + place).wrapping_sub(first);
        if let Some(of_image) = image.get(at) {
            *byte = *of_image;
        }
    }
}

/// Largest element of a map.
const LARGEST: f32 = 0.2;

fn read_maps(bytes: &[u8]) -> Result<Maps<f32>, ImageError> {
    let mut maps = Nets::NONE.maps;
    if bytes.is_empty() {
        return Ok(maps);
    }
    let Some((values, sum)) = bytes
        .split_last_chunk::<4>()
        .filter(|_| bytes.len() == MAPS_LEN)
    else {
        return Err(ImageError::Length(bytes.len()));
    };
    let (stored, computed) = (u32::from_le_bytes(*sum), crc32(values));
    if stored != computed {
        return Err(ImageError::Crc { stored, computed });
    }
    let elements = maps.as_flattened_mut().as_flattened_mut();
    let words = values.as_chunks::<4>().0;
    for (i, (element, word)) in elements.iter_mut().zip(words).enumerate() {
        *element = f32::from_le_bytes(*word);
        if element.is_nan() || element.abs() > LARGEST {
            return Err(ImageError::NonFiniteWeight(i as u8)); // below 18
        }
    }
    Ok(maps)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_maps() -> Nets {
        let mut nets = Nets::NONE;
        for (i, element) in nets
            .maps
            .as_flattened_mut()
            .as_flattened_mut()
            .iter_mut()
            .enumerate()
        {
            *element = 1e-3 * (i as f32 - 8.0);
        }
        nets
    }

    /// Whatever pieces an image is written in, it is read as it was; without its last part it has
    /// no maps.
    #[test]
    fn an_image_holds_both_networks_and_the_maps() {
        let nets = with_maps();
        for piece in [1, 7, 64, IMAGES_LEN] {
            let mut image = [0; IMAGES_LEN];
            for (at, piece) in (0..).step_by(piece).zip(image.chunks_mut(piece)) {
                nets.write_images(at, piece);
            }
            assert_eq!(Nets::from_images(&image), Ok(nets));
            assert_eq!(Nets::from_images(&image[..NETS_LEN]), Ok(Nets::NONE));
        }
        assert!(!nets.same_images(&Nets::NONE) && nets.same_images(&with_maps()));
    }

    #[test]
    fn damaged_maps_are_found() {
        let mut image = [0; IMAGES_LEN];
        with_maps().write_images(0, &mut image);
        for at in NETS_LEN..IMAGES_LEN {
            image[at] ^= 4;
            let found = Nets::from_images(&image);
            assert!(matches!(found, Err(ImageError::Crc { .. })), "{at}");
            image[at] ^= 4;
        }
        for short in [NETS_LEN + 1, IMAGES_LEN - 1] {
            let found = Nets::from_images(&image[..short]);
            assert_eq!(found, Err(ImageError::Length(short - NETS_LEN)));
        }
        for wild in [f32::NAN, f32::INFINITY, -0.21] {
            let mut nets = with_maps();
            nets.maps[1][0][2] = wild;
            nets.write_images(0, &mut image);
            assert_eq!(
                Nets::from_images(&image),
                Err(ImageError::NonFiniteWeight(11))
            );
        }
    }
}
