//! Numbers that a page quotes from somewhere else. A mark right behind a number says where it is
//! from:
//!
//! ```text
//! in 49<!-- figures: docs/START.md; hand-held; silently wrong --> of 50 trials
//! ```
//!
//! | source | the number |
//! |---|---|
//! | `PAGE.md; ROW; COLUMN; N` | the N-th (or first) of a cell, in the first table with both |
//! | `PAGE.md#HEADING; ...` | the same below the heading that begins so |
//! | `docs/figures/NAME.csv; ROW; COLUMN` | a cell of a committed file (`qemu::committed`) |
//! | `budgets.toml; KEY` | of a budget, as `image.mps2.flash` |
//! | `budgets.toml; KEY; wanted` | of the goal in the comment behind it: `wanted: 3 800` |
//! | `code; KEY` | version of a format (`facts`) |
//!
//! Row and column of a page are named by how they begin. At the end of a source `; /1000` divides
//! by 1000, and `; ~10` rounds to tens, `; ~0.1` to tenths; without it a quotient is rounded to 1.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use qemu::committed::Committed;

use crate::facts::formats;

const BEGIN: &str = "<!-- figures: ";
const END: &str = " -->";

/// A number in a page.
#[derive(Debug, PartialEq)]
pub struct Quote {
    /// Its line, from 1 on.
    pub line: usize,
    /// As it is written.
    pub written: String,
    /// Where it is from.
    pub source: String,
    /// As it should be written.
    pub right: String,
}

/// All quotes of a page's text, and the text with the numbers of their sources.
pub fn of(text: &str, top: &Path) -> Result<(Vec<Quote>, String)> {
    let (mut quotes, mut out) = (Vec::new(), String::new());
    for (number, line) in (1..).zip(text.split_inclusive('\n')) {
        let mut rest = line;
        while let Some((before, mark)) = rest.split_once(BEGIN) {
            let end = || format!("line {number}: a mark without its end");
            let (source, after) = mark.split_once(END).with_context(end)?;
            let place = || format!("line {number}: `{source}`");
            let digits = last_number(before);
            ensure!(!digits.is_empty(), "{}: no number before it", place());
            let right = like(&digits, &value(source, top).with_context(place)?);
            out += before.strip_suffix(&digits).unwrap_or(before);
            out += &format!("{right}{BEGIN}{source}{END}");
            quotes.push(Quote {
                line: number,
                written: digits,
                source: source.to_owned(),
                right,
            });
            rest = after;
        }
        out += rest;
    }
    Ok((quotes, out))
}

/// The number with which a text ends; its digits may be in groups of three.
fn last_number(text: &str) -> String {
    let part = |text: &str| {
        let of_it = |c: &char| c.is_ascii_digit() || *c == '.';
        text.chars().rev().take_while(of_it).count() // as many bytes: all are ASCII
    };
    let mut begin = text.len() - part(text);
    loop {
        let group = text.get(begin..).unwrap_or_default();
        let is_group = group.split([' ', '.']).next().is_some_and(|g| g.len() == 3);
        let Some(before) = text.get(..begin).and_then(|text| text.strip_suffix(' ')) else {
            break;
        };
        let more = part(before);
        if !is_group || !(1..=3).contains(&more) || before.ends_with('.') {
            break;
        }
        begin = before.len() - more;
    }
    text.get(begin..).unwrap_or_default().to_owned()
}

/// A number, with its digits in groups if those of `written` are.
fn like(written: &str, value: &str) -> String {
    let plain: String = value.chars().filter(|c| *c != ' ').collect();
    if !written.contains(' ') {
        return plain;
    }
    let (whole, fraction) = plain.split_once('.').unwrap_or((&plain, ""));
    let mut out = String::new();
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    if !fraction.is_empty() {
        out += &format!(".{fraction}");
    }
    out
}

/// The number of a source, divided and rounded as the source says.
fn value(source: &str, top: &Path) -> Result<String> {
    let mut parts: Vec<_> = source.split(';').map(str::trim).collect();
    let mut option = |sign: char| {
        let number = parts.last()?.strip_prefix(sign)?.to_owned();
        parts.pop();
        Some(number)
    };
    let (step, divisor) = (option('~'), option('/'));
    let plain = number(&parts, top)?;
    if step.is_none() && divisor.is_none() {
        return Ok(plain);
    }
    let plain: f64 = plain.replace(' ', "").parse().context("no number")?;
    let divisor: f64 = divisor.as_deref().unwrap_or("1").parse().context("/N")?;
    let step = step.as_deref().unwrap_or("1");
    let digits = step.split_once('.').map_or(0, |(_, behind)| behind.len());
    let step: f64 = step.parse().context("~N")?;
    let rounded = (plain / divisor / step).round() * step;
    Ok(format!("{rounded:.digits$}"))
}

