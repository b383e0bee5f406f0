//! Presets and files: every number has a unit, a source and a range.

use super::spec::*;

/// Endings of a name that give its unit.
const UNITS: &[&str] = &[
    "_hz",
    "_dph",
    "_s",
    "_dphpsqrth",
    "_dpsqrth",
    "_ppm",
    "_dps",
    "_arcsec",
    "_dphpk",
    "_dphpk2",
    "_dphpkpmin",
    "_dphpk2pmin",
    "_dphpgauss",
    "_ug",
    "_ugpsqrth",
    "_ugpsqrthz",
    "_ugpg2",
    "_ratio",
    "_mm",
    "_ugpk",
    "_ugpk2",
    "_ugpkpmin",
    "_ugpk2pmin",
    "_ugs",
    "_k",
    "_kph",
    "_dphpg",
    "_dphpg2",
    "_ppmpk",
    "_dphpsqrtyr",
    "_ugpsqrtyr",
    "_jpk",
    "_w",
    "_wpk",
];

fn names(table: &toml::Table, into: &mut Vec<String>) {
    for (name, value) in table {
        match value {
            toml::Value::Table(inner) => names(inner, into),
            _ => into.push(name.clone()),
        }
    }
}

/// The table `[simulation]` of a unit file as a file of its own.
fn simulation(text: &str) -> String {
    let (_, text) = text.split_once("\n[simulation]\n").unwrap();
    text.replace("[simulation.", "[")
}

#[test]
fn every_preset_gives_every_number_with_its_source() {
    for (preset, text) in PRESETS {
        let spec = ImuSpec::preset(preset).unwrap_or_else(|| panic!("{preset}"));
        let text = simulation(text);
        spec.check().unwrap();
        let mut all = vec![];
        names(&toml::Table::try_from(&spec).unwrap(), &mut all);
        let lines: Vec<&str> = text.lines().filter(|line| line.contains(" = ")).collect();
        // fog and mems leave out what is off
        let left_out = all.len().saturating_sub(lines.len());
        let may = matches!(preset, "fog" | "mems");
        assert!(
            lines.len() <= all.len() && (left_out == 0 || may),
            "{preset}: {left_out} numbers of the spec are not given, or some twice"
        );
        for line in lines {
            let (name, value) = line.split_once(" = ").unwrap();
            let is_number = !value.starts_with("true");
            assert!(
                !is_number || UNITS.iter().any(|unit| name.ends_with(unit)),
                "{preset}: no unit: {line}"
            );
            let why = line.split_once("# ").map_or("", |(_, comment)| comment);
            let because = why
                .strip_prefix("assumed")
                .or_else(|| why.strip_prefix("source: ").filter(|rest| rest.len() > 5));
            assert!(
                because.is_some(),
                "{preset}: neither source nor assumed: {line}"
            );
        }
    }
    assert!(ImuSpec::preset("no such").is_none());
}

#[test]
fn a_file_from_before_a_cause_was_modelled_has_it_off() {
    let new = [
        "rate_random_walk",
        "nonlinearity",
        "temperature",
        "heating",
        "gradient",
        "magnetic",
        "acceleration_random",
        "cross_coupling",
        "vibration",
        "size_effect",
        "delay",
    ];
    let text = simulation(PRESETS[0].1);
    let text = text.split("[gyro.dither]").next().unwrap(); // dither and block come last
    let old: String = text
        .lines()
        .filter(|line| !new.iter().any(|name| line.starts_with(name)))
        .map(|l| format!("{l}\n"))
        .collect();
    let spec: ImuSpec = toml::from_str(&old).unwrap();
    spec.check().unwrap();
    let (g, a) = (&spec.gyro, &spec.accel);
    let off = [
        g.rate_random_walk_dphpsqrth,
        g.nonlinearity_ppm,
        g.temperature_dphpk,
        g.gradient_dphpk,
        g.magnetic_dphpgauss,
        g.dither.lock_in_dph,
        g.dither.strip_residual_arcsec,
        a.acceleration_random_walk_ugpsqrth,
        a.cross_coupling_ugpg2,
        a.vibration_rectification_ugpg2,
        a.size_effect_mm,
        a.delay_s,
        a.temperature_ugpk,
        spec.block.self_heating_k,
    ];
    assert_eq!(off, [0.0; 14]);
    assert_eq!(
        g.total_angle_random_walk_dpsqrth(),
        g.angle_random_walk_dpsqrth
    );
    assert!(toml::from_str::<ImuSpec>(&old.replace("bias_unit_dph", "bias_dph")).is_err());
    assert!(toml::from_str::<ImuSpec>(&format!("{old}\n[gyro.dither]\nlockin = 1.0")).is_err());
}

#[test]
fn out_of_range_is_named() {
    let spoilt = |change: fn(&mut ImuSpec)| {
        let mut spec = ImuSpec::preset("nav").unwrap();
        change(&mut spec);
        spec.check().unwrap_err()
    };
    assert!(spoilt(|s| s.gyro.pulse_arcsec = 0.0).contains("gyro.pulse_arcsec"));
    assert!(spoilt(|s| s.accel.k2_ugpg2 = f64::NAN).contains("accel.k2_ugpg2"));
    assert!(spoilt(|s| s.rate_hz = 0).contains("rate_hz"));
    assert!(spoilt(|s| s.gyro.dither.fringe_arcsec = 0.0).contains("gyro.dither.fringe_arcsec"));
    assert!(spoilt(|s| s.block.ambient_ramp_kph = -1.0).contains("block.ambient_ramp_kph"));
    assert!(spoilt(|s| s.accel.delay_s = 0.2).contains("accel.delay_s = 0.2: must be 0 to 0.1"));
    let regular = spoilt(|s| {
        s.gyro.dither.lock_in_dph = 100.0;
        s.gyro.dither.amplitude_noise_arcsec = 0.0;
    });
    assert!(
        regular.contains("gyro.dither.amplitude_noise_arcsec = 0"),
        "{regular}"
    );
}
