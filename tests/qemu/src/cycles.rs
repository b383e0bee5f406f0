//! A model of the cycles of straight code on a Cortex-M4F, for a comparison that QEMU cannot make:
//! two forms of a kernel, where fewer instructions need not mean fewer cycles.
//!
//! From the Cortex-M4 technical reference manual (ARM 100166, tables 3-1 and 7-1), without wait
//! states of the memory:
//!
//! | instruction | cycles |
//! |---|---|
//! | VMUL, VADD, VSUB, VCVT, VCMP, VMOV, VMRS | 1 |
//! | VMLA, VMLS, VFMA and their kin | 3 |
//! | VDIV, VSQRT | 14 |
//! | VLDM, VSTM, VPUSH, VPOP, PUSH, POP of n words | 1 + n |
//! | VLDR, VSTR, LDR, STR | 2 |
//! | a branch that is taken | 3 |
//! | the rest | 1 |
//!
//! and one more where the instruction that follows uses the result of floating-point arithmetic.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection, ObjectSymbol};

/// Cost of one call of a function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Executed instructions.
    pub instructions: u64,
    /// Cycles by the model.
    pub cycles: u64,
}

/// Cost of the function `name` of an image. The function runs the n-th of its loops (one backward
/// branch each, none nested) `turns[n]` times and calls no other function.
///
/// # Errors
/// No such image or function, or its loops do not match `turns`.
pub fn of(image: &Path, name: &str, turns: &[u64]) -> Result<Cost> {
    let bytes = fs::read(image).with_context(|| image.display().to_string())?;
    let elf = object::File::parse(&*bytes)?;
    let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(name));
    let symbol = symbol.with_context(|| format!("no `{name}` in {}", image.display()))?;
    let section = elf.section_by_index(symbol.section_index().context("undefined")?)?;
    let start = (symbol.address() & !1) - section.address();
    let data = section.data()?;
    let code = data.get(start as usize..(start + symbol.size()) as usize);
    let halves: Vec<u16> = code
        .context("outside its section")?
        .chunks_exact(2)
        .map(|half| u16::from_le_bytes([half[0], half[1]]))
        .collect();
    walk(&halves, turns)
}

fn walk(code: &[u16], turns: &[u64]) -> Result<Cost> {
    let (mut cost, mut at, mut loops) = (Cost::default(), 0, 0);
    let mut left: Option<u64> = None;
    let mut written: Option<u32> = None;
    while let Some(&first) = code.get(at) {
        let wide = first >> 11 >= 0b11101;
        let second = if wide {
            *code.get(at + 1).context("torn")?
        } else {
            0
        };
        let one = if wide {
            wide_one(first, second)
        } else {
            narrow(first)
        };
        let waits = written.is_some_and(|register| one.reads >> register & 1 == 1);
        cost.instructions += 1;
        cost.cycles += one.cycles + u64::from(waits);
        written = one.writes;
        at += 1 + usize::from(wide);
        if let Some(offset) = one.back {
            let turns = *turns.get(loops).context("a loop nobody spoke of")?;
            let more = left.unwrap_or(turns) - 1;
            if more > 0 {
                at = at
                    .checked_add_signed(offset)
                    .context("a branch out of the function")?;
                cost.cycles += 2;
                left = Some(more);
            } else {
                left = None;
                loops += 1;
            }
        }
        if one.ends {
            break;
        }
    }
    ensure!(loops == turns.len(), "{loops} loops, not {}", turns.len());
    Ok(cost)
}

/// One instruction: cycles, FPU registers read (a bit each), FPU register that arithmetic writes.
#[derive(Default)]
struct One {
    cycles: u64,
    reads: u32,
    writes: Option<u32>,
    /// Distance of a conditional branch in halfwords, from the next instruction.
    back: Option<isize>,
    ends: bool,
}

fn narrow(code: u16) -> One {
    let one = |cycles| One {
        cycles,
        ..One::default()
    };
    let list = u64::from((code & 0x1ff).count_ones());
    match code >> 8 {
        0xd0..=0xdd if code & 0x80 != 0 => One {
            // from the address of the branch and two halfwords
            back: Some(isize::from(code as u8 as i8) + 1),
            ..one(1)
        },
        0xb4 | 0xb5 | 0xbc => one(1 + list),
        0xbd => One {
            ends: true,
            ..one(3 + list)
        },
        0x47 => One {
            ends: true,
            ..one(3)
        },
        0x48..=0x4f | 0x60..=0x6f | 0x90..=0x9f => one(2),
        _ => one(1),
    }
}

