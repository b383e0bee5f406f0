//! Each fault of a header and of the data is named.

use super::*;

#[test]
#[expect(clippy::too_many_lines, reason = "a list of cases")]
fn every_fault_of_the_header_is_named() {
    for (from, to, start) in [
        (
            "file = \"imu.csv\"",
            "flie = \"imu.csv\"",
            "in.toml:3: 'imu.flie' is not known",
        ),
        (
            "unit = \"deg/s\"",
            "unit = 3",
            "in.toml:5: 'imu.gyro.unit' is integer `3`, expected a text in quotes",
        ),
        (
            "unit = \"deg/s\"",
            "unit = \"rpm\"",
            "in.toml: 'imu.gyro' has the unit 'rpm'; remedy: use one of rad/s, ",
        ),
        (
            "unit = \"deg/s\"",
            "unit = \"deg\"",
            "in.toml: 'imu.accel' is in g while the gyros are in deg;",
        ),
        (
            "\"gy\"",
            "\"gyro y\"",
            "in.toml: 'imu.gyro' names column 'gyro y', which imu.csv does not have; remedy: use one of status, t,",
        ),
        (
            "y x -z",
            "x y up",
            "in.toml: 'imu.axes' is 'x y up' and may name",
        ),
        (
            "\"blank\"",
            "\"none\"",
            "in.toml: 'gnss.separator' is 'none'",
        ),
        (
            "\"enu\"",
            "\"nwu\"",
            "in.toml: 'gnss.velocity' has the order 'nwu'",
        ),
        (
            "heading_deg = 90.0",
            "",
            "in.toml: 'start' gives a part of an attitude",
        ),
        (
            "axes = \"y x -z\"",
            "",
            "in.toml: 'imu.axes' is not given, nor a mounting or a unit",
        ),
        (
            "axes = \"y x -z\"",
            "mounting = \"y x z\"",
            "in.toml: 'imu.mounting.axes' is 'y x z' and is left-handed",
        ),
        (
            "axes = \"y x -z\"",
            "mounting = [[1, 0, 0], [0, 1, 0], [0, 1, 0]]",
            "in.toml: 'imu.mounting.matrix' is [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]",
        ),
        (
            "axes = \"y x -z\"",
            "mounting = 3",
            "in.toml:7: 'imu.mounting' is neither axes",
        ),
        (
            "[gnss]",
            "[gnss]\nlever_arm_m = [1, 200, 0]",
            "in.toml: 'gnss.lever_arm_m' is [1.0, 200.0, 0.0]",
        ),
        (
            "[gnss]",
            "[gnss]\ntime_offset_s = \"guess\"",
            "in.toml: 'gnss.time_offset_s' is 'guess'; remedy: give seconds",
        ),
        (
            "[gnss]",
            "[gnss]\ntime_offset_s = nan",
            "in.toml: 'gnss.time_offset_s' is NaN",
        ),
        (
            "heading_deg = 90.0",
            "heading_deg = 90.0\nheading_sigma_deg = 0",
            "in.toml: 'start.heading_sigma_deg' is 0",
        ),
        (
            "\"5\", \"6\", \"7\"",
            "\"5\"",
            "in.toml: 'gnss.velocity' names 1 columns",
        ),
        ("[imu]", "truth = \"no.csv\"\n[imu]", "no.csv: no such file"),
        (
            "[imu]",
            "truth = 3\n[imu]",
            "in.toml:2: 'truth' is neither a file nor a table",
        ),
        (
            "heading_deg = 90.0",
            "heading_deg = nan",
            "in.toml: 'start.heading_deg' is NaN",
        ),
        (
            "roll_deg = 0.0\npitch_deg = 0.0\nheading_deg = 90.0",
            "standstill_s = 30",
            "in.toml: 'start.standstill_s' is 30",
        ),
        (
            "unit = \"ms\"",
            "unit = \"s\"",
            "in.toml: 'imu.time' has a median step of 10 s",
        ),
        (
            "axes =",
            "max_gap_s = -1.0\naxes =",
            "in.toml: 'imu.max_gap_s' is -1",
        ),
        ("imu.csv", "imo.csv", "imo.csv: no such file"),
        (
            "[gnss]",
            "[gnss]\nposition_sigma_m = [0.0, 1.0, 1.0]",
            "in.toml: 'gnss' has the standard deviation 0",
        ),
        ("\"s\" }", "\"ms\" }", "in.toml: 'time' has no whole second"),
    ] {
        let header = MOVING.replacen(from, to, 1);
        let why = Folder::new(&header, &imu(601), &gnss(6)).complaint();
        assert!(why.starts_with(start), "{why}");
    }
    let header = MOVING.split("[gnss]").next().unwrap().to_owned() + "[start]\nstandstill_s = 90\n";
    let why = Folder::new(&header, &imu(601), "").complaint();
    assert!(
        why.starts_with("in.toml: 'start' does not give the site"),
        "{why}"
    );
    assert!(matches!(
        load(Path::new("no/such.toml")),
        Err(Error::Missing { .. })
    ));
}

