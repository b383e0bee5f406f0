//! `cargo xtask figures`: makes the tables and pictures of the pages again. The list of all
//! of them is in `list`; a test finds a generated part or a picture that is not in it.

mod campaigns;
mod drive;
mod list;
mod measured;
mod real;
mod sensors;
#[cfg(test)]
mod sizes;
mod tables;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use qemu::committed::{Committed, file};
use qemu::images::{target_directory, workspace};

use crate::stage::{cargo_with, succeed};
use crate::table::markdown;
use list::{BY_HAND, FIGURES, Figure, How};

/// Which figures to make.
#[derive(clap::Args)]
pub struct Order {
    /// Figures by name, besides the cheap ones, which are always made.
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// All figures. Takes hours.
    #[arg(long, conflicts_with = "names")]
    all: bool,
    /// Lists all figures instead: what makes each, how long it takes, and what is made by hand.
    #[arg(long, conflicts_with_all = ["names", "all"])]
    list: bool,
}

/// Makes figures, or lists them.
pub fn figures(order: &Order) -> Result<ExitCode> {
    if order.list {
        print!("{}", listed()?);
        return Ok(ExitCode::SUCCESS);
    }
    for figure in chosen(order)? {
        eprintln!("{}: {} ({})", figure.name, figure.what, figure.takes);
        make(figure).with_context(|| format!("figure `{}`", figure.name))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn chosen(order: &Order) -> Result<Vec<&'static Figure>> {
    for name in &order.names {
        let names: Vec<_> = FIGURES.iter().map(|figure| figure.name).collect();
        ensure!(
            names.contains(&name.as_str()),
            "no figure `{name}`; remedy: one of {}",
            names.join(", ")
        );
    }
    let is = |figure: &&Figure| match (order.all, &order.names[..]) {
        (true, _) => true,
        (_, names) => figure.cheap || names.iter().any(|name| name == figure.name),
    };
    Ok(FIGURES.iter().filter(is).collect())
}

fn listed() -> Result<String> {
    let header = ["name", "files", "what", "made by", "takes", "by default"];
    let rows = FIGURES.iter().map(|figure| {
        let usual = if figure.cheap { "yes" } else { "" };
        let files = figure.files.join(", ");
        let command = figure.how.command(figure.name);
        [
            figure.name,
            &files,
            figure.what,
            &command,
            figure.takes,
            usual,
        ]
        .map(str::to_owned)
        .to_vec()
    });
    let mut out = markdown(&header.map(str::to_owned), rows);
    out += "\nBy hand:\n";
    for (files, how) in BY_HAND {
        out += &format!("- {files}: {how}\n");
    }
    for table in copied()? {
        out += &format!("- {}: {}\n", file(&table.name), table.made_by);
    }
    Ok(out)
}

/// Committed tables that no figure makes; the first line of each names the command that made it.
fn copied() -> Result<Vec<Committed>> {
    let mut copied = Vec::new();
    for entry in fs::read_dir(workspace().join("docs/figures"))? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let name = name.trim_end_matches(".csv").to_owned();
        let made = FIGURES.iter().flat_map(|figure| figure.files);
        if !made.copied().any(|made| made == file(&name)) {
            copied.push(Committed::read(&name)?);
        }
    }
    copied.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(copied)
}

fn make(figure: &Figure) -> Result<()> {
    match figure.how {
        How::Here(work) => work(),
        How::HostSim(words) => {
            let folder = target_directory()?.join("figures");
            fs::create_dir_all(&folder)?;
            let json = folder.join(format!("{}.json", figure.name));
            let mut run = cargo_with("run --quiet --release --package host-sim --");
            succeed(run.args(words).arg("--json").arg(named(&json)))
        }
    }
}

/// The folder of a campaign of the present learner, which goes on there when it was interrupted.
/// Other learners have folders of their own, since their results cannot be mixed.
fn campaign_folder(name: &str) -> Result<PathBuf> {
    let folder = format!("learner-{}", firmware::learn::VERSION);
    Ok(target_directory()?.join("figures").join(folder).join(name))
}

/// A path as commands in pages name it: from the workspace on, where cargo runs, so that no page
/// names a folder of this machine.
fn named(path: &Path) -> &Path {
    path.strip_prefix(workspace()).unwrap_or(path)
}

/// The pages that may hold generated tables.
fn pages() -> Result<Vec<PathBuf>> {
    let top = workspace();
    let mut pages = ["README.md", "firmware/README.md", "lrnn-nostd/README.md"]
        .map(|name| top.join(name))
        .to_vec();
    for entry in fs::read_dir(top.join("docs"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "md") {
            pages.push(path);
        }
    }
    pages.sort();
    Ok(pages)
}

#[cfg(test)]
mod tests {
    use super::*;

    const REMEDY: &str = "remedy: cargo xtask figures";

    /// Every folder in a page is one that its reader has.
    #[test]
    fn no_page_names_a_folder_of_this_machine() {
        let top = workspace();
        for page in pages().expect("pages") {
            let text = fs::read_to_string(&page).expect("a page");
            assert!(!text.contains("/target/figures"), "{page:?}");
        }
        assert_eq!(named(&top.join("a/b")), Path::new("a/b"));
    }

