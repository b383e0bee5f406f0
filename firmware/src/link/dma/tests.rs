//! A controller and a line's receiver and transmitter, simulated, with bytes and interrupts at the
//! worst moments.

use super::*;
use crate::link::uart::{Port, RECEIVED};
use crate::link::{Full, Line, Lost};
use proptest::prelude::*;
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;
use std::vec::Vec;

/// One stream's registers.
#[derive(Default)]
struct Registers {
    places: Cell<&'static [AtomicU8]>,
    left: Cell<usize>,
    enabled: Cell<bool>,
    complete: Cell<bool>,
}

impl Registers {
    fn arm(&self, places: &'static [AtomicU8]) {
        assert!(!self.enabled.get(), "armed while it runs");
        assert!(!self.complete.get(), "armed with its flag still set");
        assert!(!places.is_empty());
        self.places.set(places);
        self.left.set(places.len());
        self.enabled.set(true);
    }

    fn stop(&self) -> usize {
        self.enabled.set(false);
        self.complete.set(false);
        self.left.get()
    }

    /// Moves one byte; the place it concerns.
    fn step(&self) -> Option<&'static AtomicU8> {
        if !self.enabled.get() {
            return None;
        }
        let place = &self.places.get()[self.places.get().len() - self.left.get()];
        self.left.set(self.left.get() - 1);
        if self.left.get() == 0 {
            self.enabled.set(false);
            self.complete.set(true);
        }
        Some(place)
    }
}

/// The board: line, controller, interrupt controller.
struct Board {
    uart: &'static Uart,
    receiving: Registers,
    sending: Registers,
    /// The receiver's data register.
    held: Cell<Option<u8>>,
    /// Error flags of the receiver are set.
    overrun: Cell<bool>,
    /// Interrupts made pending by the frame path: receiving, sending.
    pending: [Cell<bool>; 2],
    /// Whether an interrupt runs, or interrupts are masked.
    masked: Cell<bool>,
    awake: Cell<bool>,
    overruns: Cell<usize>,
    /// Numbers of bytes that arrive at the next moments in which the other side looks at the
    /// stream.
    moments: RefCell<VecDeque<u8>>,
    /// Next byte of the sensor, which counts.
    next: Cell<u8>,
    /// Bytes that reached the line's receiver and were not overrun.
    arrived: RefCell<Vec<u8>>,
    /// Bytes that have left.
    sent: RefCell<Vec<u8>>,
    interrupts: Cell<usize>,
}

impl Board {
    fn new(moments: Vec<u8>) -> Rc<Board> {
        let uart: &'static Uart = std::boxed::Box::leak(std::boxed::Box::new(Uart::new()));
        let board = Rc::new(Board {
            uart,
            receiving: Registers::default(),
            sending: Registers::default(),
            held: Cell::new(None),
            overrun: Cell::new(false),
            overruns: Cell::new(0),
            pending: Default::default(),
            masked: Cell::new(false),
            awake: Cell::new(false),
            moments: RefCell::new(moments.into()),
            next: Cell::new(0),
            arrived: RefCell::default(),
            sent: RefCell::default(),
            interrupts: Cell::new(0),
        });
        board.pending[0].set(true);
        board.interrupt();
        board
    }

    /// A byte of the sensor; an overrun loses it and reports that.
    fn arrive(&self) {
        let byte = self.next.get();
        self.next.set(byte.wrapping_add(1));
        if self.held.get().is_some() {
            self.overrun.set(true);
            self.overruns.set(self.overruns.get() + 1);
        } else {
            self.held.set(Some(byte));
            self.arrived.borrow_mut().push(byte);
        }
        self.request();
        self.interrupt();
    }

    /// The receiver asks the stream to take its byte.
    fn request(&self) {
        if let Some(byte) = self.held.get()
            && let Some(place) = self.receiving.step()
        {
            place.store(byte, Ordering::Relaxed);
            self.held.set(None);
        }
    }

    /// Serves interrupts until none is pending.
    fn interrupt(&self) {
        if self.masked.replace(true) {
            return;
        }
        loop {
            if self.overrun.replace(false) {
                self.uart.lost();
                self.awake.set(true);
            }
            let asked = self.pending[0].replace(false);
            if asked || self.receiving.complete.get() {
                self.interrupts.set(self.interrupts.get() + 1);
                if self.uart.received_by(&Handle(self, true)) {
                    self.awake.set(true);
                }
                self.request();
            } else if self.pending[1].replace(false) || self.sending.complete.get() {
                self.uart.sent_by(&Handle(self, false));
            } else if !self.overrun.get() {
                break;
            }
        }
        self.masked.set(false);
    }

