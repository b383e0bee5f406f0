//! The project from Python, as the module `lrnn_imu`: the very code of device and desktop, so with
//! their bits. The stub (`python/lrnn_imu/_native.pyi`) has the same texts as the items here.
//!
//! Arrays come in as views and go out as the memory that Rust wrote (`arrays`). What takes long
//! lets other threads of Python run and looks for Ctrl-C (`long`). Errors are Python's exceptions
//! with the text of the Rust error (`errors`).
#![allow(
    clippy::needless_pass_by_value,
    reason = "arguments that Python converts"
)]
#![allow(
    clippy::too_many_arguments,
    reason = "keyword arguments of Python functions"
)]

mod allan;
mod arrays;
mod compensator;
mod errors;
mod experiment;
mod kalman;
mod learner;
mod long;
mod navigator;
mod network;
mod read;
mod recording;
mod replay;
mod session;
mod step;
mod unit;

use pyo3::prelude::*;

/// Native part of `lrnn_imu`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::allan::{Allan, allan, allan_file};
    #[pymodule_export]
    use super::compensator::Compensator;
    #[pymodule_export]
    use super::experiment::{Experiment, Scenario, run_experiment, simulate};
    #[pymodule_export]
    use super::kalman::Kalman;
    #[pymodule_export]
    use super::learner::{Learner, Pass};
    #[pymodule_export]
    use super::navigator::{Navigator, align, free_inertial, ned};
    #[pymodule_export]
    use super::network::Network;
    #[pymodule_export]
    use super::read::read;
    #[pymodule_export]
    use super::recording::{Recording, read_csv, read_kf_gins};
    #[pymodule_export]
    use super::replay::{Replay, replay};
    #[pymodule_export]
    use super::session::{Learnt, Session, learn_from_fixes};
    #[pymodule_export]
    use super::step::Step;
    #[pymodule_export]
    use super::unit::Unit;

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
