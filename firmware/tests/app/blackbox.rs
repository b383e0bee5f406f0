//! The black box: what it holds, when it holds it, and that the stream goes on.

use crate::device::{Device, Mock, nets};
use firmware::app::blackbox::read::{Content, events, page};
use firmware::app::blackbox::{EventKind, LEN, Memory, PAGES};
use firmware::app::{App, Config};
use firmware::control::recording::{Cause, Order, Recording, State};
use firmware::control::{Mode, Reason};
use firmware::wire::command::{MAX_CHUNK, Request, Response, fault};
use firmware::wire::{Fields, ImuFormat};

const FORMAT: ImuFormat = ImuFormat::Hg4930;

fn config() -> Config {
    Config {
        format: Some(FORMAT),
        mode: Mode::Frozen,
        nets: nets([1e-5; 3], [1e-3; 3]),
        ..Config::default()
    }
}

/// A device that records in new memory.
fn recording(config: Config) -> Device<Mock> {
    let mut device = Device::new(config);
    device.app.record_in(Box::leak(Box::new(Memory::ZEROED)));
    device
}

fn frame(index: u32) -> Vec<u8> {
    let fields = Fields {
        index,
        gyro: [index as i32; 3],
        accel: [1000 + index as i32; 3],
        ..Fields::default()
    };
    let mut buffer = [0; 256];
    let len = (FORMAT.simulated()[0].emit)(&fields, &mut buffer).expect("room");
    buffer[..len].to_vec()
}

/// Feeds frames a millisecond apart and gives what came.
fn frames(device: &mut Device<Mock>, numbers: core::ops::Range<u32>) -> Vec<u8> {
    let mut came = Vec::new();
    for index in numbers {
        device.pass_us(1000);
        let frame = frame(index);
        device.feed(&frame);
        came.extend(frame);
    }
    came
}

fn recording_state(device: &mut Device<Mock>) -> Recording {
    device.ask(&Request::GetRecording, |answer| match answer {
        Response::Recording(recording) => recording,
        other => panic!("{other:?}"),
    })
}

fn read(device: &mut Device<Mock>) -> Vec<u8> {
    let mut all = Vec::new();
    while all.len() < LEN {
        let request = Request::ReadRecording {
            offset: all.len() as u32,
            length: MAX_CHUNK as u16,
        };
        device.ask(&request, |answer| match answer {
            Response::Image { bytes, .. } => all.extend_from_slice(bytes),
            other => panic!("{other:?}"),
        });
    }
    all
}

#[test]
fn without_memory_there_is_none() {
    let mut device = Device::new(config());
    for request in [
        Request::GetRecording,
        Request::Record(Order::Hold),
        Request::Record(Order::Release),
    ] {
        device.ask(&request, |answer| {
            assert_eq!(answer, Response::Refused(Reason::Unsupported));
        });
    }
}

/// It holds the last frames unchanged, up to the last one, and can be read only while it holds.
#[test]
fn the_last_frames_are_held_unchanged() {
    let mut device = recording(config());
    let came = frames(&mut device, 0..300);
    let piece = Request::ReadRecording {
        offset: 0,
        length: 16,
    };
    device.ask(&piece, |answer| {
        assert_eq!(answer, Response::Refused(Reason::NotAvailable));
    });
    device.order(&Request::Record(Order::Hold));
    let held = recording_state(&mut device);
    assert_eq!((held.state, held.cause), (State::Holds, Cause::Request));
    let memory = read(&mut device);
    let mut pages: Vec<_> = (0..PAGES).filter_map(|n| page(&memory, n)).collect();
    pages.sort_by_key(|page| page.number);
    assert_eq!(pages.len(), PAGES);
    let mut pieces = Vec::new();
    for page in &pages {
        for entry in page.entries() {
            if let Content::Piece(_, bytes) = entry.content {
                pieces.extend_from_slice(bytes);
            }
        }
    }
    assert!(pieces.len() >= 24 * 44, "{} bytes", pieces.len());
    assert!(came.ends_with(&pieces));
}

/// Holding, reading and releasing lose no byte of the stream and change none.
#[test]
fn the_stream_goes_on_while_it_is_read() {
    let (mut device, mut plain) = (recording(config()), Device::new(config()));
    for second in 0..5 {
        let numbers = second * 100..second * 100 + 100;
        for device in [&mut device, &mut plain] {
            frames(device, numbers.clone());
        }
        device.order(&Request::Record(Order::Hold));
        read(&mut device);
        device.order(&Request::Record(Order::Release));
        plain.time.set(device.time.get());
        plain.settle();
    }
    assert_eq!(
        device.lines.navigation.bytes(),
        plain.lines.navigation.bytes()
    );
    assert_eq!(recording_state(&mut device).state, State::Records);
}

