//! A device that is told its sensor over its command link, in QEMU, by the code of `host-sim
//! device`.

use std::time::Instant;

use firmware::configuration::Configuration;
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use firmware::wire::command::{Health, Request, fault};
use host_sim::device;
use host_sim::hil::{self, Drive};
use host_sim::simulator::imu::ImuSpec;
use host_sim::unit::Unit;
use qemu::images::BOARDS;
use qemu::listening::Listening;
use qemu::lockstep::{Board, Twin, in_step};

/// The drive: this long, the first part of it at rest.
const SECONDS: [u32; 2] = [100, 32];

/// Four sensors, each with its own format, rate and datasheet.
const SENSORS: [&str; 4] = ["stim300", "kvh-1775", "hg4930", "novatel"];

fn unit(name: &str) -> Unit {
    let sensor = match name {
        "stim300" => "format = 'stim300'\nrate_hz = 250",
        "kvh-1775" => "format = 'kvh'\nrate_hz = 100\nkvh = { rotation = 'rate', angle = 'deg' }",
        "hg4930" => "format = 'hg4930'\nrate_hz = 100",
        _ => "format = 'novatel'\nnovatel = { imu_type = 11 }",
    };
    let text = format!(
        "name = '{name}'\n\
         [sensor]\n{sensor}\n\
         [gyro]\nbias_turn_on_dph = 10\nbias_in_run_dph = 0.5\nangle_random_walk_dpsqrth = 0.15\n\
         [accel]\nbias_turn_on_ug = 5000\nbias_in_run_ug = 50\n\
         velocity_random_walk_ugpsqrthz = 60\n"
    );
    let mut unit: Unit = toml::from_str(&text).expect("a unit");
    // what is learnt comes into force without the navigation computer's alignment, and quickly
    unit.correction.mode = host_sim::unit::around::Mode::Learn;
    unit.correction.activation = host_sim::unit::around::Activation::Faded;
    unit.correction.align_s = 30.0;
    unit.correction.slew_gyro_dphps = Some(10.0);
    unit.correction.slew_accel_ugps = Some(1000.0);
    // the drive comes faster than in real time, with pauses
    unit.correction.check_rate = false;
    unit.sensor.silence_ms = 10_000.0;
    unit
}

/// A sensor with the errors of the unit's datasheet.
fn errors(unit: &Unit) -> ImuSpec {
    let mut errors = ImuSpec::preset("medium").expect("a preset");
    errors.gyro.bias_unit_dph = unit.gyro.bias_turn_on_dph;
    errors.gyro.angle_random_walk_dpsqrth = unit.gyro.angle_random_walk_dpsqrth;
    errors.accel.bias_unit_ug = unit.accel.bias_turn_on_ug;
    errors.accel.velocity_random_walk_ugpsqrthz = unit.accel.velocity_random_walk_ugpsqrthz;
    errors
}

fn drive(unit: &Unit, told: &Configuration, seconds: [u32; 2]) -> Drive {
    hil::drive_told(told, ImuFormat::Stim300, &errors(unit), seconds).expect("a drive")
}

/// Health without what is measured with the board's own clock.
fn health(health: Health) -> Health {
    Health {
        busy: None,
        busiest: None,
        ..health
    }
}

#[test]
#[ignore = "for the lengths of the drives"]
fn when_are_they_promoted() {
    for name in SENSORS {
        let unit = unit(name);
        let told = unit.configuration().expect("a configuration");
        let drive = drive(&unit, &told, [300, 32]);
        let mut twin = Twin::new(&told);
        let mut last = 0;
        for second in drive
            .records
            .chunk_by(|a, b| a.at_us / 1_000_000 == b.at_us / 1_000_000)
        {
            in_step(&mut twin, None, second).expect("it runs");
            let health = twin.health().expect("it answers");
            if health.promotions + health.rollbacks != last || second[0].at_us / 1_000_000 % 50 == 0
            {
                last = health.promotions + health.rollbacks;
                println!("{name} {} s: {health:?}", second[0].at_us / 1_000_000);
            }
        }
        let bytes: usize = drive.records.iter().map(|r| r.bytes.len()).sum();
        println!("{name}: {} bytes a second", bytes / 300);
    }
}

#[test]
fn one_image_is_configured_for_four_sensors_one_after_another() {
    let Some(image) = BOARDS[0].image.build_or_skip() else {
        return;
    };
    let listening = Listening::start(BOARDS[0], &image).expect("QEMU listens");
    let mut board = Board::connect(&listening).expect("it connects");
    passes_everything(&mut board);
    for name in SENSORS {
        let begun = Instant::now();
        let unit = unit(name);
        let told = unit.configuration().expect("a configuration");
        let drive = drive(&unit, &told, SECONDS);
        device::configure(&mut board.link, &told).expect("it is configured");
        assert_eq!(
            device::configuration(&mut board.link).expect("it answers"),
            Some(told.clone())
        );
        let mut twin = Twin::new(&told);
        let changed = in_step(&mut twin, Some(&mut board), &drive.records);
        let changed = changed.unwrap_or_else(|error| panic!("{name}: {error:?}"));
        let here = health(twin.health().expect("it answers"));
        let there = health(board.link.health().expect("it answers"));
        println!(
            "{name}: {changed} bytes changed, {:?}, {here:?}",
            begun.elapsed()
        );
        assert_eq!(here, there, "{name}");
        assert!(
            here.winner > 0 && here.promotions > 0 && here.used_fixes > 30,
            "{name}: {here:?}"
        );
        assert!(changed > 1000, "{name}: {changed}");
        assert_eq!(here.faults, 0, "{name}");
        let learnt = board.link.learnt_images().expect("it answers");
        assert!(
            twin.learnt().expect("it learns") == learnt,
            "{name}: weights"
        );
    }
}

/// Without a configuration bytes pass unchanged, and the device says so.
fn passes_everything(board: &mut Board) {
    let told = Configuration::default();
    let medium = ImuSpec::preset("medium").expect("a preset");
    let drive = hil::drive_told(&told, ImuFormat::Stim300, &medium, [4, 4]).expect("a drive");
    let sensor = drive
        .records
        .iter()
        .filter(|r| r.input == hil::Input::Sensor);
    let mut bytes: Vec<u8> = sensor.flat_map(|record| record.bytes.clone()).collect();
    bytes.extend(b"text that is no frame\r\n");
    let refused = board
        .link
        .order(&Request::SetMode(Mode::Frozen))
        .expect_err("refused");
    assert!(
        refused.to_string().contains("no configuration"),
        "{refused}"
    );
    let came = board.through(&bytes, bytes.len()).expect("it passes");
    assert!(came == bytes);
    let health = board.link.health().expect("it answers");
    assert_eq!(
        health.faults & fault::NOT_CONFIGURED,
        fault::NOT_CONFIGURED,
        "{health:?}"
    );
    assert_eq!(
        device::configuration(&mut board.link).expect("it answers"),
        None
    );
}
