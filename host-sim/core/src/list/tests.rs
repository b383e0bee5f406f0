use super::*;
use crate::inertial::sins::Increment;
use firmware::sample::Counts;
use nalgebra::Vector3;
use std::fmt::Debug;

/// A list of which this many bytes stay in memory.
fn list<T: Item>(items: &[T], most: usize) -> List<T> {
    List::collected(items.iter().cloned(), most)
}

fn comes_back<T: Item + PartialEq + Debug>(items: &[T]) {
    for (most, in_file) in [(IN_MEMORY, false), (1000, true)] {
        let list = list(items, most);
        assert_eq!(matches!(list.storage, Storage::File(_)), in_file);
        assert_eq!(list.len(), items.len());
        assert!(list.each().eq(items.iter().cloned()));
        assert!(list.each().rev().eq(items.iter().rev().cloned()));
        let part = list.part(5000..7000).part(10..9999);
        assert!(part.each().eq(items[5010..7000].iter().cloned()));
        assert_eq!(*part.block(3..2500), items[5013..7000]);
        assert_eq!(part.end().as_ref(), Some(&items[6999]));
        let mut cursor = list.cursor();
        for k in [0, 1, 29_999, 4, 3, 20_000, 19_999, 20_001, 30_000, 7] {
            assert_eq!(cursor.get(k), items.get(k), "{k}");
        }
        assert_eq!(part, self::list(&items[5010..7000], 0));
        // as a slice, and read again from there
        assert_eq!(part[..], items[5010..7000]);
        assert!(list.each().eq(items.iter().cloned()));
        assert!(list.check().is_ok());
    }
}

#[test]
fn items_come_back_as_they_went_from_memory_and_from_a_file() {
    let wave = |k: i32| f64::from(k).sin() / 3.0;
    comes_back(&(0..30_000).map(wave).collect::<Vec<f64>>());
    let increment = |k: i32| Increment {
        dtheta: Vector3::new(wave(k), wave(k + 1), -wave(k)),
        dv: Vector3::new(1.0, wave(7 * k), f64::MIN_POSITIVE),
    };
    comes_back(&(0..30_000).map(increment).collect::<Vec<_>>());
    let counts = |k: i32| Counts {
        dtheta: [k, -k, i32::MAX],
        dv: [i32::MIN, 7 * k, 1],
    };
    comes_back(&(0..30_000).map(counts).collect::<Vec<_>>());
    assert!(list::<f64>(&[], 0).each().next().is_none());
}

#[test]
fn a_part_is_shared_until_it_is_changed() {
    let numbers = [0.0, 1.0, 2.0, 3.0, 4.0];
    for most in [0, 1000] {
        let all = list(&numbers, most);
        let mut part = all.part(1..4).part(1..9);
        assert_eq!(*part, [2.0, 3.0]);
        part.edit(|part| part[0] = 7.0);
        assert_eq!((&*part, &*all), (&[7.0, 3.0][..], &numbers[..]));
    }
}

/// What cannot be written or read is reported, and the list ends before it.
#[test]
fn a_broken_file_is_reported_with_a_remedy() {
    let reported = |list: &List<f64>| list.check().unwrap_err().to_string();
    let full = Error::writing(
        std::path::Path::new("x"),
        std::io::ErrorKind::StorageFull.into(),
    );
    let list = List::<f64>::of(File::broken(full));
    assert!(list.is_empty() && list.each().next().is_none() && list.is_empty());
    let text = reported(&list);
    assert!(
        text.contains("a temporary file: cannot be written (no storage space"),
        "{text}"
    );
    assert!(
        text.contains("; remedy: choose a place with free space"),
        "{text}"
    );
    // a file that is shorter than it was
    let short = tempfile::tempfile().unwrap();
    short.set_len(8 * 9000).unwrap();
    let list = List::<f64>::of(File::new(short, 8, 20_000));
    assert!(list.each().count() < 9001);
    assert!(
        reported(&list).contains("a temporary file"),
        "{}",
        reported(&list)
    );
    assert!(list[..].len() < 9001);
}
