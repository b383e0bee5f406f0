//! The cost of the images against `budgets.toml`.

use qemu::budget::Budgets;
use qemu::committed::Committed;
use qemu::count;
use qemu::images::{
    BOARDS, DIFFERENT, GROWTH, INFERENCE, INSTRUCTIONS, MPS2, STM32F405, STM32F405_WINDOW,
};
use qemu::machine::{MPS2_AN386, NETDUINOPLUS2};
use qemu::memory::{RAM_START, address};
use qemu::size::{RAM, Size};

#[test]
fn a_loop_of_known_length_is_counted_exactly() {
    let Some(image) = INSTRUCTIONS.build_or_skip() else {
        return;
    };
    for board in BOARDS {
        let (known, _) = count::run(board.machine, &image).expect("the image runs");
        known.check().expect("within two ticks");
    }
}

/// Two machines with different clocks count the same instructions.
#[test]
fn both_counters_agree() {
    let Some(image) = INSTRUCTIONS.build_or_skip() else {
        return;
    };
    let (_, fine) = count::run(NETDUINOPLUS2, &image).expect("the image runs");
    let (_, coarse) = count::run(MPS2_AN386, &image).expect("the image runs");
    for (name, count) in fine {
        // In 1000 repetitions two ticks of 40 instructions are 0.08. Work of many instructions is
        // done in down to a fortieth of the repetitions: there they are 3.2.
        let off = (count - coarse[&name]).abs();
        let limit = if count > 10_000.0 { 3.2 } else { 0.2 };
        assert!(off < limit, "{name}: {count} and {}", coarse[&name]);
    }
}

/// A larger size costs more, in every size that `cargo xtask growth` draws.
#[test]
fn what_grows_costs_more() {
    let Some(image) = GROWTH.build_or_skip() else {
        return;
    };
    let (_, counts) = count::run(NETDUINOPLUS2, &image).expect("the image runs");
    for kind in ["rate", "nets", "weights", "candidates", "navigators"] {
        let sizes = counts.iter().filter_map(|(name, cost)| {
            let (of, size) = name.split_once('/')?;
            (of == kind).then(|| (size.parse::<u32>().expect("a size"), *cost))
        });
        let mut sizes: Vec<(u32, f64)> = sizes.collect();
        sizes.sort_by_key(|(size, _)| *size);
        assert!(sizes.len() > 2, "{kind}: {sizes:?}");
        assert!(
            sizes.windows(2).all(|two| two[0].1 < two[1].1),
            "{kind}: {sizes:?}"
        );
    }
}

#[test]
fn instructions_are_within_budget() {
    let Some(image) = INSTRUCTIONS.build_or_skip() else {
        return;
    };
    let (_, counts) = count::run(NETDUINOPLUS2, &image).expect("the image runs");
    let budgets = Budgets::read().expect("budgets.toml").instructions;
    assert!(
        counts.keys().eq(budgets.keys()),
        "measured {:?}, budgets for {:?}",
        counts.keys(),
        budgets.keys()
    );
    let committed = Committed::read("works").expect("docs/figures");
    for (name, count) in counts {
        let near = committed.near(&name, "instructions", count);
        near.expect("the figure of the pages");
        assert!(
            count <= budgets[&name],
            "{name}: {count:.1} instructions, budget {}",
            budgets[&name]
        );
        let multiplications = if name.starts_with("activation") {
            5.0
        } else {
            54.0
        };
        assert!(
            count > multiplications,
            "{name}: {count:.1} instructions cannot hold {multiplications} multiplications; was it optimised away?"
        );
    }
}

#[test]
fn inference_cannot_panic() {
    let Some(image) = INFERENCE.build_or_skip() else {
        return;
    };
    let size = Size::of(&image).expect("an ELF file");
    assert!(size.panics.is_empty(), "{:?}", size.panics);
}

#[test]
fn boards_cannot_panic() {
    for image in [STM32F405, STM32F405_WINDOW, MPS2] {
        let Some(image) = image.build_or_skip() else {
            return;
        };
        let size = Size::of(&image).expect("an ELF file");
        assert!(size.panics.is_empty(), "{:?}", size.panics);
    }
}

/// A `bkpt` stops a board that has no debugger. Programs made for QEMU contain some, so the search
/// does find something.
#[test]
fn boards_have_no_semihosting() {
    let calls = |image: &std::path::Path| Size::of(image).expect("an ELF file").semihosting;
    for image in [STM32F405, STM32F405_WINDOW, MPS2] {
        let Some(image) = image.build_or_skip() else {
            return;
        };
        assert_eq!(calls(&image), 0, "{}", image.display());
    }
    let other = INFERENCE.build().expect("it was built for the test before");
    assert!(calls(&other) > 0);
}

/// Only the core can access core-coupled memory. It holds the learner's matrices and nothing else:
/// no DMA buffer and no stack.
#[test]
fn nothing_but_the_learner_is_in_core_coupled_memory() {
    let Some(image) = STM32F405.build_or_skip() else {
        return;
    };
    let bytes = std::fs::read(&image).expect("it was built");
    let size = Size::of(&image).expect("an ELF file");
    assert_eq!(size.in_coupled.len(), 1, "{:?}", size.in_coupled);
    let (name, learner) = &size.in_coupled[0];
    assert!(name.contains("ccm") && name.contains("LEARNER"), "{name}");
    assert_eq!(*learner, size.coupled, "a part of it has no name");
    for symbol in ["_stack_start", "_stack_end"] {
        let at = address(&bytes, symbol).expect("a symbol");
        assert!(
            (RAM_START..=RAM_START + RAM).contains(&at),
            "{symbol} {at:#x}"
        );
    }
}

#[test]
fn a_panic_in_an_image_is_found() {
    let Some(image) = DIFFERENT.build_or_skip() else {
        return;
    };
    let size = Size::of(&image).expect("an ELF file");
    assert!(!size.panics.is_empty(), "this image has a bounds check");
}
