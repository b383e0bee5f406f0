//! Whatever the order of the steps of the queue's two ends: values come out as they went in, each
//! once, and a slot is never used from both ends at once.

use orders::spsc::{Consumer, Producer, Queue};

/// Values that are not atomic, so that reading too early is detected.
type Value = [u32; 3];

const SENT: [Value; 3] = [[1, 2, 3], [4, 5, 6], [7, 8, 9]];

fn in_every_order<const N: usize>() {
    loom::model(|| {
        let queue: &mut Queue<Value, N> = Box::leak(Box::new(Queue::new()));
        let (mut puts, mut takes): (Producer<Value, N>, Consumer<Value, N>) = queue.split();
        // its atomics and slots are made before there is a second thread
        assert!(puts.is_empty() && !takes.waits());
        for value in 0..N as u32 {
            assert!(puts.put([value; 3]) && takes.take() == Some([value; 3]));
        }
        let putting = loom::thread::spawn(move || {
            let put = SENT.map(|value| puts.put(value));
            (puts, put)
        });
        let mut got: Vec<Value> = (0..2).filter_map(|_| takes.take()).collect();
        let (puts, put) = putting.join().expect("the end that puts");
        while let Some(value) = takes.take() {
            got.push(value);
        }
        let kept = SENT.iter().zip(put).filter(|(_, put)| *put);
        assert!(kept.map(|(value, _)| *value).eq(got), "{put:?}");
        assert!(put.iter().filter(|put| **put).count() >= N.min(3));
        assert!(puts.is_empty() && puts.has_room());
    });
}

#[test]
fn with_room_for_one() {
    in_every_order::<1>();
}

#[test]
fn with_room_for_two() {
    in_every_order::<2>();
}
