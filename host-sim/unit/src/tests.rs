//! Short files, and what they become.

use super::*;
use firmware::configuration::record::{decode, encode};
use host_core::inertial::units::{DEG_PER_H, UG};

/// The shortest complete file.
pub(super) const SHORT: &str = "\
name = 'short'
[sensor]
format = 'stim300'
[gyro]
bias_turn_on_dph = 10
bias_in_run_dph = 0.5
angle_random_walk_dpsqrth = 0.15
[accel]
bias_turn_on_ug = 2000
bias_in_run_ug = 50
velocity_random_walk_ugpsqrthz = 60
";

#[test]
fn a_short_file_is_a_whole_configuration() {
    let unit: Unit = toml::from_str(SHORT).unwrap();
    let configuration = unit.configuration().unwrap();
    assert_eq!(configuration.identity.name, "short");
    assert_eq!(configuration.lines.sensor_baud, 921_600);
    assert_eq!(
        (configuration.rate, configuration.mounting),
        (1000.0, [1.0, 0.0, 0.0, 0.0])
    );
    let near = |a: f32, b: f64| (f64::from(a) / b - 1.0).abs() < 1e-6;
    assert!(near(configuration.gyro.bias_turn_on, 10.0 * DEG_PER_H));
    assert!(near(configuration.gyro.bias_in_run, 0.5 * DEG_PER_H));
    // 0.15 deg/sqrt(h) in rad/sqrt(s); 60 ug in m/s2
    assert!(near(configuration.gyro.white_noise, 4.363_323e-5));
    assert!(near(configuration.accel.white_noise, 5.883_99e-4));
    assert!(near(
        configuration.correction.limit.gyro,
        30.0375 * DEG_PER_H
    ));
    assert!(near(configuration.correction.limit.accel, 6_001.875 * UG));
    assert!(near(configuration.correction.slew.accel, 6.001_875 * UG));
    assert!(near(configuration.receiver.fix_delay, 0.1));
    assert!(near(configuration.receiver.fix_delay_sigma, 0.1));
    assert!(near(configuration.receiver.lever_arm_sigma, 2.0));
    assert_eq!(configuration.correction.silence_us, 100_000);
    assert_eq!(decode(&encode(&configuration)), Ok(configuration));
}

#[test]
fn a_mounting_that_nobody_knows_is_one_and_comes_back() {
    let text = format!("{SHORT}[vehicle]\nmounting = 'unknown'\n");
    let unit: Unit = toml::from_str(&text).unwrap();
    let configuration = unit.configuration().unwrap();
    assert_eq!(configuration.mounting, firmware::configuration::UNKNOWN);
    let back = Unit::of(&configuration).unwrap();
    assert_eq!(back.vehicle, unit.vehicle);
    assert_eq!(
        found(&format!("{text}[mounting]\naxes = 'y x -z'\n")),
        [
            "u.toml:13: 'vehicle.mounting' is \"unknown\", but the table [mounting] gives one; \
          remedy: delete one of them"
        ]
    );
}

/// All findings of a text as lines.
fn found(text: &str) -> Vec<String> {
    let (unit, found) = examine(text);
    assert_eq!(
        unit.is_none(),
        found.iter().any(|finding| !finding.doubt),
        "{found:?}"
    );
    let lines = found
        .into_iter()
        .map(|finding| finding.error("u.toml".as_ref()).to_string());
    lines.collect()
}

/// `SHORT` with a line replaced.
fn with(old: &str, new: &str) -> String {
    assert!(SHORT.contains(old), "{old}");
    SHORT.replace(old, new)
}

#[test]
fn a_short_file_raises_no_doubt() {
    assert_eq!(found(SHORT), Vec::<String>::new());
}

