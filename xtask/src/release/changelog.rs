//! The parts of `CHANGELOG.md` (Keep a Changelog) that a release needs.

use anyhow::{Result, ensure};

const UNRELEASED: &str = "## [Unreleased]";

/// The text under the heading of this version, with or without a date.
pub fn entry<'a>(text: &'a str, version: &str) -> Option<&'a str> {
    let heading = format!("## [{version}]");
    section(text, |line| {
        let rest = line.strip_prefix(&heading);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(" - "))
    })
}

/// The text under `[Unreleased]`.
pub fn unreleased(text: &str) -> &str {
    section(text, |line| line == UNRELEASED).unwrap_or_default()
}

/// The text with the unreleased changes as the entry of `version`, of this date (year-month-day).
pub fn release(text: &str, version: &str, date: &str) -> Result<String> {
    ensure!(
        entry(text, version).is_none(),
        "CHANGELOG.md has an entry for {version} already; remedy: raise `version` in Cargo.toml"
    );
    ensure!(
        !unreleased(text).is_empty(),
        "CHANGELOG.md has nothing under `{UNRELEASED}`; remedy: write there what is new"
    );
    let both = format!("{UNRELEASED}\n\n## [{version}] - {date}\n");
    Ok(text.replacen(&format!("{UNRELEASED}\n"), &both, 1))
}

/// The text between a heading of the second level and the next one.
fn section(text: &str, is: impl Fn(&str) -> bool) -> Option<&str> {
    let mut begin = None;
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let heading = line.trim_end();
        match begin {
            Some(begin) if heading.starts_with("## ") => return Some(text[begin..at].trim()),
            None if is(heading) => begin = Some(at + line.len()),
            _ => {}
        }
        at += line.len();
    }
    begin.map(|begin| text[begin..].trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Changelog\n\n## [Unreleased]\n\nWire 9.\n\n### Added\n\n- new\n\n\
                        ## [0.1.10] - 2026-01-02\n\n- ten\n\n## [0.1.0]\n\n- old\n";

    #[test]
    fn an_entry_is_that_of_its_version() {
        assert_eq!(entry(TEXT, "0.1.0"), Some("- old"));
        assert_eq!(entry(TEXT, "0.1.10"), Some("- ten"));
        assert_eq!(entry(TEXT, "0.1.1"), None);
        assert_eq!(unreleased(TEXT), "Wire 9.\n\n### Added\n\n- new");
        assert_eq!(unreleased("# Changelog\n"), "");
    }

    #[test]
    fn what_was_unreleased_becomes_an_entry() {
        let text = release(TEXT, "0.2.0", "2026-11-24").expect("something is new");
        assert_eq!(unreleased(&text), "");
        assert_eq!(entry(&text, "0.2.0"), Some(unreleased(TEXT)));
        assert!(text.contains("## [0.2.0] - 2026-11-24\n"));
        assert_eq!(entry(&text, "0.1.0"), Some("- old"));
        assert!(
            release(&text, "0.3.0", "2026-11-25").is_err(),
            "nothing new"
        );
        assert!(
            release(TEXT, "0.1.0", "2026-11-25").is_err(),
            "there already"
        );
    }
}
