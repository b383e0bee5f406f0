//! Any bytes as a weight image, also with a right frame around them: what decodes encodes to the
//! same bytes, and a network of any finite weights steps without a value that is not finite.
//! Two networks without maps encode with maps of zero.

use firmware::model::{IMAGES_LEN, NETS_LEN, Nets};
use lrnn_nostd::image::{IMAGE_LEN, decode, encode};
use lrnn_nostd::{Net, State};

/// A valid frame around bytes that may be weights.
fn framed(input: &[u8]) -> Vec<u8> {
    let mut image = input.to_vec();
    image.resize(IMAGE_LEN, 0);
    image[..5].copy_from_slice(b"LRNN\x01");
    image[8..12].copy_from_slice(&(IMAGE_LEN as u32).to_le_bytes());
    let crc = crate::crc32(&image[..IMAGE_LEN - 4]);
    image[IMAGE_LEN - 4..].copy_from_slice(&crc.to_le_bytes());
    image
}

fn check(image: &[u8]) -> bool {
    let net: Net = match decode(image) {
        Ok(net) => net,
        Err(error) => return crate::refused(&error),
    };
    assert_eq!(encode(&net)[..], *image);
    let mut state = State::new();
    for input in [
        [0.0; 3],
        [1.0, -1.0, 1e30],
        [f32::NAN; 3],
        [f32::MAX; 3],
        [1e-40; 3],
    ] {
        let step = net.step(&mut state, input);
        let values = step.output.iter().chain(&step.error);
        assert!(values.copied().all(f32::is_finite), "{step:?}");
    }
    true
}

fn encodes_alike(images: &[u8]) {
    let Ok(nets) = Nets::from_images(images) else {
        return;
    };
    let mut again = vec![0; IMAGES_LEN];
    nets.write_images(0, &mut again);
    assert_eq!(again[..images.len()], *images);
    assert!(images.len() > NETS_LEN || nets.maps == Nets::NONE.maps);
}

/// Whether the weights were accepted.
pub fn run(input: &[u8]) -> bool {
    check(input);
    let first = framed(input);
    let reached = check(&first);
    let second = framed(input.get(IMAGE_LEN..).unwrap_or_default());
    let mut images = [first, second].concat();
    encodes_alike(&images);
    let mut maps = input.to_vec();
    maps.resize(IMAGES_LEN - NETS_LEN - 4, 0);
    images.extend(&maps);
    images.extend(crate::crc32(&maps).to_le_bytes());
    encodes_alike(&images);
    let _ = Nets::from_images(input);
    reached
}
