//! The inputs: how each differs from the right one, and what is to be told.

use std::path::Path;

/// An input.
pub struct Case {
    /// The input in words, for the page.
    pub input: &'static str,
    /// Makes it from the right files.
    pub make: fn(&Path),
    /// The command.
    pub args: &'static str,
    /// Parts of what is told.
    pub told: &'static [&'static str],
    /// A part of the result.
    pub result: &'static str,
}

const CONVERT: &str = "convert csv --header header.toml --to csv --out o";
const STRICT: &str = "replay csv --header header.toml --unit tactical --strict";

fn read(dir: &Path, name: &str) -> String {
    std::fs::read_to_string(dir.join(name)).unwrap()
}

fn write(dir: &Path, name: &str, text: &str) {
    std::fs::write(dir.join(name), text).unwrap();
}

/// Changes a file as a text.
fn text(dir: &Path, name: &str, change: impl Fn(&str) -> String) {
    write(dir, name, &change(&read(dir, name)));
}

/// Changes the cells of each line below the names, counted from 0.
fn lines(dir: &Path, name: &str, change: impl Fn(usize, &mut Vec<String>)) {
    text(dir, name, |old| {
        let (names, rest) = old.split_once('\n').unwrap();
        let changed = rest.lines().enumerate().map(|(k, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            change(k, &mut cells);
            cells.join(",") + "\n"
        });
        format!("{names}\n{}", changed.collect::<String>())
    });
}

/// Multiplies and adds to cells of gnss.csv: t, lat, lon, h, vn, ve, vd.
fn fixes(dir: &Path, columns: &[usize], change: impl Fn(f64) -> f64) {
    lines(dir, "gnss.csv", |_, cells| {
        for column in columns {
            cells[*column] = format!("{:?}", change(cells[*column].parse().unwrap()));
        }
    });
}

fn header(dir: &Path, from: &str, to: &str) {
    text(dir, "header.toml", |old| {
        assert!(old.contains(from), "{from}");
        old.replacen(from, to, 1)
    });
}

