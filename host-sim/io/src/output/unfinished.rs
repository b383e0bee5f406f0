//! Temporary files and folders, which are removed when the user interrupts the program.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Temporary files and folders that exist now. An interruption waits while the register is locked.
#[derive(Debug)]
struct Register(Mutex<BTreeSet<PathBuf>>);

/// The register of the program.
static UNFINISHED: Register = Register::new();

impl Register {
    const fn new() -> Self {
        Self(Mutex::new(BTreeSet::new()))
    }

    fn locked(&self) -> MutexGuard<'_, BTreeSet<PathBuf>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn make<T>(
        &'static self,
        make: impl FnOnce() -> std::io::Result<T>,
        path: impl FnOnce(&T) -> &Path,
    ) -> std::io::Result<(Unfinished, T)> {
        let mut all = self.locked();
        let made = make()?;
        let path = path(&made).to_path_buf();
        all.insert(path.clone());
        let register = self;
        Ok((Unfinished { register, path }, made))
    }

    fn abandon(&self) {
        let all = self.locked();
        for path in all.iter() {
            // a file that is gone already has its final name
            let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir_all(path));
        }
        std::mem::forget(all); // nothing gets its name from now on
    }
}

/// Registers a temporary file or folder. Drop this after the file or folder.
#[derive(Debug)]
pub struct Unfinished {
    register: &'static Register,
    path: PathBuf,
}

impl Unfinished {
    /// Makes a temporary file or folder; `path` gives its path. An interruption waits until it
    /// exists and is registered.
    pub fn make<T>(
        make: impl FnOnce() -> std::io::Result<T>,
        path: impl FnOnce(&T) -> &Path,
    ) -> std::io::Result<(Self, T)> {
        UNFINISHED.make(make, path)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        self.register.locked().remove(&self.path);
    }
}

/// Until this is dropped an interruption waits, so that several renames are done together or not at
/// all.
pub fn undivided() -> impl Drop {
    UNFINISHED.locked()
}

/// Removes all unfinished files before the program ends in the middle of its work. No file gets its
/// final name afterwards: a thread that tries waits for the end of the program.
pub fn abandon() {
    UNFINISHED.abandon();
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;
    use tempfile::{NamedTempFile, TempDir, tempdir};

    fn names(directory: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(directory).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.collect()
    }

    /// A register for one test: it cannot be used after [`Register::abandon`].
    fn register() -> &'static Register {
        Box::leak(Box::new(Register::new()))
    }

    fn file_in(dir: &Path, of: &'static Register) -> (Unfinished, NamedTempFile) {
        of.make(|| NamedTempFile::new_in(dir), NamedTempFile::path)
            .unwrap()
    }

    #[test]
    fn what_is_unfinished_is_known_while_it_is_there() {
        let (dir, of) = (tempdir().unwrap(), register());
        let (unfinished, file) = file_in(dir.path(), of);
        assert!(of.locked().contains(file.path()));
        drop((file, unfinished));
        assert!(of.locked().is_empty() && names(dir.path()).is_empty());
        let refused = || Err(std::io::Error::other("no"));
        of.make(refused, PathBuf::as_path).unwrap_err();
        assert!(of.locked().is_empty());
    }

    #[test]
    fn an_interruption_removes_what_is_unfinished_and_nothing_is_begun_after_it() {
        let (dir, of) = (tempdir().unwrap(), register());
        let (_a, file) = file_in(dir.path(), of);
        let folder = || tempfile::tempdir_in(dir.path());
        let (_b, folder) = of.make(folder, TempDir::path).unwrap();
        std::fs::write(folder.path().join("inside"), "x").unwrap();
        std::fs::write(dir.path().join("whole"), "x").unwrap();
        of.abandon();
        assert_eq!(names(dir.path()), ["whole"]);
        let (late, came) = (dir.path().join("late"), std::sync::mpsc::channel());
        std::thread::spawn(move || {
            let made = of.make(
                || std::fs::write(&late, "x").map(|()| late),
                PathBuf::as_path,
            );
            came.0.send(made.is_ok())
        });
        let waited = came.1.recv_timeout(Duration::from_millis(200));
        assert!(waited.is_err() && names(dir.path()) == ["whole"]);
        std::mem::forget((_a, _b)); // they would wait
        drop((file, folder));
    }

    /// Interrupted at any time: a file that is being made is there and known, or never made, and
    /// renames that belong together are done.
    #[test]
    fn an_interruption_waits_for_what_is_undivided() {
        use std::sync::mpsc::channel;
        let (dir, of) = (tempdir().unwrap(), register());
        let path = dir.path().join("made");
        let (begun, start) = channel();
        let abandoned = std::thread::spawn(move || {
            start.recv().unwrap();
            of.abandon();
        });
        let make = || {
            begun.send(()).unwrap();
            std::thread::sleep(Duration::from_millis(100));
            assert!(!abandoned.is_finished());
            std::fs::write(&path, "x").map(|()| path.clone())
        };
        std::mem::forget(of.make(make, PathBuf::as_path).unwrap());
        abandoned.join().unwrap();
        assert!(names(dir.path()).is_empty());

        let of = register();
        let locked = of.locked();
        let abandoned = std::thread::spawn(move || of.abandon());
        std::thread::sleep(Duration::from_millis(100));
        assert!(!abandoned.is_finished());
        drop(locked);
        abandoned.join().unwrap();
    }
}
