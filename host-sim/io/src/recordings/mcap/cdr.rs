//! CDR, the serialization of ROS 2 (OMG DDS-XTypes, encoding version 1), and the messages that are
//! read.
//!
//! A message begins with four bytes of encapsulation: a kind (0 big-endian, 1 little-endian), then
//! options. Numbers are aligned to their own size, counted from the byte after them. The fields are
//! those of the ROS 2 packages `sensor_msgs` and `geometry_msgs`. This reader is written here
//! because it is shorter than the declarations that a crate for CDR would need.

/// Fault of a message, as the rest of a sentence whose subject is the message.
type Fault = String;

/// `std_msgs/Header`: the stamp, ns since 1970.
pub(super) type Stamp = i64;

/// `sensor_msgs/msg/Imu` without its orientation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Imu {
    pub(super) stamp: Stamp,
    /// rad/s
    pub(super) gyro: [f64; 3],
    /// Specific force, m/s2; `z` is +9.8 at rest if it points up.
    pub(super) accel: [f64; 3],
    /// Whether the sensor has gyros and accelerometers. A first covariance of -1 says that it has
    /// none.
    pub(super) has: [bool; 2],
}

/// `sensor_msgs/msg/NavSatFix`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NavSatFix {
    pub(super) stamp: Stamp,
    /// -1 no fix, 0 fix, 1 with satellite-based augmentation, 2 with a ground station.
    pub(super) status: i8,
    /// Latitude and longitude, deg, height above the ellipsoid, m.
    pub(super) position: [f64; 3],
    /// Variances east, north, up, m2.
    pub(super) variance: [f64; 3],
    /// 0 unknown, 1 approximated, 2 diagonal known, 3 known.
    pub(super) variance_kind: u8,
}

/// `geometry_msgs/msg/TwistStamped` and `TwistWithCovarianceStamped`: the linear part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Twist {
    pub(super) stamp: Stamp,
    /// East, north, up, m/s.
    pub(super) velocity: [f64; 3],
    /// Variances of these, m2/s2.
    pub(super) variance: Option<[f64; 3]>,
}

impl Imu {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, Fault> {
        let mut cdr = Cdr::new(bytes)?;
        let stamp = cdr.header()?;
        cdr.doubles::<4>()?; // orientation
        cdr.doubles::<9>()?;
        let gyro = cdr.doubles()?;
        let gyro_variance = cdr.doubles::<9>()?;
        let accel = cdr.doubles()?;
        let accel_variance = cdr.doubles::<9>()?;
        Ok(Self {
            stamp,
            gyro,
            accel,
            has: [gyro_variance, accel_variance].map(|v| v[0].to_bits() != (-1.0_f64).to_bits()),
        })
    }
}

impl NavSatFix {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, Fault> {
        let mut cdr = Cdr::new(bytes)?;
        let stamp = cdr.header()?;
        let status = i8::from_le_bytes(cdr.aligned()?);
        cdr.aligned::<2>()?; // satellite systems
        let position = cdr.doubles()?;
        let [east, _, _, _, north, _, _, _, up] = cdr.doubles()?;
        let [variance_kind] = cdr.aligned()?;
        Ok(Self {
            stamp,
            status,
            position,
            variance: [east, north, up],
            variance_kind,
        })
    }
}

impl Twist {
    /// `with_covariance`: which of the two messages it is.
    pub(super) fn read(bytes: &[u8], with_covariance: bool) -> Result<Self, Fault> {
        let mut cdr = Cdr::new(bytes)?;
        let stamp = cdr.header()?;
        let velocity = cdr.doubles()?;
        cdr.doubles::<3>()?; // rotation
        let variance = match with_covariance {
            true => {
                let all = cdr.doubles::<36>()?;
                Some([all[0], all[7], all[14]])
            }
            false => None,
        };
        Ok(Self {
            stamp,
            velocity,
            variance,
        })
    }
}

