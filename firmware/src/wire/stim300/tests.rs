//! A datagram for the tests of all formats.

use super::*;
use crate::wire::examples::made;
use std::vec::Vec;

/// An example with identifiers and CRs in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let repr = Repr {
        contents: Contents::from_id(0xA5).unwrap(),
        gyro: Cluster {
            values: [i32::from(n), 0x0091_9191, -0x0056_F0F1],
            status: 0,
        },
        accel: Cluster::default(),
        incl: Cluster::default(),
        temperatures: [Temperatures::default(); 3],
        extra: (0, 0),
        counter: n,
        latency_us: 120,
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(frame)?);
    made(|buffer| repr.emit(buffer))
}
