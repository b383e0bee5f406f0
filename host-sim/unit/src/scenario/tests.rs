//! Scenario files: what is read, and how mistakes are reported.

use super::*;
use std::io::Write;

pub(super) fn load_text(text: &str) -> Result<Scenario, Error> {
    let mut file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    Scenario::load(&file.path().to_string_lossy())
}

#[test]
fn every_built_in_scenario_is_in_range() {
    for name in names() {
        Scenario::load(name).unwrap().check().unwrap();
    }
}

#[test]
fn a_file_says_only_what_differs() {
    let s = load_text(
        "name = 'mine'\nunit = 'nav'\n[[test.segment]]\nduration_s = 1400.0\nspeed_mps = 12.0\n",
    )
    .unwrap();
    assert_eq!(
        (s.name.as_str(), s.unit_name.as_str(), s.test.segment.len()),
        ("mine", "nav", 1)
    );
    assert_eq!(s.unit().name, "nav");
    assert_eq!(s.learn, Scenario::default().learn);
}

#[test]
fn a_unit_file_lies_beside_the_scenario() {
    let dir = tempfile::tempdir().unwrap();
    let text = crate::presets::text("tactical").unwrap();
    std::fs::write(
        dir.path().join("my.toml"),
        text.replace("\"tactical\"", "\"mine\""),
    )
    .unwrap();
    let file = dir.path().join("scenario.toml");
    std::fs::write(&file, "unit = 'my.toml'").unwrap();
    let scenario = Scenario::load(&file.to_string_lossy()).unwrap();
    assert_eq!(scenario.unit().name, "mine");
    assert_eq!(scenario.imu_spec().rate_hz, 100);
}

#[test]
fn mistakes_are_named_with_line_and_key() {
    let message = |text: &str| load_text(text).unwrap_err().to_string();
    assert!(
        message("name = 'x'\nheding_deg = 3\n").contains(":2: 'heding_deg'"),
        "{}",
        message("name = 'x'\nheding_deg = 3\n")
    );
    assert!(message("latitude_deg = 91.0").contains("'latitude_deg' is 91"));
    assert!(message("latitude_deg = nan").contains("'latitude_deg' is NaN"));
    assert!(message("unit = 'medum'").contains("medium"));
    assert!(message("name = 'x'\npreset = 'nav'").contains(":2: 'preset'"));
    assert!(message("preset = 'nav'").contains("unit = \"NAME\""));
    assert!(message("[imu.gyro]\nbias_unit_dph = 1").contains("[simulation]"));
    assert!(message("[gnss]\nhorizontal_m = 'one'").contains(":2:"));
    assert!(message("name = '../x'").contains("'name'"));
    assert!(message("[[learn.segment]]\nduration_s = -5.0").contains("learn"));
    assert!(
        Scenario::load("no-such")
            .unwrap_err()
            .to_string()
            .contains("no-such")
    );
    assert!(
        Scenario::load("no/such.toml")
            .unwrap_err()
            .to_string()
            .contains("no such file")
    );
}

#[test]
fn a_key_that_a_command_ignores_is_refused_by_name() {
    let scenario = load_text("height_m = 5\n[learn]\ndrive_s = 1800").unwrap();
    let refused = scenario.gives_none_of(&["test", "learn"], "campaign");
    let message = refused.unwrap_err().to_string();
    assert!(
        message.contains("'learn' is given") && message.contains("campaign"),
        "{message}"
    );
    assert!(
        scenario
            .gives_none_of(&["test", "network"], "campaign")
            .is_ok()
    );
    assert!(
        Scenario::default()
            .gives_none_of(&["learn"], "campaign")
            .is_ok()
    );
}

/// docs/scenario.toml is a scenario, and names each key and each table.
#[test]
fn the_documented_scenario_has_all_keys() {
    let text = include_str!("../../../../docs/scenario.toml");
    load_text(text).unwrap();
    let documented: toml::Table = toml::from_str(text).unwrap();
    let expected = |of: &str| -> Vec<String> {
        let error = load_text(&format!("{of}zzz = 1")).unwrap_err().to_string();
        let (_, names) = error.split_once("expected").unwrap();
        let names = names.split('`').skip(1).step_by(2);
        names.map(str::to_owned).collect()
    };
    for key in expected("") {
        let Some(toml::Value::Table(table)) = documented.get(&key) else {
            assert!(documented.contains_key(&key), "{key}");
            continue;
        };
        for name in expected(&format!("[{key}]\n")) {
            // a drive's segments are shown as a comment: only a road has them
            assert!(
                table.contains_key(&name) || name == "segment" || name == "drive_s",
                "{key}.{name}"
            );
        }
    }
}
