//! A whole measurement datagram as numbers, to make one or to compare two.

use super::{Cluster, Contents, Extra, Frame, Temperatures, at, seal};
use crate::wire::Error;
use crate::wire::field::{put, put_be_i24};

/// Every field of a measurement datagram. Parts that `contents` leaves out are neither read nor
/// sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Repr {
    /// Parts that are sent.
    pub contents: Contents,
    /// Gyros.
    pub gyro: Cluster,
    /// Accelerometers.
    pub accel: Cluster,
    /// Inclinometers.
    pub incl: Cluster,
    /// Temperatures of the clusters sent, in their order.
    pub temperatures: [Temperatures; 3],
    /// PPS or auxiliary value (24 bits) and its status byte.
    pub extra: (u32, u8),
    /// 2000 Hz samples, modulo 256.
    pub counter: u8,
    /// Microseconds.
    pub latency_us: u16,
}

impl Repr {
    /// Takes a datagram apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        Repr {
            contents: frame.contents(),
            gyro: frame.gyro(),
            accel: frame.accel().unwrap_or_default(),
            incl: frame.incl().unwrap_or_default(),
            temperatures: core::array::from_fn(|n| frame.temperatures(n).unwrap_or_default()),
            extra: frame.extra().unwrap_or_default(),
            counter: frame.counter(),
            latency_us: frame.latency_us(),
        }
    }

    /// Writes the datagram with its CRC, without CR LF, and returns its length. Values keep their
    /// low 24 bits.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short; it is then unchanged.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let len = self.contents.len();
        let frame = buffer.get_mut(..len).ok_or(Error::Length)?;
        put(frame, 0, [self.contents.id()]);
        let mut at = at::GYRO;
        let clusters = [
            (true, self.gyro),
            (self.contents.accel, self.accel),
            (self.contents.incl, self.incl),
        ];
        for (_, cluster) in clusters.into_iter().filter(|(sent, _)| *sent) {
            for (axis, value) in cluster.values.into_iter().enumerate() {
                put_be_i24(frame, at + 3 * axis, value);
            }
            put(frame, at + 9, [cluster.status]);
            at += at::CLUSTER;
        }
        if self.contents.temperature {
            let sent = self.temperatures.iter().take(self.contents.clusters());
            for temperatures in sent {
                for (axis, value) in temperatures.values.into_iter().enumerate() {
                    put(frame, at + 2 * axis, value.to_be_bytes());
                }
                put(frame, at + 6, [temperatures.status]);
                at += at::TEMPERATURES;
            }
        }
        if self.contents.extra != Extra::None {
            let [_, high, middle, low] = self.extra.0.to_be_bytes();
            put(frame, at, [high, middle, low, self.extra.1]);
        }
        put(frame, len - at::COUNTER_FROM_END, [self.counter]);
        put(
            frame,
            len - at::LATENCY_FROM_END,
            self.latency_us.to_be_bytes(),
        );
        seal(frame);
        Ok(len)
    }
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use crate::wire::field::hex;

    /// Accepted by the two third-party clients (`pystim300`, `vortexntnu/stim300-driver`): 10, -5,
    /// 0.25 deg/s and 0.1, -0.2, 9.80665 m/s^2 over 1 ms with the 10 g range.
    const GOLDEN: [u8; 28] = hex("910051ecffd70a00020c000001a3fffcb900a0ac000000785742dbb0");

    #[test]
    fn golden_frame_reads_and_is_made_again() {
        let frame = Frame::new_checked(GOLDEN).unwrap();
        // 10 deg/s for 1 ms at 2^21 counts a degree, and so on
        assert_eq!(frame.gyro().values, [20972, -10486, 524]);
        assert_eq!(frame.accel().unwrap().values, [419, -839, 41132]);
        assert_eq!((frame.counter(), frame.latency_us()), (0, 120));
        assert_eq!(frame.reading().valid, Axes::ALL);
        let mut made = [0; 28];
        assert_eq!(Repr::parse(&frame).emit(&mut made), Ok(28));
        assert_eq!(made, GOLDEN);
        assert_eq!(Repr::parse(&frame).emit(&mut [0; 27]), Err(Error::Length));
    }

    /// Tables 5-21 and 5-22 and the lengths of section 12: identifier (none, PPS, AUX), bytes,
    /// dummy bytes.
    #[test]
    fn identifiers_lengths_and_dummy_bytes() {
        let table = [
            (0x90, 0xF0, 0x98, 18, 2),
            (0x91, 0xF1, 0x99, 28, 0),
            (0x92, 0xF2, 0x9A, 28, 0),
            (0x93, 0xF3, 0x9B, 38, 2),
            (0x94, 0xF4, 0x9C, 25, 3),
            (0xA5, 0xF5, 0xAD, 42, 2),
            (0xA6, 0xF6, 0xAE, 42, 2),
            (0xA7, 0xF7, 0xAF, 59, 1),
        ];
        let mut known = 0;
        for (plain, pps, aux, len, dummies) in table {
            for (id, len) in [(plain, len), (pps, len + 4), (aux, len + 4)] {
                let contents = Contents::from_id(id).unwrap();
                assert_eq!(contents.id(), id);
                assert_eq!(contents.len(), len, "{id:#x}");
                assert_eq!((len - 4 + dummies) % 4, 0);
                known += 1;
            }
        }
        let all = (0..=255).filter(|&id| Contents::from_id(id).is_some());
        assert_eq!(all.count(), known);
    }

    #[test]
    fn words_saturate_and_say_so() {
        let mut bytes = GOLDEN;
        let mut frame = Frame::new_checked(&mut bytes).unwrap();
        let saturated = frame
            .change([0x0080_0000, -1, 2], [3, -0x0080_0001, 4], None)
            .unwrap();
        assert_eq!(saturated, Axes(0b01_0001));
        assert_eq!(frame.gyro().values, [0x007F_FFFF, -1, 2]);
        assert_eq!(frame.accel().unwrap().values, [3, -0x0080_0000, 4]);
        assert!(Frame::new_checked(bytes).is_ok());
        // status, counter and latency as they came
        assert_eq!((bytes[10], &bytes[20..24]), (0, &GOLDEN[20..24]));
    }

    #[test]
    fn families_change_without_touching_the_data() {
        let contents = Contents::from_id(0xF7).unwrap();
        let mut repr = Repr::parse(&Frame::new_checked(GOLDEN).unwrap());
        repr.contents = contents;
        repr.extra = (0x00AB_CDEF, 0x11);
        let mut bytes = [0; MAX_LEN];
        assert_eq!(repr.emit(&mut bytes), Ok(MAX_LEN));
        let mut frame = Frame::new_checked(bytes).unwrap();
        let (gyro, accel) = (frame.gyro().values, frame.accel().unwrap().values);
        let saturated = frame.change(gyro, accel, Some(Extra::Aux));
        assert_eq!(saturated, Some(Axes::NONE));
        assert_eq!(frame.buffer[0], 0xAF);
        assert_eq!(frame.buffer[1..59], bytes[1..59]);
        assert_eq!(scan(&frame.buffer), Scan::Frame(63));
        assert_eq!(frame.extra(), Some((0x00AB_CDEF, 0x11)));
        frame.change(gyro, accel, Some(Extra::Pps)).unwrap();
        assert_eq!(frame.buffer, bytes);
    }

    #[test]
    fn status_names_the_bad_axes() {
        assert_eq!(status::valid_axes(0), 0b111);
        assert_eq!(status::valid_axes(status::CONDITIONS), 0b111);
        assert_eq!(status::valid_axes(status::OVERLOAD | 0b010), 0b101);
        assert_eq!(status::valid_axes(status::CHANNEL), 0);
        assert_eq!(status::valid_axes(status::START_UP), 0);
        assert_eq!(status::valid_axes(status::INTEGRITY | 1), 0);
    }

    #[test]
    fn a_damaged_frame_is_refused() {
        assert_eq!(Frame::new_checked(&GOLDEN[..27]).err(), Some(Error::Length));
        let mut bytes = GOLDEN;
        bytes[0] = 0x00;
        assert_eq!(Frame::new_checked(bytes).err(), Some(Error::Header));
        bytes = GOLDEN;
        bytes[20] ^= 1;
        assert_eq!(Frame::new_checked(bytes).err(), Some(Error::Checksum));
        assert_eq!(scan(&bytes), Scan::BadChecksum);
        assert_eq!(scan(&GOLDEN[..5]), Scan::Partial(28));
        assert_eq!(scan(b"\r\n\x91"), Scan::Other(2));
        assert_eq!(scan(b"\r\x91"), Scan::Garbage);
    }
}
