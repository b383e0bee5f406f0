//! Weights in the board's flash at start: a good image is used, a damaged one is refused.

use std::path::Path;
use std::thread;
use std::time::Duration;

use firmware::wire::checksum::crc32_zlib;
use lrnn_nostd::image;
use qemu::images::BOARDS;
use qemu::live::Live;
use qemu::replay::nets;

/// The two slots (`memory.x`).
const SLOTS: [u32; 2] = [0x080C_0000, 0x080E_0000];

/// A record as `firmware::store` documents it, written here independently.
fn record(generation: u32) -> Vec<u8> {
    let images = [image::encode(&nets().gyro), image::encode(&nets().accel)].concat();
    let mut record = b"LRNS".to_vec();
    for word in [1, generation, images.len() as u32] {
        record.extend(word.to_le_bytes());
    }
    record.extend(images);
    seal(record)
}

fn seal(mut record: Vec<u8>) -> Vec<u8> {
    let sum = crc32_zlib(&record);
    record.extend(sum.to_le_bytes());
    record
}

fn damaged(mut record: Vec<u8>, at: usize) -> Vec<u8> {
    record[at] ^= 1;
    record
}

/// Log of the board about its weights when it starts with these slots.
fn log(image: &Path, slots: [Option<Vec<u8>>; 2]) -> Vec<String> {
    let directory = tempfile::tempdir().expect("a directory");
    let files = ["first", "second"].map(|name| directory.path().join(name));
    let mut memory = Vec::new();
    for ((slot, file), address) in slots.into_iter().zip(&files).zip(SLOTS) {
        if let Some(bytes) = slot {
            std::fs::write(file, bytes).expect("written");
            memory.push((address, file.as_path()));
        }
    }
    let mut live = Live::start_with(BOARDS[0], image, &memory).expect("it starts");
    for _ in 0..100 {
        thread::sleep(Duration::from_millis(50));
        let log = live.memory().and_then(|memory| memory.log());
        let log = log.unwrap_or_default(); // not begun yet
        if !log.is_empty() {
            thread::sleep(Duration::from_millis(200)); // the second line, if there is one
            return live
                .memory()
                .and_then(|memory| memory.log())
                .expect("a log");
        }
    }
    panic!("the board says nothing");
}

fn number(log: &[String]) -> Option<u32> {
    let line = log.iter().find(|line| line.contains("stored weights"))?;
    line.rsplit(' ').next()?.parse().ok()
}

#[test]
fn only_good_images_are_taken_at_start() {
    let Some(image) = BOARDS[0].image.build_or_skip() else {
        return;
    };
    // The checksum of the record is right and the weights are not: a network's image has its own
    // checksum.
    let resealed = {
        let mut record = damaged(record(9), 100);
        record.truncate(record.len() - 4);
        seal(record)
    };
    let cases = [
        ("nothing stored", [None, None], None),
        ("one good", [Some(record(7)), None], Some(7)),
        ("the newer", [Some(record(7)), Some(record(8))], Some(8)),
        (
            "one bit of a weight",
            [Some(damaged(record(7), 100)), None],
            None,
        ),
        (
            "one bit of the sum",
            [Some(damaged(record(7), 624)), None],
            None,
        ),
        ("another version", [Some(damaged(record(7), 4)), None], None),
        (
            "the newer is damaged",
            [Some(damaged(record(8), 300)), Some(record(7))],
            Some(7),
        ),
        (
            "a network refused",
            [Some(resealed), Some(record(7))],
            Some(7),
        ),
    ];
    for (what, slots, expected) in cases {
        let log = log(&image, slots);
        assert_eq!(number(&log), expected, "{what}: {log:?}");
    }
}
