//! One target, guided by branch coverage: `cargo xtask fuzz --targets`.
//!
//! All targets are in one program, so that it is linked once. The environment variable
//! `FUZZ_TARGET` names the one. The arguments are those of libFuzzer.
#![no_main]

use fuzz::{TARGETS, Target};
use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;

fn target() -> &'static Target {
    static TARGET: OnceLock<&Target> = OnceLock::new();
    TARGET.get_or_init(|| {
        let name = std::env::var("FUZZ_TARGET").expect("FUZZ_TARGET names a target");
        let target = TARGETS.iter().find(|target| target.name == name);
        target.unwrap_or_else(|| panic!("there is no target {name}"))
    })
}

fuzz_target!(|input: &[u8]| {
    (target().run)(input);
});
