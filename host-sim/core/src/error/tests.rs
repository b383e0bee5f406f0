//! Texts of errors.

use super::*;

#[test]
fn a_bad_value_reads_as_one_line_with_location_and_remedy() {
    let error = Error::Value {
        file: "data.csv".into(),
        line: 17,
        field: "dv_x_mps".into(),
        text: "abc".into(),
        fault: "not a number",
        remedy: "give a decimal number in m/s".into(),
    };
    assert_eq!(
        error.to_string(),
        "data.csv:17: column 'dv_x_mps': 'abc' is not a number; remedy: give a decimal number in m/s"
    );
}

#[test]
fn a_scenario_error_has_a_line_only_where_one_is_known() {
    let with = |line| Error::Scenario {
        file: "s.toml".into(),
        line,
        key: "imu.rate".into(),
        problem: "is unknown".into(),
        remedy: "write 'imu.rate_hz'".into(),
    };
    assert_eq!(
        with(Some(3)).to_string(),
        "s.toml:3: 'imu.rate' is unknown; remedy: write 'imu.rate_hz'"
    );
    assert_eq!(
        with(None).to_string(),
        "s.toml: 'imu.rate' is unknown; remedy: write 'imu.rate_hz'"
    );
}

#[test]
fn an_unknown_name_offers_the_nearest() {
    let error = Error::unknown("scenario", "papper", &["paper", "long-haul"]);
    assert_eq!(
        error.to_string(),
        "there is no scenario 'papper', did you mean 'paper'?; remedy: one of paper, long-haul"
    );
    let far = Error::unknown("scenario", "quite different", &["paper"]);
    assert_eq!(
        far.to_string(),
        "there is no scenario 'quite different'; remedy: one of paper"
    );
}

#[test]
fn edit_distance_counts_single_changes() {
    assert_eq!(edits("", "abc"), 3);
    assert_eq!(edits("kitten", "sitting"), 3);
    assert_eq!(edits("same", "same"), 0);
}

#[test]
fn reading_tells_missing_from_unreadable() {
    let missing = std::fs::read("no-such-file-here").unwrap_err();
    assert!(matches!(
        Error::reading(Path::new("x"), missing),
        Error::Missing { .. }
    ));
    let directory = std::fs::read("/").unwrap_err();
    assert!(matches!(
        Error::reading(Path::new("/"), directory),
        Error::Folder { .. }
    ));
}

#[test]
fn an_excerpt_is_short_and_printable() {
    assert_eq!(excerpt("a\u{7}b"), "a\\u{7}b");
    assert_eq!(excerpt(&"x".repeat(200)).len(), 83);
}

/// Each error of the system on a file gives a remedy for the user.
#[test]
fn each_way_in_which_reading_fails_has_a_remedy_of_its_own() {
    use std::io::{Error as Io, ErrorKind};
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    std::fs::write(&file, "x").unwrap();
    let below = file.join("below");
    for (path, kind, part) in [
        (&file, ErrorKind::NotFound, "no such file"),
        (&below, ErrorKind::NotADirectory, "no such file"),
        (&file, ErrorKind::NotADirectory, "is a file, not a folder"),
        (&file, ErrorKind::IsADirectory, "is a folder, not a file"),
        (&file, ErrorKind::InvalidData, "is not text"),
        (
            &file,
            ErrorKind::PermissionDenied,
            "check that you may read it",
        ),
    ] {
        let text = Error::reading(path, Io::from(kind)).to_string();
        assert!(text.contains(part) && text.contains("; remedy: "), "{text}");
        assert!(text.starts_with(path.to_str().unwrap()), "{text}");
    }
}

#[test]
fn a_clock_that_begins_anew_is_told_from_lines_out_of_order() {
    let said = |before: f64, now: f64| {
        Error::TimeBack {
            file: "imu.csv".into(),
            line: 9,
            field: "t".into(),
            before,
            now,
        }
        .to_string()
    };
    assert!(said(65.535, 0.004).contains("the clock begins anew there"));
    assert!(said(300.0, 290.0).contains("sort the lines"));
    assert!(said(3.0, 3.0).contains("the same time comes twice"));
}
