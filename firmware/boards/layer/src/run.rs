//! The frame path: the loop of `firmware::app::run` in a task.

use core::convert::Infallible;

use embassy_futures::join::join;
use embassy_futures::select::{Either3, select3, select4};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage::nor_flash::NorFlash;
use firmware::app::{App, GivesUpdates, Hardware, Jobs, Lines, Updates, run};
use firmware::configuration::SerialLines;
use firmware::control::update::Running as Image;
use firmware::learn::Learner;
use firmware::link::{Clock, rates};
use firmware::store::Store;
use firmware::update::TakesUpdates;
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::adis::{DetectedSensor, Rate};
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
static UPDATES: ConstStaticCell<Updates> = ConstStaticCell::new(Updates::new());

/// The board as the frame path sees it.
struct Running<S, N, C, G, A, W> {
    lines: Lines<S, N, C, G>,
    /// What the lines are open with.
    open: SerialLines,
    adis: A,
    /// The sensor has a new burst.
    new: bool,
    /// An ADIS was found; something has come on the sensor's line.
    has_adis: bool,
    heard: bool,
    guard: crash::Guard,
    feed: W,
    updates: Option<GivesUpdates<'static>>,
}

impl<S: Wire, N: Wire, C: Wire, G: Wire, A: Fetch, W: FnMut()> run::Board
    for Running<S, N, C, G, A, W>
{
    type Sensor = S;
    type Navigation = N;
    type Command = C;
    type Gnss = G;
    type Time = Time;

    fn lines(&mut self) -> (&mut Lines<S, N, C, G>, &Time) {
        (&mut self.lines, &Time)
    }

    /// A line that stays as it is goes on: to open it would cut what it is sending.
    fn open(&mut self, lines: &SerialLines) {
        let frame = Frame::sensor(lines);
        if frame != Frame::sensor(&self.open) {
            self.lines.sensor.open(&frame);
            self.lines.navigation.open(&frame);
        }
        if lines.receiver_baud != self.open.receiver_baud {
            self.lines.gnss.open(&Frame::plain(lines.receiver_baud));
        }
        self.open = *lines;
    }

    fn turned(&mut self, unhealthy: u8, _: bool) {
        if unhealthy == 0 {
            (self.feed)();
        }
        self.guard.turned(Time.now_us(), unhealthy);
    }

    fn during(&mut self, phase: LoopPhase) {
        crash::during(phase);
    }

    fn burst<'f>(&mut self, frame: &'f mut [u8; LONGEST]) -> Option<&'f mut [u8]> {
        // before the frame path takes the bytes that have come
        self.heard |= !self.lines.sensor.is_idle();
        let new = core::mem::take(&mut self.new) || NEW.try_take().is_some();
        if new { self.adis.burst(frame) } else { None }
    }

    fn has_lost(&mut self) -> bool {
        self.adis.has_lost()
    }

    /// A look takes up to half a millisecond, in which a frame would wait.
    fn look_for_adis(&mut self, rate: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor> {
        if !self.lines.sensor.is_idle() || (self.heard && !self.has_adis) {
            return None;
        }
        let found = self.adis.look(Time.now_us(), rate)?;
        self.has_adis = true;
        Some(found)
    }

    fn forget_adis(&mut self) {
        self.adis.forget();
    }

    fn updates(&mut self) -> Option<&mut GivesUpdates<'static>> {
        self.updates.as_mut()
    }

    fn restart(&mut self) {
        cortex_m::peripheral::SCB::sys_reset()
    }

    #[cfg(feature = "stm32")]
    fn pulse(&mut self) -> Option<u64> {
        crate::pulse::rose()
    }
}

static NEW: New = New::new();

/// [`run_updatable`] of a board that takes no updates. Its image does not check signatures.
///
/// # Panics
/// It is called a second time.
pub async fn run<S: Wire, N: Wire, C: Wire, G: Wire, A: Source, F: NorFlash, W: FnMut()>(
    board: Board<S, N, C, G, A, F, W>,
    learner: Option<&'static mut dyn Learner>,
) {
    run_updatable(board, learner, None::<Infallible>).await;
}

/// Runs the application with a learner, for ever. The learner, the store and `updater` are the main
/// thread's from then on.
///
/// # Panics
/// It is called a second time.
#[allow(
    unsafe_code,
    reason = "the store is the main thread's; says why that is sound"
)]
pub async fn run_updatable<S, N, C, G, A, F, W, U>(
    board: Board<S, N, C, G, A, F, W>,
    learner: Option<&'static mut dyn Learner>,
    mut updater: Option<U>,
) where
    S: Wire,
    N: Wire,
    C: Wire,
    G: Wire,
    A: Source,
    F: NorFlash,
    W: FnMut(),
    U: TakesUpdates,
{
    let [_, command, _] = &board.clocks;
    let (guard, reset, switched_on) = crash::Guard::start(command);
    let hardware = Hardware {
        name: board.name,
        clocks: board.clocks,
        parity: board.parity,
        pin_sets: 1,
        reset,
    };
    let mut store = Store::new(board.flash).ok();
    let running = updater.as_ref().map(|updater| updater.report().running);
    // an image on trial leaves the store as the one before it can read it
    let at_ease = switched_on && running != Some(Image::Trial);
    let mut app = App::start_up(hardware, &mut store, at_ease, learner);
    if let Some(updater) = &updater {
        app.takes_updates(updater.report(), updater.faults());
    }
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
    let (adis, edges) = board.adis.split(&NEW);
    let background = learners::apart(&mut app);
    let (mut gives, stores) = JOBS.take().split();
    // SAFETY: this future is a task's, which is pinned in a static and never ends.
    let updates =
        unsafe { thread::hand_over(background, stores, &mut store, &mut updater, UPDATES.take()) };
    let mut board = Running {
        lines: board.lines,
        open: SerialLines::DEFAULT,
        adis,
        new: false,
        has_adis: false,
        heard: false,
        guard,
        feed: board.feed,
        updates,
    };
    let mut frame = [0; LONGEST];
    let turns = async {
        loop {
            if run::turn(&mut app, &mut board, Some(&mut gives), &mut frame) {
                yield_now().await; // other tasks run
                continue;
            }
            let Lines {
                sensor,
                navigation,
                command,
                gnss,
            } = &mut board.lines;
            let arrived = select4(
                sensor.arrived(),
                navigation.arrived(),
                command.arrived(),
                gnss.arrived(),
            );
            let woken = select3(arrived, NEW.wait(), Timer::after(TURN)).await;
            board.new = matches!(woken, Either3::Second(()));
        }
    };
    join(edges, turns).await;
}