#[test]
#[expect(clippy::too_many_lines, reason = "a list of cases")]
fn every_kind_of_mistake_is_named_with_its_line_and_remedy() {
    let arw = "angle_random_walk_dpsqrth = 0.15";
    for (old, new, says) in [
        (
            "name = 'short'",
            "name = ''",
            "u.toml:1: 'name' has 0 characters; remedy: give 1 to 32",
        ),
        (
            "name = 'short'",
            "name = 'é'",
            "u.toml:1: 'name' is 'é'; remedy: give at most 32 letters",
        ),
        (
            "'stim300'",
            "'stim30'",
            "u.toml:3: 'sensor.format' is 'stim30'; remedy: use one of stim300",
        ),
        (
            "'stim300'",
            "'stim300'\nbaud = 'fast'",
            "u.toml:4: 'sensor.baud' is the text 'fast'; remedy: give a whole number",
        ),
        (
            "'stim300'",
            "'stim300'\nrate_hz = 300",
            "u.toml:4: 'sensor.rate_hz' is 300",
        ),
        (
            arw,
            "angle_random_walk_dpsqrth = -1",
            "u.toml:7: 'gyro.angle_random_walk_dpsqrth' is -1; remedy: give a number from",
        ),
        (
            arw,
            "angle_random_walk_dpsqrth = nan",
            "u.toml:7: 'gyro.angle_random_walk_dpsqrth' is NaN",
        ),
        (
            arw,
            "angle_random_walk = 0.15",
            "u.toml:7: 'gyro.angle_random_walk' is not a key of this table",
        ),
        (
            arw,
            "",
            "u.toml:4: 'gyro.angle_random_walk_dpsqrth' is missing; remedy: give it: Angle random walk",
        ),
        (
            arw,
            "angle_random_walk_dpsqrth = 0.15\nscale_pm = 3",
            "remedy: write 'scale_ppm'",
        ),
        (arw, "angle_random_walk_dpsqrth 0.15", "u.toml:7: 'file' "),
        (
            "[accel]",
            "[mounting]\naxes = 'x y y'\n[accel]",
            "u.toml:9: 'mounting.axes' is 'x y y' and names an axis twice",
        ),
        (
            "[accel]",
            "[mounting]\naxes = 'x y z'\nroll_deg = 1\n[accel]",
            "is given together with angles",
        ),
        (
            "[accel]",
            "[receiver]\nlever_arm_m = [0, 200, 0]\n[accel]",
            "u.toml:9: 'receiver.lever_arm_m' is 200; remedy: give a number from -100 to 100",
        ),
        (
            "[accel]",
            "[receiver]\nlever_arm_m = [0, 0]\n[accel]",
            "u.toml:9: 'receiver.lever_arm_m' has 2 values",
        ),
        (
            "[accel]",
            "[receiver]\nlever_arm_m = 3\n[accel]",
            "give a list of numbers",
        ),
        (
            "[accel]",
            "[receiver]\nlever_arm_sigma_m = 101\n[accel]",
            "'receiver.lever_arm_sigma_m' is 101; remedy: give a number from 0 to 100",
        ),
        (
            "[accel]",
            "[receiver]\nprotocol = 'ublox'\n[accel]",
            "use one of ubx, nmea, novatel, sbf, detect",
        ),
        (
            "[accel]",
            "[receiver]\nheading_offset_deg = 270\n[accel]",
            "'receiver.heading_offset_deg' is 270; remedy: give a number from -180 to 180",
        ),
        (
            "[accel]",
            "[correction]\nmark = 'yes'\n[accel]",
            "give true or false",
        ),
        (
            "[accel]",
            "[correction]\nmode = 'lern'\n[accel]",
            "(perhaps 'learn')",
        ),
    ] {
        let all = found(&with(old, new));
        assert!(
            all.iter().any(|line| line.contains(says)),
            "{new}: {all:#?}"
        );
    }
    let spoilt = presets::text("medium")
        .unwrap()
        .replace("pulse_arcsec = 0.1 ", "pulse_arcsec = 0.0 ");
    let all = found(&spoilt);
    assert!(
        all[0].contains("'simulation.gyro.pulse_arcsec' is 0"),
        "{all:?}"
    );
}

#[test]
fn all_mistakes_of_a_file_are_reported_at_once() {
    let text = with("bias_turn_on_dph = 10", "bias_turn_on_dph = -10");
    let text = text.replace("[accel]", "[accel]\nscale_percent = 1");
    let text = text.replace("format = 'stim300'", "format = 'stim300'\nparity = 'odd '");
    let all = found(&text);
    let lines: Vec<&str> = all.iter().map(|line| &line[..9]).collect();
    assert_eq!(lines, ["u.toml:4:", "u.toml:6:", "u.toml:10"], "{all:#?}");
    assert!(all[2].contains("1 % is 10000 ppm"));
}

