//! Motions of the vehicle in the drive in which the device learns.

use super::begin::Begin;
use super::times::Times;
use host_core::simulator::truth::{City, Segment, Vehicle, VehicleName, random_drive};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A motion after the standstill. All but [`Motion::In`] are a car's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// A car on town streets and country roads.
    Road,
    /// The same on a rough road: factor of the vibration.
    Rough(f64),
    /// Another vehicle of the simulator.
    In(VehicleName),
    /// It creeps at this speed, m/s, while the disturbance lasts, then drives.
    Creep(f64),
    /// It reaches this speed, m/s, in this time, s, then drives on.
    Departure(f64, f64),
    /// It drives straight on at this speed, m/s, while the disturbance lasts, then as a car does.
    Cruise(f64),
    /// It drives straight on at this speed, m/s, all the time.
    Straight(f64),
    /// It turns by 180 degrees at this interval, s.
    TurnsBack(f64),
    /// It drives in circles of this duration, s, all the time.
    Circles(f64),
    /// It stops for 6 s at this interval, s.
    StopsAndGoes(f64),
    /// As [`Motion::Road`], but this happens at power-on, before the standstill, for this long, s.
    Begins(Begin, f64),
}

impl Motion {
    /// The vehicle of the simulator.
    pub(super) fn vehicle(self) -> Vehicle {
        match self {
            Self::In(name) => usual(name),
            _ => Vehicle::Road,
        }
    }

    /// The undisturbed motion of the next drive, with the same vehicle.
    pub(super) fn next(self) -> Self {
        match self {
            Self::In(_) => self,
            _ => Self::Road,
        }
    }

    /// What happens before the standstill, and for how long, s.
    pub(super) fn begins(self) -> Option<(Begin, u32)> {
        match self {
            Self::Begins(begin, lasts_s) => Some((begin, lasts_s.max(1.0) as u32)),
            _ => None,
        }
    }

    /// The motion after the standstill.
    pub(super) fn after(self) -> Self {
        match self {
            Self::Begins(..) => Self::Road,
            _ => self,
        }
    }

    /// Factor of the vibration.
    pub(super) fn vibration(self) -> f64 {
        match self {
            Self::Rough(factor) => factor,
            _ => 1.0,
        }
    }

    /// The segments of a car's drive of `drive_s` s after the standstill; `None`: a random drive,
    /// or another vehicle. `lasts_s`: the disturbance, from the end of the standstill on.
    pub(super) fn segments(self, times: &Times, lasts_s: f64, seed: u64) -> Option<Vec<Segment>> {
        let drive_s = f64::from(times.aided_s + times.free_s);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut of: Vec<Segment> = match self {
            Self::Road | Self::Rough(_) | Self::In(_) | Self::Begins(..) => return None,
            Self::Creep(speed) => vec![
                to(speed, 3.0),
                Segment::hold((lasts_s - 6.0).max(1.0)),
                to(0.0, 3.0),
            ],
            Self::Departure(speed, time) => vec![to(speed, time), to(0.0, 3.0)],
            Self::Cruise(speed) => vec![
                to(speed, 1.5 * speed),
                Segment::hold((lasts_s - 3.0 * speed).max(1.0)),
                to(0.0, 1.5 * speed),
            ],
            Self::Straight(speed) => vec![to(speed, 2.0 * speed), Segment::hold(drive_s)],
            Self::TurnsBack(every_s) => again(
                drive_s,
                &[
                    to(12.0, 12.0),
                    Segment::hold(every_s),
                    to(4.0, 8.0),
                    turn(180.0, 12.0),
                ],
            ),
            Self::Circles(period_s) => again(drive_s, &[to(8.0, 10.0), turn(360.0, period_s)]),
            Self::StopsAndGoes(every_s) => {
                let stop = [to(10.0, 9.0), Segment::hold(every_s), to(0.0, 7.0)];
                again(drive_s, &[&stop[..], &[Segment::hold(6.0)]].concat())
            }
        };
        let gone: f64 = of.iter().map(|segment| segment.duration_s).sum();
        if drive_s - gone > 60.0 {
            of.extend(random_drive(drive_s - gone, &mut rng));
        }
        Some(cut(of, drive_s))
    }
}

fn to(speed: f64, duration_s: f64) -> Segment {
    Segment {
        speed_mps: Some(speed),
        ..Segment::hold(duration_s)
    }
}

fn turn(turn_deg: f64, duration_s: f64) -> Segment {
    Segment {
        turn_deg,
        ..Segment::hold(duration_s)
    }
}

/// Repeats a pattern for at least `duration_s`.
fn again(duration_s: f64, pattern: &[Segment]) -> Vec<Segment> {
    let once: f64 = pattern.iter().map(|segment| segment.duration_s).sum();
    let times = (duration_s / once).ceil() as usize;
    pattern.repeat(times)
}

/// The segments until `duration_s`; the last one may become a stretch at constant speed.
fn cut(segments: Vec<Segment>, duration_s: f64) -> Vec<Segment> {
    let mut left = duration_s;
    let mut of = Vec::with_capacity(segments.len() + 1);
    for segment in segments {
        if segment.duration_s > left {
            break;
        }
        left -= segment.duration_s;
        of.push(segment);
    }
    if left > 0.05 {
        of.push(Segment::hold(left));
    }
    of
}

/// A vehicle with its usual parameters.
fn usual(name: VehicleName) -> Vehicle {
    match name {
        VehicleName::Road => Vehicle::Road,
        // at rest the engine hardly shakes it
        VehicleName::City => Vehicle::City(City {
            calm_stops: true,
            ..City::default()
        }),
        VehicleName::Ship => Vehicle::Ship(Default::default()),
        VehicleName::Aircraft => Vehicle::Aircraft(Default::default()),
        VehicleName::Traffic => Vehicle::Traffic(Default::default()),
        VehicleName::Train => Vehicle::Train(Default::default()),
        VehicleName::HandHeld => Vehicle::HandHeld(Default::default()),
        VehicleName::Standing => Vehicle::Standing(Default::default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every motion lasts as long as the drive, and begins as described.
    #[test]
    fn motions_fill_the_drive() {
        let times = Times::default();
        let drive_s = f64::from(times.aided_s + times.free_s);
        for motion in [
            Motion::Creep(0.15),
            Motion::Departure(0.5, 60.0),
            Motion::Cruise(10.0),
            Motion::Straight(30.0),
            Motion::TurnsBack(20.0),
            Motion::Circles(40.0),
            Motion::StopsAndGoes(20.0),
        ] {
            let segments = motion.segments(&times, 300.0, 1).unwrap();
            let all: f64 = segments.iter().map(|segment| segment.duration_s).sum();
            assert!((all - drive_s).abs() < 1e-6, "{motion:?}: {all}");
            assert!(segments.iter().all(|segment| segment.duration_s > 0.0));
        }
        let creep = Motion::Creep(0.15).segments(&times, 300.0, 1).unwrap();
        assert_eq!(creep[0].speed_mps, Some(0.15));
        assert_eq!(creep[..3].iter().map(|s| s.duration_s).sum::<f64>(), 300.0);
    }
}
