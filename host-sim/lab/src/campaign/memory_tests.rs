//! Campaigns with earlier drives, on short drives and few runs.

use super::*;
use host_core::inertial::ekf::{Regressor, Triad, TurnOn};
use host_core::inertial::units::{DEG_PER_H, UG};
use host_estimation::learning::teacher::Assumptions;
use host_unit::Unit;
use statrs::distribution::{ChiSquared, ContinuousCDF};

fn campaign(drives: &[u32], fixes: bool, schemes: &[&str]) -> Campaign {
    let scenario = Scenario::load("medium").unwrap();
    Campaign {
        schemes: schemes.iter().map(|name| (*name).to_owned()).collect(),
        drives: drives.to_vec(),
        fixes,
        ..Campaign::single(scenario, &[ErrorModelName::Thermal])
    }
}

fn row<'a>(rows: &'a [Row], scheme: &str, drives: u32) -> &'a Row {
    let mut found = rows.iter();
    found
        .find(|row| row.scheme == scheme && row.drives == drives)
        .unwrap()
}

/// A unit whose biases step and age is judged as it is after its drives, others as ever.
#[test]
fn real_units_change_from_drive_to_drive() {
    let mut of = campaign(&[0, 40], false, &["uncorrected"]);
    of.models = ["linear", "real"].map(|name| name.parse().unwrap()).into();
    let rows = of.run(&Tuning::default(), 2).unwrap();
    let error = |group: &str, drives| {
        let group: Group = group.parse().unwrap();
        let mut rows = rows.iter();
        let row = rows.find(|row| row.error_model == group && row.drives == drives);
        row.unwrap().horizontal_m
    };
    assert_eq!(error("linear", 0), error("linear", 40));
    assert_ne!(error("real", 0), error("real", 40));
}

/// Without earlier drives a memory is empty. Schemes without memory have the same row after each
/// number of drives, that of a campaign without drives. Schemes with memory have other rows.
#[test]
fn a_memory_without_drives_is_the_filter_without_memory() {
    let names = ["ekf6", "ekf6-memory", "ekf-exp", "ekf-exp-memory"];
    let both = campaign(&[0, 1], true, &names);
    let rows = both.run(&Tuning::default(), 3).unwrap();
    let today = campaign(&[0], true, &names);
    let today = today.run(&Tuning::default(), 3).unwrap();
    assert_eq!((rows.len(), today.len()), (2 * 5, 5));
    for old in &today {
        assert_eq!(old, row(&rows, &old.scheme, 0));
    }
    for name in ["ekf6", "ekf-exp"] {
        let memory = format!("{name}-memory");
        let of = |scheme: &str, drives| row(&rows, scheme, drives).north_m;
        assert_eq!(of(name, 0), of(&memory, 0), "{name}");
        assert_eq!(of(name, 0), of(name, 1), "{name}");
        assert_ne!(of(&memory, 0), of(&memory, 1), "{name}");
    }
    assert_eq!(
        row(&rows, "floor", 0).north_m,
        row(&rows, "floor", 1).north_m
    );
    // computed, not copied: the scheme itself has an empty memory at first
    let imu = both.imu();
    let mut compared = 0;
    both.sessions(&imu, 3, |_, case| {
        let of = |name: &str| SCHEMES.iter().find(|(n, _)| *n == name).unwrap().1;
        for name in ["ekf6", "ekf-exp", "ekf-temp"] {
            let [a, b] = [name.to_owned(), format!("{name}-memory")]
                .map(|name| of(&name)(case).unwrap().position);
            assert_eq!(a, b, "{name}");
            compared += 1;
        }
        Ok(())
    })
    .unwrap();
    assert_eq!(compared, 6);
}

