//! The main loop, with any learner.

use firmware::app::App;
use firmware::learn::Learner;
use firmware::link::Clock as _;
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::command::{ClockSource, CrashKind, LoopPhase, Reset, cause, fault};

use super::{Board, ccm, crash};
use crate::shared::{blackbox, learners};

/// With the learner from references and fixes.
#[allow(dead_code, reason = "an image without the learner from fixes")]
pub fn learning_from_fixes() -> ! {
    let learner = learners::combined(ccm::learner);
    run::<true>(learner.map(|learner| learner as _))
}

/// Starts the board and the application with a learner. `ADIS`: look for one at the SPI.
pub fn run<const ADIS: bool>(learner: Option<&mut dyn Learner>) -> ! {
    let Some(mut board) = Board::start() else {
        cortex_m::peripheral::SCB::sys_reset()
    };
    let mut app = app(&mut board, learner);
    if let Some(number) = app.stored_number() {
        defmt::println!("stored weights, number {=u32}", number);
    }
    if let Some(memory) = blackbox::memory() {
        app.record_in(memory);
    }
    if let Some(random) = board.random.take() {
        app.seed(random);
    }
    let mut frame = [0; LONGEST];
    loop {
        crash::during(LoopPhase::Burst);
        if ADIS {
            match board.burst(&mut frame) {
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
        if app.wants_to_store() {
            crash::during(LoopPhase::Store);
            store(&mut app, &mut board);
        }
        crash::during(LoopPhase::Look);
        if ADIS {
            look_for_adis(&mut app, &mut board);
        }
        crash::during(LoopPhase::Sleep);
        let (supply_low, reopened) = board.state();
        app.board_is(supply_low, reopened);
        board.guard(app.unwell(board.time.now_us()));
        board.turned(busy, app.needs());
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

/// The application with what is stored. It is not inlined, nor is [`store`], so that their stack is
/// free again afterwards.
#[inline(never)]
fn app<'m>(board: &mut Board, learner: Option<&'m mut dyn Learner>) -> App<'m> {
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
    App::start_up(board.hardware(), &mut board.store, at_ease, learner)
}

#[inline(never)]
fn store(app: &mut App, board: &mut Board) {
    if app.may_halt() {
        board.long_work();
    }
    let before = app.faults() & fault::STORE;
    if let Some(store) = &mut board.store {
        app.store(|step, content| store.carry_out(step, content));
    }
    if app.faults() & fault::STORE > before && board.state().0 {
        defmt::println!("not stored: the supply is below 2.7 V");
    }
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
