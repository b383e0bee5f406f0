//! The pages: each link leads somewhere, in the tree and in the built book; each page is in the
//! book's table of contents; worked diffs apply to the tree; the front page is short.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

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

/// Whether a hunk applies: the file must contain its old lines consecutively.
fn applies(file: &str, old: &[&str]) -> bool {
    let lines: Vec<&str> = file.lines().collect();
    lines.windows(old.len()).any(|window| window == old)
}

/// Each worked diff that names its files applies to the tree: files that it creates do not exist
/// yet, and each hunk's old lines do.
#[test]
fn worked_diffs_apply() {
    let top = workspace();
    for (page, least) in [
        ("add-a-protocol.md", 5),
        ("add-an-error-term.md", 2),
        ("add-a-hypothesis.md", 4),
    ] {
        let text = std::fs::read_to_string(top.join("docs").join(page)).expect("a page");
        let mut hunks = 0;
        for diff in blocks(&text, "diff") {
            let mut lines = diff.lines();
            let from = lines.next().and_then(|line| line.strip_prefix("--- "));
            let to = lines.next().and_then(|line| line.strip_prefix("+++ b/"));
            let (from, to) = from.zip(to).expect("a diff begins with its files");
            let file = top.join(to);
            if from == "/dev/null" {
                assert!(!file.exists(), "{page}: {to} is there already");
                hunks += 1;
                continue;
            }
            assert_eq!(from.strip_prefix("a/"), Some(to), "{page}");
            let file = std::fs::read_to_string(file).expect(to);
            let lines: Vec<&str> = lines.collect();
            for hunk in lines.split(|line| line.starts_with("@@ ")).skip(1) {
                let kept = hunk.iter().filter(|line| !line.starts_with('+'));
                let old: Vec<&str> = kept.map(|line| line.get(1..).unwrap_or("")).collect();
                assert!(old.len() > 2, "{page}: {to}: a hunk without context");
                assert!(applies(&file, &old), "{page}: {to}: {old:#?} is not there");
                hunks += 1;
            }
        }
        assert!(hunks >= least, "{page}: {hunks} hunks");
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

/// The commands of `host-sim` that pages show.
const COMMANDS: [&str; 15] = [
    "run",
    "replay",
    "convert",
    "learnability",
    "campaign",
    "fleet",
    "allan",
    "device",
    "hil",
    "start",
    "abuse",
    "simulate",
    "report",
    "soak",
    "unit",
];

/// Each command that a page shows as code has options that the program knows.
#[test]
fn commands_of_the_pages_are_known() {
    let mut seen = 0;
    for path in pages().into_keys() {
        let text = std::fs::read_to_string(&path).expect("a page");
        for line in text.lines().filter_map(|line| line.strip_prefix("    ")) {
            let line = line.trim_start_matches("cargo run --release -- ");
            let line = line.split("  ").next().unwrap_or_default();
            let line = line.split(" #").next().unwrap_or_default();
            let line = line.split(" -- ").next().unwrap_or_default();
            let words: Vec<_> = line.split_whitespace().collect();
            let whole = !line.contains(['|', '$']) && !line.contains("...");
            if !whole || !words.first().is_some_and(|word| COMMANDS.contains(word)) {
                continue;
            }
            let asked = std::process::Command::new(system::host_sim_binary())
                .args(&words)
                .arg("--help")
                .output()
                .expect("host-sim runs");
            let errors = String::from_utf8_lossy(&asked.stderr).into_owned();
            assert!(
                asked.status.success(),
                "{}: {line}: {errors}",
                path.display()
            );
            seen += 1;
        }
    }
    assert!(seen > 50, "{seen} commands");
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
