//! Forms of files, what gets lost in conversions, and what commands refuse.

use super::edits::{
    CONVERT, Case, fixes, gpsd, gzip, header, lines, read, repeat_a_stamp, rest, text,
    three_of_four, wide, write,
};

pub const CASES: &[Case] = &[
    Case {
        input: "a table without heights, to CSV",
        make: |dir| header(dir, "height = { column = 'h', unit = 'm' }\n", ""),
        args: CONVERT,
        printed: &[],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "the same, to KF-GINS text",
        make: |dir| header(dir, "height = { column = 'h', unit = 'm' }\n", ""),
        args: "convert csv --header header.toml --to kf-gins --out o",
        printed: &["361 of 361 fixes lack position, height"],
        result: "35\u{a0}999 samples, 0 fixes",
    },
    Case {
        input: "10 fixes without velocity, to KF-GINS text with velocities",
        make: |dir| {
            lines(dir, "gnss.csv", |k, cells| {
                if k % 36 == 7 {
                    cells[4..7].fill(String::new());
                }
            });
        },
        args: "convert csv --header header.toml --to kf-gins --velocity --out o",
        printed: &["10 of 361 fixes lack position, height or velocity"],
        result: "35\u{a0}999 samples, 351 fixes",
    },
    Case {
        input: "fixes before the first and after the last sample",
        make: |dir| fixes(dir, &[0], |t| 1.2 * t - 30.0),
        args: CONVERT,
        printed: &["60 of 361 fixes are outside the time of the samples"],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "KF-GINS text whose 13 columns have the standard deviations before the velocity",
        make: |dir| {
            text(dir, "k/gnss.txt", |old| {
                let each = old.lines().map(|line| {
                    let c: Vec<&str> = line.split(' ').collect();
                    [&c[..4], &c[7..10], &c[4..7], &c[10..]].concat().join(" ") + "\n"
                });
                each.collect()
            });
        },
        args: "convert kf-gins k/imu.txt k/gnss.txt --to csv --out o",
        printed: &[
            "are read as standard deviations of position, velocity",
            "--gnss-order",
        ],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "the same in the usual order",
        make: |_| (),
        args: "convert kf-gins k/imu.txt k/gnss.txt --to csv --out o",
        printed: &["are read as velocity, then the standard deviations"],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "solutions of RTKLIB (`.pos`) beside the samples",
        make: |dir| {
            let names = "%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m)";
            let mut out = format!("% program   : RTKPOST\n{names}\n");
            for line in read(dir, "gnss.csv").lines().skip(1) {
                let c: Vec<&str> = line.split(',').collect();
                out += &format!(
                    "2300 {} {} {} {} 1 12 0.02 0.02 0.04\n",
                    c[0], c[1], c[2], c[3]
                );
            }
            write(dir, "x.pos", &out);
        },
        args: "convert csv --header header.toml --fixes x.pos --to csv --out o",
        printed: &["x.pos: 361 fixes (RTKLIB)"],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "reports of gpsd (lines of JSON) beside the samples",
        make: |dir| write(dir, "x.json", &gpsd(dir)),
        args: "convert csv --header header.toml --fixes x.json --to csv --out o",
        printed: &["x.json: 361 fixes (gpsd)"],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "the same in UTF-16, with a last line that is cut",
        make: |dir| {
            let text = gpsd(dir);
            wide(dir, "x.json", &text[..text.len() - 30]);
        },
        args: "convert csv --header header.toml --fixes x.json --to csv --out o",
        printed: &["x.json: 360 fixes (gpsd)", "ends within a line"],
        result: "35\u{a0}999 samples, 360 fixes",
    },
    Case {
        input: "a spreadsheet's \"Unicode text\" (UTF-16, tabs)",
        make: |dir| {
            wide(dir, "imu.csv", &read(dir, "imu.csv").replace(',', "\t"));
            header(dir, "[imu]", "[imu]\nseparator = 'tab'");
        },
        args: CONVERT,
        printed: &[],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "lines of a logger before the names of the columns",
        make: |dir| {
            let before = "Logger 2.1, serial 17\n# started 2024-05-05\n\n";
            text(dir, "imu.csv", |old| format!("{before}{old}"));
        },
        args: CONVERT,
        printed: &[],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "a comma at the end of each line, numbers in quotes, carriage returns alone",
        make: |dir| {
            lines(dir, "imu.csv", |_, cells| {
                cells
                    .iter_mut()
                    .for_each(|cell| *cell = format!("\"{cell}\""));
                cells.push(String::new());
            });
            text(dir, "imu.csv", |old| old.replace('\n', "\r"));
        },
        args: CONVERT,
        printed: &[],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "columns that are separated by semicolons, with a header that says commas",
        make: |dir| text(dir, "imu.csv", |old| old.replace(',', ";")),
        args: CONVERT,
        printed: &["the columns seem to be separated by ';': say so in 'imu.separator'"],
        result: "refused",
    },
    Case {
        input: "samples of `nan`",
        make: |dir| {
            lines(dir, "imu.csv", |k, cells| {
                if (20_000..20_004).contains(&k) {
                    cells[1..].fill("nan".into());
                }
            });
        },
        args: CONVERT,
        printed: &["4 lines of imu.csv hold no whole sample"],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "a last line that a power cut has cut",
        make: |dir| text(dir, "imu.csv", |old| old[..old.len() - 60].to_owned()),
        args: CONVERT,
        printed: &["imu.csv:36001: the file ends within this line"],
        result: "35\u{a0}998 samples, 361 fixes",
    },
    Case {
        input: "a last line that lacks digits of its last number, and no end of a line",
        make: |dir| text(dir, "imu.csv", |old| old[..old.len() - 4].to_owned()),
        args: CONVERT,
        printed: &["imu.csv:36001: the file ends within this line"],
        result: "35\u{a0}998 samples, 361 fixes",
    },
    Case {
        input: "a gzipped file whose last part is missing",
        make: |dir| {
            gzip(dir, "imu.csv", 0.5);
        },
        args: CONVERT,
        printed: &[
            "the gzip stream is cut after this line; the file is read up to it",
            "of 361 fixes are outside the time of the samples",
        ],
        result: " samples, 361 fixes",
    },
    Case {
        input: "KF-GINS text with a first and a last line that are cut",
        make: |dir| text(dir, "k/imu.txt", |old| old[40..old.len() - 40].to_owned()),
        args: "convert kf-gins k/imu.txt k/gnss.txt --to csv --out o",
        printed: &[
            "k/imu.txt:1: the first line of data is not whole",
            "k/imu.txt:35999: the file ends within this line",
        ],
        result: "35\u{a0}997 samples, 361 fixes",
    },
    Case {
        input: "a pointer of git-lfs in place of the file",
        make: |dir| {
            let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n";
            write(dir, "imu.csv", pointer);
        },
        args: CONVERT,
        printed: &["imu.csv: is only a pointer of git-lfs", "git lfs pull"],
        result: "refused",
    },
    Case {
        input: "a web page in place of the file",
        make: |dir| write(dir, "gnss.csv", "<!DOCTYPE html>\n<html>Log in</html>\n"),
        args: CONVERT,
        printed: &["gnss.csv: is a web page (HTML)", "download the file itself"],
        result: "refused",
    },
    Case {
        input: "a spreadsheet (.xlsx) in place of the file",
        make: |dir| write(dir, "gnss.csv", "PK\u{3}\u{4}\u{14}"),
        args: CONVERT,
        printed: &["gnss.csv: is a zip archive or a spreadsheet", "as CSV"],
        result: "refused",
    },
    Case {
        input: "a gzipped file of which only the first bytes are there",
        make: |dir| gzip(dir, "imu.csv", 1e-6),
        args: CONVERT,
        printed: &["imu.csv: the compressed data end after 0 unpacked bytes"],
        result: "refused",
    },
    Case {
        input: "one line of the fixes twice",
        make: |dir| {
            text(dir, "gnss.csv", |old| {
                let line = old.lines().nth(200).unwrap();
                old.replacen(line, &format!("{line}\n{line}"), 1)
            });
        },
        args: CONVERT,
        printed: &["1 line from 199 to 199 s holds no fix: the time is that of the line before"],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "one line of the samples twice",
        make: |dir| {
            text(dir, "imu.csv", |old| {
                let line = old.lines().nth(200).unwrap();
                old.replacen(line, &format!("{line}\n{line}"), 1)
            });
        },
        args: CONVERT,
        printed: &[
            "imu.csv:202: column 't': time 2 follows 2",
            "the same time comes twice",
        ],
        result: "refused",
    },
    Case {
        input: "a column `valid` of the letters A and V, as in NMEA",
        make: |dir| {
            text(dir, "gnss.csv", |old| old.replacen("vd\n", "vd,valid\n", 1));
            lines(dir, "gnss.csv", |k, cells| {
                cells.push(if k < 10 { "V" } else { "A" }.to_owned());
            });
        },
        args: CONVERT,
        printed: &["10 lines from 0 to 9 s hold no fix: 'valid' says that there is none"],
        result: "35\u{a0}999 samples, 351 fixes",
    },
    Case {
        input: "a file with one sample",
        make: |dir| {
            text(dir, "imu.csv", |old| {
                old.lines().take(2).map(|l| format!("{l}\n")).collect()
            });
        },
        args: CONVERT,
        printed: &["'imu.file' has 1 whole samples"],
        result: "refused",
    },
    Case {
        input: "rates under names of increments, to `allan`",
        make: |dir| {
            rest(
                dir,
                "t_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dv_x_mps,dv_y_mps,dv_z_mps",
                1.0,
            );
        },
        args: "allan rest.csv",
        printed: &[
            "rest.csv: has a mean specific force of 97",
            "hold rates (rad/s, m/s2), not increments",
        ],
        result: "refused",
    },
    Case {
        input: "times in ms under the name `t_s`, to `allan`",
        make: |dir| {
            rest(
                dir,
                "t_s,wx_radps,wy_radps,wz_radps,ax_mps2,ay_mps2,az_mps2",
                1000.0,
            );
        },
        args: "allan rest.csv",
        printed: &["column 't_s'", "in ms they would be 100 samples a second"],
        result: "refused",
    },
    Case {
        input: "lines before the names, semicolons and UTF-16, to `allan`",
        make: |dir| {
            rest(
                dir,
                "t_s,wx_radps,wy_radps,wz_radps,ax_mps2,ay_mps2,az_mps2",
                1.0,
            );
            let text = format!("Logger 2.1\n\n{}", read(dir, "rest.csv"));
            wide(dir, "rest.csv", &text.replace(',', ";"));
        },
        args: "allan rest.csv --column wx_radps",
        printed: &["the lines before line 3 are left out"],
        result: "",
    },
    Case {
        input: "accelerometers in m/s2 under names of g, to `allan`",
        make: |dir| rest(dir, "t_s,wx_radps,wy_radps,wz_radps,ax_g,ay_g,az_g", 1.0),
        args: "allan rest.csv",
        printed: &["the accelerometers are in m/s2, not in g"],
        result: "refused",
    },
    Case {
        input: "one stamp twice in a bag",
        make: |dir| {
            // the stamps of the header of the samples 100 and 101 become the same
            let mut bytes = std::fs::read(dir.join("drive.mcap")).unwrap();
            repeat_a_stamp(&mut bytes);
            std::fs::write(dir.join("drive.mcap"), bytes).unwrap();
        },
        args: "convert mcap drive.mcap --to csv --out o",
        printed: &["has the time", "--bag-time"],
        result: "refused",
    },
    Case {
        input: "a log of PX4 in which a quarter of the samples is missing",
        make: |dir| {
            let log = std::fs::read(dir.join("flight.ulg")).unwrap();
            std::fs::write(dir.join("flight.ulg"), three_of_four(&log)).unwrap();
        },
        args: "convert ulog flight.ulg --to csv --out o",
        printed: &["is logged for 75"],
        result: "refused",
    },
    Case {
        input: "a simulation into the folder of a recording",
        make: |_| (),
        args: "simulate --out .",
        printed: &["--out: has the file", "--force"],
        result: "refused",
    },
    Case {
        input: "a recording converted into its own folder",
        make: |_| (),
        args: "convert csv --header header.toml --to csv --out .",
        printed: &["--out: has the file", "--force"],
        result: "refused",
    },
    Case {
        input: "an angle random walk in deg/s/sqrt(Hz), given as deg/sqrt(h)",
        make: |dir| {
            let out = crate::host_sim(dir, "unit show stim300").success();
            let unit = String::from_utf8(out.get_output().stdout.clone()).unwrap();
            let key = "angle_random_walk_dpsqrth = 0.15";
            assert!(unit.contains(key), "{unit}");
            write(
                dir,
                "u.toml",
                &unit.replacen(key, "angle_random_walk_dpsqrth = 0.0025", 1),
            );
        },
        args: "unit check u.toml",
        printed: &[
            "is 0.0025 deg/sqrt(h), less than gyros of 10.8 deg/h have",
            "multiply by 60",
        ],
        result: "",
    },
];
