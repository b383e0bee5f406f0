use super::*;
use crate::experiment::outcome::table;
use host_core::inertial::counts::FINE_LSB;
use host_core::inertial::free_inertial::aligned_free_inertial;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::units::UG;
use host_io::recordings::load;
use test_bench::recordings::recorded as file;

fn recorded() -> Option<Recording> {
    file("lasergyro-static.csv.gz").map(|path| load(&path).unwrap())
}

/// A perfect IMU on a vehicle that sways by some mrad, partly with a lasting change, with a
/// constant error added; in the form of the file.
fn swaying(seconds: usize, error: &Increment) -> Recording {
    let site = at_rest(
        &Recording {
            rate_hz: 100.0,
            gyro_lsb_rad: 1.0,
            accel_lsb_mps: 1.0,
            pulses: Vec::new(),
        },
        0,
    )
    .nearest_fix(0);
    let here = Local::at(site.position.lat, site.position.h);
    let dt = 0.01;
    let q = |k: usize| {
        let t = k as f64 * dt;
        let step = 2e-3 * (1.0 + ((t - 700.0) / 2.0).tanh());
        from_euler(
            0.01 + 3e-3 * (t / 3.0).sin() + step,
            -0.02 + 2e-3 * (t / 15.0).sin(),
            1.58 + 1e-4 * (t / 7.0).sin(),
        )
    };
    let increment = |k: usize| {
        let (a, b) = (q(k), q(k + 1));
        let turn = a.inverse() * from_rotvec(&(here.omega_ie() * dt)) * b;
        Increment {
            dtheta: turn.scaled_axis() + error.dtheta * dt,
            dv: a.slerp(&b, 0.5).inverse() * -here.gravity() * dt + error.dv * dt,
        }
    };
    let increments: Vec<Increment> = (0..seconds * 100).map(increment).collect();
    let turn = |c: firmware::sample::Counts| {
        [
            c.dtheta[1],
            c.dtheta[0],
            -c.dtheta[2],
            c.dv[1],
            c.dv[0],
            -c.dv[2],
        ]
    };
    let counts = quantise(&increments, &FINE_LSB).unwrap();
    Recording {
        rate_hz: 100.0,
        gyro_lsb_rad: FINE_LSB.rad,
        accel_lsb_mps: FINE_LSB.mps,
        pulses: counts.into_iter().map(turn).collect(),
    }
}

#[test]
fn sway_is_no_error_and_what_one_attitude_shows_is_found() {
    let down = |rate: f64, force: f64| Increment {
        dtheta: Vector3::new(0.0, 0.0, rate * DEG_PER_H),
        dv: Vector3::new(0.0, 0.0, force * UG),
    };
    for error in [down(0.0, 0.0), down(0.1, 50.0)] {
        let found = errors(&swaying(1500, &error)).unwrap();
        assert_eq!(found.len(), 1499);
        for part in [&found[..749], &found[749..], &found[..]] {
            let n = part.len() as f64;
            let g = (part.iter().map(|e| e.dtheta).sum::<Vector3<f64>>() / n - error.dtheta)
                / DEG_PER_H;
            let a = (part.iter().map(|e| e.dv).sum::<Vector3<f64>>() / n - error.dv) / UG;
            println!("left: {g:.4?} deg/h {a:.2?} ug");
            assert!(g.amax() < 0.01 && a.amax() < 1.0, "{g} deg/h {a} ug");
        }
    }
}

#[test]
fn error_at_rest_coasts_like_the_recording() {
    let Some(recording) = recorded() else { return };
    let errors = errors(&recording).unwrap();
    assert_eq!(errors.len(), 1846);
    let config = Config {
        standstill_s: 480.0,
        length_s: 1846.0,
        heading: 90.6f64.to_radians(),
        vibration: 0.0,
        gnss: GnssSpec::default(),
        drive: None,
    };
    let hybrid = session(&recording, &errors, &config).unwrap();
    let hybrid = aligned_free_inertial(&hybrid, &hybrid.increments()).unwrap();
    let real = at_rest(&recording, 480);
    let real = aligned_free_inertial(&real, &real.increments()).unwrap();
    for t in [300, 600, 900, 1200, 1320] {
        let [h, r] = [&hybrid, &real].map(|c| c.position[t].xy());
        println!(
            "{t} s: real {:.1} m, hybrid {:.1} m, apart {:.1} m",
            r.norm(),
            h.norm(),
            (h - r).norm()
        );
        assert!((h - r).norm() < 1.0 + 0.1 * r.norm());
    }
    let long = Config {
        length_s: 1860.0,
        ..config
    };
    assert!(session(&recording, &errors, &long).is_none());
}

#[test]
fn drives_of_22_minutes_are_judged() {
    let Some(recording) = recorded() else { return };
    let unit = Unit::preset(lasergyro::UNIT).unwrap();
    let all = replay(&recording, &[1, 2, 3], &unit).unwrap().unwrap();
    println!("{}", table(&all));
    for o in &all {
        println!("{}", o.notes[0]);
        assert_eq!(o.rows.len(), 40);
        // the road changes how errors add up, not their size: 233 m at rest
        let raw = o.horizontal("raw", 1320).unwrap();
        assert!((10.0..700.0).contains(&raw), "{raw}");
        let zero = o.notes[0].starts_with("The correction is left at zero");
        assert_eq!(o.horizontal("rnn", 1320) == Some(raw), zero);
    }
    // A learner whose corrections must be proven does no harm on the real error. On no road is it
    // worse than the device without corrections. Over all roads it is no worse than a navigator
    // that does not use the stops of the drive.
    let total = |scheme: &str| -> f64 {
        let on = |o: &Outcome| o.horizontal(scheme, 1320).unwrap();
        all.iter().map(on).sum()
    };
    let [learner, raw] = ["device", "raw"].map(total);
    assert!(learner < 1.02 * raw, "{learner} {raw}");
    for o in &all {
        let [learner, raw] = ["device", "raw"].map(|scheme| o.horizontal(scheme, 1320).unwrap());
        assert!(learner < 1.02 * raw, "{learner} {raw}");
    }
}

#[test]
fn too_short_a_recording_gives_nothing() {
    let none = Increment::default();
    assert!(errors(&swaying(100, &none)).is_none());
}
