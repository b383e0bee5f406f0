//! The arithmetic of the networks is the same on all machines, and an image's exit code shows a
//! failure.

use std::time::Duration;

use qemu::images::{AGREEMENT, BOARDS, DIFFERENT, Image};
use qemu::machine::{self, Clock, Machine, NETDUINOPLUS2, Run};

fn run(image: Image, machine: Machine) -> Option<Run> {
    let image = image.build_or_skip()?;
    Some(
        machine::run(machine, &image, Clock::Free, Duration::from_secs(60))
            .expect("QEMU runs the image to its end"),
    )
}

#[test]
fn target_agrees_with_the_desktop_bit_for_bit() {
    for board in BOARDS {
        let Some(run) = run(AGREEMENT, board.machine) else {
            return;
        };
        assert_eq!(run.code, Some(0), "{}: {}", board.name, run.output);
        let equal = run
            .output
            .lines()
            .filter(|line| line.ends_with("equal"))
            .count();
        assert_eq!(equal, 9, "{}: {}", board.name, run.output);
    }
}

#[test]
fn one_wrong_bit_gives_a_non_zero_exit_code() {
    let Some(run) = run(DIFFERENT, NETDUINOPLUS2) else {
        return;
    };
    assert_eq!(run.code, Some(1), "{}", run.output);
    let first = run.output.lines().next().unwrap_or_default();
    assert!(first.ends_with("DIFFERENT"), "{}", run.output);
}

#[test]
fn an_image_that_hangs_is_killed() {
    let Some(image) = AGREEMENT.build_or_skip() else {
        return;
    };
    let error = machine::run(NETDUINOPLUS2, &image, Clock::Free, Duration::ZERO)
        .expect_err("no program is that fast");
    assert!(error.to_string().contains("still running"), "{error}");
}
