//! Runs an image of the Raspberry Pi Pico 2 in a third-party emulator, `rp2350-emu`.
//!
//! Standard input, JSON: `image`: path. `command`: requests, hexadecimal; each is sent over USB
//! after the answer to the previous one. `restart`: requests after a power cycle. `sensor`: frames,
//! hexadecimal, at UART0, one each `period` cycles of 150 MHz, `baud` bit/s. `damage`: `[[frame,
//! byte, "framing" or "overrun"], ...]`: that byte comes with a wrong stop bit, or is lost. `gnss`:
//! `[[cycle after the first frame, hex], ...]` at the receiver's pin, 115 200 bit/s. `ask`:
//! requests after the frames. `deaf`: then no interrupt reaches the core for so many milliseconds.
//! `theirs`: the navigation computer's UART is the emulator's.
//!
//! Standard output: `navigation HEX`, `command HEX` and, from before the power went off, `before
//! HEX`, `interrupts NUMBER COUNT`, `came CYCLE ...`, `left CYCLE ...` (end of each byte's stop bit
//! at UART0, begin of its start bit at UART1, from the first frame on), `executed OUTSIDE INSIDE`
//! (instructions outside interrupts and in them), `start MILLISECOND WHY`, `flash ERASED
//! PROGRAMMED` (sectors, pages), `log HEX`, and `wrong WHAT` for behaviour that the chip does not
//! have.
mod chip;
mod fabric;
mod gaps;
mod rom;
mod uart;
mod usb;

use std::io::Read;

use serde_json::Value;

use chip::{Chip, US};

const MS: u64 = 1000 * US;
/// Pins of the lines and their functions: UART, and PIO0.
const PINS: [(u32, u32); 5] = [(0, 2), (1, 2), (4, 2), (5, 2), (6, 6)];

/// The flash content of an ELF image.
fn flash(image: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(image[at..at + 4].try_into().expect("four bytes"));
    let half = |at: usize| usize::from(u16::from_le_bytes([image[at], image[at + 1]]));
    let mut flash = vec![0xFF; rom::FLASH];
    for n in 0..half(44) {
        let header = word(28) as usize + half(42) * n;
        let [kind, from, _, to, len] = [0, 1, 2, 3, 4].map(|n| word(header + 4 * n) as usize);
        let address = to
            .checked_sub(0x1000_0000)
            .filter(|to| to + len <= rom::FLASH);
        if let (1, Some(to)) = (kind, address) {
            flash[to..to + len].copy_from_slice(&image[from..from + len]);
        }
    }
    flash
}

fn bytes(hex: &Value) -> Vec<u8> {
    let text = hex.as_str().unwrap_or_default();
    let digits = |at: usize| u8::from_str_radix(&text[at..at + 2], 16).expect("hexadecimal");
    (0..text.len()).step_by(2).map(digits).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn list<'a>(asked: &'a Value, name: &str) -> &'a [Value] {
    asked[name].as_array().map_or(&[], Vec::as_slice)
}

/// Sends requests, each after the answer to the previous one.
fn ask(chip: &mut Chip, requests: &[Value]) {
    for request in requests {
        let answered = chip.own.usb.from_device.len();
        chip.own.usb.to_device.extend(bytes(request));
        let give_up = chip.now() + 5000 * MS;
        while !chip.own.usb.from_device[answered..].contains(&0) && chip.now() < give_up {
            chip.run(chip.now() + MS / 10);
        }
    }
}

/// Puts the frames on the sensor line from this cycle on. Returns when each byte has arrived.
fn send(chip: &mut Chip, asked: &Value, start: u64) -> Vec<u64> {
    let baud = asked["baud"].as_u64().unwrap_or(921_600);
    let period = asked["period"].as_u64().unwrap_or(MS);
    let uart = &mut chip.own.uarts[0];
    let byte = uart.bits() * 1_000_000 * US / baud;
    for (n, frame) in list(asked, "sensor").iter().enumerate() {
        for (k, of) in bytes(frame).into_iter().enumerate() {
            let at = start + period * n as u64 + byte * (k as u64 + 1);
            let damaged = list(asked, "damage")
                .iter()
                .find(|one| one[0] == n && one[1] == k);
            let flag = match damaged.and_then(|one| one[2].as_str()) {
                Some("framing") => uart::FRAMING,
                Some("overrun") => uart::OVERRUN,
                _ => 0,
            };
            uart.arrivals.push_back((at, u16::from(of) | flag));
        }
    }
    chip.own.next = 0;
    chip.own.uarts[0]
        .arrivals
        .iter()
        .map(|(at, _)| at - start)
        .collect()
}

