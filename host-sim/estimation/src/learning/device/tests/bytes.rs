use super::super::*;
use firmware::wire::framer::Kind;
use firmware::wire::{Framer, ImuFormat};
use host_device::hil::{self, drive_configured, networks};
use host_unit::Unit as OfUnit;
use host_unit::sensor::FormatName;

/// Bytes in and out, with the same board, store and learner as [`Device::drive`].
struct Bytes {
    raw: Vec<Counts>,
    corrected: Vec<Counts>,
    fixes: Vec<(usize, Fix)>,
    stored_s: Vec<f64>,
    report: Report,
}

fn frames(framer: &mut Framer<ImuFormat>, bytes: &[u8], into: &mut Vec<Counts>) {
    for piece in bytes.chunks(64) {
        framer.push(piece);
        while let Some(event) = framer.next_event() {
            assert_eq!(event.kind(), Kind::Frame);
            let reading = event.frame().and_then(|frame| frame.read().ok());
            into.push(counts_of(reading.expect("a sample").sample));
        }
    }
}

fn by_bytes(configuration: &Configuration, flash: &mut MemoryFlash, of: &hil::Drive) -> Bytes {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut learner = FixLearner::new(&mut memory, Settings::of(configuration));
    let mut store = Store::new(core::mem::take(flash)).ok();
    let app = App::start_up(Hardware::DESKTOP, &mut store, true, Some(&mut learner));
    let mut app = Box::new(app);
    let mut lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine> = Lines::default();
    let mut clock = SetClock(0);
    let mut framers = [Framer::new(of.format), Framer::new(of.format)];
    let mut out = Bytes {
        raw: Vec::new(),
        corrected: Vec::new(),
        fixes: Vec::new(),
        stored_s: Vec::new(),
        report: Report::default(),
    };
    for record in &of.records {
        while clock.0 + TICK_US < u64::from(record.at_us) {
            clock.0 += TICK_US;
            while app.poll(&mut lines, &clock) {}
        }
        clock.0 = record.at_us.into();
        let known = app.counters().good_fixes;
        match record.input {
            hil::Input::Sensor => {
                frames(&mut framers[0], &record.bytes, &mut out.raw);
                lines.sensor.received.extend(&record.bytes);
            }
            hil::Input::Gnss => lines.gnss.received.extend(&record.bytes),
        }
        while app.poll(&mut lines, &clock) {}
        if app.counters().good_fixes != known {
            out.fixes.push((out.raw.len(), *app.fix().expect("a fix")));
        }
        while app.wants_to_store() {
            let mut done = false;
            app.store(|step, content| {
                let progress = store.as_mut().expect("room").carry_out(step, content);
                done = progress == Progress::Done;
                progress
            });
            if done {
                out.stored_s.push(clock.0 as f64 * 1e-6);
            }
        }
        frames(&mut framers[1], &lines.navigation.sent, &mut out.corrected);
        lines.navigation.sent.clear();
        lines.sensor.sent.clear();
    }
    out.report = app.learning();
    *flash = store.expect("room").into_inner();
    out
}

/// A unit whose stored networks correct wrongly, over three power-ons with fixes: the application
/// decides alike on bytes and on samples, to the last bit of every sample and of what it stores. In
/// the first drive it finds that the networks do harm, and stores that nothing corrects from the
/// next power-on on.
#[test]
fn bytes_and_samples_are_corrected_alike_over_power_ons() {
    let mut unit = OfUnit::preset("medium").unwrap();
    unit.sensor.format = FormatName::Novatel;
    let mut configuration = unit.configuration().unwrap();
    configuration.correction.mode = Mode::Learn;
    let mut device = Device::new(&configuration);
    device.store_nets(&networks());
    let mut flash = device.flash().clone();
    let mut corrected = Vec::new();
    for seconds in [[700, 60], [200, 10], [500, 30]] {
        let of = drive_configured(
            &configuration,
            ImuFormat::Novatel,
            &unit.simulated(),
            seconds,
        )
        .unwrap();
        let bytes = by_bytes(&configuration, &mut flash, &of);
        let drive = device.drive(&Input {
            samples: &bytes.raw.clone().into(),
            lsb: of.session.lsb,
            dt: of.session.dt,
            celsius: &[],
            missing: &[],
            fixes: &bytes.fixes,
            wheels: &[],
            alignment: &[],
        });
        assert!(bytes.fixes.len() > 150, "{}", bytes.fixes.len());
        assert_eq!(drive.corrected.len(), bytes.corrected.len());
        let differs = drive
            .corrected
            .iter()
            .zip(&bytes.corrected)
            .position(|(a, b)| a != b);
        assert_eq!(differs, None, "{seconds:?}");
        assert_eq!(drive.report, bytes.report);
        assert_eq!(drive.stored_s.len(), bytes.stored_s.len());
        assert_eq!(device.flash(), &flash, "{seconds:?}");
        let corrects = drive.corrected.iter().zip(&bytes.raw).any(|(a, b)| a != b);
        corrected.push((corrects, drive.in_force_since()));
    }
    assert_eq!(corrected, [(true, Some(0)), (false, None), (false, None)]);
}

/// What is wrong with a memory is said, and a good one is read back.
#[test]
fn a_memory_of_another_unit_is_refused_by_name() {
    let mut unit = OfUnit::preset("medium").unwrap();
    unit.serial = "A1".into();
    let own = unit.configuration().unwrap();
    let mut device = Device::new(&own);
    device.store_nets(&networks());
    let flash = device.flash().clone();
    let read = Device::of_flash(&own, flash.clone()).unwrap();
    assert_eq!(read.stored().0, networks());
    unit.serial = "B2".into();
    let other = unit.configuration().unwrap();
    let (problem, _) = Device::of_flash(&other, flash.clone()).unwrap_err();
    assert!(
        problem.contains("'A1'") && problem.contains("'B2'"),
        "{problem}"
    );
    // without serial numbers names are what is left
    unit.serial.clear();
    let nameless = unit.configuration().unwrap();
    let flash = Device::new(&nameless).flash().clone();
    assert!(Device::of_flash(&nameless, flash.clone()).is_ok());
    unit.name = "another".into();
    let other = unit.configuration().unwrap();
    let (problem, _) = Device::of_flash(&other, flash).unwrap_err();
    assert!(problem.contains("'another'"), "{problem}");
    let (problem, _) = Device::of_flash(&own, MemoryFlash::default()).unwrap_err();
    assert!(problem.contains("no good record"), "{problem}");
    let (problem, _) = Device::of_flash(&own, MemoryFlash(vec![0; 100])).unwrap_err();
    assert!(problem.contains("too short"), "{problem}");
}