/// Without fixes the device corrects nothing before its first drive, and then by its stored
/// networks. This unit has constant biases, so errors are smaller if they are known from earlier
/// drives.
#[test]
fn without_fixes_only_memory_helps() {
    let frozen = "ekf6-memory-frozen";
    let names = [
        "uncorrected",
        "ekf6",
        "ekf6-memory",
        frozen,
        "limit",
        "device",
    ];
    let mut campaign = campaign(&[0, 1, 2], false, &names);
    campaign.models = vec![ErrorModelName::Linear.into()];
    let rows = campaign.run(&Tuning::default(), 14).unwrap();
    let end = |scheme: &str, drives| row(&rows, scheme, drives).horizontal_m[4];
    assert_eq!(end("device", 0), end("uncorrected", 0));
    assert_eq!(end("ekf6-memory", 0), end("ekf6", 0));
    assert_eq!(end(frozen, 0), end("uncorrected", 0));
    for drives in [1, 2] {
        assert_eq!(end("uncorrected", drives), end("uncorrected", 0));
        assert_eq!(end("limit", drives), end("limit", 0));
        for scheme in ["ekf6-memory", frozen, "device"] {
            let (with, without) = (end(scheme, drives), end(scheme, 0));
            assert!(with < 0.5 * without, "{scheme}: {with} of {without} m");
        }
    }
    assert!(end("limit", 0) < 0.5 * end("uncorrected", 0));
    assert_ne!(end("ekf6-memory", 1), end("ekf6-memory", 2));
    // The second drive does not move the device's networks by more than their standard deviations,
    // so they stay; what it remembers of the unit is stored anew.
    let known = campaign.known(&campaign.imu(), &Tuning::default(), 14);
    let known = known.unwrap();
    let flash = |drives| {
        let mut after = known.iter().filter(|known| known.0 == drives);
        after.next().unwrap().2.device().unwrap().flash().clone()
    };
    assert_ne!(flash(1), flash(2));
}

/// Biases of a unit and of the turn-on, drawn from the filter's prior: after three drives the
/// distance between the unit's biases and the remembered ones, normalised by the remembered
/// covariance, is a chi-square variable (two-sided 99.9 % bounds over all units).
#[test]
fn what_is_remembered_of_a_unit_is_as_good_as_it_claims() {
    const UNITS: u32 = 16;
    let mut unit = Unit::default();
    let mut imu = unit.simulated().error_model(ErrorModelName::Noise);
    (imu.gyro.bias_unit_dph, imu.gyro.bias_turn_on_dph) = (0.3, 0.1);
    (imu.accel.bias_unit_ug, imu.accel.bias_turn_on_ug) = (300.0, 100.0);
    unit.simulation = Some(imu);
    unit.gyro.bias_turn_on_dph = 0.3_f64.hypot(0.1);
    unit.accel.bias_turn_on_ug = 300.0_f64.hypot(100.0);
    (unit.gyro.bias_in_run_dph, unit.accel.bias_in_run_ug) = (0.0, 0.0);
    let prior = Assumptions::of(&unit).prior;
    assert!((prior.gyro_bias / DEG_PER_H / 0.1_f64.sqrt() - 1.0).abs() < 1e-9);
    assert!((prior.accel_bias / UG / 1e5_f64.sqrt() - 1.0).abs() < 1e-9);
    let mut campaign = campaign(&[3], true, &["ekf6-memory"]);
    campaign.models = vec![ErrorModelName::Linear.into()];
    campaign.scenario.set_unit("assumed.toml", unit);
    let mut tuned = Tuned::default();
    tuned.turn_on[0] = TurnOn {
        law: 1.0,
        ..TurnOn::of_all(0.1)
    };
    let imu = campaign.imu();
    let squares: Vec<f64> = (0..UNITS)
        .into_par_iter()
        .map(|k| {
            let mut memory = memory::Memory::default();
            let mut truth = Vec::new();
            for number in 1..=3 {
                let each = |_, case: &Case<'_>| {
                    let case = Case { tuned, ..*case };
                    let bias = |triad, axis| {
                        let one = host_core::inertial::ekf::Parameter::constant(
                            triad,
                            axis,
                            Regressor::One,
                            1.0,
                        );
                        case.knows.unit.value(&one)
                    };
                    let of = |triad| (0..3).map(move |axis| (triad, axis));
                    let all = of(Triad::Gyro).chain(of(Triad::Accel));
                    truth = all.map(|(triad, axis)| bias(triad, axis)).collect();
                    memory.keep(0, &case).unwrap();
                    Ok(())
                };
                campaign.earlier(&imu, k, number, each).unwrap();
            }
            let known = &memory.of(0)[0].unit;
            let off = &known.mean - nalgebra::DVector::from_vec(truth);
            let sigma = known.p.diagonal().map(f64::sqrt);
            let unit = off.component_div(&sigma);
            let correlation =
                nalgebra::DMatrix::from_fn(6, 6, |i, j| known.p[(i, j)] / (sigma[i] * sigma[j]));
            unit.dot(&correlation.cholesky().unwrap().solve(&unit))
        })
        .collect();
    let sum: f64 = squares.iter().sum();
    let chi = ChiSquared::new(6.0 * f64::from(UNITS)).unwrap();
    let bounds = [chi.inverse_cdf(5e-4), chi.inverse_cdf(1.0 - 5e-4)];
    assert!(
        bounds[0] < sum && sum < bounds[1],
        "{sum} {bounds:?} {squares:?}"
    );
}

