//! Writes a log again with other raw samples, in the same way as the device: the words change, the
//! checksum changes by the same difference, and every other byte stays.

use crate::recordings::session::complain;
use firmware::sample::{Axes as Valid, Lsb, RawSample};
use firmware::wire::framer::LONGEST;
use firmware::wire::{Change, Checked, Framer, ImuFormat, Settings};
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::sins::Increment;
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;

/// A log whose raw samples have become a record.
#[derive(Debug, Clone)]
pub struct Log {
    /// The file.
    pub file: PathBuf,
    pub(super) mounting: Axes,
    pub(super) lsb: Lsb,
}

/// Remainders of rounding so far, counts of gyros and accelerometers.
type Remainder = [Vector3<f64>; 2];

impl Log {
    /// See [`crate::recordings::corrected::Original::without`]. Counts stay whole numbers; the
    /// remainders of rounding are carried over, as in the device.
    pub fn without(&self, taken: &[Increment]) -> Result<Vec<u8>, Error> {
        let bytes = crate::recordings::read::read(&self.file)?;
        let mut out = Vec::with_capacity(bytes.len());
        let mut taken = taken.iter();
        let mut left = Remainder::default();
        let mut framer = Framer::new(ImuFormat::Novatel);
        for piece in bytes.chunks(LONGEST) {
            framer.push(piece);
            while let Some(event) = framer.next_event() {
                let at = out.len();
                out.extend_from_slice(event.bytes());
                self.frame(&mut out[at..], &mut taken, &mut left)?;
            }
        }
        while let Some(event) = framer.flush() {
            let at = out.len();
            out.extend_from_slice(event.bytes());
            self.frame(&mut out[at..], &mut taken, &mut left)?;
        }
        match taken.next() {
            None => Ok(out),
            Some(_) => Err(self.changed()),
        }
    }

    /// Changes a message that holds a good raw sample.
    fn frame<'t>(
        &self,
        message: &mut [u8],
        taken: &mut impl Iterator<Item = &'t Increment>,
        left: &mut Remainder,
    ) -> Result<(), Error> {
        let Ok(mut frame) = Checked::new(ImuFormat::Novatel, message) else {
            return Ok(());
        };
        let Some(reading) = frame.read().ok().filter(|r| r.valid == Valid::ALL) else {
            return Ok(());
        };
        let RawSample::Counts { gyro, accel } = reading.sample else {
            return Ok(());
        };
        let taken = taken.next().ok_or_else(|| self.changed())?;
        let gyro_counts = self.counts(gyro, taken.dtheta / self.lsb.rad, &mut left[0]);
        let accel_counts = self.counts(accel, taken.dv / self.lsb.mps, &mut left[1]);
        if (gyro_counts, accel_counts) == (gyro, accel) {
            return Ok(());
        }
        let sample = RawSample::Counts {
            gyro: gyro_counts,
            accel: accel_counts,
        };
        let change = Change {
            sample: &sample,
            mark: false,
            settings: &Settings::DEFAULT,
        };
        frame.change(&change).map(drop).map_err(|_| self.changed())
    }

    /// Subtracts the correction, given in axes of the vehicle, from the counts.
    fn counts(&self, raw: [i32; 3], taken: Vector3<f64>, left: &mut Vector3<f64>) -> [i32; 3] {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let turn = Matrix3::from_columns(&axes.map(|axis| self.mounting.turn(axis)));
        let due = *left - turn.transpose() * taken;
        let whole = due.map(f64::round);
        *left = due - whole;
        let [x, y, z] = whole.into();
        let add = |raw: i32, whole: f64| raw.saturating_add(whole as i32);
        [add(raw[0], x), add(raw[1], y), add(raw[2], z)]
    }

    fn changed(&self) -> Error {
        let problem = "are not those that were read before".to_owned();
        let remedy = "do not change the file while it is replayed";
        complain(&self.file, "raw samples", problem, remedy)
    }
}
