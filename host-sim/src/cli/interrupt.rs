//! Ctrl-C: a command that can stop by itself is told; any other ends at once, and what it was
//! writing is removed. So files are whole or absent, and the exit code is 130.

use host_io::output::abandon;
use std::io::{Write, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// What the command that runs wants to be told by.
static ASKED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Looks for Ctrl-C from now on.
pub fn watch() {
    let handled = ctrlc::set_handler(|| match ASKED.get() {
        Some(asked) if !asked.load(Ordering::Relaxed) => asked.store(true, Ordering::Relaxed),
        _ => {
            abandon();
            let text = "host-sim: interrupted; files are whole or absent";
            let _ = writeln!(stderr(), "{text}"); // nobody may be reading
            std::process::exit(130);
        }
    });
    if let Err(error) = handled {
        let _ = writeln!(
            stderr(),
            "host-sim: an interruption ends it at once ({error})"
        );
    }
}

/// Becomes true at the first Ctrl-C, for a command that stops by itself then. A second one ends it.
pub(super) fn asked() -> Arc<AtomicBool> {
    Arc::clone(ASKED.get_or_init(|| Arc::new(AtomicBool::new(false))))
}
