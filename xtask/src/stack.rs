//! `cargo xtask stack`: a bound of each board's stack from its call graph, and the room there is.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use comfy_table::Table;
use qemu::images::{Image, MPS2, STM32F405, STM32F405_WINDOW};
use qemu::stack::{Bound, Way, differences};

use crate::table::numbers;

/// The boards' images.
pub const IMAGES: [Image; 3] = [STM32F405, STM32F405_WINDOW, MPS2];

/// Prints the bounds, and writes `json` if asked. A bound above the room is an error.
pub fn stack(json: Option<&Path>) -> Result<ExitCode> {
    let mut bounds = Vec::new();
    let (mut table, mut ways) = (table(), Vec::new());
    for image in IMAGES {
        let built = image.build()?;
        let bound = Bound::of(&built).with_context(|| image.name.to_owned())?;
        let frames = differences(&built, &image.build_with_frames()?)
            .with_context(|| image.name.to_owned())?;
        row(&mut table, image.name, &bound, frames);
        for way in [&bound.main].into_iter().chain(&bound.levels) {
            ways.push(functions(image.name, way));
        }
        bounds.push((image.name, bound));
    }
    println!("{table}");
    for way in ways {
        println!("\n{way}");
    }
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&bounds)? + "\n";
        fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    let beyond: Vec<_> = bounds
        .iter()
        .filter_map(|(name, bound)| excess(name, bound))
        .collect();
    if !beyond.is_empty() {
        bail!("the stack may overflow:\n  {}", beyond.join("\n  "));
    }
    Ok(ExitCode::SUCCESS)
}

/// By how much a bound is above the room.
fn excess(name: &str, bound: &Bound) -> Option<String> {
    let bytes = bound.bytes.max(bound.anew.bytes);
    (bytes > bound.room).then(|| format!("{name}: {bytes} of {} bytes", bound.room))
}

fn table() -> Table {
    numbers([
        "image",
        "stack at most, B",
        "room, B",
        "main, B",
        "interrupts, B",
        "crash handler from the top, B",
        "functions",
        "calls through registers",
        "frames as the compiler says",
    ])
}

fn row(table: &mut Table, name: &str, bound: &Bound, frames: usize) {
    table.add_row([
        name.to_owned(),
        bound.bytes.to_string(),
        bound.room.to_string(),
        bound.main.bytes.to_string(),
        (bound.bytes - bound.main.bytes).to_string(),
        bound.anew.bytes.to_string(),
        bound.functions.to_string(),
        bound.pointers.to_string(),
        frames.to_string(),
    ]);
}

fn functions(image: &str, way: &Way) -> Table {
    let mut table = numbers([
        &format!("{image}: {} bytes from {}", way.bytes, way.root),
        "bytes",
    ]);
    for (name, bytes) in &way.functions {
        table.add_row([name.clone(), bytes.to_string()]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_above_the_room_is_named() {
        let anew = Way {
            bytes: 101,
            ..Way::default()
        };
        let mut bound = Bound {
            bytes: 100,
            room: 100,
            ..Bound::default()
        };
        assert_eq!(excess("board", &bound), None);
        bound.anew = anew;
        assert_eq!(
            excess("board", &bound).as_deref(),
            Some("board: 101 of 100 bytes")
        );
        bound.anew = Way::default();
        bound.room = 99;
        assert!(excess("board", &bound).is_some());
    }
}
