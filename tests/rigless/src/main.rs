//! Runs an unmodified image on a chip of the crate `rigless`.
mod asked;
mod board;
mod line;
mod run;

use std::io::{Read, Write, stdin, stdout};

use anyhow::Result;

fn main() -> Result<()> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    let told = run::run(&serde_json::from_str(&text)?)?;
    stdout().write_all(told.as_bytes())?;
    Ok(())
}
