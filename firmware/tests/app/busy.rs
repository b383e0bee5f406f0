//! A flood of requests does not make deferred work be done at once.

use crate::device::{Device, Mock};
use firmware::app::{App, Config};
use firmware::compensator::Block;
use firmware::control::{Alignment, Mode, Reason};
use firmware::learn::{Learner, Report};
use firmware::model::Nets;
use firmware::sample::StreamScale;
use firmware::wire::ImuFormat;
use firmware::wire::command::{MAX_PACKET, Packets, Request, Response, decode, encode};
use lrnn_nostd::State;
use std::cell::Cell;
use std::rc::Rc;

/// A learner with so many parts of work left. What would do them at once is counted.
#[derive(Default)]
struct Works {
    left: Rc<Cell<u32>>,
    forced: Rc<Cell<u32>>,
}

impl Works {
    fn at_once(&self) {
        self.forced.set(self.forced.get() + self.left.replace(0));
    }
}

impl Learner for Works {
    fn begin(&mut self, _: &Nets, _: StreamScale) {}
    fn restart(&mut self) {}
    fn block(&mut self, _: u32, _: &Block) {}
    fn gap(&mut self) {}
    fn align(&mut self, _: Alignment) {
        self.at_once();
    }
    fn work(&mut self) -> bool {
        self.left.set(self.left.get().saturating_sub(1));
        self.left.get() > 0
    }
    fn is_busy(&self) -> bool {
        self.left.get() > 0
    }
    fn learnt(&mut self) -> (Nets, [State; 2]) {
        self.at_once();
        (Nets::NONE, [State::new(); 2])
    }
    fn report(&self) -> Report {
        Report::default()
    }
}

fn device() -> (Device<Mock>, Rc<Cell<u32>>, Rc<Cell<u32>>) {
    let works: &'static mut Works = Box::leak(Box::default());
    let (left, forced) = (works.left.clone(), works.forced.clone());
    let config = Config {
        format: Some(ImuFormat::Hg4930),
        mode: Mode::Learn,
        ..Config::default()
    };
    let mut device = Device::new(Config::default());
    device.app = App::with_learner(config, Some(works));
    let mut buffer = [0; 256];
    let fields = firmware::wire::Fields::default();
    let len = (ImuFormat::Hg4930.simulated()[0].emit)(&fields, &mut buffer).expect("room");
    device.feed(&buffer[..len]);
    (device, left, forced)
}

/// The requests that would force work are refused as long as there is some, and then succeed.
#[test]
fn what_would_force_work_is_refused_while_there_is_some() {
    for request in [
        Request::ReadLearnt {
            offset: 0,
            length: 128,
        },
        Request::CommitLearnt,
        Request::Alignment(Alignment::Started),
    ] {
        let (mut device, left, forced) = device();
        left.set(5);
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(9, &request, &mut buffer).expect("a packet");
        let mut refused = 0;
        loop {
            device.lines.command.input.extend(&*packet);
            // one pass after the other, so that work is left
            while device.lines.command.sent.is_empty() {
                device.app.poll(&mut device.lines, &device.time);
            }
            let mut answer = device.lines.command.sent.remove(0);
            let (_, response) = decode::<Response>(&mut answer).expect("an answer");
            if response != Response::Refused(Reason::Busy) {
                break;
            }
            refused += 1;
            assert!(refused < 100, "{request:?}");
        }
        assert!(refused > 0, "{request:?}");
        assert_eq!(forced.get(), 0, "{request:?}");
    }
}

/// However many requests have come, no pass carries out two.
#[test]
fn a_pass_carries_out_one_request() {
    let (mut device, ..) = device();
    let mut buffer = [0; MAX_PACKET];
    for number in 0..50 {
        let packet = encode(number, &Request::GetHealth, &mut buffer).expect("a packet");
        device.lines.command.input.extend(&*packet);
    }
    let mut answers = 0;
    for _ in 0..1000 {
        device.app.poll(&mut device.lines, &device.time);
        let mut packets = Packets::new();
        let sent = std::mem::take(&mut device.lines.command.sent).concat();
        let n = sent
            .iter()
            .filter(|byte| packets.push(**byte).is_some())
            .count();
        assert!(n <= 1, "{n} in a pass");
        answers += n;
    }
    assert_eq!(answers, 50);
}
