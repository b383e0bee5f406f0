//! The weight image: the round trip is exact, and every kind of damage has its own error.

use lrnn_nostd::image::{IMAGE_LEN, ImageError, crc32, decode, encode};
use lrnn_nostd::{Diagonal, Full, Identity, Net, Normalisation, Rational, Tanh, Weights};
use proptest::prelude::*;

fn net() -> Net {
    let normalisation = Normalisation {
        input_offset: [0.0, 0.1, 9.80665],
        input_scale: [0.5, 1.0, 0.05],
        output_scale: [1e-5, 2e-5, 3e-5],
    };
    Net::new(
        Weights::from_fn(|index| index as f32 - 31.25),
        normalisation,
    )
}

/// The image with some bytes replaced and a correct CRC.
fn altered(at: usize, bytes: &[u8]) -> [u8; IMAGE_LEN] {
    let mut image = encode(&net());
    image[at..at + bytes.len()].copy_from_slice(bytes);
    let crc = crc32(&image[..IMAGE_LEN - 4]);
    image[IMAGE_LEN - 4..].copy_from_slice(&crc.to_le_bytes());
    image
}

fn error(bytes: &[u8]) -> ImageError {
    decode::<Rational, Identity, Full>(bytes).expect_err("must be refused")
}

#[test]
fn layout_as_documented() {
    let image = encode(&net());
    assert_eq!(image.len(), 304);
    assert_eq!(
        image[..12],
        [b'L', b'R', b'N', b'N', 1, 2, 0, 0, 0x30, 1, 0, 0]
    );
    assert_eq!(image[20..24], 9.80665_f32.to_le_bytes());
    assert_eq!(image[36..40], 1e-5_f32.to_le_bytes());
    assert_eq!(image[48..52], (-31.25_f32).to_le_bytes());
    assert_eq!(image[296..300], 30.75_f32.to_le_bytes());
    assert_eq!(image[300..], crc32(&image[..300]).to_le_bytes());
    assert_eq!(
        encode(&Net::<Tanh, Tanh, Diagonal>::new(
            net().weights,
            net().normalisation
        ))[5..8],
        [1, 1, 1]
    );
}

#[test]
fn each_damage_has_its_name() {
    let image = encode(&net());
    assert_eq!(decode(&image), Ok(net()));
    assert_eq!(error(&image[..303]), ImageError::Length(303));
    assert_eq!(error(&[]), ImageError::Length(0));
    assert_eq!(error(&altered(0, b"LRNX")), ImageError::Magic(*b"LRNX"));
    assert_eq!(error(&altered(4, &[2])), ImageError::Version(2));
    assert_eq!(error(&altered(8, &[0x31])), ImageError::LengthField(305));
    assert_eq!(error(&altered(5, &[1])), ImageError::HiddenActivation(1));
    assert_eq!(error(&altered(6, &[2])), ImageError::OutputActivation(2));
    assert_eq!(error(&altered(7, &[1])), ImageError::Feedback(1));
    assert_eq!(
        error(&altered(12 + 4 * 8, &f32::NAN.to_le_bytes())),
        ImageError::NonFiniteScale(8)
    );
    assert_eq!(
        error(&altered(48 + 4 * 62, &f32::INFINITY.to_le_bytes())),
        ImageError::NonFiniteWeight(62)
    );
    assert_eq!(
        error(&altered(48, &f32::NAN.to_le_bytes())),
        ImageError::NonFiniteWeight(0)
    );
    let mut flipped = image;
    flipped[100] ^= 1;
    assert!(matches!(error(&flipped), ImageError::Crc { .. }));
}

#[test]
fn no_flipped_bit_passes() {
    let image = encode(&net());
    for bit in 0..8 * IMAGE_LEN {
        let mut flipped = image;
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(
            decode::<Rational, Identity, Full>(&flipped).is_err(),
            "bit {bit}"
        );
    }
}

#[test]
fn errors_name_the_cause() {
    assert_eq!(
        ImageError::NonFiniteWeight(17).to_string(),
        "weight image: weight 17 is not finite"
    );
    assert_eq!(
        ImageError::Length(5).to_string(),
        "weight image of 5 bytes, expected 304"
    );
    let _: &dyn core::error::Error = &ImageError::Version(3);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trip_is_exact(values in prop::collection::vec(-1e30_f32..1e30, 72)) {
        let triple = |at: usize| [values[at], values[at + 1], values[at + 2]];
        let normalisation = Normalisation { input_offset: triple(63), input_scale: triple(66), output_scale: triple(69) };
        let net = Net::<Tanh, Rational, Diagonal>::new(Weights::from_fn(|index| values[index]), normalisation);
        let image = encode(&net);
        prop_assert_eq!(decode(&image), Ok(net));
        prop_assert_eq!(encode(&decode::<Tanh, Rational, Diagonal>(&image).expect("own image")), image);
    }

    /// Any bytes, with and without a right header and CRC, give a network or an error.
    #[test]
    fn any_bytes(mut bytes in prop::collection::vec(any::<u8>(), 0..400), dressed in any::<bool>()) {
        if dressed {
            bytes.resize(IMAGE_LEN, 0xA5);
            bytes[..12].copy_from_slice(&encode(&net())[..12]);
            let crc = crc32(&bytes[..IMAGE_LEN - 4]);
            bytes[IMAGE_LEN - 4..].copy_from_slice(&crc.to_le_bytes());
        }
        match decode::<Rational, Identity, Full>(&bytes) {
            Ok(net) => prop_assert!(net.weights.is_finite()),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }

    #[test]
    fn crc_is_ieee(bytes in prop::collection::vec(any::<u8>(), 0..1000)) {
        prop_assert_eq!(crc32(&bytes), crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes));
    }
}

#[test]
fn crc_check_value() {
    assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
}
