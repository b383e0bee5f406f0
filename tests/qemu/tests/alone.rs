//! `lrnn-nostd` in a crate of its own: the same bits on every core, and what it costs at every
//! level of optimisation.

use std::time::Duration;

use qemu::alone::{CORES, LEVELS, M4F, REFERENCE, SMALL, example, missing};
use qemu::budget::Budgets;
use qemu::count::Counts;
use qemu::images::here_or_skip;
use qemu::machine::{self, Clock};
use qemu::size::Size;

/// Pieces of work that no level of optimisation may make slower. `learn` has a limit of its own.
const WORKS: [&str; 3] = ["step", "gradient", "descent"];
/// Activations of the hidden layers.
const HIDDEN: [&str; 3] = ["rational", "tanh", "cubic"];

#[test]
fn every_core_has_the_bits_of_the_desktop_and_keeps_its_budget() {
    if !here_or_skip(missing()) {
        return;
    }
    let budgets = Budgets::read().expect("budgets.toml").alone.core;
    assert_eq!(budgets.len(), CORES.len(), "{budgets:?}");
    for core in CORES {
        let built = core.build(SMALL).expect("it builds");
        let run = built.agreement().expect("QEMU runs it to its end");
        assert_eq!(run.code, Some(0), "{}: {}", core.name, run.output);
        let equal = run.output.lines().filter(|line| line.ends_with("equal"));
        assert_eq!(equal.count(), 8, "{}: {}", core.name, run.output);

        let counts = built.count().expect("it counts");
        let flash = built.flash().expect("ELF files");
        let (step, descent) = (counts["step_rational"], counts["descent_rational"]);
        let budget = budgets[core.name];
        println!("{}: {step:.0} {descent:.0} {flash:?}", core.name);
        assert!(step <= budget.step, "{}: {step:.1}", core.name);
        assert!(descent <= budget.descent, "{}: {descent:.1}", core.name);
        assert!(
            flash.step <= budget.step_flash && flash.descent <= budget.descent_flash,
            "{}: {flash:?}",
            core.name
        );
        assert!(step > 54.0 && descent > 500.0 && flash.descent > flash.step);
    }
}

/// The example that users copy learns, and prints the result.
#[test]
fn the_example_for_a_cortex_m_runs() {
    if !here_or_skip(missing()) {
        return;
    }
    let image = example().expect("it builds");
    let run = machine::run(M4F.machine, &image, Clock::Free, Duration::from_secs(60));
    let run = run.expect("QEMU runs it to its end");
    assert_eq!(run.code, Some(0), "{}", run.output);
    assert!(run.output.contains("2.06 deg/h of 2.06"), "{}", run.output);
}

#[test]
fn the_cost_does_not_depend_on_the_level_of_optimisation() {
    if !here_or_skip(missing()) {
        return;
    }
    let budget = Budgets::read().expect("budgets.toml").alone;
    let mut reference = Counts::new();
    for level in LEVELS {
        let built = M4F.build(level).expect("it builds");
        let run = built.agreement().expect("QEMU runs it to its end");
        assert_eq!(run.code, Some(0), "{level}: {}", run.output);
        let counts = built.count().expect("it counts");
        if level == REFERENCE {
            reference = counts.clone();
        }
        for hidden in HIDDEN {
            let limits = WORKS.map(|work| (work, budget.times));
            for (work, times) in limits.into_iter().chain([("learn", budget.learn_times)]) {
                let name = format!("{work}_{hidden}");
                let more = counts[&name] / reference[&name];
                println!("{level} {name}: {:.0}, {more:.2} times", counts[&name]);
                assert!(more <= times, "{level}: {name} takes {more:.2} times");
            }
        }
        for program in ["step", "descent"] {
            let size = Size::of(&built.program(program)).expect("an ELF file");
            assert!(size.panics.is_empty(), "{level}: {:?}", size.panics);
        }
    }
}
