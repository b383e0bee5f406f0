//! The boot ROM functions that the image looks up by two letters (RP2350 datasheet, 5.4 and 5.5).
//! The real ROM is not at hand, so the flash is changed here.

use rp2350_emu::Emulator;

/// Bytes of a Pico 2's flash.
pub const FLASH: usize = 4 << 20;
/// Bytes of a page, which is programmed at once, and of the pieces that are erased.
const PAGE: usize = 256;
const SECTOR: usize = 4096;
const BLOCK: usize = 65_536;
/// Typical times of a W25Q32 for a page, a sector and a block, us.
const PROGRAM_US: u64 = 400;
const SECTOR_US: u64 = 45_000;
const BLOCK_US: u64 = 150_000;

/// Address of the look-up function. The other functions follow, 16 bytes each.
const LOOK_UP: u32 = 0x100;
const NAMES: [&[u8; 2]; 6] = [b"IF", b"EX", b"RE", b"RP", b"FC", b"CX"];

/// Code of each function: a branch to itself, then `BX LR`.
const CODE: [u8; 4] = [0xFE, 0xE7, 0x70, 0x47];

/// Content of the flash, and how often it was changed.
#[derive(Debug)]
pub struct Rom {
    /// The flash.
    pub flash: Vec<u8>,
    /// Number of sectors erased and of pages programmed.
    pub counts: [usize; 2],
    ends: Option<u64>,
}

impl Rom {
    /// A ROM with this flash.
    pub const fn new(flash: Vec<u8>) -> Self {
        Self {
            flash,
            counts: [0; 2],
            ends: None,
        }
    }

    /// The ROM's bytes: it starts the image as the boot ROM does, with its stack and its entry.
    pub fn bytes(&self) -> Vec<u8> {
        let mut rom = vec![0; 32 * 1024];
        rom[..8].copy_from_slice(&self.flash[..8]);
        rom[0x10..0x14].copy_from_slice(b"Mu\x01\x02");
        rom[0x16..0x18].copy_from_slice(&(LOOK_UP as u16 | 1).to_le_bytes());
        for at in (0..=NAMES.len()).map(|n| LOOK_UP as usize + 16 * n) {
            rom[at..at + 4].copy_from_slice(&CODE);
        }
        rom
    }

    /// Called when the core is about to run at this address of the ROM.
    pub fn at(&mut self, emulator: &mut Emulator, pc: u32, now: u64, cycles_a_us: u64) {
        match self.ends {
            None if pc < LOOK_UP || !pc.is_multiple_of(16) => {} // on the way back
            None => {
                let arguments = [0, 1, 2].map(|n| emulator.core(0).reg(n));
                let took = self.call(emulator, (pc - LOOK_UP) as usize / 16, arguments);
                self.ends = Some(now + took * cycles_a_us);
            }
            Some(ends) if now < ends => {}
            Some(_) => {
                self.ends = None;
                emulator.core_mut(0).regs.set_pc(pc + 2);
            }
        }
    }

    /// Calls a function by its index. Returns how long it takes, us.
    fn call(&mut self, emulator: &mut Emulator, index: usize, of: [u32; 3]) -> u64 {
        let Some(before) = index.checked_sub(1) else {
            let is = |name: &&[u8; 2]| u32::from(u16::from_le_bytes(**name)) == of[0];
            let found = NAMES.iter().position(is);
            let address = found.map_or(0, |n| LOOK_UP + 16 * (n as u32 + 1) + 1);
            emulator.core_mut(0).set_reg(0, address);
            return 0;
        };
        let function = NAMES.get(before).copied().unwrap_or(b"  ");
        self.change(emulator, function, of)
    }

    /// Erases or programs. Returns how long it takes, us.
    fn change(&mut self, emulator: &mut Emulator, function: &[u8; 2], of: [u32; 3]) -> u64 {
        let from = of[0] as usize;
        match function {
            b"RE" => {
                let len = of[1] as usize;
                self.flash[from..from + len].fill(0xFF);
                self.counts[0] += len / SECTOR;
                emulator.load_flash(&self.flash);
                (len / BLOCK) as u64 * BLOCK_US + (len % BLOCK / SECTOR) as u64 * SECTOR_US
            }
            b"RP" => {
                let len = of[2] as usize;
                // a 1 leaves a bit unchanged: the driver pads a page with ones
                for (n, cell) in self.flash[from..from + len].iter_mut().enumerate() {
                    *cell &= emulator.bus.read8(of[1] + n as u32, 0);
                }
                self.counts[1] += len / PAGE;
                emulator.load_flash(&self.flash);
                (len / PAGE) as u64 * PROGRAM_US
            }
            _ => 0,
        }
    }
}
