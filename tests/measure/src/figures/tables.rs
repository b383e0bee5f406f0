//! Tables of the pages that come from committed files, `docs/figures/NAME.csv`: between the markers
//! `figures table NAME` of a page. Most are copied unchanged.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use qemu::committed::{Committed, file};

use super::{drive, measured, real, sensors};
use crate::markers::between;
use crate::table::markdown;

/// The command that writes these tables.
const COMMAND: &str = "figures tables";
const MARKER: &str = "<!-- figures table ";

/// A table as Markdown.
pub fn table(name: &str) -> Result<String> {
    let of = Committed::read(name)?;
    match name {
        "drive" => drive::drive_table(&of),
        "path" => measured::path_table(&of),
        "sensors" => sensors::table(&of),
        "works" => measured::works_table(&of),
        "real-rc-car" | "real-car" | "real-hand-a" | "real-hand-b" | "real-hand-c" => {
            real::table(&of)
        }
        _ => Ok(markdown(&of.header, of.rows.iter().cloned())),
    }
    .with_context(|| file(name))
    .map(|table| table + &version(&of))
}

/// The learner that a table was measured with, and whether there is a newer one.
fn version(of: &Committed) -> String {
    let present = firmware::learn::VERSION;
    match learner(&of.made_by) {
        Some(version) if version < present => {
            format!("\nMeasured with learner {version}; **the present one is {present}**.\n")
        }
        Some(version) => format!("\nMeasured with learner {version}.\n"),
        None => String::new(),
    }
}

/// The version of the learner that a text names.
pub fn learner(text: &str) -> Option<u32> {
    let (_, rest) = text
        .split_once("learner ")
        .filter(|(before, _)| before.ends_with(", ") || before.ends_with("with "))?;
    let digits = rest.chars().take_while(char::is_ascii_digit);
    digits.collect::<String>().parse().ok()
}

/// A page's text with the tables of the files, and how many there are.
pub fn of(text: &str) -> Result<(usize, String)> {
    let (mut new, mut seen) = (text.to_owned(), 0);
    for line in text.lines() {
        let begins = line
            .strip_prefix(MARKER)
            .and_then(|rest| rest.split_once(": written by"));
        if let Some((name, _)) = begins {
            new = between(
                &new,
                &format!("figures table {name}"),
                COMMAND,
                &table(name)?,
            )?;
            seen += 1;
        }
    }
    Ok((seen, new))
}

/// Writes the tables into all pages.
pub fn write() -> Result<()> {
    for page in super::pages()? {
        write_in(&page).with_context(|| page.display().to_string())?;
    }
    Ok(())
}

fn write_in(page: &Path) -> Result<()> {
    let old = fs::read_to_string(page)?;
    let (_, new) = of(&old)?;
    if new != old {
        fs::write(page, new)?;
        println!("{}", page.display());
    }
    Ok(())
}
