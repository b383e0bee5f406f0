//! The learner's memory is stored while samples are corrected, and comes back at the next power-on
//! of the board or of the sensor, if it is of the same unit.

use crate::frames::Kind;
use crate::record::{HARDWARE, configure, configured, record};
use crate::stored::Flash;
use crate::taught::{Bench, Taught, with};
use firmware::app::App;
use firmware::configuration::record::encode;
use firmware::configuration::{Activation, Configuration};
use firmware::control::Mode;
use firmware::inputs::Source;
use firmware::learn::CombinedLearner;
use firmware::store::{Content, MEMORY_MAX, Progress, Step, Store};
use firmware::wire::command::{Remembered, Request, Response};
use std::sync::Arc;

const KIND: Kind = Kind::RAWIMUSX;

fn unit() -> Configuration {
    let mut unit = configured(KIND);
    unit.identity.serial = "N1".try_into().expect("short");
    unit.correction.mode = Mode::Learn;
    unit.correction.slew.accel = 1e-3;
    unit.correction.silence_us = 100_000;
    unit.correction.check_rate = false;
    unit
}

/// A board: a flash that outlives power-off.
struct Board {
    store: Store<Flash>,
}

impl Board {
    /// With this unit stored.
    fn new(unit: &Configuration) -> Board {
        let mut store = Store::new(crate::stored::blank()).expect("room");
        let record = encode(unit);
        let nets = with(1e-3);
        let content = Content::new(&nets, &record);
        store.save(&content).expect("stored");
        Board { store }
    }

    /// The device after power-on.
    fn power_on(&mut self) -> Bench {
        let flash = core::mem::replace(
            &mut self.store,
            Store::new(crate::stored::blank()).expect("room"),
        )
        .into_inner();
        self.store = Store::new(flash).expect("room");
        self.store.make_room().expect("room");
        let stored = self.store.load();
        let mut memory = [0; MEMORY_MAX];
        let len = self.store.memory(&mut memory);
        Bench::of(KIND, |learner| {
            // as on a board: beside one that learns from references
            let references = Box::leak(Box::new(Taught(Arc::default())));
            let both = CombinedLearner {
                references,
                fixes: Taught(learner.0.clone()),
            };
            let both = Box::leak(Box::new(both));
            let mut app = App::power_on(HARDWARE, Some(stored), Some(both));
            app.recall(&memory[..len]);
            app
        })
    }

    /// Step of storing in a pass of the main loop, if any.
    fn pass(&mut self, bench: &mut Bench) -> Option<Step> {
        let mut seen = None;
        bench.device.app.store(|step, content| {
            seen = Some(step);
            self.store.carry_out(step, content)
        });
        seen
    }

    /// Seconds of samples, a pass after each. Gives how many records were begun.
    fn run(&mut self, bench: &mut Bench, seconds: u32) -> u32 {
        let passes = (f64::from(seconds) * KIND.rate()) as u32;
        let steps = (0..passes).map(|_| {
            bench.step(1.0);
            self.pass(bench)
        });
        steps.filter(|step| *step == Some(Step::Begin)).count() as u32
    }
}

fn remembered(bench: &mut Bench) -> Remembered {
    bench
        .device
        .ask(&Request::GetMemory, |answer| match answer {
            Response::Remembered(remembered) => remembered,
            other => panic!("{other:?}"),
        })
}

/// A bench whose learner navigates and remembers this.
fn learns(bench: &Bench, memory: &[u8]) {
    bench.says.navigates.set(true);
    bench.says.learns.set(memory.to_vec());
}

#[test]
fn a_memory_comes_back_at_the_next_power_on() {
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    assert!(bench.says.knows.borrow().is_empty());
    let nothing = remembered(&mut bench);
    assert_eq!((nothing.drives, nothing.of_another), (0, false));
    let first: Vec<u8> = (0..=255).cycle().take(1700).collect();
    learns(&bench, &first);
    assert_eq!(board.run(&mut bench, 5), 0);
    assert_eq!(board.run(&mut bench, 327), 8);
    let now = remembered(&mut bench);
    assert_eq!((now.drives, now.minutes, now.temperatures), (1, 4, None));
    assert!(now.acts, "what was stored before this drive");
    for drive in 2..5 {
        bench = board.power_on();
        board.run(&mut bench, 1);
        assert_eq!(*bench.says.knew.borrow(), first);
        learns(&bench, &first);
        assert_eq!(board.run(&mut bench, 72), 4);
        let now = remembered(&mut bench);
        assert_eq!(now.drives, drive);
        assert_eq!(now.minutes, 4, "50 s are no minute");
    }
}

