use super::act::Act;
use super::device::Format;
use super::receiver::{self, Message};
use super::run::Teach;
use super::times::Span;
use super::world::{World, sensor_faults};
use super::*;
use firmware::compensator::Block;
use firmware::configuration::Configuration;
use firmware::learn::{Learner, Report, Winner};
use firmware::model::Nets;
use firmware::sample::StreamScale;
use host_device::hil::networks;
use host_unit::sensor::FormatName;
use lrnn_nostd::State;

const SHORT: Times = Times {
    standstill_s: 120,
    aided_s: 300,
    free_s: 60,
};

fn abuse(cases: &[&str], runs: u32, out: &Path) -> Abuse {
    Abuse {
        cases: cases.iter().map(|name| name.parse().unwrap()).collect(),
        sensors: vec![Sensor::Perfect],
        computers: vec![Computer::Plain, Computer::GaussMarkov],
        activations: vec![Activation::Live, Activation::NextPowerOn],
        times: SHORT,
        runs,
        shard: (0, 1),
        out: out.to_path_buf(),
        resume: false,
    }
}

fn execute(abuse: &Abuse, teach: Teach<'_>) -> Vec<Judged> {
    abuse
        .execute(teach, &AtomicBool::new(false), &|| ())
        .unwrap()
}

/// A learner that promotes networks without having learnt them, or nothing at all.
struct Broken {
    promotes: bool,
}

impl Learner for Broken {
    fn begin(&mut self, _: &Nets, _: StreamScale) {}
    fn restart(&mut self) {}
    fn block(&mut self, _: u32, _: &Block) {}
    fn gap(&mut self) {}
    fn winner(&mut self) -> Option<Winner> {
        self.promotes.then(|| Winner {
            nets: networks(),
            states: [State::new(); 2],
            estimate: [[1e-6; 3], [1e-3; 3]],
        })
    }
    fn learnt(&mut self) -> (Nets, [State; 2]) {
        (networks(), [State::new(); 2])
    }
    fn report(&self) -> Report {
        Report {
            winner: u8::from(self.promotes),
            promotions: u32::from(self.promotes),
            still_s: 10,
            ..Report::default()
        }
    }
}

fn broken(_: &Configuration, then: &mut dyn FnMut(&mut dyn Learner)) {
    then(&mut Broken { promotes: true });
}

fn idle(_: &Configuration, then: &mut dyn FnMut(&mut dyn Learner)) {
    then(&mut Broken { promotes: false });
}

/// A device that harms is found: at the next power-on behind every computer, and live behind one
/// that does not estimate biases itself. One that corrects nothing leaves every error as it is, to
/// the last bit.
#[test]
fn a_device_that_harms_is_found() {
    let dir = tempfile::tempdir().unwrap();
    let abuse = abuse(&["none"], 2, dir.path());
    let harmed = summarise(&execute(&abuse, &broken), &abuse.cases);
    assert_eq!(harmed.len(), 4);
    for of in &harmed {
        let absorbs = of.activation == Activation::Live && of.computer != Computer::Plain;
        assert!(of.harms() || absorbs, "{of:?}");
        assert_eq!((of.runs, of.promoted_share), (2, 1.0));
    }
    let left = execute(&abuse, &idle);
    assert!(
        left.iter()
            .all(|row| row.corrected_m == row.raw_m && !row.promoted)
    );
    assert!(
        left.iter().all(|row| (0.01..100.0).contains(&row.raw_m)),
        "{left:?}"
    );
}

/// Interrupted and resumed runs, and merged shards, equal a run in one go.
#[test]
fn resumed_and_divided_runs_equal_the_whole() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let cases = ["none", "standing", "no-counter"];
    let whole = abuse(&cases, 2, &at("whole"));
    let rows = execute(&whole, &broken);
    assert_eq!(rows.len(), 2 * 3 * 4);

    let mut stopped = abuse(&cases, 2, &at("stopped"));
    let stop = AtomicBool::new(false);
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    one.install(|| stopped.execute(&broken, &stop, &|| stop.store(true, Ordering::Relaxed)))
        .unwrap();
    stopped.resume = true;
    let more = std::sync::atomic::AtomicU32::new(0);
    let count = || {
        more.fetch_add(1, Ordering::Relaxed);
    };
    let resumed = stopped
        .execute(&broken, &AtomicBool::new(false), &count)
        .unwrap();
    assert_eq!(resumed, rows);
    assert_eq!(u64::from(more.into_inner()), whole.length());

    let shards: Vec<PathBuf> = (0..2)
        .map(|i| {
            let mut shard = abuse(&cases, 2, &at(&format!("shard{i}")));
            shard.shard = (i, 2);
            assert_eq!(execute(&shard, &broken).len(), rows.len() / 2);
            shard.out
        })
        .collect();
    assert_eq!(merge(&shards).unwrap(), rows);

    // other cases in the same directory are rejected, and nothing is lost
    let other = abuse(&["none"], 2, &at("whole"));
    let refused = other.execute(&broken, &AtomicBool::new(false), &|| ());
    assert!(matches!(refused, Err(Error::NotOurs { .. })));
    assert_eq!(merge(&[at("whole")]).unwrap(), rows);
}

