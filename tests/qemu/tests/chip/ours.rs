//! Our board's image in the same model, intact or broken: one check for each part of the chip that
//! a mutant breaks.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use firmware::wire::adis::Burst;
use firmware::wire::command::{MAX_PACKET, Request, Response, cause, decode, encode};
use qemu::judges::ask;
use serde_json::{Value, json};

use qemu::drive::hex;

fn packet(request: &Request) -> String {
    let mut buffer = [0; MAX_PACKET];
    hex(encode(1, request, &mut buffer).expect("a packet"))
}

/// Runs our board's image in a model. Returns, for each name, the rest of the output line that
/// begins with it.
fn ours(
    (python, image): Tools,
    (script, broken): (&str, Option<&str>),
    mut asked: Value,
    names: &[&str],
) -> Result<Vec<String>> {
    asked["image"] = json!(image);
    asked["break"] = json!(broken);
    let output = ask(python, script, asked.to_string().as_bytes())?;
    let line = |name: &&str| {
        let found = output.iter().find_map(|line| line.strip_prefix(*name));
        found.unwrap_or_default().trim().to_owned()
    };
    Ok(names.iter().map(line).collect())
}

/// A function of our board's image that uses what a mutant breaks.
#[derive(Clone, Copy, Debug)]
pub enum BoardFunction {
    /// Sensor bytes passed to the navigation computer, and the clocks, as in `faults`.
    Stream,
    /// An ADIS at the SPI.
    Adis,
    /// Storing a record in a flash that is full of zeros, which are no record.
    Store,
    /// At a supply of 2.65 V no record is stored.
    Supply,
    /// The window watchdog, when the clock of the main loop runs too fast.
    Window,
}

impl BoardFunction {
    /// All parts.
    pub const ALL: [Self; 5] = [
        Self::Stream,
        Self::Adis,
        Self::Store,
        Self::Supply,
        Self::Window,
    ];
}

type Tools<'a> = (&'a Path, &'a Path);

/// Checks one part of our image.
pub fn check_ours(tools: Tools, broken: Option<&str>, part: BoardFunction) -> Result<()> {
    match part {
        BoardFunction::Stream => stream(tools, broken),
        BoardFunction::Adis => adis(tools, broken),
        BoardFunction::Store => store(tools, broken, false),
        BoardFunction::Supply => store(tools, broken, true),
        BoardFunction::Window => {
            let asked = json!({"ms": 90, "faults": [[60, "tim2", 4.0]]});
            let lines = ours(tools, (FAULTS, broken), asked, &["why "])?;
            ensure!(lines[0].contains("fed too early"), "{}", lines[0]);
            Ok(())
        }
    }
}

const FAULTS: &str = "stm32faults.py";

fn stream(tools: Tools, broken: Option<&str>) -> Result<()> {
    let asked = json!({"ms": 60, "ask": [[50, packet(&Request::GetReset)]]});
    let names = [
        "start ",
        "clock ",
        "command ",
        "line sensor ",
        "line navigation ",
    ];
    let lines = ours(tools, (FAULTS, broken), asked, &names)?;
    // 22 to 24 frames of 28 bytes: the first ones arrive during the start, which lasts 14 to 19 ms
    // and may end within a frame
    let passed = lines[0].rsplit_once(" True ");
    let bytes = passed.and_then(|(_, bytes)| bytes.parse::<u32>().ok());
    ensure!(
        bytes.is_some_and(|bytes| (616..=672).contains(&bytes)),
        "passed: {}",
        lines[0]
    );
    ensure!(lines[1] == "168000000", "{} Hz", lines[1]);
    let understood = lines[3..].iter().all(|line| line.ends_with(" 0 0"));
    ensure!(understood, "{lines:?}");
    let mut bytes: Vec<u8> = (0..lines[2].len() / 2)
        .map(|n| u8::from_str_radix(&lines[2][2 * n..2 * n + 2], 16))
        .collect::<Result<_, _>>()?;
    bytes.retain(|byte| *byte != 0);
    let Ok((_, Response::Reset(reset))) = decode::<Response>(&mut bytes) else {
        bail!("no answer: {}", lines[2]);
    };
    ensure!(reset.causes & cause::POWER_ON != 0, "{reset:?}");
    // asked at 50 ms; the clocks are measured and ready after 11 to 16 ms
    let uptime = reset.uptime_ms;
    ensure!((30..=40).contains(&uptime), "{uptime} ms");
    Ok(())
}

fn adis(tools: Tools, broken: Option<&str>) -> Result<()> {
    let frame = |counter| Burst {
        gyro: [i32::from(counter), -70_000, 3],
        counter,
        ..Burst::default()
    };
    let frames: Vec<_> = (0..10).map(|n| hex(&frame(n).emit32())).collect();
    let adis = json!({"product": 16507, "range": 3, "hz": 1_000_000});
    let asked = json!({"command": [], "sensor": frames, "period": 168_000, "adis": adis});
    let lines = ours(tools, ("stm32f405.py", broken), asked, &["navigation "])?;
    ensure!(lines[0] == frames.concat(), "{}", lines[0]);
    Ok(())
}

/// A record is stored unless the supply is low.
fn store(tools: Tools, broken: Option<&str>, low: bool) -> Result<()> {
    let chip = json!({"volts": if low { 2.65 } else { 3.3 }, "brown_out": 0});
    // neither sector of the store has a record or free space for one
    let full = [0x080C_0000, 0x080E_0000].map(|at| json!([at, "00".repeat(0x2_0000)]));
    let asked = json!({"ms": 1400, "chip": chip, "quiet": [50, 1400],
        "flash": full, "ask": [[100, packet(&Request::StoreImage)]]});
    let lines = ours(tools, (FAULTS, broken), asked, &["writes "])?;
    ensure!((lines[0] == "0") == low, "{} writes", lines[0]);
    Ok(())
}
