use super::*;

const LSB: Lsb = Lsb {
    rad: 1e-8,
    mps: 1e-6,
};
const SAMPLE_S: f64 = 0.01;
const SAMPLES: u32 = 50;
const SENSORS: Sensors = Sensors {
    noise: [1e-6, 1e-4],
    bias: [5e-8, 1e-3],
    walk: 0.0,
};
const LEVEL: V32 = [0.0, 0.0, -9.81];

/// A window of samples with this mean rate and force, and sines of a vibration about them.
fn window(detector: &mut Standstill, rate: V32, force: V32, vibration: [f32; 2]) -> bool {
    for k in 0..SAMPLES {
        // 7 Hz, and whole periods in a window would need 8
        let sine = libm::sinf(core::f32::consts::TAU * 7.0 * (k as f32 + 0.5) / SAMPLES as f32);
        let counts = |of: V32, amplitude: f32, worth: f64| {
            of.map(|x| (f64::from(x + amplitude * sine) * SAMPLE_S / worth) as i32)
        };
        detector.sample(&Counts {
            dtheta: counts(rate, vibration[0], LSB.rad),
            dv: counts(force, vibration[1], LSB.mps),
        });
    }
    detector.end_window();
    detector.passes()
}

/// Whether it is a quiet one, too.
fn rests(detector: &mut Standstill, of: [f32; 2]) -> bool {
    let before = detector.quiet;
    window(detector, [0.0; 3], LEVEL, of) && detector.quiet > before
}

fn new(sensors: &Sensors) -> Standstill {
    Standstill::new(sensors, LSB, SAMPLE_S)
}

const CALM: [f32; 2] = [1e-4, 0.01];

/// The thresholds follow from noise and sway: a change well within them passes, one well beyond
/// does not.
#[test]
fn thresholds_follow_the_datasheet() {
    for (noise, step) in [([1e-6, 1e-4], 0.1), ([1e-3, 0.1], 1.0)] {
        let sensors = Sensors { noise, ..SENSORS };
        let mut detector = new(&sensors);
        let edge = |k: f32| [0.0, k * step, -9.81];
        assert!(window(&mut detector, [0.0; 3], LEVEL, CALM));
        assert!(
            window(&mut detector, [0.0; 3], edge(0.7), CALM),
            "{noise:?}"
        );
        assert!(
            !window(&mut detector, [0.0; 3], edge(2.5), CALM),
            "{noise:?}"
        );
    }
    let mut detector = new(&SENSORS);
    assert!(window(&mut detector, [7e-5, 0.0, 0.0], LEVEL, CALM));
    assert!(!window(&mut detector, [2e-3, 0.0, 0.0], LEVEL, CALM));
    let mut detector = new(&SENSORS);
    assert!(!window(&mut detector, [0.0; 3], [0.0, 0.0, -9.0], CALM));
}

/// An engine that idles is as quiet as a car gets; the road is louder, however straight it is.
#[test]
fn the_road_is_louder_than_an_idling_engine() {
    let (idles, road) = ([8e-3, 0.5], [16e-3, 0.9]);
    let mut detector = new(&SENSORS);
    let runs = |detector: &mut Standstill, of, n| (0..n).filter(|_| rests(detector, of)).count();
    // it is driving when the power comes: nothing is known yet
    assert_eq!(runs(&mut detector, road, 6), 6);
    assert_eq!(runs(&mut detector, idles, 8), 8);
    assert_eq!(detector.seconds(), 7);
    // it drives off
    window(&mut detector, [0.0; 3], [1.0, 0.0, -9.81], road);
    assert_eq!(runs(&mut detector, road, 20), 0);
    assert_eq!(runs(&mut detector, idles, 8), 8);
}

/// The engine is started while the car stands: after a pause of two seconds that is a standstill
/// as well, and later ones are found at once.
#[test]
fn an_engine_that_is_started_counts_after_two_seconds() {
    let (off, idles, road) = ([2e-3, 0.1], [8e-3, 0.5], [16e-3, 0.9]);
    let mut detector = new(&SENSORS);
    let mut stands = |n: u32, of| {
        (0..n)
            .map(|_| rests(&mut detector, of))
            .collect::<std::vec::Vec<_>>()
    };
    assert_eq!(stands(10, off), [true; 10]);
    assert_eq!(stands(5, idles), [false, false, false, false, true]);
    assert_eq!(detector.seconds(), 7);
    window(&mut detector, [0.0; 3], [1.0, 0.0, -9.81], road);
    let mut stands = |n: u32, of| (0..n).filter(|_| rests(&mut detector, of)).count();
    assert_eq!(stands(20, road), 0);
    assert_eq!(stands(4, idles), 4);
}

/// Values that are constant, or coarser than the noise, do not make the next window a loud one, nor
/// does sway; what is more than that does.
#[test]
fn sway_is_quiet() {
    let mut detector = new(&SENSORS);
    for _ in 0..8 {
        assert!(window(&mut detector, [0.0; 3], LEVEL, [0.0; 2]));
    }
    let count = [1.4e-6, 1.4e-4]; // rad/s and m/s2: 1.4 counts a sample
    assert!(rests(&mut detector, count));
    assert!(rests(&mut detector, [1.1e-3, 0.05]));
    assert!(!rests(&mut detector, [1.5e-3, 0.01]));
    assert!(rests(&mut detector, CALM));
    assert!(!rests(&mut detector, [1e-4, 0.08]));
}

