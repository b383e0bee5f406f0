//! The main loop, with any learner.

use firmware::app::App;
use firmware::learn::Learner;
use firmware::store::{MEMORY_MAX, Store};
use firmware::wire::adis::spi::LONGEST;

use super::Board;
use crate::shared::blackbox;

/// Starts the board and the application with a learner. `ADIS`: look for one at the SPI.
pub fn run<const ADIS: bool>(learner: Option<&mut dyn Learner>) -> ! {
    let Some(mut board) = Board::start() else {
        cortex_m::peripheral::SCB::sys_reset()
    };
    let mut app = app(&mut board, learner);
    recall(&mut app, &mut board);
    if let Some(memory) = blackbox::memory() {
        app.record_in(memory);
    }
    if let Some(random) = board.random.take() {
        app.seed(random);
    }
    let mut frame = [0; LONGEST];
    loop {
        if ADIS && let Some(reply) = board.burst(&mut frame) {
            // an error has been counted
            let _ = app.burst(reply, &mut board.lines.navigation, &board.time);
        }
        if let Some(at_us) = board.pulse() {
            app.pulse(at_us);
        }
        let busy = app.poll(&mut board.lines, &board.time);
        if let Some(lines) = app.to_open() {
            board.open(&lines);
        }
        if app.wants_to_store() {
            store(&mut app, &mut board);
        }
        if ADIS && let Some(found) = board.look_for_adis() {
            defmt::println!("ADIS, {=f64} bursts a second", found.rate);
            app.found(&found);
        }
        board.turned(busy, app.needs());
    }
}

/// The application with what is stored. It is not inlined, nor is [`store`], so that their stack is
/// free again afterwards.
#[inline(never)]
fn app<'m>(board: &mut Board, learner: Option<&'m mut dyn Learner>) -> App<'m> {
    defmt::println!(
        "lrnn {=str}, {}, DMA {=bool}",
        env!("CARGO_PKG_VERSION"),
        board.clocks,
        board.dma
    );
    // erasing takes its time only after more than a hundred records, and no sensor waits yet
    if let Some(store) = &mut board.store {
        let _ = store.make_room(); // fault STORE tells when the next record finds none
    }
    let stored = board.store.as_mut().map(Store::load);
    match &stored {
        Some(Ok(Some(stored))) => {
            defmt::println!("stored weights, number {=u32}", stored.generation);
        }
        Some(Err(newer)) => defmt::println!("stored by a newer version, {=u32}", newer.0),
        _ => {}
    }
    App::power_on(board.hardware(), stored, learner)
}

/// Apart from [`app`], so that the stack does not hold both.
#[inline(never)]
fn recall(app: &mut App, board: &mut Board) {
    let mut memory = [0; MEMORY_MAX];
    let len = board
        .store
        .as_mut()
        .map_or(0, |store| store.memory(&mut memory));
    app.recall(memory.get(..len).unwrap_or_default());
}

#[inline(never)]
fn store(app: &mut App, board: &mut Board) {
    if let Some(store) = &mut board.store {
        app.store(|step, content| store.carry_out(step, content));
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // for the linker: nothing in these images panics (`cargo xtask size`)
    cortex_m::peripheral::SCB::sys_reset()
}
