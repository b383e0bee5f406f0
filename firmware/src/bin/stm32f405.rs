//! Board `stm32f405`: the co-processor on an STM32F405. The same image runs on the board and in QEMU (`netduinoplus2`).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../board/stm32f405/mod.rs"]
mod board;
#[cfg(target_os = "none")]
#[path = "../board/memory.rs"]
mod memory;
#[cfg(target_os = "none")]
#[path = "../board/time.rs"]
mod time;
#[cfg(target_os = "none")]
#[path = "../board/uart.rs"]
mod uart;

#[cfg(target_os = "none")]
mod target {
    use firmware::app::{App, Config, Nets};
    use firmware::learn::Learner;
    use firmware::store::Store;

    use crate::board::Board;
    use crate::memory;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let Some(mut board) = Board::start() else {
            cortex_m::peripheral::SCB::sys_reset()
        };
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
        let mut learner = memory::learner();
        let learner = learner.as_mut().map(|learner| learner as &mut dyn Learner);
        let mut app = App::with_learner(config, learner);
        loop {
            let busy = app.poll(&mut board.lines, &board.time);
            if let (Some(nets), Some(store)) = (app.to_store(), &mut board.store) {
                app.stored(store.save(&nets).is_ok());
            }
            board.turned(busy, app.needs());
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        cortex_m::peripheral::SCB::sys_reset() // for the linker: nothing in this image panics (`cargo xtask size`)
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32f405 is a board binary: `cargo xtask flash` or `cargo xtask qemu`");
}
