//! Checks the width of comments and the length of files: no line of Rust with a comment is longer
//! than [`WIDTH`], and no file is longer than [`LINES`]. rustfmt wraps code, but leaves comments as
//! they are.

use crate::images::workspace;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};

/// Longest line with a comment, in characters.
const WIDTH: usize = 100;
/// Longest file, in lines.
const LINES: usize = 500;

/// Reads every Rust file of the workspace.
///
/// # Errors
/// Names each line and file that is too long; a file that cannot be read.
pub fn check() -> Result<()> {
    let root = workspace();
    let mut found = Vec::new();
    for file in rust_files(&root)? {
        let text = std::fs::read_to_string(&file).with_context(|| format!("{}", file.display()))?;
        let name = file.strip_prefix(&root).unwrap_or(&file).display();
        for number in long_comments(&text) {
            found.push(format!(
                "{name}:{number}: a comment of more than {WIDTH} characters"
            ));
        }
        let lines = text.lines().count();
        if lines > LINES {
            found.push(format!("{name}: {lines} lines, {LINES} are allowed"));
        }
    }
    ensure!(
        found.is_empty(),
        "too long; remedy: wrap comments, split files\n{}",
        found.join("\n")
    );
    Ok(())
}

/// Numbers of the lines, from 1, that carry a comment and are too long. A line that holds a link
/// cannot be wrapped and is left alone.
fn long_comments(text: &str) -> impl Iterator<Item = usize> {
    let lines = text.lines().enumerate();
    lines.filter_map(|(at, line)| {
        let comment = line.trim_start().starts_with("//") || line.contains(" // ");
        let long = line.chars().count() > WIDTH && !line.contains("://");
        (comment && long).then_some(at + 1)
    })
}

/// All `.rs` files below the folder, without what is built or hidden.
fn rust_files(root: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let entries =
            std::fs::read_dir(&folder).with_context(|| format!("{}", folder.display()))?;
        for entry in entries {
            let path = entry
                .with_context(|| format!("{}", folder.display()))?
                .path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() {
                if name != "target" && !name.starts_with('.') {
                    folders.push(path);
                }
            } else if name.ends_with(".rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_comments_are_found_and_long_code_is_not() {
        let comment = format!("    // {}", "x".repeat(WIDTH - 6));
        let fits = format!("/// {}", "ä".repeat(WIDTH - 4));
        let behind = format!("let x = 1; // {}", "x".repeat(WIDTH));
        let code = format!("let x = \"{}\";", "x".repeat(WIDTH));
        let address = format!("// see https://{}", "x".repeat(WIDTH));
        let text = [comment, fits, behind, code, address].join("\n");
        assert_eq!(long_comments(&text).collect::<Vec<_>>(), [1, 3]);
    }
}
