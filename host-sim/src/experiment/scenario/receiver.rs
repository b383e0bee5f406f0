//! The receiver of a scenario: the table `[gnss]`.

use super::Scenario;
use crate::error::Error;

impl Scenario {
    /// Ranges of the table and the tables in it.
    pub(super) fn check_receiver(&self) -> Result<(), Error> {
        let gnss = &self.gnss;
        let coloured = &gnss.coloured;
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
        ])
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
    }

    #[test]
    fn mistakes_are_named_by_key() {
        let message = |text: &str| load_text(text).unwrap_err().to_string();
        assert!(message("[gnss]\ntold_factor = 0").contains("'gnss.told_factor' is 0"));
        let text = "[gnss.coloured]\ntime_s = 0";
        assert!(message(text).contains("'gnss.coloured.time_s' is 0"));
        let text = "[gnss.coloured]\nhorizontal_m = -1";
        assert!(message(text).contains("'gnss.coloured.horizontal_m' is -1"));
        assert!(message("[gnss.coloured]\ntime = 9").contains(":2: 'time'"));
    }
}
