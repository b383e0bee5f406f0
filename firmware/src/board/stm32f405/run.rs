//! The frame path in PendSV, and the learner and the store in the main thread.

use cortex_m::peripheral::SCB;
use firmware::app::{App, Gives, Job, Jobs, Stores};
use firmware::learn::Learner;
use firmware::learn::exchange::Background;
use firmware::link::Clock as _;
use firmware::store::{Progress, Store};
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::command::{ClockSource, CrashKind, LoopPhase, Reset, cause};
use static_cell::{ConstStaticCell, StaticCell};

use super::flash::Sectors;
use super::{Board, ccm, crash, supply};
use crate::shared::wake::{self, Frame};
use crate::shared::{blackbox, learners};

/// With the learner from references and fixes.
#[allow(dead_code, reason = "an image without the learner from fixes")]
pub fn learning_from_fixes() -> ! {
    let learner = learners::combined(ccm::learner);
    run::<true>(learner.map(|learner| learner as _))
}

/// The frame path.
struct Path {
    app: &'static mut App<'static>,
    board: Board,
    gives: Gives<'static>,
    /// Look for an ADIS at the SPI.
    adis: bool,
    frame: [u8; LONGEST],
}

static FRAME: Frame<Path> = Frame::new();
/// It is too large to be moved over the stack.
static APP: StaticCell<App<'static>> = StaticCell::new();
static JOBS: ConstStaticCell<Jobs> = ConstStaticCell::new(Jobs::new());

#[cortex_m_rt::exception]
fn PendSV() {
    FRAME.turn(|path| {
        let before = crash::interrupted();
        while path.turn() {}
        crash::resume(before);
    });
}

/// Starts the board and the application with a learner, which has the main thread from then on, as
/// the store has. `ADIS`: look for one at the SPI.
pub fn run<const ADIS: bool>(learner: Option<&'static mut dyn Learner>) -> ! {
    let Some((mut background, mut stores, mut store)) = start::<ADIS>(learner) else {
        SCB::sys_reset()
    };
    loop {
        crash::during(LoopPhase::Learn);
        let learned = background.as_mut().is_some_and(Background::turn);
        crash::during(LoopPhase::Store);
        let stored = stores.turn(|job| carry_out(job, &mut store, background.as_ref()));
        crash::during(LoopPhase::Sleep);
        if !(learned || stored) {
            let waits = || background.as_ref().is_some_and(Background::waits) || stores.waits();
            wake::sleep(|| !waits());
        }
    }
}

/// What the main thread has.
type Thread = (
    Option<Background<'static>>,
    Stores<'static>,
    Option<Store<Sectors>>,
);

/// By itself, so that the stack is free again afterwards. `None` when called a second time.
#[inline(never)]
fn start<const ADIS: bool>(learner: Option<&'static mut dyn Learner>) -> Option<Thread> {
    let (mut scb, mut store, mut board) = Board::start()?;
    let app = app(&board, &mut store, learner)?;
    if let Some(number) = app.stored_number() {
        defmt::println!("stored weights, number {=u32}", number);
    }
    if let Some(memory) = blackbox::memory() {
        app.record_in(memory);
    }
    if let Some(random) = board.random.take() {
        app.seed(random);
    }
    let background = learners::apart(app);
    let (gives, stores) = JOBS.try_take()?.split();
    let path = Path {
        app,
        board,
        gives,
        adis: ADIS,
        frame: [0; LONGEST],
    };
    FRAME.start(&mut scb, path);
    Some((background, stores, store))
}

impl Path {
    /// One turn. True: there may be more to do.
    fn turn(&mut self) -> bool {
        let Path { app, board, .. } = self;
        if self.adis {
            crash::during(LoopPhase::Burst);
            match board.burst(&mut self.frame) {
                // an error has been counted
                Ok(Some(reply)) => {
                    let _ = app.burst(reply, &mut board.lines.navigation, &board.time);
                }
                Ok(None) => {}
                Err(_) => app.lost(),
            }
        }
        if let Some(at_us) = board.pulse() {
            app.pulse(at_us);
        }
        crash::during(LoopPhase::Poll);
        let busy = app.poll(&mut board.lines, &board.time);
        if let Some(lines) = app.to_open() {
            crash::during(LoopPhase::Open);
            board.open(&lines);
        }
        crash::during(LoopPhase::Look);
        let halts = app.may_halt();
        if self.gives.turn(app) && halts {
            board.long_work();
        }
        if self.adis {
            look_for_adis(app, board);
        }
        let (supply_low, reopened) = board.state();
        app.board_is(supply_low, reopened);
        // while the flash is erased, no turn comes in time
        if !(halts && app.is_storing()) {
            board.guard(app.unwell(board.time.now_us()));
        }
        busy || !board.lines.sensor.want(app.needs())
    }
}

