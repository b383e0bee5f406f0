//! The receiver of a scenario: the table `[gnss]`.

use super::Scenario;
use host_core::error::Error;
use host_core::simulator::gnss::{AntennaPrior, GnssSpec};

impl Scenario {
    /// The receiver with lever arm and delay as configured in the unit.
    #[must_use]
    pub fn receiver(&self) -> GnssSpec {
        let unit = &self.unit().receiver;
        let assumed_antenna = AntennaPrior {
            age_s: [unit.fix_delay_ms, unit.fix_delay_sigma_ms].map(|ms| 1e-3 * ms),
            lever_arm_m: unit.lever_arm_m,
            lever_arm_sigma_m: unit.lever_arm_sigma(),
        };
        GnssSpec {
            assumed_antenna,
            ..self.gnss
        }
    }

    /// Checks that there is one fix a second, for commands that cannot use more.
    ///
    /// # Errors
    /// Another rate.
    pub fn one_fix_a_second(&self, command: &str) -> Result<(), Error> {
        let rate = self.gnss.rate_hz;
        if rate == 1 {
            return Ok(());
        }
        let problem = format!("is {rate}, but `{command}` takes one fix a second");
        let remedy = "leave it out; `simulate` writes, and `start --rate-hz` tries, more";
        Err(self.bad("gnss.rate_hz", problem, remedy))
    }

    /// The fixes in a line for reports: white noise, and the further errors that are on.
    #[must_use]
    pub fn fixes(&self) -> String {
        let gnss = &self.receiver();
        let rate = gnss.rate_hz;
        let (horizontal, vertical) = (gnss.horizontal_m, gnss.vertical_m);
        let speed = gnss.velocity_mps;
        let mut text =
            format!("{rate} Hz, {horizontal} m horizontal, {vertical} m vertical, {speed} m/s");
        if gnss.coloured.is_on() {
            text.push_str(", and coloured errors");
        }
        if gnss.told_factor != 1.0 {
            text.push_str(&format!("; reported accuracy times {}", gnss.told_factor));
        }
        let streets = gnss.multipath.in_streets;
        for (on, name) in [
            (gnss.gaps.mean_interval_s > 0.0, "gaps"),
            (gnss.multipath.mean_interval_s > 0.0, "multipath"),
            (
                gnss.multipath.mean_interval_s > 0.0 && streets,
                "in streets only",
            ),
        ] {
            if on {
                text.push_str(&format!("; {name}"));
            }
        }
        let antenna = gnss.antenna_prior();
        if let Some(latency_s) = gnss.latency_s {
            let [configured_s, _] = antenna.age_s;
            text.push_str(&format!(
                "; {latency_s} s late, configured {configured_s} s"
            ));
        }
        if let Some(arm) = gnss.lever_arm_m {
            let configured = antenna.lever_arm_m;
            text.push_str(&format!(
                "; lever arm {arm:?} m, configured {configured:?} m"
            ));
        }
        text
    }

