//! `--pdf`: a browser prints the page.

use crate::cli::options::refused;
use host_core::error::Error;
use host_io::output::write_atomic;
use std::path::Path;
use std::process::{Command, Stdio};

/// Names of Chromium.
const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// Prints `page` into the file `pdf`.
///
/// # Errors
/// [`Error::Option`] where no Chromium is installed or it fails, [`Error::Unwritable`].
pub(super) fn print(page: &Path, pdf: &Path) -> Result<(), Error> {
    let failed = |problem: &str, remedy: &str| {
        let problem = format!("{problem}; the page is at {}", page.display());
        refused("--pdf", problem, remedy)
    };
    let starts = |name: &&&str| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    };
    let Some(name) = NAMES.iter().find(starts) else {
        let remedy = "install it (Debian: apt-get install chromium), or print the page from a \
                      browser";
        return Err(failed("is printed by Chromium, which is not found", remedy));
    };
    let unwritable = |source| Error::writing(pdf, source);
    let full = std::path::absolute(page).map_err(unwritable)?;
    // a profile of its own, so that it works beside a browser that is open
    let scratch = tempfile::tempdir().map_err(unwritable)?;
    let (profile, printed) = (scratch.path().join("profile"), scratch.path().join("pdf"));
    let status = Command::new(name)
        // a container or root has no sandbox, and the page is ours and fetches nothing
        .args(["--headless", "--no-sandbox", "--disable-gpu"])
        .args(["--no-first-run", "--disable-dev-shm-usage"])
        .args(["--no-pdf-header-footer", "--generate-pdf-document-outline"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("--print-to-pdf={}", printed.display()))
        .arg(full)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    match std::fs::read(&printed) {
        Ok(bytes) if status.is_ok_and(|status| status.success()) => write_atomic(pdf, &bytes),
        _ => Err(failed(
            &format!("{name} could not print"),
            "print the page from a browser",
        )),
    }
}