    /// Something happens in the world between two steps of the program.
    fn moment(&self) {
        let bytes = self.moments.borrow_mut().pop_front().unwrap_or(0);
        // the receiver's one place is enough between two steps
        if bytes > 0 && self.held.get().is_none() {
            self.arrive();
        }
    }

    /// The transmitter takes a byte.
    fn transmit(&self) -> bool {
        let Some(place) = self.sending.step() else {
            return false;
        };
        self.sent.borrow_mut().push(place.load(Ordering::Relaxed));
        self.interrupt();
        true
    }
}

/// A stream of the board.
struct Handle<'b>(&'b Board, bool);

impl Handle<'_> {
    fn registers(&self) -> &Registers {
        if self.1 {
            &self.0.receiving
        } else {
            &self.0.sending
        }
    }
}

impl Progress for Handle<'_> {
    fn left(&self) -> usize {
        self.0.moment();
        let left = self.registers().left.get();
        self.0.moment();
        left
    }
}

impl Stream<'static> for Handle<'_> {
    fn arm(&self, places: &'static [AtomicU8]) {
        self.0.moment();
        self.registers().arm(places);
        if self.1 {
            self.0.request();
        }
    }

    fn stop(&self) -> usize {
        self.0.moment();
        let left = self.registers().stop();
        self.0.moment();
        left
    }

    fn is_running(&self) -> bool {
        self.registers().enabled.get()
    }
}

std::thread_local! {
    /// The board under test, for `sync` and `wake`, which carry nothing.
    static BOARD: RefCell<Option<Rc<Board>>> = const { RefCell::new(None) };
}

fn pend(which: usize) {
    let board = BOARD.with_borrow(|board| board.clone());
    let board = board.expect("a board is under test");
    board.pending[which].set(true);
    board.interrupt();
}

/// The frame path's view of the board under test.
struct Peek(Rc<Board>);

impl Progress for Peek {
    fn left(&self) -> usize {
        Handle(&self.0, true).left()
    }
}

fn start(moments: Vec<u8>) -> (Rc<Board>, Port<'static, Peek>) {
    let board = Board::new(moments);
    BOARD.set(Some(board.clone()));
    let peek = Peek(board.clone());
    let port = board.uart.port_over(peek, || pend(0), || pend(1));
    (board, port)
}

/// Everything there is.
fn read_all(port: &mut impl Line, into: &mut Vec<u8>) -> usize {
    let mut losses = 0;
    let mut buffer = [0; 64];
    while !port.is_idle() {
        match port.receive(&mut buffer) {
            Ok(len) => into.extend_from_slice(&buffer[..len]),
            Err(Lost) => losses += 1,
        }
    }
    losses
}

#[derive(Debug, Clone)]
enum Step {
    /// This number of bytes arrives.
    Arrive(usize),
    /// Bytes arrive while interrupts are masked: after the end of a transfer two bytes are one too
    /// many.
    Late(usize),
    /// The frame path asks for so many.
    Want(usize),
    /// ... takes at most so many.
    Receive(usize),
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        4 => (1..70usize).prop_map(Step::Arrive),
        1 => (300..900usize).prop_map(Step::Arrive),
        1 => (1..4usize).prop_map(Step::Late),
        4 => (1..80usize).prop_map(Step::Want),
        4 => (1..100usize).prop_map(Step::Receive),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// All that arrived is read once and in order, except where a loss was reported to the reader.
    /// A reader that sleeps is woken by the byte it wants, not before.
    #[test]
    fn nothing_is_lost_or_read_twice(
        steps in prop::collection::vec(step(), 1..80),
        moments in prop::collection::vec(0..2u8, 0..400),
    ) {
        let (board, mut port) = start(moments);
        let mut got = Vec::new();
        let mut losses = 0;
        for step in steps {
            match step {
                Step::Arrive(bytes) => (0..bytes).for_each(|_| board.arrive()),
                Step::Late(bytes) => {
                    board.masked.set(true);
                    (0..bytes).for_each(|_| board.arrive());
                    board.masked.set(false);
                    board.interrupt();
                }
                Step::Want(bytes) => {
                    board.awake.set(false);
                    losses += read_all(&mut port, &mut got);
                    if port.want(bytes) {
                        let came = |board: &Board| board.arrived.borrow().len() - got.len();
                        if came(&board) < bytes {
                            board.awake.set(false); // by bytes before it asked
                        }
                        while came(&board) < bytes {
                            prop_assert!(!board.awake.get(), "woken after {} of {bytes}", came(&board));
                            board.arrive();
                        }
                        prop_assert!(board.awake.get(), "not woken by {bytes} bytes");
                    } else {
                        prop_assert!(!port.is_idle(), "reports bytes that are not there");
                    }
                }
                Step::Receive(bytes) => {
                    let mut buffer = [0; 100];
                    match port.receive(&mut buffer[..bytes]) {
                        Ok(len) => got.extend_from_slice(&buffer[..len]),
                        Err(Lost) => losses += 1,
                    }
                }
            }
        }
        board.moments.borrow_mut().clear();
        losses += read_all(&mut port, &mut got);
        let arrived = board.arrived.borrow();
        prop_assert_eq!(&got, &*arrived);
        prop_assert_eq!(board.overruns.get() > 0, losses > 0, "{} reported", losses);
    }

