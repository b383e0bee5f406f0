//! Writes the initial inputs of the targets with our own writers. Only on demand, after a change of
//! a format: `cargo test -p fuzz --test seeds -- --ignored`.

use firmware::configuration::SCHEMA;
use firmware::configuration::record::encode;
use firmware::update::{DEVELOPMENT_SEED, FIRMWARE};
use firmware::wire::command::key::Secret;
use firmware::wire::{Fields, ImuFormat, framer::LONGEST, ubx::Pvt};
use host_device::device::sign;
use host_unit::{Unit, presets};
use std::path::Path;

fn write(target: &str, name: &str, bytes: &[u8]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    std::fs::write(folder.join(target).join(name), bytes).expect("a file");
}

/// The configuration of each preset unit.
#[test]
#[ignore = "writes files"]
fn configurations() {
    for name in presets::names() {
        let unit = Unit::preset(name).expect("a unit");
        let configuration = unit.configuration().expect("a configuration");
        let record = encode(&configuration);
        let body = &record[8..record.len() - 4];
        let seed = [&[SCHEMA as u8], body].concat();
        write("configuration", &format!("seed-{name}"), &seed);
    }
}

/// A signed MAVLink message, which cannot be changed. The target repairs its CRC.
fn signed() {
    let mavlink = ImuFormat::ALL
        .iter()
        .position(|format| matches!(format, ImuFormat::Mavlink(_)));
    let mavlink = mavlink.expect("a format");
    let fields = Fields {
        index: 0,
        time: 0.0,
        gyro: [100, -200, 300],
        accel: [5, -7, 40_000],
        rest: 0,
    };
    let mut buffer = [0; LONGEST];
    let sensor = &ImuFormat::ALL[mavlink].simulated()[0];
    let len = (sensor.emit)(&fields, &mut buffer).expect("room");
    buffer[2] = 1;
    let checked_and_signed = 0x80 | mavlink as u8;
    let mut seed = vec![checked_and_signed, 200];
    seed.extend(&buffer[..len + 13]);
    write("stream", "seed-mavlink-signed", &seed);
}

/// Three frames of the first sensor of each format, and two fixes.
#[test]
#[ignore = "writes files"]
fn streams() {
    for (index, format) in ImuFormat::ALL.into_iter().enumerate() {
        let sensor = &format.simulated()[0];
        let mut seed = vec![index as u8, 200];
        for n in 0..3 {
            let fields = Fields {
                index: n,
                time: f64::from(n) / f64::from(sensor.rate),
                gyro: [100, -200, 300],
                accel: [5, -7, 40_000],
                rest: sensor.rest,
            };
            let mut buffer = [0; LONGEST];
            let len = (sensor.emit)(&fields, &mut buffer).expect("room");
            seed.extend(&buffer[..len]);
        }
        let name = sensor.name.to_lowercase().replace([' ', ','], "-");
        write("stream", &format!("seed-{name}"), &seed);
    }
    signed();
    let mut seed = vec![ImuFormat::ALL.len() as u8, 200];
    for second in 0..2 {
        let fix = Pvt {
            time_of_week: second * 1000,
            fix: 3,
            flags: 1,
            horizontal_accuracy: 1400,
            vertical_accuracy: 1500,
            speed_accuracy: 50,
            ..Pvt::default()
        };
        seed.extend(fix.emit());
    }
    write("stream", "seed-fixes", &seed);
}

