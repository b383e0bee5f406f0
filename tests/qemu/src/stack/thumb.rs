//! The Thumb-2 instructions that move the stack pointer or leave the straight line (Armv7-M
//! Architecture Reference Manual, chapters A5 and A7), and what a `blx` needs to know of the rest.
//!
//! No crate decodes the floating-point ones among them (`vpush`). What sets the stack pointer or
//! the program counter in a way that is not listed here is [`What::Unknown`], never passed over.

/// Registers with a meaning.
const SP: u16 = 13;
const PC: u16 = 15;

/// What a call need not keep (AAPCS): r0 to r3, r12, lr.
const CLOBBERED: u16 = 0x500f;

/// What an instruction does to the stack pointer or the program counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// Neither.
    Other,
    /// `nop`.
    Nothing,
    /// The stack grows by so many bytes; negative: it shrinks.
    Grow(i32),
    /// The stack pointer becomes another register's value.
    SetStack,
    /// `bl`.
    Call(u32),
    /// `blx` through a register.
    CallRegister(u8),
    /// `b`.
    Jump(u32),
    /// `b` or `cbz` with a condition.
    Branch(u32),
    /// `bx` through a register that is not the link register.
    JumpRegister(u8),
    /// `tbb`, `tbh`: a jump by a table.
    Table {
        /// The register with its address; 15: it is behind the instruction.
        base: u8,
        /// Of halfwords.
        halves: bool,
    },
    /// An address near the instruction, into a register.
    Address(u8, u32),
    /// Back to the caller.
    Return,
    /// The next so many instructions have a condition; whether it is the same for all of them.
    If(u8, bool),
    /// `udf`, `bkpt`.
    Stop,
    /// `movw` of 16 bits into a register.
    Low(u8, u16),
    /// `movt` of 16 bits into a register.
    High(u8, u16),
    /// A word from memory at a register and an offset.
    Load {
        /// To this register.
        to: u8,
        /// Offset.
        offset: u32,
        /// From the stack frame.
        frame: bool,
    },
    /// A word from a register into the stack frame, at an offset.
    Keep(u8, u32),
    /// Two words.
    KeepTwo([u8; 2], u32),
    /// The address of what is at this offset of the stack frame, into a register.
    FrameAddress(u32),
    /// A register into another.
    Copy {
        /// To this register.
        to: u8,
        /// From that one.
        from: u8,
    },
    /// Sets the stack pointer or the program counter, and is not understood.
    Unknown,
}

impl What {
    /// Whether the next instruction may follow.
    pub fn goes_on(self) -> bool {
        !matches!(
            self,
            Self::Jump(_) | Self::Return | Self::Table { .. } | Self::JumpRegister(_) | Self::Stop
        )
    }
}

/// One instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// 2 or 4 bytes.
    pub length: u32,
    /// What it does.
    pub what: What,
    /// The registers that it may write, a bit each; rather one too many.
    pub writes: u16,
}

/// Whether an instruction that begins with this halfword has a second one (A5.1).
pub fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// The instruction at `address`; `second` is not looked at if it is a narrow one.
pub fn decode(address: u32, first: u16, second: u16) -> Instruction {
    if is_wide(first) {
        Instruction {
            length: 4,
            what: wide(address, first, second),
            writes: wide_writes(first, second),
        }
    } else {
        Instruction {
            length: 2,
            what: narrow(address, first),
            writes: narrow_writes(first),
        }
    }
}

/// A sum with an offset of so many bits.
fn target(address: u32, offset: u32, bits: u32) -> u32 {
    let signed = (offset << (32 - bits)) as i32 >> (32 - bits);
    address.wrapping_add(4).wrapping_add_signed(signed)
}

/// The program counter as instructions add to it.
fn near(address: u32) -> u32 {
    (address + 4) & !3
}

