//! Our board's image in the same model, whole or broken: the parts of it that use what is broken.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use firmware::wire::adis::Burst;
use firmware::wire::command::{MAX_PACKET, Request, Response, cause, decode, encode};
use qemu::judges::ask;
use serde_json::{Value, json};

use crate::programs::hex;

fn packet(request: &Request) -> String {
    let mut buffer = [0; MAX_PACKET];
    hex(encode(1, request, &mut buffer).expect("a packet"))
}

/// Runs our board's image in a model, and returns the rest of the line that begins with each name.
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

/// A part of our board's image that uses what a mutant breaks.
#[derive(Clone, Copy, Debug)]
pub enum Part {
    /// Sensor's bytes to the navigation computer and time, as in `faults.rs`.
    Stream,
    /// An ADIS at the SPI.
    Adis,
    /// A record in a store that holds what is no record.
    Store,
    /// No record at 2.65 V.
    Supply,
    /// The window watchdog, when the clock of the loop runs away.
    Window,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Stream,
        Self::Adis,
        Self::Store,
        Self::Supply,
        Self::Window,
    ];
}

type Tools<'a> = (&'a Path, &'a Path);

/// Whether our image does what it must.
pub fn check_ours(tools: Tools, broken: Option<&str>, part: Part) -> Result<()> {
    match part {
        Part::Stream => stream(tools, broken),
        Part::Adis => adis(tools, broken),
        Part::Store => store(tools, broken, false),
        Part::Supply => store(tools, broken, true),
        Part::Window => {
            let asked = json!({"ms": 90, "faults": [[60, "tim2", 4.0]]});
            let told = ours(tools, (FAULTS, broken), asked, &["why "])?;
            ensure!(told[0].contains("fed too early"), "{}", told[0]);
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
    let told = ours(tools, (FAULTS, broken), asked, &names)?;
    // 22 to 24 frames of 28 bytes: the first one comes into the start, which lasts 14 to 19 ms
    let passed = ["True 616", "True 644", "True 672"];
    let all = passed.iter().any(|passed| told[0].ends_with(passed));
    ensure!(all, "passed: {}", told[0]);
    ensure!(told[1] == "168000000", "{} Hz", told[1]);
    let understood = told[3..].iter().all(|line| line.ends_with(" 0 0"));
    ensure!(understood, "{told:?}");
    let mut bytes: Vec<u8> = (0..told[2].len() / 2)
        .map(|n| u8::from_str_radix(&told[2][2 * n..2 * n + 2], 16))
        .collect::<Result<_, _>>()?;
    bytes.retain(|byte| *byte != 0);
    let Ok((_, Response::Reset(reset))) = decode::<Response>(&mut bytes) else {
        bail!("no answer: {}", told[2]);
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
    let told = ours(tools, ("stm32f405.py", broken), asked, &["navigation "])?;
    ensure!(told[0] == frames.concat(), "{}", told[0]);
    Ok(())
}

/// A record is stored if the supply is not low.
fn store(tools: Tools, broken: Option<&str>, low: bool) -> Result<()> {
    let chip = json!({"volts": if low { 2.65 } else { 3.3 }, "brown_out": 0});
    // both sectors of the store hold no record, and no place for one
    let full = [0x080C_0000, 0x080E_0000].map(|at| json!([at, "00".repeat(0x2_0000)]));
    let asked = json!({"ms": 1400, "chip": chip, "quiet": [50, 1400],
        "flash": full, "ask": [[100, packet(&Request::StoreImage)]]});
    let told = ours(tools, (FAULTS, broken), asked, &["writes "])?;
    ensure!((told[0] == "0") == low, "{} writes", told[0]);
    Ok(())
}