/// Datagram 0xA7 has 61 bytes without CR LF: 59 with a start bit and a stop bit each at 2 kHz is
/// more than 921 600 bit/s.
#[test]
fn a_line_too_slow_for_the_frames_is_refused_with_the_rate_that_is_not() {
    let sensor = "format = 'stim300'\nrate_hz = 2000\n";
    let fast = format!("{sensor}baud = 1843200\n[sensor.stim300]\ndatagram = '0xA7'");
    assert_eq!(
        found(&with("format = 'stim300'", &fast)),
        Vec::<String>::new()
    );
    let slow = fast.replace("1843200", "921600");
    let all = found(&with("format = 'stim300'", &slow));
    assert!(all[0].contains("u.toml:5: 'sensor.baud' is 921600, but the frames at 2000 Hz need"));
    assert!(all[0].contains("1843200 bit/s or more"), "{all:?}");
}

#[test]
fn physical_nonsense_is_doubted_but_can_be_used() {
    for (old, new, says) in [
        // an optical gyro with the noise of a consumer one
        (
            "= 10\nbias_in_run_dph = 0.5\nangle_random_walk_dpsqrth = 0.15",
            "= 0.01\nbias_in_run_dph = 0.001\nangle_random_walk_dpsqrth = 5",
            "'gyro.angle_random_walk_dpsqrth' is 5 deg/sqrt(h), more than gyros of 0.01 deg/h have",
        ),
        ("= 0.15", "= 0.15\nscale_ppm = 0.5", "multiply by 10000"),
        (
            "= 0.15",
            "= 0.15\nmisalignment_mrad = 200",
            "if the datasheet gives arcsec",
        ),
        (
            "bias_in_run_dph = 0.5",
            "bias_in_run_dph = 50",
            "more than the bias at power-on",
        ),
        (
            "bias_turn_on_ug = 2000\nbias_in_run_ug = 50",
            "bias_turn_on_ug = 2\nbias_in_run_ug = 0.05",
            "if the datasheet gives mg",
        ),
        (
            "= 60",
            "= 0.06",
            "if the datasheet gives m/s/sqrt(h), multiply by 1700",
        ),
        (
            "[accel]",
            "[receiver]\nfix_delay_ms = 0.1\n[accel]",
            "0.1 s is 100",
        ),
        (
            "[accel]",
            "[receiver]\nfix_delay_sigma_ms = 0.03\n[accel]",
            "'receiver.fix_delay_sigma_ms' is 0.03 ms; remedy: give milliseconds",
        ),
        (
            "[accel]",
            "[receiver]\nfix_delay_ms = 0\nfix_delay_sigma_ms = 0\n[accel]",
            "'receiver.fix_delay_ms' is 0 ms with fix_delay_sigma_ms 0",
        ),
        (
            "[accel]",
            "[receiver]\npulse = true\nfix_delay_sigma_ms = 0\n[accel]",
            "without pulses fix_delay_ms would count as exact",
        ),
        (
            "[accel]",
            "[receiver]\nlever_arm_m = [19, 0, -9]\n[accel]",
            "'receiver.lever_arm_m' has a length of 21.0 m, more than the vehicle",
        ),
        (
            "[accel]",
            "[receiver]\nlever_arm_sigma_m = 25\n[accel]",
            "'receiver.lever_arm_sigma_m' is 25 m, more than the vehicle",
        ),
        (
            "[accel]",
            "[receiver]\nheading_offset_deg = 1.57\n[accel]",
            "'receiver.heading_offset_deg' is 1.57 deg; remedy: give degrees",
        ),
        (
            "[gyro]",
            "[sensor.kvh]\n[gyro]",
            "'sensor.kvh' has no effect, because the format is stim300",
        ),
    ] {
        let text = with(old, new);
        let all = found(&text);
        assert!(
            all.iter().any(|line| line.contains(says)),
            "{new}: {all:#?}"
        );
        assert!(examine(&text).0.is_some(), "{new}: {all:#?}");
    }
}

#[test]
fn an_exact_lever_arm_is_no_doubt_and_one_not_given_is_uncertain() {
    let file = |lines: &str| with("[accel]", &format!("[receiver]\n{lines}\n[accel]"));
    let sigma = |lines: &str| {
        let unit: Unit = toml::from_str(&file(lines)).unwrap();
        unit.configuration().unwrap().receiver.lever_arm_sigma
    };
    assert_eq!(sigma("lever_arm_m = [0, 0, 0]"), 2.0);
    assert_eq!(sigma("lever_arm_m = [1.2, 0, -0.5]"), 0.5);
    assert_eq!(sigma("lever_arm_sigma_m = 0.1"), 0.1);
    let exact = file("lever_arm_m = [1.2, 0, -0.5]\nlever_arm_sigma_m = 0");
    assert_eq!(found(&exact), Vec::<String>::new());
    let ship =
        file("lever_arm_m = [60, 0, -9]").replace("[accel]", "[vehicle]\nkind = 'ship'\n[accel]");
    assert_eq!(found(&ship), Vec::<String>::new());
}

