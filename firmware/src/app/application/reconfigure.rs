//! The application restarts with another configuration, while the sensor goes on sending.

use super::App;
use crate::app::config::{Config, StoreFaults};
use crate::app::flow::configure;
use crate::app::phase::Machine;
use crate::configuration::record::decode;
use crate::link::Line;
use crate::model::Nets;
use crate::store::unit;
use crate::wire::command::fault;

impl App<'_> {
    /// Takes the configuration of the server's record into use. The beginning of a frame that is
    /// arriving stays pending when the format stays, and is sent on when it does not: no byte is
    /// lost.
    #[inline(never)]
    pub(super) fn reconfigure(&mut self, out: &mut impl Line, now: u64) {
        let Some((config, other_weights)) = self.renewed() else {
            return; // the server has decoded it
        };
        if config.format != Some(self.link.framer.format()) {
            self.pass_rest(out);
        }
        self.gnss.restart(config.receiver());
        let of = |config: &Config| config.configuration.as_ref().map(unit);
        let same = of(&self.flow.config).is_some_and(|old| Some(old) == of(&config));
        if !same {
            self.flow.pending.unit_memory.exchange_unit();
        }
        configure(&mut self.flow.learning.port, same, &config);
        self.flow.restart(config);
        self.flow.health.flag(fault::WEIGHTS, other_weights);
        self.machine = Machine::new();
        self.reverse = Default::default();
        self.use_detected();
        self.note_record();
        self.start(out, now);
    }

    /// The configuration of the record, with what stays of the one in use; whether the weights
    /// belong to another sensor. By itself, so that the stack holds the configuration once.
    #[inline(never)]
    fn renewed(&mut self) -> Option<(Config, bool)> {
        let configuration = decode(&self.commands.server.record).ok()?;
        let old = &self.flow.config;
        let new = Config::of(&configuration);
        let serial = |config: &Config| {
            let configuration = config.configuration.as_ref();
            configuration.map(|configuration| configuration.identity.serial.clone())
        };
        let same = serial(old).is_none_or(|old| Some(old) == serial(&new));
        let other_weights = !same && !old.nets.same_images(&Nets::NONE);
        self.flow.pending.configuration_changed();
        if !same {
            self.flow.pending.forget_next();
        }
        if old.lines() != new.lines() {
            self.to_open = Some(new.lines());
        }
        let config = Config {
            nets: if same { old.nets } else { Nets::NONE },
            store: old.store,
            store_faults: StoreFaults {
                other_unit: false,
                ..old.store_faults
            },
            hardware: old.hardware,
            ..new
        };
        Some((config, other_weights))
    }
}
