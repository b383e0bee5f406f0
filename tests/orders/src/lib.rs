//! The ring of the lines, from its own source, with loom's atomics in place of the processor's.
//! Loom runs a test in every order in which the two ends can take their steps, and with every value
//! that a load may see.

/// Atomics that loom watches. Those of the processor can be made in a constant, so these are made
/// when they are used first.
pub mod atomics {
    pub use std::sync::atomic::Ordering;

    macro_rules! atomic {
        ($name:ident, $loom:ident, $value:ty) => {
            /// Stands in for the type of the same name in `core::sync::atomic`.
            #[derive(Debug)]
            pub struct $name($value, std::sync::OnceLock<loom::sync::atomic::$loom>);

            impl $name {
                /// With this value.
                pub const fn new(value: $value) -> $name {
                    $name(value, std::sync::OnceLock::new())
                }

                fn get(&self) -> &loom::sync::atomic::$loom {
                    let make = || loom::sync::atomic::$loom::new(self.0);
                    self.1.get_or_init(make)
                }

                /// As in `core::sync::atomic`.
                pub fn load(&self, order: Ordering) -> $value {
                    self.get().load(order)
                }

                /// As in `core::sync::atomic`.
                pub fn store(&self, value: $value, order: Ordering) {
                    self.get().store(value, order);
                }
            }
        };
    }

    atomic!(AtomicU8, AtomicU8, u8);
    atomic!(AtomicU32, AtomicU32, u32);
    atomic!(AtomicUsize, AtomicUsize, usize);
}

#[path = "../../../firmware/src/link/ring.rs"]
pub mod ring;
