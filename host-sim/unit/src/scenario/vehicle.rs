//! The vehicle of a scenario: its name, its table of parameters, and its restrictions.

use super::{DriveSpec, Scenario};
use host_core::error::Error;
use host_core::simulator::truth::{Vehicle, VehicleName};

impl Scenario {
    /// Another vehicle, with the parameters that the scenario has for it.
    ///
    /// # Errors
    /// An unknown name; a vehicle that the rest of the scenario does not fit.
    pub fn set_vehicle(&mut self, name: &str) -> Result<(), Error> {
        let names = VehicleName::NAMES;
        let found = names.iter().find(|(known, _)| *known == name);
        let Some((_, vehicle)) = found else {
            let names = names.map(|(name, _)| name);
            return Err(Error::unknown("vehicle", name, &names));
        };
        self.vehicle_name = *vehicle;
        self.check_vehicle()
    }

    /// The vehicle with its parameters.
    #[must_use]
    pub fn vehicle(&self) -> Vehicle {
        match self.vehicle_name {
            VehicleName::Road => Vehicle::Road,
            VehicleName::City => Vehicle::City(self.city),
            VehicleName::Ship => Vehicle::Ship(self.ship),
            VehicleName::Aircraft => Vehicle::Aircraft(self.aircraft),
            VehicleName::Traffic => Vehicle::Traffic(self.traffic),
            VehicleName::Train => Vehicle::Train(self.train),
            VehicleName::HandHeld => Vehicle::HandHeld(self.hand_held),
            VehicleName::Standing => Vehicle::Standing(self.standing),
        }
    }

