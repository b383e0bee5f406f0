//! Orders of the page's buttons.

use firmware::control::{Alignment, Mode};
use firmware::fix::Heading;
use firmware::wire::command::Request;
use host_core::error::Error;
use host_device::device::{Link, MODES, commit, configure, mode_name, store};
use host_unit::Unit;
use serde::Deserialize;
use std::fs;
use std::path::Path;
use tokio::sync::oneshot;

/// Result of an order, in words.
pub type Reply = Result<String, String>;

/// An order and the channel for its answer.
pub struct PendingOrder {
    /// The order.
    pub order: Order,
    /// Receives the answer.
    pub reply: oneshot::Sender<Reply>,
}

/// An order of a button.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "order", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Order {
    /// Sets the mode.
    Mode {
        /// Its name.
        mode: String,
    },
    /// The navigation computer's alignment begins, or is done.
    Alignment {
        /// Whether it is done.
        finished: bool,
    },
    /// Gives the heading for the alignment in progress, deg.
    Heading {
        /// Heading, deg, clockwise from north.
        deg: f64,
        /// Its standard deviation, deg.
        sigma: f64,
    },
    /// Puts the learnt weights into use.
    CommitLearnt {},
    /// Stores configuration and weights, so that they survive a power cycle.
    Store {},
    /// Configures the device with a unit.
    Configure {
        /// The text of the unit file.
        unit: String,
        /// Whether to store it, so that it survives a power cycle.
        store: bool,
    },
}

impl Order {
    /// Carries out the order.
    pub(super) fn carry_out(&self, link: &mut Link) -> Reply {
        let done = match self {
            Self::Mode { mode } => set_mode(link, mode),
            Self::Alignment { finished } => align(link, *finished),
            Self::Heading { deg, sigma } => {
                let heading = Heading {
                    angle: deg.to_radians() as f32,
                    sigma: sigma.to_radians() as f32,
                };
                let done = link.order(&Request::Heading(heading));
                done.map(|()| format!("the heading {deg} deg is taken"))
            }
            Self::CommitLearnt {} => commit(link),
            Self::Store {} => link.health().and_then(|health| {
                store(link, health.mode)?;
                Ok("configuration and weights are stored".into())
            }),
            Self::Configure { unit, store } => return configured(link, unit, *store),
        };
        done.map_err(|error| error.to_string())
    }
}

fn set_mode(link: &mut Link, name: &str) -> Result<String, Error> {
    let mode: Option<Mode> = MODES.into_iter().find(|mode| mode_name(*mode) == name);
    let Some(mode) = mode else {
        return Err(Error::unknown("mode", name, &MODES.map(mode_name)));
    };
    link.order(&Request::SetMode(mode))?;
    Ok(format!("the mode is {name}"))
}

fn align(link: &mut Link, finished: bool) -> Result<String, Error> {
    let (alignment, words) = if finished {
        (Alignment::Finished, "the alignment is done")
    } else {
        (Alignment::Started, "the alignment has begun")
    };
    link.order(&Request::Alignment(alignment))?;
    Ok(words.into())
}

/// Configures the device with a unit. The text is read as a file, so that errors name line and key.
fn configured(link: &mut Link, text: &str, keep: bool) -> Reply {
    let folder = tempfile::tempdir().map_err(|error| format!("no temporary file ({error})"))?;
    let file = folder.path().join("unit.toml");
    fs::write(&file, text).map_err(|error| format!("no temporary file ({error})"))?;
    configure_unit(link, &file, keep).map_err(|error| {
        let prefix = format!("{}{}", folder.path().display(), std::path::MAIN_SEPARATOR);
        error.to_string().replace(&prefix, "")
    })
}

fn configure_unit(link: &mut Link, file: &Path, keep: bool) -> Result<String, Error> {
    let configuration = Unit::read(file)?.configuration();
    let configuration = configuration.map_err(|wrong| Error::Option {
        option: wrong.key,
        problem: wrong.problem,
        remedy: wrong.remedy,
    })?;
    configure(link, &configuration)?;
    if keep {
        store(link, configuration.correction.mode)?;
    }
    let stored = if keep { " and stored" } else { "" };
    let name = &configuration.identity.name;
    Ok(format!("the unit {name} is configured{stored}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_as_the_page_sends_them() {
        let read = serde_json::from_str::<Order>;
        assert_eq!(
            read(r#"{"order":"mode","mode":"learn"}"#).expect("good"),
            Order::Mode {
                mode: "learn".into()
            }
        );
        assert_eq!(
            read(r#"{"order":"commit-learnt"}"#).expect("good"),
            Order::CommitLearnt {}
        );
        for bad in [
            r#"{"order":"erase"}"#,
            r#"{"order":"heading","deg":3}"#,
            r#"{"order":"store","all":true}"#,
            r#"{"mode":"learn"}"#,
        ] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
