//! Valid and faulty files.

use super::columns::*;
use super::*;
use host_core::error::Error;
use host_core::inertial::units::G0;
use host_io::recordings::{ACCEL_LSB_MPS, GYRO_LSB_RAD};
use std::path::Path;

fn load_text(text: &str, choice: &Choice) -> Result<Vec<Series>, Error> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("imu.csv");
    std::fs::write(&file, text).unwrap();
    series(&file, choice)
}

fn series(file: &Path, choice: &Choice) -> Result<Vec<Series>, Error> {
    load(file, choice, &mut Vec::new())?
        .into_iter()
        .map(Column::series)
        .collect()
}

fn complaint(text: &str) -> String {
    let message = load_text(text, &Choice::default()).unwrap_err().to_string();
    assert!(message.contains("; remedy: "), "{message}");
    message[message.find("imu.csv").unwrap_or(0)..].to_owned()
}

/// A file of 200 lines at 50 Hz.
fn file(header: &str, line: impl Fn(usize) -> String) -> String {
    (0..200).fold(format!("{header}\n"), |text, i| text + &line(i) + "\n")
}

fn time(i: usize) -> f64 {
    (i + 1) as f64 * 0.02
}

/// As a spreadsheet writes it: all names are in one cell to whoever splits at commas.
#[test]
fn semicolons_and_decimal_commas() {
    let text = file("t_s;wx_radps;wy_radps;az_mps2", |i| {
        format!("{:.4};0,25;0,5;-9,8", time(i)).replace('.', ",")
    });
    let series = load_text(&text, &Choice::default()).unwrap();
    let names: Vec<&str> = series.iter().map(|s| s.column.as_str()).collect();
    assert_eq!(names, ["wx_radps", "wy_radps", "az_mps2"]);
    assert_eq!(series[1].increments[7], 0.01);
    let one = file("t_s;wx_radps", |i| format!("{};0.5", time(i)));
    assert_eq!(load_text(&one, &Choice::default()).unwrap().len(), 1);
}

#[test]
fn increments_rates_and_pulses_come_out_as_si_increments() {
    let text = file("t_s,dtheta_x_rad,wy_radps,roll_rad,az_g,ve_mps", |i| {
        format!("{:.4},1e-6,0.5,9,-1,7", time(i))
    });
    let series = load_text(&text, &Choice::default()).unwrap();
    let names: Vec<&str> = series.iter().map(|s| s.column.as_str()).collect();
    assert_eq!(names, ["dtheta_x_rad", "wy_radps", "az_g"]);
    assert!(
        series
            .iter()
            .all(|s| s.rate_hz == 50.0 && s.increments.len() == 200)
    );
    assert_eq!(
        [
            series[0].increments[7],
            series[1].increments[7],
            series[2].increments[7]
        ],
        [1e-6, 0.01, -G0 / 50.0]
    );
    let pulses = load_text(
        &file(host_io::recordings::HEADER, |_| "1,0,0,0,0,80".into()),
        &Choice::default(),
    )
    .unwrap();
    assert_eq!(
        (pulses.len(), pulses[0].rate_hz, pulses[0].increments[0]),
        (6, 100.0, GYRO_LSB_RAD)
    );
    assert_eq!(pulses[5].increments[3], 80.0 * ACCEL_LSB_MPS);
}

#[test]
fn a_column_and_a_rate_can_be_given() {
    let text = file("roll_rad,dtheta_x_rad", |i| format!("{i},1"));
    let choice = Choice {
        columns: vec!["roll_rad".into()],
        rate_hz: Some(20.0),
        ..Choice::default()
    };
    let series = load_text(&text, &choice).unwrap();
    assert_eq!(
        (series.len(), series[0].rate_hz, series[0].increments[5]),
        (1, 20.0, 5.0)
    );
    let wrong = load_text(
        &text,
        &Choice {
            columns: vec!["dtheta_y_rad".into()],
            ..choice
        },
    )
    .unwrap_err()
    .to_string();
    assert!(
        wrong.contains("no sensor column 'dtheta_y_rad', did you mean 'dtheta_x_rad'?"),
        "{wrong}"
    );
    let unknown = load_text(&text, &Choice::default())
        .unwrap_err()
        .to_string();
    assert!(
        unknown.starts_with("--rate: ") && unknown.contains("remedy: give the samples per second"),
        "{unknown}"
    );
}