    /// Tables of the vehicles that are not in use, which a command would ignore.
    #[must_use]
    pub fn other_vehicles(&self) -> Vec<&'static str> {
        let others = VehicleName::NAMES.into_iter();
        let others = others.filter(|(_, vehicle)| *vehicle != self.vehicle_name);
        others.map(|(name, _)| name).collect()
    }

    /// Checks the ranges of the vehicles' parameters, and the restrictions of the vehicle.
    pub(super) fn check_vehicle(&self) -> Result<(), Error> {
        self.check_tables()?;
        if self.gnss.multipath.in_streets && !self.vehicle().is_car() {
            let problem = "is true, but only a car goes through streets".into();
            let remedy = "leave it out, or give a car as the vehicle";
            return Err(self.bad("gnss.multipath.in_streets", problem, remedy));
        }
        if self.vehicle_name == VehicleName::Road {
            return Ok(());
        }
        for (key, drive) in [("learn.segment", &self.learn), ("test.segment", &self.test)] {
            if !drive.segment.is_empty() {
                let problem = "is given, but only the vehicle 'road' drives segments".into();
                return Err(self.bad(key, problem, "leave it out, or write vehicle = \"road\""));
            }
        }
        Ok(())
    }

    /// Checks the ranges of the tables of all vehicles.
    fn check_tables(&self) -> Result<(), Error> {
        let (ship, aircraft) = (&self.ship, &self.aircraft);
        let (traffic, train) = (&self.traffic, &self.train);
        let (walk, standing) = (&self.hand_held, &self.standing);
        self.in_ranges(&[
            ("ship.wave_height_m", ship.wave_height_m, 0.0, 15.0),
            ("ship.wave_period_s", ship.wave_period_s, 3.0, 20.0),
            ("ship.speed_mps", ship.speed_mps, 0.0, 15.0),
            ("ship.current_mps", ship.current_mps, 0.0, 5.0),
            ("aircraft.speed_mps", aircraft.speed_mps, 30.0, 120.0),
            ("aircraft.bank_deg", aircraft.bank_deg, 0.0, 60.0),
            ("aircraft.wind_mps", aircraft.wind_mps, 0.0, 30.0),
            ("traffic.queue_share", traffic.queue_share, 0.0, 1.0),
            ("traffic.creep_mps", traffic.creep_mps, 0.1, 3.0),
            ("traffic.creep_s", traffic.creep_s, 6.0, 300.0),
            ("traffic.stop_s", traffic.stop_s, 1.0, 300.0),
            ("traffic.departure_s", traffic.departure_s, 5.0, 120.0),
            ("traffic.speed_mps", traffic.speed_mps, 5.0, 35.0),
            ("train.speed_mps", train.speed_mps, 5.0, 90.0),
            ("train.radius_m", train.radius_m, 150.0, 20_000.0),
            ("train.cant_mm", train.cant_mm, 0.0, 180.0),
            ("train.stop_every_s", train.stop_every_s, 0.0, 7200.0),
            ("hand-held.speed_mps", walk.speed_mps, 0.3, 2.5),
            ("hand-held.step_hz", walk.step_hz, 1.0, 3.0),
            ("hand-held.step_g", walk.step_g, 0.0, 1.0),
            ("hand-held.swing_deg", walk.swing_deg, 0.0, 60.0),
            ("standing.rock_deg", standing.rock_deg, 0.0, 1.0),
            ("standing.sway_mps", standing.sway_mps, 0.0, 0.05),
        ])?;
        if train.stop_every_s != 0.0 {
            let stops = ("train.stop_every_s", train.stop_every_s, 60.0, 7200.0);
            self.in_ranges(&[stops])?;
        }
        Ok(())
    }

    /// Checks the standstill of a drive. Only vehicles that need none may have none.
    pub(super) fn check_standstill(&self, key: &str, drive: &DriveSpec) -> Result<(), Error> {
        let may_be_0 = self.vehicle_name != VehicleName::Road;
        if may_be_0 && drive.standstill_s == 0 {
            return Ok(());
        }
        let key = format!("{key}.standstill_s");
        self.in_ranges(&[(&key, f64::from(drive.standstill_s), 90.0, 7200.0)])
    }

    /// Checks that the vehicle can stand, for commands that align at a standstill of their own.
    ///
    /// # Errors
    /// A ship.
    pub fn vehicle_stands(&self, remedy: &str) -> Result<(), Error> {
        if self.vehicle().stands() {
            return Ok(());
        }
        let problem = format!("is '{}', which never stands", self.vehicle_name);
        Err(self.bad("vehicle", problem, remedy))
    }

    /// Checks that the vehicle stands before both drives, for commands that align there.
    ///
    /// # Errors
    /// A ship; a standstill of 0.
    pub fn stands_first(&self) -> Result<(), Error> {
        let remedy = "give a vehicle that stands for at least 90 s first; `host-sim start` and \
                      `simulate` take any";
        self.vehicle_stands(remedy)?;
        for (key, drive) in [
            ("learn.standstill_s", &self.learn),
            ("test.standstill_s", &self.test),
        ] {
            if drive.standstill_s == 0 {
                return Err(self.bad(key, "is 0".into(), remedy));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_text;
    use super::*;
    use host_core::simulator::truth::{City, Ship};

    #[test]
    fn a_vehicle_has_a_name_and_a_table() {
        let scenario = load_text("").unwrap();
        assert_eq!(scenario.vehicle(), Vehicle::Road);
        let scenario = load_text("vehicle = 'ship'\n[ship]\nwave_height_m = 3").unwrap();
        let want = Ship {
            wave_height_m: 3.0,
            ..Ship::default()
        };
        assert_eq!(scenario.vehicle(), Vehicle::Ship(want));
        let scenario = load_text("vehicle = 'city'\n[city]\nstops = false").unwrap();
        let want = City {
            stops: false,
            ..City::default()
        };
        assert_eq!(scenario.vehicle(), Vehicle::City(want));
    }

    #[test]
    fn every_vehicle_is_found_by_its_name() {
        for (name, vehicle) in VehicleName::NAMES {
            let scenario = load_text(&format!("vehicle = '{name}'")).unwrap();
            assert_eq!(scenario.vehicle_name, vehicle);
            assert_eq!(vehicle.to_string(), name);
            assert!(!scenario.other_vehicles().contains(&name));
            assert_eq!(scenario.other_vehicles().len(), 7);
            let mut other = Scenario::default();
            other.set_vehicle(name).unwrap();
            assert_eq!(other.vehicle(), scenario.vehicle());
        }
        let text = "vehicle = 'hand-held'\n[hand-held]\nstep_hz = 2.1\npauses = false";
        let Vehicle::HandHeld(walk) = load_text(text).unwrap().vehicle() else {
            panic!("another vehicle");
        };
        assert_eq!(
            (walk.step_hz, walk.pauses, walk.speed_mps),
            (2.1, false, 1.3)
        );
    }

    #[test]
    fn parameters_of_the_vehicles_have_ranges() {
        for (key, value) in [
            ("traffic.queue_share", 1.1),
            ("traffic.creep_mps", 0.05),
            ("traffic.creep_s", 5.0),
            ("traffic.stop_s", 0.5),
            ("traffic.departure_s", 121.0),
            ("traffic.speed_mps", 4.0),
            ("train.speed_mps", 91.0),
            ("train.radius_m", 149.0),
            ("train.cant_mm", 181.0),
            ("train.stop_every_s", 59.0),
            ("hand-held.speed_mps", 0.2),
            ("hand-held.step_hz", 3.5),
            ("hand-held.step_g", -0.1),
            ("hand-held.swing_deg", 61.0),
            ("standing.rock_deg", 1.5),
            ("standing.sway_mps", 0.06),
        ] {
            let (table, field) = key.split_once('.').unwrap();
            let text = format!("[{table}]\n{field} = {value:?}");
            let message = load_text(&text).unwrap_err().to_string();
            assert!(
                message.contains(&format!("'{key}' is {value}")),
                "{message}"
            );
        }
        assert!(load_text("[train]\nstop_every_s = 0").is_ok());
    }

    #[test]
    fn a_vehicle_that_does_not_fit_is_refused_by_key() {
        let message = |text: &str| load_text(text).unwrap_err().to_string();
        assert!(message("vehicle = 'boat'").contains(":1: 'vehicle'"));
        assert!(message("[ship]\nspeed_mps = 90").contains("'ship.speed_mps' is 90"));
        assert!(message("[aircraft]\nbank = 9").contains(":2: 'aircraft.bank'"));
        let text = "vehicle = 'ship'\n[[test.segment]]\nduration_s = 200.0";
        assert!(message(text).contains("'test.segment' is given"));
        let text = "vehicle = 'ship'\n[gnss.multipath]\nin_streets = true";
        assert!(message(text).contains("'gnss.multipath.in_streets' is true"));
        assert!(load_text(&text.replace("ship", "city")).is_ok());
        assert!(message("[test]\nstandstill_s = 0").contains("'test.standstill_s' is 0"));
        let mut scenario = Scenario::default();
        let unknown = scenario.set_vehicle("shp").unwrap_err().to_string();
        assert!(unknown.contains("there is no vehicle 'shp'") && unknown.contains("ship"));
    }

    #[test]
    fn commands_that_align_at_a_standstill_refuse_those_without() {
        let refuses = |text: &str| {
            let refused = load_text(text).unwrap().stands_first();
            refused.map_err(|error| error.to_string())
        };
        assert!(refuses("").is_ok());
        assert!(refuses("vehicle = 'aircraft'").is_ok());
        assert!(
            refuses("vehicle = 'ship'")
                .unwrap_err()
                .contains("never stands")
        );
        let at_once = "vehicle = 'city'\n[learn]\nstandstill_s = 0";
        assert!(
            refuses(at_once)
                .unwrap_err()
                .contains("'learn.standstill_s' is 0")
        );
    }
}
