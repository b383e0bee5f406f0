//! Whether the watchdogs are fed: a fault that is known and handled is no reason to restart; a part
//! that does not run is one.

use crate::device::{Device, nets};
use crate::frames::{Kind, kinds};
use crate::record::{HARDWARE, configured};
use firmware::app::{App, Config, Hardware};
use firmware::configuration::SerialLines;
use firmware::configuration::record::encode;
use firmware::control::{Mode, Reason};
use firmware::link::rates::Clock;
use firmware::model::Nets;
use firmware::store::{Content, Store};
use firmware::wire::command::{
    ClockSource, Crystal, Request, Reset, Response, cause, fault, unwell,
};

pub const START: Reset = Reset {
    causes: cause::WATCHDOG | cause::PIN,
    uptime_ms: 0,
    safe: false,
    clock: ClockSource::Crystal,
    core_hz: 168_000_000,
    crystal: Crystal {
        built_mhz: 12,
        used_mhz: 12,
        measured_khz: 12_000,
    },
    command_baud: 913_043,
    brown_out: Some(3),
    supply_low: false,
    reopened: 0,
    crash: None,
};

fn board(reset: Reset) -> Hardware {
    Hardware {
        reset: Some(reset),
        ..HARDWARE
    }
}

/// Runs the main loop for `ms` milliseconds. Returns the bits of parts that are unhealthy.
fn turns(device: &mut Device, ms: u64) -> u8 {
    let mut bits = 0;
    for _ in 0..ms {
        device.pass_us(1000);
        device.settle();
        bits |= device.app.unwell(device.time.get());
    }
    bits
}

#[test]
fn a_sensor_that_is_silent_or_speaks_nonsense_is_handled() {
    let mut device = Device::new(Config::unconfigured(board(START)));
    assert_eq!(turns(&mut device, 5000), 0, "never connected");
    for n in 0..5000u32 {
        device.feed(&n.wrapping_mul(2_654_435_761).to_le_bytes());
        assert_eq!(turns(&mut device, 1), 0, "nonsense");
    }
    assert_eq!(turns(&mut device, 5000), 0, "silent again");
    for kind in kinds() {
        let mut device = Device::new(kind.config());
        for frame in kind.stream(0, 300) {
            device.feed(&frame);
            assert_eq!(turns(&mut device, 1), 0, "{kind:?}");
        }
        assert_eq!(turns(&mut device, 3000), 0, "{kind:?} falls silent");
    }
}

/// One byte just before it would be silence: a frame takes long, and nothing leaves meanwhile.
#[test]
fn the_slowest_bytes_are_handled() {
    let mut device = Device::new(Config::unconfigured(board(START)));
    for n in 0..700u32 {
        device.feed(&[n as u8]);
        assert_eq!(turns(&mut device, 90), 0, "{n}");
    }
}

/// A loop that no longer calls the application.
#[test]
fn an_application_that_does_not_run_is_unhealthy() {
    let mut device = Device::new(Config::unconfigured(board(START)));
    assert_eq!(turns(&mut device, 10), 0);
    let now = device.time.get();
    assert_eq!(device.app.unwell(now + 900_000), 0);
    // nobody noticed the silence, and nobody served the links
    let bits = device.app.unwell(now + 1_200_000);
    assert_eq!(bits, unwell::WORDS | unwell::LINKS);
    assert_eq!(turns(&mut device, 200), 0, "well again");
}

fn ask(device: &mut Device) -> Reset {
    let mut reset = None;
    device.ask(&Request::GetReset, |answer| match answer {
        Response::Reset(answer) => reset = Some(answer),
        other => panic!("{other:?}"),
    });
    reset.expect("an answer")
}

#[test]
fn the_start_is_reported_with_the_present_state() {
    let mut device = Device::new(Config::unconfigured(board(START)));
    turns(&mut device, 1500);
    device.app.board_is(true, 3);
    let reset = ask(&mut device);
    assert!((1500..1600).contains(&reset.uptime_ms), "{reset:?}");
    let expected = Reset {
        uptime_ms: reset.uptime_ms,
        supply_low: true,
        reopened: 3,
        ..START
    };
    assert_eq!(reset, expected);
    assert_ne!(device.app.faults() & fault::SUPPLY, 0);
    device.app.board_is(false, 3);
    assert_eq!(device.app.faults() & fault::SUPPLY, 0);
}

