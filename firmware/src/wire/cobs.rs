//! Consistent overhead byte stuffing (Cheshire and Baker 1999): packets without zeros, so that a
//! zero can end them.
//!
//! The functions of the `cobs` crate, and `postcard`'s COBS and CRC flavours, leave bounds checks
//! in the image, whose panics the release build forbids. So twenty lines are here. The crate is the
//! tests' oracle.

/// Encodes `plain`, puts a zero behind it and returns the length. `None` if `out` is too short: it
/// needs `plain`, one byte for each 254 of it, and the zero.
pub fn encode(plain: &[u8], out: &mut [u8]) -> Option<usize> {
    // `code` at `code_at` counts the bytes up to the zero it stands for
    let (mut code_at, mut code, mut at) = (0, 1u8, 1);
    for &byte in plain {
        if code == 0xFF {
            *out.get_mut(code_at)? = code;
            (code_at, code, at) = (at, 1, at + 1);
        }
        if byte == 0 {
            *out.get_mut(code_at)? = code;
            (code_at, code, at) = (at, 1, at + 1);
        } else {
            *out.get_mut(at)? = byte;
            code += 1;
            at += 1;
        }
    }
    *out.get_mut(code_at)? = code;
    *out.get_mut(at)? = 0;
    Some(at + 1)
}

/// Decodes a packet (without its zero) in place and returns the length. `None` for bytes that no
/// encoder makes.
pub fn decode_in_place(packet: &mut [u8]) -> Option<usize> {
    let (mut from, mut to) = (0, 0);
    loop {
        let code = *packet.get(from).filter(|&&code| code != 0)?;
        from += 1;
        for _ in 1..code {
            let byte = *packet.get(from).filter(|&&byte| byte != 0)?;
            *packet.get_mut(to)? = byte;
            from += 1;
            to += 1;
        }
        if from == packet.len() {
            return Some(to);
        }
        if code != 0xFF {
            *packet.get_mut(to)? = 0;
            to += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Few values and long runs, so that zeros and runs of 254 and more both happen. Not empty:
    /// there the crate writes nothing where the paper has one byte.
    fn plain() -> impl Strategy<Value = Vec<u8>> {
        prop::collection::vec((0..4u8, 1..300usize), 1..6).prop_map(|runs| {
            let runs = runs.into_iter().map(|(byte, len)| vec![byte; len]);
            runs.collect::<Vec<_>>().concat()
        })
    }

    proptest! {
        #[test]
        fn the_crate_reads_and_writes_the_same(plain in plain()) {
            let mut ours = vec![0xEE; plain.len() + plain.len() / 254 + 2];
            let len = encode(&plain, &mut ours).unwrap();
            prop_assert_eq!(ours[len - 1], 0);
            prop_assert!(!ours[..len - 1].contains(&0));
            let theirs = ::cobs::decode_vec(&ours[..len - 1]).unwrap();
            prop_assert_eq!(&theirs, &plain);

            let mut theirs = ::cobs::encode_vec(&plain);
            let len = decode_in_place(&mut theirs).unwrap();
            prop_assert_eq!(&theirs[..len], &plain[..]);
        }

        #[test]
        fn any_bytes_are_answered(mut bytes in prop::collection::vec(0..5u8, 0..40)) {
            if let Some(len) = decode_in_place(&mut bytes) {
                prop_assert!(len < bytes.len());
            }
        }
    }

    #[test]
    fn a_short_buffer_is_refused() {
        for len in 0..6 {
            assert_eq!(encode(&[1, 0, 2, 3], &mut [0; 6][..len]), None);
        }
        let mut out = [0; 6];
        assert_eq!(encode(&[1, 0, 2, 3], &mut out), Some(6));
        assert_eq!(out, [2, 1, 3, 2, 3, 0]);
        assert_eq!(decode_in_place(&mut []), None);
    }
}
