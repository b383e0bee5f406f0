use super::*;
use test_bench::recordings::{file, message};

const COMMENT: &str = "% program   : RTKPOST ver.2.4.3\n% (lat/lon/height=WGS84/ellipsoidal)\n";
const BEHIND: &str = "Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio";

fn solved(text: &str) -> Result<Solutions, String> {
    let (_dir, path) = file("in.pos", text.as_bytes());
    assert!(is_one(&path) || text.starts_with("no"));
    read(&path).map_err(|why| message(&why))
}

/// 2021-01-05 is a Tuesday of GPS week 2139.
#[test]
fn both_times_and_all_positions_give_the_same_fix() {
    let gps = 2139.0 * WEEK_S + 2.0 * 86_400.0 + 10.0 * 3600.0 + 20.0 * 60.0 + 30.5;
    let rest = "1  12   0.0100   0.0200   0.0300   0.0   0.0   0.0   0.00    5.0";
    let degrees = "latitude(deg) longitude(deg)  height(m)";
    for (clock, time, names, position) in [
        (
            "GPST",
            "2021/01/05 10:20:30.500",
            degrees,
            "-28.5 112.75 58.5",
        ),
        ("GPST", "2139 210030.500", degrees, "-28.5 112.75 58.5"),
        (
            "UTC",
            "2021/01/05 10:20:12.500",
            degrees,
            "-28.5 112.75 58.5",
        ),
        (
            "JST",
            "2021/01/05 19:20:12.500",
            degrees,
            "-28.5 112.75 58.5",
        ),
        (
            "GPST",
            "2139 210030.500",
            "latitude(d'\") longitude(d'\")  height(m)",
            "-28 30 0.0 112 45 0.0 58.5",
        ),
    ] {
        let text = format!("{COMMENT}%  {clock}   {names}   {BEHIND}\n{time} {position} {rest}\n");
        let fixes = solved(&text).unwrap().fixes;
        let fix = fixes[0];
        assert!(
            (fix.time - gps).abs() < 1e-6,
            "{clock} {time}: {}",
            fix.time - gps
        );
        assert!((fix.lat_deg + 28.5).abs() < 1e-9 && (fix.lon_deg - 112.75).abs() < 1e-9);
        assert_eq!(
            (fix.height_m, fix.sigmas[..3].to_vec()),
            (58.5, vec![0.01, 0.02, 0.03])
        );
        assert!(!fix.has(3..4));
    }
}

/// A place on the equator and one at 45 degrees, by hand.
#[test]
fn positions_from_the_centre_and_velocities_are_turned() {
    let names = "x-ecef(m)      y-ecef(m)      z-ecef(m)   Q  ns   sdx(m)   sdy(m)   sdz(m) \
                 vx(m/s) vy(m/s) vz(m/s)";
    let text = format!("%  GPST   {names}\n2139 5.0 6378147.0 0.0 0.0 1 9 0.3 0.1 0.2 3 1 2\n");
    let fix = solved(&text).unwrap().fixes[0];
    assert!(fix.lat_deg.abs() < 1e-9 && fix.lon_deg.abs() < 1e-9);
    assert!((fix.height_m - 10.0).abs() < 1e-6);
    for (got, want) in fix.velocity.iter().zip([2.0, 1.0, -3.0]) {
        assert!((got - want).abs() < 1e-12);
    }
    for (got, want) in fix.sigmas.iter().zip([0.2, 0.1, 0.3]) {
        assert!((got - want).abs() < 1e-12);
    }
    let [lat, lon, height] = geodetic([3_194_419.145, 3_194_419.145, 4_487_348.409]);
    assert!(
        (lat - 45.0).abs() < 1e-8 && (lon - 45.0).abs() < 1e-9,
        "{lat} {lon}"
    );
    assert!(height.abs() < 1e-2, "{height}");
}

