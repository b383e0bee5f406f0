//! The report directory: one self-contained HTML page and its pictures as PNG.
//!
//! It is written completely or not at all.

use super::drawn::draw;
use super::{html, json};
use host_core::error::Error;
use host_io::output::{Unfinished, directory_of, undivided};
use host_lab::experiment::results::{Curve, Report};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Name of the page.
pub(super) const PAGE: &str = "index.html";

/// Writes `index.html` and the four PNGs of `report` into `dir` and returns the path of the page.
///
/// The files are made in a directory beside `dir`, which is renamed when it is complete. An
/// existing `dir` is replaced only if it is empty or holds such a report. Other files in it are
/// retained.
///
/// # Errors
/// [`Error::BadResult`] for NaN in the results or curves of unequal length, [`Error::NotOurs`],
/// [`Error::Unwritable`], [`Error::Drawing`]. `dir` is then unchanged.
pub fn write(dir: &Path, report: &Report) -> Result<PathBuf, Error> {
    check(report)?;
    // The pictures are drawn only when the directory may be written.
    write_files(dir, || files(report))
}

/// Writes files into `dir` as described at [`write()`] and returns the path of the page.
pub(super) fn write_files<N: AsRef<Path>>(
    dir: &Path,
    files: impl FnOnce() -> Result<Vec<(N, Vec<u8>)>, Error>,
) -> Result<PathBuf, Error> {
    let unwritable = |source| Error::writing(dir, source);
    // Full path, so that `.` and links have a parent to put the new directory into.
    let target = std::path::absolute(dir).map_err(unwritable)?;
    let target = target.canonicalize().unwrap_or(target);
    let replaces = existing(dir, &target)?;
    let parent = directory_of(&target);
    fs::create_dir_all(parent).map_err(unwritable)?;
    let (_unfinished, fresh) =
        Unfinished::make(|| temporary_directory(parent), TempDir::path).map_err(unwritable)?;
    for (name, bytes) in files()? {
        fs::write(fresh.path().join(name), bytes).map_err(unwritable)?;
    }
    if replaces {
        replace(&fresh, &target)
    } else {
        fs::rename(fresh.path(), &target)
    }
    .map_err(unwritable)?;
    let _ = fresh.keep(); // it was renamed: there is nothing to remove
    Ok(dir.join(PAGE))
}

/// Name and content of every file of the report.
fn files(report: &Report) -> Result<Vec<(&'static str, Vec<u8>)>, Error> {
    let figures = draw(&report.curves, "min")?;
    let page = html::page(report, &figures)?;
    let pngs = figures.into_iter().map(|f| (f.figure.file(), f.png));
    let mut files: Vec<(&'static str, Vec<u8>)> = pngs.collect();
    files.push((PAGE, page.into_bytes()));
    Ok(files)
}

/// Rejects results that are not finite, and curves of unequal lengths.
fn check(report: &Report) -> Result<(), Error> {
    json::check(&report.results)?;
    let unequal = |item: &str, field, found: usize, expected: usize| {
        let problem = format!("has {found} values where its abscissa has {expected}");
        if found == expected {
            Ok(())
        } else {
            Err(Error::BadResult {
                item: item.to_owned(),
                field,
                problem,
            })
        }
    };
    let curves: [(&[Curve], _); 3] = [
        (&report.curves.track, "track"),
        (&report.curves.error_over_time, "error_over_time"),
        (&report.curves.learning, "learning"),
    ];
    for (curves, field) in curves {
        for curve in curves {
            unequal(&curve.name, field, curve.y.len(), curve.x.len())?;
        }
    }
    for trace in &report.curves.traces {
        let (axis, t) = (&trace.axis, trace.t_min.len());
        unequal(axis, "network", trace.network.len(), t)?;
        for (field, values) in [("truth", &trace.truth), ("teacher", &trace.teacher)] {
            if !values.is_empty() {
                unequal(axis, field, values.len(), t)?;
            }
        }
    }
    Ok(())
}

/// Whether `target` exists and may be replaced.
///
/// # Errors
/// If it must not be replaced.
fn existing(dir: &Path, target: &Path) -> Result<bool, Error> {
    let not_ours = |holds| {
        Err(Error::NotOurs {
            dir: dir.to_path_buf(),
            holds,
        })
    };
    let mut entries = match fs::read_dir(target) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(_) if target.is_file() => return not_ours("is a file"),
        Err(error) => return Err(Error::writing(dir, error)),
    };
    let ours = || fs::read(target.join(PAGE)).is_ok_and(|page| is_ours(&page));
    if entries.next().is_none() || ours() {
        Ok(true)
    } else {
        not_ours("holds other files and no report of ours")
    }
}

/// Whether this is a page of ours.
pub fn is_ours(page: &[u8]) -> bool {
    let head = &page[..page.len().min(1024)];
    head.windows(html::MARKER.len())
        .any(|part| part == html::MARKER.as_bytes())
}

