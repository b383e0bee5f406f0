//! The environment of a scenario: the tables `[ambient]` and `[power]`.

use super::Scenario;
use host_core::error::Error;
use host_core::simulator::imu::world::StartName;

impl Scenario {
    /// Sets the start of the unit (cold, warm or hot) by name.
    ///
    /// # Errors
    /// An unknown name; a cold start with a soak.
    pub fn set_start(&mut self, name: &str) -> Result<(), Error> {
        let names = StartName::NAMES;
        let found = names.iter().find(|(known, _)| *known == name);
        let Some((_, start)) = found else {
            let names = names.map(|(name, _)| name);
            return Err(Error::unknown("start", name, &names));
        };
        self.power.start = *start;
        self.check_world()
    }

    /// Checks the ranges of the two tables, and rejects contradictory values.
    pub(super) fn check_world(&self) -> Result<(), Error> {
        let (air, power) = (&self.ambient, &self.power);
        self.in_ranges(&[
            ("ambient.offset_k", air.offset_k, -80.0, 60.0),
            ("ambient.day_k", air.day_k, 0.0, 30.0),
            ("ambient.hour", air.hour, 0.0, 24.0),
            ("ambient.lapse_kpkm", air.lapse_kpkm, -20.0, 20.0),
            ("power.soak_s", power.soak_s.unwrap_or(0.0), 0.0, 1e6),
            ("power.on_before_s", power.on_before_s, 0.0, 1e5),
            ("power.age_days", power.age_days, 0.0, 1e4),
            ("power.power_ons", power.power_ons.into(), 0.0, 1e4),
        ])?;
        for (k, step) in air.step.iter().enumerate() {
            let key = |field: &str| format!("ambient.step[{k}].{field}");
            self.in_ranges(&[
                (&key("at_s"), step.at_s, -1e6, 1e6),
                (&key("duration_s"), step.duration_s, 0.0, 1e6),
                (&key("change_k"), step.change_k, -80.0, 80.0),
            ])?;
        }
        let drawn = [StartName::Cold, StartName::Mixed].contains(&power.start);
        if drawn && power.soak_s.is_some() {
            let problem = "is given, but only a warm or hot start has a soak of given length";
            let remedy = "leave it out, or write start = \"warm\"";
            return Err(self.bad("power.soak_s", problem.into(), remedy));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_text;
    use super::*;

    #[test]
    fn the_world_reaches_the_simulated_imu() {
        let text = "[power]\nstart = 'warm'\nsoak_s = 1200\nage_days = 90\n[ambient]\n\
                    offset_k = -15\nday_k = 6\nhour = 7.5\nlapse_kpkm = 6.5\n\
                    [[ambient.step]]\nat_s = 300\nduration_s = 60\nchange_k = -8";
        let world = load_text(text).unwrap().imu_spec().world;
        assert_eq!(
            (world.power.start, world.power.soak_s),
            (StartName::Warm, Some(1200.0))
        );
        assert_eq!(
            (world.power.age_days, world.power.on_before_s),
            (90.0, 7200.0)
        );
        assert_eq!(world.ambient.step.len(), 1);
        assert_eq!(
            Scenario::default().imu_spec().world,
            host_core::simulator::imu::World::default()
        );
        let mut scenario = Scenario::default();
        scenario.set_start("hot").unwrap();
        assert_eq!(scenario.imu_spec().world.power.start, StartName::Hot);
        assert!(
            scenario
                .set_start("luke")
                .unwrap_err()
                .to_string()
                .contains("start 'luke'")
        );
    }

    #[test]
    fn mistakes_are_named_by_key() {
        let message = |text: &str| load_text(text).unwrap_err().to_string();
        assert!(message("[ambient]\nday_k = 31").contains("'ambient.day_k' is 31"));
        assert!(message("[ambient]\nday = 3").contains(":2: 'ambient.day'"));
        assert!(message("[power]\nsoak_s = 9").contains("'power.soak_s' is given"));
        assert!(message("[power]\nstart = 'tepid'").contains(":2: 'power.start'"));
        let step = "[[ambient.step]]\nat_s = 0\nduration_s = -1\nchange_k = 5";
        assert!(message(step).contains("'ambient.step[0].duration_s' is -1"));
        assert!(message("[power]\nage_days = nan").contains("'power.age_days' is NaN"));
    }
}
