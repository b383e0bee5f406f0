use super::header::Header;
use super::*;
use crate::inertial::free_inertial::free_inertial;
use crate::inertial::session::Session;
use crate::inertial::units::DEG;
use nalgebra::Vector3;
use std::fmt::Write;
use std::path::PathBuf;

const MOVING: &str = r#"
[imu]
file = "imu.csv"
time = { column = "t", unit = "ms" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accel = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "y x -z"

[gnss]
file = "gnss.txt"
separator = "blank"
names = false
time = { column = "1", unit = "s" }
latitude = { column = "2", unit = "deg" }
longitude = { column = "3", unit = "deg" }
height = { column = "4", unit = "m" }
velocity = { columns = ["5", "6", "7"], unit = "m/s", order = "enu" }

[start]
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 90.0
"#;

/// Samples in right-forward-up of a level drive east at 20 m/s; `t` in ms from 1000 s on.
fn imu(n: usize) -> String {
    let mut text = "status,t,gx,gy,gz,ax,ay,az\n".to_owned();
    for k in 0..n {
        writeln!(
            text,
            "ok,{},0,0,0.0023,0,0,{}",
            1_000_000 + 10 * k,
            9.81 / 9.80665
        )
        .unwrap();
    }
    text
}

fn gnss(n: usize) -> String {
    (0..n)
        .map(|k| {
            format!(
                "{:.1}  45.0 {:.9} 80 20 0 0\n",
                1000.5 + k as f64,
                7.0 + 2.537e-4 * k as f64
            )
        })
        .collect()
}

fn load(header: &Path) -> Result<Session, Error> {
    read(header, &[])?.session()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new(header: &str, imu: &str, gnss: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        for (name, text) in [("in.toml", header), ("imu.csv", imu), ("gnss.txt", gnss)] {
            std::fs::write(dir.path().join(name), text).unwrap();
        }
        Self(dir)
    }

    fn header(&self) -> PathBuf {
        self.0.path().join("in.toml")
    }

    fn complaint(&self) -> String {
        let text = load(&self.header())
            .map(|s| s.epochs())
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("; remedy: ") && !text.contains('\n'),
            "{text}"
        );
        text.replace(&format!("{}/", self.0.path().display()), "")
    }
}

#[test]
fn rates_with_fixes_become_a_session_that_navigates() {
    let folder = Folder::new(MOVING, &imu(601), &gnss(6));
    let s = load(&folder.header()).unwrap();
    assert_eq!(
        (s.epochs(), s.counts.len(), s.standstill, s.dt),
        (5, 500, 0, 0.01)
    );
    let fix = |k: usize| s.fixes[k].unwrap();
    assert_eq!(fix(1).sigmas, [1.0, 1.0, 1.5, 0.05, 0.05, 0.05]);
    assert!((fix(3).velocity - Vector3::new(0.0, 20.0, 0.0)).norm() < 1e-12);
    // the session begins at the first fix and has the fixes of the file
    assert!((fix(2).position.lon / DEG - (7.0 + 2.0 * 2.537e-4)).abs() < 1e-12);
    // counts are turned from right-forward-up to forward-right-down
    let increment = s.increments()[7];
    assert!((increment.dtheta.z + 0.0023 * DEG * 0.01).abs() < 2e-9);
    assert!((increment.dv.z + 0.0981).abs() < 2e-8);
    let end = free_inertial(&s, &s.increments(), s.reference[0], 0, 5).position[5];
    // the made samples lack the Coriolis acceleration of 2 mm/s2 and the rotation of the Earth
    assert!(end.xy().norm() < 0.3, "{end}");
}

#[test]
fn the_documented_example_is_a_header() {
    let doc: String = include_str!("mod.rs")
        .lines()
        .skip_while(|l| *l != "//! ```toml")
        .skip(1)
        .take_while(|l| *l != "//! ```")
        .map(|l| l.trim_start_matches("//!").to_owned() + "\n")
        .collect();
    let header: Header = toml::from_str(&doc).unwrap();
    assert_eq!(header.start.standstill_s, Some(300));
    // the keys that are commented out exist, too
    let all = doc
        .replace("# separator", "separator")
        .replace("# names", "names")
        .replace("# max_gap", "max_gap");
    toml::from_str::<Header>(&all).unwrap();
}