pub const CASES: &[Case] = &[
    Case {
        input: "latitude, longitude and height 0 for the first 40 s",
        make: |dir| {
            lines(dir, "gnss.csv", |k, cells| {
                if k < 40 {
                    cells[1..4].fill("0".into());
                }
            });
        },
        args: CONVERT,
        told: &["40 lines from 0 to 39 s are no fixes: latitude and longitude are 0"],
        result: "36000 samples, 321 fixes",
    },
    Case {
        input: "the same for 5 s in mid-drive",
        make: |dir| {
            lines(dir, "gnss.csv", |k, cells| {
                if (200..205).contains(&k) {
                    cells[1..4].fill("0.0".into());
                }
            });
        },
        args: CONVERT,
        told: &["5 lines from 200 to 204 s are no fixes"],
        result: "36000 samples, 356 fixes",
    },
    Case {
        input: "a column `fix_type` that is 0, and `hdop` that is 99.99, without a fix",
        make: |dir| {
            text(dir, "gnss.csv", |old| {
                old.replacen("vd\n", "vd,fix_type,hdop\n", 1)
            });
            lines(dir, "gnss.csv", |k, cells| {
                let (kind, dilution) = match k {
                    0..30 => ("0", "99.99"),
                    30..50 => ("3", "99.99"),
                    _ => ("3", "0.8"),
                };
                cells.extend([kind.to_owned(), dilution.to_owned()]);
            });
        },
        args: CONVERT,
        told: &[
            "30 lines from 0 to 29 s are no fixes: 'fix_type' is 0",
            "20 lines from 30 to 49 s",
        ],
        result: "36000 samples, 311 fixes",
    },
    Case {
        input: "a `status` of -1 before the first fix, as in ROS",
        make: |dir| {
            text(dir, "gnss.csv", |old| {
                old.replacen("vd\n", "vd,field.status.status\n", 1)
            });
            lines(dir, "gnss.csv", |k, cells| {
                cells.push(if k < 10 { "-1" } else { "0" }.to_owned());
            });
        },
        args: CONVERT,
        told: &["10 lines from 0 to 9 s are no fixes: 'field.status.status' is -1"],
        result: "36000 samples, 351 fixes",
    },
    Case {
        input: "positions in rad, told as deg",
        make: |dir| fixes(dir, &[1, 2], f64::to_radians),
        args: STRICT,
        told: &["'gnss.latitude.unit'", "the unit 'rad' would fit"],
        result: "warned",
    },
    Case {
        input: "positions in deg, told as rad",
        make: |dir| {
            text(dir, "header.toml", |old| {
                old.replace("unit = 'deg'", "unit = 'rad'")
            })
        },
        args: CONVERT,
        told: &["not on Earth", "the positions are in deg"],
        result: "refused",
    },
    Case {
        input: "latitude and longitude in each other's column",
        make: |dir| {
            lines(dir, "gnss.csv", |_, cells| {
                cells[2] = "113.5".into();
                cells.swap(1, 2);
            });
        },
        args: CONVERT,
        told: &["may have changed places"],
        result: "refused",
    },
    Case {
        input: "velocities in km/h, told as m/s",
        make: |dir| fixes(dir, &[4, 5, 6], |v| 3.6 * v),
        args: STRICT,
        told: &["'gnss.velocity.unit'", "the unit 'km/h' would fit"],
        result: "warned",
    },
    Case {
        input: "velocities in knots, told as m/s",
        make: |dir| fixes(dir, &[4, 5, 6], |v| v * 3600.0 / 1852.0),
        args: STRICT,
        told: &["'gnss.velocity.unit'", "the unit 'knots' would fit"],
        result: "warned",
    },
    Case {
        input: "velocities east-north-up, told as ned",
        make: |dir| {
            fixes(dir, &[6], |v| -v);
            lines(dir, "gnss.csv", |_, cells| cells.swap(4, 5));
        },
        args: STRICT,
        told: &["'gnss.velocity.order'", "the order 'enu' would fit"],
        result: "warned",
    },
    Case {
        input: "one column named for two axes",
        make: |dir| header(dir, "'gx', 'gy', 'gz'", "'gx', 'gy', 'gy'"),
        args: CONVERT,
        told: &["'imu.gyro' names column 'gy', which 'gyro' names already"],
        result: "refused",
    },
    Case {
        input: "the columns of x and z swapped",
        make: |dir| {
            header(dir, "'gx', 'gy', 'gz'", "'gz', 'gy', 'gx'");
            header(dir, "'ax', 'ay', 'az'", "'az', 'ay', 'ax'");
        },
        args: STRICT,
        told: &["'imu.axes'", "the axis that points down"],
        result: "warned",
    },
    Case {
        input: "rates in deg/s, told as rad/s",
        make: |dir| {
            lines(dir, "imu.csv", |_, cells| {
                for cell in &mut cells[1..4] {
                    *cell = format!("{:?}", cell.parse::<f64>().unwrap().to_degrees());
                }
            });
        },
        args: STRICT,
        told: &["'imu.gyro.unit'", "the unit 'deg/s' would fit"],
        result: "warned",
    },
    Case {
        input: "accelerometers in g, told as m/s^2",
        make: |dir| {
            lines(dir, "imu.csv", |_, cells| {
                for cell in &mut cells[4..7] {
                    *cell = format!("{:?}", cell.parse::<f64>().unwrap() / 9.80665);
                }
            });
        },
        args: STRICT,
        told: &["'imu.accel.unit'", "the unit 'g' would fit"],
        result: "warned",
    },
    Case {
        input: "fixes in UTC, samples in GPS time",
        make: |dir| fixes(dir, &[0], |t| t - 18.0),
        args: STRICT,
        told: &[
            "'gnss.time_offset_s'",
            "GPS time is 18 s ahead of UTC since 2017",
        ],
        result: "warned",
    },
    Case {
        input: "fixes in local time, 8 h ahead",
        make: |dir| fixes(dir, &[0], |t| t + 28_800.0),
        args: STRICT,
        told: &[
            "'time' has no whole second",
            "give -28800 s",
            "8 h is the difference of a time zone",
        ],
        result: "refused",
    },
    Case {
        input: "times of the fixes in ms, told as s",
        make: |dir| fixes(dir, &[0], |t| 1000.0 * (t + 400_000.0)),
        args: STRICT,
        told: &["'time' has no whole second"],
        result: "refused",
    },
    Case {
        input: "times of the samples in ms, told as s",
        make: |dir| {
            lines(dir, "imu.csv", |_, cells| {
                cells[0] = format!("{}", 1000.0 * cells[0].parse::<f64>().unwrap());
            });
        },
        args: CONVERT,
        told: &["'imu.time' has a median step of 10 s", "'ms' would fit"],
        result: "refused",
    },
    Case {
        input: "seconds of week over the end of a week",
        make: |dir| {
            let week = |t: f64| (t + 604_700.0) % 604_800.0;
            fixes(dir, &[0], week);
            lines(dir, "imu.csv", |_, cells| {
                cells[0] = format!("{:.2}", week(cells[0].parse().unwrap()));
            });
        },
        args: CONVERT,
        told: &[
            "seconds of week of the samples begin anew",
            "seconds of week of the fixes",
        ],
        result: "36000 samples, 361 fixes",
    },
    Case {
        input: "a table without heights, to CSV",
        make: |dir| header(dir, "height = { column = 'h', unit = 'm' }\n", ""),
        args: CONVERT,
        told: &[],
        result: "36000 samples, 361 fixes",
    },
    Case {
        input: "the same, to KF-GINS text",
        make: |dir| header(dir, "height = { column = 'h', unit = 'm' }\n", ""),
        args: "convert csv --header header.toml --to kf-gins --out o",
        told: &["361 of 361 fixes lack position, height"],
        result: "36000 samples, 0 fixes",
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
        told: &["10 of 361 fixes lack position, height or velocity"],
        result: "36000 samples, 351 fixes",
    },
    Case {
        input: "fixes before the first and after the last sample",
        make: |dir| fixes(dir, &[0], |t| 1.2 * t - 30.0),
        args: CONVERT,
        told: &["61 of 361 fixes are outside the time of the samples"],
        result: "36000 samples, 361 fixes",
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
        told: &[
            "are read as standard deviations of position, velocity",
            "--gnss-order",
        ],
        result: "36000 samples, 361 fixes",
    },
    Case {
        input: "the same in the usual order",
        make: |_| (),
        args: "convert kf-gins k/imu.txt k/gnss.txt --to csv --out o",
        told: &["are read as velocity, then the standard deviations"],
        result: "36000 samples, 361 fixes",
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
        told: &["x.pos: 361 fixes (RTKLIB)"],
        result: "36000 samples, 361 fixes",
    },
    Case {
        input: "lines of a logger before the names of the columns",
        make: |dir| {
            let before = "Logger 2.1, serial 17\n# started 2024-05-05\n\n";
            text(dir, "imu.csv", |old| format!("{before}{old}"));
        },
        args: CONVERT,
        told: &[],
        result: "36000 samples, 361 fixes",
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
        told: &[],
        result: "36000 samples, 361 fixes",
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
        told: &["4 lines of imu.csv hold no whole sample"],
        result: "35996 samples, 361 fixes",
    },
    Case {
        input: "a last line that a power cut has cut",
        make: |dir| text(dir, "imu.csv", |old| old[..old.len() - 60].to_owned()),
        args: CONVERT,
        told: &["imu.csv:36001: the file ends within this line"],
        result: "35999 samples, 361 fixes",
    },
    Case {
        input: "KF-GINS text with a first and a last line that are cut",
        make: |dir| text(dir, "k/imu.txt", |old| old[40..old.len() - 40].to_owned()),
        args: "convert kf-gins k/imu.txt k/gnss.txt --to csv --out o",
        told: &[
            "k/imu.txt:1: the first line of data is not whole",
            "k/imu.txt:36000: the file ends within this line",
        ],
        result: "35998 samples, 361 fixes",
    },
    Case {
        input: "a pointer of git-lfs in place of the file",
        make: |dir| {
            let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n";
            write(dir, "imu.csv", pointer);
        },
        args: CONVERT,
        told: &["imu.csv: is only a pointer of git-lfs", "git lfs pull"],
        result: "refused",
    },
    Case {
        input: "a file with one sample",
        make: |dir| {
            text(dir, "imu.csv", |old| {
                old.lines().take(2).map(|l| format!("{l}\n")).collect()
            })
        },
        args: CONVERT,
        told: &["'imu.file' has 1 whole samples"],
        result: "refused",
    },
    Case {
        input: "rates under names of increments, to `allan`",
        make: |dir| {
            rest(
                dir,
                "t_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dv_x_mps,dv_y_mps,dv_z_mps",
                1.0,
            )
        },
        args: "allan rest.csv",
        told: &[
            "rest.csv: has a mean specific force of 98",
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
            )
        },
        args: "allan rest.csv",
        told: &["column 't_s'", "in ms they would be 100 samples a second"],
        result: "refused",
    },
    Case {
        input: "accelerometers in m/s2 under names of g, to `allan`",
        make: |dir| rest(dir, "t_s,wx_radps,wy_radps,wz_radps,ax_g,ay_g,az_g", 1.0),
        args: "allan rest.csv",
        told: &["the accelerometers are in m/s2, not in g"],
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
        told: &["has the time", "--bag-time"],
        result: "refused",
    },
    Case {
        input: "a simulation into the folder of a recording",
        make: |_| (),
        args: "simulate --out .",
        told: &["--out: has the file", "--force"],
        result: "refused",
    },
    Case {
        input: "a recording converted into its own folder",
        make: |_| (),
        args: "convert csv --header header.toml --to csv --out .",
        told: &["--out: has the file", "--force"],
        result: "refused",
    },
    Case {
        input: "an angle random walk in deg/s/sqrt(Hz), told as deg/sqrt(h)",
        make: |dir| {
            let out = super::host_sim(dir, "unit show stim300").success();
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
        told: &[
            "is 0.0025 deg/sqrt(h), less than gyros of 10.8 deg/h have",
            "multiply by 60",
        ],
        result: "",
    },
];

