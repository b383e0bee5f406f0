//! Files that say of themselves what is not so: no fix, units, order, axes, clocks.

use super::edits::{
    CONVERT, Case, SIMULATED, STRICT, fixes, header, lines, scaled, simulated, text,
    without_velocities,
};

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
        printed: &["40 lines from 0 to 39 s hold no fix: latitude and longitude are 0"],
        result: "35\u{a0}999 samples, 321 fixes",
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
        printed: &["5 lines from 200 to 204 s hold no fix"],
        result: "35\u{a0}999 samples, 356 fixes",
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
        printed: &[
            "30 lines from 0 to 29 s hold no fix: 'fix_type' is 0",
            "20 lines from 30 to 49 s",
        ],
        result: "35\u{a0}999 samples, 311 fixes",
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
        printed: &["10 lines from 0 to 9 s hold no fix: 'field.status.status' is -1"],
        result: "35\u{a0}999 samples, 351 fixes",
    },
    Case {
        input: "a type of fix of 1 (no fix, or dead reckoning) and a `valid` of 0",
        make: |dir| {
            text(dir, "gnss.csv", |old| {
                old.replacen("vd\n", "vd,gps.fix_type,valid\n", 1)
            });
            lines(dir, "gnss.csv", |k, cells| {
                let [kind, valid] = match k {
                    0..10 => ["1", "1"],
                    10..30 => ["3", "0"],
                    _ => ["3", "1"],
                };
                cells.extend([kind, valid].map(str::to_owned));
            });
        },
        args: CONVERT,
        printed: &[
            "10 lines from 0 to 9 s hold no fix: 'gps.fix_type' is 1",
            "20 lines from 10 to 29 s hold no fix: 'valid' is 0",
        ],
        result: "35\u{a0}999 samples, 331 fixes",
    },
    Case {
        input: "latitude, longitude and height -1 for 20 s in mid-drive",
        make: |dir| {
            lines(dir, "gnss.csv", |k, cells| {
                if (200..220).contains(&k) {
                    cells[1..4].fill("-1".into());
                }
            });
        },
        args: STRICT,
        printed: &["'gnss.latitude' puts 20 fixes from 200 to 219 s up to"],
        result: "warned",
    },
    Case {
        input: "heights in mm, given as m",
        make: |dir| fixes(dir, &[3], |v| 1e3 * v),
        args: CONVERT,
        printed: &["not a height of a vehicle", "the height may be in mm or cm"],
        result: "refused",
    },
    Case {
        input: "heights in feet, given as m",
        make: |dir| fixes(dir, &[3], |v| v / 0.3048),
        args: STRICT,
        printed: &["'gnss.height.unit'", "the unit 'ft' would fit"],
        result: "warned",
    },
    Case {
        input: "positions in rad, given as deg",
        make: |dir| fixes(dir, &[1, 2], f64::to_radians),
        args: STRICT,
        printed: &["'gnss.latitude.unit'", "the unit 'rad' would fit"],
        result: "warned",
    },
    Case {
        input: "positions in deg, given as rad",
        make: |dir| {
            text(dir, "header.toml", |old| {
                old.replace("unit = 'deg'", "unit = 'rad'")
            });
        },
        args: CONVERT,
        printed: &["not on Earth", "the positions are in deg"],
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
        printed: &["may have changed places"],
        result: "refused",
    },
    Case {
        input: "latitude and longitude in each other's column, both possible",
        make: |dir| lines(dir, "gnss.csv", |_, cells| cells.swap(1, 2)),
        args: STRICT,
        printed: &["'gnss.latitude'", "seem to have changed places"],
        result: "warned",
    },
    Case {
        input: "west longitudes without their sign",
        make: |dir| fixes(dir, &[2], |v| -v),
        args: STRICT,
        printed: &["'gnss.longitude.unit'", "west is negative: the unit '-deg'"],
        result: "warned",
    },
    Case {
        input: "the same with the unit `-deg`",
        make: |dir| {
            fixes(dir, &[2], |v| -v);
            header(dir, "'lon', unit = 'deg'", "'lon', unit = '-deg'");
        },
        args: CONVERT,
        printed: &[],
        result: "35\u{a0}999 samples, 361 fixes",
    },
    Case {
        input: "the same without velocities",
        make: |dir| {
            fixes(dir, &[2], |v| -v);
            without_velocities(dir);
        },
        args: STRICT,
        printed: &[
            "'gnss.latitude.unit or gnss.longitude.unit'",
            "positions alone do not show which",
        ],
        result: "warned",
    },
    Case {
        input: "south latitudes without their sign, without velocities",
        make: |dir| {
            fixes(dir, &[1], |v| -v);
            without_velocities(dir);
        },
        args: STRICT,
        printed: &[
            "'gnss.latitude.unit or gnss.longitude.unit'",
            "positions alone do not show which",
        ],
        result: "warned",
    },
    Case {
        input: "south latitudes without their sign",
        make: |dir| fixes(dir, &[1], |v| -v),
        args: STRICT,
        printed: &["'gnss.latitude.unit'", "south is negative"],
        result: "warned",
    },
    Case {
        input: "positions that the receiver holds for 20 s in mid-drive",
        make: |dir| {
            lines(dir, "gnss.csv", |k, cells| {
                if (200..220).contains(&k) {
                    cells[1..4].clone_from_slice(&["45.84", "5.74", "310"].map(str::to_owned));
                }
            });
        },
        args: STRICT,
        printed: &["repeats a position 19 times, first from 200 s on"],
        result: "warned",
    },
    Case {
        input: "the same where a type of fix of 5 and velocities of 0 mean that there is none",
        make: |dir| {
            text(dir, "gnss.csv", |old| {
                old.replacen("vd\n", "vd,fixType\n", 1)
            });
            lines(dir, "gnss.csv", |k, cells| {
                let none = (200..220).contains(&k);
                if none {
                    cells[1..4].clone_from_slice(&["45.84", "5.74", "310"].map(str::to_owned));
                    cells[4..7].fill("0".into());
                }
                cells.push(if none { "5" } else { "3" }.into());
            });
        },
        args: STRICT,
        printed: &["repeats a position 19 times, first from 200 s on, and jumps by"],
        result: "warned",
    },
    Case {
        input: "an accuracy `eph` of 9999, as of autopilots without a fix",
        make: |dir| {
            text(dir, "gnss.csv", |old| old.replacen("vd\n", "vd,eph\n", 1));
            lines(dir, "gnss.csv", |k, cells| {
                cells.push(
                    if (200..220).contains(&k) {
                        "9999"
                    } else {
                        "1.2"
                    }
                    .into(),
                );
            });
        },
        args: CONVERT,
        printed: &["20 lines from 200 to 219 s hold no fix: 'eph' is 9999"],
        result: "35\u{a0}999 samples, 341 fixes",
    },
    Case {
        input: "velocities in km/h, given as m/s",
        make: |dir| fixes(dir, &[4, 5, 6], |v| 3.6 * v),
        args: STRICT,
        printed: &["'gnss.velocity.unit'", "the unit 'km/h' would fit"],
        result: "warned",
    },
    Case {
        input: "velocities in knots, given as m/s",
        make: |dir| fixes(dir, &[4, 5, 6], |v| v * 3600.0 / 1852.0),
        args: STRICT,
        printed: &["'gnss.velocity.unit'", "the unit 'knots' would fit"],
        result: "warned",
    },
    Case {
        input: "velocities east-north-up, given as ned",
        make: |dir| {
            fixes(dir, &[6], |v| -v);
            lines(dir, "gnss.csv", |_, cells| cells.swap(4, 5));
        },
        args: STRICT,
        printed: &["'gnss.velocity.order'", "the order 'enu' would fit"],
        result: "warned",
    },
    Case {
        input: "velocities north-east-up, given as ned",
        make: |dir| fixes(dir, &[6], |v| -v),
        args: STRICT,
        printed: &["'gnss.velocity.order'", "the order 'neu' would fit"],
        result: "warned",
    },
    Case {
        input: "velocities to the west, given as to the east",
        make: |dir| fixes(dir, &[5], |v| -v),
        args: STRICT,
        printed: &[
            "'gnss.velocity.order'",
            "they seem to hold north, west, down",
        ],
        result: "warned",
    },
    Case {
        input: "one column named for two axes",
        make: |dir| header(dir, "'gx', 'gy', 'gz'", "'gx', 'gy', 'gy'"),
        args: CONVERT,
        printed: &["'imu.gyro' names column 'gy', which 'gyro' names already"],
        result: "refused",
    },
    Case {
        input: "the columns of x and z swapped",
        make: |dir| {
            header(dir, "'gx', 'gy', 'gz'", "'gz', 'gy', 'gx'");
            header(dir, "'ax', 'ay', 'az'", "'az', 'ay', 'ax'");
        },
        args: STRICT,
        printed: &["'imu.axes'", "the axis that points down"],
        result: "warned",
    },
    Case {
        input: "the columns of x and y swapped",
        make: |dir| {
            header(dir, "'gx', 'gy', 'gz'", "'gy', 'gx', 'gz'");
            header(dir, "'ax', 'ay', 'az'", "'ay', 'ax', 'az'");
        },
        args: STRICT,
        printed: &["'imu.axes'", "forward seems to be what is called right"],
        result: "warned",
    },
    Case {
        input: "one gyro with the wrong sign",
        make: |dir| scaled(dir, &[3], -1.0),
        args: STRICT,
        printed: &["'imu.gyro'", "the gyros of the axes called down"],
        result: "warned",
    },
    Case {
        input: "accelerations without gravity",
        make: |dir| {
            lines(dir, "imu.csv", |_, cells| {
                cells[6] = format!("{:?}", cells[6].parse::<f64>().unwrap() + 9.806);
            });
        },
        args: STRICT,
        printed: &[
            "'imu.accel.unit'",
            "with gravity; it seems to have been taken off",
        ],
        result: "warned",
    },
    Case {
        input: "the columns of gyros and accelerometers in each other's place",
        make: |dir| {
            header(dir, "'gx', 'gy', 'gz'", "'Ax', 'Ay', 'Az'");
            header(dir, "'ax', 'ay', 'az'", "'gx', 'gy', 'gz'");
            header(dir, "'Ax', 'Ay', 'Az'", "'ax', 'ay', 'az'");
        },
        args: STRICT,
        printed: &["gyros and accelerometers seem to have changed places"],
        result: "warned",
    },
    Case {
        input: "rates in deg/s, given as rad/s",
        make: |dir| scaled(dir, &[1, 2, 3], 1f64.to_degrees()),
        args: STRICT,
        printed: &["'imu.gyro.unit'", "the unit 'deg/s' would fit"],
        result: "warned",
    },
    Case {
        input: "accelerometers in g, given as m/s^2",
        make: |dir| scaled(dir, &[4, 5, 6], 1.0 / 9.80665),
        args: STRICT,
        printed: &["'imu.accel.unit'", "the unit 'g' would fit"],
        result: "warned",
    },
    Case {
        input: "fixes in UTC, samples in GPS time",
        make: |dir| fixes(dir, &[0], |t| t - 18.0),
        args: STRICT,
        printed: &[
            "'gnss.time_offset_s'",
            "GPS time is 18 s ahead of UTC since 2017",
        ],
        result: "warned",
    },
    Case {
        input: "fixes in local time, 8 h ahead",
        make: |dir| fixes(dir, &[0], |t| t + 28_800.0),
        args: STRICT,
        printed: &[
            "'time' has no whole second",
            "give -28800 s",
            "8 h is the difference of a time zone",
        ],
        result: "refused",
    },
    Case {
        input: "times of the fixes in ms, given as s",
        make: |dir| fixes(dir, &[0], |t| 1000.0 * (t + 400_000.0)),
        args: STRICT,
        printed: &[
            "'time' has no whole second",
            "the times of the fixes seem to be in ms",
        ],
        result: "refused",
    },
    Case {
        input: "the same, with samples and fixes that begin at 0",
        make: |dir| fixes(dir, &[0], |t| 1e3 * t),
        args: STRICT,
        printed: &[
            "360 of 361 fixes outside the time of the samples",
            "fixes seem to be in ms",
        ],
        result: "warned",
    },
    Case {
        input: "fixes that are 100 s late",
        make: |dir| fixes(dir, &[0], |t| t + 100.0),
        args: STRICT,
        printed: &[
            "'gnss.time_offset_s'",
            "samples and fixes match best at -99.99",
        ],
        result: "warned",
    },
    Case {
        input: "the same of a ship in waves, whose motion repeats itself",
        make: |dir| {
            simulated(dir, "ship --seed 3");
            fixes(dir, &[0], |t| t + 100.0);
        },
        args: SIMULATED,
        printed: &[
            "'gnss.time_offset_s'",
            "samples and fixes match best at -100.0",
        ],
        result: "warned",
    },
    Case {
        input: "fixes that are 17 s late, of a sensor in the hand",
        make: |dir| {
            simulated(dir, "hand-held");
            fixes(dir, &[0], |t| t + 17.0);
        },
        args: SIMULATED,
        printed: &[
            "'gnss' and 'imu' contradict each other",
            "the clock of the fixes",
        ],
        result: "warned",
    },
    Case {
        input: "an aircraft whose x and y axes point backwards and to the left",
        make: |dir| {
            simulated(dir, "aircraft");
            scaled(dir, &[1, 2, 4, 5], -1.0);
        },
        args: SIMULATED,
        printed: &[
            "makes the vehicle push against the axis called forward where the fixes speed up",
            "forward seems to be against what is called forward",
        ],
        result: "warned",
    },
    Case {
        input: "times of the samples in ms, given as s",
        make: |dir| {
            scaled(dir, &[0], 1000.0);
        },
        args: CONVERT,
        printed: &["'imu.time' has a median step of 10 s", "'ms' would fit"],
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
        printed: &[
            "seconds of week of the samples begin anew",
            "seconds of week of the fixes",
        ],
        result: "35\u{a0}999 samples, 361 fixes",
    },
];
