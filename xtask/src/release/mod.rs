//! `cargo xtask release`: all files of a release, in one folder that appears complete or not at
//! all. docs/RELEASES.md says what the version numbers mean.

mod changelog;
pub mod git;
mod page;
mod parts;
pub mod sums;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use crate::images::{target_directory, workspace};
use anyhow::{Context, Result, bail, ensure};

use crate::{measure, needs, supply};
use git::Source;
use page::Page;
pub use sums::hex;

/// Options of a release build.
#[derive(clap::Args)]
pub struct Order {
    /// The folder, which must not be there yet. Usually target/release-VERSION.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The key that signs updates of the boards that take them (`cargo xtask sign`).
    #[arg(long, value_name = "FILE")]
    update_key: Option<PathBuf>,
    /// Only the firmware images, to compare their checksums with those of a release.
    #[arg(long)]
    only_images: bool,
    /// Builds the tree as it is: changed files and changes without an entry are no error. The
    /// version ends with the commit, and with `-dirty` if files are changed.
    #[arg(long)]
    snapshot: bool,
    /// Builds nothing: makes what CHANGELOG.md has under `[Unreleased]` the entry of the version.
    #[arg(long, conflicts_with_all = ["out", "only_images", "snapshot"])]
    changelog: bool,
}

/// The release that is being built.
pub struct Release {
    pub version: String,
    pub source: Source,
    /// The compiler by its name and version.
    pub toolchain: String,
    /// The target triple of this machine.
    pub host: String,
    /// The folder in which it is built.
    pub folder: PathBuf,
}

/// The version of the workspace, which all of its packages have.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Builds the release.
pub fn release(order: &Order) -> Result<ExitCode> {
    let path = workspace().join("CHANGELOG.md");
    let log = fs::read_to_string(&path).context("CHANGELOG.md")?;
    let source = Source::here()?;
    if order.changelog {
        fs::write(&path, changelog::release(&log, VERSION, &source.day)?)?;
        println!("CHANGELOG.md: {VERSION}; commit it, then: cargo xtask release");
        return Ok(ExitCode::SUCCESS);
    }
    let version = if order.snapshot {
        snapshot(&source)
    } else {
        ready(&source, &log)?;
        VERSION.to_owned()
    };
    let out = match &order.out {
        Some(out) => out.clone(),
        None => target_directory()?.join(format!("release-{version}")),
    };
    ensure!(
        !out.exists(),
        "{} is there already; remedy: remove it, or --out DIR",
        out.display()
    );
    let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty());
    let parent = parent.map_or_else(|| PathBuf::from("."), PathBuf::from);
    fs::create_dir_all(&parent)?;
    let folder = tempfile::Builder::new()
        .prefix(".release-")
        .tempdir_in(parent)?;
    let [toolchain, host] = compiler()?;
    let release = Release {
        version,
        source,
        toolchain,
        host,
        folder: folder.path().to_path_buf(),
    };
    needs::target()?;
    let left_out = fill(&release, order, &log)?;
    let folder = folder.keep();
    open_to_all(&folder)?;
    fs::rename(&folder, &out).with_context(|| out.display().to_string())?;
    for why in left_out {
        println!("left out: {why}");
    }
    println!("{}: sha256sum --check {}", out.display(), sums::NAME);
    Ok(ExitCode::SUCCESS)
}

/// Builds all parts into the folder; returns what was left out.
fn fill(release: &Release, order: &Order, log: &str) -> Result<Vec<String>> {
    let mut left_out = Vec::new();
    if !supply::has_cyclonedx() {
        left_out.push(format!("bills of materials; remedy: {}", supply::CYCLONEDX));
    }
    let mut firmware = parts::own_images(release)?;
    firmware.extend(parts::board_images(release, &mut left_out)?);
    match &order.update_key {
        Some(key) => parts::update(release, key)?,
        None => left_out.push(
            "h743.update, which must be signed; remedy: --update-key FILE (docs/RELEASES.md)"
                .into(),
        ),
    }
    if order.only_images {
        left_out.push("programs and wheel: --only-images".into());
    } else {
        parts::programs(release)?;
        left_out.extend(parts::python(release)?);
    }
    for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
        fs::copy(workspace().join(name), release.folder.join(name)).context(name)?;
    }
    let mut files = Vec::new();
    for name in sums::names(&release.folder)? {
        let bytes = fs::metadata(release.folder.join(&name))?.len();
        files.push((name, bytes));
    }
    let formats = facts(&mut firmware)?;
    let page = Page {
        release,
        formats: &formats,
        firmware: &firmware,
        files: &files,
        left_out: &left_out,
        changes: if order.snapshot {
            changelog::unreleased(log)
        } else {
            changelog::entry(log, VERSION).unwrap_or_default()
        },
    };
    fs::write(release.folder.join("RELEASE.md"), page.text())?;
    sums::write(&release.folder)?;
    Ok(left_out)
}

