//! The weight image of a file.

use firmware::configuration::Configuration;
use firmware::model::{IMAGES_LEN, NETS_LEN, Nets};
use host_core::error::Error;
use lrnn_nostd::{Net, Normalisation, Weights};
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
    Nets::from_images(bytes).map_err(|error| {
        refused(format!(
            "is not a weight image of these networks ({error:?})"
        ))
    })
}

/// Networks that subtract maps and biases of gyros and accelerometers from the samples z, so that
/// `z - M z - b` is left. SI.
#[must_use]
pub fn calibrated(maps: [[[f64; 3]; 3]; 2], biases: [[f64; 3]; 2]) -> Nets {
    let [gyro, accel] = biases.map(|bias| {
        let largest = bias.iter().fold(0.0, |most: f64, b| most.max(b.abs()));
        let output = if largest > 0.0 { largest } else { 1.0 };
        let mut weights = Weights::<f64>::zero();
        let [.., top] = &mut weights.layers;
        top.b = bias.map(|b| b / output);
        let normalisation = Normalisation {
            output_scale: [output as f32; 3],
            ..Normalisation::identity()
        };
        Net::new(weights.cast(), normalisation)
    });
    Nets {
        gyro,
        accel,
        maps: maps.map(|map| map.map(|row| row.map(|x| x as f32))),
    }
}

/// What a device with this configuration would not subtract in full, and the field that limits it.
#[must_use]
pub fn clipped(nets: &Nets, configuration: &Configuration) -> Vec<(&'static str, f64)> {
    let limits = [
        configuration.correction.limit.gyro,
        configuration.correction.limit.accel,
    ];
    let triads = [&configuration.gyro, &configuration.accel];
    let biases = [nets.gyro.initial_output(), nets.accel.initial_output()];
    let keys = [
        ["gyro.bias_turn_on_dph", "gyro.scale_ppm"],
        ["accel.bias_turn_on_ug", "accel.scale_ppm"],
    ];
    let largest = |of: &[f32]| of.iter().fold(0.0, |most: f32, x| most.max(x.abs()));
    let mut found = vec![];
    for i in 0..2 {
        let most = SIGMAS * triads[i].scale.max(triads[i].misalignment);
        let parts = [
            (largest(&biases[i]), limits[i]),
            (largest(nets.maps[i].as_flattened()), most),
        ];
        for (key, (needed, limit)) in keys[i].into_iter().zip(parts) {
            if needed > limit {
                found.push((key, f64::from(needed / limit)));
            }
        }
    }
    found
}

/// Standard deviations of the datasheet that an element of a map may have on the device.
const SIGMAS: f32 = 3.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_is_what_the_networks_give_and_limits_are_named() {
        let mut maps = [[[0.0; 3]; 3]; 2];
        maps[1][0] = [0.02, -0.004, 0.001];
        let nets = calibrated(maps, [[0.0; 3], [0.3, -0.1, 0.02]]);
        let image = super::super::images(&nets);
        let back = check_image(Path::new("w.bin"), &image).unwrap();
        assert_eq!(back.maps[1][0], [0.02, -0.004, 0.001]);
        for (found, want) in back.accel.initial_output().iter().zip([0.3, -0.1, 0.02]) {
            assert!((found - want).abs() < 1e-7, "{found}");
        }
        assert_eq!(back.gyro.initial_output(), [0.0; 3]);
        let unit = host_unit::Unit::preset("stim300").unwrap();
        let clipped = clipped(&back, &unit.configuration().unwrap());
        let keys: Vec<_> = clipped.iter().map(|(key, _)| *key).collect();
        assert_eq!(keys, ["accel.bias_turn_on_ug", "accel.scale_ppm"]);
        // 0.3 m/s2 against three times 2200 ug, 2 % against three times 1 mrad
        assert!((clipped[0].1 / 4.635 - 1.0).abs() < 0.01, "{clipped:?}");
        assert!((clipped[1].1 / 6.67 - 1.0).abs() < 0.01, "{clipped:?}");
    }

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
