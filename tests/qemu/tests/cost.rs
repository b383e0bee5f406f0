//! What the images cost, against `budgets.toml`.

use qemu::budget::Budgets;
use qemu::count;
use qemu::images::{DIFFERENT, INFERENCE, INSTRUCTIONS};
use qemu::size::Size;

#[test]
fn a_loop_of_known_length_is_counted_exactly() {
    let Some(image) = INSTRUCTIONS.build_or_skip() else {
        return;
    };
    let (known, _) = count::run(&image).expect("the image runs");
    known.check().expect("within two ticks");
}

#[test]
fn instructions_are_within_budget() {
    let Some(image) = INSTRUCTIONS.build_or_skip() else {
        return;
    };
    let (_, counts) = count::run(&image).expect("the image runs");
    let budgets = Budgets::read().expect("budgets.toml").instructions;
    assert!(
        counts.keys().eq(budgets.keys()),
        "measured {:?}, budgets for {:?}",
        counts.keys(),
        budgets.keys()
    );
    for (name, count) in counts {
        assert!(
            count <= budgets[&name],
            "{name}: {count:.1} instructions, budget {}",
            budgets[&name]
        );
        assert!(
            count > 200.0,
            "{name}: {count:.1} instructions cannot hold 54 multiplications; was it optimised away?"
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
fn a_panic_in_an_image_is_seen() {
    let Some(image) = DIFFERENT.build_or_skip() else {
        return;
    };
    let size = Size::of(&image).expect("an ELF file");
    assert!(!size.panics.is_empty(), "this image has a bounds check");
}
