//! A drive with faults, recorded by the application and played again.

use super::super::drive;
use super::*;
use crate::hil::{Input, MemoryLine, SetClock, networks};
use firmware::app::blackbox::read::{Content, HEAD_LEN, Head};
use firmware::app::blackbox::{LEN, Memory, PAGES, State};
use firmware::app::{App, Config, Lines};
use firmware::configuration::Sensor;
use firmware::control::Mode;
use firmware::link::NoLine;
use firmware::wire::ImuFormat;
use firmware::wire::adis::{self, Burst, Model};
use firmware::wire::command::fault;
use test_bench::line::MockLine;

/// Recording of a device after `frames` frames of a drive; `disturb` changes their bytes.
fn recorded(format: ImuFormat, frames: usize, disturb: impl Fn(usize, &mut Vec<u8>)) -> Vec<u8> {
    recorded_at(true, format, frames, disturb)
}

/// As [`recorded`]; `says_idle`: whether the line reports that it is idle.
fn recorded_at(
    says_idle: bool,
    format: ImuFormat,
    frames: usize,
    disturb: impl Fn(usize, &mut Vec<u8>),
) -> Vec<u8> {
    let drive = drive(format, 3).expect("a drive");
    let mut sensor = firmware::wire::Settings::DEFAULT;
    (format.simulated()[0].settings)(&mut sensor);
    let config = Config {
        format: Some(format),
        sensor,
        mode: Mode::Frozen,
        nets: networks(),
        block: 0.05,
        ..Config::default()
    };
    let memory = Box::leak(Box::new(Memory::ZEROED));
    let mut app = App::new(config);
    app.record_in(memory);
    let mut lines: Lines<MockLine, MemoryLine, NoLine, NoLine> = Lines {
        sensor: MockLine {
            never_idle: !says_idle,
            ..MockLine::default()
        },
        navigation: MemoryLine::default(),
        command: NoLine,
        gnss: NoLine,
    };
    let mut clock = SetClock(0);
    let sensors = drive.records.iter().filter(|r| r.input == Input::Sensor);
    for (n, record) in sensors.take(frames).enumerate() {
        let mut bytes = record.bytes.clone();
        disturb(n, &mut bytes);
        clock.0 = record.at_us.into();
        lines.sensor.input.extend(&bytes);
        while app.poll(&mut lines, &clock) {}
    }
    stopped(&mut app)
}

fn stopped(app: &mut App) -> Vec<u8> {
    app.hold_recording();
    let mut bytes = vec![0; LEN];
    assert_eq!(app.read_recording(0, &mut bytes), Some(LEN));
    bytes
}

fn head(memory: &[u8]) -> Head {
    Head::parse(&memory[..HEAD_LEN]).expect("a black box")
}

/// Every format: the pages are full of frames, and play to the same bytes.
#[test]
fn what_was_recorded_plays_again() {
    for format in ImuFormat::ALL {
        let memory = recorded(format, 333, |_, _| {});
        assert_eq!(head(&memory).state, State::Holds);
        let pages = play_as(format, &memory);
        assert_eq!(pages.len(), PAGES, "{format:?}");
        let pieces: usize = pages.iter().map(|page| page.pieces).sum();
        println!("{format:?}: {pieces} pieces");
        assert!(pieces >= 3 * 4, "{format:?}: {pages:?}");
        for page in &pages {
            assert_eq!(page.verdict, Verdict::Agrees, "{format:?}: {page:?}");
        }
    }
}

/// Plays the pages with the format's usual sensor.
fn play_as(format: ImuFormat, memory: &[u8]) -> Vec<Page> {
    let mut settings = firmware::wire::Settings::DEFAULT;
    (format.simulated()[0].settings)(&mut settings);
    let mut configuration = host_unit::Unit::default()
        .configuration()
        .expect("a configuration");
    configuration.sensor = Some(Sensor::Stream(format.settings(&settings)));
    configuration.rate = settings.rate;
    configuration.correction.limit = Config::default().limit;
    play(Some(&configuration), memory)
}

/// Damage, silence and split frames are played, too. After a fault the recording stops, with bytes
/// from before and after it.
#[test]
fn faults_are_recorded_and_played() {
    let memory = recorded(ImuFormat::Stim300, 400, |n, bytes| {
        if (300..340).contains(&n) {
            match n % 5 {
                0 => bytes[7] ^= 4,
                1 => bytes.truncate(9),
                2 => bytes.extend([0x93, 1, 2]),
                _ => {}
            }
        }
        if n == 310 {
            bytes[19] |= 0x41; // STIM300 status: an axis is invalid
            ImuFormat::Stim300.seal(bytes);
        }
    });
    let pages = play_as(ImuFormat::Stim300, &memory);
    assert!(
        pages.iter().all(|page| page.verdict == Verdict::Agrees),
        "{pages:?}"
    );
    assert!(
        pages.iter().map(|page| page.pieces).sum::<usize>() > 40,
        "{pages:?}"
    );
}