fn number(parts: &[&str], top: &Path) -> Result<String> {
    let read = |name: &str| fs::read_to_string(top.join(name)).with_context(|| name.to_owned());
    match parts[..] {
        [csv, row, column] if csv.ends_with(".csv") => {
            let table = Committed::parse(csv, &read(csv)?).with_context(|| csv.to_owned())?;
            Ok(table.cell(row, column)?.to_owned())
        }
        ["code", key] => {
            let format = formats().into_iter().find(|format| format.key == key);
            let format = format.with_context(|| format!("no format `{key}`"))?;
            Ok(format.version.to_string())
        }
        ["budgets.toml", key] => budget(&read("budgets.toml")?, key),
        ["budgets.toml", key, "wanted"] => wanted(&read("budgets.toml")?, key),
        [page, row, column, ref n @ ..] if n.len() < 2 => {
            let (file, heading) = page.split_once('#').unwrap_or((page, ""));
            ensure!(file.ends_with(".md"), "no source of numbers");
            let n = n.first().map_or(Ok(1), |n| n.parse()).context("N")?;
            cell(below(&read(file)?, heading)?, row, column, n)
        }
        _ => bail!("no source of numbers"),
    }
}

/// What stands below the heading that begins so; all without a heading.
fn below<'a>(page: &'a str, heading: &str) -> Result<&'a str> {
    let mut rest = page;
    while let (false, Some((line, after))) = (heading.is_empty(), rest.split_once('\n')) {
        let title = line.trim_start_matches('#');
        if title.len() < line.len() && title.trim_start().starts_with(heading) {
            return Ok(after);
        }
        rest = after;
    }
    ensure!(heading.is_empty(), "no heading `{heading}`");
    Ok(page)
}

/// The N-th number of a cell, of the first table that has the row and the column.
fn cell(page: &str, row: &str, column: &str, n: usize) -> Result<String> {
    let cells = |line: &str| -> Option<Vec<String>> {
        let inside = line.trim().strip_prefix('|')?.strip_suffix('|')?;
        let plain = |cell: &str| {
            let text = without_marks(cell);
            text.replace(['`', '*'], "").trim().to_owned()
        };
        Some(inside.split('|').map(plain).collect())
    };
    let mut header: Option<Vec<String>> = None;
    for line in page.lines() {
        let Some(cells) = cells(line) else {
            header = None;
            continue;
        };
        let Some(header) = &header else {
            header = Some(cells);
            continue;
        };
        let at = header.iter().skip(1).position(|name| name == column);
        let begins = || {
            header
                .iter()
                .skip(1)
                .position(|name| name.starts_with(column))
        };
        let is_row = cells.first().is_some_and(|first| {
            let behind = first.strip_prefix(row);
            behind.is_some_and(|behind| !behind.starts_with(|c: char| c.is_alphanumeric()))
        });
        if let (true, Some(at)) = (is_row, at.or_else(begins)) {
            let cell = cells.get(at + 1).map_or("", String::as_str);
            let found = numbers(cell).into_iter().nth(n.saturating_sub(1));
            return found.with_context(|| format!("`{cell}` has no {n} numbers"));
        }
    }
    bail!("no table has the row `{row}` and the column `{column}`")
}

/// A text without the marks of quotes.
fn without_marks(text: &str) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some((before, mark)) = rest.split_once(BEGIN) {
        out += before;
        rest = mark.split_once(END).map_or("", |(_, after)| after);
    }
    out + rest
}

/// The numbers of a text; digits in groups are one number.
fn numbers(text: &str) -> Vec<String> {
    let (mut found, mut end) = (Vec::new(), text.len());
    while let Some(at) = text
        .get(..end)
        .and_then(|text| text.rfind(|c: char| c.is_ascii_digit()))
    {
        let number = last_number(&text[..=at]);
        end = at + 1 - number.len();
        found.push(number.trim_start_matches('.').to_owned());
    }
    found.reverse();
    found
}

/// A value of `budgets.toml`.
fn budget(text: &str, key: &str) -> Result<String> {
    let table: toml::Table = toml::from_str(text).context("budgets.toml")?;
    let mut value = toml::Value::Table(table);
    for name in key.split('.') {
        let part = value.get(name).cloned();
        value = part.with_context(|| format!("budgets.toml has no `{key}`"))?;
    }
    ensure!(
        value.is_integer() || value.is_float(),
        "`{key}` is no number"
    );
    Ok(value.to_string())
}