/// A vehicle at rest, and one with a receiver in the same table.
#[test]
#[ignore = "writes files"]
fn tables() {
    let imu = "[imu]\nfile=\"imu.csv\"\ntime={column=\"t\",unit=\"ms\"}\n\
               gyro={columns=[\"gx\",\"gy\",\"gz\"],unit=\"deg/s\"}\n\
               accel={columns=[\"ax\",\"ay\",\"az\"],unit=\"g\"}\naxes=\"y x -z\"\n";
    let start = "[start]\nroll_deg=0.0\npitch_deg=0.0\nheading_deg=90.0\n";
    let site = "latitude_deg=45.0\nlongitude_deg=7.0\nheight_m=80.0\n";
    let gnss = "[gnss]\ntime={column=\"t\",unit=\"ms\"}\nlatitude={column=\"lat\",unit=\"deg\"}\n\
                longitude={column=\"lon\",unit=\"deg\"}\nheight={column=\"h\",unit=\"m\"}\n";
    let mut still = String::from("t,gx,gy,gz,ax,ay,az\n");
    let mut moving = String::from("t,gx,gy,gz,ax,ay,az,lat,lon,h\n");
    for k in 0..30 {
        let sample = format!("{},0,0,0.0023,0,0,1.0003", 10 * k);
        still += &format!("{sample}\n");
        moving += &if k % 10 == 0 {
            format!("{sample},45.000{k},7.0,80.0\n")
        } else {
            format!("{sample},,,\n")
        };
    }
    let still = format!("{imu}{start}{site}\0{still}");
    let moving = format!("{imu}{gnss}{start}\0{moving}");
    write("csv", "seed-standing", still.as_bytes());
    write("csv", "seed-moving", moving.as_bytes());
    write(
        "csv",
        "seed-increments",
        still
            .replace("\"deg/s\"", "\"rad\"")
            .replace("\"g\"", "\"m/s\"")
            .as_bytes(),
    );
}

/// An act of the target `update`, as `arbitrary` reads it: one more follows, which of the eight,
/// and its fields.
fn act(which: u32, fields: &[u8]) -> Vec<u8> {
    [&[1][..], &(which << 29).to_le_bytes(), fields].concat()
}

/// A file of an update, and devices that take one: confirmed, rolled back, with power cuts, with
/// another key, of another board, an older one, and out of order.
#[test]
#[ignore = "writes files"]
fn updates() {
    let images = [(0x0800_0200, vec![1; 70]), (0x0800_0C00, vec![2; 40])];
    let file = sign::signed("mock", FIRMWARE, &images, &Secret(DEVELOPMENT_SEED)).expect("short");
    write("update", "seed-file", &[&[0], &file[..]].concat());
    let begin = |update: u8| act(0, &[update, 0, 0]);
    let older = |update: u8| act(0, &[update, 0, 1]);
    let changed = |at: u8| act(0, &[1, 1, at, 4, 0]);
    let (pieces, finish, confirm) = (act(1, &[200]), act(3, &[]), act(4, &[]));
    let cut = |left: u16| act(6, &[left as u8, (left >> 8) as u8, 0x5A]);
    let restart = act(7, &[]);
    let sent = |update: u8| [begin(update), pieces.clone(), finish.clone()].concat();
    let whole = |update: u8| [sent(update), restart.clone()].concat();
    let acts = [
        ("confirmed", [whole(1), confirm.clone(), whole(2)].concat()),
        (
            "rolled-back",
            [whole(3), restart.clone(), whole(5)].concat(),
        ),
        (
            "cut-while-it-comes",
            [cut(1500), whole(3), whole(3)].concat(),
        ),
        (
            "cut-at-the-record",
            [cut(2790), whole(3), restart.clone()].concat(),
        ),
        (
            "cut-in-the-loader",
            [sent(1), cut(30), confirm.clone()].concat(),
        ),
        (
            "older",
            [whole(7), older(7), pieces.clone(), finish.clone()].concat(),
        ),
        ("another-board", whole(13)),
        ("another-key", whole(19)),
        (
            "changed",
            [changed(10), pieces.clone(), changed(70)].concat(),
        ),
        (
            "begun-twice",
            [begin(3), act(1, &[2]), sent(1), restart.clone()].concat(),
        ),
    ];
    for (name, acts) in acts {
        write(
            "update",
            &format!("seed-{name}"),
            &[&[1], &acts[..]].concat(),
        );
    }
}
