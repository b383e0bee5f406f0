//! The ends of a ring as a line. `tests/orders` runs them in every order, so these tests are not in
//! the ring's own file.

use super::ring::*;
use super::{Line, Lost, Serial};
use embedded_io::Read;

#[test]
fn losses_are_reported_once() {
    let (receive, transmit) = (Ring::<4>::new(), Ring::<4>::new());
    let (mut interrupt, reader) = (receive.producer(), receive.consumer());
    let (writer, mut wire) = (transmit.producer(), transmit.consumer());
    let mut line = Serial::new(reader, writer);
    for byte in 1..=6 {
        interrupt.push(byte);
    }
    let mut buffer = [0; 8];
    assert_eq!(line.receive(&mut buffer), Err(Lost));
    assert_eq!(line.receive(&mut buffer), Ok(4));
    assert_eq!(buffer[..4], [1, 2, 3, 4]);
    assert_eq!(line.receive(&mut buffer), Ok(0));
    interrupt.mark_lost();
    assert_eq!(line.receive(&mut buffer), Err(Lost));
    assert_eq!((line.receive(&mut buffer), interrupt.room()), (Ok(0), 4));

    assert_eq!(line.send(b"abcdef"), Ok(()));
    let mut sent = std::vec::Vec::new();
    while let Some(byte) = wire.pop() {
        sent.push(byte);
        line.poll();
    }
    assert_eq!(sent, b"abcdef");
}

#[test]
fn two_threads() {
    let ring = Ring::<16>::new();
    let (mut producer, mut consumer) = (ring.producer(), ring.consumer());
    let mut wrong = 0;
    std::thread::scope(|scope| {
        scope.spawn(move || {
            for n in 0..100_000u32 {
                while producer.room() == 0 {
                    std::thread::yield_now();
                }
                producer.push(n as u8);
            }
        });
        let mut buffer = [0; 7];
        let mut n = 0u32;
        while n < 100_000 {
            let read = consumer.read(&mut buffer).expect("nothing is lost");
            for &byte in &buffer[..read] {
                // no panic: the other thread would wait for ever
                wrong += u32::from(byte != n as u8);
                n += 1;
            }
            std::thread::yield_now();
        }
    });
    assert_eq!(wrong, 0);
}

/// A bit of either count flips: what is in the ring is lost, and what comes next passes. No old
/// byte leaves again.
#[test]
fn a_count_in_upset_memory_loses_what_is_there() {
    for bit in 2..usize::BITS {
        for upset in [
            |ring: &Ring<4>, by| _ = ring.filled(by),
            |ring: &Ring<4>, by| ring.emptied(by),
        ] {
            let ring = Ring::<4>::new();
            let (mut producer, mut consumer) = (ring.producer(), ring.consumer());
            producer.push(1);
            upset(&ring, 1 << bit);
            assert_eq!(ring.pop(), None, "bit {bit}");
            producer.push(2);
            assert_eq!((ring.pop(), ring.pop()), (Some(2), None));

            producer.push(1);
            upset(&ring, 1 << bit);
            assert!(ring.oldest().is_empty(), "bit {bit}");
            producer.push(3);
            assert_eq!((consumer.pop(), consumer.pop()), (Some(3), None));

            producer.push(1);
            upset(&ring, 1 << bit);
            let mut buffer = [0; 8];
            assert_eq!(consumer.read(&mut buffer), Err(Overrun), "bit {bit}");
            producer.push(4);
            assert_eq!((consumer.read(&mut buffer), buffer[0]), (Ok(1), 4));

            producer.push(1);
            upset(&ring, 1 << bit);
            assert_eq!(consumer.pop(), None, "bit {bit}");
            assert_eq!(producer.room(), 4);
        }
    }
}
