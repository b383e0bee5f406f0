//! An ADIS at the board's SPI, whose bursts DMA fetches: the bytes, the cost, and the counters
//! after failures.

use firmware::configuration::Sensor as ConfiguredSensor;
use firmware::wire::adis::{Burst, Form, Model, Settings};
use firmware::wire::command::{Counters, Request, Response, decode};
use qemu::budget::Budgets;
use qemu::protocol::packet_of;
use serde_json::{Value, json};

use super::*;

/// A sensor by its product number: range, fastest clock, one burst.
pub struct Sensor {
    pub product: u32,
    range: u32,
    hz: u32,
    burst: fn(u16) -> Vec<u8>,
}

pub const SENSORS: [Sensor; 2] = [
    Sensor {
        product: 16507,
        range: 0x3,
        hz: 1_000_000,
        burst: |counter| burst(counter).emit32().to_vec(),
    },
    Sensor {
        product: 16495,
        range: 0x7,
        hz: 6_500_000,
        burst: |counter| burst(counter).emit_1649x(true).to_vec(),
    },
];

fn burst(counter: u16) -> Burst {
    Burst {
        gyro: [i32::from(counter), -70_000, 3],
        accel: [5, 6_000_000, -i32::from(counter)],
        temperature: 250,
        counter,
        ..Burst::default()
    }
}

impl Sensor {
    pub fn bursts(&self, count: u16) -> Vec<Record> {
        let record = |n| Record {
            input: Input::Sensor,
            at_us: 0,
            bytes: (self.burst)(n),
        };
        (0..count).map(record).collect()
    }

    /// The sensor, as the model reads it (JSON).
    pub fn description(&self) -> Value {
        json!({"product": self.product, "range": self.range, "hz": self.hz})
    }
}

pub fn bytes(frames: &[Record]) -> String {
    frames.iter().map(|frame| hex(&frame.bytes)).collect()
}

/// An ADIS16507-1 and an ADIS16495-2 are found, set up and read at their data-ready; the bursts
/// leave unchanged. Each burst takes two interrupts: data-ready and the end of the transfer.
#[test]
fn an_adis_is_found_and_its_bursts_leave() {
    let (Some(python), Some(built)) = (python(), STM32F405.build_or_skip()) else {
        return;
    };
    for sensor in SENSORS {
        let frames = sensor.bursts(100);
        let description = sensor.description();
        let done = run(
            &python,
            &built,
            &[],
            &frames,
            (MILLISECOND, BAUD),
            &description,
        );
        let name = sensor.product;
        assert!(done.sent == bytes(&frames), "{name}: {}", done.sent);
        let counts = [DATA_READY, BURST_END].map(|number| done.served(number));
        assert_eq!(counts, [100; 2], "{name}");
    }
}

/// Frames that pass before instructions are counted, so that a UART's format is known; and the
/// number of frames that are counted.
const BEFORE: usize = 20;
const COUNTED: usize = 40;

/// Instructions of the core per frame that passes. All other work in the time of a frame is
/// included.
pub fn cost(python: &Path, image: &Path, world: Value, frames: &[Record], period: u32) -> f64 {
    let lines = SerialLines {
        sensor_baud: 3_000_000,
        ..SerialLines::DEFAULT
    };
    let mut configuration = Configuration {
        lines,
        ..Configuration::default()
    };
    configuration.correction.check_rate = false;
    let commands = configure(&configuration).expect("packets");
    let mut world = world;
    world["count"] = json!(BEFORE);
    let frames = &frames[..BEFORE + COUNTED];
    let pace = (period, lines.sensor_baud);
    let done = run_in(python, image, &commands, frames, pace, &world);
    assert!(done.sent == bytes(frames), "{world}");
    done.executed.iter().sum::<f64>() / COUNTED as f64
}

/// At 2000 and at 4000 bursts a second the core executes for a burst at most what `budgets.toml`
/// says, and no more than for a frame from a UART.
#[test]
fn a_burst_costs_what_a_uart_frame_costs() {
    let (Some(python), Some(image)) = (python(), STM32F405.build_or_skip()) else {
        return;
    };
    let budget = Budgets::read().expect("budgets.toml").adis;
    let uart = frames(ImuFormat::AdisUart, 1);
    for (hz, sensor, most) in [
        (2000, &SENSORS[0], budget.burst_2000),
        (4000, &SENSORS[1], budget.burst_4000),
    ] {
        let period = 1000 * MILLISECOND / hz;
        let spi = json!({"adis": sensor.description()});
        let burst = cost(&python, &image, spi, &sensor.bursts(200), period);
        println!(
            "ADIS{} at {hz} a second: {burst:.0} instructions a burst",
            sensor.product
        );
        let line = json!({"adis": null});
        let frame = cost(&python, &image, line, &uart, period);
        println!("UART at {hz} a second: {frame:.0} instructions a frame");
        assert!(burst <= most, "{hz}: {burst}");
        assert!(burst <= frame, "{hz}: {burst} and {frame}");
    }
}

