//! `host-sim device configure` and `device show`.

use crate::cli::options::refused;
use firmware::configuration::Configuration;
use host_core::error::Error;
use host_device::device::{Info, Link, can_store, configuration, configure, info, store};
use host_unit::Unit;

/// The configuration of the unit of a file or preset.
pub(super) fn of_unit(name: &str) -> Result<Configuration, Error> {
    let configuration = Unit::load(name)?.configuration();
    configuration.map_err(|f| refused(format!("{name}: {}", f.key), f.problem, f.remedy))
}

/// Configures the device with the unit of a file or preset, and with `keep` stores the
/// configuration. Returns the device's state afterwards.
pub(super) fn run(link: &mut Link, name: &str, keep: bool) -> Result<Info, Error> {
    let configuration = of_unit(name)?;
    link.version()?;
    if keep && !can_store(link)? {
        return Err(link.error(
            "this board has no place to store a configuration",
            "give --no-store, and configure it after each start",
        ));
    }
    configure(link, &configuration)?;
    if keep {
        store(link, configuration.correction.mode)?;
    }
    info(link)
}

/// The configuration in use as a unit file.
pub(super) fn show(link: &mut Link) -> Result<Unit, Error> {
    link.version()?;
    let Some(configuration) = configuration(link)? else {
        return Err(link.error(
            "the device has no configuration and only passes bytes",
            "configure it: host-sim device configure FILE",
        ));
    };
    Unit::of(&configuration).ok_or_else(|| {
        link.error(
            "its configuration was not made from a unit file and cannot be shown as one",
            "configure it from a unit file",
        )
    })
}
