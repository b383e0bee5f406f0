use super::*;
use crate::inputs::{Inputs, OWN, Source};
use crate::learn::bank::{CURVED, DRIVEN, Gates, HYPOTHESES, MAP, STORED};
use crate::learn::settings::Settings;
use crate::model::Nets;
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

const THERMAL: Inputs = [[
    Source::Temperature,
    Source::TemperatureRate,
    Source::Vibration,
]; 2];

fn networks(inputs: &Inputs) -> Shapes {
    let Nets { gyro, accel, .. } = Nets::NONE;
    Shapes::new(&[gyro, accel], &Settings::MEDIUM.sheet, inputs).complete()
}

fn bank(inputs: &Inputs) -> Box<Bank> {
    let mut bank = Box::new(Bank::ZEROED);
    let of = (&Settings::MEDIUM.sheet, inputs);
    bank.begin(of, &networks(inputs), 1.0, [1e-3; 9], Gates::USUAL);
    bank
}

fn bytes(unit: &Unit) -> Vec<u8> {
    let mut bytes = vec![0; LEN];
    for (at, piece) in (0..).step_by(100).zip(bytes.chunks_mut(100)) {
        unit.write(at, piece);
    }
    bytes
}

/// Judgements of the memory, any numbers.
const JUDGED: [f32; 3] = [0.5, 0.25, 2.0];

/// A unit after a drive, with what a bank knows that has learnt nothing.
fn after(base: &Head, inputs: &Inputs) -> Unit {
    let mut unit = Unit::NEW;
    let (mut bank, nets) = (bank(inputs), networks(inputs));
    let sheet = &Settings::MEDIUM.sheet;
    let mut rehearsal = Rehearsal::ZEROED;
    rehearsal.begin();
    let drive = (600.0, [18.0, 41.0]);
    unit.remember(base, (&mut bank, &rehearsal), sheet, &nets, drive, JUDGED);
    unit
}

#[test]
fn the_bytes_are_read_as_they_were_written() {
    let unit = after(&Head::NEW, &THERMAL);
    let mut read = Unit::NEW;
    read.read(&bytes(&unit));
    assert_eq!(read.head, unit.head);
    assert_eq!(read.values, unit.values);
    assert_eq!((unit.head.drives, unit.head.seconds), (1, 600.0));
    assert_eq!((unit.head.degc, read.head.judged), ([18.0, 41.0], JUDGED));
    let second = after(&unit.head, &THERMAL).head;
    assert_eq!((second.drives, second.seconds), (2, 1200.0));
    let mut again = bank(&THERMAL);
    assert!(read.recall(&mut again, &networks(&THERMAL)));
}

#[test]
fn bytes_of_something_else_are_no_memory() {
    let good = bytes(&after(&Head::NEW, &THERMAL));
    let with = |at: usize, value: f32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    let mut other = good.clone();
    other[0] = 1;
    for wrong in [
        vec![],
        good[..LEN - 1].to_vec(),
        other,
        with(4, f32::NAN),
        with(16, -1.0),
        with(24, f32::INFINITY),
        with(28, f32::NAN),
        with(32, f32::INFINITY),
        with(44, -0.5),
        with(104, f32::NAN),
    ] {
        let mut unit = Unit::NEW;
        unit.read(&wrong);
        assert_eq!(unit.head, Head::NEW);
    }
    // a value that cannot be is found when it is to be used
    for (at, value) in [
        (108, f32::NAN),
        (108 + 24, -1.0),
        (180, f32::NAN),
        (1620 + 96, 0.0),
        (LEN - 4, 1e30),
    ] {
        let mut unit = Unit::NEW;
        unit.read(&with(at, value));
        assert!(!unit.recall(&mut bank(&THERMAL), &networks(&THERMAL)));
    }
}

/// The memory of networks with other inputs, or of another shape, is not used for these.
#[test]
fn memory_belongs_to_its_networks() {
    let unit = after(&Head::NEW, &THERMAL);
    assert!(!unit.recall(&mut bank(&OWN), &networks(&OWN)));
    let mut other = networks(&THERMAL);
    other.curved[1].weights.layers[0].w[2][2] += 0.01;
    assert!(!unit.recall(&mut bank(&THERMAL), &other));
}

/// The scatter goes from the datasheet's guess to that of the unit itself.
#[test]
fn the_scatter_of_the_turn_ons_is_learnt() {
    let sheet = &Settings::MEDIUM.sheet;
    let turn_on = Head::NEW.turn_on(sheet);
    assert!((turn_on[0] - sheet.turn_on[0]).abs() < 1e-6);
    for scatter in [0.02_f32, 0.5] {
        let head = Head {
            moments: [300.0 * scatter * scatter; 2],
            count: 300.0,
            ..Head::NEW
        };
        for is in head.turn_on(sheet) {
            assert!((is / scatter - 1.0).abs() < 0.25, "{is}");
        }
    }
    let wild = Head {
        moments: [1e9, 0.0],
        count: 300.0,
        ..Head::NEW
    };
    assert!(wild.turn_on(sheet)[0] < 1.0);
}

