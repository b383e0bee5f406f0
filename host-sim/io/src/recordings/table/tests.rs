use super::*;
use std::io::Write;
use test_bench::recordings::{file, message};

fn complaint(bytes: &[u8]) -> String {
    let (_dir, path) = file("in.csv", bytes);
    message(&Table::<f64>::with_header(&path, "t,x").unwrap_err())
}

#[test]
fn plain_gzip_and_windows_files_read_alike() {
    let plain = b"t,x\n0.5,-1e-3\n1, 2\n".to_vec();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(&plain).unwrap();
    let windows = String::from_utf8(plain.clone())
        .unwrap()
        .replace('\n', "\r\n");
    for bytes in [
        plain.clone(),
        gzip.finish().unwrap(),
        windows.into_bytes(),
        [b"\xef\xbb\xbf".as_slice(), &plain].concat(),
    ] {
        let (_dir, path) = file("in.csv", &bytes);
        let table = Table::<f64>::with_header(&path, "t,x").unwrap();
        let rows: Vec<&[f64]> = table.rows().collect();
        assert_eq!(rows, [[0.5, -1e-3], [1.0, 2.0]]);
        table.check_rising(0).unwrap();
    }
}

#[test]
fn every_fault_names_its_location() {
    for (bytes, start) in [
        (b"".as_slice(), "in.csv: is empty"),
        (b"t,x\n", "in.csv: has a header and no data"),
        (b"\x7fELF\x02,x\n1,2\n", "in.csv: is not text"),
        (b"t,y\n1,2\n", "in.csv:1: header is 't,y'"),
        (b"t,x\n1,2\n3\n", "in.csv:3: 1 columns instead of 2"),
        (b"t,x\n1,2\n\n3,4\n", "in.csv:3: 0 columns"),
        (b"t,x\n1,2,3\n", "in.csv:2: 3 columns"),
        (b"t,x\n1,a\n", "in.csv:2: column 'x': 'a' is not a number"),
        (b"t,x\n1,\n", "in.csv:2: column 'x': '' is missing"),
        (b"t,x\nNaN,1\n", "in.csv:2: column 't': 'NaN' is not finite"),
        (
            b"t,x\n1,\xff\n",
            "in.csv:2: column 'x': '\u{fffd}' is not a number",
        ),
        (
            b"\x1f\x8b\x08",
            "in.csv: the compressed data end after 0 unpacked bytes; remedy",
        ),
    ] {
        let got = complaint(bytes);
        assert!(got.starts_with(start), "{got}");
    }
    let missing = Table::<f64>::with_header(Path::new("no/such.csv"), "t,x").unwrap_err();
    assert!(matches!(missing, Error::Missing { .. }));
}

#[test]
fn a_decimal_comma_is_a_point() {
    let parse = <f64 as Cell>::parse;
    assert_eq!(parse("-0,0128"), Ok(-0.0128));
    assert_eq!(parse("1,5e-3"), Ok(1.5e-3));
    for wrong in ["1,234,5", "1,234.5", "1.234,5", ","] {
        assert_eq!(parse(wrong), Err("not a number"), "{wrong}");
    }
}

/// A table with the columns t and x whose first and last line may be cut.
fn cut_table(path: &Path) -> Table {
    let source = Source::open(path, Separator::COMMA).unwrap();
    let layout = Layout {
        skip: 1,
        names: &["t", "x"].map(String::from),
        wanted: &[0, 1],
        gap: None,
        loose: usize::MAX,
        cut: true,
    };
    Table::read(&source, &layout).unwrap()
}

/// The rows of a file with the columns t and x, and the notes on it.
fn rows(bytes: &[u8]) -> (Vec<[f64; 2]>, Vec<String>) {
    let (_dir, path) = file("in.csv", bytes);
    let table = cut_table(&path);
    let rows = table.rows().map(|row| [row[0], row[1]]).collect();
    let name = path.display().to_string();
    let notes = table.notes.iter();
    (
        rows,
        notes.map(|note| note.replace(&name, "in.csv")).collect(),
    )
}

