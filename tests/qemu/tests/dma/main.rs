//! The board's own image on a chip with a DMA controller and with an ADIS at its SPI bus. QEMU has
//! neither, so the chip is Unicorn's Cortex-M4 with peripherals written from the reference manual
//! (`judges/stm32f405.py`).

mod adis;
mod bursts;
mod layer;
mod ring;

use std::path::Path;

use firmware::configuration::{Configuration, Parity, SerialLines};
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use qemu::drive::{Record, frames, hex};
use qemu::images::{Image, STM32F405, STM32F405_WINDOW};
use qemu::judges::{ask, python};
use qemu::protocol::{configure, mode, set_up};
use qemu::replay::Input;
use qemu::software::desktops;

/// Numbers of interrupts: the sensor's UART, its stream in, and the navigation computer's stream
/// out.
const SENSOR: i32 = 37;
const SENSOR_IN: i32 = 58;
const NAVIGATION_OUT: i32 = 17;
/// ... data-ready of the ADIS, and the end of its burst.
const DATA_READY: i32 = 10;
const BURST_END: i32 = 56;

/// Results of a run of the image.
struct Done {
    /// Bytes sent to the navigation computer, hexadecimal.
    sent: String,
    /// How often each interrupt was served.
    served: Vec<(i32, usize)>,
    /// Bytes of core-coupled memory that the image has written, from the start on, and how many of
    /// them are not 0.
    coupled: [usize; 2],
    /// Bytes sent on USART3, hexadecimal.
    usart3: String,
    /// Bits per character and divider of USART1, USART2, USART3 and UART4.
    lines: Vec<(i32, usize)>,
    /// When the stop bit of each byte on the sensor's line ended, and when the start bit of each
    /// byte on the navigation line began, cycles.
    came: Vec<f64>,
    left: Vec<f64>,
    /// Instructions outside interrupts and in them, where they were counted.
    executed: Vec<f64>,
    /// Bytes sent on the command link, hexadecimal.
    command: String,
    /// DEC_RATE of the ADIS.
    decimation: Option<u16>,
}

impl Done {
    fn served(&self, number: i32) -> usize {
        let found = self.served.iter().find(|(of, _)| *of == number);
        found.map_or(0, |(_, count)| *count)
    }
}

fn run(
    python: &Path,
    image: &Path,
    commands: &[Vec<u8>],
    frames: &[Record],
    (period, baud): (u32, u32),
    adis: &serde_json::Value,
) -> Done {
    let world = serde_json::json!({"adis": adis});
    run_in(python, image, commands, frames, (period, baud), &world)
}

/// Runs the image on a chip with other properties; `world` is added to the input of the model.
fn run_in(
    python: &Path,
    image: &Path,
    commands: &[Vec<u8>],
    frames: &[Record],
    (period, baud): (u32, u32),
    world: &serde_json::Value,
) -> Done {
    let commands: Vec<_> = commands.iter().map(|packet| hex(packet)).collect();
    let sensor: Vec<_> = frames.iter().map(|frame| hex(&frame.bytes)).collect();
    let mut asked = serde_json::json!({
        "image": image, "command": commands, "sensor": sensor, "period": period, "baud": baud,
        "times": true,
    });
    for (name, value) in world.as_object().expect("an object") {
        asked[name] = value.clone();
    }
    let output = ask(python, "stm32f405.py", asked.to_string().as_bytes()).expect("it runs");
    let values = |name: &'static str| {
        output
            .iter()
            .filter_map(move |line| line.strip_prefix(name))
    };
    let pair = |text: &'_ str| {
        let (first, second) = text.split_once(' ').expect("two numbers");
        let first: i32 = first.parse().expect("a number");
        (first, second.parse::<usize>().expect("a number"))
    };
    let cycles = |name: &'static str| -> Vec<f64> {
        let line = values(name).next().unwrap_or_default();
        line.split_whitespace()
            .map(|at| at.parse().expect("a number"))
            .collect()
    };
    let (written, not_zero) = pair(values("coupled ").next().expect("a line"));
    Done {
        sent: values("navigation")
            .next()
            .expect("a line")
            .trim()
            .to_owned(),
        served: values("interrupts ").map(pair).collect(),
        coupled: [written as usize, not_zero],
        usart3: values("gnss ").next().expect("a line").trim().to_owned(),
        lines: values("line ")
            .map(|line| pair(line.split_once(' ').expect("a name").1))
            .collect(),
        came: cycles("came"),
        left: cycles("left"),
        executed: cycles("executed"),
        command: values("command ").next().unwrap_or_default().to_owned(),
        decimation: values("decimation ")
            .next()
            .map(|n| n.parse().expect("a number")),
    }
}