/// Reads the values of a message in order.
struct Cdr<'a> {
    /// After the encapsulation.
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> Cdr<'a> {
    fn new(message: &'a [u8]) -> Result<Self, Fault> {
        let Some((head, bytes)) = message.split_first_chunk::<4>() else {
            return Err(format!("has {} bytes", message.len()));
        };
        match head {
            [0, kind @ (0 | 1), ..] => Ok(Self {
                bytes,
                at: 0,
                big_endian: *kind == 0,
            }),
            [high, low, ..] => Err(format!(
                "has the CDR encapsulation {high:02x}{low:02x}, not 0000 or 0001"
            )),
        }
    }

    /// The next value of `N` bytes, returned in little-endian order.
    fn aligned<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let start = self.at.next_multiple_of(N);
        let value = self.bytes.get(start..).and_then(|b| b.first_chunk::<N>());
        let Some(&(mut value)) = value else {
            return Err(format!("is cut short after {} bytes", self.bytes.len() + 4));
        };
        self.at = start + N;
        if self.big_endian {
            value.reverse();
        }
        Ok(value)
    }

    fn doubles<const N: usize>(&mut self) -> Result<[f64; N], Fault> {
        let mut out = [0.0; N];
        for value in &mut out {
            *value = f64::from_le_bytes(self.aligned()?);
        }
        Ok(out)
    }

    /// `std_msgs/Header`: seconds, nanoseconds, name of the frame.
    fn header(&mut self) -> Result<Stamp, Fault> {
        let seconds = i64::from(i32::from_le_bytes(self.aligned()?));
        let nanoseconds = i64::from(u32::from_le_bytes(self.aligned()?));
        let length = u32::from_le_bytes(self.aligned()?) as usize;
        self.at = self.at.saturating_add(length).min(self.bytes.len());
        Ok(seconds * 1_000_000_000 + nanoseconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `header` in little-endian: 1.5 s, frame "gps". The length of a string counts its zero byte.
    const HEADER: [u8; 20] = [
        0, 1, 0, 0, 1, 0, 0, 0, 0x00, 0x65, 0xCD, 0x1D, 4, 0, 0, 0, b'g', b'p', b's', 0,
    ];

    /// The message after its header, in either byte order.
    fn message(fields: &[(usize, u64)], big_endian: bool) -> Vec<u8> {
        let mut out = HEADER.to_vec();
        for (size, bits) in fields {
            let start = 4 + (out.len() - 4).next_multiple_of(*size);
            out.resize(start, 0xEE); // padding may hold anything
            out.extend(&bits.to_le_bytes()[..*size]);
        }
        if big_endian {
            // numbers of the header, then the fields, each reversed in its position
            out[1] = 0;
            for at in [4, 8, 12] {
                out[at..at + 4].reverse();
            }
            let mut at: usize = 16;
            for (size, _) in fields {
                at = at.next_multiple_of(*size);
                out[4 + at..4 + at + size].reverse();
                at += size;
            }
        }
        out
    }

    fn doubles(values: &[f64]) -> Vec<(usize, u64)> {
        values.iter().map(|x| (8, x.to_bits())).collect()
    }

    #[test]
    fn both_byte_orders_read_alike() {
        let mut values = vec![0.0; 37];
        values[13..16].copy_from_slice(&[0.1, -0.2, 0.3]);
        values[25..28].copy_from_slice(&[1.0, 2.0, 9.8]);
        values[28] = -1.0;
        let fix: Vec<(usize, u64)> = [(1, 0xFF), (2, 1)]
            .into_iter()
            .chain(doubles(&[47.5, 8.25, 400.0]))
            .chain(doubles(&[1.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 9.0]))
            .chain([(1, 2)])
            .collect();
        let mut twist = doubles(&[3.0, 4.0, -0.5, 0.0, 0.0, 0.0]);
        twist.extend(doubles(&std::array::from_fn::<f64, 36, _>(|k| k as f64)));
        for big_endian in [false, true] {
            let imu = Imu::read(&message(&doubles(&values), big_endian)).unwrap();
            assert_eq!((imu.stamp, imu.has), (1_500_000_000, [true, false]));
            assert_eq!((imu.gyro, imu.accel), ([0.1, -0.2, 0.3], [1.0, 2.0, 9.8]));
            let fix = NavSatFix::read(&message(&fix, big_endian)).unwrap();
            assert_eq!((fix.status, fix.variance_kind), (-1, 2));
            assert_eq!(fix.position, [47.5, 8.25, 400.0]);
            assert_eq!(fix.variance, [1.0, 4.0, 9.0]);
            let bytes = message(&twist, big_endian);
            let twist = Twist::read(&bytes, true).unwrap();
            assert_eq!(twist.variance, Some([0.0, 7.0, 14.0]));
            assert_eq!(twist.velocity, [3.0, 4.0, -0.5]);
            assert_eq!(Twist::read(&bytes, false).unwrap().variance, None);
        }
    }

    #[test]
    fn a_bad_message_says_what_is_wrong() {
        let whole = message(&doubles(&[0.0; 37]), false);
        assert!(Imu::read(&whole).is_ok());
        for length in 0..whole.len() {
            assert!(Imu::read(&whole[..length]).is_err(), "{length}");
        }
        let mut other = whole.clone();
        other[1] = 7;
        let why = Imu::read(&other).unwrap_err();
        assert_eq!(why, "has the CDR encapsulation 0007, not 0000 or 0001");
        let mut long = whole;
        long[12..16].copy_from_slice(&[0xFF; 4]);
        assert!(Imu::read(&long).unwrap_err().contains("cut short"));
    }
}