    /// Checks the ranges of the table and the tables in it.
    pub(super) fn check_receiver(&self) -> Result<(), Error> {
        let gnss = &self.gnss;
        let (coloured, gaps, multipath) = (&gnss.coloured, &gnss.gaps, &gnss.multipath);
        self.in_ranges(&[
            ("gnss.horizontal_m", gnss.horizontal_m, 1e-3, 1e3),
            ("gnss.vertical_m", gnss.vertical_m, 1e-3, 1e3),
            ("gnss.velocity_mps", gnss.velocity_mps, 1e-4, 1e2),
            ("gnss.told_factor", gnss.told_factor, 0.01, 100.0),
            ("gnss.latency_s", gnss.latency_s.unwrap_or(0.0), 0.0, 5.0),
            ("gnss.rate_hz", f64::from(gnss.rate_hz), 1.0, 20.0),
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
        for (axis, metres) in gnss.lever_arm_m.into_iter().flatten().enumerate() {
            let key = format!("gnss.lever_arm_m[{axis}]");
            self.in_ranges(&[(&key, metres, -100.0, 100.0)])?;
        }
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
    use super::*;

    #[test]
    fn the_receiver_has_only_the_errors_of_the_file() {
        assert_eq!(load_text("").unwrap().gnss, GnssSpec::default());
        let text = "[gnss]\ntold_factor = 0.5\n[gnss.coloured]\nhorizontal_m = 2.5";
        let gnss = load_text(text).unwrap().gnss;
        assert_eq!((gnss.told_factor, gnss.horizontal_m), (0.5, 1.0));
        let coloured = gnss.coloured;
        assert_eq!((coloured.horizontal_m, coloured.time_s), (2.5, 60.0));
        let white = "1 Hz, 1 m horizontal, 1.5 m vertical, 0.05 m/s";
        assert_eq!(load_text("").unwrap().fixes(), white);
        let text = format!("{text}\n[gnss.gaps]\nmean_interval_s = 60");
        let want = format!("{white}, and coloured errors; reported accuracy times 0.5; gaps");
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
        assert!(message("[gnss.coloured]\ntime = 9").contains(":2: 'gnss.coloured.time'"));
        assert!(message("[gnss]\nlatency_s = 5.1").contains("'gnss.latency_s' is 5.1"));
        let text = "[gnss]\nlever_arm_m = [0, 200, 0]";
        assert!(message(text).contains("'gnss.lever_arm_m[1]' is 200"));
        assert!(message("[gnss]\nlever_arm_m = [0, 2]").contains(":2: 'gnss.lever_arm_m'"));
        assert!(message("[gnss]\nrate_hz = 0").contains("'gnss.rate_hz' is 0"));
        assert!(message("[gnss]\nrate_hz = 21").contains("'gnss.rate_hz' is 21"));
        assert!(message("[gnss]\nrate_hz = 2.5").contains(":2: 'gnss.rate_hz'"));
        assert!(message("[gnss]\nassumed_antenna = 1").contains(":2: 'gnss.assumed_antenna'"));
    }

    /// Lever arm and delay that filters assume are the unit's, where the scenario gives them.
    #[test]
    fn filters_get_the_units_lever_arm_and_delay_where_the_scenario_gives_them() {
        let unit =
            "[receiver]\nlever_arm_m = [1, 0, -2]\nlever_arm_sigma_m = 0.3\nfix_delay_ms = 80";
        let dir = tempfile::tempdir().unwrap();
        let medium = crate::presets::text("medium").unwrap();
        let start = medium.find("[receiver]").unwrap();
        let end = start + medium[start..].find("\n\n").unwrap();
        let text = format!("{}{unit}{}", &medium[..start], &medium[end..]);
        std::fs::write(dir.path().join("u.toml"), text).unwrap();
        let receiver = |keys: &str| {
            let file = dir.path().join("s.toml");
            std::fs::write(&file, format!("unit = 'u.toml'\n[gnss]\n{keys}")).unwrap();
            let scenario = Scenario::load(&file.to_string_lossy()).unwrap();
            (scenario.receiver().antenna_prior(), scenario.fixes())
        };
        assert_eq!(receiver("").0, AntennaPrior::default());
        let (antenna, text) = receiver("latency_s = 0.5");
        assert_eq!(
            (antenna.age_s, antenna.lever_arm_m),
            ([0.08, 0.1], [0.0; 3])
        );
        assert!(text.ends_with("; 0.5 s late, configured 0.08 s"), "{text}");
        let (antenna, text) = receiver("lever_arm_m = [2.5, 0, 0]");
        assert_eq!(
            (antenna.age_s, antenna.lever_arm_m),
            ([0.0; 2], [1.0, 0.0, -2.0])
        );
        assert_eq!(antenna.lever_arm_sigma_m, 0.3);
        let want = "; lever arm [2.5, 0.0, 0.0] m, configured [1.0, 0.0, -2.0] m";
        assert!(text.ends_with(want), "{text}");
    }

    #[test]
    fn commands_that_take_one_fix_a_second_refuse_more() {
        let scenario = load_text("[gnss]\nrate_hz = 5").unwrap();
        let message = scenario.one_fix_a_second("run").unwrap_err().to_string();
        assert!(message.contains("'gnss.rate_hz' is 5") && message.contains("`run`"));
        assert!(load_text("").unwrap().one_fix_a_second("run").is_ok());
    }
}