#[test]
fn lines_before_the_names_and_the_end_of_a_week_are_read_over_with_a_note() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("imu.csv");
    let text = file("t_s,dtheta_x_rad", |i| {
        format!("{:.2},1e-6", (604_798.0 + time(i)) % 604_800.0)
    });
    std::fs::write(&path, format!("Log of my box\n50 Hz,rad\n{text}")).unwrap();
    let mut notes = Vec::new();
    let columns = load(&path, &Choice::default(), &mut notes).unwrap();
    assert_eq!((columns.len(), columns[0].rate_hz), (1, 50.0));
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].ends_with("imu.csv: the lines before line 3 are left out"));
    assert!(notes[1].starts_with("The seconds of week of the samples begin anew"));
}

#[test]
fn faults_are_named_by_line_and_column() {
    let with = |at: usize, bad: &'static str| {
        file("t_s,dtheta_x_rad", move |i| {
            if i == at {
                bad.into()
            } else {
                format!("{:.4},1e-6", time(i))
            }
        })
    };
    for (text, expected) in [
        (
            with(5, "0.12,abc"),
            "imu.csv:7: column 'dtheta_x_rad': 'abc' is not a number; remedy: ",
        ),
        (
            with(5, "0.12,NaN"),
            "imu.csv:7: column 'dtheta_x_rad': 'NaN' is not finite; remedy: ",
        ),
        (
            with(5, "0.12,"),
            "imu.csv:7: column 'dtheta_x_rad': '' is missing; remedy: ",
        ),
        (
            with(5, "0.12"),
            "imu.csv:7: 1 columns instead of 2; remedy: ",
        ),
        (
            with(5, ""),
            "imu.csv:8: column 't_s': '0.14' is not one step after the line before; remedy: ",
        ),
        (
            with(5, "0.05,1"),
            "imu.csv:7: column 't_s': time 0.05 follows 0.1; remedy: ",
        ),
        (
            with(5, "0.139,1"),
            "imu.csv:7: column 't_s': '0.139' is not one step after the line before; remedy: cut the file there (a step is 0.02 s)",
        ),
        (
            "t_s,x\n1,2\n".into(),
            "imu.csv:1: header is 't_s,x', and no name states a sensor and its unit; \
             remedy: name the columns as in 't_s,dtheta_x_rad",
        ),
        (
            "t_s,dtheta_x_rad\n".into(),
            "imu.csv: has a header and no data; remedy: ",
        ),
        (
            "t_s,dtheta_x_rad\n0.1,1\n0.2,1\n".into(),
            "imu.csv: holds 2 samples, too few for an Allan deviation; remedy: ",
        ),
        (String::new(), "imu.csv: is empty; remedy: "),
    ] {
        let message = complaint(&text);
        assert!(message.starts_with(expected), "{message}");
    }
    let missing = load(
        Path::new("no/such.csv"),
        &Choice::default(),
        &mut Vec::new(),
    )
    .unwrap_err();
    assert!(matches!(missing, Error::Missing { .. }));
}

#[test]
fn times_in_a_smaller_unit_are_refused() {
    for (unit, of_s) in [("ms", 1e3), ("us", 1e6), ("ns", 1e9)] {
        let text = file("t_s,dtheta_x_rad", |i| {
            format!("{:.0},1e-6", of_s * time(i))
        });
        let message = complaint(&text);
        let remedy = format!("in {unit} they would be 50 samples a second");
        assert!(message.contains("a step that no IMU has"), "{message}");
        assert!(message.contains(&remedy), "{message}");
    }
}

#[test]
fn gzip_reads_alike_and_a_broken_one_is_reported() {
    use std::io::Write;
    let text = file("dtheta_x_rad", |i| format!("{}e-6", i * 7919 % 1009));
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(text.as_bytes()).unwrap();
    let whole = encoder.finish().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("imu.csv.gz");
    let choice = Choice {
        rate_hz: Some(10.0),
        ..Choice::default()
    };
    std::fs::write(&file, &whole).unwrap();
    assert_eq!(
        series(&file, &choice).unwrap(),
        load_text(&text, &choice).unwrap()
    );
    std::fs::write(&file, &whole[..whole.len() - 20]).unwrap();
    // up to the cut, with a note
    let mut notes = Vec::new();
    load(&file, &choice, &mut notes).unwrap();
    assert!(format!("{notes:?}").contains("cut"), "{notes:?}");
}
