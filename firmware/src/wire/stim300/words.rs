//! Frames as they mostly come, with gyros and accelerometers, read and changed four bytes at a
//! time.
//!
//! ```text
//! ID g g g | g g g g | g g st a | a a a a | a a a a | st ...
//! ```

use super::{Frame, at, status};
use crate::sample::{Axes, RawSample};
use crate::wire::Reading;
use crate::wire::checksum::crc32_mpeg2_padded_change_of;
use crate::wire::field::{I24_MIN, put, saturate_i24, take};

/// Words with all six values and what is between them, of a frame with accelerometers.
type Words = [u32; 5];

/// The words of a frame. `None`: it is too short to have accelerometers.
#[inline(always)]
fn words(frame: &[u8]) -> Option<Words> {
    let (words, _) = frame.as_chunks::<4>();
    let words = words.first_chunk::<5>()?;
    Some(words.map(u32::from_be_bytes))
}

/// The six values in these words.
#[inline(always)]
fn triads([a, b, c, d, e]: Words) -> [[i32; 3]; 2] {
    // each at the top of its word
    let tops = [
        [a << 8, b, b << 24 | c >> 8],
        [c << 24 | d >> 8, d << 16 | e >> 16, e << 8],
    ];
    tops.map(|triad| triad.map(|top| top.cast_signed() >> 8))
}

/// [`Frame::reading`] of a frame that was found good: whether it has accelerometers is bit 0 of its
/// identifier, and counter and latency are counted from its end.
#[inline(always)]
pub(super) fn read(frame: &[u8]) -> Option<Reading> {
    let id = *frame.first()?;
    if id & 0b101 != 1 {
        return read_otherwise(frame); // without accelerometers, or with temperatures
    }
    let [gyro, accel] = triads(words(frame)?);
    let [gyro_status] = take(frame, at::GYRO + at::CLUSTER - 1);
    let [accel_status] = take(frame, at::GYRO + 2 * at::CLUSTER - 1);
    let end = frame.len().checked_sub(at::COUNTER_FROM_END)?;
    let [counter, high, low] = take(frame, end);
    let valid = if status::is_good(gyro_status | accel_status) {
        Axes::ALL
    } else {
        Axes::new(
            status::valid_axes(gyro_status),
            status::valid_axes(accel_status),
        )
    };
    Some(Reading {
        counter: Some(counter.into()),
        latency_us: Some(u16::from_be_bytes([high, low])),
        ..Reading::new(RawSample::Counts { gyro, accel }, Axes::ALL, valid)
    })
}

/// Reads a frame field by field.
#[inline(never)]
fn read_otherwise(frame: &[u8]) -> Option<Reading> {
    Frame::over(frame).map(|frame| frame.reading())
}

/// [`Frame::change`] of a frame with accelerometers, whose identifier stays. Words are read,
/// changed and written at once.
#[inline(always)]
pub(super) fn change_words(frame: &mut [u8], gyro: &[i32; 3], accel: &[i32; 3]) -> Option<Axes> {
    let [a, b, c] = gyro.map(|value| value.wrapping_sub(I24_MIN));
    let [d, e, f] = accel.map(|value| value.wrapping_sub(I24_MIN));
    if (a | b | c | d | e | f).cast_unsigned() > 0x00FF_FFFF {
        return change_saturated(frame, gyro, accel);
    }
    put_words(frame, gyro, accel)
}

/// Changes a frame where a value does not fit into 24 bits.
#[cold]
#[inline(never)]
fn change_saturated(frame: &mut [u8], gyro: &[i32; 3], accel: &[i32; 3]) -> Option<Axes> {
    let of = |triad: &[i32; 3]| {
        let axes = triad.iter().enumerate();
        axes.fold(0, |set, (axis, value)| {
            set | u8::from(saturate_i24(*value).1) << axis
        })
    };
    let held = |triad: &[i32; 3]| triad.map(|value| saturate_i24(value).0);
    put_words(frame, &held(gyro), &held(accel))?;
    Some(Axes::new(of(gyro), of(accel)))
}

