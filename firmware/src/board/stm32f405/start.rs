//! From power-on to the run loop: the frame path in PendSV, the learner and the store in the main
//! thread.

use cortex_m::peripheral::SCB;
use firmware::app::run::{MainThread, turn};
use firmware::app::{App, Gives, Jobs};
use firmware::learn::Learner;
use firmware::store::Store;
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::command::{ClockSource, CrashKind, Reset, cause};
use static_cell::{ConstStaticCell, StaticCell};

use super::flash::Sectors;
use super::{Board, ccm, crash};
use crate::shared::wake::{self, Frame};
use crate::shared::{blackbox, crash as record, learners};

/// With the learner from references and fixes, and an ADIS.
#[allow(dead_code, reason = "an image without the learner from fixes")]
pub fn learning_from_fixes() -> ! {
    let learner = learners::combined(ccm::learner);
    run(learner.map(|learner| learner as _), true)
}

/// The frame path.
struct Path {
    app: &'static mut App<'static>,
    board: Board,
    gives: Gives<'static>,
    frame: [u8; LONGEST],
}

static FRAME: Frame<Path> = Frame::new();
/// It is too large to be moved over the stack.
static APP: StaticCell<App<'static>> = StaticCell::new();
static STORE: StaticCell<Option<Store<Sectors>>> = StaticCell::new();
static JOBS: ConstStaticCell<Jobs> = ConstStaticCell::new(Jobs::new());

#[cortex_m_rt::exception]
fn PendSV() {
    FRAME.turn(|path| {
        let before = record::interrupted();
        let Path { app, board, .. } = path;
        while turn(app, board, Some(&mut path.gives), &mut path.frame) {}
        record::resume(before);
    });
}

/// Starts the board and the application with a learner, which has the main thread from then on, as
/// the store has. `adis`: look for one at the SPI.
pub fn run(learner: Option<&'static mut dyn Learner>, adis: bool) -> ! {
    let Some(mut thread) = start(learner, adis) else {
        SCB::sys_reset()
    };
    loop {
        if !thread.turn(record::during) {
            wake::sleep(|| !thread.waits());
        }
    }
}

/// By itself, so that the stack is free again afterwards. `None` when called a second time.
#[inline(never)]
fn start(
    learner: Option<&'static mut dyn Learner>,
    adis: bool,
) -> Option<MainThread<'static, 'static>> {
    let (mut scb, store, mut board) = Board::start(adis)?;
    let store = STORE.try_init_with(|| store)?;
    let app = app(&board, store, learner)?;
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
        frame: [0; LONGEST],
    };
    FRAME.start(&mut scb, path);
    Some(MainThread {
        background,
        stores: Some(stores),
        store: store.as_mut().map(|store| store as _),
        updates: None,
    })
}

/// The application before power-on. `None` when called a second time. It is not inlined, so that
/// its stack is free again afterwards.
#[inline(never)]
fn blank() -> Option<&'static mut App<'static>> {
    APP.try_init_with(App::blank)
}

/// The application with what is stored.
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
    log_reset(&board.reset);
    // Erasing takes its time only after more than a hundred records, and no sensor waits yet. After
    // a reset of another kind one does, and without PLL the search alone takes too long.
    let at_ease = board.reset.causes & cause::POWER_ON != 0
        && board.clocks.source != ClockSource::InternalDirect;
    let app = blank()?;
    app.boot(board.hardware(), store, at_ease, learner);
    Some(app)
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
fn log_reset(reset: &Reset) {
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