#[test]
fn increments_at_rest_need_only_a_site() {
    let header = r#"
[imu]
file = "imu.csv"
separator = ";"
names = false
time = { column = "1", unit = "s" }
gyro = { columns = ["2", "3", "4"], unit = "arcsec" }
accel = { columns = ["5", "6", "7"], unit = "m/s" }
axes = "x y z"
[start]
standstill_s = 90
latitude_deg = 34.0
longitude_deg = 108.0
height_m = 380.0
"#;
    let rows: String = (0..10_000)
        .map(|k| {
            format!(
                "{:.3};0.25;0;-0.5;0;0.001;-0.049\n",
                50.0 + 0.005 * f64::from(k)
            )
        })
        .collect();
    let folder = Folder::new(header, &rows, "");
    assert!(
        folder
            .complaint()
            .starts_with("in.toml: 'time' covers 50 s, all of it within the standstill of 90 s")
    );
    let rows: String = (0..20_000)
        .map(|k| {
            format!(
                "{:.3};0.25;0;-0.5;0;0.001;-0.049\n",
                50.0 + 0.005 * f64::from(k)
            )
        })
        .collect();
    let s = load(&Folder::new(header, &rows, "").header()).unwrap();
    assert_eq!(
        (s.epochs(), s.counts.len(), s.standstill),
        (100, 20_000, 90)
    );
    let sum: i64 = s.counts.iter().map(|c| i64::from(c.dtheta[2])).sum();
    let want = -0.5 * crate::inertial::units::ARCSEC / 1e-9 * 20_000.0;
    assert!((sum as f64 - want).abs() <= 1.0, "{sum} {want}");
    assert_eq!(s.fixes[99].unwrap().velocity, Vector3::zeros());
    // the motion of a lost increment is that of its neighbours
    let lost = rows.replace("50.050;0.25;0;-0.5;0;0.001;-0.049\n", "");
    let s = load(&Folder::new(header, &lost, "").header()).unwrap();
    let bridged: i64 = s.counts.iter().map(|c| i64::from(c.dtheta[2])).sum();
    assert!((bridged as f64 - want).abs() <= 1.0, "{bridged} {want}");
}

#[test]
fn fixes_may_be_in_the_file_of_the_samples_and_lack_a_velocity() {
    let header = MOVING
        .replace(
            "file = \"gnss.txt\"\nseparator = \"blank\"\nnames = false\n",
            "",
        )
        .replace(
            "velocity = { columns = [\"5\", \"6\", \"7\"], unit = \"m/s\", order = \"enu\" }\n",
            "",
        );
    let gnss_at = header.find("[gnss]").unwrap();
    let (first, second) = header.split_at(gnss_at);
    let second = second
        .replace("\"1\", unit = \"s\"", "\"t\", unit = \"ms\"")
        .replace("\"2\"", "\"lat\"")
        .replace("\"3\"", "\"lon\"")
        .replace("\"4\"", "\"h\"");
    let header = format!("{first}{second}");
    let mut rows = String::new();
    for (k, line) in imu(501).lines().enumerate() {
        let fix = match k {
            0 => ",lat,lon,h".to_owned(),
            _ if k % 100 == 51 => format!(",45,{:.9},80", 7.0 + 2.537e-6 * (k - 1) as f64),
            _ => ",,,".to_owned(),
        };
        rows += &format!("{line}{fix}\n");
    }
    let s = load(&Folder::new(&header, &rows, "").header()).unwrap();
    assert_eq!(s.epochs(), 4);
    let fix = s.fixes[2].unwrap();
    assert!(fix.has(0..3) && !fix.has(3..4));
    let velocity = s.reference[2].velocity;
    assert!((velocity.y - 20.0).abs() < 0.02, "{velocity}");
    let half = rows.replacen(",45,", ",,", 1);
    let why = Folder::new(&header, &half, "").complaint();
    assert!(
        why.starts_with("imu.csv:52: column 'lat': 'NaN' is missing"),
        "{why}"
    );
    let level = rows.replacen(",80\n", ",\n", 1);
    let s = load(&Folder::new(&header, &level, "").header()).unwrap();
    let fix = s.fixes[0].unwrap();
    assert!(fix.has(0..2) && !fix.has(2..3));
    assert_eq!(s.reference[0].position.h, 80.0);
}

