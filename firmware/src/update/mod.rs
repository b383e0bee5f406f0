//! Updates of the firmware over the command link: two slots, a signed image, a trial.
//!
//! The flash has two slots, each with room for an image, and a loader that starts one of them. The
//! image that runs is never touched: an update goes into the other slot, so that bytes go on
//! meanwhile, and power may fail at any moment. An image runs at the address of its slot, so an
//! update has one for each.
//!
//! 1. [`Order::Begin`] brings the [`header`]: board, slot, version and signature are checked before
//!    anything is erased.
//! 2. [`Order::Piece`] brings the image in order. A part of the slot is erased when its first piece
//!    comes.
//! 3. [`Order::Finish`] compares what the flash holds with the signed digest, and writes the
//!    slot's record ([`slots`]).
//! 4. At the next start the loader marks the slot as tried and starts it.
//! 5. [`Order::Confirm`] comes when the application does well. Without it the loader goes back to
//!    the slot before at the next start after that.
//!
//! embassy-boot would exchange the images of two places instead, so that one image would do. It
//! needs a page more than twice the image, and one for its state: on an STM32H743 17 sectors of
//! 128 KiB for the 16 that there are. It is without the firmware for as long as copying takes, half
//! a minute there, and it writes words a second time, which flash with check bits does not allow.

pub mod header;
mod receive;
pub mod slots;

pub use receive::{Order, Outcome, Piece, TakesUpdates, Updater};
pub use slots::Slots;

/// Version of this firmware, from its manifest.
pub const FIRMWARE: [u16; 3] = [
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
];

const fn number(text: &str) -> u16 {
    match u16::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => panic!("the version is not a number"), // at compile time
    }
}

/// Seed of the development key. It is no secret: everybody can sign with it. A firmware expects it
/// unless it is built with another key, and `host-sim device info` says so.
pub const DEVELOPMENT_SEED: [u8; 32] = *b"LRNN development key, no secret!";

/// The public key of [`DEVELOPMENT_SEED`].
pub const DEVELOPMENT_KEY: [u8; 32] = [
    65, 12, 25, 184, 112, 88, 40, 43, 56, 77, 249, 182, 33, 241, 151, 237, 241, 115, 41, 181, 35,
    176, 142, 253, 98, 149, 187, 73, 143, 61, 156, 168,
];

#[cfg(test)]
mod tests;
