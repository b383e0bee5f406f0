//! Whatever the order of the steps of its two ends: bytes come out as they went in, each once, and
//! a loss is reported.

use embedded_io::{Read, Write};
use orders::atomics::Ordering;
use orders::ring::{Overrun, Ring};
use std::sync::Arc;

const SENT: [u8; 3] = [11, 22, 33];

/// A ring whose atomics are created before the second thread starts.
fn ring() -> Arc<Ring<2>> {
    let ring = Arc::new(Ring::new());
    let (_, _, _) = (ring.pushed(), ring.popped(), ring.consumer());
    for byte_slot in ring.free() {
        assert_eq!(byte_slot.load(Ordering::Relaxed), 0);
    }
    ring
}

/// Runs the two ends in every order. `puts` returns how many bytes of [`SENT`] found room; `takes`
/// must have read the first of these, and the rest must still be in the ring.
fn in_every_order(
    puts: impl Fn(&Ring<2>) -> usize + Copy + Send + Sync + 'static,
    takes: impl Fn(&Ring<2>, &mut Vec<u8>) + Copy + Send + Sync + 'static,
) {
    loom::model(move || {
        let ring = ring();
        let other = ring.clone();
        let puts = loom::thread::spawn(move || puts(&other));
        let mut got = Vec::new();
        takes(&ring, &mut got);
        let put = puts.join().expect("the end that puts");
        while let Some(byte) = ring.pop() {
            got.push(byte);
        }
        assert_eq!(got, SENT[..put]);
    });
}

/// Takes bytes one at a time, with twice as many attempts as there is room.
fn pops(ring: &Ring<2>, got: &mut Vec<u8>) {
    let mut consumer = ring.consumer();
    for _ in 0..3 {
        got.extend(consumer.pop());
    }
}

fn reads(ring: &Ring<2>, got: &mut Vec<u8>) {
    let mut consumer = ring.consumer();
    for _ in 0..2 {
        let mut buffer = [0; 2];
        let read = consumer.read(&mut buffer).expect("nothing is lost");
        got.extend(&buffer[..read]);
    }
}

/// Takes bytes as a DMA controller does: reads the memory, then reports how many.
fn empties(ring: &Ring<2>, got: &mut Vec<u8>) {
    for _ in 0..2 {
        let oldest = ring.oldest();
        got.extend(
            oldest
                .iter()
                .map(|byte_slot| byte_slot.load(Ordering::Relaxed)),
        );
        ring.emptied(oldest.len());
    }
}

fn writes(ring: &Ring<2>) -> usize {
    let mut producer = ring.producer();
    let Ok(first) = producer.write(&SENT);
    let Ok(second) = producer.write(&SENT[first..]);
    first + second
}

/// Puts bytes as a DMA controller does.
fn fills(ring: &Ring<2>) -> usize {
    let mut put = 0;
    for _ in 0..2 {
        let free = ring.free();
        let bytes = &SENT[put..];
        for (byte_slot, byte) in free.iter().zip(bytes) {
            byte_slot.store(*byte, Ordering::Relaxed);
        }
        let filled = free.len().min(bytes.len());
        ring.filled(filled);
        put += filled;
    }
    put
}

#[test]
fn the_loop_reads_what_a_controller_fills() {
    in_every_order(fills, reads);
}

#[test]
fn a_controller_empties_what_the_loop_writes() {
    in_every_order(writes, empties);
}

#[test]
fn an_interrupt_takes_what_the_loop_writes() {
    in_every_order(writes, pops);
}

/// What an interrupt pushes: a byte without room is lost, the ones before and after it are not, and
/// the loss is reported to the loop.
#[test]
fn a_lost_byte_is_reported() {
    loom::model(|| {
        let ring = ring();
        let other = ring.clone();
        let mut consumer = ring.consumer();
        let interrupt = loom::thread::spawn(move || {
            for byte in SENT {
                other.push(byte);
            }
        });
        let (mut got, mut reported) = (Vec::new(), 0);
        let mut read = |got: &mut Vec<u8>| {
            let mut buffer = [0; 2];
            match consumer.read(&mut buffer) {
                Ok(read) => got.extend(&buffer[..read]),
                Err(Overrun) => reported += 1,
            }
        };
        read(&mut got);
        interrupt.join().expect("the interrupt");
        (0..3).for_each(|_| read(&mut got));
        assert!(
            got == SENT || (got == SENT[..2] && reported == 1),
            "{got:?}"
        );
        assert_eq!(got == SENT, reported == 0);
    });
}
