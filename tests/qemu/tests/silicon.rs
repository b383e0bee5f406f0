//! The board's bench image: in QEMU, which has no cycle counter, it does every work and says that nothing was counted.

use std::thread;
use std::time::Duration;

use qemu::budget::Budgets;
use qemu::images::{BENCH, BOARDS, Board};
use qemu::live::Live;

#[test]
fn every_work_is_done_and_none_is_counted_without_a_counter() {
    let Some(image) = BENCH.build_or_skip() else {
        return;
    };
    let board = Board {
        image: BENCH,
        ..BOARDS[0]
    };
    let mut live = Live::start(board, &image).expect("it starts");
    let mut log = Vec::new();
    for _ in 0..600 {
        thread::sleep(Duration::from_millis(100));
        log = live
            .memory()
            .and_then(|memory| memory.log())
            .unwrap_or_default(); // not begun yet
        if log.last().is_some_and(|line| line == "done") {
            break;
        }
    }
    let [hello, counter, works @ .., _] = &log[..] else {
        panic!("{log:?}")
    };
    assert!(hello.contains("lrnn bench") && hello.contains("NotThere"));
    assert!(counter.contains("no cycle counter"), "{counter}");
    let mut done: Vec<_> = works
        .iter()
        .map(|line| line.strip_suffix(" done, not counted").expect(line))
        .collect();
    done.sort_unstable();
    let budgets = Budgets::read().expect("budgets.toml").instructions;
    assert!(budgets.keys().eq(&done), "{done:?}, {:?}", budgets.keys());
}
