//! The main loop, with any learner.

use firmware::app::{App, Config};
use firmware::learn::Learner;
use firmware::model::Nets;
use firmware::store::Store;
use firmware::wire::adis::Found;
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::{Settings, adis};

use super::Board;

/// Starts the board and the application with a learner. `ADIS`: look for one at the SPI.
pub fn run<const ADIS: bool>(mut learner: Option<&mut dyn Learner>) -> ! {
    let Some(mut board) = Board::start() else {
        cortex_m::peripheral::SCB::sys_reset()
    };
    let mut adis = None;
    loop {
        let learner = learner
            .as_mut()
            .map(|learner| &mut **learner as &mut dyn Learner);
        let app = app(&mut board, learner, adis);
        adis = Some(until_found::<ADIS>(&mut board, app));
    }
}

/// The main loop, until an ADIS is found in place of a silent sensor line.
fn until_found<const ADIS: bool>(board: &mut Board, mut app: App) -> Found {
    let mut frame = [0; LONGEST];
    loop {
        if ADIS && let Some(reply) = board.burst(&mut frame) {
            // an error has been counted
            let _ = app.burst(reply, &mut board.lines.navigation, &board.time);
        }
        let busy = app.poll(&mut board.lines, &board.time);
        if app.wants_to_store() {
            store(&mut app, board);
        }
        if ADIS && let Some(found) = board.look_for_adis() {
            return found;
        }
        board.turned(busy, app.needs());
    }
}

/// The application with the stored weights. It is not inlined, nor is [`store`], so that their
/// stack is free again afterwards.
#[inline(never)]
fn app<'m>(
    board: &mut Board,
    learner: Option<&'m mut dyn Learner>,
    adis: Option<Found>,
) -> App<'m> {
    let version = env!("CARGO_PKG_VERSION");
    match adis {
        None => defmt::println!(
            "lrnn {=str}, {}, DMA {=bool}",
            version,
            board.clocks,
            board.dma
        ),
        Some(found) => defmt::println!("ADIS, {=f64} bursts a second", found.rate),
    }
    let stored = board.store.as_mut().and_then(Store::load);
    if let Some(stored) = &stored {
        defmt::println!("stored weights, number {=u32}", stored.generation);
    }
    let config = Config {
        nets: stored.map_or(Nets::NONE, |stored| stored.nets),
        store: board.store.is_some(),
        sensor: Settings {
            adis: adis.map(|found| adis::Settings {
                form: found.model.form(),
                units: found.units,
                framed: false,
            }),
            rate: adis.map_or(Settings::DEFAULT.rate, |found| found.rate),
            ..Settings::DEFAULT
        },
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
    // for the linker: nothing in these images panics (`cargo xtask size`)
    cortex_m::peripheral::SCB::sys_reset()
}