/// The first fault is held with the records before and after it. Later faults do not replace it.
#[test]
fn the_first_fault_is_held() {
    let mut device = recording(config());
    frames(&mut device, 0..100);
    let before = recording_state(&mut device);
    assert_eq!((before.state, before.cause), (State::Records, Cause::None));
    device.wait_ms(200); // silent
    let at = recording_state(&mut device);
    assert_eq!((at.state, at.cause), (State::Follows, Cause::Fault));
    assert_eq!(at.faults, fault::SILENT);
    frames(&mut device, 100..400);
    let after = recording_state(&mut device);
    assert_eq!((after.state, after.faults), (State::Holds, fault::SILENT));
    assert!(after.pages <= before.pages + 3, "{after:?}");
    device.wait_ms(200);
    frames(&mut device, 400..500);
    assert_eq!(recording_state(&mut device), after);
    let memory = read(&mut device);
    let faults = |memory: &[u8]| {
        events(memory)
            .filter(|e| e.what == EventKind::Faults)
            .count()
    };
    assert_eq!(faults(&memory), 2, "silent, and heard again");
    device.order(&Request::Record(Order::Release));
    frames(&mut device, 500..600);
    assert!(recording_state(&mut device).pages > after.pages);
}

/// A reset leaves what was recorded until then, and garbage in the memory is none.
#[test]
fn a_reset_is_survived_and_garbage_is_not_believed() {
    let mut memory = Memory::ZEROED;
    let mut bytes = vec![0; LEN];
    for (n, state) in [State::Records, State::Holds].into_iter().enumerate() {
        let mut device: Device<Mock> = Device::new(config());
        let mut app = App::new(config());
        app.record_in(&mut memory);
        let mut now = 0;
        for index in 0..100 {
            device.lines.sensor.input.extend(frame(index));
            now += 1000;
            device.time.set(now);
            while app.poll(&mut device.lines, &device.time) {}
        }
        app.hold_recording();
        assert_eq!(
            app.read_recording(0, &mut bytes),
            Some(LEN),
            "start {n}, {state:?}"
        );
    }
    let starts: Vec<u32> = events(&bytes)
        .filter(|event| event.what == EventKind::Start)
        .map(|event| event.value)
        .collect();
    assert_eq!(starts, [0, 1]);
    let mut device: Device<Mock> = Device::new(config());
    let mut app = App::new(config());
    app.record_in(&mut memory);
    app.poll(&mut device.lines, &device.time);
    assert_eq!(app.read_recording(0, &mut bytes), Some(LEN), "it holds");
    drop(app);
    let mut garbage = Memory::ZEROED;
    garbage.fill(0xA5);
    let mut app = App::new(config());
    app.record_in(&mut garbage);
    assert_eq!(app.read_recording(0, &mut bytes), None, "it records");
}

fn pages_of(memory: &[u8]) -> Vec<firmware::app::blackbox::read::Page<'_>> {
    let mut pages: Vec<_> = (0..PAGES).filter_map(|n| page(memory, n)).collect();
    pages.sort_by_key(|page| page.number);
    pages
}

fn ends(page: &firmware::app::blackbox::read::Page) -> bool {
    page.entries().any(|entry| entry.content == Content::Break)
}

/// Bytes that come before the first frame are part of no page.
#[test]
fn what_comes_before_the_first_frame_is_no_page() {
    let mut device = recording(config());
    for byte in 0..=255 {
        device.pass_us(1000);
        device.feed(&[byte; 3]);
    }
    device.order(&Request::Record(Order::Hold));
    let memory = read(&mut device);
    let blank = &memory[LEN - PAGES * 704..];
    assert!(blank.iter().all(|byte| *byte == 0), "{blank:?}");
}

/// A page says that it ends where the mode changes, also when the next frame begins a page anyway.
#[test]
fn a_page_ends_where_the_mode_changes() {
    let mut full = 0;
    for count in 60..90 {
        let mut device = recording(config());
        let halves = |device: &mut Device<Mock>, index: u32, between: Option<Mode>| {
            let frame = frame(index);
            device.pass_us(500);
            device.feed(&frame[..20]);
            if let Some(mode) = between {
                device.order(&Request::SetMode(mode));
            }
            device.pass_us(500);
            device.feed(&frame[20..]);
        };
        (0..count).for_each(|index| halves(&mut device, index, None));
        let before = recording_state(&mut device).pages;
        halves(&mut device, count, Some(Mode::Bypass));
        (1..5).for_each(|more| halves(&mut device, count + more, None));
        device.order(&Request::Record(Order::Hold));
        let memory = read(&mut device);
        let pages = pages_of(&memory);
        let old = pages.iter().find(|page| page.number == before).expect("it");
        assert_eq!(old.key.mode, Mode::Frozen);
        assert_eq!(pages.last().expect("pages").key.mode, Mode::Bypass);
        assert!(ends(old), "{count} frames");
        full += u32::from(old.entries().count() > 15);
    }
    assert!(full > 0);
}

/// A page says that it ends where bytes found no room on it.
#[test]
fn a_page_ends_where_its_room_does() {
    let mut device = recording(config());
    frames(&mut device, 0..50);
    let before = recording_state(&mut device).pages;
    for _ in 0..200 {
        device.pass_us(100);
        device.feed(&[0x55; 5]);
    }
    frames(&mut device, 50..52);
    device.order(&Request::Record(Order::Hold));
    let memory = read(&mut device);
    let pages = pages_of(&memory);
    let old = pages.iter().find(|page| page.number == before).expect("it");
    assert!(ends(old));
    assert!(pages.iter().any(|page| page.number > before));
}