/// One piece of 64 bytes in a pass, and nothing moves in the drive.
#[test]
fn a_pass_stores_one_piece_while_samples_are_corrected() {
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    learns(&bench, &[7; 1792]);
    let mut steps = Vec::new();
    for _ in 0..(15.0 * KIND.rate()) as u32 {
        bench.step(1.0);
        steps.extend(board.pass(&mut bench));
    }
    assert_eq!(steps[0], Step::Begin);
    assert!(steps[1..].iter().all(|step| *step == Step::GoOn));
    // images, configuration and memory of 608 + 300 + 1812 bytes, and some more
    assert!((40..52).contains(&steps.len()), "{}", steps.len());
    let seen = bench.take();
    assert_eq!(seen.len() as u32, bench.n, "no frame is lost");
    assert!(
        seen.iter()
            .all(|c| (c - 1e-3).abs() <= 1.01 * bench.count())
    );
}

/// After a restart of the sensor the learner goes on from what it knew before, stored or not.
#[test]
fn a_restart_of_the_sensor_alone_gives_back_what_was_known() {
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    learns(&bench, b"first drive");
    board.run(&mut bench, 8);
    assert_eq!(remembered(&mut bench).drives, 0, "too short to be stored");
    bench.silence(2.0);
    board.run(&mut bench, 8);
    assert_eq!(bench.device.counters().restarts, 1);
    assert_eq!(*bench.says.knew.borrow(), b"first drive");
    // each power-on of the sensor is a drive of its own
    board.run(&mut bench, 20);
    assert_eq!(remembered(&mut bench).drives, 1);
    bench.silence(2.0);
    board.run(&mut bench, 80);
    assert_eq!(remembered(&mut bench).drives, 2);
}

/// A command stores what was learnt since the last record; when nothing is new, it writes nothing.
#[test]
fn a_command_stores_what_was_learnt_since_the_last_record() {
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    learns(&bench, b"at first");
    board.run(&mut bench, 150);
    let stores = (0..60).any(|_| board.run(&mut bench, 5) > 0);
    assert!(stores, "a record from time to time");
    // the networks are stored with the first, and the second is about the memory alone
    for since in [b"since then", b"once again"] {
        bench.device.order(&Request::SetMode(Mode::Learn));
        learns(&bench, since);
        assert_eq!(board.run(&mut bench, 12), 0);
        bench.device.order(&Request::SetMode(Mode::Bypass));
        board.run(&mut bench, 2);
        bench.device.order(&Request::StoreImage);
        assert_eq!(board.pass(&mut bench), Some(Step::Save));
        bench.device.order(&Request::StoreImage);
        assert_eq!(board.pass(&mut bench), None, "it is stored already");
    }
    let mut bench = board.power_on();
    assert_eq!(*bench.says.knows.borrow(), b"once again");
    assert_eq!(remembered(&mut bench).drives, 1);
}

/// With another serial number or other inputs the memory is not used, and this is reported. By
/// command it is not stored again.
#[test]
fn a_memory_of_another_unit_is_not_used() {
    let mut other = unit();
    other.identity.serial = "N2".try_into().expect("short");
    let mut driven = unit();
    driven.inputs[0][0] = Source::Vibration;
    let mut renamed = unit();
    renamed.identity.name = "renamed".try_into().expect("short");
    for (another, used) in [(other, false), (driven, false), (renamed, true)] {
        let mut board = Board::new(&unit());
        let mut bench = board.power_on();
        learns(&bench, b"known");
        assert!(board.run(&mut bench, 80) > 1);
        bench.device.order(&Request::SetMode(Mode::Bypass));
        board.run(&mut bench, 2);
        assert_eq!(configure(&mut bench.device, &record(&another)), Ok(()));
        let now = remembered(&mut bench);
        assert_eq!((now.drives > 0, now.of_another), (used, !used));
        let known: &[u8] = if used { b"known" } else { b"" };
        assert_eq!(*bench.says.knows.borrow(), known);
        // stored by command, it is the new unit's or nobody's
        bench.says.navigates.set(false);
        bench.device.order(&Request::SetMode(Mode::Bypass));
        board.run(&mut bench, 2);
        bench.device.order(&Request::StoreImage);
        assert_eq!(board.pass(&mut bench), Some(Step::Save));
        let mut bench = board.power_on();
        assert_eq!(remembered(&mut bench).drives > 0, used);
        assert_eq!(*bench.says.knows.borrow(), known);
    }
    // a store whose memory and configuration do not belong together
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    bench.device.app.recall(&[1; 40]);
    assert!(remembered(&mut bench).of_another);
    assert!(bench.says.knows.borrow().is_empty());
    bench.device.app.recall(&[1; 4]);
    let _ = board.run(&mut bench, 1);
}

