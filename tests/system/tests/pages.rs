//! The pages: each link leads somewhere, in the tree and in the built book; each page is in the
//! book's table of contents; worked patches apply to the tree; the front page is short. Commands,
//! paths and tests that the documents name exist.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use documents::{judge, shown};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

/// Most words of README.md: a page and a half.
const SHORT: usize = 800;

fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("tests/system").to_path_buf()
}

/// Content of a page.
#[derive(Default)]
struct Page {
    links: Vec<String>,
    /// Anchors of its headings.
    headings: BTreeSet<String>,
    words: usize,
}

/// The anchor of a heading, by GitHub's and mdBook's rule.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn page(path: &Path) -> Page {
    let text = std::fs::read_to_string(path).expect("a readable page");
    let mut page = Page::default();
    let mut heading: Option<String> = None;
    for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                page.links.push(dest_url.into_string());
            }
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                page.headings
                    .extend(heading.take().map(|text| anchor(&text)));
            }
            Event::Text(text) | Event::Code(text) => {
                page.words += text.split_whitespace().count();
                if let Some(heading) = &mut heading {
                    heading.push_str(&text);
                }
            }
            _ => {}
        }
    }
    page
}

/// The pages that a reader begins with, and all of `docs/`.
fn pages() -> BTreeMap<PathBuf, Page> {
    let top = workspace();
    let docs = std::fs::read_dir(top.join("docs")).expect("docs/");
    let docs = docs.map(|entry| entry.expect("an entry").path());
    let outside = [
        "README.md",
        "CONTRIBUTING.md",
        "firmware/README.md",
        "host-sim/python/README.md",
        "lrnn-nostd/README.md",
    ];
    let all = docs.chain(outside.map(|name| top.join(name)));
    all.filter(|path| path.extension().is_some_and(|e| e == "md"))
        .map(|path| (path.clone(), page(&path)))
        .collect()
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                out.pop();
            }
            Component::CurDir => {}
            part => out.push(part),
        }
    }
    out
}

#[test]
fn every_link_leads_somewhere() {
    let pages = pages();
    let mut followed = 0;
    for (path, page) in &pages {
        for link in &page.links {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            followed += 1;
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => path.clone(),
                file => plain(&path.parent().expect("a folder").join(file)),
            };
            assert!(target.exists(), "{}: {link}: no file", path.display());
            let known = pages
                .get(&target)
                .is_none_or(|to| heading.is_empty() || to.headings.contains(heading));
            assert!(known, "{}: {link}: no such heading", path.display());
        }
    }
    assert!(followed > 50, "{followed} links");
}

/// The built book has the files of `docs/` and nothing else: a link to another file leads nowhere
/// there.
#[test]
fn no_link_of_the_book_leaves_it() {
    let docs = workspace().join("docs");
    let mut followed = 0;
    for (path, page) in pages() {
        let Ok(name) = path.strip_prefix(&docs) else {
            continue;
        };
        for link in page.links.iter().filter(|link| !link.contains("://")) {
            let (file, _) = link.split_once('#').unwrap_or((link, ""));
            let inside = plain(&docs.join(file)).starts_with(&docs);
            assert!(inside, "{}: {link} leaves docs/", name.display());
            followed += 1;
        }
    }
    assert!(followed > 50, "{followed} links");
}

/// The code blocks of a page in this language.
fn blocks(page: &str, language: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut within = None;
    for line in page.lines() {
        match (&mut within, line.strip_prefix("```")) {
            (None, Some(of)) => within = Some((of == language, String::new())),
            (Some((wanted, text)), Some(_)) => {
                blocks.extend(wanted.then(|| std::mem::take(text)));
                within = None;
            }
            (Some((_, text)), None) => {
                text.push_str(line);
                text.push('\n');
            }
            (None, None) => {}
        }
    }
    blocks
}

/// Each worked example is a patch that applies to the tree, and its page shows how.
#[test]
fn worked_patches_apply() {
    for name in ["add-a-protocol", "add-an-error-term", "add-a-hypothesis"] {
        let patch = format!("docs/{name}.patch");
        let page = std::fs::read_to_string(workspace().join(format!("docs/{name}.md")));
        assert!(
            page.expect("a page")
                .contains(&format!("git apply {patch}"))
        );
        let tried = std::process::Command::new("git")
            .args(["apply", "--check", &patch])
            .current_dir(workspace())
            .output()
            .expect("git runs");
        let said = String::from_utf8_lossy(&tried.stderr);
        assert!(tried.status.success(), "{patch}: {said}");
    }
}

