//! Who can be called through a register.
//!
//! The address of every function that is called so is somewhere in the image. Either it is in a
//! *vtable*, the table of a trait's methods, whose form is known: three words (how to drop it, its
//! size, its alignment), then the methods. Then a call that loads its target at an offset can only
//! mean the methods at this offset. Or instructions or other constants hold it. Then any call
//! through a register may mean it.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Result;

use super::image::Image;
use super::thumb::What;

/// A trait whose methods are called through vtables (or a function that is called by its address),
/// and where no such call can be. It narrows what
/// a call can mean, so that a learner that asks a hypothesis is no recursion.
struct Dynamic {
    /// How the methods are called.
    methods: &'static str,
    /// Functions with this in their names call them through no vtable ...
    never: &'static [&'static str],
    /// ... unless one of these is in it, too: code of a room above can be part of them.
    unless: &'static [&'static str],
}

/// The traits. `tests` compare `never` with the sources.
const DYNAMIC: [Dynamic; 3] = [
    Dynamic {
        methods: " as firmware::learn::Learner>::",
        never: &[
            "firmware::learn::",
            "lrnn_nostd::",
            "firmware::nav::",
            MASKED,
        ],
        unless: &["firmware::app::", "firmware::store::", "::board::"],
    },
    Dynamic {
        methods: " as firmware::learn::bank::hypothesis::Hypothesis<",
        never: &[" as firmware::learn::bank::hypothesis::Hypothesis<", MASKED],
        unless: &[],
    },
    Dynamic {
        methods: MASKED,
        never: &[MASKED],
        unless: &[],
    },
];

/// Calls what the loop does to the cutting of frames: closures that call nothing through a vtable
/// themselves.
const MASKED: &str = "::shared::cut::masked";

/// What can be called through registers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Targets {
    /// The methods in vtables: trait, offset, function.
    methods: BTreeSet<(usize, u32, u32)>,
    /// Functions whose address is held elsewhere, with their trait (behind the last: any other).
    plain: BTreeSet<(usize, u32)>,
}

impl Targets {
    /// Looks through the image.
    ///
    /// # Errors
    /// An instruction cannot be read.
    pub fn of(image: &Image) -> Result<Self> {
        let mut targets = Self::default();
        let words: BTreeMap<u32, u32> = image.words().collect();
        let mut in_tables = BTreeSet::new();
        for at in words.keys() {
            let methods = methods(image, *at);
            let names: Vec<_> = methods.iter().map(|(_, to)| image.name(*to)).collect();
            let kind = kind(&names);
            if kind == DYNAMIC.len() {
                continue; // of no trait that is known: anybody may mean them
            }
            for (index, (place, to)) in methods.iter().enumerate() {
                let offset = 12 + 4 * index as u32;
                targets.methods.insert((kind, offset, *to));
                in_tables.insert(*place);
            }
        }
        let elsewhere = words.iter().filter(|(at, _)| !in_tables.contains(at));
        let mut plain: BTreeSet<u32> = elsewhere
            .filter_map(|(_, word)| image.pointer(*word))
            .collect();
        for start in image.functions.keys() {
            plain.extend(made(image, *start)?);
        }
        let of_kind = |to: u32| (kind(&[image.name(to)]), to);
        targets.plain = plain.into_iter().map(of_kind).collect();
        Ok(targets)
    }

    /// Whom `caller` can mean, with a target loaded at `slot` or anywhere.
    pub fn of_call(&self, caller: &str, slot: Option<u32>) -> BTreeSet<u32> {
        let may = |kind: usize| DYNAMIC.get(kind).is_none_or(|dynamic| dynamic.may(caller));
        let methods = self
            .methods
            .iter()
            .filter(|(kind, offset, _)| may(*kind) && slot.is_none_or(|slot| slot == *offset));
        let plain = self.plain.iter().filter(|(kind, _)| may(*kind));
        methods
            .map(|(_, _, to)| *to)
            .chain(plain.map(|(_, to)| *to))
            .collect()
    }

    /// Whether `function` can be called through a register.
    pub fn has(&self, function: u32) -> bool {
        self.methods.iter().any(|(_, _, to)| *to == function)
            || self.plain.iter().any(|(_, to)| *to == function)
    }
}

impl Dynamic {
    fn may(&self, caller: &str) -> bool {
        let has = |names: &[&str]| names.iter().any(|name| caller.contains(name));
        !has(self.never) || has(self.unless)
    }
}

/// The trait that these are methods of; behind the last: any other. Equal functions are one, so one
/// name may belong to two of its types, but never to two traits of the table.
fn kind(names: &[&str]) -> usize {
    let of = |dynamic: &Dynamic| names.iter().any(|name| name.contains(dynamic.methods));
    DYNAMIC.iter().position(of).unwrap_or(DYNAMIC.len())
}

/// The methods of the vtable at `at`: places and functions; none if there is no vtable.
fn methods(image: &Image, at: u32) -> Vec<(u32, u32)> {
    let head = [at, at + 4, at + 8].map(|at| image.word(at));
    let [Some(drop), Some(size), Some(align)] = head else {
        return Vec::new();
    };
    let drops = drop == 0 || image.pointer(drop).is_some();
    if image.is_code(at) || !drops || size > 1 << 17 || !matches!(align, 1 | 2 | 4 | 8) {
        return Vec::new();
    }
    (0..)
        .map(|index| at + 12 + 4 * index)
        .map_while(|place| Some((place, image.pointer(image.word(place)?)?)))
        .collect()
}

/// The functions whose address the function at `start` makes of two halves.
fn made(image: &Image, start: u32) -> Result<BTreeSet<u32>> {
    let mut lows: BTreeSet<(u8, u16)> = BTreeSet::new();
    let mut highs = BTreeSet::new();
    for instruction in image.instructions(start)?.into_values() {
        match instruction.what {
            What::Low(register, half) => drop(lows.insert((register, half))),
            What::High(register, half) => drop(highs.insert((register, half))),
            _ => {}
        }
    }
    let pairs = lows.iter().flat_map(|(low_in, low)| {
        let highs = highs.iter().filter(move |(high_in, _)| high_in == low_in);
        highs.map(move |(_, high)| u32::from(*high) << 16 | u32::from(*low))
    });
    Ok(pairs.filter_map(|word| image.pointer(word)).collect())
}