/// The versions of formats from `tests/measure`, which also says how large each image is.
fn facts(firmware: &mut [parts::Firmware]) -> Result<Vec<(String, String)>> {
    let output = measure("facts")
        .args(firmware.iter().map(|image| &image.built))
        .output()
        .context("cannot start cargo")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "measure facts: {said}");
    let text = String::from_utf8(output.stdout)?;
    let lines = text.lines().filter_map(|line| line.rsplit_once(' '));
    let mut lines: Vec<_> = lines.map(|(a, b)| (a.to_owned(), b.to_owned())).collect();
    let formats = lines.len().checked_sub(firmware.len());
    let sizes = lines.split_off(formats.context("measure facts: lines are missing")?);
    for (image, (flash, ram)) in firmware.iter_mut().zip(sizes) {
        image.bytes = [flash, ram];
    }
    Ok(lines)
}

/// The version of a snapshot.
fn snapshot(source: &Source) -> String {
    let commit = source.commit.get(..8).unwrap_or(&source.commit);
    let dirty = if source.dirty { "-dirty" } else { "" };
    format!("{VERSION}-{commit}{dirty}")
}

/// Checks that this tree can be released: nothing is changed, and the changelog entry has all
/// changes.
fn ready(source: &Source, log: &str) -> Result<()> {
    let trial = "or --snapshot, which is no release";
    if source.dirty {
        bail!("files are changed or new (git status); remedy: commit them, {trial}");
    }
    ensure!(
        changelog::unreleased(log).is_empty(),
        "CHANGELOG.md has unreleased changes; remedy: raise `version` in Cargo.toml, then \
         cargo xtask release --changelog; {trial}"
    );
    ensure!(
        changelog::entry(log, VERSION).is_some_and(|entry| !entry.is_empty()),
        "CHANGELOG.md has no entry for {VERSION}; remedy: cargo xtask release --changelog; {trial}"
    );
    Ok(())
}

/// The compiler's version, and the target of this machine.
fn compiler() -> Result<[String; 2]> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let printed = Command::new(rustc)
        .arg("-vV")
        .current_dir(workspace())
        .output()
        .context("cannot start rustc")?;
    let printed = String::from_utf8(printed.stdout)?;
    let host = printed.lines().find_map(|line| line.strip_prefix("host: "));
    let host = host.context("rustc names no host")?;
    let first = printed.lines().next().unwrap_or_default();
    Ok([first, host].map(str::to_owned))
}

/// Makes a temporary folder readable for all, since it will be published.
fn open_to_all(folder: &std::path::Path) -> Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755))?;
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(dirty: bool) -> Source {
        Source {
            commit: "0123456789abcdef".into(),
            day: "2026-11-24".into(),
            dirty,
        }
    }

    #[test]
    fn a_release_is_clean_and_has_an_entry_for_all_that_is_new() {
        let entry = format!("## [{VERSION}]\n\n- new\n");
        let good = format!("## [Unreleased]\n\n{entry}");
        assert!(ready(&source(false), &good).is_ok());
        for (dirty, log, why) in [
            (true, good.clone(), "changed or new"),
            (
                false,
                format!("## [Unreleased]\n\n- more\n\n{entry}"),
                "unreleased",
            ),
            (false, "## [Unreleased]\n".into(), "no entry"),
            (
                false,
                format!("## [{VERSION}]\n\n## [0.0.1]\n- a\n"),
                "no entry",
            ),
        ] {
            let error = ready(&source(dirty), &log).expect_err(why).to_string();
            assert!(error.contains(why) && error.contains("remedy"), "{error}");
        }
    }

    #[test]
    fn a_snapshot_says_of_what() {
        assert_eq!(snapshot(&source(false)), format!("{VERSION}-01234567"));
        assert_eq!(snapshot(&source(true)), format!("{VERSION}-01234567-dirty"));
    }
}
