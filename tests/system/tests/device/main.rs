//! `host-sim device` with devices in threads, and with peers that are no device.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

mod keys;
mod report;
mod simulated;
mod software;
mod watching;

use assert_cmd::Command;
use firmware::wire::command::{Response, Version, encode};
use host_unit::Unit;
use serde_json::Value;
use software::{Device, Kind};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;

/// A unit file.
const UNIT: &str = "\
name = 'bench'
serial = 'N25581'
[sensor]
format = 'stim300'
rate_hz = 250
baud = 460800
[gyro]
bias_turn_on_dph = 10
bias_in_run_dph = 0.5
angle_random_walk_dpsqrth = 0.15
[accel]
bias_turn_on_ug = 2000
bias_in_run_ug = 50
velocity_random_walk_ugpsqrthz = 60
[correction]
mode = 'shadow'
";

fn command(port: &str, args: &[&str]) -> Command {
    let mut command = Command::new(system::host_sim_binary());
    command.args(["device", "--port", port]).args(args);
    command
}

/// Standard output of a command that succeeds.
fn output(port: &str, args: &[&str]) -> String {
    let assert = command(port, args).assert().success();
    String::from_utf8(assert.get_output().stdout.clone()).unwrap()
}

/// The object that a command with `--json` prints.
fn json(port: &str, args: &[&str]) -> Value {
    let text = output(port, &[args, &["--json"]].concat());
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// The message of a command that fails.
fn error(port: &str, args: &[&str]) -> String {
    let assert = command(port, args).assert().code(2);
    let text = String::from_utf8(assert.get_output().stderr.clone()).unwrap();
    assert!(text.contains("remedy: "), "{text}");
    text
}

/// A unit file with some text replaced.
fn file(directory: &Path, from: &str, to: &str) -> String {
    assert!(UNIT.contains(from));
    let path = directory.join("unit.toml");
    std::fs::write(&path, UNIT.replace(from, to)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_new_device_is_configured_and_shows_its_configuration() {
    let directory = tempfile::tempdir().unwrap();
    let unit = file(directory.path(), "", "");
    let device = Device::start(&Kind::NEW);
    let port = &device.port;

    let info = output(port, &["info"]);
    assert!(info.contains("only passes bytes"), "{info}");
    let info = json(port, &["info"]);
    assert_eq!(
        (&info["configured"], &info["board"]),
        (&false.into(), &"software".into())
    );
    let text = error(port, &["show"]);
    assert!(
        text.contains("has no configuration") && text.contains("configure FILE"),
        "{text}"
    );

    let answer = json(port, &["configure", &unit, "--no-store"]);
    assert_eq!(
        (&answer["configured"], &answer["stored"]),
        (&true.into(), &false.into())
    );
    assert_eq!(
        (&answer["name"], &answer["serial"]),
        (&"bench".into(), &"N25581".into())
    );
    assert_eq!(answer["mode"], "shadow");
    // 25 MHz / 54 = 462 963 bit/s, 0.47 % above 460 800
    let line = &answer["lines"][0];
    assert_eq!(
        (&line["configured"], &line["bit_rate"]),
        (&460_800.into(), &462_963.into())
    );
    let percent = line["error_percent"].as_f64().unwrap();
    assert!((percent - 0.4694).abs() < 1e-3, "{percent}");
    let info = output(port, &["info"]);
    assert!(info.contains("462963 bit/s in fact (+0.47 %)"), "{info}");
    assert!(info.contains("not stored"), "{info}");

    let shown = output(port, &["show"]);
    let shown_file = directory.path().join("shown.toml");
    std::fs::write(&shown_file, &shown).unwrap();
    let configuration = |name: &str| Unit::load(name).unwrap().configuration().unwrap();
    assert_eq!(
        configuration(shown_file.to_str().unwrap()),
        configuration(&unit),
        "{shown}"
    );
    assert_eq!(json(port, &["show"])["sensor"]["baud"], 460_800);

    output(port, &["configure", shown_file.to_str().unwrap()]);
    assert_eq!(json(port, &["mode"])["mode"], "shadow");
}

#[test]
fn what_a_device_cannot_be_is_refused_by_name_and_the_old_configuration_stays() {
    let directory = tempfile::tempdir().unwrap();
    let device = Device::start(&Kind::NEW);
    let port = &device.port;
    let refused = |from: &str, to: &str| {
        error(
            port,
            &["configure", &file(directory.path(), from, to), "--no-store"],
        )
    };
    let before = output(
        port,
        &["configure", &file(directory.path(), "", ""), "--no-store"],
    );

    // the board's clock cannot: 25 MHz / 16 = 1 562 500 bit/s
    let text = refused("baud = 460800", "baud = 1843200");
    assert!(
        text.contains("1562500 bit/s") && text.contains("sensor.baud"),
        "{text}"
    );
    let text = refused("rate_hz = 250", "rate_hz = 250\npins = 2");
    assert!(text.contains("sensor.pins from 0 to 1"), "{text}");
    let text = refused("rate_hz = 250", "rate_hz = 250\nparity = 'even'");
    assert!(text.contains("parity"), "{text}");
    // no device can
    let text = refused("bias_turn_on_ug = 2000", "bias_turn_on_ug = 0");
    assert!(
        text.contains("unit.toml") && text.contains("accel"),
        "{text}"
    );
    let text = refused("rate_hz = 250", "rate_hz = 300");
    assert!(text.contains("sensor.rate_hz"), "{text}");
    let text = refused("serial", "surreal");
    assert!(text.contains("surreal"), "{text}");
    let text = error(port, &["configure", "no-such-file.toml"]);
    assert!(text.contains("no-such-file"), "{text}");

    assert_eq!(output(port, &["info"]), before);
}

#[test]
fn modes_are_reported_and_set_and_refused() {
    let directory = tempfile::tempdir().unwrap();
    let kind = Kind {
        learns: false,
        ..Kind::NEW
    };
    let device = Device::start(&kind);
    let port = &device.port;
    assert_eq!(output(port, &["mode"]), "bypass\n");
    let text = error(port, &["mode", "frozen"]);
    assert!(text.contains("no configuration"), "{text}");
    output(
        port,
        &["configure", &file(directory.path(), "", ""), "--no-store"],
    );
    assert_eq!(output(port, &["mode", "frozen"]), "frozen\n");
    assert_eq!(json(port, &["mode"])["mode"], "frozen");
    let text = error(port, &["mode", "learn"]);
    assert!(text.contains("no learner"), "{text}");
    let text = error(port, &["learnt", "commit"]);
    assert!(text.contains("learnt nothing"), "{text}");
    command(port, &["mode", "fast"]).assert().code(2);
}

#[test]
fn a_heading_is_refused_with_a_reason() {
    let directory = tempfile::tempdir().unwrap();
    let device = Device::start(&Kind::NEW);
    let port = &device.port;
    let heading = |deg: &str, sigma: &str| error(port, &["heading", deg, "--sigma", sigma]);
    let text = heading("-10", "5");
    assert!(text.contains("does not align itself"), "{text}");
    // mode shadow: it learns, but has received no fix
    output(
        port,
        &["configure", &file(directory.path(), "", ""), "--no-store"],
    );
    let text = heading("90", "5");
    assert!(text.contains("no fix yet"), "{text}");
    let text = heading("90", "0");
    assert!(text.contains("out of range"), "{text}");
    command(port, &["heading", "90"]).assert().code(2);
}

#[test]
fn weights_are_read_and_written_whole_or_not_at_all() {
    let directory = tempfile::tempdir().unwrap();
    let device = Device::start(&Kind::NEW);
    let port = &device.port;
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    output(port, &["weights", "get", &path("w.bin")]);
    let image = std::fs::read(path("w.bin")).unwrap();
    assert_eq!(image.len(), 684);

    let other = host_device::hil::networks();
    std::fs::write(path("other.bin"), host_device::device::images(&other)).unwrap();
    let answer = json(port, &["weights", "put", &path("other.bin")]);
    assert_eq!(answer["bytes"], 684);
    output(port, &["weights", "get", &path("w.bin")]);
    let read = std::fs::read(path("w.bin")).unwrap();
    assert!(read != image && read == std::fs::read(path("other.bin")).unwrap());

    // without maps, as before there were any
    std::fs::write(path("nets.bin"), &image[..608]).unwrap();
    json(port, &["weights", "put", &path("nets.bin")]);
    output(port, &["weights", "get", &path("w.bin")]);
    assert_eq!(std::fs::read(path("w.bin")).unwrap(), image);

    std::fs::write(path("short.bin"), &image[..600]).unwrap();
    let text = error(port, &["weights", "put", &path("short.bin")]);
    assert!(
        text.contains("short.bin") && text.contains("600 bytes"),
        "{text}"
    );
    let mut damaged = image;
    damaged[300] ^= 1;
    std::fs::write(path("damaged.bin"), damaged).unwrap();
    let text = error(port, &["weights", "put", &path("damaged.bin")]);
    assert!(text.contains("not a weight image"), "{text}");
    let text = error(port, &["weights", "put", &path("none.bin")]);
    assert!(text.contains("no such file"), "{text}");
    let text = error(port, &["weights", "get", "/dev/null/w.bin"]);
    assert!(text.contains("cannot be written"), "{text}");
}

#[test]
fn storing_is_done_or_its_failure_is_reported() {
    let directory = tempfile::tempdir().unwrap();
    let unit = file(directory.path(), "", "");
    let device = Device::start(&Kind::NEW);
    let answer = json(&device.port, &["configure", &unit]);
    assert_eq!(
        (&answer["stored"], &answer["mode"]),
        (&true.into(), &"shadow".into())
    );
    let answer = json(&device.port, &["store"]);
    assert_eq!(answer["done"], true);
    assert_eq!(output(&device.port, &["mode"]), "shadow\n");

    let worn = Kind {
        worn: true,
        ..Kind::NEW
    };
    let device = Device::start(&worn);
    let text = error(&device.port, &["configure", &unit]);
    assert!(text.contains("could not store"), "{text}");
    let info = json(&device.port, &["info"]);
    assert_eq!(
        (&info["configured"], &info["stored"]),
        (&true.into(), &false.into())
    );
    assert_eq!(info["mode"], "shadow");

    let without = Kind {
        stores: false,
        ..Kind::NEW
    };
    let device = Device::start(&without);
    let text = error(&device.port, &["configure", &unit]);
    assert!(text.contains("--no-store"), "{text}");
    assert_eq!(json(&device.port, &["info"])["configured"], false);
    let text = error(&device.port, &["store"]);
    assert!(text.contains("no place to store"), "{text}");
}

/// Starts a server that answers every byte with the same packet. Returns its address.
fn answers(packet: &'static [u8]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut buffer = [0; 64];
        while stream.read(&mut buffer).is_ok_and(|len| len > 0) {
            if stream.write_all(packet).is_err() {
                break;
            }
        }
    });
    port
}

#[test]
fn another_version_and_what_is_no_device_are_reported() {
    let version = Version {
        wire: 6,
        firmware: [0, 9, 3],
        image: 1,
    };
    let mut buffer = [0; 64];
    let packet = encode(1, &Response::Version(version), &mut buffer).unwrap();
    let port = answers(packet.to_vec().leak());
    let text = error(&port, &["info"]);
    assert!(
        text.contains("firmware 0.9.3, which speaks version 6"),
        "{text}"
    );
    assert!(text.contains("cargo xtask flash"), "{text}");

    let text = error(&answers(b"$GPGGA,1,2,3*45\r\n"), &["info"]);
    assert!(
        text.contains("no answer") && text.contains("bytes came"),
        "{text}"
    );
    let text = error("/dev/tty-of-nobody", &["info"]);
    assert!(
        text.contains("--port /dev/tty-of-nobody: does not open"),
        "{text}"
    );
}

/// Speeds of the wheels from standard input: refused without the table in the unit file, and by
/// line.
#[test]
fn speeds_of_the_wheels_are_sent() {
    let directory = tempfile::tempdir().unwrap();
    let wheels = |port: &str, text: &str| {
        let output = command(port, &["wheels"])
            .write_stdin(text)
            .output()
            .unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (
            output.status.code(),
            text(output.stdout),
            text(output.stderr),
        )
    };
    let device = Device::start(&Kind::NEW);
    let port = device.port.clone();
    let unit = file(directory.path(), "", "");
    output(&port, &["configure", &unit, "--no-store"]);
    let (code, _, says) = wheels(&port, "1.5\n");
    assert_eq!(code, Some(2));
    assert!(says.contains("its configuration has no wheels"), "{says}");
    assert!(says.contains("[wheels]"), "{says}");
    let unit = file(directory.path(), "[correction]", "[wheels]\n[correction]");
    output(&port, &["mode", "bypass"]);
    output(&port, &["configure", &unit, "--no-store"]);
    let (code, says, _) = wheels(&port, "# m/s\n1.5\n\n-0.25\n");
    assert_eq!(code, Some(0));
    assert!(
        says.starts_with("2 speeds of the wheels were taken, 0 came"),
        "{says}"
    );
    for (text, what) in [
        ("1\nfast\n", "line 2"),
        ("1\n2\n999\n", "line 3"),
        ("nan", "line 1"),
    ] {
        let (code, _, says) = wheels(&port, text);
        assert_eq!(code, Some(2));
        assert!(
            says.contains(what) && says.contains("negative in reverse"),
            "{says}"
        );
    }
}
