//! Columns that hold something else than their header says, and logs of receivers that begin with
//! something else.

use super::edits::{
    Case, SIMULATED, STRICT, fixes, header, lines, read, simulated, without_velocities, write,
};

/// What `gpspipe -r` writes: lines of JSON, then the sentences of the receiver.
fn piped(dir: &std::path::Path) {
    let sentence = |text: &str| {
        let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
        format!("${text}*{sum:02X}\r\n")
    };
    let rmc = |line: &str| {
        let c: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        // time 0 of the samples is that of the week
        let time = (604_800.0 + c[0] - 18.0) as u32 % 86_400;
        let time = time / 3600 * 10_000 + time / 60 % 60 * 100 + time % 60;
        let angle = |deg: f64| format!("{:.5}", deg.trunc() * 100.0 + deg.fract() * 60.0);
        let (lat, lon) = (angle(c[1]), angle(c[2]));
        sentence(&format!("GPRMC,{time:06}.00,A,{lat},N,{lon},E,,,,,"))
    };
    let fixes: String = read(dir, "gnss.csv").lines().skip(1).map(rmc).collect();
    let head =
        "{\"class\":\"VERSION\",\"release\":\"3.25\"}\n{\"class\":\"DEVICES\",\"devices\":[]}\n";
    write(dir, "x.nmea", &format!("{head}{fixes}"));
}

fn exchanged(dir: &std::path::Path, to: &str) {
    header(dir, "'gx', 'gy', 'gz'", to);
}

pub const CASES: &[Case] = &[
    Case {
        input: "heights in km, given as m",
        make: |dir| fixes(dir, &[3], |v| v / 1e3),
        args: STRICT,
        printed: &["'gnss.height.unit'", "seem to be in km"],
        result: "warned",
    },
    Case {
        input: "heights of 0 beside vertical velocities",
        make: |dir| fixes(dir, &[3], |_| 0.0),
        args: STRICT,
        printed: &[
            "'gnss.height.unit' is 0 m at all fixes",
            "leave the height out",
        ],
        result: "warned",
    },
    Case {
        input: "the columns of the gyros y and z in each other's place",
        make: |dir| exchanged(dir, "'gx', 'gz', 'gy'"),
        args: STRICT,
        printed: &[
            "'imu.gyro'",
            "the axes called right and down seem to have changed places",
        ],
        result: "warned",
    },
    Case {
        input: "the same without velocities",
        make: |dir| {
            exchanged(dir, "'gx', 'gz', 'gy'");
            without_velocities(dir);
        },
        args: STRICT,
        printed: &[
            "'imu.gyro'",
            "the axes called right and down seem to have changed places",
        ],
        result: "warned",
    },
    Case {
        input: "the gyros x and z in each other's place, without velocities",
        make: |dir| {
            exchanged(dir, "'gz', 'gy', 'gx'");
            without_velocities(dir);
        },
        args: STRICT,
        printed: &[
            "'imu.gyro'",
            "the axes called forward and down seem to have changed places",
        ],
        result: "warned",
    },
    Case {
        input: "the gyros x and y of a car in a city in each other's place",
        make: |dir| {
            simulated(dir, "city");
            lines(dir, "imu.csv", |_, cells| cells.swap(1, 2));
        },
        args: SIMULATED,
        printed: &["the axes called forward and right seem to have changed places"],
        result: "warned",
    },
    Case {
        input: "the gyros y and z of a car in a city in each other's place",
        make: |dir| {
            simulated(dir, "city");
            lines(dir, "imu.csv", |_, cells| cells.swap(2, 3));
        },
        args: SIMULATED,
        printed: &["the axes called right and down seem to have changed places"],
        result: "warned",
    },
    Case {
        input: "sentences behind lines of JSON, as `gpspipe -r` writes them, beside the samples",
        make: piped,
        args: "convert csv --header header.toml --fixes x.nmea --to csv --out o",
        printed: &["361 fixes (NMEA)"],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "the log of a SiRF receiver (binary) beside the samples",
        make: |dir| {
            let message = [0xA0, 0xA2, 0, 3, 2, 4, 6, 0, 12, 0xB0, 0xB3];
            std::fs::write(dir.join("x.log"), message.repeat(100)).unwrap();
        },
        args: "convert csv --header header.toml --fixes x.log --to csv --out o",
        printed: &[
            "seen are SiRF (binary): 100 messages",
            "log its reports (gpspipe -w)",
        ],
        result: "refused",
    },
];