#[test]
fn loggers_habits_do_not_matter() {
    for bytes in [
        &b"t,x\r1,2\r3,4\r"[..],                  // carriage returns alone
        b"t,x\r1,2\r3,4",                         // the last one is missing
        b"t,x\r\r\n1,2\r\r\n3,4\r\r\n",           // two of them before each line feed
        b"t,x\n1,2,\n3,4,\n",                     // a separator at the end
        b"\"t\",\"x\"\n\"1\",\"2\"\n\" 3 \",4\n", // quotes
        b"t,x\n1,2\n3,4\n\n\n",                   // empty lines at the end
        b"t,x\r\n\r\n1,2\n\n \n3,4\r\n\r\n",      // and anywhere
        b"t,x\n1,2\n# paused\n3,4\n% the end\n",  // comments
    ] {
        assert_eq!(
            rows(bytes),
            (vec![[1.0, 2.0], [3.0, 4.0]], vec![]),
            "{bytes:?}"
        );
    }
    // a short file without the end of its last line: no line before that one counts as cut
    let short = vec![[1.0, 22.0], [3.0, 4.0], [5.0, 66.0]];
    assert_eq!(rows(b"t,x\n1,22\n3,4\n5,66"), (short, vec![]));
    // UTF-16 with its mark, both ways round, and packed
    for big in [false, true] {
        let wide = |text: &str| -> Vec<u8> {
            let units = text.encode_utf16();
            let bytes = units.map(|u| {
                if big {
                    u.to_be_bytes()
                } else {
                    u.to_le_bytes()
                }
            });
            bytes.flatten().collect()
        };
        let bytes = wide("\u{feff}t,x\r\n1,2\r\n3,4\r\n");
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packed.write_all(&bytes).unwrap();
        for bytes in [bytes, packed.finish().unwrap()] {
            assert_eq!(rows(&bytes), (vec![[1.0, 2.0], [3.0, 4.0]], vec![]));
        }
    }
    // a carriage return at the end of a piece of the file
    for length in 4090..4100 {
        let first = format!("t,x\r{:>length$},2\r", 1);
        let bytes = [first.as_bytes(), b"3,4\r"].concat();
        assert_eq!(rows(&bytes).0, [[1.0, 2.0], [3.0, 4.0]], "{length}");
    }
}

#[test]
fn a_first_or_last_line_that_is_cut_is_left_out_with_a_note() {
    let two = vec![[1.0, 2.0], [3.0, 4.0]];
    let last = "in.csv:4: the file ends within this line and is read up to it (was the power \
                cut?)";
    for end in [&b"5"[..], b"5,", b"5,-", b"5,6e-", b"\0\0\0\0"] {
        let bytes = [b"t,x\n1,2\n3,4\n", end].concat();
        assert_eq!(
            rows(&bytes),
            (two.clone(), vec![last.to_owned()]),
            "{end:?}"
        );
    }
    // the last number may lack digits where the line does not end and others are longer
    let (got, notes) = rows(b"t,x\n1,-9.81\n3,-9.82\n5,-9.");
    assert_eq!(
        (got.len(), notes),
        (2, vec![last.to_owned()]),
        "a number that is cut"
    );
    for whole in [&b"t,x\n1,2\n3,4"[..], b"t,x\n1,-9.81\n3,-9.\n"] {
        let (got, notes) = rows(whole);
        assert_eq!((got.len(), notes), (2, vec![]), "{whole:?}");
    }
    let first = "in.csv:2: the first line of data is not whole and is left out";
    for line in ["9", "s,m", "7e,9"] {
        let bytes = format!("t,x\n{line}\n1,2\n3,4\n");
        assert_eq!(
            rows(bytes.as_bytes()),
            (two.clone(), vec![first.to_owned()])
        );
    }
    // the line after it is the third, also in errors
    let (_dir, path) = file("in.csv", b"t,x\n9\n1,2\n1,4\n");
    let table = cut_table(&path);
    let back = message(&table.check_rising(0).unwrap_err());
    assert!(back.starts_with("in.csv:4:"), "{back}");
    // whole lines with a fault are no cut ones
    let why = complaint(b"t,x\n1,2\n3,4\n5\n");
    assert!(why.starts_with("in.csv:4: 1 columns"), "{why}");
    let why = complaint(b"t,x\n9\n8\n1,2\n");
    assert!(why.starts_with("in.csv:2: 1 columns"), "{why}");
    // files of a known length are read whole or not at all
    let why = complaint(b"t,x\n1,2\n3");
    assert!(why.starts_with("in.csv:3: 1 columns"), "{why}");
}