/// On a unit whose biases alone are constant the search finds that: the share that is new at a
/// turn-on, with the drift in run, is 0.004.
#[test]
fn the_search_finds_what_stays() {
    let mut campaign = campaign(&[2], false, &["ekf6-memory"]);
    campaign.models = vec![ErrorModelName::Linear.into()];
    campaign.tuning_units = 4;
    let steps = std::sync::atomic::AtomicU32::new(0);
    let count = || {
        steps.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    };
    let tuning = Tuning::find(&campaign, &campaign.imu(), &count).unwrap();
    let turn_on = tuning.of(ErrorModelName::Linear.into()).turn_on[0];
    for share in [turn_on.gyro, turn_on.accel] {
        assert!((1e-4..=0.02).contains(&share), "{share}");
    }
    assert_eq!(
        steps.into_inner(),
        campaign.tuning_units * campaign.tuning_rounds()
    );
    assert_eq!(campaign.tuning_rounds(), 5);
    campaign.drives = vec![0];
    assert_eq!(campaign.tuning_rounds(), 1);
}

/// The rivals of `replay sessions` take part where they are named. What remembers this unit's
/// constant biases has a much smaller error than before its first drive, and `last` is `none`
/// before that.
#[test]
fn rivals_take_part_where_they_are_named() {
    let tight = ["ekf6-tight", "ekf12-tight", "ekf24-tight"];
    let names = [&["uncorrected", "rest", "last"][..], &tight].concat();
    let mut named = campaign(&[0, 2], false, &names);
    named.models = vec![ErrorModelName::Linear.into()];
    let rows = named.run(&Tuning::default(), 14).unwrap();
    let end = |scheme: &str, drives| row(&rows, scheme, drives).horizontal_m[4];
    assert!((end("last", 0) / end("uncorrected", 0) - 1.0).abs() < 1e-6);
    assert_eq!(end("rest", 0), end("rest", 2));
    assert_ne!(end("rest", 0), end("uncorrected", 0));
    for scheme in ["last"].into_iter().chain(tight) {
        let (with, without) = (end(scheme, 2), end(scheme, 0));
        println!("{scheme}: {with} of {without} m");
        assert!(with < 0.5 * without, "{scheme}: {with} of {without} m");
    }
    let all = campaign(&[0], true, &[]).names();
    assert!(all.iter().any(|name| name == "ekf6-memory"));
    assert!(
        !names[1..]
            .iter()
            .any(|name| all.iter().any(|of| of == name)),
        "{all:?}"
    );
}
