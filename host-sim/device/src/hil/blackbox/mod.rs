//! Files of a device's black box, and their replay in the same application on the desktop.
//!
//! The application gets the configuration that the device had. The first frame of a page makes its
//! correction, and the page's key sets it to the device's state. Then the bytes arrive at their
//! times, and the corrections in force are those recorded: the networks and the learner are not
//! played. The output must equal the device's output, and the fault bits that follow from the
//! stream must be those of the device.

mod file;
mod play;
#[cfg(test)]
mod tests;

pub use file::{read, write};
pub use play::{Page, Verdict, names, play};