/// A gzipped file that is cut is read up to the last line that is whole.
#[test]
fn a_gzip_stream_that_is_cut_is_read_up_to_the_cut() {
    let row = |k: usize| [k as f64, f64::from(k as u32 * 7919 % 1000) - 0.5];
    let mut text = String::from("t,x\n");
    for k in 0..2000 {
        text += &format!("{},{}\n", row(k)[0], row(k)[1]);
    }
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(text.as_bytes()).unwrap();
    let packed = encoder.finish().unwrap();
    let mut before = 0;
    for cut in (packed.len() / 4..packed.len()).step_by(packed.len() / 16) {
        let (got, notes) = rows(&packed[..cut]);
        assert!(got.len() >= before && got.len() <= 2000, "{cut}");
        before = got.len();
        for (k, got) in got.iter().enumerate() {
            assert_eq!(*got, row(k), "{cut}");
        }
        let note = "the gzip stream is cut after this line; the file is read up to it";
        assert!(notes.iter().any(|text| text.ends_with(note)), "{notes:?}");
        // files of a known length are read whole or not at all
        let why = complaint(&packed[..cut]);
        assert!(why.contains("the compressed data end after "), "{why}");
    }
    assert!(before > 1000, "{before}");
    // damage is no cut
    let mut damaged = packed;
    let half = damaged.len() / 2;
    damaged[half..half + 20].fill(0x55);
    let (_dir, path) = file("in.csv", &damaged);
    let source = Source::open(&path, Separator::COMMA).unwrap();
    let names = ["t", "x"].map(String::from);
    let why = Table::<f64>::first_columns(&source, 1, &names, 2);
    let why = message(&why.unwrap_err());
    assert!(why.contains("the compressed data are damaged"), "{why}");
}

#[test]
fn a_long_file_is_read_in_pieces_and_keeps_only_what_is_wanted() {
    let mut text = String::from("t,x,y\n");
    for i in 0..20_000 {
        text += &format!("{i},{},7\n", 2 * i);
    }
    let (_dir, path) = file("in.csv", text.trim_end().as_bytes());
    let source = Source::open(&path, Separator::COMMA).unwrap();
    let layout = Layout {
        skip: 1,
        names: &["t", "x", "y"].map(String::from),
        wanted: &[0, 1],
        gap: None,
        loose: usize::MAX,
        cut: false,
    };
    for _ in 0..2 {
        let mut rest = Vec::new();
        let table = Table::<f64>::read_first(&source, &layout, 1, |row| {
            rest.extend_from_slice(row);
            Ok(())
        });
        let times: Vec<f64> = (0..20_000).map(f64::from).collect();
        assert_eq!(table.unwrap().values(), times);
        assert!(rest.iter().zip(&times).all(|(x, t)| *x == 2.0 * t));
        assert_eq!(rest.len(), 20_000);
    }
}

#[test]
fn time_must_rise_and_values_stay_in_range() {
    let (_dir, path) = file("in.csv", b"t,x\n1,2\n2,-9\n2,3\n");
    let table = Table::<f64>::with_header(&path, "t,x").unwrap();
    let back = message(&table.check_rising(0).unwrap_err());
    assert!(
        back.starts_with("in.csv:4: column 't': time 2 follows 2"),
        "{back}"
    );
    let wide = message(&table.check_within(1..2, 5.0, "give m").unwrap_err());
    assert_eq!(
        wide,
        "in.csv:3: column 'x': '-9' is out of range; remedy: give m"
    );
}

/// Comment lines among the data do not shift the lines that errors name.
#[test]
fn errors_name_the_line_behind_comments() {
    let text = b"# made by hand\n1,2\n2,3\n# a pause\n# a long one\n3,4\n3,5\n# more\n4,900\n";
    let (_dir, path) = file("in.csv", text);
    let names = ["t", "x"].map(String::from);
    let layout = Layout {
        skip: 0,
        names: &names,
        wanted: &[0, 1],
        gap: None,
        loose: usize::MAX,
        cut: true,
    };
    let source = Source::open(&path, Separator::COMMA).unwrap();
    let table = Table::<f64>::read(&source, &layout).unwrap();
    let line = |fault: Error| message(&fault);
    let back = line(table.check_rising(0).unwrap_err());
    assert!(back.starts_with("in.csv:7: "), "{back}");
    let large = line(table.check_within(1..2, 100.0, "").unwrap_err());
    assert!(large.starts_with("in.csv:9: "), "{large}");
    let first = line(table.complain(0, 1, "bad", ""));
    assert!(first.starts_with("in.csv:2: "), "{first}");
}
