//! The vehicle of a scenario: its name, its table of parameters, and what it cannot do.

use super::{DriveSpec, Scenario};
use crate::error::Error;
use crate::simulator::truth::{Aircraft, Ship, Vehicle, VehicleName};

/// Names of the vehicles as they are written.
const NAMES: [(&str, VehicleName); 4] = [
    ("road", VehicleName::Road),
    ("city", VehicleName::City),
    ("ship", VehicleName::Ship),
    ("aircraft", VehicleName::Aircraft),
];

impl Scenario {
    /// Another vehicle, with the parameters that the scenario has for it.
    ///
    /// # Errors
    /// An unknown name; a vehicle that the rest of the scenario does not fit.
    pub fn set_vehicle(&mut self, name: &str) -> Result<(), Error> {
        let found = NAMES.iter().find(|(known, _)| *known == name);
        let Some((_, vehicle)) = found else {
            return Err(Error::unknown(
                "vehicle",
                name,
                &NAMES.map(|(name, _)| name),
            ));
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
        }
    }

    /// Ranges of the vehicles' parameters, and what a vehicle can do.
    pub(super) fn check_vehicle(&self) -> Result<(), Error> {
        let Ship {
            wave_height_m,
            wave_period_s,
            speed_mps,
            current_mps,
            ..
        } = self.ship;
        let Aircraft {
            speed_mps: through_air,
            bank_deg,
            wind_mps,
            ..
        } = self.aircraft;
        self.in_ranges(&[
            ("ship.wave_height_m", wave_height_m, 0.0, 15.0),
            ("ship.wave_period_s", wave_period_s, 3.0, 20.0),
            ("ship.speed_mps", speed_mps, 0.0, 15.0),
            ("ship.current_mps", current_mps, 0.0, 5.0),
            ("aircraft.speed_mps", through_air, 30.0, 120.0),
            ("aircraft.bank_deg", bank_deg, 0.0, 60.0),
            ("aircraft.wind_mps", wind_mps, 0.0, 30.0),
        ])?;
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

    /// The standstill of a drive: only a vehicle that need not stand may have none.
    pub(super) fn check_standstill(&self, key: &str, drive: &DriveSpec) -> Result<(), Error> {
        let may_be_0 = self.vehicle_name != VehicleName::Road;
        if may_be_0 && drive.standstill_s == 0 {
            return Ok(());
        }
        let key = format!("{key}.standstill_s");
        self.in_ranges(&[(&key, f64::from(drive.standstill_s), 90.0, 7200.0)])
    }

    /// That the vehicle stands before both drives, for commands that align themselves there.
    ///
    /// # Errors
    /// A ship; a standstill of 0.
    pub fn stands_first(&self) -> Result<(), Error> {
        let remedy = "give a vehicle that stands for at least 90 s first; `host-sim start` and \
                      `simulate` take any";
        if self.vehicle_name == VehicleName::Ship {
            return Err(self.bad("vehicle", "is 'ship', which never stands".into(), remedy));
        }
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

    /// That the vehicle is a car on the road, for commands that know no other.
    ///
    /// # Errors
    /// Another vehicle.
    pub fn on_road(&self) -> Result<(), Error> {
        if self.vehicle_name == VehicleName::Road {
            return Ok(());
        }
        let problem = "is not 'road', which is all that this command knows".into();
        Err(self.bad("vehicle", problem, "leave it out"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_text;
    use super::*;
    use crate::simulator::truth::City;

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
    fn a_vehicle_that_does_not_fit_is_refused_by_key() {
        let message = |text: &str| load_text(text).unwrap_err().to_string();
        assert!(message("vehicle = 'boat'").contains(":1: 'vehicle'"));
        assert!(message("[ship]\nspeed_mps = 90").contains("'ship.speed_mps' is 90"));
        assert!(message("[aircraft]\nbank = 9").contains(":2: 'bank'"));
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
        assert!(load_text("vehicle = 'city'").unwrap().on_road().is_err());
        assert!(load_text("").unwrap().on_road().is_ok());
    }
}