/// A transfer that hangs, and a data-ready that does not come, cost their bursts and are counted;
/// all others leave.
#[test]
fn failed_bursts_are_counted_and_the_rest_leaves() {
    let (Some(python), Some(image)) = (python(), STM32F405.build_or_skip()) else {
        return;
    };
    let request = hex(&packet_of(1, &Request::GetCounters).expect("a packet"));
    for sensor in SENSORS {
        let frames = sensor.bursts(60);
        let mut adis = sensor.description();
        (adis["hangs"], adis["silent"]) = (json!([20]), json!([40]));
        let world = json!({"adis": adis, "ask": [request]});
        let done = run_in(&python, &image, &[], &frames, (MILLISECOND, BAUD), &world);
        // the burst that finds the transfer hanging is lost too: the sensor needs a pause
        let intact: Vec<Record> = (0..60)
            .filter(|n| ![20, 21, 40].contains(n))
            .map(|n| frames[n].clone())
            .collect();
        let name = sensor.product;
        assert!(done.sent == bytes(&intact), "{name}: {}", done.sent);
        let counted = counters(&done.command);
        assert_eq!(
            (counted.lost, counted.missed),
            (2, 3),
            "{name}: {counted:?}"
        );
        assert_eq!(counted.frames, 57, "{name}");
    }
}

/// The configuration of a sensor at the SPI, with this rate, Hz. Nothing is corrected.
pub fn configuration(sensor: &Sensor, rate: f64) -> Configuration {
    let model = Model::from_registers(sensor.product as u16, sensor.range as u16);
    let model = model.expect("a model");
    let form = model.form();
    let units = model.units(form != Form::Narrow).expect("a range");
    let mut configuration = Configuration {
        sensor: Some(ConfiguredSensor::Spi(Settings {
            form,
            units,
            framed: false,
        })),
        rate,
        ..Configuration::default()
    };
    configuration.lines.sensor_baud = 3_000_000; // 4250 bursts of 40 bytes need 1 700 000
    configuration.correction.check_rate = false;
    configuration.correction.mode = Mode::Bypass;
    configuration
}

/// The configured rate is set, also while bursts arrive, and set again with the next configuration.
/// After that bursts leave unchanged. The burst in progress is dropped, and nothing at the old rate
/// leaves later.
#[test]
fn the_configured_rate_is_set() {
    if let (Some(python), Some(image)) = (python(), STM32F405.build_or_skip()) {
        sets_rates(&python, &image, 1);
    }
}

/// Configures rates one after another; the sensor is set up `rest` ms after an answer.
pub fn sets_rates(python: &Path, image: &Path, rest: u32) {
    for (sensor, rates, decimation) in [
        (&SENSORS[0], &[][..], 1),
        (&SENSORS[0], &[2000.0][..], 0),
        (&SENSORS[0], &[2000.0, 100.0][..], 19),
        (&SENSORS[1], &[][..], 3),
        (&SENSORS[1], &[4250.0][..], 0),
        (&SENSORS[1], &[4250.0, 10.0, 2125.0][..], 1),
    ] {
        let configured = rates
            .iter()
            .flat_map(|rate| configure(&configuration(sensor, *rate)).expect("packets"));
        let commands: Vec<_> = configured.collect();
        let frames = sensor.bursts(60);
        let old = (sensor.burst)(7);
        let mut adis = sensor.description();
        (adis["before"], adis["rest"]) = (json!(hex(&old)), json!(rest));
        let world = json!({"adis": adis});
        let done = run_in(
            python,
            image,
            &commands,
            &frames,
            (MILLISECOND, BAUD),
            &world,
        );
        let name = (sensor.product, rates);
        assert_eq!(done.decimation, Some(decimation), "{name:?}");
        let new = bytes(&frames);
        let before = done.sent.strip_suffix(&new);
        let before = before.unwrap_or_else(|| panic!("{name:?}: {}", done.sent));
        let (old, ready) = (hex(&old), before.len() / hex(&old).len());
        assert_eq!(before, old.repeat(ready), "{name:?}: whole bursts");
        assert!(rates.is_empty() || ready > 2, "{name:?}: {ready} before");
    }
}

/// Decodes the last answer, hexadecimal, which must be one to `GetCounters`.
pub fn counters(answers: &str) -> Counters {
    let pairs = (0..answers.len() / 2).map(|n| &answers[2 * n..2 * n + 2]);
    let bytes = pairs.map(|pair| u8::from_str_radix(pair, 16).expect("hexadecimal"));
    let bytes: Vec<u8> = bytes.collect();
    let mut packets = bytes.split(|byte| *byte == 0);
    let last = packets.rfind(|packet| !packet.is_empty());
    let mut bytes = last.expect("an answer").to_vec();
    match decode::<Response>(&mut bytes) {
        Ok((_, Response::Counters(counters))) => counters,
        other => panic!("{other:?}"),
    }
}
