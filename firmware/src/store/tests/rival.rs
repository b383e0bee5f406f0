//! The usual store for NOR flash beside ours, on the same strict flash: the crate
//! `sequential-storage` keeps one item as long as our record in two sectors of an STM32F405.
//!
//! It is asked the question that decides here: what happens between two words of the sensor? The
//! core of an STM32F405 halts while its flash is written or erased (DS8626 table 47: 16 us a word,
//! 1 to 2 s a sector of 128 KiB).

use super::*;
use core::future::Future;
use core::task::{Context, Poll, Waker};
use embedded_storage_async::nor_flash as nor;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};

const SECTOR: usize = 128 * 1024;
const RECORDS: u8 = 100;

/// The flash with the traits that the rival wants.
#[derive(Clone)]
struct Waits(Flash<SECTOR>);

impl ErrorType for Waits {
    type Error = Failure;
}

impl nor::ReadNorFlash for Waits {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl nor::NorFlash for Waits {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        self.0.write(offset, bytes)
    }
}

/// A future that never waits.
fn now<T>(future: impl Future<Output = T>) -> T {
    let mut future = core::pin::pin!(future);
    match future
        .as_mut()
        .poll(&mut Context::from_waker(Waker::noop()))
    {
        Poll::Ready(value) => value,
        Poll::Pending => panic!("this flash does not wait"),
    }
}

/// Most bytes that one call erased, and wrote without an erasure.
#[derive(Debug, PartialEq, Default)]
struct Most {
    erased: usize,
    wrote: usize,
}

impl Most {
    fn see(&mut self, flash: &mut Flash<SECTOR>) {
        let (erased, wrote) = (flash.erased, flash.work - flash.erased);
        (flash.erased, flash.work) = (0, 0);
        self.erased = self.erased.max(erased);
        if erased == 0 {
            self.wrote = self.wrote.max(wrote);
        }
    }
}

/// Ours, as the application uses it: room is made at power-on; in the stream a call writes a piece.
fn ours(records: u8) -> Most {
    let mut store = Store::new(Flash::<SECTOR>::new(2 * SECTOR)).unwrap();
    let mut stream = Most::default();
    with(18, |content| store.save(content)).unwrap();
    (store.flash.erased, store.flash.work) = (0, 0);
    for n in 0..records {
        if n % 4 == 0 {
            store.make_room().unwrap(); // a power-on: no sensor waits
            (store.flash.erased, store.flash.work) = (0, 0);
        }
        with(18, |content| {
            store.begin(content).unwrap();
            loop {
                let progress = store.go_on(content).unwrap();
                stream.see(&mut store.flash);
                if progress == Progress::Done {
                    break;
                }
            }
        });
    }
    stream
}

/// The crate: a call stores an item.
fn theirs(records: u8) -> Most {
    let record = framed(18, 0);
    let mut buffer = std::vec![0; record.len() + 64];
    let config = MapConfig::new(0..2 * SECTOR as u32);
    let blank = Waits(Flash::blank(2 * SECTOR));
    let mut map = MapStorage::<u8, _, _>::new(blank, config, Cache::new_uncached());
    let mut stream = Most::default();
    for n in 0..records {
        let mut record = record.clone();
        record[40] = n;
        now(map.store_item(&mut buffer, &1, &record.as_slice())).unwrap();
        stream.see(&mut map.flash().0);
        let found = now(map.fetch_item::<&[u8]>(&mut buffer, &1)).unwrap();
        assert_eq!(found, Some(record.as_slice()));
    }
    stream
}

/// In the stream ours halts the core for 16 words at a time and never erases. The crate writes an
/// item in one call, and erases a sector in the call that finds the other one full.
#[test]
fn what_a_word_of_the_sensor_waits_for() {
    let record = framed(18, 0).len();
    assert_eq!(
        ours(RECORDS),
        Most {
            erased: 0,
            wrote: PIECE
        }
    );
    let theirs = theirs(RECORDS);
    assert_eq!(theirs.erased, SECTOR);
    assert!(theirs.wrote >= record, "{theirs:?}");
}
