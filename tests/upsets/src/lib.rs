//! Single event upsets: a particle, a worn cell or a supply that dips changes one bit of memory.
//!
//! A device runs on the desktop until it corrects its samples. Its memory is copied. Then one bit
//! after the other is flipped, the device runs for some seconds, its output is compared with its
//! input, and the memory is restored. The judge knows frames and limits, and nothing of how the
//! device works.
//!
//! A flipped bit can make a value that its type does not have, or an address that leads nowhere. On
//! a microcontroller that ends in a fault of the processor or in an endless loop, after which the
//! watchdog restarts the device. Here it ends a process, so the trials run in a process of their
//! own ([`parent`]).

pub mod child;
pub mod device;
pub mod judge;
pub mod memory;
pub mod parent;
