//! Runs an unmodified image on a chip of the crate `rigless`.
mod adis;
mod asked;
mod board;
mod line;
mod run;

use std::io::{Read, Write, stdin, stdout};

use anyhow::Result;

fn main() -> Result<()> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    // the input lives as long as the program, so the thread of the core may hold it
    let asked = Box::leak(Box::new(serde_json::from_str(&text)?));
    let output = run::run(asked)?;
    stdout().write_all(output.as_bytes())?;
    Ok(())
}