/// Values of 24 bits. No axis saturates.
#[inline(always)]
fn put_words(frame: &mut [u8], gyro: &[i32; 3], accel: &[i32; 3]) -> Option<Axes> {
    let end = frame.len().checked_sub(at::CRC)?;
    let after = end.checked_sub(size_of::<Words>())?;
    let before = words(frame)?;
    let [a, _, c, _, _] = before;
    let [gx, gy, gz] = gyro.map(i32::cast_unsigned);
    let [ax, ay, az] = accel.map(i32::cast_unsigned);
    let low = 0x00FF_FFFF;
    let new: Words = [
        a & !low | gx & low,
        gy << 8 | gz >> 16 & 0xFF,
        gz << 16 | c & 0xFF00 | ax >> 16 & 0xFF,
        ax << 16 | ay >> 8 & 0xFFFF,
        ay << 24 | az & low,
    ];
    let mut bits = new;
    for (bits, before) in bits.iter_mut().zip(before) {
        *bits ^= before;
    }
    let (places, _) = frame.as_chunks_mut::<4>();
    for (place, word) in places.first_chunk_mut::<5>()?.iter_mut().zip(new) {
        *place = word.to_be_bytes();
    }
    let crc = crc32_mpeg2_padded_change_of(bits, after);
    let sum = u32::from_be_bytes(take(frame, end)) ^ crc;
    put(frame, end, sum.to_be_bytes());
    Some(Axes::NONE)
}

#[cfg(test)]
mod tests {
    use super::super::{Cluster, Contents, Extra, Repr, Temperatures};
    use super::*;
    use std::vec::Vec;

    fn frame(id: u8, state: &mut u64) -> Vec<u8> {
        let mut next = || {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (*state >> 33) as u32
        };
        let mut values = || [0; 3].map(|_| (next() << 8).cast_signed() >> 8);
        let (gyro, accel) = (values(), values());
        // one cluster in four is not all good
        let mut status = || (next() & next()) as u8 & if next() & 3 == 0 { 0xFF } else { 0x27 };
        let repr = Repr {
            contents: Contents::from_id(id).expect("an identifier"),
            gyro: Cluster {
                values: gyro,
                status: status(),
            },
            accel: Cluster {
                values: accel,
                status: status(),
            },
            incl: Cluster::default(),
            temperatures: [Temperatures::default(); 3],
            extra: (next() & 0xFF_FFFF, 1),
            counter: next() as u8,
            latency_us: next() as u16,
        };
        let mut buffer = [0; 64];
        let len = repr.emit(&mut buffer).expect("room");
        buffer[..len].to_vec()
    }

    /// Reading and changing by words gives the same as by fields, for frames of every length with
    /// accelerometers, saturated or not.
    #[test]
    fn words_do_what_fields_do() {
        let mut state = 1;
        let mut saturated = 0;
        for round in 0..4000 {
            let id = [0x91, 0x93, 0xA5, 0xA7, 0xF1, 0xF7, 0x99, 0xAF][round % 8];
            let mut by_words = frame(id, &mut state);
            let mut by_fields = by_words.clone();
            let whole = Frame::new_checked(&by_words[..]).expect("good");
            assert_eq!(read(&by_words), Some(whole.reading()), "{id:#x}");
            let [gyro, accel] = [0, 1].map(|triad| {
                let [a, b, c] = take::<3>(&by_words, 22 + triad);
                [a, b, c].map(|byte| (i32::from(byte) - 128) * [50_000, 66_500][round % 2])
            });
            let axes = change_words(&mut by_words, &gyro, &accel).expect("long enough");
            let expected = Frame::over(&mut by_fields[..])
                .and_then(|mut frame| frame.change(gyro, accel, None::<Extra>));
            assert_eq!(Some(axes), expected, "{id:#x}");
            assert_eq!(by_words, by_fields, "{id:#x}");
            Frame::new_checked(&by_words[..]).expect("its CRC is right");
            saturated += u32::from(axes != Axes::NONE);
        }
        assert!((100..3900).contains(&saturated), "{saturated}");
    }
}
