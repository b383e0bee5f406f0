//! The run loop that all boards share, on a board of mock lines.

use crate::adis::reply;
use crate::device::{Mock, Time};
use crate::frames::Kind;
use crate::record::{HARDWARE, configured};
use firmware::app::run::{self, MainThread, turn};
use firmware::app::{App, Config, Jobs, Lines};
use firmware::configuration::SerialLines;
use firmware::store::Store;
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::adis::{Burst, DetectedSensor, Form, Model, Rate};
use firmware::wire::command::{LoopPhase, MAX_PACKET, Request, encode, fault};

/// Calls of the loop, in their order.
#[derive(Debug, Clone, PartialEq)]
enum Call {
    Open(SerialLines),
    Turned(u8, bool),
    Forget,
    LongWork,
}

#[derive(Debug, Default)]
struct Bench {
    lines: Lines<Mock, Mock, Mock, Mock>,
    time: Time,
    calls: Vec<Call>,
    phases: Vec<LoopPhase>,
    bursts: Vec<Vec<u8>>,
    lost: usize,
    finds: Option<DetectedSensor>,
    supply_low: bool,
    waiting: usize,
}

impl run::Board for Bench {
    type Sensor = Mock;
    type Navigation = Mock;
    type Command = Mock;
    type Gnss = Mock;
    type Time = Time;

    fn lines(&mut self) -> (&mut Lines<Mock, Mock, Mock, Mock>, &Time) {
        (&mut self.lines, &self.time)
    }

    fn open(&mut self, lines: &SerialLines) {
        self.calls.push(Call::Open(*lines));
    }

    fn turned(&mut self, unhealthy: u8, erases: bool) {
        self.calls.push(Call::Turned(unhealthy, erases));
    }

    fn during(&mut self, phase: LoopPhase) {
        self.phases.push(phase);
    }

    fn burst<'f>(&mut self, frame: &'f mut [u8; LONGEST]) -> Option<&'f mut [u8]> {
        let bytes = self.bursts.pop()?;
        let frame = &mut frame[..bytes.len()];
        frame.copy_from_slice(&bytes);
        Some(frame)
    }

    fn has_lost(&mut self) -> bool {
        let lost = self.lost > 0;
        self.lost = self.lost.saturating_sub(1);
        lost
    }

    fn look_for_adis(&mut self, _: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor> {
        self.finds.take()
    }

    fn forget_adis(&mut self) {
        self.calls.push(Call::Forget);
    }

    fn has(&mut self, bytes: usize) -> bool {
        self.waiting >= bytes
    }

    fn long_work(&mut self) {
        self.calls.push(Call::LongWork);
    }

    fn state(&self) -> (bool, u16) {
        (self.supply_low, 3)
    }
}

impl Bench {
    /// Turns with a millisecond between them, until there is no more to do in one.
    fn settle(&mut self, app: &mut App, jobs: Option<&mut firmware::app::Gives>) {
        let mut jobs = jobs;
        self.time.set(self.time.get() + 1000);
        while turn(app, self, jobs.as_deref_mut(), &mut [0; LONGEST]) {}
    }

    fn ask(&mut self, number: u8, request: &Request) {
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(number, request, &mut buffer).expect("a packet");
        self.lines.command.input.extend(&*packet);
    }
}

#[test]
fn a_found_adis_corrects_its_bursts_and_lost_ones_are_gaps() {
    let (mut app, mut bench) = (App::new(Config::default()), Bench::default());
    let model = Model::Adis16475(1);
    bench.finds = Some(DetectedSensor {
        model,
        units: model.units(false).expect("a model"),
        rate: 2000.0,
    });
    bench.settle(&mut app, None);
    let burst = Burst {
        counter: 1,
        ..Burst::default()
    };
    bench.bursts.push(reply(Form::Narrow, &burst));
    bench.settle(&mut app, None);
    assert_eq!(bench.lines.navigation.sent, [reply(Form::Narrow, &burst)]);
    assert_eq!((app.counters().frames, app.counters().lost), (1, 0));
    bench.lost = 2;
    bench.settle(&mut app, None);
    assert_eq!(app.counters().lost, 2);
    let order = [
        LoopPhase::Burst,
        LoopPhase::Poll,
        LoopPhase::Look,
        LoopPhase::Sleep,
    ];
    assert!(bench.phases.ends_with(&order), "{:?}", bench.phases);
}