/// Clocks and lines as they are: 16 MHz cannot make 921 600 bit/s within 2 %.
#[test]
fn clock_and_bit_rates_are_faults() {
    let bits = |clock, used_mhz, hz| {
        let crystal = Crystal {
            used_mhz,
            ..START.crystal
        };
        let hardware = Hardware {
            clocks: [Clock::stm32(hz); 3],
            ..board(Reset {
                clock,
                crystal,
                ..START
            })
        };
        Device::new(Config::unconfigured(hardware)).app.faults() & (fault::CLOCK | fault::BIT_RATE)
    };
    assert_eq!(bits(ClockSource::Crystal, 12, 42_000_000), 0);
    assert_eq!(bits(ClockSource::Crystal, 8, 42_000_000), fault::CLOCK);
    assert_eq!(bits(ClockSource::Internal, 0, 42_000_000), fault::CLOCK);
    let both = fault::CLOCK | fault::BIT_RATE;
    assert_eq!(bits(ClockSource::InternalDirect, 0, 16_000_000), both);
    assert_eq!(bits(ClockSource::Simulator, 0, 42_000_000), 0);
}

/// A UART with a list of rates, beside a line of which nothing is known: no other rate is taken,
/// and the one that is there is named and reported.
#[test]
fn a_rate_that_is_not_in_the_list_is_refused() {
    let hardware = Hardware {
        clocks: [
            Clock::of(16_000_000, &[457_143, 941_176, 1_000_000]),
            Clock::ANY,
            Clock::ANY,
        ],
        ..Hardware::DESKTOP
    };
    let lines = |sensor_baud| SerialLines {
        sensor_baud,
        ..SerialLines::DEFAULT
    };
    for (asked, there) in [
        (500_000, 457_143),
        (921_600, 941_176),
        (1_500_000, 1_000_000),
    ] {
        assert_eq!(hardware.check(&lines(asked)), Err(Reason::Baud(there)));
    }
    assert_eq!(hardware.check(&lines(460_800)), Ok(()));
    assert_eq!(hardware.bauds(&lines(460_800)), [457_143, 0, 0]);
}

/// A safe start passes bytes at the configured lines, in bypass, without the stored networks, and
/// leaves the store alone.
#[test]
fn a_safe_start_uses_no_stored_weights() {
    let mut configuration = configured(Kind::STIM);
    configuration.lines.sensor_baud = 460_800;
    configuration.correction.mode = Mode::Frozen;
    let nets = nets([1e-5; 3], [0.0; 3]);
    let record = encode(&configuration);
    let content = Content::new(&nets, &record);
    let mut store = Store::new(crate::stored::blank()).expect("room");
    assert!(store.save(&content).is_ok());
    for safe in [false, true] {
        let hardware = board(Reset { safe, ..START });
        let app = App::power_on(hardware, Some(store.load()), None);
        assert_eq!(app.nets().same_images(&Nets::NONE), safe);
        assert_eq!(app.faults() & fault::SAFE_START != 0, safe);
        let mut device = Device::new(Config::default());
        device.app = app;
        let lines = device.app.to_open();
        assert_eq!(lines.map(|lines| lines.sensor_baud), Some(460_800));
        let frames = Kind::STIM.stream(0, 50);
        for frame in &frames {
            device.feed(frame);
        }
        let unchanged = device.lines.navigation.bytes() == frames.concat();
        assert_eq!(unchanged, safe, "stored networks correct from power-on on");
        let mode = device.ask(&Request::GetHealth, |answer| match answer {
            Response::Health(health) => health.mode,
            other => panic!("{other:?}"),
        });
        assert_eq!(mode, if safe { Mode::Bypass } else { Mode::Frozen });
        device.ask(&Request::StoreImage, |answer| {
            let why = if safe {
                Reason::Unsupported
            } else {
                Reason::Mode
            };
            assert_eq!(answer, Response::Refused(why));
        });
    }
}
