//! Activation `NextPowerOn`: stored networks act from the first word and stay, and what is learnt
//! meanwhile acts from the next power-on on.

use crate::frames::Kind;
use crate::record::{HARDWARE, configure, configured, record};
use crate::stored::Flash;
use crate::taught::{Bench, with};
use firmware::app::App;
use firmware::configuration::Configuration;
use firmware::configuration::record::{Record, encode};
use firmware::control::{Alignment, Mode};
use firmware::model::Nets;
use firmware::store::{Content, Store};
use firmware::wire::command::{Progress, Request, Response};

const KIND: Kind = Kind::RAWIMUSX;
/// Errors that were stored and that are learnt, m/s2.
const OLD: f32 = 1e-3;
const NEW: f32 = 2e-3;

fn unit() -> Configuration {
    let mut unit = configured(KIND);
    unit.correction.mode = Mode::Learn;
    unit.correction.limit.accel = 0.1;
    unit.correction.slew.accel = 1e-4;
    unit.correction.silence_us = 100_000;
    unit.correction.check_rate = false;
    unit
}

/// A store with these networks and this unit.
fn flash(nets: &Nets, unit: &Configuration) -> Flash {
    let mut store = Store::new(crate::stored::blank()).expect("room");
    let record = encode(unit);
    store.save(&Content::new(nets, &record)).expect("stored");
    store.into_inner()
}

/// The device after power-on; it navigates.
fn powered(flash: &Flash) -> Bench {
    let mut store = Store::new(flash.clone()).expect("room");
    let stored = Some(store.load());
    let bench = Bench::of(KIND, |learner| {
        App::power_on(HARDWARE, stored, Some(learner))
    });
    bench.says.navigates.set(true);
    bench
}

/// Content that the device wants to store now.
fn wanted(bench: &mut Bench) -> Option<(Nets, Record)> {
    let mut got = None;
    bench.device.app.store(|_, content| {
        got = Some((*content.nets, content.record.clone()));
        true
    });
    got
}

fn near(correction: f64, error: f32, bench: &Bench) -> bool {
    (correction - f64::from(error)).abs() <= 1.01 * bench.count()
}

/// What the device reports of its way to a correction.
fn progress(bench: &mut Bench) -> Progress {
    bench
        .device
        .ask(&Request::GetProgress, |answer| match answer {
            Response::Progress(progress) => progress,
            other => panic!("{other:?}"),
        })
}

/// The steps to a correction: networks that are proved and stored act at the next power-on only.
/// Zero networks in the store are no correction.
#[test]
fn the_way_to_a_correction_is_reported() {
    let steps = |bench: &mut Bench| {
        let of = progress(bench);
        (of.navigates, of.stored, of.in_force)
    };
    let mut flash = flash(&Nets::NONE, &unit());
    let mut bench = powered(&flash);
    bench.run(20.0);
    assert_eq!(steps(&mut bench), (true, false, false));
    bench.says.winner.set(Some(NEW));
    bench.run(25.0);
    assert_eq!(steps(&mut bench), (true, false, false), "it waits");
    let (nets, kept) = wanted(&mut bench).expect("it is proved");
    assert_eq!(steps(&mut bench), (true, true, false));
    let mut store = Store::new(flash.clone()).expect("room");
    store.save(&Content::new(&nets, &kept)).expect("stored");
    flash = store.into_inner();
    let mut bench = powered(&flash);
    bench.run(20.0);
    assert_eq!(steps(&mut bench), (true, false, true));
    bench.says.stored_harms.set(true);
    bench.run(11.0);
    assert_eq!(wanted(&mut bench).expect("it does harm").0, Nets::NONE);
    assert_eq!(steps(&mut bench), (true, false, true));
}

