//! Board `mps2`: the co-processor on Arm's MPS2 with a Cortex-M4F (AN386) or Cortex-M7 (AN500), for
//! QEMU.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../board/mps2/mod.rs"]
mod board;
#[cfg(target_os = "none")]
#[path = "../board/shared/mod.rs"]
mod shared;

#[cfg(target_os = "none")]
mod target {
    use cortex_m::peripheral::SCB;
    use firmware::app::App;
    use firmware::app::run::{MainThread, turn};
    use firmware::learn::exchange::Background;
    use firmware::learn::{FixMemory, Learner};
    use firmware::wire::adis::spi::LONGEST;
    use static_cell::{ConstStaticCell, StaticCell};

    use crate::board::Board;
    use crate::shared::wake::{self, Frame};
    use crate::shared::{blackbox, learners};

    /// Of the learner from fixes. This board has one kind of memory.
    static FIXES: ConstStaticCell<FixMemory> = ConstStaticCell::new(FixMemory::ZEROED);

    fn memory() -> Option<&'static mut FixMemory> {
        FIXES.try_take()
    }

    /// The frame path.
    struct Path {
        app: &'static mut App<'static>,
        board: Board,
    }

    static FRAME: Frame<Path> = Frame::new();
    /// It is too large to be moved over the stack.
    static APP: StaticCell<App<'static>> = StaticCell::new();

    #[cortex_m_rt::exception]
    fn PendSV() {
        FRAME.turn(
            |Path { app, board }| {
                while turn(app, board, None, &mut [0; LONGEST]) {}
            },
        );
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let Some((mut scb, board)) = Board::start() else {
            cortex_m::peripheral::SCB::sys_reset()
        };
        let mut thread = MainThread {
            background: start(&mut scb, board),
            stores: None,
            store: None,
            updates: None,
        };
        loop {
            if !thread.turn(|_| ()) {
                wake::sleep(|| !thread.waits());
            }
        }
    }

    /// By itself, so that the stack is free again afterwards.
    #[inline(never)]
    fn blank() -> Option<&'static mut App<'static>> {
        APP.try_init_with(App::blank)
    }

    /// By itself, so that the stack is free again afterwards.
    #[inline(never)]
    fn start(scb: &mut SCB, board: Board) -> Option<Background<'static>> {
        let learner = learners::combined(memory).map(|learner| learner as &mut dyn Learner);
        let app = blank()?;
        app.switch_on(Board::hardware(), None, learner);
        if let Some(memory) = blackbox::memory() {
            app.record_in(memory);
        }
        let background = learners::apart(app);
        FRAME.start(scb, Path { app, board });
        background
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        // for the linker: nothing in this image panics (`cargo xtask size`)
        cortex_m::peripheral::SCB::sys_reset()
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("mps2 is a board binary: `cargo xtask qemu`");
}
