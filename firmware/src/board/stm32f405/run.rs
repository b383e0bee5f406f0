//! The main loop, whatever learns.

use firmware::app::{App, Config, Nets};
use firmware::learn::Learner;
use firmware::store::Store;

use super::Board;

/// Starts the board and the application with what learns.
pub fn run(learner: Option<&mut dyn Learner>) -> ! {
    let Some(mut board) = Board::start() else {
        cortex_m::peripheral::SCB::sys_reset()
    };
    let mut app = app(&mut board, learner);
    loop {
        let busy = app.poll(&mut board.lines, &board.time);
        if app.wants_to_store() {
            store(&mut app, &mut board);
        }
        board.turned(busy, app.needs());
    }
}

/// The application with the stored weights. Not inlined, nor is [`store`]: what they need of the stack is not needed for ever.
#[inline(never)]
fn app<'m>(board: &mut Board, learner: Option<&'m mut dyn Learner>) -> App<'m> {
    let version = env!("CARGO_PKG_VERSION");
    defmt::println!(
        "lrnn {=str}, {}, DMA {=bool}",
        version,
        board.clocks,
        board.dma
    );
    let stored = board.store.as_mut().and_then(Store::load);
    if let Some(stored) = &stored {
        defmt::println!("stored weights, number {=u32}", stored.generation);
    }
    let config = Config {
        nets: stored.map_or(Nets::NONE, |stored| stored.nets),
        store: board.store.is_some(),
        ..Config::default()
    };
    App::with_learner(config, learner)
}

#[inline(never)]
fn store(app: &mut App, board: &mut Board) {
    if let (Some(nets), Some(store)) = (app.to_store(), &mut board.store) {
        app.stored(store.save(&nets).is_ok());
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    cortex_m::peripheral::SCB::sys_reset() // for the linker: nothing in these images panics (`cargo xtask size`)
}
