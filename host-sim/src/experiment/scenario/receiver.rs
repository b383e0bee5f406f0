//! The receiver of a scenario: the table `[gnss]`.

use super::Scenario;
use crate::error::Error;

impl Scenario {
    /// The fixes in a line for reports: white noise, and the further errors that are on.
    #[must_use]
    pub fn fixes(&self) -> String {
        let gnss = &self.gnss;
        let (horizontal, vertical) = (gnss.horizontal_m, gnss.vertical_m);
        let speed = gnss.velocity_mps;
        let mut text =
            format!("1 Hz, {horizontal} m horizontal, {vertical} m vertical, {speed} m/s");
        if gnss.coloured.is_on() {
            text.push_str(", and coloured errors");
        }
        if gnss.told_factor != 1.0 {
            text.push_str(&format!("; told accuracy times {}", gnss.told_factor));
        }
        for (on, name) in [
            (gnss.gaps.mean_interval_s > 0.0, "gaps"),
            (gnss.multipath.mean_interval_s > 0.0, "multipath"),
        ] {
            if on {
                text.push_str(&format!("; {name}"));
            }
        }
        text
    }

    /// Ranges of the table and the tables in it.
    pub(super) fn check_receiver(&self) -> Result<(), Error> {
        let gnss = &self.gnss;
        let (coloured, gaps, multipath) = (&gnss.coloured, &gnss.gaps, &gnss.multipath);
        self.in_ranges(&[
            ("gnss.horizontal_m", gnss.horizontal_m, 1e-3, 1e3),
            ("gnss.vertical_m", gnss.vertical_m, 1e-3, 1e3),
            ("gnss.velocity_mps", gnss.velocity_mps, 1e-4, 1e2),
            ("gnss.told_factor", gnss.told_factor, 0.01, 100.0),
            (
                "gnss.coloured.horizontal_m",
                coloured.horizontal_m,
                0.0,
                1e3,
            ),
            ("gnss.coloured.vertical_m", coloured.vertical_m, 0.0, 1e3),
            (
                "gnss.coloured.velocity_mps",
                coloured.velocity_mps,
                0.0,
                1e2,
            ),
            ("gnss.coloured.time_s", coloured.time_s, 0.1, 1e5),
            (
                "gnss.coloured.velocity_time_s",
                coloured.velocity_time_s,
                0.1,
                1e5,
            ),
            ("gnss.gaps.mean_interval_s", gaps.mean_interval_s, 0.0, 1e6),
            ("gnss.gaps.mean_length_s", gaps.mean_length_s, 0.1, 1e5),
            (
                "gnss.multipath.mean_interval_s",
                multipath.mean_interval_s,
                0.0,
                1e6,
            ),
            (
                "gnss.multipath.mean_length_s",
                multipath.mean_length_s,
                0.1,
                1e5,
            ),
            (
                "gnss.multipath.horizontal_m",
                multipath.horizontal_m,
                0.0,
                1e3,
            ),
            ("gnss.multipath.vertical_m", multipath.vertical_m, 0.0, 1e3),
            (
                "gnss.multipath.velocity_mps",
                multipath.velocity_mps,
                0.0,
                1e2,
            ),
        ])?;
        for (table, interval_s) in [
            ("gaps", gaps.mean_interval_s),
            ("multipath", multipath.mean_interval_s),
        ] {
            if interval_s != 0.0 {
                let key = format!("gnss.{table}.mean_interval_s");
                self.in_ranges(&[(&key, interval_s, 0.1, 1e6)])?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_text;
    use crate::simulator::gnss::GnssSpec;

    #[test]
    fn the_receiver_errs_only_as_the_file_tells() {
        assert_eq!(load_text("").unwrap().gnss, GnssSpec::default());
        let text = "[gnss]\ntold_factor = 0.5\n[gnss.coloured]\nhorizontal_m = 2.5";
        let gnss = load_text(text).unwrap().gnss;
        assert_eq!((gnss.told_factor, gnss.horizontal_m), (0.5, 1.0));
        let coloured = gnss.coloured;
        assert_eq!((coloured.horizontal_m, coloured.time_s), (2.5, 60.0));
        let white = "1 Hz, 1 m horizontal, 1.5 m vertical, 0.05 m/s";
        assert_eq!(load_text("").unwrap().fixes(), white);
        let text = format!("{text}\n[gnss.gaps]\nmean_interval_s = 60");
        let want = format!("{white}, and coloured errors; told accuracy times 0.5; gaps");
        assert_eq!(load_text(&text).unwrap().fixes(), want);
    }

    #[test]
    fn mistakes_are_named_by_key() {
        let message = |text: &str| load_text(text).unwrap_err().to_string();
        assert!(message("[gnss]\ntold_factor = 0").contains("'gnss.told_factor' is 0"));
        let text = "[gnss.coloured]\ntime_s = 0";
        assert!(message(text).contains("'gnss.coloured.time_s' is 0"));
        let text = "[gnss.coloured]\nhorizontal_m = -1";
        assert!(message(text).contains("'gnss.coloured.horizontal_m' is -1"));
        let text = "[gnss.gaps]\nmean_length_s = 0";
        assert!(message(text).contains("'gnss.gaps.mean_length_s' is 0"));
        let text = "[gnss.multipath]\nmean_interval_s = 1e-9";
        assert!(message(text).contains("'gnss.multipath.mean_interval_s' is 0.000000001"));
        assert!(message("[gnss.coloured]\ntime = 9").contains(":2: 'time'"));
    }
}