/// The damaged last line comes first, and the times are plain numbers.
#[test]
fn a_recording_cut_within_its_first_second_says_so() {
    let whole = imu(17);
    let cut = &whole[..whole.len() - 12];
    let why = Folder::new(MOVING, cut, &gnss(6)).complaint();
    let (_, why) = why.split_once("'time' ").unwrap();
    assert!(why.starts_with("has no whole second: "), "{why}");
    let parts = [
        "imu.csv:18: the file ends within this line",
        "(was the power cut?); the samples last from 1000 to 1000.15 s",
        "remedy: give the whole file",
    ];
    let at = parts.map(|part| why.find(part).unwrap_or_else(|| panic!("{part}: {why}")));
    assert!(at.is_sorted(), "{why}");
    let whole = Folder::new(MOVING, &imu(16), &gnss(6)).complaint();
    let short = "no whole second: the samples last from 1000 to 1000.15 s; remedy: give a longer";
    assert!(whole.contains(short), "{whole}");
}

#[test]
fn every_fault_of_the_data_is_named() {
    let imu_text = imu(601);
    for (from, to, start) in [
        (
            "ok,1000070,0,",
            "ok,1000070,x,",
            "imu.csv:9: column 'gx': 'x' is not a number",
        ),
        (
            "ok,1000070,0,",
            "ok,1000070,3000,",
            "imu.csv:9: column 'gx': '3000' is out of range; remedy: check the unit of the gyros",
        ),
        (
            "ok,1000070,0,",
            "ok,1000060,0,",
            "imu.csv:9: column 't': time 1000060 follows 1000060",
        ),
        ("ok,1000070,0,", "ok,", "imu.csv:9: 6 columns instead of 8"),
        ("ok,1000070,", "ok,1000079.999,", "imu.csv:9: column 't'"),
    ] {
        let changed = imu_text.replace(from, to);
        let folder = Folder::new(MOVING, &changed, &gnss(6));
        if to.contains("79.999") {
            load(&folder.header()).unwrap(); // jitter within bounds is accepted
        } else {
            let why = folder.complaint();
            assert!(why.starts_with(start), "{why}");
        }
    }
    let with_gap: String = imu_text
        .lines()
        .enumerate()
        .filter(|(k, _)| !(100..104).contains(k))
        .map(|(_, l)| format!("{l}\n"))
        .collect();
    // a short gap is bridged: the vehicle goes on as before
    let s = load(&Folder::new(MOVING, &with_gap, &gnss(6)).header()).unwrap();
    assert_eq!((s.epochs(), s.counts[55].dv[2]), (5, s.counts[0].dv[2]));
    let fixes = gnss(6);
    for (from, to, start) in [
        (
            "1002.5  45.0",
            "1002.5  95.0",
            "gnss.txt:3: column '2': '95' is not on Earth with its longitude and height",
        ),
        (
            "1002.5",
            "1000.5",
            "gnss.txt:3: column '1': '1000.5' is not after the fix before",
        ),
        (
            "1002.5  45.0",
            "1002.5",
            "gnss.txt:3: 6 columns instead of 7",
        ),
    ] {
        let why = Folder::new(MOVING, &imu_text, &fixes.replace(from, to)).complaint();
        assert!(why.starts_with(start), "{why}");
    }
    let why = Folder::new(MOVING, &imu_text, &gnss(1)).complaint();
    assert!(
        why.starts_with("in.toml: 'gnss' has fewer than two fixes"),
        "{why}"
    );
}
