use super::*;
use test_bench::recordings::{file, message};

fn read_text(text: &str) -> Result<Solutions, String> {
    let (_dir, path) = file("in.json", text.as_bytes());
    assert!(is_one(&path));
    read(&path, &|_, _| ()).map_err(|why| message(&why))
}

/// A report of a second with these fields.
fn report(second: u32, more: &str) -> String {
    format!(
        "{{\"class\":\"TPV\",\"device\":\"/dev/ttyS0\",\"mode\":3,\
         \"time\":\"2026-11-27T12:00:{second:02}.500Z\",\"lat\":45.5,\"lon\":-5.25{more}}}\n"
    )
}

/// 2026-11-27 is a Friday of GPS week 2446.
#[test]
fn every_form_of_a_report_gives_its_values() {
    let gps = 2446.0 * 604_800.0 + 5.0 * 86_400.0 + 43_200.5 + 18.0;
    let sixty = concat!(
        r#","altHAE":300.5,"track":60,"speed":10,"climb":0.5"#,
        r#","epx":1,"epy":2,"epv":3,"eps":0.3,"epc":0.4"#
    );
    let ned = r#","alt":300.5,"velN":5,"velE":8.660254,"velD":-0.5,"eph":2"#;
    let sum = r#","altMSL":250.5,"geoidSep":50,"speed":10,"track":60"#;
    let (half, none) = (2.0 * FRAC_1_SQRT_2, NOT_MEASURED);
    for (more, sigmas, notes) in [
        (sixty, [2.0, 1.0, 3.0, 0.3, 0.3, 0.4], 0),
        (ned, [half, half, 1.5, 0.1, 0.1, 0.1], 1),
        (sum, [1.0, 1.0, 1.5, 0.1, 0.1, none], 0),
    ] {
        let found = read_text(&report(0, more)).unwrap();
        let fix = found.fixes[0];
        assert!((fix.time - gps).abs() < 1e-6, "{}", fix.time - gps);
        assert_eq!(
            (fix.lat_deg, fix.lon_deg, fix.height_m),
            (45.5, -5.25, 300.5)
        );
        let [n, e, d] = fix.velocity;
        assert!(
            (n - 5.0).abs() < 1e-6 && (e - 8.660254).abs() < 1e-6,
            "{n} {e}"
        );
        assert!(d == -0.5 || sigmas[5] == none);
        assert_eq!(fix.sigmas, sigmas);
        assert_eq!(found.notes.len(), notes, "{:?}", found.notes);
    }
    // other logs have the second since 1970 and no class
    let unix = "\n {\"time\":1795780800.5,\"lat\":45.5,\"lon\":-5.25,\"speed\":0}";
    let fix = read_text(unix).unwrap().fixes[0];
    assert!((fix.time - gps).abs() < 1e-6, "{}", fix.time - gps);
    assert!(fix.has(3..5) && !fix.has(2..3) && !fix.has(5..6));
}

#[test]
fn what_is_no_fix_is_left_out_with_a_note() {
    let mode = report(1, "").replace("\"mode\":3", "\"mode\":1");
    let zero = report(2, "").replace("45.5", "0").replace("-5.25", "0.0");
    let other = report(3, "").replace("ttyS0", "ttyS1");
    let text = [
        "{\"class\":\"VERSION\",\"release\":\"3.25\"}\n{\"class\":\"SKY\",\"satellites\":[]}\n",
        &mode,
        &zero,
        &other,
        &report(4, ""),
        &report(4, ",\"altHAE\":300,\"speed\":1,\"track\":2"),
        &report(4, ",\"altHAE\":301"),
        "$GPGGA,of another tool\n{\"class\":\"TPV\",broken}\n",
        &report(5, ""),
        &report(3, ""),
        "{\"class\":\"TPV\",\"mo",
    ]
    .concat();
    let found = read_text(&text).unwrap();
    let last: Vec<f64> = found.fixes.iter().map(|fix| fix.time % 60.0).collect();
    assert_eq!(last, [22.5, 23.5]);
    assert_eq!(
        (found.fixes[0].height_m, values(&found.fixes[0])),
        (300.0, 5)
    );
    let notes = found.notes.join("\n");
    for part in [
        "2 receivers are in the log; '/dev/ttyS0' is used",
        "of its 3 fixes the 2 in the longest part",
        "2 reports hold no fix: the mode is 1, and lat and lon are 0",
        "1 line is not JSON",
        "the file ends within a line",
    ] {
        assert!(notes.contains(part), "no '{part}' in {notes}");
    }
    let why = read_text(&[&text[..60], "\n", &mode].concat()).unwrap_err();
    assert!(
        why.contains("has no fix; seen are 1 VERSION, 1 TPV of which the mode is 1"),
        "{why}"
    );
}