/// The goal in the comment behind a budget.
fn wanted(text: &str, key: &str) -> Result<String> {
    let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
    let mut within = "";
    for line in text.lines() {
        let head = line.split('#').next().unwrap_or_default().trim();
        if let Some(head) = head
            .strip_prefix('[')
            .and_then(|head| head.strip_suffix(']'))
        {
            within = head;
        } else if within == table && head.split('=').next().unwrap_or_default().trim() == name {
            let goal = line.split_once("wanted: ").map(|(_, goal)| goal);
            let goal = goal.with_context(|| format!("`{key}` names no goal (`wanted: N`)"))?;
            let first = numbers(goal).into_iter().next();
            return first.with_context(|| format!("`{key}`: no number in `wanted: {goal}`"));
        }
    }
    bail!("budgets.toml has no `{key}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "| class | unit |\n|---|---|\n| a | 7 |\n\n\
        | class | started | late, s |\n|---|---|---|\n| ab | 1 | 2 |\n\
        | `a` 28 | 48 of 50 | 12 345 / 0.5 |\n";

    #[test]
    fn a_cell_is_found_in_the_table_that_has_it() {
        let of = |row, column, n| cell(PAGE, row, column, n).expect("there");
        assert_eq!(of("a", "unit", 1), "7");
        assert_eq!(of("a", "started", 2), "50");
        assert_eq!(of("a", "late", 1), "12 345");
        assert_eq!(of("ab", "late", 1), "2");
        assert_eq!(of("a", "late", 2), "0.5");
        for (row, column, n) in [("b", "unit", 1), ("a", "gone", 1), ("a", "unit", 2)] {
            assert!(cell(PAGE, row, column, n).is_err(), "{row} {column} {n}");
        }
    }

    #[test]
    fn a_table_below_a_heading() {
        let page = format!("# x\n\n{PAGE}\n## Later, more\n\n| c | unit |\n|---|---|\n| a | 9 |\n");
        let of = |heading| below(&page, heading).and_then(|part| cell(part, "a", "unit", 1));
        assert_eq!(of("").expect("there"), "7");
        assert_eq!(of("Later").expect("there"), "9");
        assert!(of("a").is_err() && below(&page, "c").is_err());
    }

    #[test]
    fn the_number_before_a_mark() {
        for (text, number) in [
            ("at 22 min 1 077", "1 077"),
            ("takes 12 345", "12 345"),
            ("| 0.51", "0.51"),
            ("22 50", "50"),
            ("none", ""),
            ("5 1234", "1234"),
            ("100", "100"),
        ] {
            assert_eq!(last_number(text), number, "{text}");
        }
        assert_eq!(
            numbers("210 / 1 077 (2 .. 3.5)"),
            ["210", "1 077", "2", "3.5"]
        );
    }

    #[test]
    fn budgets_and_goals() {
        let text = "a = 5\n[x.y] # of 7\nb = 30 # 40 before; wanted: 1 200, and more\nc = 1\n";
        assert_eq!(budget(text, "a").expect("a"), "5");
        assert_eq!(budget(text, "x.y.b").expect("b"), "30");
        assert_eq!(wanted(text, "x.y.b").expect("goal"), "1 200");
        for key in ["b", "x.y.c", "a"] {
            assert!(wanted(text, key).is_err(), "{key}");
        }
        assert!(budget(text, "x.y").is_err() && budget(text, "x.z").is_err());
    }

    #[test]
    fn cells_of_files_are_divided_and_rounded() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "# x\nimage,kind,\"flash, B\"\na,b,588236\na,c,12.3456\n";
        fs::write(folder.path().join("f.csv"), text).expect("written");
        let of = |rest: &str| value(&format!("f.csv; {rest}"), folder.path());
        for (source, number) in [
            ("a,b; flash, B", "588236"),
            ("a,b; flash, B; /1000", "588"),
            ("a,b; flash, B; ~1000", "588000"),
            ("a,b; flash, B; /1000; ~10", "590"),
            ("a,c; flash, B; ~0.01", "12.35"),
        ] {
            assert_eq!(of(source).expect(source), number, "{source}");
        }
        for bad in [
            "a; flash, B",
            "a,d; kind",
            "a,b; kind; ~1",
            "a,b; flash, B; ~x",
        ] {
            assert!(of(bad).is_err(), "{bad}");
        }
        assert_eq!(
            like("588 000", &of("a,b; flash, B; ~1000").expect("it")),
            "588 000"
        );
    }

    #[test]
    fn numbers_are_put_in_their_place() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("p.md"), PAGE).expect("written");
        let text = |started: &str, late: &str| {
            format!(
                "x\n{started}<!-- figures: p.md; a; started --> of 50, \
                 **{late}<!-- figures: p.md; a; late --> s**.\n"
            )
        };
        let (quotes, new) = of(&text("47", "9 999"), folder.path()).expect("sources");
        let found: Vec<_> = quotes
            .iter()
            .map(|q| (q.line, q.written.as_str(), q.right.as_str()))
            .collect();
        assert_eq!(found, [(2, "47", "48"), (2, "9 999", "12 345")]);
        assert_eq!(new, text("48", "12 345"));
        assert_eq!(of(&new, folder.path()).expect("sources").1, new);
        for bad in [
            "<!-- figures: p.md; a; unit -->",
            "1<!-- figures: q.md; a; b -->",
            "1<!-- figures: x -->",
        ] {
            let error = format!("{:#}", of(bad, folder.path()).expect_err(bad));
            assert!(error.contains("line 1"), "{error}");
        }
    }
}