/// The first 100 s of the samples, which are at rest, with other names and times.
fn rest(dir: &Path, names: &str, scale: f64) {
    let mut out = format!("{names}\n");
    for line in read(dir, "imu.csv").lines().skip(1).take(10_000) {
        let (time, values) = line.split_once(',').unwrap();
        out += &format!("{:.3},{values}\n", scale * time.parse::<f64>().unwrap());
    }
    write(dir, "rest.csv", &out);
}

/// Gives one sample of a bag without chunks the stamp of the one before it.
fn repeat_a_stamp(bytes: &mut [u8]) {
    // message records: code 5, length u64, channel u16, sequence u32, two times u64, CDR with its
    // 4 bytes of encapsulation, seconds i32 and nanoseconds u32
    let (mut at, mut seen, mut before) = (8, 0, [0; 8]);
    while let Some(head) = bytes.get(at..at + 9) {
        let length = u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
        let is_sample = head[0] == 5 && bytes[at + 9..at + 11] == [1, 0];
        let stamp = at + 9 + 22 + 4;
        at += 9 + length;
        if !is_sample {
            continue;
        }
        seen += 1;
        match seen {
            100 => before.copy_from_slice(&bytes[stamp..stamp + 8]),
            101 => return bytes[stamp..stamp + 8].copy_from_slice(&before),
            _ => {}
        }
    }
    panic!("the bag has fewer samples");
}
