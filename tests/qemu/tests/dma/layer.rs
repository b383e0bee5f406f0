//! The STM32F405 over `embassy-stm32` (`firmware/boards/f405`) in the same model, beside the board
//! with drivers of its own: the same bytes, other interrupts, other latency. docs/BOARDS.md draws
//! its conclusions from these measurements.

use std::path::Path;

use qemu::boards::Family;

use super::*;

/// Interrupts: the navigation computer's UART, and TIM5, the timer of `embassy-time`.
const NAVIGATION: i32 = 38;
const TIME: i32 = 50;
// DMA2 streams 0 and 3, which move the bytes of an ADIS.
const SPI_IN: i32 = 56;
const SPI_OUT: i32 = 59;
/// Software interrupts that run the frame path: PendSV, less 16, and CAN1_SCE.
const FRAME_PATHS: [i32; 2] = [-2, 22];

/// Hardware interrupts per frame.
fn interrupts(done: &Done, frames: &[Record]) -> f64 {
    let by_hardware = done
        .served
        .iter()
        .filter(|(of, _)| !FRAME_PATHS.contains(of));
    by_hardware.map(|(_, count)| *count).sum::<usize>() as f64 / frames.len() as f64
}

/// From the last byte of a frame to the first byte sent, microseconds: the median and the maximum.
/// The first frames, which are held until the format is known, do not count.
fn latencies(done: &Done, frames: &[Record]) -> [f64; 2] {
    assert_eq!(done.came.len(), done.left.len(), "as many bytes leave");
    let (mut late, mut begin) = (Vec::new(), 0);
    for frame in frames {
        let end = begin + frame.bytes.len();
        late.push(done.left[begin] - done.came[end - 1]);
        begin = end;
    }
    let mut late = late.split_off(frames.len() / 4);
    late.sort_by(f64::total_cmp);
    [late[late.len() / 2], late[late.len() - 1]].map(|cycles| cycles / 168.0)
}

/// Runs an image over frames of a format and prints what it costs.
fn measured(
    name: &str,
    python: &Path,
    image: &Path,
    frames: &[Record],
    period: u32,
) -> (Done, [f64; 2]) {
    let set_up = set_up().expect("requests");
    let none = serde_json::Value::Null;
    let done = run(python, image, &set_up, frames, (period, BAUD), &none);
    let expected = desktops(frames);
    assert!(
        done.sent == expected,
        "{name}: {} of {} bytes",
        done.sent.len() / 2,
        expected.len() / 2
    );
    let late = latencies(&done, frames);
    println!(
        "{name}: {:.2} interrupts a frame, latency {:.1} us, at most {:.1} us; {:?}",
        interrupts(&done, frames),
        late[0],
        late[1],
        done.served
    );
    (done, late)
}

/// For each frame the sensor line interrupts once, when it falls idle, its stream never, and the
/// output stream at most once. The other interrupts are timers. A frame leaves no later than with
/// the driver's buffered UART, which had no DMA and did not wait for an idle line.
#[test]
fn the_same_bytes_as_our_drivers_at_an_interrupt_a_frame() {
    let layer = Family::named("f405").expect("a board");
    let (Some(python), Some(ours)) = (python(), STM32F405_WINDOW.build_or_skip()) else {
        return;
    };
    let theirs = layer.build().expect("it builds");
    for (format, period, buffered_us) in [
        (ImuFormat::Stim300, MILLISECOND - 210, 21.4),
        (ImuFormat::Kvh, MILLISECOND / 2, 25.6),
    ] {
        let mut frames = frames(format, 1);
        frames.truncate(250);
        let (ours, soon) = measured("ours", &python, &ours, &frames, period);
        let (theirs, late) = measured("theirs", &python, &theirs, &frames, period);
        assert_eq!(ours.sent, theirs.sent);
        assert_eq!(ours.served(SENSOR) + ours.served(NAVIGATION), 0);
        let count = frames.len();
        assert_eq!(theirs.served(SENSOR), count, "{:?}", theirs.served);
        assert_eq!(theirs.served(SENSOR_IN), 0, "{:?}", theirs.served);
        assert_eq!(theirs.served(NAVIGATION), 0, "{:?}", theirs.served);
        let out = theirs.served(NAVIGATION_OUT);
        assert!(out <= count && out > count / 2, "{:?}", theirs.served);
        assert!(theirs.served(TIME) > 0);
        assert!(interrupts(&theirs, &frames) < 5.0, "{:?}", theirs.served);
        // the reason for our own drivers on this board: when this fails, review docs/BOARDS.md
        assert!(
            soon[0] < 15.0 && late[0] > soon[0] + 9.0,
            "{soon:?} {late:?}"
        );
        assert!(late[0] <= buffered_us, "{late:?}");
        // no frame waits for a look for an ADIS, once frames come: the streams of the SPI rest
        assert_eq!(
            theirs.served(SPI_IN) + theirs.served(SPI_OUT),
            0,
            "{:?}",
            theirs.served
        );
        assert!(late[1] <= buffered_us + 5.0, "{late:?}");
    }
}

/// Without its crystal each board runs on the internal oscillator. The driver of `embassy-stm32`
/// alone would wait for it forever.
#[test]
fn a_dead_crystal_stops_neither() {
    let layer = Family::named("f405").expect("a board");
    let (Some(python), Some(ours)) = (python(), STM32F405_WINDOW.build_or_skip()) else {
        return;
    };
    let theirs = layer.build().expect("it builds");
    let frames = frames(ImuFormat::Stim300, 1);
    let frames = &frames[..20];
    let dead = serde_json::json!({"chip": {"crystal": 0}});
    let all: String = frames.iter().map(|frame| hex(&frame.bytes)).collect();
    for image in [ours, theirs] {
        let done = run_in(&python, &image, &[], frames, (MILLISECOND, BAUD), &dead);
        assert_eq!(done.sent, all, "{}", image.display());
    }
}

/// The examples with a user's own main loop pass the input, byte for byte.
#[test]
fn loops_of_ones_own_pass_bytes() {
    let Some(python) = python() else { return };
    let frames = frames(ImuFormat::Stim300, 1);
    let frames = &frames[..50];
    let all: String = frames.iter().map(|frame| hex(&frame.bytes)).collect();
    for example in ["loop-embassy", "loop-rtic"] {
        let image = qemu::boards::build(example, qemu::images::TARGET).expect("it builds");
        let none = serde_json::Value::Null;
        let done = run(
            &python,
            &image,
            &[],
            frames,
            (4 * MILLISECOND, 460_800),
            &none,
        );
        assert!(
            done.sent == all,
            "{example}: {} of {}",
            done.sent.len(),
            all.len()
        );
    }
}