/// Rust code in the book is also in the README of `lrnn-nostd`, whose examples run as its tests.
#[test]
fn rust_in_the_book_is_tested() {
    let top = workspace();
    let tested = std::fs::read_to_string(top.join("lrnn-nostd/README.md")).expect("a page");
    let tested = blocks(&tested, "rust");
    let mut seen = 0;
    for path in pages()
        .into_keys()
        .filter(|path| path.starts_with(top.join("docs")))
    {
        let text = std::fs::read_to_string(&path).expect("a page");
        for block in blocks(&text, "rust") {
            assert!(tested.contains(&block), "{}: {block}", path.display());
            seen += 1;
        }
    }
    assert!(seen > 0);
}

/// Each command of `host-sim` that a document shows is parsed by the program's own parser.
#[test]
fn commands_of_the_documents_are_parsed() {
    let definition = host_sim::cli::Cli::definition();
    let (mut seen, mut wrong) = (0, Vec::new());
    for shown in shown() {
        let from_cargo = shown.after("cargo run --release");
        let words = match (from_cargo, shown.words.as_slice()) {
            (Some([]), _) => continue,
            (Some([dashes, words @ ..]), _) if dashes == "--" => words,
            (None, [program, words @ ..]) if program == "host-sim" => words,
            // a command without the program's name; `unit = ...` is a line of a file
            (None, words @ [first, second, ..])
                if second != "=" && definition.find_subcommand(first).is_some() =>
            {
                words
            }
            _ => continue,
        };
        let words = words.iter().filter(|word| *word != "...");
        let given = ["host-sim"].into_iter().chain(words.map(String::as_str));
        let given = definition.clone().try_get_matches_from(given);
        wrong.extend(judge(&shown, given).err());
        seen += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen > 100, "{seen} commands");
}

/// The files that git knows.
fn tracked() -> BTreeSet<String> {
    let listed = std::process::Command::new("git")
        .args(["ls-files"])
        .current_dir(workspace())
        .output()
        .expect("git runs");
    let listed = String::from_utf8(listed.stdout).expect("names");
    listed.lines().map(str::to_owned).collect()
}

/// Whether a word is a path from the top of the tree, as the documents write it.
fn is_path(word: &str) -> bool {
    let folders = [
        "deploy",
        "docs",
        "firmware",
        "host-sim",
        "lrnn-nostd",
        "tests",
        "xtask",
    ];
    let top = word.split('/').next().unwrap_or_default();
    let plain = |c: char| c.is_alphanumeric() || "/._-".contains(c);
    let known = word.contains('/') && !word.contains("NAME");
    known && folders.contains(&top) && word.chars().all(plain)
}

