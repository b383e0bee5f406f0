//! Options of `replay` for what the files of a recording do not contain.

use crate::options::{refused, within};
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::inertial::units::DEG;
use host_io::recordings::record::Record;
use host_unit::Unit;

/// Time offset, lever arm and heading, which files of some formats cannot contain.
#[derive(Debug, ClapArgs)]
pub struct RecordOptions {
    /// Added to the times of the fixes to give the IMU's, s
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    time_offset: Option<f64>,
    /// Estimate that offset from the motion, within 40 s of the given one, else farther away
    #[arg(long)]
    pub estimate_time_offset: bool,
    /// From the IMU to the antenna: forward, right, down, m [default: that of the recording, else
    /// of the unit]
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    lever_arm: Vec<f64>,
    /// Rough heading at the first fix, deg clockwise from north, that helps to find the attitude
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    heading: Option<f64>,
    /// Its standard deviation, deg
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 10.0,
        requires = "heading"
    )]
    heading_sigma: f64,
}

impl RecordOptions {
    /// Sets the values of `record` from the options, else from the unit.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn apply(&self, record: &mut Record, unit: &Unit) -> Result<(), Error> {
        if let Some(offset) = self.time_offset {
            let offset = within("--time-offset", offset, [-1e9, 1e9])?;
            record.move_fixes(offset - record.given_offset_s.unwrap_or(0.0));
            record.given_offset_s = Some(offset);
        }
        let metres = |arm: &[f64; 3]| arm.iter().all(|x| x.abs() <= 100.0);
        match (
            <[f64; 3]>::try_from(&self.lever_arm[..]),
            &self.lever_arm[..],
        ) {
            (Ok(arm), _) if metres(&arm) => record.lever_arm_m = Some(arm),
            (Err(_), []) => {
                let of_unit = unit.receiver.lever_arm_m;
                record.lever_arm_m.get_or_insert(of_unit);
            }
            _ => {
                return Err(refused(
                    "--lever-arm",
                    format!("is {:?}", self.lever_arm),
                    "give forward,right,down in m, each -100 to 100",
                ));
            }
        }
        if let Some(heading) = self.heading {
            if record.initial_attitude.is_some() {
                let problem = "helps to find an attitude, and this recording gives one, or stands \
                               still for it";
                return Err(refused("--heading", problem, "leave it out"));
            }
            let heading = within("--heading", heading, [-360.0, 360.0])?;
            let sigma = within("--heading-sigma", self.heading_sigma, [0.01, 180.0])?;
            record.rough_heading = Some([heading * DEG, sigma * DEG]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A recording's own lever arm counts, also where it is zero, before that of the unit.
    #[test]
    fn a_stated_lever_arm_of_zero_counts() {
        let mut unit = Unit::preset("tactical").unwrap();
        unit.receiver.lever_arm_m = [2.0, -1.0, -1.5];
        let options = |lever_arm| RecordOptions {
            time_offset: None,
            estimate_time_offset: false,
            lever_arm,
            heading: None,
            heading_sigma: 10.0,
        };
        for (stated, option, want) in [
            (None, vec![], [2.0, -1.0, -1.5]),
            (Some([0.0; 3]), vec![], [0.0; 3]),
            (Some([1.0, 0.0, 0.0]), vec![], [1.0, 0.0, 0.0]),
            (Some([1.0, 0.0, 0.0]), vec![0.0; 3], [0.0; 3]),
        ] {
            let mut record = Record {
                lever_arm_m: stated,
                ..Record::default()
            };
            options(option).apply(&mut record, &unit).unwrap();
            assert_eq!(record.lever_arm_m, Some(want));
        }
    }
}
