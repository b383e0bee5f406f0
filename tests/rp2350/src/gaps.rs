//! Replaces instructions of the image that the emulator does not support, or decodes wrongly, by
//! those that it supports. The encodings are what LLVM's assembler writes.

use rp2350_emu::CortexM33;
use rp2350_emu::core::CoreBus;

/// "VMOV.F32 S0, S0".
const NOTHING: [u16; 2] = [0xEEB0, 0x0A40];

/// A transfer of a register of 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pair {
    /// Between two core registers and the 64-bit register.
    Core([u16; 2], u16, bool),
    /// Between memory and the register: base register, offset, direction.
    Memory(u16, i32, u16, bool),
}

/// An equivalent instruction that the emulator supports.
pub const fn known(first: u16, second: u16) -> [u16; 2] {
    match without_order(first, second) {
        Some(plain) => plain,
        None if Pair::of(first, second).is_some() => NOTHING,
        None if first & 0xFFE8 == 0xB660 => [masks(first), second],
        None if is_choice(first, second) => {
            let (pair, condition) = (first >> 6 & 1, first >> 4 & 3);
            [first & !0x70 | condition << 5 | pair << 4, second]
        }
        None if is_block(first, second) => [first, second & !0x100],
        None => [first, second],
    }
}

/// CPSIE and CPSID: the masks are F (bit 0) and I (bit 1). The emulator exchanges them, so "CPSID
/// i" would be "CPSID f", and no interrupt would ever be served again.
const fn masks(change: u16) -> u16 {
    change & !3 | change << 1 & 2 | change >> 1 & 1
}

/// The same instruction without memory ordering, which one core does not need. The emulator decodes
/// LDAEX as a table branch.
const fn without_order(first: u16, second: u16) -> Option<[u16; 2]> {
    let (register, base, status) = (second & 0xF000, first & 0xF, second & 0xF);
    Some(match (first & 0xFFF0, second >> 4 & 0xFF) {
        (0xE8D0, 0xF8) => [0xF890 | base, register], // LDAB: LDRB
        (0xE8D0, 0xF9) => [0xF8B0 | base, register], // LDAH: LDRH
        (0xE8D0, 0xFA) => [0xF8D0 | base, register], // LDA: LDR
        (0xE8D0, 0xFC) => [first, register | 0xF4F], // LDAEXB: LDREXB
        (0xE8D0, 0xFD) => [first, register | 0xF5F], // LDAEXH: LDREXH
        (0xE8D0, 0xFE) => [0xE850 | base, register | 0xF00], // LDAEX: LDREX
        (0xE8C0, 0xF8) => [0xF880 | base, register], // STLB: STRB
        (0xE8C0, 0xF9) => [0xF8A0 | base, register], // STLH: STRH
        (0xE8C0, 0xFA) => [0xF8C0 | base, register], // STL: STR
        (0xE8C0, 0xFC) => [first, register | 0xF40 | status], // STLEXB: STREXB
        (0xE8C0, 0xFD) => [first, register | 0xF50 | status], // STLEXH: STREXH
        (0xE8C0, 0xFE) => [0xE840 | base, register | status << 8], // STLEX: STREX
        _ => return None,
    })
}

/// VSEL, VMAXNM and VMINNM: the odd bit of the result's register is bit 6 and the condition bits 5
/// and 4. The emulator has the condition first.
const fn is_choice(first: u16, second: u16) -> bool {
    let is_max = first & 0x80 != 0;
    first >> 8 == 0xFE && second & 0xF10 == 0xA00 && (!is_max || first & 0x30 == 0)
}

/// VLDM, VSTM, VPUSH and VPOP of registers of 64 bits: the same words as with twice as many 32-bit
/// registers.
const fn is_block(first: u16, second: u16) -> bool {
    let (before, up, back) = (first & 0x100 != 0, first & 0x80 != 0, first & 0x20 != 0);
    first & 0xFE40 == 0xEC00 && second & 0xF01 == 0xB00 && (up || before) && (back || !before)
}

impl Pair {
    /// The transfer that these half words encode, if any.
    pub const fn of(first: u16, second: u16) -> Option<Self> {
        let to = first & 0x10 != 0;
        if first & 0xFFE0 == 0xEC40 && second & 0xFF0 == 0xB10 {
            return Some(Self::Core([second >> 12, first & 0xF], second & 0xF, to));
        }
        if first & 0xFF60 == 0xED00 && second & 0xF00 == 0xB00 {
            let offset = (second & 0xFF) as i32 * 4;
            let offset = if first & 0x80 == 0 { -offset } else { offset };
            return Some(Self::Memory(first & 0xF, offset, second >> 12, to));
        }
        None
    }

    /// Carries it out; `pc` is its address.
    pub fn run<B: CoreBus>(self, core: &mut CortexM33, bus: &mut B, pc: u32) {
        match self {
            Self::Core(of, pair, to_core) => {
                for (n, register) in of.into_iter().enumerate() {
                    let single = usize::from(pair) * 2 + n;
                    if to_core {
                        core.set_reg(register.into(), core.regs.s[single].to_bits());
                    } else {
                        core.regs.s[single] = f32::from_bits(core.reg(register.into()));
                    }
                }
            }
            Self::Memory(base, offset, pair, load) => {
                let from = match base {
                    15 => (pc + 4) & !3,
                    _ => core.reg(base.into()),
                };
                for n in 0..2 {
                    let address = from.wrapping_add_signed(offset) + 4 * n;
                    let single = usize::from(pair) * 2 + n as usize;
                    if load {
                        core.regs.s[single] = f32::from_bits(bus.read32(address, 0));
                    } else {
                        bus.write32(address, core.regs.s[single].to_bits(), 0);
                    }
                }
            }
        }
    }
}

/// Where in flash the image may have a [`Pair`]: a bit for each half word. A constant that looks
/// like one is never run.
#[derive(Debug)]
pub struct Pairs {
    candidates: Vec<u64>,
    flash: Vec<u16>,
}

impl Pairs {
    /// The pairs of this flash.
    pub fn new(flash: &[u8]) -> Self {
        let flash: Vec<u16> = flash
            .as_chunks::<2>()
            .0
            .iter()
            .map(|half| u16::from_le_bytes(*half))
            .collect();
        let mut candidates = vec![0; flash.len() / 64];
        for (n, halves) in flash.windows(2).enumerate() {
            if Pair::of(halves[0], halves[1]).is_some() {
                candidates[n / 64] |= 1 << (n % 64);
            }
        }
        Self { candidates, flash }
    }

    /// The pair at this address.
    pub fn at(&self, pc: u32) -> Option<Pair> {
        let half = pc.checked_sub(0x1000_0000)? as usize / 2;
        if self.candidates.get(half / 64)? >> (half % 64) & 1 == 0 {
            return None;
        }
        Pair::of(self.flash[half], self.flash[half + 1])
    }
}