/// Without bytes that were waited for, the loop sleeps; with them it runs again at once.
#[test]
fn it_runs_again_while_bytes_wait() {
    let (mut app, mut bench) = (App::new(Config::default()), Bench::default());
    bench.settle(&mut app, None);
    assert!(!turn(&mut app, &mut bench, None, &mut [0; LONGEST]));
    bench.waiting = app.needs();
    assert!(turn(&mut app, &mut bench, None, &mut [0; LONGEST]));
}

/// A commanded record halts the processor: the board hears of it before, the turns until it is
/// stored say so, and the main thread stores it.
#[test]
fn a_commanded_record_goes_through_the_main_thread() {
    let mut configuration = configured(Kind::STIM);
    configuration.lines.sensor_baud = 1_843_200;
    let mut store = Store::new(crate::stored::blank()).ok();
    let mut app = App::start_up(HARDWARE, &mut store, true, None);
    let mut bench = Bench::default();
    let mut jobs = Jobs::new();
    let (mut gives, stores) = jobs.split();
    let mut thread = MainThread {
        background: None,
        stores: Some(stores),
        store: store.as_mut().map(|store| store as _),
        updates: None,
    };
    bench.settle(&mut app, Some(&mut gives));
    assert!(!thread.waits() && !thread.turn(|_| ()));
    let record = firmware::configuration::record::encode(&configuration);
    let mut number = 0;
    for (index, bytes) in record.chunks(64).enumerate() {
        let offset = (index * 64) as u32;
        bench.ask(number, &Request::WriteConfiguration { offset, bytes });
        (0..30).for_each(|_| bench.settle(&mut app, Some(&mut gives)));
        number += 1;
    }
    let length = record.len() as u32;
    bench.ask(number, &Request::CommitConfiguration { length });
    for _ in 0..100 {
        bench.settle(&mut app, Some(&mut gives));
    }
    let opened = Call::Open(configuration.lines);
    assert!(
        bench.calls.contains(&opened),
        "{:?}",
        bench.lines.command.sent
    );
    bench.ask(number + 1, &Request::StoreImage);
    for _ in 0..100 {
        bench.settle(&mut app, Some(&mut gives));
        if thread.waits() {
            break;
        }
    }
    assert!(bench.calls.contains(&Call::LongWork));
    bench.calls.clear();
    bench.settle(&mut app, Some(&mut gives));
    assert!(
        bench.calls.contains(&Call::Turned(0, true)),
        "{:?}",
        bench.calls
    );
    let phases = std::cell::RefCell::new(Vec::new());
    while thread.turn(|phase| phases.borrow_mut().push(phase)) {
        bench.settle(&mut app, Some(&mut gives));
    }
    bench.calls.clear();
    bench.settle(&mut app, Some(&mut gives));
    assert_eq!(bench.calls, [Call::Turned(0, false)]);
    assert_eq!(
        phases.borrow()[..3],
        [LoopPhase::Learn, LoopPhase::Store, LoopPhase::Sleep]
    );
    assert_eq!(app.faults() & fault::STORE, 0);
    let mut again = App::start_up(HARDWARE, &mut store, true, None);
    assert_eq!(again.stored_number(), Some(1));
    assert_eq!(again.to_open(), Some(configuration.lines));
}

/// Without a store in the flash every job fails, and the fault says so.
#[test]
fn a_board_without_a_store_reports_it() {
    let mut app = App::new(Config::of(&configured(Kind::STIM)));
    let mut bench = Bench::default();
    let mut jobs = Jobs::new();
    let (mut gives, stores) = jobs.split();
    let mut thread = MainThread {
        background: None,
        stores: Some(stores),
        store: None,
        updates: None,
    };
    bench.ask(0, &Request::SetMode(firmware::control::Mode::Bypass));
    bench.ask(1, &Request::StoreImage);
    for _ in 0..100 {
        bench.settle(&mut app, Some(&mut gives));
        thread.turn(|_| ());
    }
    let _ = app.faults();
    assert!(!app.is_storing());
}