/// Replaces the directory `target` by `fresh`, and moves its other files into it.
fn replace(fresh: &TempDir, target: &Path) -> io::Result<()> {
    let _undivided = undivided();
    let aside = temporary_directory(directory_of(target))?;
    let old = aside.path().join("old");
    fs::rename(target, &old)?;
    if let Err(error) = fs::rename(fresh.path(), target) {
        fs::rename(&old, target)?; // undo
        return Err(error);
    }
    for entry in fs::read_dir(&old)? {
        let name = entry?.file_name();
        if !target.join(&name).exists() {
            let moved = fs::rename(old.join(&name), target.join(&name));
            if moved.is_err() {
                let _ = aside.keep(); // do not delete the user's files
                return moved;
            }
        }
    }
    Ok(())
}

/// A temporary directory with the permissions of an ordinary new one.
fn temporary_directory(parent: &Path) -> io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".host-sim-");
    #[cfg(unix)]
    // the umask is applied to this mode
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    builder.tempdir_in(parent)
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(dir)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    const OURS: [&str; 5] = [
        "error.png",
        "errors.png",
        "index.html",
        "learning.png",
        "track.png",
    ];

    #[test]
    fn a_report_appears_whole_and_replaces_an_older_one_but_not_the_reader_s_own_files() {
        let parent = tempfile::tempdir().unwrap();
        let dir = parent.path().join("deep/er");
        let mut report = sample::report();
        assert_eq!(write(&dir, &report).unwrap(), dir.join("index.html"));
        assert_eq!(names(&dir), OURS);
        fs::write(dir.join("my-notes.txt"), "keep me").unwrap();
        report.title = "Second <edition>".into();
        write(&dir, &report).unwrap();
        assert_eq!(
            fs::read_to_string(dir.join("my-notes.txt")).unwrap(),
            "keep me"
        );
        let page = fs::read_to_string(dir.join("index.html")).unwrap();
        assert!(page.contains("Second &lt;edition&gt;") && !page.contains("Sample of the report"));
        assert_eq!(names(&dir).len(), 6);
        assert_eq!(
            names(&parent.path().join("deep")),
            ["er"],
            "nothing temporary is left"
        );
    }

    #[test]
    fn an_empty_directory_is_taken_and_any_other_left_alone() {
        let parent = tempfile::tempdir().unwrap();
        let (empty, other, file) = (
            parent.path().join("empty"),
            parent.path().join("other"),
            parent.path().join("file"),
        );
        fs::create_dir(&empty).unwrap();
        write(&empty, &sample::report()).unwrap();
        assert_eq!(names(&empty), OURS);
        fs::create_dir(&other).unwrap();
        fs::write(other.join("index.html"), "<title>somebody's page</title>").unwrap();
        fs::write(&file, "x").unwrap();
        for (dir, holds) in [
            (&other, "holds other files and no report of ours"),
            (&file, "is a file"),
        ] {
            let message = write(dir, &sample::report()).unwrap_err().to_string();
            assert!(
                message.contains(holds)
                    && message.contains("remedy: give a new or an empty directory"),
                "{message}"
            );
        }
        assert_eq!(names(&other), ["index.html"]);
        assert_eq!(names(parent.path()), ["empty", "file", "other"]);
    }

    #[test]
    fn a_bad_result_writes_nothing() {
        let parent = tempfile::tempdir().unwrap();
        let dir = parent.path().join("report");
        let mut report = sample::report();
        report.results.rows[3].d_east_m = f64::NAN;
        assert!(
            write(&dir, &report)
                .unwrap_err()
                .to_string()
                .contains("row 4 (5 min, rnn)': 'd_east_m' is NaN")
        );
        let mut report = sample::report();
        report.curves.traces[4].teacher.pop();
        let message = write(&dir, &report).unwrap_err().to_string();
        assert!(
            message.contains("'accel y': 'teacher' has 2999 values where its abscissa has 3000"),
            "{message}"
        );
        assert!(names(parent.path()).is_empty());
    }

    #[test]
    fn an_unwritable_place_is_named() {
        let parent = tempfile::tempdir().unwrap();
        fs::write(parent.path().join("file"), "x").unwrap();
        let dir = parent.path().join("file/report");
        let error = write(&dir, &sample::report()).unwrap_err();
        assert!(error.to_string().contains("file/report"), "{error}");
        assert_eq!(names(parent.path()), ["file"]);
    }

    #[test]
    #[ignore = "writes out/report-sample for the eye, and prints the time it took"]
    fn look_at_the_sample() {
        let out = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../out/report-sample");
        let start = std::time::Instant::now();
        let page = write(&out, &sample::report()).unwrap();
        println!(
            "{} in {:.0} ms",
            page.display(),
            start.elapsed().as_secs_f64() * 1e3
        );
    }
}
