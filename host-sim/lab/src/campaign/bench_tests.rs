use super::*;
use crate::campaign::schemes::FILTERS;
use crate::campaign::{Campaign, tests};
use host_core::simulator::imu::ErrorModelName;

/// The filters without laws of time or temperature.
const LAWLESS: [usize; 3] = [0, 1, 2];

/// Every filter with three walks, in one batch and side by side where they are alike, equals the
/// same filter alone: bit for bit, and with laws up to the last digits.
#[test]
fn filters_side_by_side_are_the_filters_alone() {
    let campaign: Campaign = tests::of_one_run();
    let (mut compared, mut most) = (0, 0.0_f64);
    let each = |group, case: &Case<'_>| {
        if group != ErrorModelName::All.into() {
            return Ok(());
        }
        let walks = [0.01, 0.05, 3.2];
        let all = (0..FILTERS.len()).flat_map(|filter| walks.map(|walk| (filter, walk)));
        let wanted: Vec<(usize, f64)> = all.collect();
        case.bench.prepare(case, &wanted).unwrap();
        let start = aligned(case.session, &case.increments()).unwrap();
        for (filter, walk) in wanted {
            let assumptions = case.knows.assumptions.walking(walk);
            let models = models(case.bench, filter, case.session, &assumptions.prior);
            let alone = models.into_iter().map(|model| {
                start.scored(
                    model,
                    &assumptions,
                    case.session,
                    &case.increments(),
                    case.until,
                )
            });
            let alone = alone.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            let beside = case.bench.best(case, filter, walk).unwrap();
            let end =
                |filter: &Aided| from_filter(filter, case.session, case.increments(), case.until);
            let [beside, alone] = [&*beside, &alone];
            let metres = [&beside.0, &alone.0].map(|of| end(of).position[1320].xy());
            let off = (metres[0] - metres[1]).norm() / metres[1].norm();
            if LAWLESS.contains(&filter) {
                assert_eq!(beside.1.to_bits(), alone.1.to_bits(), "{filter} {walk}");
                assert_eq!((&beside.0.p, &beside.0.theta), (&alone.0.p, &alone.0.theta));
                assert_eq!(beside.0.sins.nav, alone.0.sins.nav);
                assert_eq!(metres[0], metres[1]);
            } else {
                assert!((beside.1 / alone.1 - 1.0).abs() < 1e-9, "{filter} {walk}");
                assert!(
                    off < 1e-6,
                    "{filter} {walk}: {off:e} of {} m",
                    metres[1].norm()
                );
            }
            most = off.max(most);
            compared += 1;
        }
        Ok(())
    };
    campaign.sessions(&campaign.imu(), 3, each).unwrap();
    println!("metres differ by at most {most:e} of themselves");
    assert_eq!(compared, 3 * FILTERS.len());
}

/// A filter runs once, even if it is requested again, and as a model of another filter.
#[test]
fn a_filter_runs_once() {
    let campaign: Campaign = tests::of_one_run();
    let each = |group, case: &Case<'_>| {
        if group == ErrorModelName::All.into() {
            let count = || case.bench.solved.borrow().len();
            case.bench.best(case, 0, 0.05).unwrap();
            assert_eq!(count(), 1);
            case.bench.best(case, 4, 0.05).unwrap();
            assert_eq!(count(), 4);
            case.bench.best(case, 4, 0.05).unwrap();
            assert_eq!(count(), 4);
            case.bench.best(case, 4, 0.1).unwrap();
            assert_eq!(count(), 8);
        }
        Ok(())
    };
    campaign.sessions(&campaign.imu(), 3, each).unwrap();
}