/// The output equals the desktop's. Each frame costs one input interrupt (two where it crosses the
/// end of the ring) and two output interrupts, regardless of the phase of the millisecond clock.
fn corrects(image: Image, format: ImuFormat, seconds: u32, period: u32) {
    let (Some(python), Some(built)) = (python(), image.build_or_skip()) else {
        return;
    };
    let frames = frames(format, seconds);
    let set_up = set_up().expect("requests");
    let none = serde_json::Value::Null;
    let done = run(&python, &built, &set_up, &frames, (period, BAUD), &none);
    let expected = desktops(&frames);
    assert!(
        done.sent == expected,
        "{} of {}",
        done.sent.len() / 2,
        expected.len() / 2
    );
    assert_eq!(done.served(SENSOR), 0, "an interrupt a byte, or errors");
    // One more where the ring ends; the format is detected byte by byte.
    let most = frames.len() * 9 / 8 + 200;
    let counts = [SENSOR_IN, NAVIGATION_OUT].map(|number| done.served(number));
    assert!(counts[0] >= frames.len() && counts[0] <= most, "{counts:?}");
    assert!(counts[1] <= 2 * most, "{counts:?}");
}

/// The configuration reopens the lines while DMA moves their bytes: bit rate, parity, stop bits,
/// and the assignment of UARTs. The command link keeps answering, and the sensor's frames pass,
/// byte for byte. A divider below 16 uses 8 samples per bit.
#[test]
fn lines_are_reopened_as_configured() {
    let (Some(python), Some(built)) = (python(), STM32F405.build_or_skip()) else {
        return;
    };
    let frames = frames(ImuFormat::Stim300, 1);
    let bytes: Vec<u8> = frames
        .iter()
        .flat_map(|frame| frame.bytes.clone())
        .collect();
    let usual = SerialLines::DEFAULT;
    let cases = [
        (
            SerialLines {
                sensor_baud: 1_843_200,
                parity: Parity::Odd,
                two_stop_bits: true,
                receiver_baud: 9600,
                pins: 1,
                cut_through: false,
            },
            1_826_087,
            [(12, 46), (12, 23), (10, 4375)],
        ),
        (
            SerialLines {
                sensor_baud: 3_000_000,
                pins: 2,
                ..usual
            },
            3_000_000,
            [(10, 28), (10, 365), (10, 14)],
        ),
    ];
    for (lines, baud, expected) in cases {
        let mut configuration = Configuration {
            lines,
            ..Configuration::default()
        };
        configuration.correction.check_rate = false;
        let commands = configure(&configuration).expect("packets");
        let done = run(
            &python,
            &built,
            &commands,
            &frames,
            (MILLISECOND, baud),
            &serde_json::Value::Null,
        );
        assert_eq!(done.lines[..3], expected, "{lines:?}");
        assert_eq!(done.lines[3], (10, 46), "the command link");
        let (sent, other) = if lines.pins == 2 {
            (&done.usart3, &done.sent)
        } else {
            (&done.sent, &done.usart3)
        };
        assert!(*sent == hex(&bytes), "{lines:?}: {sent}");
        assert!(other.is_empty(), "{lines:?}: {other}");
    }
}

/// Bit rate of the sensor without a configuration.
const BAUD: u32 = 921_600;
/// Cycles in a millisecond.
const MILLISECOND: u32 = 168_000;

#[test]
fn stim300_by_dma() {
    // Its 800 frames lie anywhere in a millisecond.
    corrects(STM32F405, ImuFormat::Stim300, 4, MILLISECOND - 210);
}

/// A frame of 36 bytes takes 390 us of the 500 us period.
#[test]
fn kvh_by_dma_at_two_thousand_a_second() {
    corrects(STM32F405, ImuFormat::Kvh, 1, MILLISECOND / 2);
}

#[test]
fn novatel_by_dma_in_the_small_image() {
    corrects(STM32F405_WINDOW, ImuFormat::Novatel, 3, MILLISECOND);
}

/// The learner from fixes is in the memory that DMA cannot access: zero before it learns,
/// initialised when it does. The small image has no such learner.
#[test]
fn the_learner_is_in_core_coupled_memory() {
    let Some(python) = python() else { return };
    let frames = frames(ImuFormat::Stim300, 1);
    let learns = mode(Mode::Learn).expect("packets");
    for (image, commands, is_there, is_used) in [
        (STM32F405, vec![], true, false),
        (STM32F405, learns.clone(), true, true),
        (STM32F405_WINDOW, learns, false, false),
    ] {
        let Some(built) = image.build_or_skip() else {
            return;
        };
        let none = serde_json::Value::Null;
        let done = run(
            &python,
            &built,
            &commands,
            &frames,
            (MILLISECOND, BAUD),
            &none,
        );
        let [written, not_zero] = done.coupled;
        let name = image.name;
        assert!(done.sent.len() > 100, "{name}: {} digits", done.sent.len());
        assert_eq!(written > 45_000, is_there, "{name}: {written} bytes");
        assert!(is_there || written == 0, "{name}: {written} bytes");
        assert_eq!(not_zero > 2_000, is_used, "{name}: {not_zero} bytes");
    }
}
