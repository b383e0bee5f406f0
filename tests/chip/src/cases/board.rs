//! The drivers of the board `stm32f405`, as its image has them.

#![allow(unsafe_code, reason = "the board's; each block says why it is sound")]
#![allow(dead_code, reason = "what only the whole firmware uses")]

#[path = "../../../../firmware/src/board/stm32f405/clock.rs"]
pub mod clock;
#[path = "../../../../firmware/src/board/stm32f405/counter.rs"]
pub mod counter;
#[path = "../../../../firmware/src/board/stm32f405/crash.rs"]
mod crash;
#[path = "../../../../firmware/src/board/stm32f405/flash.rs"]
pub mod flash;
#[path = "../../../../firmware/src/board/stm32f405/frame.rs"]
mod frame;
#[path = "../../../../firmware/src/board/stm32f405/interrupts.rs"]
pub mod interrupts;
#[path = "../../../../firmware/src/board/stm32f405/measure.rs"]
mod measure;
#[path = "../../../../firmware/src/board/stm32f405/pins.rs"]
mod pins;
#[path = "../../../../firmware/src/board/stm32f405/serial.rs"]
pub mod serial;
#[path = "../../../../firmware/src/board/stm32f405/spi.rs"]
mod spi;
#[path = "../../../../firmware/src/board/stm32f405/stream.rs"]
mod stream;
#[path = "../../../../firmware/src/board/stm32f405/supply.rs"]
pub mod supply;
