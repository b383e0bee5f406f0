//! The board's own image on a chip with a DMA controller, and with an ADIS at its SPI bus, which QEMU has not: Unicorn's Cortex-M4, with peripherals written from the reference
//! manual (`judges/stm32f405.py`).

use std::path::Path;

use firmware::app::Config;
use firmware::wire::Format;
use firmware::wire::adis::Burst;
use qemu::drive::{Record, drive};
use qemu::images::{Image, STM32F405, STM32F405_WINDOW};
use qemu::judges::{ask, python};
use qemu::protocol::set_up;
use qemu::replay::Input;
use qemu::software::on_desktop;

/// Numbers of interrupts: the sensor's UART, its stream in, and the navigation computer's stream out.
const SENSOR: u32 = 37;
const SENSOR_IN: u32 = 58;
const NAVIGATION_OUT: u32 = 17;
/// ... and data-ready of the ADIS.
const DATA_READY: u32 = 10;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What the image sends to the navigation computer, and how often each interrupt was served.
fn run(
    python: &Path,
    image: &Path,
    commands: &[Vec<u8>],
    frames: &[Record],
    period: u32,
    adis: &serde_json::Value,
) -> (String, impl Fn(u32) -> usize + use<>) {
    let commands: Vec<_> = commands.iter().map(|packet| hex(packet)).collect();
    let sensor: Vec<_> = frames.iter().map(|frame| hex(&frame.bytes)).collect();
    let asked = serde_json::json!({
        "image": image, "command": commands, "sensor": sensor, "period": period, "adis": adis,
    });
    let said = ask(python, "stm32f405.py", asked.to_string().as_bytes()).expect("it runs");
    let value = |name: &str| {
        let line = said.iter().find_map(|line| line.strip_prefix(name));
        line.map(|text| text.trim().to_owned())
    };
    let sent = value("navigation").expect("a line");
    let counts: Vec<_> = said
        .iter()
        .filter_map(|line| line.strip_prefix("interrupts "))
        .filter_map(|line| line.split_once(' '))
        .map(|(number, count)| (number.to_owned(), count.parse().expect("a count")))
        .collect();
    let served = move |number: u32| {
        let wanted = number.to_string();
        let found = counts.iter().find(|(number, _)| *number == wanted);
        found.map_or(0, |(_, count)| *count)
    };
    (sent, served)
}

/// The output is the desktop's, and each frame costs one interrupt in (one more where the
/// ring ends) and two out.
fn corrects(image: Image, format: Format, seconds: u32, period: u32) {
    let (Some(python), Some(built)) = (python(), image.build_or_skip()) else {
        return;
    };
    let records = drive(format, seconds).expect("a drive");
    let frames: Vec<_> = records
        .into_iter()
        .filter(|record| record.input == Input::Sensor)
        .collect();
    let (sent, served) = run(
        &python,
        &built,
        &set_up().expect("requests"),
        &frames,
        period,
        &serde_json::Value::Null,
    );
    let mut input: Vec<_> = set_up()
        .expect("requests")
        .into_iter()
        .map(|bytes| Record {
            input: Input::Command,
            at_us: 0,
            bytes,
        })
        .collect();
    input.extend_from_slice(&frames);
    let expected = on_desktop(Config::default(), &input).sent;
    assert!(
        sent == hex(&expected),
        "{} of {}",
        sent.len() / 2,
        expected.len()
    );
    assert_eq!(served(SENSOR), 0, "an interrupt a byte, or errors");
    // one more where the millisecond of the clock falls into a frame; and the format is found out byte by byte
    let most = frames.len() * 9 / 4 + 200;
    let counts = [served(SENSOR_IN), served(NAVIGATION_OUT)];
    assert!(counts[0] >= frames.len() && counts[0] <= most, "{counts:?}");
    assert!(counts[1] <= 2 * most, "{counts:?}");
}

/// An ADIS16507-1 and an ADIS16495-2 are found, set up and read by their data-ready; the bursts leave as they came.
#[test]
fn an_adis_is_found_and_its_bursts_leave() {
    let (Some(python), Some(built)) = (python(), STM32F405.build_or_skip()) else {
        return;
    };
    let burst = |counter: u16| Burst {
        gyro: [i32::from(counter), -70_000, 3],
        accel: [5, 6_000_000, -i32::from(counter)],
        temperature: 250,
        counter,
        ..Burst::default()
    };
    for (product, range, hz) in [(16507, 0x3, 1_000_000), (16495, 0x7, 6_500_000)] {
        let frame = |counter| match product {
            16507 => burst(counter).emit32().to_vec(),
            _ => burst(counter).emit_1649x(true).to_vec(),
        };
        let frames: Vec<_> = (0..100)
            .map(|n| Record {
                input: Input::Sensor,
                at_us: 0,
                bytes: frame(n),
            })
            .collect();
        let adis = serde_json::json!({"product": product, "range": range, "hz": hz});
        let (sent, served) = run(&python, &built, &[], &frames, MILLISECOND, &adis);
        let expected: Vec<u8> = frames.into_iter().flat_map(|frame| frame.bytes).collect();
        assert!(sent == hex(&expected), "{product}: {sent}");
        assert_eq!(served(DATA_READY), 100, "{product}");
    }
}

/// Cycles from frame to frame.
const MILLISECOND: u32 = 168_000;

#[test]
fn stim300_by_dma() {
    corrects(STM32F405, Format::Stim300, 4, MILLISECOND);
}

/// 36 bytes in 390 us of 500.
#[test]
fn kvh_by_dma_at_two_thousand_a_second() {
    corrects(STM32F405, Format::Kvh, 1, MILLISECOND / 2);
}

#[test]
fn novatel_by_dma_in_the_small_image() {
    corrects(STM32F405_WINDOW, Format::Novatel, 3, MILLISECOND);
}