/// Bursts of an ADIS, some at the ends of their range. Nothing is at the sensor's line, which
/// reports that it is idle, or cannot.
#[test]
fn bursts_are_recorded_and_played() {
    let unit = host_unit::Unit::default();
    let mut configuration = unit.configuration().expect("a configuration");
    let model = Model::Adis16505(2);
    configuration.sensor = Some(Sensor::Spi(adis::Settings {
        form: model.form(),
        units: model.units(true).expect("a model"),
        framed: false,
    }));
    configuration.rate = 500.0;
    for never_idle in [false, true] {
        let mut app = App::new(Config {
            mode: Mode::Frozen,
            nets: networks(),
            block: 0.05,
            ..Config::of(&configuration)
        });
        app.record_in(Box::leak(Box::new(Memory::ZEROED)));
        let mut lines: Lines<MockLine, MemoryLine, NoLine, NoLine> = Lines {
            sensor: MockLine {
                never_idle,
                ..MockLine::default()
            },
            navigation: MemoryLine::default(),
            command: NoLine,
            gnss: NoLine,
        };
        let mut clock = SetClock(0);
        for n in 0..700u16 {
            clock.0 = 2000 * u64::from(n);
            let count = if n % 50 == 40 { i32::MAX } else { 1 << 20 };
            let burst = Burst {
                gyro: [count, -count, count],
                accel: [-count, count, count],
                counter: n,
                ..Burst::default()
            };
            let mut reply = burst.emit32();
            let taken = app.burst(&mut reply, &mut lines.navigation, &clock);
            assert_eq!(taken, Ok(()));
            while app.poll(&mut lines, &clock) {}
        }
        assert!(app.counters().saturated > 10, "{:?}", app.counters());
        let pages = play(Some(&configuration), &stopped(&mut app));
        let pieces: usize = pages.iter().map(|page| page.pieces).sum();
        assert!(pieces > 30, "{pages:?}");
        for page in &pages {
            assert_eq!(page.verdict, Verdict::Agrees, "{never_idle}: {page:?}");
        }
    }
}

/// A sensor falls silent, at a line that reports that it is idle and at one that cannot. There each
/// poll finds no bytes, and one of them detects the silence.
#[test]
fn a_silence_is_recorded_and_played() {
    for says_idle in [true, false] {
        let memory = recorded_at(says_idle, ImuFormat::Stim300, 500, |n, bytes| {
            if (300..400).contains(&n) {
                bytes.clear();
            }
        });
        let pages = play_as(ImuFormat::Stim300, &memory);
        assert!(
            pages.iter().all(|page| page.verdict == Verdict::Agrees),
            "{says_idle}: {pages:?}"
        );
        let silent = (0..PAGES).filter_map(|n| firmware::app::blackbox::read::page(&memory, n));
        let silent = silent.flat_map(|page| page.entries().collect::<Vec<_>>());
        let silent = silent.filter(
            |entry| matches!(entry.content, Content::Faults(_, bits) if bits & fault::SILENT != 0),
        );
        assert_eq!(silent.count(), 1, "{says_idle}: {pages:?}");
    }
}

/// One bit that was changed in any byte of the sensor that others follow on its page, or in the
/// hash that the page begins with, is found.
#[test]
fn a_changed_bit_is_found() {
    let memory = recorded(ImuFormat::Hg4930, 333, |_, _| {});
    let differs = |at: usize| {
        let mut bad = memory.clone();
        bad[at] ^= 0x10;
        let pages = play_as(ImuFormat::Hg4930, &bad);
        !pages.iter().all(|page| page.verdict == Verdict::Agrees)
    };
    let offset = |bytes: &[u8]| bytes.as_ptr().addr() - memory.as_ptr().addr();
    let mut tried = 0;
    for page in (0..PAGES).filter_map(|n| firmware::app::blackbox::read::page(&memory, n)) {
        let pieces: Vec<&[u8]> = page
            .entries()
            .filter_map(|entry| match entry.content {
                Content::Piece(_, bytes) => Some(bytes),
                _ => None,
            })
            .collect();
        let (_, followed) = pieces.split_last().expect("pieces");
        for at in followed.iter().flat_map(|bytes| {
            let from = offset(bytes);
            from..from + bytes.len()
        }) {
            tried += 1;
            assert!(differs(at), "byte {at} of page {}", page.number);
        }
        // hash of all output so far
        let key = offset(page.frame) - firmware::app::blackbox::KEY_LEN;
        assert!(differs(key + 16), "hash of page {}", page.number);
    }
    println!("{tried} bytes");
    assert!(tried > 1000, "{tried}");
}

#[test]
fn a_file_is_read_as_it_was_written() {
    let memory = recorded(ImuFormat::Stim300, 100, |_, _| {});
    let configuration = host_unit::Unit::default()
        .configuration()
        .expect("a configuration");
    let fetched = crate::device::Fetched {
        firmware: [0, 1, 0],
        recording: Default::default(),
        configuration: firmware::configuration::record::encode(&configuration).to_vec(),
        memory,
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("box.json");
    write(&file, &fetched).expect("it is written");
    let (read_configuration, read_memory) = read(&file).expect("it is read");
    assert_eq!(
        (read_configuration, read_memory),
        (Some(configuration), fetched.memory)
    );
    std::fs::write(&file, "{}").expect("it is written");
    assert!(
        read(&file)
            .expect_err("no box")
            .to_string()
            .contains("not a black box")
    );
}
