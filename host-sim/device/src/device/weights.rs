//! The weight image of a file.

use firmware::model::{IMAGES_LEN, NETS_LEN, Nets};
use host_core::error::Error;
use std::path::Path;

/// Checks that `bytes`, read from `file`, are a weight image of both networks.
///
/// # Errors
/// They have another length or shape, or are damaged.
pub fn check_image(file: &Path, bytes: &[u8]) -> Result<Nets, Error> {
    let refused = |problem: String| Error::Option {
        option: file.display().to_string(),
        problem,
        remedy: "give a file that `device weights get` of this version has written".into(),
    };
    if ![IMAGES_LEN, NETS_LEN].contains(&bytes.len()) {
        let problem = format!(
            "holds {} bytes; a weight image has {IMAGES_LEN}, or {NETS_LEN} without maps",
            bytes.len()
        );
        return Err(refused(problem));
    }
    Nets::from_images(bytes)
        .map_err(|error| refused(format!("is no weight image of these networks ({error:?})")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_whole_image_of_this_shape_passes() {
        let good = super::super::images(&Nets::NONE);
        let check = |bytes: &[u8]| check_image(Path::new("w.bin"), bytes);
        assert!(check(&good).is_ok() && check(&good[..NETS_LEN]).is_ok());
        let short = check(&good[1..]).expect_err("too short").to_string();
        assert!(short.starts_with("w.bin: holds 683 bytes"), "{short}");
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 1;
            assert!(check(&bad).is_err(), "byte {at}");
        }
    }
}
