//! `host-sim device configure` and `device show`.

use crate::cli::options::refused;
use firmware::configuration::Configuration;
use host_core::error::Error;
use host_device::device::{Info, Link, can_store, configuration, configure, info, store};
use host_unit::Unit;

/// What a device is told of the unit of a file or preset.
pub(super) fn told(name: &str) -> Result<Configuration, Error> {
    let told = Unit::load(name)?.configuration();
    told.map_err(|f| refused(format!("{name}: {}", f.key), f.problem, f.remedy))
}

/// Configures the device with the unit of a file or preset, and stores that if asked to. Returns
/// what is then in force.
pub(super) fn run(link: &mut Link, name: &str, keep: bool) -> Result<Info, Error> {
    let told = told(name)?;
    link.version()?;
    if keep && !can_store(link)? {
        return Err(link.error(
            "this board has no place to store a configuration",
            "give --no-store, and configure it after each start",
        ));
    }
    configure(link, &told)?;
    if keep {
        store(link, told.correction.mode)?;
    }
    info(link)
}

/// The configuration in use as a unit file.
pub(super) fn show(link: &mut Link) -> Result<Unit, Error> {
    link.version()?;
    let Some(told) = configuration(link)? else {
        return Err(link.error(
            "the device has no configuration and only passes bytes",
            "configure it: host-sim device configure FILE",
        ));
    };
    Unit::of(&told).ok_or_else(|| {
        link.error(
            "its configuration was not made from a unit file and cannot be shown as one",
            "configure it from a unit file",
        )
    })
}
