//! The ring of the lines and the queue between two priorities, compiled from their own source with
//! loom's atomics and cells instead of the processor's. Loom runs a test in every order in which
//! the two ends can take their steps, and with every value that a load may see.

/// Atomics that loom checks. Those of the processor can be created in a constant; these are created
/// on first use.
pub mod atomics {
    pub use std::sync::atomic::Ordering;

    macro_rules! atomic {
        ($name:ident, $loom:ident, $value:ty) => {
            /// Stands in for the type of the same name in `core::sync::atomic`.
            #[derive(Debug)]
            pub struct $name($value, std::sync::OnceLock<loom::sync::atomic::$loom>);

            impl $name {
                /// An atomic with this initial value.
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

/// A slot whose use loom checks, instead of that of `firmware`.
mod slot {
    use loom::cell::UnsafeCell;
    use std::sync::OnceLock;

    /// It is created on first use: loom's cells cannot be created in a constant.
    #[derive(Debug)]
    pub struct Slot<T>(OnceLock<UnsafeCell<Option<T>>>);

    impl<T> Slot<T> {
        /// A slot without a value.
        pub const fn new() -> Slot<T> {
            Slot(OnceLock::new())
        }

        fn get(&self) -> &UnsafeCell<Option<T>> {
            self.0.get_or_init(|| UnsafeCell::new(None))
        }

        /// Writes a value. Loom fails if the other end uses the slot at the same time.
        pub fn write(&self, value: T) {
            let before = self.with(|slot| slot.replace(value));
            assert!(before.is_none(), "a value that was not taken");
        }

        /// Takes the value. Loom fails if the other end uses the slot at the same time.
        pub fn read(&self) -> T {
            self.with(Option::take).expect("a value")
        }

        #[allow(unsafe_code, reason = "loom's cells have no other access")]
        fn with<R>(&self, act: impl FnOnce(&mut Option<T>) -> R) -> R {
            // SAFETY: loom panics when anybody else has it.
            self.get().with_mut(|slot| act(unsafe { &mut *slot }))
        }
    }

    // SAFETY: loom looks whether two threads use it at once; that is the test.
    #[allow(unsafe_code, reason = "as in `firmware`")]
    unsafe impl<T: Send> Sync for Slot<T> {}
}

#[path = "../../../firmware/src/link/ring.rs"]
pub mod ring;
#[path = "../../../firmware/src/link/spsc.rs"]
pub mod spsc;
