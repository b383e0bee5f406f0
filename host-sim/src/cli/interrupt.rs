//! Ctrl-C: a command that can stop by itself gets a flag. Any other command ends at once, and the
//! file that it was writing is removed. So files are whole or absent, and the exit code is 130.

use host_io::output::abandon;
use std::io::{Write, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Flag of a command that can stop by itself; set at Ctrl-C.
static ASKED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Installs the handler of Ctrl-C.
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

/// Flag that becomes true at the first Ctrl-C, for a command that then stops by itself. A second
/// Ctrl-C ends the program.
pub(super) fn asked() -> Arc<AtomicBool> {
    Arc::clone(ASKED.get_or_init(|| Arc::new(AtomicBool::new(false))))
}
