//! Updates of the firmware, on a board whose flash has two slots.

use embedded_storage::nor_flash::NorFlash;
use firmware::update::slots::Places;
use firmware::update::{DEVELOPMENT_KEY, Slots, Updater};

/// The public key that updates must be signed for: that of the build (build.rs), or the development
/// key, which everybody has.
#[must_use]
pub const fn signer(given: Option<[u8; 32]>) -> [u8; 32] {
    match given {
        Some(key) => key,
        None => DEVELOPMENT_KEY,
    }
}

/// What takes updates of a board. `None`: this image is in no slot, so it takes none.
pub fn updater<F: NorFlash>(
    flash: F,
    places: Places,
    board: &'static str,
    signer: &[u8; 32],
) -> Option<Updater<F>> {
    let here = updater::<F> as *const () as usize as u32;
    Updater::new(Slots::new(flash, places)?, board, signer, here)
}
