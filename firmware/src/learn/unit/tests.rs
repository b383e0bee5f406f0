use super::*;
use crate::inputs::{Inputs, OWN, Source};
use crate::learn::bank::Gates;
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
    let Nets { gyro, accel } = Nets::NONE;
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
    unit.remember(base, &mut bank, sheet, &nets, (600.0, [18.0, 41.0]), JUDGED);
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
    ] {
        let mut unit = Unit::NEW;
        unit.read(&wrong);
        assert_eq!(unit.head, Head::NEW);
    }
    // a value that cannot be is found when it is to be used
    for (at, value) in [(52, f32::NAN), (52 + 24, -1.0), (LEN - 4, 1e30)] {
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
        let [gyro, accel] = head.turn_on(sheet);
        assert!((gyro / scatter - 1.0).abs() < 0.25, "{gyro}");
        assert_eq!(gyro, accel);
    }
    let wild = Head {
        moments: [1e9, 0.0],
        count: 300.0,
        ..Head::NEW
    };
    assert!(wild.turn_on(sheet)[0] < 1.0);
}

/// A fleet's prior is a memory before the first drive: what a bank takes from it is the spread.
#[test]
fn a_type_is_known_before_its_first_drive() {
    let (sheet, nets) = (&Settings::MEDIUM.sheet, networks(&THERMAL));
    let spread = Spread {
        columns: [2.0, 0.5, 0.25],
        bias: 0.75,
        turn_on: 0.05,
    };
    let unit = Unit::of_type(&nets, sheet, &[spread; 2]);
    let mut read = Unit::NEW;
    read.read(&bytes(&unit));
    assert_eq!((read.head, read.head.drives), (unit.head, 0));
    let mut bank = bank(&THERMAL);
    assert!(read.recall(&mut bank, &nets));
    let mut values = Vec::new();
    bank.remember(&mut |value| values.push(value));
    for layer in values[REMEMBERED[0]..].chunks(REMEMBERED[1]) {
        let variance = |i: usize| layer[24 + i * (i + 1) / 2 + i];
        for (i, want) in [(0, 4.0), (1, 0.25), (2, 0.0625), (9, 0.5625), (23, 0.5625)] {
            let is = variance(i);
            // a little more: a part of the datasheet's prior, as if it had aged
            assert!((want..1.1 * want + 0.04).contains(&is), "{i} {is}");
        }
        assert!(layer[..24].iter().all(|mean| *mean == 0.0));
    }
    let [gyro, accel] = read.head.turn_on(sheet);
    assert!((0.05..0.07).contains(&gyro) && gyro == accel, "{gyro}");
}
