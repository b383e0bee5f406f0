//! A whole burst as numbers.

use super::layout::{Field, Layout};
use super::{Frame, START, seal};
use crate::wire::Error;
use crate::wire::field::{put, take};

/// Every number of a burst.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Repr {
    /// Layout of the burst.
    pub layout: Layout,
    /// The numbers of all fields but the checksum in the order of [`Field::ALL`], of a quaternion
    /// four, of a triad three. What the layout does not have is not sent. Numbers of 16 bits keep
    /// their low bits.
    pub numbers: [[i32; 4]; 10],
}

impl Repr {
    /// Calls `f` with each field that is there, but for the checksum: its position among the
    /// numbers, and position and width of each of its numbers.
    fn each(layout: Layout, mut f: impl FnMut([usize; 2], usize, bool)) {
        let mut at = 1;
        for (n, field) in Field::ALL.into_iter().enumerate().take(10) {
            if layout.has(field) {
                let wide = layout.is_wide(field);
                for k in 0..field.numbers() {
                    f([n, k], at, wide);
                    at += if wide { 4 } else { 2 };
                }
            }
        }
    }

    /// Takes a burst apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        let bytes = frame.buffer.as_ref();
        let mut numbers = [[0; 4]; 10];
        Repr::each(frame.layout, |[n, k], at, wide| {
            if let Some(number) = numbers.get_mut(n).and_then(|field| field.get_mut(k)) {
                *number = if wide {
                    i32::from_be_bytes(take(bytes, at))
                } else {
                    i16::from_be_bytes(take(bytes, at)).into()
                };
            }
        });
        Repr {
            layout: frame.layout,
            numbers,
        }
    }

    /// Writes the burst with its checksum and returns its length.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short; it is then unchanged.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let len = self.layout.bytes();
        let frame = buffer.get_mut(..len).ok_or(Error::Length)?;
        put(frame, 0, [START]);
        Repr::each(self.layout, |[n, k], at, wide| {
            let number = self.numbers.get(n).and_then(|field| field.get(k));
            let number = number.copied().unwrap_or_default();
            if wide {
                put(frame, at, number.to_be_bytes());
            } else {
                put(frame, at, (number as i16).to_be_bytes());
            }
        });
        seal(frame);
        Ok(len)
    }
}