/// The messages of a receiver with these acts of a case.
/// Rows of two commands are joined if they are others, and of one version.
#[test]
fn rows_of_several_commands_are_joined() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let of = |name: &str, cases: &[&str]| execute(&abuse(cases, 1, &at(name)), &idle);
    let (one, other) = (of("one", &["jump"]), of("other", &["late-1"]));
    of("both", &["jump", "late-1"]);
    let joined = merge(&[at("one"), at("other")]).unwrap();
    assert_eq!(joined.len(), one.len() + other.len());
    assert!(one.iter().chain(&other).all(|row| joined.contains(row)));
    let refused = |dirs: &[PathBuf]| merge(dirs).unwrap_err().to_string();
    let twice = refused(&[at("one"), at("both")]);
    assert!(
        twice.contains("holds runs that are there already"),
        "{twice}"
    );
    let stamp = std::fs::read_to_string(at("other").join(STAMP.file)).unwrap();
    let older = stamp.replace("learner ", "learner 0");
    std::fs::write(at("other").join(STAMP.file), older).unwrap();
    let mixed = refused(&[at("one"), at("other")]);
    assert!(mixed.contains("holds runs of another version"), "{mixed}");
}

fn sent(world: &World, acts: &[(Act, Span)]) -> Vec<Message> {
    let faults: Vec<_> = acts
        .iter()
        .filter_map(|(act, span)| match act {
            Act::Receiver(fault) => Some((*fault, span.seconds(&SHORT))),
            _ => None,
        })
        .collect();
    let elsewhere = || World::elsewhere(&SHORT, 0);
    receiver::messages(&faults, &world.truth, elsewhere, 9, SHORT.until())
}

/// Every case of the receiver changes its messages, and none before its span.
#[test]
fn cases_of_the_receiver_change_its_messages() {
    let world = World::learning(&SHORT, (Motion::Road, None), 0);
    let clean = sent(&world, &[]);
    assert_eq!(clean.len(), 420);
    assert!(
        clean
            .iter()
            .enumerate()
            .all(|(k, of)| of.at_us == k as u64 * 1_000_000 + 1_100_000)
    );
    let names = table::PARTS[1].1.iter().map(|row| (row.name, row.span));
    let ended = names
        .clone()
        .map(|(name, _)| (format!("{name}:ended"), Span::Ends));
    let all = names.map(|(name, span)| (name.to_owned(), span));
    for (name, span) in all.chain(ended) {
        let case: Case = name.parse().unwrap();
        let with = sent(&world, &case.acts);
        assert!(with != clean, "{case}");
        // a fix arrives 0.1 s after its time
        let [from, to] = span.seconds(&SHORT);
        let [from, to] = [from - 0.5, to + 0.5].map(|s| (s.max(0.0) * 1e6) as u64);
        let outside = |of: &&Message| !(from..to).contains(&of.at_us);
        let [a, b]: [Vec<&Message>; 2] =
            [&with, &clean].map(|all| all.iter().filter(outside).collect());
        assert!(a == b, "{case}");
    }
}

/// Every case of the sensor changes the samples of a drive; no other case does.
#[test]
fn cases_of_the_sensor_change_its_samples() {
    let worlds = [
        World::learning(&SHORT, (Motion::Road, None), 0),
        World::next(&SHORT, (Motion::Road, None), 0, 0),
    ];
    let counts = |case: &Case| {
        let of = |world: &World| {
            let faults = sensor_faults(case);
            world.measured(Sensor::Errors, &faults).counts
        };
        [of(&worlds[0]), of(&worlds[1])]
    };
    let clean = counts(&"none".parse().unwrap());
    for row in table::PARTS[3].1 {
        let case: Case = row.name.parse().unwrap();
        let with = counts(&case);
        let hot = row.name == "hot-restart";
        assert_eq!(with[0] == clean[0], hot, "{case}");
        let ends = row.span != Span::Always && !row.name.starts_with("bias");
        // the next drive is so short that nothing saturates
        if row.name != "saturating" {
            assert_eq!(with[1] == clean[1], ends, "{case}");
        }
        let start = SHORT.standstill_s as usize * 100;
        if row.span != Span::Always && row.name != "bias-inverted" {
            assert_eq!(with[0][..start], clean[0][..start], "{case}");
        }
    }
    for row in table::PARTS[1].1 {
        assert!(sensor_faults(&row.name.parse().unwrap()).is_empty());
    }
}

