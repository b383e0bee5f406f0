//! The last two sectors of flash, 128 KiB each, for the weight store (RM0090 section 3.6;
//! `memory.x`).
//!
//! The core stops while flash is erased (1 to 2 s) or written (16 us a word), since it runs from
//! the same flash. The lock bit, which a chip has set after reset, shows a simulator without flash
//! controller apart. Nothing is written there.

use core::cell::UnsafeCell;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};
use stm32f4::stm32f405::FLASH;

use super::supply;

const SECTOR: u32 = 128 * 1024;
/// Number of the first sector of the store.
const FIRST: u8 = 10;
const SECTORS: u32 = 2;

/// Rounds of waiting for an end. The core mostly stops within one; else the watchdog is faster.
const PATIENCE: u32 = 100_000_000;

unsafe extern "C" {
    /// Of `memory.x`: where the store begins. The controller changes what is there, and so it is a
    /// place that may change, not a constant.
    static __store_start: UnsafeCell<[u8; (SECTOR * SECTORS) as usize]>;
}

/// Why flash was not erased or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// Bounds or alignment.
    Request(NorFlashErrorKind),
    /// No flash controller.
    NotThere,
    /// The supply is too low: the write might not hold. Nothing was begun, or what was begun ended
    /// before this word.
    Supply,
    /// The controller reports an error, or does not end.
    Failed,
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Request(kind) => *kind,
            Self::NotThere | Self::Supply | Self::Failed => NorFlashErrorKind::Other,
        }
    }
}

/// The two sectors.
pub struct Sectors(FLASH);

impl Sectors {
    /// The controller is ours from now on.
    pub fn new(flash: FLASH) -> Self {
        Self(flash)
    }

    /// A place of the store, at most its end. It comes from the whole region, so that it may be
    /// read and written within it.
    fn place(offset: u32) -> *mut u8 {
        let start = UnsafeCell::raw_get(&raw const __store_start).cast::<u8>();
        start.wrapping_add(offset as usize)
    }

    /// Does `work` with the controller unlocked. Afterwards the data cache is out of date and is
    /// reset.
    fn unlocked(&mut self, work: impl FnOnce(&FLASH) -> Result<(), Error>) -> Result<(), Error> {
        let flash = &self.0;
        if flash.cr().read().lock().bit_is_clear() {
            return Err(Error::NotThere);
        }
        if supply::is_low() {
            return Err(Error::Supply);
        }
        for key in [0x4567_0123, 0xCDEF_89AB] {
            // SAFETY: the two keys of RM0090 3.6.1, in their order.
            flash.keyr().write(|w| unsafe { w.key().bits(key) });
        }
        // All error flags are cleared by writing 1.
        flash.sr().write(|w| {
            w.operr().clear().wrperr().clear().pgaerr().clear();
            w.pgperr().clear().pgserr().clear().eop().clear()
        });
        let done = work(flash);
        flash
            .cr()
            .modify(|_, w| w.pg().clear_bit().ser().clear_bit());
        flash.cr().modify(|_, w| w.lock().locked());
        flash.acr().modify(|_, w| w.dcen().clear_bit());
        flash.acr().modify(|_, w| w.dcrst().set_bit());
        flash.acr().modify(|_, w| w.dcrst().clear_bit());
        flash.acr().modify(|_, w| w.dcen().set_bit());
        done
    }

    /// Waits for the end and looks how it was.
    fn ended(flash: &FLASH) -> Result<(), Error> {
        let idle = (0..PATIENCE).any(|_| flash.sr().read().bsy().bit_is_clear());
        let status = flash.sr().read();
        let bad = status.operr().bit_is_set()
            || status.wrperr().bit_is_set()
            || status.pgaerr().bit_is_set()
            || status.pgperr().bit_is_set()
            || status.pgserr().bit_is_set();
        if idle && !bad {
            Ok(())
        } else {
            Err(Error::Failed)
        }
    }
}

impl ErrorType for Sectors {
    type Error = Error;
}

impl ReadNorFlash for Sectors {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        check_read(self, offset, bytes.len()).map_err(Error::Request)?;
        let mut place = Self::place(offset);
        // Whole words where they are, a quarter of the time: at start the whole store is searched,
        // and without PLL it is the longest part of the start.
        let (words, rest) = match offset.is_multiple_of(4) {
            true => bytes.as_chunks_mut::<4>(),
            false => (Default::default(), bytes),
        };
        for word in words {
            // SAFETY: within the store, as checked above, and aligned. Volatile, since the contents
            // change without the compiler's knowledge.
            *word = unsafe { place.cast::<u32>().read_volatile() }.to_le_bytes();
            place = place.wrapping_add(4);
        }
        for byte in rest {
            // SAFETY: as above.
            *byte = unsafe { place.read_volatile() };
            place = place.wrapping_add(1);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        (SECTOR * SECTORS) as usize
    }
}

impl NorFlash for Sectors {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        check_erase(self, from, to).map_err(Error::Request)?;
        self.unlocked(|flash| {
            (from / SECTOR..to / SECTOR).try_for_each(|sector| {
                let number = FIRST + sector as u8;
                flash.cr().modify(|_, w| {
                    // SAFETY: sectors 10 and 11 are the store's (`check_erase`), without code or
                    // constants.
                    unsafe { w.snb().bits(number) };
                    w.psize().psize32().ser().set_bit().pg().clear_bit()
                });
                flash.cr().modify(|_, w| w.strt().start());
                Self::ended(flash)
            })
        })
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        check_write(self, offset, bytes.len()).map_err(Error::Request)?;
        self.unlocked(|flash| {
            flash
                .cr()
                .modify(|_, w| w.psize().psize32().ser().clear_bit().pg().set_bit());
            let start = Self::place(offset).cast::<u32>();
            let (words, _) = bytes.as_chunks::<4>(); // whole words, as checked above
            words.iter().enumerate().try_for_each(|(index, word)| {
                if supply::is_low() {
                    return Err(Error::Supply);
                }
                // SAFETY: within the store and aligned, as checked above. The controller programs
                // the word.
                unsafe { start.add(index).write_volatile(u32::from_le_bytes(*word)) };
                Self::ended(flash)
            })
        })
    }
}
