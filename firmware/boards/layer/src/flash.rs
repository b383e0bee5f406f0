//! The part of a chip's flash that the store has.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use firmware::store::RECORD_LEN;

/// `LEN` bytes from `START` on, counted from the flash's beginning. `ERASE` is erased at once: a
/// multiple of the flash's own unit, so that half of the region holds many records.
#[derive(Debug)]
pub struct Region<F, const START: u32, const LEN: usize, const ERASE: usize>(F);

/// Why flash was not read, written or erased.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// Bounds or alignment.
    Request(NorFlashErrorKind),
    /// The driver says so.
    Driver,
}

impl embedded_storage::nor_flash::NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Request(kind) => *kind,
            Self::Driver => NorFlashErrorKind::Other,
        }
    }
}

impl<F: NorFlash, const START: u32, const LEN: usize, const ERASE: usize>
    Region<F, START, LEN, ERASE>
{
    /// Of this flash.
    pub const fn new(flash: F) -> Self {
        const {
            assert!(ERASE.is_multiple_of(F::ERASE_SIZE) && LEN.is_multiple_of(2 * ERASE));
            assert!(LEN / 2 >= RECORD_LEN.next_multiple_of(64), "a record");
            assert!((START as usize).is_multiple_of(F::ERASE_SIZE));
        }
        Self(flash)
    }
}

impl<F, const START: u32, const LEN: usize, const ERASE: usize> ErrorType
    for Region<F, START, LEN, ERASE>
{
    type Error = Error;
}

impl<F: NorFlash, const START: u32, const LEN: usize, const ERASE: usize> ReadNorFlash
    for Region<F, START, LEN, ERASE>
{
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        check_read(self, offset, bytes.len()).map_err(Error::Request)?;
        forget(START + offset, bytes.len());
        self.0
            .read(START + offset, bytes)
            .map_err(|_| Error::Driver)
    }

    fn capacity(&self) -> usize {
        LEN
    }
}

impl<F: NorFlash, const START: u32, const LEN: usize, const ERASE: usize> NorFlash
    for Region<F, START, LEN, ERASE>
{
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        check_erase(self, from, to).map_err(Error::Request)?;
        self.0
            .erase(START + from, START + to)
            .map_err(|_| Error::Driver)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        check_write(self, offset, bytes.len()).map_err(Error::Request)?;
        self.0
            .write(START + offset, bytes)
            .map_err(|_| Error::Driver)
    }
}

/// What the data cache of a Cortex-M7 holds of the flash may be from before a write.
#[cfg(feature = "m7")]
#[allow(unsafe_code, reason = "the cache's registers")]
fn forget(offset: u32, len: usize) {
    // SAFETY: maintenance by address only, which keeps what memory means; nobody else uses these
    // registers after the caches are on.
    let mut scb = unsafe { cortex_m::Peripherals::steal() }.SCB;
    scb.clean_invalidate_dcache_by_address(0x0800_0000 + offset as usize, len);
}

#[cfg(not(feature = "m7"))]
const fn forget(_: u32, _: usize) {}
