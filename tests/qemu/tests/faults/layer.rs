//! The board `f405` over the drivers of `embassy-stm32` with the same faults.

use qemu::boards::Family;

use super::*;

/// The interrupt of the frame path's executor, CAN1_SCE.
const FRAME_PATH: i32 = 22;

/// A panic, a fault and a frame path that is stuck leave a record, and bytes pass after each reset.
/// SysTick detects that the loop has not run for 6 s, which a clock that is 84 times too fast
/// shortens. After three short runs the fourth start is a safe one.
#[test]
fn a_board_over_embassy_keeps_the_record_of_a_crash() {
    let board = Family::named("f405").expect("a board");
    let Some(tools) = python().map(|python| (python, board.build().expect("it builds"))) else {
        return;
    };
    for (faults, kind) in [
        (json!([[60, "wild", 0x6000_0000]]), CrashKind::Fault),
        (json!([[60, "torn", 0]]), CrashKind::Panic),
        (json!([[60, "overflow", 0]]), CrashKind::StackOverflow),
        (
            json!([[60, "tim5", 84], [60, "endless", FRAME_PATH]]),
            CrashKind::NotFed,
        ),
    ] {
        let done = run(&tools, json!({"ms": 420, "faults": faults}), &[400]);
        done.passes();
        assert_eq!(done.starts.len(), 2, "{kind:?}");
        let reset = done.reset();
        assert_eq!(reset.causes & !cause::PIN, cause::SOFTWARE, "{kind:?}");
        assert_eq!(
            (reset.clock, reset.core_hz),
            (ClockSource::Crystal, 168_000_000)
        );
        let crash = reset.crash.expect("a record");
        assert_eq!((crash.kind, crash.number, crash.starts), (kind, 1, 1));
        match kind {
            CrashKind::Fault => assert_eq!((crash.pc, crash.hfsr), (0x6000_0000, 1 << 30)),
            CrashKind::NotFed => assert_eq!(crash.pc >> 20, 0x80, "{crash:?}"),
            _ => assert_eq!(crash.pc, 0, "{crash:?}"),
        }
    }
    let wild = |at: u32| json!([at, "wild", 0x6000_0000]);
    let faults = json!([wild(60), wild(120), wild(180)]);
    let done = run(&tools, json!({"ms": 340, "faults": faults}), &[320]);
    done.passes();
    assert!(done.reset().safe, "{:?}", done.reset());
    assert_ne!(done.faults() & fault::SAFE_START, 0);
}