    /// The tables of committed files are in the pages as they are in the files.
    #[test]
    fn tables_are_those_of_the_committed_files() {
        let mut seen = 0;
        for page in pages().expect("pages") {
            let text = fs::read_to_string(&page).expect("a page");
            let name = page.strip_prefix(workspace()).expect("ours").display();
            let (tables, right) = match tables::of(&text) {
                Ok(found) => found,
                Err(error) => panic!("{name}: {error:#}"),
            };
            seen += tables;
            for (line, (written, right)) in (1..).zip(text.lines().zip(right.lines())) {
                assert_eq!(written, right, "{name}:{line}; {REMEDY}");
            }
            assert_eq!(text, right, "{name}; {REMEDY}");
        }
        assert!(seen >= 11, "{seen} tables");
    }

    /// Each committed file is a table of a page, and names the command that made it.
    #[test]
    fn every_committed_file_is_used() {
        let all: String = pages()
            .expect("pages")
            .iter()
            .map(|page| fs::read_to_string(page).expect("a page"))
            .collect();
        for entry in fs::read_dir(workspace().join("docs/figures")).expect("docs/figures") {
            let name = entry.expect("an entry").file_name();
            let name = name.to_string_lossy();
            let name = name.strip_suffix(".csv").expect("a CSV file");
            let table = format!("<!-- figures table {name}: written");
            assert!(all.contains(&table), "{name}");
        }
        for table in copied().expect("they can be read") {
            assert!(table.made_by.starts_with("Copied from `"), "{}", table.name);
        }
    }

    /// Pages of measured results are of the present learner.
    #[test]
    fn results_are_of_the_present_learner() {
        const PAGES: [&str; 6] = ["ABUSE", "MEMORY", "REAL", "RESULTS", "START", "sensors"];
        for page in PAGES {
            let text = fs::read_to_string(workspace().join(format!("docs/{page}.md")));
            let text = text.expect("a page");
            let mut versions = text.lines().filter_map(tables::learner).peekable();
            assert!(versions.peek().is_some(), "{page} names no learner");
            for version in versions {
                let remedy = "remedy: cargo xtask figures --all, or those of the page";
                assert_eq!(version, firmware::learn::VERSION, "{page}; {remedy}");
            }
        }
    }

    /// Each part between markers, each page that a command writes and each picture is in the list.
    #[test]
    fn every_generated_part_is_in_the_list() {
        let made_by = |file: &str, command: &str| {
            FIGURES.iter().any(|figure| {
                figure.files.contains(&file)
                    && (figure.how.command(figure.name).contains(command)
                        || figure.what.contains(&format!("`{command}`")))
            })
        };
        let mut parts = 0;
        for page in pages().expect("pages") {
            let text = fs::read_to_string(&page).expect("a page");
            let name = page.strip_prefix(workspace()).expect("ours");
            let name = name.to_str().expect("a name");
            for line in text.lines() {
                if let Some((_, rest)) = line.split_once(": written by `") {
                    let command = rest.split('`').next().expect("a command");
                    assert!(made_by(name, command), "{name}: {command}");
                    parts += 1;
                }
            }
            if text.contains("every figure is from the runs") || text.contains("\nMade by\n") {
                let whole = FIGURES.iter().any(|figure| {
                    matches!(figure.how, How::HostSim(words) if words.last() == Some(&name)
                        && text.contains(&format!("cargo run --release -- {}", words[0])))
                });
                assert!(
                    whole,
                    "{name} is written by a command that is not in the list"
                );
                parts += 1;
            }
        }
        assert!(parts >= 7, "{parts}");
        for entry in fs::read_dir(workspace().join("docs")).expect("docs") {
            let name = entry.expect("an entry").file_name();
            let name = format!("docs/{}", name.to_string_lossy());
            let listed = FIGURES
                .iter()
                .any(|figure| figure.files.contains(&name.as_str()));
            let drawn = BY_HAND.iter().any(|(files, _)| files.contains(&name));
            assert!(!name.ends_with(".svg") || listed || drawn, "{name}");
        }
        for file in FIGURES.iter().flat_map(|figure| figure.files) {
            assert!(workspace().join(file).exists(), "{file}");
        }
    }

    #[test]
    fn the_cheap_ones_are_made_when_nothing_is_named() {
        let order = |names: &[&str], all| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            let list = false;
            Order { names, all, list }
        };
        let names = |order| -> Vec<_> {
            let chosen = chosen(&order).expect("known");
            chosen.iter().map(|figure| figure.name).collect()
        };
        assert_eq!(names(order(&[], false)), ["tables"]);
        assert_eq!(
            names(order(&["tables", "alone"], false)),
            ["alone", "tables"]
        );
        assert_eq!(names(order(&[], true)).len(), FIGURES.len());
        let error = chosen(&order(&["drives"], false)).err().expect("unknown");
        assert!(error.to_string().contains("images, tables"), "{error}");
        let listed = listed().expect("a list");
        assert!(listed.contains("docs/architecture.svg, docs/rehearsal.svg"));
    }
}
