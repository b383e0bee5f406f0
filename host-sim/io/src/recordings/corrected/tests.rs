use super::*;
use crate::recordings::table::Separator;
use host_core::inertial::axes::Axes;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::io::Write;
use test_bench::recordings::file;

/// Right-forward-up, with the time after the gyros and a text between the triads.
fn original(path: &Path, separator: Separator, skip: usize) -> Original {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let columns = axes.map(|axis| Axes::RIGHT_FORWARD_UP.turn(axis));
    let columns = SampleColumns {
        time: 3,
        columns: [[0, 1, 2], [5, 4, 6]],
        units: [0.5, 2.0],
        turn: Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns)),
    };
    Original::Text(Text::new(path.to_path_buf(), separator, skip, columns))
}

/// 0.25 rad/s to the right (x of the file) and 1 m/s2 down (-z of the file).
fn taken() -> [Increment; 2] {
    let second = Increment {
        dtheta: Vector3::new(0.0, 0.25, 0.0),
        dv: Vector3::new(0.0, 0.0, 1.0),
    };
    [Increment::default(), second]
}

#[test]
fn only_numbers_that_change_are_rewritten() {
    for (separator, skip, text, want) in [
        (
            Separator::COMMA,
            1,
            "names,,\r\n1.50,2,3,0.1,5.0,6.00,7\r\n 1.50 ,2,3,0.2,5.0,6.00,7e0",
            "names,,\r\n1.50,2,3,0.1,5.0,6.00,7\r\n 1 ,2,3,0.2,5.0,6.00,7.5",
        ),
        (
            Separator::Char(b'\t'),
            0,
            "\u{feff}1\t2\t3\t4\t5\t6\t7\n0.5001\t2\t3\t4\t5\t6\t-0.5\n",
            "\u{feff}1\t2\t3\t4\t5\t6\t7\n9.999999999998899e-5\t2\t3\t4\t5\t6\t0e0\n",
        ),
        (
            Separator::Blank,
            0,
            "  1  2 3\t4 5 6 7 \n  1  2 3\t4 5 6   7 \n",
            "  1  2 3\t4 5 6 7 \n  0.5  2 3\t4 5 6   7.5 \n",
        ),
        (
            Separator::BlankOrComma,
            0,
            "1, 2 3,4 5 6 7\n1, 2 3,4 5 6 7\n",
            "1, 2 3,4 5 6 7\n0.5, 2 3,4 5 6 7.5\n",
        ),
        // decimal commas
        (
            Separator::Char(b';'),
            0,
            "1,50;2;3;0,1;5,0;6;7,25\n1,50;2;3;0,2;5,0;6;7,25\n",
            "1,50;2;3;0,1;5,0;6;7,25\n1;2;3;0,2;5,0;6;7,75\n",
        ),
        // a time that is missing, and lines of comments
        (
            Separator::COMMA,
            1,
            "names\n1,2,3,1,5,6,7\n#1,2,3,2,5,6,7\n1,2,3,nan,5,6,7\n1,2,3,3,5,6,7\n",
            "names\n1,2,3,1,5,6,7\n#1,2,3,2,5,6,7\n1,2,3,nan,5,6,7\n0.5,2,3,3,5,6,7.5\n",
        ),
    ] {
        let (_dir, path) = file("in.csv", text.as_bytes());
        let original = original(&path, separator, skip);
        let got =
            |taken: &[Increment]| String::from_utf8(original.without(taken).unwrap()).unwrap();
        assert_eq!(got(&taken()), want);
        assert_eq!(got(&[Increment::default(); 2]), text);
    }
}

#[test]
fn a_packed_file_is_read_and_another_file_is_noticed() {
    let text = b"1,2,3,4,5,6,7\n1,2,3,4,5,6,7\n";
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(text).unwrap();
    let (_dir, path) = file("in.csv", &gzip.finish().unwrap());
    let packed = original(&path, Separator::COMMA, 0);
    let got = packed.without(&taken()).unwrap();
    assert_eq!(got, b"1,2,3,4,5,6,7\n0.5,2,3,4,5,6,7.5\n");
    let zstd =
        ruzstd::encoding::compress_to_vec(&text[..], ruzstd::encoding::CompressionLevel::Fastest);
    let (_dir, path) = file("in.csv", &zstd);
    let packed = original(&path, Separator::COMMA, 0);
    let got = packed.without(&taken()).unwrap();
    assert_eq!(got, b"1,2,3,4,5,6,7\n0.5,2,3,4,5,6,7.5\n");
    let three = [taken()[1]; 3];
    for (text, taken) in [
        ("1,2,3,4,5,6,7\n", &three[..2]),                // lines are missing
        ("1,2,3,4,5,6,7\n1,2,3,4,5,6,7\n", &three[..1]), // there are more
        ("1,2,x,4,5,6,7\n", &three[..1]),
        ("1,2,3,4\n", &three[..1]),
    ] {
        let (_dir, path) = file("in.csv", text.as_bytes());
        let why = original(&path, Separator::COMMA, 0).without(taken);
        let why = why.unwrap_err().to_string();
        assert!(
            why.contains("is not the sample that was read before"),
            "{why}"
        );
    }
}
