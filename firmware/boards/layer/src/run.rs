//! The frame path: the loop around the application.

use embassy_futures::join::join;
use embassy_futures::select::{Either3, select3, select4};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage::nor_flash::NorFlash;
use firmware::app::{App, Hardware, Jobs, Lines};
use firmware::configuration::SerialLines;
use firmware::learn::Learner;
use firmware::link::{Clock, rates};
use firmware::store::Store;
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::command::LoopPhase;
use static_cell::ConstStaticCell;

use crate::adis::{Fetch, New, Source};
use crate::line::{Frame, Wire};
use crate::{blackbox, crash, learners, thread};

/// The application has its turn at least so often, as it asks.
const TURN: Duration = Duration::from_millis(1);

/// A board, open.
pub struct Board<S, N, C, G, A, F, W> {
    /// Name, at most 32 bytes.
    pub name: &'static str,
    /// Clocks of the sensor's, the navigation computer's and the receiver's line.
    pub clocks: [rates::Clock; 3],
    /// The lines can have parity and two stop bits.
    pub parity: bool,
    /// The four lines.
    pub lines: Lines<S, N, C, G>,
    /// An ADIS at an SPI, or [`crate::NoAdis`].
    pub adis: A,
    /// The part of the flash that the store has.
    pub flash: F,
    /// Feeds the watchdog.
    pub feed: W,
    /// Random bytes for the challenges of the command link, if there is a generator.
    pub random: Option<[u8; 32]>,
}

/// Time by the chip's counter.
struct Time;

impl Clock for Time {
    fn now_us(&self) -> u64 {
        Instant::now().as_micros()
    }

    fn asleep_us(&self) -> Option<u64> {
        Some(thread::asleep_us())
    }
}

static JOBS: ConstStaticCell<Jobs> = ConstStaticCell::new(Jobs::new());

/// Runs the application with a learner, for ever. The learner and the store are the main thread's
/// from then on.
///
/// # Panics
/// It is called a second time.
#[allow(
    unsafe_code,
    reason = "the store is the main thread's; says why that is sound"
)]
pub async fn run<S: Wire, N: Wire, C: Wire, G: Wire, A: Source, F: NorFlash, W: FnMut()>(
    mut board: Board<S, N, C, G, A, F, W>,
    learner: Option<&'static mut dyn Learner>,
) {
    let [_, command, _] = &board.clocks;
    let (mut guard, reset, switched_on) = crash::Guard::start(command);
    let hardware = Hardware {
        name: board.name,
        clocks: board.clocks,
        parity: board.parity,
        pin_sets: 1,
        reset,
    };
    let mut store = Store::new(board.flash).ok();
    let mut app = App::start_up(hardware, &mut store, switched_on, learner);
    if let Some(memory) = blackbox::memory() {
        app.record_in(memory);
    }
    if let Some(random) = board.random {
        app.seed(random);
    }
    defmt::println!(
        "lrnn {=str} on {=str}",
        env!("CARGO_PKG_VERSION"),
        board.name
    );
    static NEW: New = New::new();
    let (mut adis, edges) = board.adis.split(&NEW);
    let background = learners::apart(&mut app);
    let (mut gives, stores) = JOBS.take().split();
    // SAFETY: this future is a task's, which is pinned in a static and never ends.
    unsafe { thread::hand_over(background, stores, &mut store) };
    let lines = &mut board.lines;
    let time = Time;
    let (mut frame, mut new) = ([0; LONGEST], false);
    // an ADIS was found, and something has come on the sensor's line
    let (mut has_adis, mut heard) = (false, false);
    let turns = async {
        loop {
            crash::during(LoopPhase::Burst);
            if (new || NEW.try_take().is_some())
                && let Some(reply) = adis.burst(&mut frame)
            {
                // an error has been counted
                let _ = app.burst(reply, &mut lines.navigation, &time);
            }
            while adis.has_lost() {
                app.lost();
            }
            #[cfg(feature = "stm32")]
            if let Some(at_us) = crate::pulse::rose() {
                app.pulse(at_us);
            }
            heard |= !lines.sensor.is_idle();
            crash::during(LoopPhase::Poll);
            let busy = app.poll(lines, &time);
            crash::during(LoopPhase::Open);
            if let Some(told) = app.to_open() {
                open(lines, &told);
            }
            gives.turn(&mut app);
            crash::during(LoopPhase::Look);
            if app.finds_anew() {
                adis.forget();
            }
            // a look takes up to half a millisecond, in which a frame would wait
            if (has_adis || !heard)
                && lines.sensor.is_idle()
                && let Some(found) = adis.look(time.now_us(), || app.burst_rate())
            {
                has_adis = true;
                app.found(&found);
            }
            crash::during(LoopPhase::Sleep);
            let (now, unwell) = (time.now_us(), app.unwell(time.now_us()));
            if unwell == 0 {
                (board.feed)();
            }
            guard.turned(now, unwell);
            new = false;
            if busy {
                yield_now().await; // other tasks have their turn
                continue;
            }
            let arrived = select4(
                lines.sensor.arrived(),
                lines.navigation.arrived(),
                lines.command.arrived(),
                lines.gnss.arrived(),
            );
            let woken = select3(arrived, NEW.wait(), Timer::after(TURN)).await;
            new = matches!(woken, Either3::Second(()));
        }
    };
    join(edges, turns).await;
}

/// Opens the lines as told. The command link goes on.
fn open<S: Wire, N: Wire, C: Wire, G: Wire>(lines: &mut Lines<S, N, C, G>, told: &SerialLines) {
    let frame = Frame::sensor(told);
    lines.sensor.open(&frame);
    lines.navigation.open(&frame);
    lines.gnss.open(&Frame::plain(told.receiver_baud));
}