fn wide_one(first: u16, second: u16) -> One {
    let word = u32::from(first) << 16 | u32::from(second);
    let register = |high: u32, low: u32| (word >> high & 15) << 1 | word >> low & 1;
    let (d, n, m) = (register(12, 22), register(16, 7), register(0, 5));
    let cycles = |cycles| One {
        cycles,
        ..One::default()
    };
    match first >> 8 {
        // a conditional branch, backwards
        0xf4..=0xf7 if second & 0xd000 == 0x8000 && first & 0x0380 != 0x0380 => {
            let low = i32::from(first & 0x3f) << 11 | i32::from(second & 0x7ff);
            One {
                back: Some(low as isize - (1 << 17)),
                ..cycles(1)
            }
        }
        // VLDR, VSTR; VLDM, VSTM, VPUSH, VPOP
        0xec | 0xed => {
            let single = first & 0x0120 == 0x0100;
            let words = if single { 1 } else { u64::from(second & 0xff) };
            let stored = if second & 0x100 == 0 && first & 0x10 == 0 {
                let last = (u64::from(d) + words).min(32);
                (d..last as u32).fold(0, |set, register| set | 1 << register)
            } else {
                0
            };
            One {
                reads: stored,
                ..cycles(1 + words)
            }
        }
        // to and from core registers
        0xee if second & 0x10 != 0 => One {
            reads: 1 << n,
            ..cycles(1)
        },
        0xee => {
            let (two, three) = (1 << n | 1 << m, 1 << n | 1 << m | 1 << d);
            let (taken, reads) = match (word >> 23 & 1, word >> 20 & 3) {
                (0, 0 | 1) | (1, 1 | 2) => (3, three),
                (0, _) => (1, two),
                (1, 0) => (14, two),
                // VSQRT; VMOV of a constant; VCVT of fixed point, in place; the rest of one operand
                _ if word & 0x003f_00c0 == 0x0031_00c0 => (14, 1 << m),
                _ if word & 0x40 == 0 => (1, 0),
                _ if word & 0x000a_0040 == 0x000a_0040 => (1, 1 << d),
                _ => (1, 1 << m),
            };
            One {
                reads,
                writes: Some(d),
                ..cycles(taken)
            }
        }
        0xf8 => cycles(2),
        _ => cycles(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn halves(words: &[u32]) -> Vec<u16> {
        words
            .iter()
            .flat_map(|word| [(word >> 16) as u16, *word as u16])
            .collect()
    }

    #[test]
    fn a_result_used_at_once_waits() {
        // vmul.f32 s0, s1, s2; vadd.f32 s3, s3, s0; vadd.f32 s4, s4, s1
        let (mul, add, other) = (0xee20_0a81, 0xee71_1a80, 0xee32_2a20);
        let waits = walk(&halves(&[mul, add, other]), &[]).expect("straight");
        let other_first = walk(&halves(&[mul, other, add]), &[]).expect("straight");
        assert_eq!((waits.instructions, waits.cycles), (3, 4));
        assert_eq!((other_first.instructions, other_first.cycles), (3, 3));
    }

    #[test]
    fn chained_forms_and_lists() {
        // vmla.f32 s0, s1, s2; vldmia r1!, {s3-s11}; vdiv.f32 s0, s1, s2
        let cost = walk(&halves(&[0xee00_0a81, 0xecf1_1a09, 0xee80_0a81]), &[]);
        assert_eq!(cost.expect("straight").cycles, 3 + 10 + 14);
    }

    #[test]
    fn loops_are_walked() {
        // movs r2, #9; subs r2, #1; bne back
        let code = [0x2209, 0x3a01, 0xd1fd];
        let cost = walk(&code, &[9]).expect("one loop");
        assert_eq!(
            (cost.instructions, cost.cycles),
            (1 + 18, 1 + 9 + 9 + 8 * 2)
        );
        // the same with bne.w
        let wide = [0x2209, 0x3a01, 0xf47f, 0xaffd];
        assert_eq!(walk(&wide, &[9]).expect("one loop"), cost);
        assert!(walk(&code, &[]).is_err() && walk(&code, &[9, 2]).is_err());
    }
}
