//! Work that takes long: other threads of Python run meanwhile, and Ctrl-C is noticed.

use pyo3::exceptions::PyRuntimeError;
use pyo3::{PyResult, Python};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Time between two looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);
/// Samples between two looks for Ctrl-C, some milliseconds.
pub const PIECE: usize = 1 << 16;

/// Runs `work` on a thread of its own. After Ctrl-C, `KeyboardInterrupt` is raised at once; the
/// thread goes on to its end, and what it finds is dropped.
pub fn interruptible<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> R + Send + 'static,
) -> PyResult<R> {
    let (give, take) = channel();
    std::thread::spawn(move || give.send(work()));
    let take = std::sync::Mutex::new(take);
    loop {
        let next = || match take.lock() {
            Ok(take) => take.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        };
        match py.detach(next) {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                let text = "a fault of this package; remedy: report it with what you called";
                return Err(PyRuntimeError::new_err(text));
            }
        }
    }
}

/// Hands `items` to `work` in pieces; other threads of Python run during each.
pub fn in_pieces<T: Sync>(
    py: Python<'_>,
    items: &[T],
    mut work: impl FnMut(&[T]) + Send,
) -> PyResult<()> {
    for piece in items.chunks(PIECE) {
        py.detach(|| work(piece));
        py.check_signals()?;
    }
    Ok(())
}
