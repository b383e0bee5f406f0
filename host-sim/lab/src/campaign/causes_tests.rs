//! The groups of a single cause: their errors, and the assumptions of schemes that know its size.

use super::causes::{Size, beside, enlarged, fixes, receiver};
use super::measuring::Measuring;
use super::*;
use host_core::inertial::gnss::Fix;
use host_core::inertial::sins::Increment;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::session::Drive;
use host_core::simulator::truth::Vehicle;
use host_estimation::learning::teacher::Assumptions;
use nalgebra::Vector3;

fn group(name: &str) -> Group {
    name.parse().unwrap()
}

fn truth() -> (Drive, GnssSpec) {
    let campaign = tests::of_one_run();
    let (imu, own) = (campaign.imu(), GnssSpec::default());
    (
        {
            let config = campaign.config(&imu, &own, Seeds::of(2), 2640);
            Measuring::of(&Vehicle::Road, &config).drive
        },
        own,
    )
}

/// Sample moments of the fixes against those of the cause: north errors of position and velocity
/// over 44 min, divided by the reported accuracy.
#[test]
fn the_reported_accuracy_is_true_only_where_the_group_says_so() {
    let (drive, own) = truth();
    let errors = |name: &str| {
        let fixes = fixes(&drive, &own, group(name));
        let pairs = drive.truth.epochs.iter().zip(fixes).skip(10);
        let of = |(at, fix): (&host_core::inertial::sins::NavState, Option<Fix>)| {
            let fix = fix?;
            let north = fix.position.ned_from(&at.position).x / fix.sigmas[0];
            Some([
                north.powi(2),
                ((fix.velocity - at.velocity).x / fix.sigmas[3]).powi(2),
            ])
        };
        let all: Vec<[f64; 2]> = pairs.filter_map(of).collect();
        let rms = |i: usize| (all.iter().map(|e| e[i]).sum::<f64>() / all.len() as f64).sqrt();
        (rms(0), rms(1), all.len())
    };
    let near = |(p, v, _): (f64, f64, usize), want: [f64; 2], by: f64| {
        let apart = (p / want[0] - 1.0).abs().max((v / want[1] - 1.0).abs());
        assert!(apart < by, "{p} {v}, expected {want:?}");
    };
    near(errors("linear"), [1.0, 1.0], 0.05);
    near(errors("optimistic-fixes"), [3.0, 3.0], 0.05);
    near(errors("optimistic-fixes+told"), [1.0, 1.0], 0.05);
    // some twenty independent position errors in 44 min: good to a third
    near(
        errors("coloured-fixes"),
        [10.0_f64.sqrt(), 3.56_f64.sqrt()],
        0.35,
    );
    near(errors("coloured-fixes+told"), [1.0, 1.0], 0.35);
    let (unknown, known) = (errors("multipath"), errors("multipath+told"));
    assert!(
        unknown.0 > 3.0 && known.0 < 0.5 * unknown.0,
        "{unknown:?} {known:?}"
    );
    let (all, left) = (errors("linear").2, errors("gaps").2);
    let share = left as f64 / all as f64;
    assert!((0.7..0.95).contains(&share), "{share}");
    // the car is half a second ahead of the fix, and drives off and brakes in that time
    let late = errors("late-fixes");
    assert!(late.0 > 3.0 && late.1 > 3.0, "{late:?}");
}

#[test]
fn latency_and_lever_arm_are_known_or_not() {
    let own = GnssSpec::default();
    let antenna = |name: &str| receiver(&own, group(name)).antenna_prior();
    assert_eq!(antenna("late-fixes").age_s, [0.0; 2]);
    assert_eq!(antenna("late-fixes+told").age_s, [0.5, 0.0]);
    assert_eq!(antenna("lever-arm").lever_arm_m, [0.0; 3]);
    let with = receiver(&own, group("lever-arm+told"));
    assert_eq!(Some(with.antenna_prior().lever_arm_m), with.lever_arm_m);
}