/// What the bets have won goes with the memory, at most ten stakes of it and never more than was
/// won; another hypothesis than these restarts.
#[test]
fn capital_is_carried_to_the_next_drive() {
    let (nets, sheet) = (networks(&THERMAL), &Settings::MEDIUM.sheet);
    let mut rehearsal = Rehearsal::ZEROED;
    rehearsal.begin();
    (0..100).for_each(|_| rehearsal.bet(&[0.0, 2.0, 0.0, 0.0, -2.0, 0.0, 4.0, 0.0]));
    let [won, lost, none, other] =
        [1, DRIVEN, CURVED, STORED].map(|of| rehearsal.standing(of).proof);
    assert!(won > 20.0 && lost < 0.2 && other > 100.0);
    let mut unit = Unit::NEW;
    let mut bank = bank(&THERMAL);
    let drive = (600.0, [18.0, 41.0]);
    unit.remember(
        &Head::NEW,
        (&mut bank, &rehearsal),
        sheet,
        &nets,
        drive,
        JUDGED,
    );
    let mut read = Unit::NEW;
    read.read(&bytes(&unit));
    let mut next = Rehearsal::ZEROED;
    next.begin();
    read.carry(&mut next);
    let is = [1, STEPPED, DRIVEN, CURVED, STORED].map(|of| next.standing(of).proof);
    assert!(is[0] > 9.5 && is[0] < 10.001 && is[1] == is[0], "{is:?}");
    assert!(is[2] <= lost && is[2] > 0.9 * lost, "{is:?} {lost}");
    assert!(
        is[3] <= none && is[3] > 0.97 * none && is[4] == 1.0,
        "{is:?}"
    );
}

/// A memory that did harm says so to the next drive, until it has proved itself.
#[test]
fn a_refuted_memory_is_on_trial() {
    let harmful = |of: f32| {
        let mut rehearsal = Rehearsal::ZEROED;
        rehearsal.begin();
        let mut scores = [0.0; HYPOTHESES];
        scores[STORED] = of;
        (0..100).for_each(|_| rehearsal.bet(&scores));
        rehearsal.choose(|_| 0.0);
        rehearsal
    };
    let (good, nothing, bad) = (harmful(2.0), harmful(0.0), harmful(-2.0));
    assert!(bad.refutes(true, false) && bad.refutes(true, true));
    assert!(!nothing.refutes(true, false) && nothing.refutes(true, true));
    assert!(!good.refutes(true, false) && !good.refutes(true, true));
    assert!(
        !bad.refutes(false, false),
        "what did not take part does no harm"
    );
    let (mut unit, mut bank) = (Unit::NEW, bank(&THERMAL));
    let (nets, sheet) = (networks(&THERMAL), &Settings::MEDIUM.sheet);
    let drive = (600.0, [18.0, 41.0]);
    // the first drive of a unit: nothing was stored
    unit.remember(&Head::NEW, (&mut bank, &bad), sheet, &nets, drive, JUDGED);
    assert!(!unit.head.refuted);
    let Nets { gyro, accel, maps } = Nets::NONE;
    bank.begin_stored((&[gyro, accel], &maps), sheet, [1e-3; 9]);
    for (rehearsal, refuted) in [(bad, true), (nothing, true), (good, false)] {
        let base = unit.head;
        unit.remember(&base, (&mut bank, &rehearsal), sheet, &nets, drive, JUDGED);
        let mut read = Unit::NEW;
        read.read(&bytes(&unit));
        assert_eq!(read.head.refuted, refuted);
    }
}

/// A memory of the version before has no map: what it does not have begins as without memory, and
/// the rest is as it was.
#[test]
fn the_version_before_is_read() {
    let mut unit = after(&Head::NEW, &THERMAL);
    unit.head.carried = [[[50, 51]; 6]; 4];
    for (which, carried) in unit.head.carried.iter_mut().enumerate() {
        carried[0][0] = 10 * which as u8;
    }
    unit.head.refuted = true;
    unit.head.evidence = [7.0, 2.0, 3.0];
    let new = bytes(&unit);
    // head, three bets, "refuted"; of biases, driven and curved means and all covariances
    let mut old = new[..52].to_vec();
    old[..2].copy_from_slice(&3_u16.to_le_bytes());
    old.extend_from_slice(&new[52..88]);
    old.extend_from_slice(&new[100..104]);
    for (from, means) in [(108, 6), (180, 24), (900, 24)] {
        let half = means / 2;
        old.extend_from_slice(&new[from..from + 4 * means]);
        let mut own = new[from + 4 * means..].chunks(4);
        for i in 0..means {
            for j in 0..=i {
                let within = (i < half) == (j < half);
                let other = 0.5_f32.to_le_bytes();
                let bytes = if within { own.next().unwrap() } else { &other };
                old.extend_from_slice(bytes);
            }
        }
    }
    assert_eq!(old.len(), 2792);
    let mut read = Unit::NEW;
    read.read(&old);
    let mut want = unit.head;
    want.carried[3] = UNTRIED;
    want.evidence[2] = 0.0;
    assert_eq!(read.head, want);
    assert_eq!(read.values[..378], unit.values[..378]);
    assert!(read.values[378..].iter().all(|value| *value == 0.0));
    let (mut with, fresh) = (bank(&THERMAL), bank(&THERMAL));
    assert!(read.recall(&mut with, &networks(&THERMAL)));
    assert_eq!(with.maps_of(MAP), fresh.maps_of(MAP));
    read.read(&old[..old.len() - 1]);
    assert_eq!(read.head, Head::NEW);
}