#[test]
fn faults_are_named_and_cut_files_are_read() {
    let head = format!("{COMMENT}%  GPST latitude(deg) longitude(deg) height(m) {BEHIND}\n");
    let line = |k: u32, q: u32| format!("2139 {k}.0 45 7 80 {q} 9 1 1 2 0 0 0 0 0\n");
    let good = format!("{head}{}{}{}", line(1, 5), line(2, 0), line(3, 1));
    let found = solved(&good).unwrap();
    assert_eq!((found.fixes.len(), found.notes.len()), (2, 1));
    assert_eq!(
        solved(&format!("{good}2139 4.0 45 7")).unwrap().fixes.len(),
        2
    );
    for (text, part) in [
        (format!("{good}2139 4.0 45 7\n"), "'line 7' has 4 columns"),
        (
            format!("{good}{}", line(3, 1)),
            "'line 7' is not after the line before",
        ),
        (
            good.replace("3.0 45", "3.0 95"),
            "'line 6' has the position 95",
        ),
        (
            good.replace("3.0 45", "3.0 x"),
            "'line 6' has 'x', which is not a number",
        ),
        (
            good.replace(" 5 9", " 0 9").replace(" 1 9", " 0 9"),
            "'solutions' are none",
        ),
    ] {
        let why = solved(&text).unwrap_err();
        assert!(why.contains(part), "{part}: {why}");
    }
}

#[test]
fn the_fixes_meet_the_clock_of_the_samples() {
    let gps = 2139.0 * WEEK_S + 210_030.0;
    let fix = TimedFix {
        time: gps,
        ..TimedFix::EMPTY
    };
    let at = |first: f64, origin: Option<f64>| {
        let mut record = Record {
            time: vec![first, first + 0.01].into(),
            ..Record::default()
        };
        let solutions = Solutions {
            fixes: vec![fix],
            notes: Vec::new(),
        };
        solutions.beside(&mut record, origin);
        record.fixes[0].time
    };
    assert_eq!(at(210_000.0, None), 210_030.0);
    let utc = GPS_START_S + gps - 18.0;
    assert_eq!(at(utc - 5.0, None), utc);
    assert_eq!(at(0.0, Some(utc - 7.0)), 7.0);
}

/// Zeros are no position, and a last line that is cut is none, even where its position is whole.
#[test]
fn zeros_and_a_cut_line_are_no_fixes() {
    let head = format!("{COMMENT}%  GPST latitude(deg) longitude(deg)  height(m)   {BEHIND}\n");
    let rest = "1  12   0.0100   0.0200   0.0300   0.0   0.0   0.0   0.00    5.0";
    let line = |second: u32, place: &str| format!("2021/01/05 10:20:{second}.000 {place} {rest}\n");
    let all = [
        line(10, "0.000000000 0.000000000 0.0000"),
        line(11, "-28.5 112.75 58.5"),
        line(12, "-28.5 112.75 58.5"),
    ];
    let text = head.clone() + &all.concat();
    let found = solved(&text).unwrap();
    assert_eq!(found.fixes.len(), 2);
    assert!(
        found.notes[0].ends_with("1 line holds no fix: the position is 0."),
        "{:?}",
        found.notes
    );
    let at = text.rfind("58.5").unwrap() + 2;
    let found = solved(&text[..at]).unwrap();
    assert_eq!((found.fixes.len(), found.fixes[0].height_m), (1, 58.5));
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.contains("the file ends within this line"))
    );
    let earth = "%  GPST x-ecef(m) y-ecef(m) z-ecef(m)";
    let zeros = line(10, "0.0000 0.0000 0.0000") + &line(11, "-2188000.1 5181000.5 2996000.2");
    let found = solved(&format!("{COMMENT}{earth} {BEHIND}\n{zeros}")).unwrap();
    assert_eq!(found.fixes.len(), 1);
}

/// RTKLIB writes zeros as velocities without Doppler, and says in a comment above what heights are.
#[test]
fn zero_velocities_are_none_and_geodetic_heights_are_noted() {
    let names = "GPST latitude(deg) longitude(deg) height(m)";
    let line = |velocity: &str| {
        format!("2139 210030.500 -28.5 112.75 58.5 1 12 .1 .1 .1 0 0 0 0 5 {velocity}\n")
    };
    let of = |velocity: &str| {
        let behind = format!("{BEHIND} vn(m/s) ve(m/s) vu(m/s) sdvn sdve sdvu sdvne sdveu sdvun");
        let comment = COMMENT.replace("ellipsoidal", "geodetic");
        solved(&format!("{comment}%  {names} {behind}\n{}", line(velocity))).unwrap()
    };
    let still = of("0.00000 0.00000 0.00000 0 0 0 0 0 0");
    assert!(!still.fixes[0].has(3..6) && still.notes[0].contains("above the geoid"));
    let moving = of("0.00000 0.10000 0.00000 0.1 0.1 0.1 0 0 0");
    assert_eq!(moving.fixes[0].velocity, [0.0, 0.1, 0.0]);
    assert!(moving.fixes[0].has(3..6));
}