fn narrow(address: u32, first: u16) -> What {
    let low = u32::from(first & 0xff);
    let register = (first >> 3 & 15) as u8;
    // destination of `add`, `mov` with high registers
    let high = first >> 4 & 8 | first & 7;
    match first >> 8 {
        0x44 | 0x46 if high == PC => What::Unknown,
        0x44 if high == SP => What::Unknown,
        0x46 if high == SP => What::SetStack,
        0x46 => What::Copy {
            to: high as u8,
            from: register,
        },
        0x47 if first & 0x80 != 0 => What::CallRegister(register),
        0x47 if register == 14 => What::Return,
        0x47 => What::JumpRegister(register),
        0x68..=0x6f => What::Load {
            to: (first & 7) as u8,
            offset: u32::from(first >> 6 & 31) * 4,
            frame: false,
        },
        0x90..=0x97 => What::Keep((first >> 8 & 7) as u8, low * 4),
        0x98..=0x9f => What::Load {
            to: (first >> 8 & 7) as u8,
            offset: low * 4,
            frame: true,
        },
        0xa0..=0xa7 => What::Address((first >> 8 & 7) as u8, near(address) + low * 4),
        0xa8..=0xaf => What::FrameAddress(low * 4),
        0xb0 if first & 0x80 != 0 => What::Grow((low as i32 & 0x7f) * 4),
        0xb0 => What::Grow(-(low as i32) * 4),
        0xb4 | 0xb5 => What::Grow((first & 0x1ff).count_ones() as i32 * 4),
        0xbc => What::Grow(-((first & 0xff).count_ones() as i32) * 4),
        0xbd => What::Return,
        0xb1 | 0xb3 | 0xb9 | 0xbb => {
            What::Branch(address + 4 + u32::from(first >> 3 & 0x40 | first >> 2 & 0x3e))
        }
        0xbe | 0xde => What::Stop,
        0xbf if low == 0 => What::Nothing,
        0xbf if low & 15 != 0 => {
            let count = 4 - (low & 15).trailing_zeros();
            // above the lowest bit that is set: the last bit of each condition but the first's
            let last = low >> 4 & 1;
            let same = (1..count).all(|index| low >> (4 - index) & 1 == last);
            What::If(count as u8, same)
        }
        0xd0..=0xdd => What::Branch(target(address, low << 1, 9)),
        0xe0..=0xe7 => What::Jump(target(address, u32::from(first & 0x7ff) << 1, 12)),
        _ => What::Other,
    }
}

fn wide(address: u32, first: u16, second: u16) -> What {
    let list = i32::try_from(second.count_ones()).unwrap_or_default() * 4;
    let low = i32::from(second & 0xff);
    match (first, second) {
        // store and load multiple; Rn = SP, written back
        (0xe92d, _) => What::Grow(list),
        (0xe8bd, _) if second & 0x8000 != 0 => What::Return,
        (0xe8bd, _) => What::Grow(-list),
        // str rt, [sp, #-n]!; ldr rt, [sp], #n
        (0xf84d, _) if second & 0x0f00 == 0x0d00 => What::Grow(low),
        (0xf85d, _) if second & 0x0f00 == 0x0b00 && second >> 12 == PC => What::Return,
        (0xf85d, _) if second & 0x0f00 == 0x0b00 => What::Grow(-low),
        // strd, ldrd in the same way
        (0xe96d, _) => What::Grow(low * 4),
        (0xe8fd, _) => What::Grow(-low * 4),
        // vpush, vpop
        (0xed2d | 0xed6d, _) if second >> 9 & 7 == 5 => What::Grow(low * 4),
        (0xecbd | 0xecfd, _) if second >> 9 & 7 == 5 => What::Grow(-low * 4),
        // tbb, tbh
        (_, _) if first & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000 => What::Table {
            base: (first & 15) as u8,
            halves: second & 0x10 != 0,
        },
        _ if first >> 11 == 0b11110 && second & 0x8000 != 0 => branch(address, first, second),
        _ if first >> 11 == 0b11110 => immediate(address, first, second),
        _ => other_wide(first, second),
    }
}

/// Branches, and what shares their encodings (A5.3.4).
fn branch(address: u32, first: u16, second: u16) -> What {
    let [first, second] = [u32::from(first), u32::from(second)];
    let (sign, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let far = || {
        let [i1, i2] = [j1, j2].map(|j| (j ^ sign ^ 1) & 1);
        let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12;
        target(address, offset | (second & 0x7ff) << 1, 25)
    };
    match second >> 12 & 5 {
        5 => What::Call(far()),
        1 => What::Jump(far()),
        4 => What::Unknown, // to the Arm instruction set
        _ if first >> 7 & 7 != 7 => {
            let offset = sign << 20 | j2 << 19 | j1 << 18 | (first & 0x3f) << 12;
            What::Branch(target(address, offset | (second & 0x7ff) << 1, 21))
        }
        // msr to a stack pointer or to CONTROL; udf
        _ if first & 0xfff0 == 0xf380 && matches!(second & 0xff, 8 | 9 | 20) => What::Unknown,
        _ if first & 0xfff0 == 0xf7f0 => What::Stop,
        _ => What::Other,
    }
}

/// Data processing with a constant (A5.3.1, A5.3.3).
fn immediate(address: u32, first: u16, second: u16) -> What {
    let to = second >> 8 & 15;
    let (from, plain) = (first & 15, first & 0x0200 != 0);
    let twelve = first << 1 & 0x800 | second >> 4 & 0x700 | second & 0xff;
    let half = from << 12 | twelve;
    match (plain, first >> 4 & 0x1f) {
        (true, 0x04) if to != SP => What::Low(to as u8, half),
        (true, 0x0c) if to != SP => What::High(to as u8, half),
        (true, 0x00) if from == PC && to != SP => {
            What::Address(to as u8, near(address) + u32::from(twelve))
        }
        (true, 0x0a) if from == PC && to != SP => {
            What::Address(to as u8, near(address) - u32::from(twelve))
        }
        (true, 0x00) if from == SP && to != SP => What::FrameAddress(twelve.into()),
        (false, 0x10) if from == SP && to != SP => What::FrameAddress(expanded(twelve) as u32),
        _ if to != SP => What::Other,
        // addw, subw; then add and sub with or without flags
        (true, 0x00) if from == SP => What::Grow(-i32::from(twelve)),
        (true, 0x0a) if from == SP => What::Grow(i32::from(twelve)),
        (false, 0x10 | 0x11) if from == SP => What::Grow(-expanded(twelve)),
        (false, 0x1a | 0x1b) if from == SP => What::Grow(expanded(twelve)),
        // ssat, bfi and others to the stack pointer make no sense; cmp, cmn and tst have no
        // destination
        _ => What::Unknown,
    }
}

/// A constant as instructions hold it (A5.3.2).
fn expanded(twelve: u16) -> i32 {
    let byte = u32::from(twelve & 0xff);
    let value = match twelve >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (0x80 | byte & 0x7f).rotate_right(u32::from(twelve >> 7)),
    };
    value as i32
}

