//! Once a second: whether the configuration in use is intact.

use super::App;
use crate::app::config::Config;
use crate::configuration::record::{self, Record, decode};
use crate::link::Line;

impl App<'_> {
    /// Checks networks and configuration in turn. A configuration that differs from its record is
    /// restored from the record; a record that cannot be read any more is rewritten.
    #[inline(never)]
    pub(super) fn scrub(&mut self, out: &mut impl Line, now: u64) {
        self.flow.scrub();
        self.upkeep.seconds = self.upkeep.seconds.wrapping_add(1);
        let due = self.upkeep.as_recorded && self.upkeep.seconds.is_multiple_of(CONFIGURATION_S);
        if !due || self.is_as_recorded() {
            return;
        }
        self.flow.health.mended();
        if decode(&self.commands.server.record).is_ok() {
            // what is stored is what comes into use again
            let (counters, stored) = (self.flow.health.counters, self.flow.pending.config_stored);
            self.reconfigure(out, now);
            self.flow.health.counters = counters;
            self.flow.pending.config_stored = stored;
        } else if let Some(record) = self.encoded() {
            self.commands.server.record = record;
        }
    }

    #[inline(never)]
    fn encoded(&self) -> Option<Record> {
        self.flow.config.configuration.as_ref().map(record::encode)
    }

    /// A configuration has come into use. One that was changed by hand, as a test may do, is not
    /// looked at later.
    pub(super) fn note_record(&mut self) {
        self.upkeep.as_recorded = self.is_as_recorded();
    }

    fn is_as_recorded(&self) -> bool {
        App::agree(&self.flow.config, &self.commands.server.record)
    }

    /// Record, configuration and what follows from it agree.
    #[inline(never)]
    pub(super) fn agree(config: &Config, record: &Record) -> bool {
        let Some(configuration) = &config.configuration else {
            return record.is_empty();
        };
        decode(record).is_ok_and(|of_record| of_record == *configuration)
            && config.follows(&Config::of(configuration))
    }
}

/// The configuration is looked at once in so many seconds.
const CONFIGURATION_S: u8 = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configuration::tests::example;
    use crate::link::NoLine;
    use crate::wire::ImuFormat;

    /// Any upset of the configuration is repaired, a second and a third time as the first.
    #[test]
    fn every_upset_is_mended_not_only_the_first() {
        let configuration = example(ImuFormat::Stim300);
        let mut app = App::new(Config::of(&configuration));
        app.start(&mut NoLine, 0);
        app.flow.pending.config_stored = true;
        let record = app.commands.server.record.clone();
        let upsets: [fn(&mut App); 4] = [
            |app| app.flow.config.limit.gyro = 0.5,
            |app| app.flow.config.silence_us ^= 1 << 9,
            |app| {
                app.flow
                    .config
                    .configuration
                    .as_mut()
                    .expect("configured")
                    .rate = 501.0
            },
            |app| app.commands.server.record[20] ^= 4,
        ];
        for (times, upset) in (1..).zip(upsets.iter().cycle().take(12)) {
            upset(&mut app);
            (0..CONFIGURATION_S).for_each(|_| app.scrub(&mut NoLine, 0));
            assert_eq!(app.counters().mended, times);
            assert!(
                app.upkeep.as_recorded
                    && App::agree(&Config::of(&configuration), &app.commands.server.record)
            );
            assert!(app.flow.config.follows(&Config::of(&configuration)));
            assert_eq!(app.commands.server.record, record);
            assert!(app.flow.pending.config_stored, "what is learnt is stored");
        }
    }
}
