//! A small simulated fleet from its drives to its prior.

use super::*;
use firmware::inputs::Source;
use host_core::simulator::imu::ErrorModelName;

const INPUTS: [Source; 3] = [
    Source::Temperature,
    Source::TemperatureRate,
    Source::Vibration,
];

fn fleet(out: PathBuf, shard: (u32, u32)) -> Fleet {
    let mut scenario = host_unit::scenario::Scenario::default();
    scenario.set_start("mixed").unwrap();
    let name = ErrorModelName::ThermalLag;
    let campaign = Campaign {
        runs: 10,
        ..Campaign::single(scenario, &[name])
    };
    Fleet {
        from: Origin::Simulation {
            campaign: Box::new(campaign),
            group: name.into(),
            drives: 2,
        },
        inputs: [INPUTS; 2],
        out,
        resume: false,
        shard,
    }
}

/// Two merged shards in separate directories give the same bytes as one run. A directory of another
/// fleet is rejected and named.
#[test]
fn shards_merge_to_the_same_prior() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let run = |name: &str, shard| {
        let of = Fleet {
            ..fleet(at(name), shard)
        };
        of.execute(&|| {}).unwrap();
        of.wanted().len()
    };
    assert_eq!(run("all", (0, 1)), 10);
    assert_eq!(run("even", (0, 2)) + run("odd", (1, 2)), 10);
    let [all, shards] =
        [vec![at("all")], vec![at("odd"), at("even")]].map(|dirs| merge(&dirs, &[INPUTS; 2]));
    let (all, shards) = (all.unwrap(), shards.unwrap());
    assert_eq!(all, shards);
    assert!(all.iter().all(|drives| drives.len() == 2));
    // the estimated errors are those of the simulation to some ten per cent of the bias
    assert!(all[0][0].errors.len() > 120);

    let few = learn(&all[..9], &[INPUTS; 2], &Unit::default(), &|| {}).unwrap_err();
    assert!(few.to_string().contains("at least 10 units"), "{few}");

    let mut other = fleet(at("all"), (0, 1));
    other.inputs[0][0] = Source::RateX;
    let error = other.execute(&|| {}).unwrap_err().to_string();
    assert!(error.contains("another fleet"), "{error}");
    let wrong = merge(&[at("all")], &other.inputs).unwrap_err().to_string();
    assert!(wrong.contains("--inputs: are not those"), "{wrong}");
    let error = merge(&[at("nowhere")], &[INPUTS; 2])
        .unwrap_err()
        .to_string();
    assert!(error.contains("nowhere"), "{error}");
}