/// Puts the receiver's bytes on its pin.
fn fixes(chip: &mut Chip, asked: &Value, start: u64) {
    let bit = 1_000_000 * US / 115_200;
    for message in list(asked, "gnss") {
        let begin = start + message[0].as_u64().expect("a cycle");
        for (n, byte) in bytes(&message[1]).into_iter().enumerate() {
            let bits = u32::from(byte) << 1 | 1 << 9; // start bit, byte, stop bit
            for k in 0..10 {
                let at = begin + bit * (10 * n as u64 + k);
                chip.receiver.push((at, bits >> k & 1 == 1));
            }
        }
    }
}

fn times(cycles: impl Iterator<Item = u64>) -> String {
    let cycles: Vec<_> = cycles.map(|at| at.to_string()).collect();
    cycles.join(" ")
}

/// Behaviour that the chip does not have.
fn wrong(chip: &mut Chip) -> Vec<String> {
    let mut wrong: Vec<_> = chip.own.usb.wrong.iter().cloned().collect();
    if !chip.own.usb.is_open() {
        wrong.push("USB is not open".to_owned());
    }
    for (pin, function) in PINS {
        let (is, open) = chip.pin(pin);
        if is != function || !open {
            wrong.push(format!("pin {pin} has function {is}, open: {open}"));
        }
    }
    wrong
}

fn main() {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).expect("text");
    let asked: Value = serde_json::from_str(&text).expect("JSON");
    let image = std::fs::read(asked["image"].as_str().expect("a path")).expect("an image");
    let mut chip = Chip::new(flash(&image));
    chip.own.theirs = asked["theirs"] == true;
    chip.run(40 * MS);
    ask(&mut chip, list(&asked, "command"));
    let before = chip.own.usb.from_device.clone();
    if asked["restart"].is_array() {
        chip.run(chip.now() + 250 * MS); // storing begins when the answer is sent
        chip.start("power");
        chip.run(chip.now() + 40 * MS);
        ask(&mut chip, list(&asked, "restart"));
    }
    (chip.served, chip.executed) = Default::default();
    for uart in &mut chip.own.uarts {
        (uart.sent, uart.began) = Default::default();
    }
    let start = chip.now();
    let came = send(&mut chip, &asked, start);
    fixes(&mut chip, &asked, start);
    let frames = list(&asked, "sensor").len() as u64;
    chip.run(start + asked["period"].as_u64().unwrap_or(MS) * frames + 5 * MS);
    let (served, executed) = (chip.served.clone(), chip.executed);
    ask(&mut chip, list(&asked, "ask"));
    if let Some(deaf) = asked["deaf"].as_u64() {
        chip.deaf = true;
        chip.run(chip.now() + deaf * MS);
    }
    println!("navigation {}", hex(&chip.own.uarts[1].sent));
    println!("came {}", times(came.into_iter()));
    println!(
        "left {}",
        times(chip.own.uarts[1].began.iter().map(|at| at - start))
    );
    println!("before {}", hex(&before));
    println!("command {}", hex(&chip.own.usb.from_device));
    for (number, count) in served {
        println!("interrupts {number} {count}");
    }
    println!("executed {} {}", executed[0], executed[1]);
    for (at, why) in &chip.starts {
        println!("start {} {why}", at / MS);
    }
    let [erased, programmed] = chip.rom.counts;
    println!("flash {erased} {programmed}");
    println!("log {}", hex(&chip.log));
    for what in wrong(&mut chip) {
        println!("wrong {what}");
    }
}
