//! The images and how they are built ([`xtask::images`]), and the boards: each with its image and
//! the QEMU machine that runs it.

pub use xtask::images::*;

use crate::machine::{self, Machine};

/// A board: its image and the QEMU machine that runs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Name in reports.
    pub name: &'static str,
    /// The image that is flashed.
    pub image: Image,
    /// The machine that runs it here.
    pub machine: Machine,
}

/// Every board.
pub const BOARDS: [Board; 4] = [
    Board {
        name: "stm32f405",
        image: STM32F405,
        machine: machine::NETDUINOPLUS2,
    },
    Board {
        name: "mps2-an386",
        image: MPS2,
        machine: machine::MPS2_AN386,
    },
    Board {
        name: "mps2-an500",
        image: MPS2,
        machine: machine::MPS2_AN500,
    },
    Board {
        name: "stm32f405_window",
        image: STM32F405_WINDOW,
        machine: machine::NETDUINOPLUS2,
    },
];
