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
    use firmware::app::App;
    use firmware::learn::{FixMemory, Learner};
    use static_cell::ConstStaticCell;

    use crate::board::Board;
    use crate::shared::{blackbox, learners};

    /// Of the learner from fixes. This board has one kind of memory.
    static FIXES: ConstStaticCell<FixMemory> = ConstStaticCell::new(FixMemory::ZEROED);

    fn memory() -> Option<&'static mut FixMemory> {
        FIXES.try_take()
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let Some(mut board) = Board::start() else {
            cortex_m::peripheral::SCB::sys_reset()
        };
        let learner = learners::combined(memory).map(|learner| learner as &mut dyn Learner);
        let mut app = App::power_on(Board::hardware(), None, learner);
        if let Some(memory) = blackbox::memory() {
            app.record_in(memory);
        }
        loop {
            let busy = app.poll(&mut board.lines, &board.time);
            if let Some(lines) = app.to_open() {
                board.open(&lines);
            }
            board.turned(busy, app.needs());
        }
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
