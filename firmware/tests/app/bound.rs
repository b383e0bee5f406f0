//! The error bound that the device reports follows the latitude and the sample rate that it has
//! measured.

use crate::activation::{PLACE, fix};
use crate::frames::Kind;
use crate::record::{configured, unconfigured};
use crate::taught::Bench;
use firmware::app::{App, Config};
use firmware::compensator::Limit;
use firmware::error_bound::{ErrorBound, LATITUDE};
use firmware::wire::command::{Request, Response};

const KIND: Kind = Kind::RAWIMUSX;

fn reported(bench: &mut Bench) -> [u32; 5] {
    bench
        .device
        .ask(&Request::GetHealth, |answer| match answer {
            Response::Health(health) => health.error_bound_m,
            other => panic!("{other:?}"),
        })
}

#[test]
fn it_follows_what_is_measured() {
    let unit = configured(KIND);
    let config = Config::of(&unit);
    // beside the limits the elements of the maps at three sigma, at 1.1 deg/s and 11.8 m/s2 of a
    // vehicle on land
    let limit = Limit {
        gyro: config.limit.gyro + 3.0 * 5e-5 * 1.732_051 * 0.02,
        accel: config.limit.accel + 3.0 * 1e-4 * 1.732_051 * 11.806_65,
    };
    let mut bench = Bench::of(KIND, |learner| App::with_learner(config, Some(learner)));
    let bound = |latitude: f64, words: f32| ErrorBound {
        limit,
        speed: unit.vehicle.speed,
        latitude,
        words,
    };
    bench.run(5.0);
    // 2 % pass the check of the rate unnoticed
    assert_eq!(reported(&mut bench), bound(LATITUDE, 1.02).table());
    let at_the_equator = fix(5, 0);
    bench.device.lines.gnss.input.extend(at_the_equator);
    bench.run(1.0);
    assert_eq!(reported(&mut bench), bound(0.0, 1.02).table());
    assert!(bound(PLACE.latitude, 1.02).table() < bound(LATITUDE, 1.02).table());
    // five times as many samples as configured, as from a KVH at 5 kHz
    for _ in 0..20_000 {
        bench.step(5.0);
    }
    let often = reported(&mut bench);
    let expected = bound(0.0, 5.0).table();
    for (got, expected) in often.into_iter().zip(expected) {
        let ratio = f64::from(got) / f64::from(expected);
        assert!((0.99..1.01).contains(&ratio), "{often:?} {expected}");
    }
    // and the highest rate is not forgotten when the rate is right again
    bench.run(60.0);
    assert_eq!(reported(&mut bench), often);
}

/// Without a configuration nothing is corrected.
#[test]
fn a_device_that_only_passes_bytes_adds_nothing() {
    unconfigured().ask(&Request::GetHealth, |answer| match answer {
        Response::Health(health) => assert_eq!(health.error_bound_m, [0; 5]),
        other => panic!("{other:?}"),
    });
}
