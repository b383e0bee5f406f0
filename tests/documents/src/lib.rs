//! The documents of the tree, and the commands that they show. The tests that hold the commands
//! against the programs that parse them are in `tests/system`, `tests/measure` and `xtask`.

use std::path::{Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

/// Top of the tree.
fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors()
        .nth(2)
        .expect("tests/documents")
        .to_path_buf()
}

/// A command in a document.
#[derive(Debug)]
pub struct ShownCommand {
    /// Page and line.
    pub at: String,
    /// Its words, as a shell divides them.
    pub words: Vec<String>,
    /// Whether all of it is there: a line of code, and not a part of one within a sentence.
    pub whole: bool,
}

impl ShownCommand {
    /// The words behind these, if the command begins with them.
    #[must_use]
    pub fn after(&self, first: &str) -> Option<&[String]> {
        let first: Vec<_> = first.split(' ').collect();
        let begins = self
            .words
            .iter()
            .zip(&first)
            .all(|(word, first)| word == first);
        (begins && self.words.len() >= first.len()).then(|| &self.words[first.len()..])
    }
}

/// All Markdown files of the tree that its readers see; the changelog names what is gone.
#[must_use]
pub fn pages() -> Vec<PathBuf> {
    let top = workspace();
    let folders = [
        "",
        "docs",
        "deploy",
        "firmware",
        "host-sim/assets",
        "host-sim/python",
        "lrnn-nostd",
    ];
    let files = folders
        .iter()
        .flat_map(|folder| top.join(folder).read_dir().expect("a folder"));
    let files = files.map(|entry| entry.expect("an entry").path());
    let page = |path: &PathBuf| {
        path.extension().is_some_and(|end| end == "md") && !path.ends_with("CHANGELOG.md")
    };
    let mut pages: Vec<_> = files.filter(page).collect();
    pages.sort();
    pages
}

/// All code of all pages: lines of code blocks, and what stands between backticks.
#[must_use]
pub fn shown() -> Vec<ShownCommand> {
    pages().iter().flat_map(|page| of(page)).collect()
}

fn of(page: &Path) -> Vec<ShownCommand> {
    let text = std::fs::read_to_string(page).expect("a page");
    let name = page.strip_prefix(workspace()).expect("ours").display();
    let mut found = Vec::new();
    for (line, code, whole) in pieces(&text) {
        // a description stands behind two blanks or `#`, and another program behind `|`
        let code = code.trim_start();
        let ends = ["  ", " #", " | ", " > ", " && ", "; "].map(|end| code.find(end));
        let end = ends.into_iter().flatten().min().unwrap_or(code.len());
        let mut words = words(&code[..end]);
        let named = |word: &String| {
            word.split_once('=')
                .is_some_and(|(name, _)| name.chars().all(|c| c.is_uppercase() || c == '_'))
        };
        while words.first().is_some_and(named) {
            words.remove(0);
        }
        let at = format!("{name}:{line}");
        found.extend((!words.is_empty()).then_some(ShownCommand { at, words, whole }));
    }
    found
}

/// Code of a page, with its line: whole lines of code blocks, and spans of a text.
fn pieces(text: &str) -> Vec<(usize, String, bool)> {
    let (mut found, mut in_block) = (Vec::new(), false);
    let mut goes_on: Option<(usize, String)> = None;
    for (event, range) in Parser::new_ext(text, Options::ENABLE_TABLES).into_offset_iter() {
        let line = || 1 + text[..range.start].matches('\n').count();
        match event {
            Event::Start(Tag::CodeBlock(_)) => in_block = true,
            Event::End(TagEnd::CodeBlock) => in_block = false,
            Event::Code(code) => found.push((line(), code.into_string(), false)),
            // a comment, such as the marks of a table
            Event::Html(comment) => {
                let codes = comment.split('`').skip(1).step_by(2);
                found.extend(codes.map(|code| (line(), code.to_owned(), false)));
            }
            Event::Text(lines) if in_block => {
                for (number, line) in (line()..).zip(lines.lines()) {
                    let (at, mut code) = goes_on.take().unwrap_or((number, String::new()));
                    code += line.trim_start();
                    match code.strip_suffix('\\') {
                        Some(part) => goes_on = Some((at, part.to_owned())),
                        None => found.push((at, code, true)),
                    }
                }
            }
            _ => {}
        }
    }
    found
}

