//! The same computation on two machines: fixed input vectors, a fixed network, and a digest of
//! every output bit.
//!
//! The desktop test and the board image run the same [`CHECKS`] and compare them with the same
//! committed constants. If both agree with the constants, they agree with each other bit for bit.
//! After a change of the network's arithmetic `cargo xtask vectors` rewrites the constants; commit
//! them together with the change.
#![no_std]

mod digest;
#[cfg(feature = "device")]
mod driven;
#[cfg_attr(
    not(feature = "device"),
    allow(dead_code, reason = "one of them is of the device")
)]
mod expected;
pub mod generate;
#[cfg(feature = "device")]
pub mod growth;
mod inputs;
pub mod kernel;
pub mod learners;
#[cfg(feature = "device")]
pub mod learning;
#[cfg(feature = "device")]
pub mod list;
#[cfg(feature = "device")]
pub mod navigation;
mod network;
pub mod work;

use core::fmt::Write;

use lrnn_nostd::{Rational, Tanh};

pub use digest::Digest;
#[cfg(feature = "device")]
pub use driven::driven_digest;
pub use inputs::{INPUTS, VECTORS};
pub use learners::learner_digest;
pub use network::{gradient_digest, input, net, step_digest};

/// One digest with the value it must have.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Name in the printed list.
    pub name: &'static str,
    /// Computes the digest on the machine it runs on.
    pub digest: fn() -> u64,
    /// The digest that the desktop computed when the constants were written.
    pub expected: u64,
}

/// All digests: steps, exact gradients and learners with both hidden activations, the kernel in
/// both forms, and with the feature `device` networks that temperature and vibration drive.
pub const CHECKS: [Check; 8 + cfg!(feature = "device") as usize] = [
    check(
        "step, rational",
        step_digest::<Rational>,
        expected::STEP_RATIONAL,
    ),
    check("step, tanh", step_digest::<Tanh>, expected::STEP_TANH),
    check(
        "gradient, rational",
        gradient_digest::<Rational>,
        expected::GRADIENT_RATIONAL,
    ),
    check(
        "gradient, tanh",
        gradient_digest::<Tanh>,
        expected::GRADIENT_TANH,
    ),
    check(
        "learners, rational",
        learner_digest::<Rational>,
        expected::LEARNERS_RATIONAL,
    ),
    check(
        "learners, tanh",
        learner_digest::<Tanh>,
        expected::LEARNERS_TANH,
    ),
    check("kernel, m4", kernel::digest_m4, expected::KERNEL_M4),
    check("kernel, m7", kernel::digest_m7, expected::KERNEL_M7),
    #[cfg(feature = "device")]
    check("driven", driven_digest, expected::DRIVEN),
];

const fn check(name: &'static str, digest: fn() -> u64, expected: u64) -> Check {
    Check {
        name,
        digest,
        expected,
    }
}

/// Computes every digest of `checks`, prints each beside its expected value, and returns whether
/// all are equal. A line that cannot be written counts as a difference, because nobody would see
/// the result.
pub fn compare(checks: &[Check], out: &mut impl Write) -> bool {
    let mut equal = true;
    for check in checks {
        let here = (check.digest)();
        let same = here == check.expected;
        let verdict = if same { "equal" } else { "DIFFERENT" };
        let line = writeln!(
            out,
            "{:<20} here {here:016x} expected {:016x} {verdict}",
            check.name, check.expected
        );
        equal &= same && line.is_ok();
    }
    equal
}
