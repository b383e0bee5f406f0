//! Runs an unmodified image on a chip of the crate `rigless`.
mod adis;
mod board;
mod line;
mod request;
mod run;

use std::io::{Read, Write, stdin, stdout};

use anyhow::Result;

fn main() -> Result<()> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    // the input lives as long as the program, so the thread of the core may hold it
    let request = Box::leak(Box::new(serde_json::from_str(&text)?));
    let output = run::run(request)?;
    stdout().write_all(output.as_bytes())?;
    Ok(())
}