/// Loads, stores and data processing with registers.
fn other_wide(first: u16, second: u16) -> What {
    let target = second >> 12;
    let (from, to) = (first & 15, second >> 8 & 15);
    let special = target == SP || target == PC;
    match first >> 4 {
        // ldr rt, [rn, #n]
        0xf8d if !special => What::Load {
            to: target as u8,
            offset: u32::from(second & 0xfff),
            frame: from == SP,
        },
        0xf8c if from == SP => What::Keep(target as u8, u32::from(second & 0xfff)),
        0xe9c if from == SP => {
            What::KeepTwo([target as u8, to as u8], u32::from(second & 0xff) * 4)
        }
        0xf85 | 0xf8d if special => What::Unknown,
        // loads and stores that write the stack pointer back, but for those above
        0xf80..=0xf85 | 0xf91 | 0xf93 if from == SP && second & 0x0900 == 0x0900 => What::Unknown,
        0xe86 | 0xe87 | 0xe8a | 0xe8e | 0xe93 | 0xe97 | 0xe9e | 0xe9f if from == SP => {
            What::Unknown
        }
        0xeca | 0xecb | 0xece | 0xecf | 0xed2 | 0xed3 | 0xed6 | 0xed7 if from == SP => {
            What::Unknown
        }
        // ldm of the stack pointer or the program counter
        0xe89 | 0xe8b | 0xe91 | 0xe93 if second & 0xa000 != 0 => What::Unknown,
        // data processing of registers, multiplication
        0xea0..=0xebf | 0xfa0..=0xfbf if to == SP => What::Unknown,
        _ => What::Other,
    }
}

fn bit(register: u16) -> u16 {
    1 << (register & 15)
}

fn narrow_writes(first: u16) -> u16 {
    let (low, middle) = (bit(first & 7), bit(first >> 8 & 7));
    match first >> 11 {
        0b01000 if first >> 8 == 0x47 && first & 0x80 == 0 => 0,
        0b01000 if first >> 8 == 0x47 => CLOBBERED,
        0b01000 if first >> 10 == 0b010001 => bit(first >> 4 & 8 | first & 7),
        0b10110 if first >> 8 == 0xb0 => bit(SP),
        0b10110 if first >> 8 != 0xb2 => 0, // cbz, push, cps
        0b00000..=0b00011 | 0b01000 | 0b01010..=0b10001 | 0b10110 => low,
        0b10111 | 0b11001 => first & 0xff | low | middle,
        _ => middle,
    }
}

fn wide_writes(first: u16, second: u16) -> u16 {
    let (from, to, target) = (bit(first), bit(second >> 8), bit(second >> 12));
    match first >> 8 {
        0xf0..=0xf7 if second & 0xd000 == 0xd000 => CLOBBERED,
        0xf0..=0xf7 | 0xea | 0xeb => to,
        0xf8 | 0xf9 if first & 0x80 == 0 && second & 0x0900 == 0x0900 => target | from,
        0xf8 | 0xf9 => target,
        // load and store multiple
        0xe8 | 0xe9 if first & 0x40 == 0 => second | from,
        // vldr, vstr; vmov of two registers; vldm, vstm; floating-point arithmetic; vmov, vmrs
        0xed if first & 0x20 == 0 => 0,
        0xec if first & 0xe0 == 0x40 => target | from,
        0xec | 0xed => from,
        0xee if second & 0x10 == 0 => 0,
        0xee => target,
        _ => target | to | from | bit(second),
    }
}

#[cfg(test)]
#[path = "thumb_tests.rs"]
mod tests;