/// Every case of the line, of the configuration, and of the requests changes these.
#[test]
fn cases_of_line_and_configuration_change_these() {
    let world = World::learning(&SHORT, (Motion::Road, None), 0);
    let session = world.measured(Sensor::Perfect, &[]);
    let frames = |acts: &[(Act, Span)]| {
        let faults: Vec<_> = acts
            .iter()
            .filter_map(|(act, span)| match act {
                Act::Line(fault) => Some((*fault, span.seconds(&SHORT))),
                _ => None,
            })
            .collect();
        line::frames(&faults, &session.counts, (session.dt, &session.lsb), 3)
    };
    let clean = frames(&[]);
    for row in table::PARTS[4].1 {
        let case: Case = row.name.parse().unwrap();
        assert_eq!(
            frames(&case.acts) == clean,
            row.name == "no-counter",
            "{case}"
        );
    }
    let configuration = |case: &Case| {
        let faults = case.acts.iter().filter_map(|(act, _)| match act {
            Act::Configured(fault) => Some(*fault),
            _ => None,
        });
        configured::configuration(faults, (Sensor::Perfect, FormatName::Novatel)).unwrap()
    };
    let honest = configuration(&"none".parse().unwrap());
    for row in table::PARTS[5].1 {
        let case: Case = row.name.parse().unwrap();
        let asks = case.acts.iter().any(|(act, span)| match act {
            Act::Asked(asked) => !asked.requests(*span, &SHORT).is_empty(),
            _ => false,
        });
        assert!(asks || configuration(&case) != honest, "{case}");
    }
    let lsb = |counted| Format::of(counted).lsb();
    assert_eq!(lsb(true), lsb(false));
    assert_eq!(lsb(true), session.lsb);
}

/// Every motion is another one from the end of the standstill on; the next drive is a usual one.
#[test]
fn cases_of_the_motion_change_the_drive() {
    let clean = World::learning(&SHORT, (Motion::Road, None), 0).truth;
    let standstill = SHORT.standstill_s as usize;
    for row in table::PARTS[2].1 {
        let case: Case = row.name.parse().unwrap();
        if row.name == "align-moving" {
            continue;
        }
        let truth = World::learning(&SHORT, (case.motion(), None), 0).truth;
        assert_eq!(truth.increments.len(), clean.increments.len(), "{case}");
        assert!(truth.epochs != clean.epochs, "{case}");
        let speed = |k: usize| truth.epochs[k].velocity.xy().norm();
        if row.name != "ship" {
            assert!((0..standstill).all(|k| speed(k) < 0.05), "{case}");
        }
    }
    let case: Case = "creep".parse().unwrap();
    let truth = World::learning(&SHORT, (case.motion(), None), 0).truth;
    let creeps = |k: &usize| (0.1..0.25).contains(&truth.epochs[*k].velocity.xy().norm());
    assert!((standstill + 5..standstill + 42).filter(creeps).count() > 30);
}

/// Every case of the first rest but one disturbs the drive before its standstill, and nothing else
/// of it; a navigation computer gets the drive from the standstill on.
#[test]
fn cases_at_power_on_change_what_is_before_the_standstill() {
    let drive = |motion: Motion| World::next(&SHORT, (motion.after(), motion.begins()), 0, 0);
    let clean = drive(Motion::Begins(Begin::Stands, 60.0));
    assert_eq!((clean.begins_s, clean.times.standstill_s), (60, 180));
    let rows = table::PARTS
        .iter()
        .find(|(heading, _)| *heading == table::AT_POWER_ON);
    for row in rows.expect("the part").1 {
        let case: Case = row.name.parse().unwrap();
        assert!(case.only_begins() && !case.ends(), "{case}");
        let world = drive(case.motion());
        let n = 6000;
        let same = world.truth.increments[..n] == clean.truth.increments[..n];
        let stuck = !sensor_faults(&case).is_empty();
        assert_eq!(same, row.name == "rest" || stuck, "{case}");
        assert_eq!(
            world.truth.increments[n..],
            clean.truth.increments[n..],
            "{case}"
        );
        let session = world.measured(Sensor::Mems, &sensor_faults(&case));
        let other = clean.measured(Sensor::Mems, &[]);
        assert_eq!(
            session.counts[..n] == other.counts[..n],
            row.name == "rest",
            "{case}"
        );
        let later = super::world::later(&session, 60);
        assert_eq!(
            (later.standstill, later.epochs()),
            (120, session.epochs() - 60)
        );
        assert_eq!(later.counts[..], session.counts[n..], "{case}");
    }
}

/// The first rest of a device that remembers nothing takes a slow turntable for an error of the
/// gyros, and a standstill for none where there are none.
#[test]
fn the_first_rest_is_judged() {
    let dir = tempfile::tempdir().unwrap();
    let abuse = Abuse {
        activations: vec![Activation::FirstRestNew],
        sensors: vec![Sensor::ConsumerPerfect],
        ..abuse(&["rest", "rest-turntable-0.5"], 1, dir.path())
    };
    let rows = execute(&abuse, &fix_learner);
    assert_eq!(rows.len(), 4);
    for row in rows {
        let turns = row.case != "rest";
        assert_eq!(row.promoted, turns, "{row:?}");
        assert_eq!(row.corrected_m == row.raw_m, !turns, "{row:?}");
    }
}
