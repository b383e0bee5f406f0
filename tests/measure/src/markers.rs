//! The parts of documents that a command writes.

use std::fs;

use anyhow::{Context, Result, ensure};
use qemu::images::workspace;

/// Replaces the text between the markers of `task` in `docs/PERFORMANCE.md`.
pub fn write(task: &str, part: &str) -> Result<()> {
    write_in("docs/PERFORMANCE.md", task, part)
}

/// Replaces the text between the markers of `task` in this file of the workspace.
pub fn write_in(file: &str, task: &str, part: &str) -> Result<()> {
    let path = workspace().join(file);
    let old = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let new = between(&old, task, task, part).with_context(|| path.display().to_string())?;
    fs::write(&path, new).with_context(|| path.display().to_string())
}

/// `old` with the text between the markers of this name, which `task` writes, replaced by `part`.
pub fn between(old: &str, name: &str, task: &str, part: &str) -> Result<String> {
    let begin = format!("<!-- {name}: written by `cargo xtask {task}` -->\n");
    let end = format!("<!-- {name}: end -->");
    let missing = || format!("no line `{}`; remedy: git restore the file", begin.trim());
    let (before, rest) = old.split_once(&begin).with_context(missing)?;
    let (_, after) = rest
        .split_once(&end)
        .with_context(|| format!("no line `{end}` after the first marker"))?;
    ensure!(
        !after.contains(begin.trim()),
        "the marker is there twice; remedy: keep one"
    );
    Ok(format!("{before}{begin}{part}{end}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_between_the_markers_changes() {
        let begin = "<!-- x: written by `cargo xtask x` -->\n";
        let end = "<!-- x: end -->";
        let old = format!("# a\n{begin}old | 1 |\n{end}\nb\n");
        let new = between(&old, "x", "x", "new\n").expect("markers are there");
        assert_eq!(new, format!("# a\n{begin}new\n{end}\nb\n"));
        assert_eq!(between(&new, "x", "x", "new\n").expect("still there"), new);
        assert!(between(&old, "y", "y", "new\n").is_err());
        assert!(between("# a\n", "x", "x", "new\n").is_err());
        assert!(between(&format!("{begin}x"), "x", "x", "new\n").is_err());
        assert!(between(&format!("{new}{begin}"), "x", "x", "new\n").is_err());
    }
}