/// All words of a drive are corrected by what was stored before it, whatever is learnt, and it is
/// the learnt networks that are stored.
#[test]
fn nothing_moves_in_a_drive_and_what_is_proved_is_stored() {
    let mut flash = flash(&with(OLD), &unit());
    let mut bench = powered(&flash);
    bench.run(20.0);
    assert_eq!(*bench.says.begun.borrow(), Some(with(OLD)));
    bench.device.order(&Request::Alignment(Alignment::Started));
    bench.run(60.0);
    assert_eq!(wanted(&mut bench), None, "nothing is proved");
    bench.device.order(&Request::Alignment(Alignment::Finished));
    bench.says.winner.set(Some(NEW));
    bench.run(20.0);
    assert!(!bench.device.app.may_halt());
    let (nets, kept) = wanted(&mut bench).expect("it is proved");
    assert!(nets == with(NEW) && kept == encode(&unit()));
    assert_eq!(wanted(&mut bench), None);
    assert_eq!(*bench.device.app.nets(), with(OLD));
    bench.says.winner.set(None);
    bench.run(20.0);
    let seen = bench.take();
    assert!(seen.iter().all(|c| near(*c, OLD, &bench)));
    assert_eq!(seen.len() as u32, bench.n);
    // the board writes it, and at the next power-on it acts from the first word on
    let mut store = Store::new(flash.clone()).expect("room");
    store.save(&Content::new(&nets, &kept)).expect("stored");
    flash = store.into_inner();
    let mut bench = powered(&flash);
    bench.run(30.0);
    let seen = bench.take();
    assert!(seen.iter().all(|c| near(*c, NEW, &bench)), "{:?}", seen[0]);
}

/// The sensor's own power-on counts like the board's.
#[test]
fn a_restart_of_the_sensor_brings_what_was_stored_into_force() {
    let mut bench = powered(&flash(&with(OLD), &unit()));
    bench.says.winner.set(Some(NEW));
    bench.run(25.0);
    bench.device.order(&Request::Alignment(Alignment::Finished));
    assert!(wanted(&mut bench).is_some());
    bench.says.winner.set(None);
    bench.run(20.0);
    assert!(bench.take().iter().all(|c| near(*c, OLD, &bench)));
    bench.silence(2.0);
    bench.run(20.0);
    assert_eq!(bench.device.counters().restarts, 1);
    let seen = bench.take();
    assert!(seen.iter().all(|c| near(*c, NEW, &bench)), "{:?}", seen[0]);
    assert_eq!(*bench.device.app.nets(), with(NEW));
    // what could not be stored does not act
    bench.says.winner.set(Some(OLD));
    bench.run(25.0);
    bench.device.app.store(|_, _| false);
    bench.take();
    bench.silence(2.0);
    bench.run(1.0);
    assert!(bench.take().iter().all(|c| near(*c, NEW, &bench)));
}

/// Whenever the power goes, at least two thirds of what was learnt are stored, apart from the first
/// seconds. A drive of two hours writes no more than 18 records, which is half of a sector.
#[test]
fn records_come_early_and_flash_is_spared() {
    let mut bench = powered(&flash(&with(OLD), &unit()));
    let (mut records, mut last) = (0, 0.0);
    for look in 1..=720 {
        let now = 10.0 * f64::from(look);
        bench.says.winner.set(Some(OLD * (1.0 + now as f32)));
        bench.run(10.0);
        bench.take();
        if let Some((nets, _)) = wanted(&mut bench) {
            // of the last look, which was a block before at most
            let of = [now, now - 10.0].map(|now| with(OLD * (1.0 + now as f32)));
            assert!(of.contains(&nets));
            (records, last) = (records + 1, now);
        }
        assert!(last >= 0.66 * now - 20.0, "{now} s: {last} s");
    }
    assert!((14..=18).contains(&records), "{records}");
}

/// A new device does not wait for its next record to store the first networks that are proved.
#[test]
fn the_first_networks_are_stored_at_once() {
    let mut bench = powered(&flash(&Nets::NONE, &unit()));
    bench.says.learns.set(vec![1; 40]);
    let mut stored = Vec::new();
    for look in 1..=40 {
        bench.says.winner.set((look > 30).then_some(NEW));
        bench.run(10.0);
        if let Some((nets, _)) = wanted(&mut bench) {
            stored.push((look, nets));
        }
    }
    let nothing = stored.iter().filter(|(_, nets)| *nets == Nets::NONE);
    assert!(nothing.count() > 3, "memory alone");
    let first = stored.iter().find(|(_, nets)| *nets == with(NEW));
    let at = first.map(|(look, _)| *look);
    assert!(at == Some(31) || at == Some(32), "{at:?}");
}

