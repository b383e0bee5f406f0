//! `host-sim hil` with the boards' own images in QEMU at the other end of its ports.

use std::sync::atomic::AtomicBool;

use firmware::configuration::Configuration;
use firmware::wire::ImuFormat;
use host_device::hil::{Control, Setup, run};
use qemu::images::{BOARDS, Board};
use qemu::listening::Listening;

fn setup(board: &Listening, format: ImuFormat, seconds: u32) -> Setup {
    let [imu, nav, gnss, command] = board.ports.clone();
    Setup {
        imu,
        nav,
        gnss: Some(gnss),
        command: Some(command),
        key: None,
        baud: 921_600,
        configuration: Configuration::default(),
        format,
        errors: None,
        seconds,
        fast: true,
    }
}

fn runs(board: Board, formats: &[(ImuFormat, u32)]) {
    let Some(image) = board.image.build_or_skip() else {
        return;
    };
    let listening = Listening::start(board, &image).expect("QEMU listens");
    let control = Control {
        stop: &AtomicBool::new(false),
        progress: &|_, _| {},
    };
    let mut known = false;
    // One after the other on the same board, which has to detect each format by itself.
    for (format, seconds) in formats {
        let report = run(&setup(&listening, *format, *seconds), control).expect("it runs");
        let what = format!("{}, {format:?}: {report:?}", board.name);
        assert!(report.corrected && report.verdict.equal, "{what}");
        assert!(report.verdict.navigation_equal, "{what}");
        assert!(
            report.verdict.expected > 400 && report.verdict.counter_errors == 0,
            "{what}"
        );
        assert_eq!(report.fixes, Some(*seconds), "{what}");
        if let Some(busiest) = report.busiest_percent {
            assert!(busiest > 0.0 && busiest <= 100.0, "{what}");
            known = true;
        }
        assert!(
            report.latency.is_some_and(|latency| latency.min_ms > 0.0),
            "{what}"
        );
    }
    // not before the board's first second is over
    assert!(known || formats.len() == 1, "how busy the processor is");
}

#[test]
fn the_stm32f405_runs_every_format_on_one_board() {
    // so long that more than 400 samples come after the first second
    let seconds = |format: ImuFormat| 3 + 400 / format.simulated()[0].rate;
    let mut drives: Vec<_> = ImuFormat::ALL
        .map(|format| (format, seconds(format)))
        .into();
    drives.push((ImuFormat::Stim300, 3));
    runs(BOARDS[0], &drives);
}

#[test]
fn another_board_does_the_same() {
    runs(BOARDS[1], &[(ImuFormat::Stim300, 3)]);
}

#[test]
fn without_a_command_link_everything_passes_unchanged() {
    let Some(image) = BOARDS[0].image.build_or_skip() else {
        return;
    };
    let listening = Listening::start(BOARDS[0], &image).expect("QEMU listens");
    let mut setup = setup(&listening, ImuFormat::Stim300, 3);
    (setup.command, setup.gnss) = (None, None);
    let control = Control {
        stop: &AtomicBool::new(false),
        progress: &|_, _| {},
    };
    let report = run(&setup, control).expect("it runs");
    assert!(report.verdict.equal && !report.corrected, "{report:?}");
    assert_eq!(
        (report.silences, report.fixes, report.firmware),
        (None, None, None)
    );
}