    /// Messages leave whole, in order and once.
    #[test]
    fn messages_leave_in_order(
        steps in prop::collection::vec((1..300usize, 0..400usize), 1..60),
        moments in prop::collection::vec(0..2u8, 0..100),
    ) {
        let (board, mut port) = start(moments);
        let mut taken = Vec::new();
        for (number, (length, transmitted)) in steps.into_iter().enumerate() {
            let message = std::vec![number as u8; length];
            match port.send(&message) {
                Ok(()) => taken.extend_from_slice(&message),
                // room is made by the end of a transfer, which may hold the whole ring
                Err(Full) => prop_assert!(board.sent.borrow().len() < taken.len()),
            }
            for _ in 0..transmitted {
                board.transmit();
            }
        }
        while board.transmit() {}
        prop_assert_eq!(&taken, &*board.sent.borrow());
    }
}

/// One interrupt a frame, plus one where the ring ends: what the whole thing is for.
#[test]
fn one_interrupt_a_frame() {
    const FRAME: usize = 28;
    const FRAMES: usize = 1000;
    let (board, mut port) = start(Vec::new());
    let mut got = Vec::new();
    assert!(port.want(FRAME));
    let before = board.interrupts.get();
    for frame in 0..FRAMES {
        board.awake.set(false);
        for n in 1..=FRAME {
            board.arrive();
            assert_eq!(board.awake.get(), n == FRAME);
            if n == 1 + frame % (FRAME - 1) {
                assert!(port.is_idle(), "the clock wakes the loop in a frame");
                assert!(port.want(FRAME));
            }
        }
        read_all(&mut port, &mut got);
        assert!(port.want(FRAME));
    }
    let wraps = FRAME * FRAMES / RECEIVED + 1;
    let interrupts = board.interrupts.get() - before;
    assert!(interrupts <= FRAMES + wraps, "{interrupts}");
    assert_eq!(got.len(), FRAME * FRAMES);
}

/// A short message between frames is found by a frame path that the clock has woken twice.
#[test]
fn bytes_without_an_interrupt_are_found() {
    let (board, mut port) = start(Vec::new());
    assert!(port.want(28) && port.is_idle());
    board.awake.set(false);
    for _ in 0..5 {
        board.arrive();
        assert!(port.is_idle(), "they still come");
    }
    assert!(!board.awake.get() && !port.is_idle());
    let mut buffer = [0; 64];
    assert_eq!(port.receive(&mut buffer), Ok(5));
    assert_eq!(buffer[..5], [0, 1, 2, 3, 4]);
    assert!(port.is_idle() && port.want(28));
}

/// Nobody reads: the ring fills and the receiver overruns. This is reported once, and then the
/// reader gets the bytes that had come.
#[test]
fn a_full_ring_is_reported_and_goes_on() {
    let (board, mut port) = start(Vec::new());
    (0..RECEIVED + 10).for_each(|_| board.arrive());
    let mut buffer = [0; 1024];
    assert_eq!(port.receive(&mut buffer), Err(Lost));
    let mut got = Vec::new();
    read_all(&mut port, &mut got);
    assert_eq!(got.len(), RECEIVED + 1, "and the byte that was held");
    board.arrive();
    got.clear();
    assert_eq!(read_all(&mut port, &mut got), 0);
    assert_eq!(got, [(RECEIVED + 10) as u8]);
}

/// A transfer that fails ends; what is sent after it leaves.
#[test]
fn a_failed_transfer_does_not_stop_the_line() {
    let (board, mut port) = start(Vec::new());
    assert_eq!(port.send(b"lost"), Ok(()));
    board.sending.enabled.set(false);
    board.sending.complete.set(true); // the error flag
    board.interrupt();
    assert_eq!(port.send(b"next"), Ok(()));
    while board.transmit() {}
    assert_eq!(*board.sent.borrow(), b"next");
}