/// Networks that do harm are not applied a second time, and a learner that proves nothing leaves
/// the store alone.
#[test]
fn what_harms_is_removed_at_the_next_power_on() {
    let mut bench = powered(&flash(&with(OLD), &unit()));
    bench.run(600.0);
    assert_eq!(wanted(&mut bench), None);
    bench.says.stored_harms.set(true);
    bench.run(11.0);
    let (nets, _) = wanted(&mut bench).expect("it does harm");
    assert_eq!(nets, Nets::NONE);
    bench.run(30.0);
    assert_eq!(wanted(&mut bench), None, "once");
    assert!(bench.take().iter().all(|c| near(*c, OLD, &bench)));
    // what is learnt afterwards is stored all the same
    bench.says.winner.set(Some(NEW));
    bench.says.still_s.set(10);
    bench.run(620.0);
    assert_eq!(wanted(&mut bench).expect("proved").0, with(NEW));
    // without networks in the store there is nothing to remove
    let mut bench = powered(&flash(&Nets::NONE, &unit()));
    bench.says.stored_harms.set(true);
    bench.run(60.0);
    assert_eq!(wanted(&mut bench), None);
}

/// What a lost navigator has taught is replaced by what the drive began with, but not by networks
/// that do harm.
#[test]
fn what_a_lost_navigator_has_taught_is_replaced() {
    for harms in [false, true] {
        let mut bench = powered(&flash(&with(OLD), &unit()));
        bench.says.learns.set(vec![1; 40]);
        bench.says.winner.set(Some(NEW));
        bench.run(620.0);
        assert_eq!(wanted(&mut bench).expect("proved").0, with(NEW));
        bench.says.winner.set(None);
        bench.says.stored_harms.set(harms);
        bench.says.withdraws.set(true);
        let mut last = None;
        for _ in 0..25 {
            bench.run(1.0);
            last = wanted(&mut bench).or(last);
        }
        let before = if harms { Nets::NONE } else { with(OLD) };
        assert_eq!(last.expect("soon").0, before);
        assert!(bench.take().iter().all(|c| near(*c, OLD, &bench)));
    }
}

/// Only in mode learn, and only beside the configuration that is stored.
#[test]
fn nothing_is_stored_in_other_modes_or_beside_a_configuration_that_is_not() {
    for mode in [Mode::Bypass, Mode::Frozen, Mode::Shadow] {
        let mut of = unit();
        of.correction.mode = mode;
        let mut bench = powered(&flash(&with(OLD), &of));
        bench.says.winner.set(Some(NEW));
        bench.says.still_s.set(10);
        bench.run(30.0);
        assert_eq!(wanted(&mut bench), None, "{mode:?}");
    }
    let mut of = unit();
    of.correction.mode = Mode::Bypass;
    let mut bench = powered(&flash(&with(OLD), &of));
    bench.run(1.0);
    of = unit();
    of.rate += 1.0;
    assert_eq!(configure(&mut bench.device, &record(&of)), Ok(()));
    bench.says.winner.set(Some(NEW));
    bench.says.still_s.set(10);
    bench.run(30.0);
    assert_eq!(wanted(&mut bench), None);
    // after the configuration has been stored by command, it is
    bench.device.order(&Request::SetMode(Mode::Bypass));
    bench.device.order(&Request::StoreImage);
    assert!(bench.device.app.may_halt());
    assert_eq!(wanted(&mut bench).expect("by command").0, with(OLD));
    bench.device.order(&Request::SetMode(Mode::Learn));
    bench.run(30.0);
    assert_eq!(wanted(&mut bench).expect("proved").0, with(NEW));
    // a command keeps what was learnt for the next power-on
    bench.device.order(&Request::SetMode(Mode::Bypass));
    bench.device.order(&Request::StoreImage);
    assert_eq!(wanted(&mut bench).expect("by command").0, with(NEW));
}
