//! The part of a chip's flash that the store has.

#[cfg(feature = "h7")]
use embassy_stm32::pac::FLASH;
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
        checked_read(|| {
            self.0
                .read(START + offset, bytes)
                .map_err(|_| Error::Driver)
        })
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
        clear();
        self.0
            .erase(START + from, START + to)
            .map_err(|_| Error::Driver)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        check_write(self, offset, bytes.len()).map_err(Error::Request)?;
        clear();
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

/// Reads flash that has check bits. A word of which power was cut off while it was written or
/// erased may have two wrong bits: then the bus reports an error (RM0433 4.3.12), which would be a
/// fault of the core at each start. For the time of `read` such an error is no fault (Armv7-M
/// B3.2.8, BFHFNMIGN: at the priority that FAULTMASK gives), and it is looked for afterwards.
#[cfg(feature = "h7")]
#[allow(unsafe_code, reason = "the core's registers of faults")]
fn checked_read(read: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    /// CCR: a data access that fails is no fault.
    const IGNORE: u32 = 1 << 8;
    /// CFSR: a data access failed, here or some instructions before, and where is known.
    const FAILED: u32 = 0b1000_0110 << 8;
    clear();
    // SAFETY: only the two registers below are used, and nobody else does without FAULTMASK: the
    // entry of a fault reads them and does not return.
    let scb = unsafe { cortex_m::Peripherals::steal() }.SCB;
    // SAFETY: no interrupt until the end of this function, which is short. Nothing relies on more.
    unsafe { core::arch::asm!("cpsid f") };
    // SAFETY: as above; the bit is set back.
    unsafe { scb.ccr.modify(|ccr| ccr | IGNORE) };
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    let done = read();
    cortex_m::asm::dsb();
    let failed = scb.cfsr.read() & FAILED != 0;
    // SAFETY: a bit that is written is cleared; the other bit is set back.
    unsafe {
        scb.cfsr.write(FAILED);
        scb.ccr.modify(|ccr| ccr & !IGNORE);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    // SAFETY: as it was.
    unsafe { core::arch::asm!("cpsie f") };
    let double = (0..2).any(|bank| FLASH.bank(bank).sr().read().dbeccerr());
    clear();
    if failed || double {
        return Err(Error::Driver);
    }
    done
}

#[cfg(not(feature = "h7"))]
fn checked_read(read: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    read()
}

/// Clears what the controller keeps of former errors. The driver writes to the register that shows
/// them, which changes nothing on this chip (RM0433 4.9.6), and would call each later write failed.
#[cfg(feature = "h7")]
fn clear() {
    for bank in 0..2 {
        FLASH.bank(bank).ccr().write(|w| {
            w.set_clr_wrperr(true);
            w.set_clr_pgserr(true);
            w.set_clr_strberr(true);
            w.set_clr_incerr(true);
            w.set_clr_operr(true);
            w.set_clr_rdperr(true);
            w.set_clr_rdserr(true);
            w.set_clr_sneccerr(true);
            w.set_clr_dbeccerr(true);
            w.set_clr_crcrderr(true);
        });
    }
}

#[cfg(not(feature = "h7"))]
const fn clear() {}
