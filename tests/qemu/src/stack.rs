//! A bound of an image's stack, from its instructions: how deep each function goes, whom it calls,
//! and what interrupts add.
//!
//! The instructions are those of the image that is flashed. What the compiler says of its frames
//! comes from another build, with [`EMIT`], and is compared ([`differences`]).

mod flow;
mod image;
mod targets;
mod thumb;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use serde::Serialize;

use flow::{Flow, Source, Target, flow, sources};
use image::Image;
use targets::Targets;

/// The compiler's flag with which it says how large its frames are; it needs `RUSTC_BOOTSTRAP`.
pub const EMIT: &str = "-Zemit-stack-sizes";

/// What the core pushes for an exception: 26 words with the floating-point registers, and one to
/// align them (Armv7-M B1.5.7).
const EXCEPTION: u32 = 108;

/// A way down.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Way {
    /// Who begins.
    pub root: String,
    /// Bytes at the deepest.
    pub bytes: u32,
    /// The functions on it, each with its own bytes where it calls the next one.
    pub functions: Vec<(String, u32)>,
}

/// The bound of an image.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Bound {
    /// Bytes of stack at most: the main loop, and on it one interrupt of each level.
    pub bytes: u32,
    /// Bytes that the linker has set aside.
    pub room: u32,
    /// From reset on.
    pub main: Way,
    /// The deepest handler of each level that can interrupt the ones before, with what the core
    /// pushes.
    pub levels: Vec<Way>,
    /// Handlers that begin at the top of the stack and never return.
    pub anew: Way,
    /// Functions that can be reached.
    pub functions: usize,
    /// Calls through registers among them.
    pub pointers: usize,
}

impl Bound {
    /// Of the image in a file.
    ///
    /// # Errors
    /// It cannot be followed, or a function can come back to itself.
    pub fn of(path: &Path) -> Result<Self> {
        let image = Image::read(path)?;
        let mut graph = Graph::new(&image)?;
        let reset = image.reset().context("no reset vector")?;
        let main = graph.way(reset)?;
        let levels = levels(&image, &mut graph)?;
        let anew = graph.anew()?;
        let above = levels.iter().map(|way| way.bytes).sum::<u32>();
        Ok(Self {
            bytes: main.bytes + above,
            room: image.room,
            main,
            levels,
            anew,
            functions: graph.deepest.len(),
            pointers: graph.pointers(),
        })
    }
}

/// The handlers of the interrupts whose priority is the second highest, behind the window
/// watchdog's (`CUT_THROUGH` in `board/stm32f405/interrupts.rs`); all others that are served have a
/// lower one.
const CUT_THROUGH: [&str; 6] = [
    "stm32f405::serial::usart1",
    "stm32f405::serial::usart1_in_end",
    "stm32f405::serial::usart1_out_end",
    "stm32f405::serial::usart2",
    "stm32f405::serial::usart2_in_end",
    "stm32f405::serial::usart2_out_end",
];

/// The deepest handlers, lowest priority first. Those of a level do not interrupt each other.
fn levels(image: &Image, graph: &mut Graph) -> Result<Vec<Way>> {
    let level = |(number, handler): &(u32, u32)| match number {
        2 => 4,
        3 => 3,
        _ if image.name(*handler).ends_with("crash::wwdg") => 2,
        _ => usize::from(
            CUT_THROUGH
                .iter()
                .any(|cut| image.name(*handler).ends_with(cut)),
        ),
    };
    let mut deepest: BTreeMap<usize, Way> = BTreeMap::new();
    for handler in image.handlers() {
        let mut way = graph.way(handler.1)?;
        way.bytes += EXCEPTION;
        let place = deepest.entry(level(&handler)).or_default();
        if way.bytes > place.bytes {
            *place = way;
        }
    }
    Ok(deepest.into_values().collect())
}

/// Who calls whom, as far as it was asked for.
struct Graph<'i> {
    image: &'i Image,
    targets: Targets,
    /// Of every function of the image.
    flows: BTreeMap<u32, Flow>,
    /// Who calls a function by its name, and where.
    callers: BTreeMap<u32, BTreeSet<(u32, u32)>>,
    /// Bytes of a function with all it calls, and the call that leads there.
    deepest: BTreeMap<u32, (u32, Option<(u32, u32)>)>,
    /// The functions that are being looked at.
    open: Vec<u32>,
}

impl<'i> Graph<'i> {
    fn new(image: &'i Image) -> Result<Self> {
        let mut flows = BTreeMap::new();
        let mut callers: BTreeMap<u32, BTreeSet<_>> = BTreeMap::new();
        for start in image.functions.keys() {
            let flow = flow(image, *start)?;
            for call in &flow.calls {
                if let Target::Function(to) = call.to {
                    callers.entry(to).or_default().insert((*start, call.at));
                }
            }
            flows.insert(*start, flow);
        }
        Ok(Self {
            image,
            targets: Targets::of(image)?,
            flows,
            callers,
            deepest: BTreeMap::new(),
            open: Vec::new(),
        })
    }

