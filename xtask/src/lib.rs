//! Builds images and programs, checks what the machine must have, and calls other programs. `cargo
//! xtask` uses it, and so do the packages that test images (`tests/qemu`) and measure them
//! (`tests/measure`). It depends on nothing of this workspace.

pub mod boards;
pub mod images;
pub mod load;
pub mod needs;
pub mod stage;
pub mod table;
pub mod venv;