/// Finds an ADIS, or sets it to another rate.
fn look_for_adis(app: &mut App, board: &mut Board) {
    if app.finds_anew() {
        board.forget_adis();
    }
    if let Some(found) = board.look_for_adis(|| app.burst_rate()) {
        defmt::println!("ADIS, {=f64} bursts a second", found.rate);
        app.found(&found);
    }
}

/// The application with what is stored. It is not inlined, nor is [`carry_out`], so that their
/// stack is free again afterwards.
#[inline(never)]
fn app(
    board: &Board,
    store: &mut Option<Store<Sectors>>,
    learner: Option<&'static mut dyn Learner>,
) -> Option<&'static mut App<'static>> {
    defmt::println!(
        "lrnn {=str}, {=str}, {=u32} Hz, DMA {=bool}",
        env!("CARGO_PKG_VERSION"),
        source(board.reset.clock),
        board.reset.core_hz,
        board.dma
    );
    tell(&board.reset);
    // Erasing takes its time only after more than a hundred records, and no sensor waits yet. After
    // a reset of another kind one does, and without PLL the search alone takes too long.
    let at_ease = board.reset.causes & cause::POWER_ON != 0
        && board.clocks.source != ClockSource::InternalDirect;
    APP.try_init_with(|| App::start_up(board.hardware(), store, at_ease, learner))
}

#[inline(never)]
fn carry_out(
    job: &Job,
    store: &mut Option<Store<Sectors>>,
    background: Option<&Background>,
) -> Progress {
    let content = job.content(background.map(Background::learner));
    let progress = match store {
        Some(store) => store.carry_out(job.step, &content),
        None => Progress::Failed,
    };
    if progress == Progress::Failed && supply::is_low() {
        defmt::println!("not stored: the supply is below 2.7 V");
    }
    progress
}

/// Where the clock comes from, in words.
fn source(clock: ClockSource) -> &'static str {
    match clock {
        ClockSource::Crystal => "crystal",
        ClockSource::Internal => "internal oscillator (1 % at 25 C, -8 to +4.5 % at -40 to 105 C)",
        ClockSource::InternalDirect => "internal oscillator without PLL",
        ClockSource::Simulator => "simulator",
    }
}

/// Why it started, and what is not as it should be.
#[inline(never)]
fn tell(reset: &Reset) {
    defmt::println!("reset by {=u8:#x}", reset.causes);
    let known = &reset.crystal;
    if known.used_mhz != known.built_mhz && reset.clock != ClockSource::Simulator {
        defmt::println!(
            "crystal of {=u8} MHz expected, {=u32} kHz measured, {=u8} MHz used",
            known.built_mhz,
            known.measured_khz,
            known.used_mhz
        );
    }
    if reset.brown_out.is_some_and(|level| level < 3) {
        defmt::println!("option bytes: brown-out level below 3");
    }
    if let Some(crash) = &reset.crash {
        let kind = match crash.kind {
            CrashKind::Fault => "fault of the core",
            CrashKind::StackOverflow => "stack overflow",
            CrashKind::ClockStopped => "crystal stopped",
            CrashKind::Panic => "panic",
            CrashKind::NotFed => "watchdog",
        };
        defmt::println!(
            "crash {=u32}, {=u32} start(s) ago: {=str} at {=u32:#x}, CFSR {=u32:#x}",
            crash.number,
            crash.starts,
            kind,
            crash.pc,
            crash.cfsr
        );
    }
    if reset.safe {
        defmt::println!("safe start: bypass");
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // for the linker: nothing in these images panics (`cargo xtask size`)
    crash::panicked()
}
