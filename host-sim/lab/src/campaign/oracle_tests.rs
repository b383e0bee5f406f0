//! The residual error of the oracle: on every group of errors, against an IMU with noise alone.

use super::bench::Bench;
use super::*;
use host_core::inertial::session::Session;
use host_core::simulator::imu::Draws;
use host_core::simulator::session::{SessionConfig, drive, measured};
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::Assumptions;
use std::cell::OnceCell;

fn campaign(preset: &str) -> (Campaign, ImuSpec) {
    let mut imu = ImuSpec::preset(preset).unwrap();
    imu.rate_hz = RATE_HZ;
    let campaign = Campaign::single(Scenario::default(), &ErrorModelName::ALL);
    (campaign, imu)
}

/// Takes some minutes:
/// `cargo nextest run --run-ignored only -p host-lab oracle_against_the_floor --no-capture`.
#[test]
#[ignore = "a measurement of minutes; what it must not lose is tested below on one unit"]
fn oracle_against_the_floor() {
    for preset in ["medium", "nav"] {
        let (campaign, imu) = campaign(preset);
        let runs: Vec<Vec<f64>> = (0..24)
            .into_par_iter()
            .map(|k| {
                let mut row = vec![];
                let end = |free: Option<FreeInertial>| free.unwrap().position[1320].xy().norm();
                let judge = |model, case: &Case<'_>| {
                    if model == ErrorModelName::Noise.into() {
                        row.push(end(schemes::none(case, case.increments(), 1.0)));
                    }
                    row.push(end(oracle_of(case)));
                    Ok(())
                };
                campaign.sessions(&imu, k, judge).unwrap();
                row
            })
            .collect();
        let column =
            |i: usize| statistics::median(&mut runs.iter().map(|r| r[i]).collect::<Vec<_>>());
        println!("{preset}: floor {:.0} m", column(0));
        for (i, model) in campaign.models.iter().enumerate() {
            println!("{preset}: oracle on {model} {:.0} m", column(i + 1));
        }
    }
}

fn oracle_of(case: &Case<'_>) -> Option<FreeInertial> {
    let (_, oracle) = SCHEMES.iter().find(|(name, _)| *name == "oracle").unwrap();
    oracle(case)
}

/// With its parameters given, the oracle removes most of each cause, which is far larger than in
/// any preset: within 5 min of free-inertial navigation after 10 min of aiding. So does the limit,
/// which knows its size. The consistency tests of the filter judge causes that only wander.
#[test]
fn the_oracle_knows_every_cause() {
    let (campaign, imu) = campaign("medium");
    let noise = imu.error_model(ErrorModelName::Noise);
    let config = SessionConfig {
        gnss: &campaign.scenario.gnss,
        start: campaign.scenario.start(),
        heading: 0.3,
        ..SessionConfig::new(&imu, [300.0, 900.0], [11, 12, 13])
    };
    let (truth, fixes) = drive(&config);
    let causes = noise.each_cause_large();
    assert!(causes.len() >= 19, "{}", causes.len());
    let failed: Vec<String> = causes
        .into_par_iter()
        .filter_map(|(name, spec)| {
            let draws = Draws::of(config.turn_on, false);
            let (session, imu) = measured(&config, &spec, &truth, &fixes, draws);
            let session = Session {
                gather: GATHER,
                ..session
            };
            let case = Case {
                session: &session,
                increments: &OnceCell::new(),
                bench: &Bench::default(),
                knows: Knowledge {
                    assumptions: &Assumptions::of_simulated(&spec),
                    device: &Device::of_unit(&host_unit::Unit::default()).unwrap(),
                    simulated: &spec,
                    unit: &imu.unit_errors(),
                    beyond: &[],
                },
                tuned: Tuned::default(),
                until: 900,
                fixes: true,
                memory: None,
            };
            let end = |free: Option<FreeInertial>| free.unwrap().position[300].xy().norm();
            let none = end(schemes::none(&case, case.increments(), 1.0));
            let oracle = end(oracle_of(&case));
            let limit = end(limit::limit(&case));
            println!("{name}: none {none:.1} m, oracle {oracle:.1} m, limit {limit:.1} m");
            let failed = oracle > 0.3 * none || limit > 0.3 * none;
            failed.then(|| format!("{name}: {oracle} m, limit {limit} m of {none} m"))
        })
        .collect();
    assert!(failed.is_empty(), "{failed:#?}");
}