    fn way(&mut self, root: u32) -> Result<Way> {
        let bytes = self.depth(root)?;
        let mut functions = Vec::new();
        let mut next = Some(root);
        while let Some(function) = next {
            let (_, call) = self.deepest[&function];
            let own = call.map_or(self.flows[&function].frame, |(depth, _)| depth);
            functions.push((self.image.name(function).to_owned(), own));
            next = call.map(|(_, to)| to);
        }
        Ok(Way {
            root: self.image.name(root).to_owned(),
            bytes,
            functions,
        })
    }

    fn depth(&mut self, function: u32) -> Result<u32> {
        if let Some((bytes, _)) = self.deepest.get(&function) {
            return Ok(*bytes);
        }
        if let Some(first) = self.open.iter().position(|open| *open == function) {
            let circle = self.open[first..].iter().map(|open| self.image.name(*open));
            bail!(
                "recursion:\n  {}",
                circle.collect::<Vec<_>>().join("\n  calls ")
            );
        }
        self.open.push(function);
        let (mut deepest, mut call) = (self.flows[&function].frame, None);
        for (depth, anew, to) in self.calls(function)? {
            let bytes = self.depth(to)?;
            if !anew && depth + bytes > deepest {
                (deepest, call) = (depth + bytes, Some((depth, to)));
            }
        }
        self.open.pop();
        self.deepest.insert(function, (deepest, call));
        Ok(deepest)
    }

    /// Depth, whether on a new stack, and who is called.
    fn calls(&self, function: u32) -> Result<BTreeSet<(u32, bool, u32)>> {
        let name = self.image.name(function);
        let mut calls = BTreeSet::new();
        for call in &self.flows[&function].calls {
            let targets = match call.to {
                Target::Function(to) => BTreeSet::from([to]),
                Target::Pointer(source) => self.meant(function, source)?,
            };
            ensure!(
                !targets.is_empty(),
                "{name} calls through a register at {:#x}: nobody is known to be meant",
                call.at
            );
            calls.extend(targets.into_iter().map(|to| (call.depth, call.anew, to)));
        }
        Ok(calls)
    }

    /// Whom `function` calls through a register that has its value from there.
    fn meant(&self, function: u32, from: Source) -> Result<BTreeSet<u32>> {
        let of = |caller, slot| self.targets.of_call(self.image.name(caller), slot);
        Ok(match from {
            Source::Slot(slot) => of(function, Some(slot)),
            Source::Constant(word) => self.image.pointer(word).into_iter().collect(),
            Source::Argument(register) if !self.targets.has(function) => {
                let mut all = BTreeSet::new();
                for (caller, at) in self.callers.get(&function).into_iter().flatten() {
                    for source in sources(self.image, *caller, *at, register)? {
                        all.extend(match source {
                            Source::Slot(slot) => of(*caller, Some(slot)),
                            Source::Constant(word) => {
                                self.image.pointer(word).into_iter().collect()
                            }
                            // an argument of an argument is followed no further
                            Source::Argument(_) | Source::Unknown => of(*caller, None),
                        });
                    }
                }
                all
            }
            Source::Argument(_) | Source::Unknown => of(function, None),
        })
    }

    /// The deepest way on a stack that a handler has begun anew.
    fn anew(&mut self) -> Result<Way> {
        let mut deepest = Way::default();
        let starts = self.flows.iter().flat_map(|(function, flow)| {
            let anew = flow.calls.iter().filter(|call| call.anew);
            anew.map(|call| (*function, *call))
        });
        let starts: Vec<_> = starts.collect();
        for (function, call) in starts {
            let Target::Function(to) = call.to else {
                bail!(
                    "{} begins a stack for nobody known",
                    self.image.name(function)
                );
            };
            let mut way = self.way(to)?;
            way.bytes += call.depth;
            if way.bytes > deepest.bytes {
                deepest = way;
            }
        }
        Ok(deepest)
    }

    fn pointers(&self) -> usize {
        let reached = self
            .deepest
            .keys()
            .filter_map(|function| self.flows.get(function));
        reached
            .flat_map(|flow| &flow.calls)
            .filter(|call| matches!(call.to, Target::Pointer(_)))
            .count()
    }
}

/// Compares an image with what the compiler says of the same image, built with [`EMIT`]: the same
/// instructions, and each frame as it follows from them. Returns how many frames were compared.
///
/// # Errors
/// They differ; it names where.
pub fn differences(image: &Path, stated: &Path) -> Result<usize> {
    let (image, stated) = (Image::read(image)?, Image::read(stated)?);
    ensure!(
        image.text() == stated.text(),
        "with {EMIT} the image has other instructions"
    );
    let mut wrong = Vec::new();
    for (start, bytes) in &stated.stated {
        let own = flow(&image, *start)?.frame;
        if own != *bytes {
            let name = image.name(*start);
            wrong.push(format!("{name}: {own}, the compiler says {bytes}"));
        }
    }
    ensure!(wrong.is_empty(), "frames differ:\n  {}", wrong.join("\n  "));
    ensure!(!stated.stated.is_empty(), "the compiler says nothing");
    Ok(stated.stated.len())
}

#[cfg(test)]
#[path = "stack/tests.rs"]
mod tests;