/// deg/s/sqrt(Hz) typed as deg/sqrt(h) is 60 times too small, for gyros of every class.
#[test]
fn a_gyro_noise_that_is_60_times_too_small_is_doubted() {
    for name in presets::names() {
        let mut unit = Unit::preset(name).unwrap();
        let doubted = |unit: &Unit| {
            let all = doubts::of(unit);
            all.iter()
                .any(|f| f.key == "gyro.angle_random_walk_dpsqrth" && f.remedy.contains("by 60"))
        };
        assert!(!doubted(&unit), "{name}");
        unit.gyro.angle_random_walk_dpsqrth /= 60.0;
        assert!(doubted(&unit), "{name}");
    }
}

#[test]
fn every_preset_is_a_configuration_with_a_source_for_each_number() {
    for (name, text) in presets::PRESETS {
        let (unit, found) = examine(text);
        assert!(
            found.iter().all(|finding| finding.doubt),
            "{name}: {found:#?}"
        );
        let doubted: Vec<&str> = found.iter().map(|finding| finding.key.as_str()).collect();
        assert!(doubted.is_empty(), "{name}: {found:#?}");
        let unit = unit.unwrap();
        assert_eq!(Unit::preset(name), Some(unit.clone()));
        let configuration = unit.configuration().unwrap();
        assert_eq!(configuration.check(), Ok(()));
        assert_eq!(decode(&encode(&configuration)), Ok(configuration), "{name}");
        unit.simulated().check().unwrap();
        assert_eq!(
            toml::from_str::<Unit>(&unit.to_text("x").unwrap()).unwrap(),
            unit
        );
        assert!(text.starts_with("#:schema ../unit.schema.json\n"), "{name}");
        assert!(presets::title(text).len() > 20);
        let shown = presets::text(name).unwrap();
        assert!(shown.starts_with("#:schema unit.schema.json\n"));
        for line in text.lines().filter(|line| line.contains(" = ")) {
            let why = line.split_once("# ").map_or("", |(_, comment)| comment);
            let because = why.strip_prefix("source: ").or(why.strip_prefix("assumed"));
            assert!(
                because.is_some(),
                "{name}: neither source nor assumed: {line}"
            );
        }
    }
    assert_eq!(Unit::preset("no such"), None);
    let error = Unit::load("stim30").unwrap_err().to_string();
    assert!(error.contains("did you mean 'stim300'"), "{error}");
}

#[test]
fn without_a_simulation_the_errors_follow_from_the_datasheet() {
    let unit: Unit = toml::from_str(&with("= 0.15", "= 0.15\ng_sensitivity_dphpg = 3")).unwrap();
    let spec = unit.simulated();
    spec.check().unwrap();
    let (g, a) = (&spec.gyro, &spec.accel);
    assert_eq!(spec.rate_hz, 1000);
    assert_eq!(
        (g.bias_turn_on_dph, g.rate_random_walk_dphpsqrth),
        (10.0, 0.5)
    );
    assert_eq!(
        (a.bias_turn_on_ug, a.acceleration_random_walk_ugpsqrth),
        (2000.0, 50.0)
    );
    assert_eq!(g.total_angle_random_walk_dpsqrth(), 0.15);
    assert_eq!(a.velocity_random_walk_ugpsqrthz, 60.0);
    assert_eq!(
        (g.scale_ppm, a.scale_ppm, g.g_sensitivity_dphpg),
        (500.0, 500.0, 3.0)
    );
    assert!((g.misalignment_arcsec - 206.264_806).abs() < 1e-5); // 1 mrad
    let others = [
        g.bias_unit_dph,
        g.warm_up_dph,
        g.nonlinearity_ppm,
        a.bias_unit_ug,
        a.delay_s,
    ];
    assert_eq!(others, [0.0; 5]);
    let fast: Unit = toml::from_str(&with("'stim300'", "'kvh'\nrate_hz = 5000")).unwrap();
    assert_eq!(fast.simulated().rate_hz, 2500);
}
