//! The pages: each link leads somewhere, each page is in the book's table of contents, and the
//! front page is short.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

/// Most words of README.md: a page and a half.
const SHORT: usize = 800;

fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("tests/system").to_path_buf()
}

/// What a page holds.
#[derive(Default)]
struct Page {
    links: Vec<String>,
    /// Names of its headings, as a link calls them.
    headings: BTreeSet<String>,
    words: usize,
}

/// A heading as a link calls it: GitHub's and mdBook's rule.
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
