//! How deep the stack is at each place of a function, by following its instructions.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, bail, ensure};

use super::image::Image;
use super::thumb::{Instruction, What};

/// No function's own stack is larger, so that one that grows without end is found.
const LARGEST: u32 = 1 << 20;

/// What a function does to the stack.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Flow {
    /// Its own bytes at the deepest.
    pub frame: u32,
    /// Whom it calls, and how deep the stack is then.
    pub calls: BTreeSet<Call>,
}

/// A call, or a jump into another function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Call {
    /// Where.
    pub at: u32,
    /// Bytes of the caller.
    pub depth: u32,
    /// The caller has set the stack pointer anew, and `depth` counts from there.
    pub anew: bool,
    /// Who is called.
    pub to: Target,
}

/// Who is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// The function at this address.
    Function(u32),
    /// One that a register names.
    Pointer(Source),
}

/// Where a register has its value from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// From memory, at this offset from another register.
    Slot(u32),
    /// A constant.
    Constant(u32),
    /// The function's caller has put it into this register.
    Argument(u8),
    /// It is not certain.
    Unknown,
}

/// The state in front of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct State {
    depth: u32,
    anew: bool,
}

struct Walk<'i> {
    image: &'i Image,
    start: u32,
    code: BTreeMap<u32, Instruction>,
    /// Instructions with a condition, and where the others with the same condition begin; `None`:
    /// there are two conditions.
    conditional: BTreeMap<u32, Option<u32>>,
    /// Where branches lead.
    labels: BTreeSet<u32>,
    /// The deepest state in front of each instruction, on the old stack and on a new one.
    seen: BTreeMap<(u32, bool), u32>,
    open: Vec<(u32, State)>,
    flow: Flow,
}

/// Follows the function at `start`.
///
/// # Errors
/// An instruction moves the stack pointer in a way that cannot be followed.
pub fn flow(image: &Image, start: u32) -> Result<Flow> {
    let mut walk = Walk::new(image, start)?;
    let state = State {
        depth: 0,
        anew: false,
    };
    walk.open.push((start, state));
    while let Some((at, state)) = walk.open.pop() {
        walk.step(at, state)
            .with_context(|| format!("{} at {at:#x}", image.name(start)))?;
    }
    Ok(walk.flow)
}

/// Where `register` can have its value from at `at` in the function at `start`.
///
/// # Errors
/// As [`flow`].
pub fn sources(image: &Image, start: u32, at: u32, register: u8) -> Result<BTreeSet<Source>> {
    Ok(Walk::new(image, start)?.sources(at, register))
}

fn conditional(code: &BTreeMap<u32, Instruction>) -> BTreeMap<u32, Option<u32>> {
    let mut all = BTreeMap::new();
    for (at, instruction) in code {
        if let What::If(count, same) = instruction.what {
            let behind = code.range(at + 1..).take(count.into());
            all.extend(behind.map(|(place, _)| (*place, same.then_some(*at))));
        }
    }
    all
}

impl<'i> Walk<'i> {
    fn new(image: &'i Image, start: u32) -> Result<Self> {
        let code = image.instructions(start)?;
        let mut walk = Self {
            conditional: conditional(&code),
            labels: BTreeSet::new(),
            seen: BTreeMap::new(),
            open: Vec::new(),
            flow: Flow::default(),
            image,
            start,
            code,
        };
        walk.labels = walk.labels();
        Ok(walk)
    }

    fn labels(&self) -> BTreeSet<u32> {
        let targets = self.code.iter().flat_map(|(at, i)| match i.what {
            What::Jump(to) | What::Branch(to) => vec![to],
            What::Table { base, halves } => self.table(*at, base, halves).unwrap_or_default(),
            _ => Vec::new(),
        });
        targets.collect()
    }

    /// The targets of the table jump at `at`. The table ends where an entry leads to no code, at
    /// the latest where the compiler has marked code again. What is behind its true end may look
    /// like targets, too: rather one too many.
    fn table(&self, at: u32, base: u8, halves: bool) -> Option<Vec<u32>> {
        let behind = at + 4;
        let table = if base == 15 {
            behind
        } else {
            let (_, loaded) = self.loaded(at, base)?;
            match loaded?.what {
                What::Address(_, address) => address,
                _ => return None,
            }
        };
        let end = self
            .image
            .is_data(table)
            .then(|| self.image.mark_behind(table))??;
        let width = if halves { 2 } else { 1 };
        let entries = (table..end).step_by(width).filter_map(|entry| {
            let count = if halves {
                u16::from_le_bytes(self.image.bytes(entry)?).into()
            } else {
                u32::from(self.image.bytes::<1>(entry)?[0])
            };
            Some(behind + 2 * count)
        });
        // no compiler jumps to what only fills up
        let is_code = |to: &u32| self.code.get(to).is_some_and(|i| i.what != What::Nothing);
        Some(entries.take_while(is_code).collect())
    }