/// A bias of two on one axis of a unit and none on another, and a ramp of 3 in an hour: closed
/// form.
#[test]
fn the_size_of_a_cause_is_its_root_mean_square_and_its_change() {
    let seconds = |of: &dyn Fn(f64) -> f64| -> Vec<Increment> {
        let at = |k: usize| Increment {
            dtheta: Vector3::new(of(k as f64), 0.0, 0.0),
            dv: Vector3::repeat(5.0),
        };
        (0..4000).map(at).collect()
    };
    let size = Size::of(&[&seconds(&|_| 2.0), &seconds(&|_| 0.0)], 300..3900);
    assert!((size.bias[0] - (4.0_f64 / 6.0).sqrt()).abs() < 1e-12);
    assert_eq!((size.bias[1], size.walk), (5.0, [0.0; 2]));
    let ramp = Size::of(&[&seconds(&|t| 3.0 * t / 3600.0)], 300..3900);
    // the means of the first and last two minutes are 58 min apart
    let want = 3.0 * (58.0 / 60.0) / 3.0_f64.sqrt();
    assert!((ramp.walk[0] - want).abs() < 1e-9, "{ramp:?} {want}");
}

#[test]
fn a_datasheet_with_a_known_cause_has_larger_biases() {
    let assumptions = Assumptions::of(&host_unit::Unit::default());
    assert_eq!(
        enlarged(&assumptions, &Size::default()).prior.gyro_bias,
        assumptions.prior.gyro_bias
    );
    let size = Size {
        bias: [3.0 * assumptions.prior.gyro_bias, 0.0],
        walk: [assumptions.in_run[0] * assumptions.prior.gyro_bias, 0.0],
    };
    let with = enlarged(&assumptions, &size);
    assert!((with.prior.gyro_bias / assumptions.prior.gyro_bias - 10.0_f64.sqrt()).abs() < 1e-12);
    let walk = with.in_run[0] * with.prior.gyro_bias;
    let before = assumptions.in_run[0] * assumptions.prior.gyro_bias;
    assert!((walk / before - 2.0_f64.sqrt()).abs() < 1e-12);
    assert_eq!(with.prior.accel_bias, assumptions.prior.accel_bias);
}

/// Under each cause of the sensors for which the oracle has no parameters, it has the same errors
/// as without the cause.
#[test]
fn the_oracle_knows_the_environment() {
    let models = [ErrorModelName::Linear].into_iter();
    let campaign = Campaign {
        models: models
            .chain(ErrorModelName::CAUSES)
            .map(Group::from)
            .collect(),
        ..tests::of_one_run()
    };
    let (_, oracle) = SCHEMES.iter().find(|(name, _)| *name == "oracle").unwrap();
    let end = |case: &Case<'_>| oracle(case).unwrap().position.last().unwrap().xy().norm();
    let (mut linear, mut judged, mut blind_is_worse) = (0.0, 0, 0);
    let each = |group: Group, case: &Case<'_>| {
        if group == ErrorModelName::Linear.into() {
            linear = end(case);
        }
        if case.knows.beyond.is_empty() {
            return Ok(());
        }
        let knows = Knowledge {
            beyond: &[],
            ..case.knows
        };
        let (with, blind) = (end(case), end(&Case { knows, ..*case }));
        println!("{group}: {with:.0} m, blind {blind:.0} m, without the cause {linear:.0} m");
        assert!(
            (with / linear - 1.0).abs() < 0.02,
            "{group}: {with}, {linear} m"
        );
        judged += 1;
        blind_is_worse += usize::from(blind > 1.5 * with);
        Ok(())
    };
    campaign.sessions(&campaign.imu(), 1, each).unwrap();
    assert_eq!((judged, blind_is_worse), (10, 4));
}

/// Two sessions of the same seeds differ only by the additional cause of one.
#[test]
fn groups_differ_by_their_cause_alone() {
    let campaign = tests::of_one_run();
    let (imu, gnss) = (campaign.imu(), GnssSpec::default());
    let config = campaign.config(&imu, &gnss, Seeds::of(4), 600);
    let mut measuring = Measuring::of(&Vehicle::Road, &config);
    let mut of = |name| measuring.session(&config, &imu.error_model(name), &[]).0;
    let linear = of(ErrorModelName::Linear);
    let same = beside(&of(ErrorModelName::Linear), &linear);
    assert!(same.iter().all(|w| *w == Increment::default()));
    // the residual of dither is noise to all schemes
    let dither = ErrorModelName::Dither;
    for name in ErrorModelName::CAUSES
        .into_iter()
        .filter(|name| *name != dither)
    {
        let by = beside(&of(name), &linear);
        assert!(by.iter().any(|w| *w != Increment::default()), "{name}");
    }
}