/// A gap ends the standstill, and half a window before it counts for nothing.
#[test]
fn a_gap_ends_it() {
    let mut detector = new(&SENSORS);
    window(&mut detector, [0.0; 3], LEVEL, CALM);
    window(&mut detector, [0.0; 3], LEVEL, CALM);
    assert_eq!(detector.seconds(), 1);
    detector.sample(&Counts {
        dtheta: [i32::MAX; 3],
        dv: [i32::MIN; 3],
    });
    detector.gap();
    assert_eq!(detector.seconds(), 0);
    assert!(window(&mut detector, [0.0; 3], LEVEL, CALM));
    // and a window without samples is none
    detector.end_window();
    assert_eq!(detector.seconds(), 0);
}

/// An engine that shakes a car as much as the road does: a rest where the wheels show it. Wheels
/// that turn end it.
#[test]
fn wheels_show_rests_that_shake() {
    let (road, engine) = ([1.5e-3, 0.1], [4e-3, 0.3]);
    let drives = |detector: &mut Standstill, level: [f32; 2], wheels: Option<bool>| {
        if let Some(stand) = wheels {
            detector.wheels(stand);
        }
        window(detector, [0.0; 3], LEVEL, level)
    };
    for reported in [false, true] {
        let mut detector = new(&SENSORS);
        for _ in 0..20 {
            let passes = drives(&mut detector, road, reported.then_some(false));
            assert_eq!(passes, !reported);
        }
        // the road's level was quiet before, and ends as a standstill of another level does
        detector.moves();
        for _ in 0..20 {
            drives(&mut detector, engine, reported.then_some(true));
        }
        assert_eq!(detector.rest().is_some(), reported);
        assert!(!drives(&mut detector, engine, Some(false)));
        assert!(detector.rest().is_none());
    }
}

/// Wheels that stand, or were reported to long ago, make no rest of a motion.
#[test]
fn wheels_that_stand_do_not_make_a_rest() {
    let mut detector = new(&SENSORS);
    for k in 0..40 {
        detector.wheels(true);
        let swell = 0.02 * libm::sinf(0.5 * k as f32);
        window(&mut detector, [swell, 0.0, 0.0], LEVEL, CALM);
        assert!(detector.rest().is_none(), "{k}");
    }
    detector.wheels(false);
    for expected in [false, false, true] {
        assert_eq!(window(&mut detector, [0.0; 3], LEVEL, CALM), expected);
    }
}

/// A sensor that begins with half a second of equal samples is not taken for a quiet one.
#[test]
fn equal_samples_at_the_beginning_are_no_measure() {
    let idles = [8e-3, 0.5];
    let mut detector = new(&SENSORS);
    assert!(window(&mut detector, [0.0; 3], LEVEL, [0.0; 2]));
    let quiet = (0..12).filter(|_| rests(&mut detector, idles)).count();
    assert!(quiet >= 11, "{quiet}");
}

/// The starter jolts a car that was quiet: its engine is then louder than any rest before. A
/// receiver that shows that it stands makes the level count, and one that shows nothing does not.
#[test]
fn a_receiver_shows_that_an_idling_engine_is_at_rest() {
    for shows in [true, false] {
        let mut detector = new(&SENSORS);
        assert!((0..20).all(|_| rests(&mut detector, CALM)));
        let jolted = [0.0, 1.5, -9.81];
        assert!(!window(&mut detector, [0.0; 3], jolted, [0.05, 2.0]));
        let quiet = (0..20)
            .filter(|_| {
                if shows {
                    detector.is_right();
                }
                rests(&mut detector, [8e-3, 0.5])
            })
            .count();
        assert_eq!(quiet > 10, shows, "{quiet}");
    }
}

/// The mean of a rest is of its last windows, as many as the walk of the biases allows.
#[test]
fn a_mean_is_of_the_last_windows() {
    let sensors = Sensors {
        noise: [5e-5, 1e-3],
        walk: 7e-6,
        bias: [1e-3, 1e-2],
    };
    let mut detector = new(&sensors);
    for k in 0..400 {
        let rate = if k < 200 { 0.0 } else { 1e-4 };
        window(&mut detector, [rate, 0.0, 0.0], LEVEL, CALM);
    }
    let rest = detector.rest().unwrap();
    // sqrt(2) 2 noise / walk
    assert!((19.0..21.0).contains(&rest.seconds), "{rest:?}");
    assert!((rest.rate[0] - 1e-4).abs() < 2e-6, "{rest:?}");
    assert_eq!(rest.stood_s, 200.0);
    // without a walk it is of all of them
    let mut detector = new(&Sensors {
        walk: 0.0,
        ..sensors
    });
    (0..400).for_each(|_| assert!(window(&mut detector, [0.0; 3], LEVEL, CALM)));
    assert_eq!(detector.rest().unwrap().seconds, 197.0);
}
