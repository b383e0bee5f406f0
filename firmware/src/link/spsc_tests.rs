//! The queue between two priorities, with the processor's own atomics. They are not in its file,
//! which `tests/orders` compiles with loom's.

use super::spsc::Queue;
use std::boxed::Box;
use std::thread;

/// Two threads, and values on the heap: Miri reports a race, one that is dropped twice, and one
/// that is lost (`cargo +nightly miri test -p firmware --lib spsc`).
#[test]
fn values_pass_once_and_in_order() {
    const VALUES: usize = if cfg!(miri) { 100 } else { 10_000 };
    let mut queue = Queue::<Box<usize>, 4>::new();
    let (mut producer, mut consumer) = queue.split();
    thread::scope(|scope| {
        scope.spawn(move || {
            for n in 0..VALUES {
                while !producer.has_room() {
                    thread::yield_now();
                }
                assert!(producer.put(Box::new(n)));
            }
        });
        for n in 0..VALUES {
            while !consumer.waits() {
                thread::yield_now();
            }
            assert_eq!(consumer.take(), Some(Box::new(n)));
        }
        assert_eq!(consumer.take(), None);
    });
}

/// Counters near their end, and a queue that is full.
#[test]
fn no_value_is_lost_when_it_is_full_and_its_counters_turn_over() {
    let mut queue = Queue::<Box<usize>, 4>::after(usize::MAX - 1);
    let (mut producer, mut consumer) = queue.split();
    for round in 0..3 {
        for n in 0..4 {
            assert!(producer.put(Box::new(4 * round + n)));
        }
        assert!(!producer.has_room() && !producer.put(Box::new(0)));
        for n in 0..4 {
            assert_eq!(consumer.take(), Some(Box::new(4 * round + n)));
        }
        assert!(producer.is_empty() && !consumer.waits());
    }
}

/// A bit of either number flips: no slot without a value is read, and the next value passes.
#[test]
fn a_number_in_upset_memory_loses_what_waits() {
    for put in [true, false] {
        for bit in 2..usize::BITS {
            let mut queue = Queue::<u8, 4>::new();
            assert!(queue.split().0.put(1));
            queue.upset(put, bit);
            let (mut producer, mut consumer) = queue.split();
            assert_eq!(consumer.take(), None, "bit {bit}");
            assert!(producer.is_empty() && producer.put(2));
            assert_eq!((consumer.take(), consumer.take()), (Some(2), None));
        }
    }
}