/// Without a navigator nothing is learnt, and nothing is stored.
#[test]
fn a_drive_that_shows_nothing_stores_nothing() {
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    bench.says.learns.set(b"known".to_vec());
    assert_eq!(board.run(&mut bench, 400), 0);
    assert_eq!(bench.says.took.get(), 0);
}

/// A change of the content while a record is being written ends it; the newest record stays, and
/// the next one is whole.
#[test]
fn other_networks_end_a_record_in_progress() {
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    learns(&bench, &[5; 1000]);
    while board.pass(&mut bench).is_none() {
        bench.step(1.0);
    }
    for _ in 0..5 {
        assert_eq!(board.pass(&mut bench), Some(Step::GoOn));
    }
    bench.device.order(&Request::CommitLearnt);
    assert_eq!(board.pass(&mut bench), None);
    assert!(board.run(&mut bench, 40) > 0);
    let mut bench = board.power_on();
    assert_eq!(remembered(&mut bench).drives, 1);
    assert_eq!(*bench.says.knows.borrow(), vec![5; 1000]);
}

/// A live activation stores no networks, but what is remembered.
#[test]
fn a_live_activation_remembers_too() {
    let mut live = unit();
    live.correction.activation = Activation::Commanded;
    let mut board = Board::new(&live);
    let mut bench = board.power_on();
    learns(&bench, b"known");
    bench.says.winner.set(Some(5e-3));
    assert_eq!(board.run(&mut bench, 85), 5);
    let now = remembered(&mut bench);
    assert_eq!((now.drives, now.acts), (1, false));
    let stored = board.store.load().expect("readable").expect("a record");
    assert_eq!(stored.nets, with(1e-3), "as before");
    let bench = board.power_on();
    assert_eq!(*bench.says.knows.borrow(), b"known");
}

/// One power-on of the sensor is one drive, whatever is configured, set, uploaded or stored in it.
#[test]
fn one_power_on_is_one_drive() {
    let mut board = Board::new(&unit());
    let mut bench = board.power_on();
    learns(&bench, b"known");
    assert!(board.run(&mut bench, 80) > 0);
    for n in 0..5 {
        let mut again = unit();
        again.rate += f64::from(n) * 1e-3;
        bench.device.order(&Request::SetMode(Mode::Bypass));
        board.run(&mut bench, 2);
        let took = bench.says.took.get();
        assert_eq!(configure(&mut bench.device, &record(&again)), Ok(()));
        assert_eq!(bench.says.took.get(), took, "nothing is remembered");
        bench.device.order(&Request::SetMode(Mode::Bypass));
        board.run(&mut bench, 2);
        bench.device.order(&Request::StoreImage);
        assert_eq!(board.pass(&mut bench), Some(Step::Save));
        bench.device.order(&Request::SetMode(Mode::Learn));
        board.run(&mut bench, 40);
        bench.device.order(&Request::CommitLearnt);
        board.run(&mut bench, 80);
        assert_eq!(remembered(&mut bench).drives, 1);
        assert_eq!(bench.says.drives.get(), 0, "{n}");
    }
    // a start has many signs and is one drive
    bench.silence(2.0);
    board.run(&mut bench, 80);
    bench.silence(0.5);
    board.run(&mut bench, 20);
    assert_eq!(bench.device.counters().restarts, 1);
    assert_eq!(bench.says.drives.get(), 1);
}

/// A record of the learner that is on its way to the flash when the user asks to store is not what
/// was asked for.
#[test]
fn a_record_on_its_way_is_not_the_one_that_is_asked_for() {
    let mut bench = Board::new(&unit()).power_on();
    learns(&bench, &[7; 500]);
    while !bench.device.app.wants_to_store() {
        bench.step(1.0);
    }
    let on_its_way = bench.device.app.job().expect("a record of the learner");
    bench.device.order(&Request::SetMode(Mode::Bypass));
    bench.device.order(&Request::StoreImage);
    (bench.device.app).stored(&on_its_way.done(Progress::Done));
    let job = bench.device.app.job().expect("what was asked for");
    assert_eq!((on_its_way.step, job.step), (Step::Begin, Step::Save));
    bench.device.app.stored(&job.done(Progress::Done));
    assert!(bench.device.app.job().is_none());
}