/// Each path that a document names is there: a file with or without `.rs`, or a folder. A worked
/// diff makes the files that are in it.
#[test]
fn paths_in_the_documents_are_there() {
    let files = tracked();
    let (mut seen, mut wrong) = (0, Vec::new());
    for shown in shown().iter().filter(|shown| !shown.whole) {
        for path in shown.words.iter().filter(|word| is_path(word)) {
            let path = path.trim_end_matches('/');
            // from the top, or in the package whose page it is
            let page = shown.at.rsplit_once('/').map_or("", |(folder, _)| folder);
            let there = |file: &String| {
                let own = file
                    .strip_prefix(page)
                    .map_or("", |file| file.trim_start_matches('/'));
                let rest = [file.as_str(), own]
                    .into_iter()
                    .find_map(|f| f.strip_prefix(path));
                let rest = rest.unwrap_or("-");
                rest.is_empty() || rest == ".rs" || rest.starts_with('/')
            };
            seen += 1;
            if !files.iter().any(there) {
                wrong.push(format!("{}: no {path}", shown.at));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen > 100, "{seen} paths");
}

/// The names of tests and modules in the sources.
fn names_in_sources() -> String {
    let files = tracked();
    let sources = files.iter().filter(|file| file.ends_with(".rs"));
    let mut names = String::new();
    for file in sources {
        let text = std::fs::read_to_string(workspace().join(file)).unwrap_or_default();
        for line in text.lines() {
            let line = line.trim_start().trim_start_matches("pub ");
            let named = ["fn ", "mod "]
                .iter()
                .find_map(|word| line.strip_prefix(word));
            if let Some(name) = named {
                names += name
                    .split(|c: char| !c.is_alphanumeric() && c != '_')
                    .next()
                    .unwrap_or_default();
                names.push(' ');
            }
        }
        names += file.trim_end_matches(".rs");
        names.push(' ');
    }
    names
}

/// The cells of a column of a table in `docs/`.
fn column(file: &str, name: &str) -> Vec<String> {
    let mut rows = csv::Reader::from_path(workspace().join("docs").join(file)).expect(file);
    let headers = rows.headers().expect("a header").clone();
    let at = headers.iter().position(|header| header == name);
    let at = at.expect(name);
    rows.records()
        .map(|row| row.expect("a row")[at].to_owned())
        .collect()
}

/// Commands of the documents and of the table of promises, as words behind `cargo nextest run`.
fn commands_of_tests() -> Vec<(String, Vec<String>)> {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect();
    let mut all: Vec<(String, Vec<String>)> = Vec::new();
    for shown in shown() {
        all.extend(
            shown
                .after("cargo nextest run")
                .map(|words| (shown.at.clone(), words.to_vec())),
        );
    }
    for cell in column("RELIABILITY.csv", "command") {
        for command in cell
            .split("; ")
            .filter(|command| command.starts_with("-p "))
        {
            all.push(("docs/RELIABILITY.csv".into(), words(command)));
        }
    }
    for cell in column("MUTANTS.csv", "found by") {
        for test in cell.split(", ").filter(|test| !test.starts_with("none")) {
            all.push(("docs/MUTANTS.csv".into(), words(test)));
        }
    }
    all
}

/// The tests that the documents name: each filter selects a test or a module, each package and each
/// file of tests exists.
#[test]
fn tests_in_the_documents_are_there() {
    let names = names_in_sources();
    let budgets = std::fs::read_to_string(workspace().join("budgets.toml")).expect("budgets");
    let manifests: String = tracked()
        .iter()
        .filter(|file| file.ends_with("Cargo.toml"))
        .map(|file| std::fs::read_to_string(workspace().join(file)).expect("a manifest"))
        .collect();
    let (mut seen, mut wrong) = (0, Vec::new());
    for (at, words) in commands_of_tests() {
        let mut words = words.iter();
        while let Some(word) = words.next() {
            let there = match word.as_str() {
                "-p" | "--package" => {
                    let name = words.next().expect("a package");
                    manifests.contains(&format!("name = \"{name}\""))
                }
                "--test" => {
                    let name = words.next().expect("a file of tests");
                    names.contains(&format!("tests/{name} "))
                        || names.contains(&format!("tests/{name}/"))
                }
                "-E" => words.next().is_some(),
                option if option.starts_with('-') => true,
                path if path.contains(['/', '.']) || path.chars().any(char::is_uppercase) => true,
                filter => {
                    filter.split("::").all(|part| names.contains(part)) || budgets.contains(filter)
                }
            };
            seen += 1;
            if !there {
                wrong.push(format!("{at}: no {word}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen > 100, "{seen} names");
}

#[test]
fn every_page_is_in_the_table_of_contents() {
    let docs = workspace().join("docs");
    let contents = docs.join("SUMMARY.md");
    let listed: BTreeSet<_> = page(&contents)
        .links
        .iter()
        .map(|link| plain(&docs.join(link)))
        .collect();
    let inside = |path: &&PathBuf| path.starts_with(&docs) && **path != contents;
    let there: BTreeSet<_> = pages().into_keys().filter(|path| inside(&path)).collect();
    assert_eq!(listed, there, "docs/SUMMARY.md and docs/");
}

#[test]
fn the_front_page_is_short() {
    let words = page(&workspace().join("README.md")).words;
    assert!(words <= SHORT, "README.md has {words} words");
}
