//! The application as it is after power-on, by what the board's store holds.

use super::App;
use crate::app::config::{Config, StoreFaults};
use crate::app::hardware::Hardware;
use crate::app::server::InitialState;
use crate::app::server::wear::{Wear, digest};
use crate::configuration::SCHEMA;
use crate::configuration::record::{Record, decode, schema};
use crate::control::Mode;
use crate::learn::Learner;
use crate::model::Nets;
use crate::store::{Newer, Stored, unit};
use crate::wire::command::StoreReport;
use crate::wire::command::key::Key;

impl<'m> App<'m> {
    /// Power-on with the content of the store; `None`: the board has no store.
    ///
    /// Weights and configuration are taken together. A configuration that this firmware does not
    /// understand is not used, and neither are the weights beside it: the device passes bytes, and
    /// fault STORE reports that the record cannot be read. If it is of a newer firmware, it is not
    /// overwritten either. Weights of another unit than the configuration's are not used, which
    /// fault WEIGHTS reports. Fault STORE also reports that an older record is used because a newer
    /// one is damaged, until something is stored again. Fault KEY reports an older record with
    /// another key.
    ///
    /// A safe start uses the configuration for the lines and the format only. It stays in bypass
    /// with the built-in networks and neither reads nor writes the store any more.
    pub fn power_on(
        hardware: Hardware,
        stored: Option<Result<Option<Stored>, Newer>>,
        learner: Option<&'m mut dyn Learner>,
    ) -> App<'m> {
        let mut app = App::blank();
        app.switch_on(hardware, stored, learner);
        app
    }

    /// [`App::power_on`] of one that is [`App::blank`].
    #[inline(never)]
    pub fn switch_on(
        &mut self,
        hardware: Hardware,
        stored: Option<Result<Option<Stored>, Newer>>,
        learner: Option<&'m mut dyn Learner>,
    ) {
        let (config, store_report) = prepared(hardware, &stored);
        let (record, key) = match &stored {
            // one that is not understood is not used
            Some(Ok(Some(stored))) if config.configuration.is_some() => {
                (stored.record.clone(), stored.key)
            }
            Some(Ok(Some(stored))) => (Record::new(), stored.key),
            _ => (Record::new(), Key::Unprovisioned),
        };
        let stored = !record.is_empty();
        let mut wear = Wear::new();
        // a key that is given again is stored again while a record with another one is left
        if stored && !config.store_faults.unread && !config.store_faults.other_key {
            wear.holds(Some(digest(&config.nets, &record, &key)));
        }
        let held = InitialState {
            record,
            stored,
            key,
            store_report,
            wear,
        };
        self.begin(config, held, learner);
    }
}

/// The application's settings and the report on the store, from the content of the store. A
/// function of its own, so that the stack is free again when the application is made.
#[inline(never)]
fn prepared(
    hardware: Hardware,
    stored: &Option<Result<Option<Stored>, Newer>>,
) -> (Config, StoreReport) {
    let store = stored.is_some();
    let mut newer = None;
    let mut nets = &Nets::NONE;
    let mut configuration = None;
    let mut unread = false;
    let (mut store_report, mut other_unit, mut other_key) = (StoreReport::default(), false, false);
    match stored {
        Some(Ok(Some(stored))) => {
            configuration = decode(&stored.record).ok();
            let life = stored.life;
            other_key = stored.other_key;
            store_report = StoreReport {
                generation: Some(stored.generation),
                starts: life.starts,
                failures: life.failures,
                minutes: life.minutes,
                erased: life.erased,
                damaged: stored.damaged,
                passed: stored.passed,
            };
            let of = stored.unit.zip(configuration.as_ref().map(unit));
            other_unit = of.is_some_and(|(of, configuration)| of != configuration);
            unread = configuration.is_none() && !stored.record.is_empty();
            if unread {
                store_report.generation = None;
                newer = schema(&stored.record).filter(|schema| *schema > SCHEMA);
            } else {
                nets = &stored.nets;
                unread = stored.damaged;
            }
            if other_unit {
                nets = &Nets::NONE;
            }
        }
        Some(Err(Newer(version))) => {
            unread = true;
            newer = Some(u16::try_from(*version).unwrap_or(u16::MAX));
        }
        Some(Ok(None)) | None => {}
    }
    let configuration = configuration.as_ref();
    let safe = hardware.starts_safely();
    let base = configuration.map_or_else(|| Config::unconfigured(hardware), Config::of);
    let config = Config {
        nets: if safe { Nets::NONE } else { *nets },
        store: store && !safe,
        mode: if safe { Mode::Bypass } else { base.mode },
        store_faults: StoreFaults {
            newer,
            unread,
            other_unit,
            other_key,
        },
        hardware,
        ..base
    };
    (config, store_report)
}