    fn step(&mut self, at: u32, mut state: State) -> Result<()> {
        let known = self.seen.get(&(at, state.anew));
        if known.is_some_and(|depth| *depth >= state.depth) {
            return Ok(());
        }
        ensure!(state.depth < LARGEST, "the stack grows without end");
        self.seen.insert((at, state.anew), state.depth);
        let instruction = *self
            .code
            .get(&at)
            .with_context(|| format!("no instruction at {at:#x}"))?;
        let conditional = self.conditional.contains_key(&at);
        let behind = at + instruction.length;
        let mut goes_on = true;
        match instruction.what {
            // before a return under the same condition; without it the stack is as deep as before
            What::Grow(by) if conditional && by <= 0 => {}
            What::Grow(by) => {
                ensure!(!conditional, "the stack pointer moves under a condition");
                let depth = state.depth.checked_add_signed(by);
                state.depth = depth.context("more is taken off the stack than was put there")?;
                if !state.anew {
                    self.flow.frame = self.flow.frame.max(state.depth);
                }
            }
            What::SetStack => {
                state = State {
                    depth: 0,
                    anew: true,
                };
            }
            What::Call(to) => {
                self.call(at, state, to)?;
                goes_on = self.code.contains_key(&behind); // else it never returns
            }
            What::CallRegister(register) => {
                self.pointer(at, state, register);
                goes_on = self.code.contains_key(&behind);
            }
            What::JumpRegister(register) => {
                self.pointer(at, state, register);
                goes_on = conditional;
            }
            What::Jump(to) => {
                self.jump(at, state, to)?;
                goes_on = conditional;
            }
            What::Branch(to) => self.jump(at, state, to)?,
            What::Table { base, halves } => {
                let targets = self.table(at, base, halves);
                let targets = targets.context("a table that is not found")?;
                self.open.extend(targets.into_iter().map(|to| (to, state)));
                goes_on = false;
            }
            What::Return | What::Stop => goes_on = conditional,
            What::Unknown => bail!("an instruction that cannot be followed"),
            _ => {}
        }
        if goes_on {
            self.jump(at, state, behind)?;
        }
        Ok(())
    }

    fn jump(&mut self, at: u32, state: State, to: u32) -> Result<()> {
        if self.code.contains_key(&to) {
            self.open.push((to, state));
            return Ok(());
        }
        self.call(at, state, to)
    }

    fn call(&mut self, at: u32, state: State, to: u32) -> Result<()> {
        ensure!(
            self.image.functions.contains_key(&to),
            "a call of {to:#x}, where no function begins"
        );
        self.add(at, state, Target::Function(to));
        Ok(())
    }

    fn pointer(&mut self, at: u32, state: State, register: u8) {
        for source in self.sources(at, register) {
            self.add(at, state, Target::Pointer(source));
        }
    }

    fn add(&mut self, at: u32, State { depth, anew }: State, to: Target) {
        self.flow.calls.insert(Call {
            at,
            depth,
            anew,
            to,
        });
    }

    /// Where `register` can have its value from at `at`.
    fn sources(&self, at: u32, register: u8) -> BTreeSet<Source> {
        let Some((place, loaded)) = self.loaded(at, register) else {
            return BTreeSet::from([Source::Unknown]);
        };
        let one = match loaded.map(|instruction| instruction.what) {
            None => Source::Argument(register),
            Some(What::Copy { from, .. }) => return self.sources(place, from),
            Some(What::Load {
                frame: true,
                offset,
                ..
            }) => return self.kept(offset),
            Some(What::Load { offset, .. }) => Source::Slot(offset),
            Some(What::High(_, high)) => self.constant(place, register, high),
            _ => Source::Unknown,
        };
        BTreeSet::from([one])
    }

    /// The constant whose upper half is made at `at`.
    fn constant(&self, at: u32, register: u8, high: u16) -> Source {
        let low = self.loaded(at, register).and_then(|(_, loaded)| loaded);
        match low.map(|instruction| instruction.what) {
            Some(What::Low(_, low)) => Source::Constant(u32::from(high) << 16 | u32::from(low)),
            _ => Source::Unknown,
        }
    }

    /// Where the word at this offset of the frame can have its value from, if nothing takes its
    /// address: from wherever the function writes it.
    fn kept(&self, offset: u32) -> BTreeSet<Source> {
        let mut sources = BTreeSet::new();
        for (at, instruction) in &self.code {
            let register = match instruction.what {
                What::Keep(register, at) if at == offset => register,
                What::KeepTwo([register, _], at) if at == offset => register,
                What::KeepTwo([_, register], at) if at + 4 == offset => register,
                What::FrameAddress(at) if at == offset => {
                    sources.insert(Source::Unknown);
                    continue;
                }
                _ => continue,
            };
            sources.extend(match self.loaded(*at, register) {
                // from one place of the frame to another is not followed
                Some((_, Some(by))) if matches!(by.what, What::Load { frame: true, .. }) => {
                    BTreeSet::from([Source::Unknown])
                }
                _ => self.sources(*at, register),
            });
        }
        if sources.is_empty() {
            sources.insert(Source::Unknown);
        }
        sources
    }

    /// The instruction that has given `register` its value at `at`, if nothing leads there but the
    /// straight line. No instruction: it is as the caller has left it.
    fn loaded(&self, at: u32, register: u8) -> Option<(u32, Option<Instruction>)> {
        let mut here = at;
        for (place, instruction) in self.code.range(self.start..at).rev() {
            if self.labels.contains(&here) || here != place + instruction.length {
                return None;
            }
            if instruction.writes >> register & 1 == 1 {
                let condition = self.conditional.get(place);
                let holds = condition.is_none_or(|condition| {
                    condition.is_some() && self.conditional.get(&at) == Some(condition)
                });
                return holds.then_some((*place, Some(*instruction)));
            }
            if !instruction.what.goes_on() && !self.conditional.contains_key(place) {
                return None;
            }
            here = *place;
        }
        (here == self.start && !self.labels.contains(&here)).then_some((here, None))
    }
}