/// The words of a line. Quotes hold blanks together.
fn words(line: &str) -> Vec<String> {
    // `[--option VALUE]` may be left out, and is read as given
    let line = line.replace(" [", " ").replace("] ", " ");
    let line = line.strip_suffix(']').unwrap_or(&line);
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for c in line.chars() {
        match (quote, c) {
            (Some(open), c) if open == c => quote = None,
            (None, '\'' | '"') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, ' ') => words.extend(word.take()),
            (_, c) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

/// Whether a word stands for another: `FILE`, `<file>`, `...`, `$S,$F`, `{a,b}`.
#[must_use]
pub fn stands_for_another(word: &str) -> bool {
    let named = |word: &str| {
        word.chars().any(char::is_uppercase)
            && word
                .chars()
                .all(|c| c.is_uppercase() || c.is_numeric() || "_-,.:/=".contains(c))
    };
    word.contains(['$', '<', '{', '\u{2026}']) || word.contains("...") || named(word)
}

/// What is wrong with a command, by the parser of its program. A part of a command may lack
/// something, and a word that stands for another need not be a value.
///
/// # Errors
/// The parser's words.
pub fn judge(shown: &ShownCommand, given: clap::error::Result<impl Sized>) -> Result<(), String> {
    use clap::error::{ContextKind, ContextValue, ErrorKind};
    let Err(error) = given else {
        return Ok(());
    };
    let open = !shown.whole || shown.words.iter().any(|word| stands_for_another(word));
    let named = |kind| match error.get(kind) {
        Some(ContextValue::String(value)) => value.as_str(),
        _ => "",
    };
    let value = named(ContextKind::InvalidValue);
    let lacks = [
        ErrorKind::MissingRequiredArgument,
        ErrorKind::MissingSubcommand,
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand,
    ];
    let good = match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => true,
        ErrorKind::InvalidValue | ErrorKind::ValueValidation => {
            stands_for_another(value) || (value.is_empty() && open)
        }
        ErrorKind::InvalidSubcommand => stands_for_another(named(ContextKind::InvalidSubcommand)),
        // `convert --to FORMAT`, in a sentence about the commands below `convert`: the parser's tip
        ErrorKind::UnknownArgument => !shown.whole && error.to_string().contains("' exists"),
        kind => open && lacks.contains(&kind),
    };
    match good {
        true => Ok(()),
        false => Err(format!("{}: {}: {error}", shown.at, shown.words.join(" "))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_found_where_they_stand() {
        let text = "Run `a b\nc` or `d`.\n\n    SEED=1 run --out 'x y' \\\n      --fast   quickly\n\n\
                    ```sh\nrun # now\n```\n";
        let found = pieces(text);
        assert_eq!(found[0], (1, "a b c".to_owned(), false));
        assert_eq!(found[1].1, "d");
        assert_eq!(found[2].0, 4);
        assert_eq!(
            words(&found[2].1)[..5],
            ["SEED=1", "run", "--out", "x y", "--fast"]
        );
        assert_eq!(found.len(), 4);
    }

    #[test]
    fn placeholders_are_recognised() {
        for word in [
            "FILE",
            "DIR/tuning.json",
            "...",
            "<unit>",
            "$S,$F",
            "CASE.KEY=VALUE",
        ] {
            assert_eq!(
                stands_for_another(word),
                word != "DIR/tuning.json",
                "{word}"
            );
        }
        assert!(!stands_for_another("medium") && !stands_for_another("--seed"));
    }
}