#[test]
fn every_fault_of_the_header_is_named() {
    for (from, to, start) in [
        (
            "file = \"imu.csv\"",
            "flie = \"imu.csv\"",
            "in.toml:3: 'flie' unknown field",
        ),
        (
            "unit = \"deg/s\"",
            "unit = 3",
            "in.toml:5: 'gyro' invalid type",
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
            "in.toml:7: 'mounting' is neither axes",
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
        (
            "ok,1000070,0,",
            "ok,",
            "imu.csv:9: 6 columns where the header names 8",
        ),
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
            "gnss.txt:3: 6 columns where the header names 7",
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

/// The same vector in four ways: named axes, a matrix, angles after axes, the unit's mounting.
#[test]
fn a_mounting_is_told_in_several_ways() {
    let first = |axes: &str, top: &str| {
        let header = top.to_owned() + &MOVING.replace("axes = \"y x -z\"", axes);
        let folder = Folder::new(
            &header,
            &imu(601).replace(",0,0,1.", ",0.1,0.2,1."),
            &gnss(6),
        );
        let unit = crate::unit::Unit {
            mounting: crate::unit::mounting::Mounting {
                axes: Some("y x -z".into()),
                ..Default::default()
            },
            ..crate::unit::Unit::default()
        };
        let text = unit.to_text("made by a test").unwrap();
        std::fs::write(folder.0.path().join("u.toml"), text).unwrap();
        read(&folder.header(), &[]).unwrap().samples[9].dv
    };
    let named = first("axes = \"y x -z\"", "");
    assert!(named.z < -9.0 && named.x > 1.9 && named.y > 0.9, "{named}");
    for (axes, top) in [
        ("mounting = \"y x -z\"", ""),
        ("mounting = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]", ""),
        ("axes = \"x -y -z\"\nmounting = { heading_deg = 90.0 }", ""),
        ("", "unit = \"u.toml\"\n"),
    ] {
        let told = first(axes, top);
        assert!((told - named).norm() < 1e-9, "{axes}: {told} {named}");
    }
}

#[test]
fn a_truth_of_its_own_judges_and_its_columns_are_those_of_the_fixes_or_named() {
    let truth = |k: usize| format!("{},45.1,{:.9},90,1,2,3", 1000.0 + 0.5 * k as f64, 7.0);
    let plain: String = (0..20).map(|k| truth(k) + "\n").collect();
    let named = format!("t_s,lat_deg,lon_deg,height_m,v_north_mps,v_east_mps,v_down_mps\n{plain}");
    let columns = r#"[truth]
file = "truth.csv"
names = false
time = { column = "1", unit = "s" }
latitude = { column = "2", unit = "deg" }
longitude = { column = "3", unit = "deg" }
height = { column = "4", unit = "m" }
velocity = { columns = ["5", "6", "7"], unit = "m/s", order = "ned" }
"#;
    for (top, text) in [("truth = \"truth.csv\"\n", &named), (columns, &plain)] {
        let folder = Folder::new(&format!("{top}{MOVING}"), &imu(601), &gnss(6));
        std::fs::write(folder.0.path().join("truth.csv"), text).unwrap();
        let s = load(&folder.header()).unwrap();
        assert!((s.reference[2].position.lat / DEG - 45.1).abs() < 1e-12);
        assert_eq!(s.reference[2].velocity, Vector3::new(1.0, 2.0, 3.0));
        assert!((s.fixes[2].unwrap().position.lat / DEG - 45.0).abs() < 1e-12);
        assert!(s.unjudged.is_empty());
    }
    let folder = Folder::new(
        &format!("truth = \"truth.csv\"\n{MOVING}"),
        &imu(601),
        &gnss(6),
    );
    std::fs::write(folder.0.path().join("truth.csv"), "a,b\n1,2\n").unwrap();
    let why = folder.complaint();
    assert!(
        why.starts_with("in.toml: 'truth.time' names column '1'"),
        "{why}"
    );
}

/// A told offset moves the fixes and the truth, and fixes lack what their lines lack.
#[test]
fn fixes_move_by_the_told_offset() {
    let header = MOVING
        .replace(
            "[gnss]",
            "[gnss]\ntime_offset_s = 2.5\nlever_arm_m = [1.0, -0.5, -2]",
        )
        .replace("\"5\", \"6\", \"7\"", "\"5\", \"6\"");
    let folder = Folder::new(&header, &imu(1001), &gnss(6));
    let record = read(&folder.header(), &[]).unwrap();
    assert!((record.fixes[0].time - 1003.0).abs() < 1e-9);
    assert_eq!(record.told_offset_s, Some(2.5));
    assert_eq!(record.lever_arm_m, [1.0, -0.5, -2.0]);
    assert!(record.fixes[0].has(3..5) && !record.fixes[0].has(5..6));
    assert_eq!(record.fixes[0].velocity[1], 20.0);
    let s = record.session().unwrap();
    assert_eq!(
        (s.lever_arm, s.reference_arm),
        (Vector3::new(1.0, -0.5, -2.0), s.lever_arm)
    );
}

/// The rows of the table of keys in docs/your-data.md, as `table.key`.
fn documented() -> std::collections::BTreeSet<String> {
    let page = include_str!("../../../../docs/your-data.md");
    let (_, table) = page.split_once("| field | meaning | default |").unwrap();
    let rows = table.lines().skip(1).take_while(|row| !row.is_empty());
    let keys = rows.filter_map(|row| row.strip_prefix("| ")?.split_once(" | "));
    let keys = keys.flat_map(|(first, _)| {
        let mut table = "";
        let names = first.split('`').skip(1).step_by(2);
        let key = names.map(move |name| match name.split_once('.') {
            Some((of, key)) => {
                table = of;
                format!("{table}.{key}")
            }
            None if table.is_empty() => name.to_owned(),
            None => format!("{table}.{name}"),
        });
        key.collect::<Vec<_>>()
    });
    keys.collect()
}

/// The keys that the parser expects in the place of an unknown one.
fn expected(header: &str) -> Vec<String> {
    let error = toml::from_str::<super::header::Header>(header).unwrap_err();
    let (_, names) = error.message().split_once("expected ").unwrap();
    names
        .split('`')
        .skip(1)
        .step_by(2)
        .map(String::from)
        .collect()
}

/// docs/your-data.md explains each key of the header, and no other.
#[test]
fn the_table_of_keys_is_that_of_the_parser() {
    let mut known: Vec<String> = expected("zzz = 1");
    known.retain(|table| !["imu", "start"].contains(&table.as_str()));
    for table in ["imu", "gnss", "start"] {
        let keys = expected(&format!("[{table}]\nzzz = 1"));
        known.extend(keys.iter().map(|key| format!("{table}.{key}")));
    }
    let truth = toml::from_str::<super::header::TruthTable>("zzz = 1").unwrap_err();
    let (_, names) = truth.message().split_once("expected ").unwrap();
    let names = names.split('`').skip(1).step_by(2);
    known.extend(names.map(|key| format!("truth.{key}")));
    let documented = documented();
    assert!(known.len() > 30, "{known:?}");
    assert_eq!(documented, known.into_iter().collect());
}

/// `--truth` replaces the file that the header names, and keeps the columns that it tells.
#[test]
fn another_truth_replaces_that_of_the_header() {
    let dir = tempfile::tempdir().unwrap();
    let mut record = crate::recordings::record::Record::from_session(
        &crate::recordings::testing::simulated(5.0, 20.0, 1),
    );
    record.initial_attitude = None;
    super::write(&record, None, dir.path()).unwrap();
    let at = |name: &str| dir.path().join(name);
    let track = |height: f64| -> String {
        let row = |k: i32| format!("{k};45.0;7.0;{height}\n");
        "when;la;lo;up\n".to_owned() + &(0..20).map(row).collect::<String>()
    };
    std::fs::write(at("a.txt"), track(100.0)).unwrap();
    std::fs::write(at("b.txt"), track(200.0)).unwrap();
    let header = std::fs::read_to_string(at("header.toml")).unwrap();
    let truth = "[truth]\nfile = 'a.txt'\nseparator = ';'\ntime_offset_s = 3\n\
                 time = { column = 'when', unit = 's' }\n\
                 latitude = { column = 'la', unit = 'deg' }\n\
                 longitude = { column = 'lo', unit = 'deg' }\n\
                 height = { column = 'up', unit = 'm' }\n";
    std::fs::write(at("header.toml"), format!("{truth}{header}")).unwrap();
    let height = |record: &Record| {
        let truth = record.truth.as_ref().unwrap();
        (truth.span(), truth.at(10.0).position.h)
    };
    let named = read(&at("header.toml"), &[]).unwrap();
    let given = read_with_truth(&at("header.toml"), &[], Some(&at("b.txt"))).unwrap();
    assert_eq!(height(&named), (Some((3.0, 22.0)), 100.0));
    assert_eq!(height(&given), (Some((3.0, 22.0)), 200.0));
    // with fixes from elsewhere, too
    let beside = samples(&at("header.toml"), &[], Some(&at("b.txt"))).unwrap();
    assert_eq!(height(&beside), height(&given));
    let why = read_with_truth(&at("header.toml"), &[], Some(&at("c.txt"))).unwrap_err();
    assert!(why.to_string().contains("c.txt: no such file"), "{why}");
}
