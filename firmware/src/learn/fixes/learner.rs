//! The learner from fixes as the compensator drives it.

use super::FixLearner;
use crate::align::Align;
use crate::compensator::Block;
use crate::control::{Alignment, Reason};
use crate::fix::{Fix, Heading};
use crate::learn::bank::ZERO_CORRECTION;
use crate::learn::prior::Shapes;
use crate::learn::quantise::{Scale, split};
use crate::learn::settings::Settings;
use crate::learn::{Learner, Report, Resting, Solution, Trials, Winner};
use crate::model::Nets;
use crate::sample::{RawSample, StreamScale};
use crate::wheels::WheelSpeed;
use lrnn_nostd::State;

impl Learner for FixLearner<'_> {
    fn configure(&mut self, settings: &Settings) {
        self.settings = *settings;
        self.memory.antenna.configure(settings);
        self.samples.stream = None;
        self.choice.running = ZERO_CORRECTION;
        self.tally = super::Tally::default();
        self.restart();
    }

    /// Begins from what is remembered of the unit, or from the datasheet: the hypotheses have
    /// networks of their own. One of them believes `nets`, which correct this drive, and shows
    /// whether they should. Hidden layers of `nets` that pass their inputs on are the shape of the
    /// networks that are driven by inputs.
    fn begin(&mut self, nets: &Nets, stream: StreamScale) {
        self.shapes.driven = [nets.gyro, nets.accel];
        self.choice.stored_maps = nets.maps;
        self.samples.stream = Some(stream);
        self.choice.running = ZERO_CORRECTION;
        self.samples.scale = None;
        self.begin_bank();
        self.memory.rehearsal.begin();
        self.begin_stored();
        self.begin_shapes();
        (0..Shapes::<f32>::REACHES).for_each(|reach| self.shapes.reach(reach));
        self.begin_from_memory(&stream);
    }

    fn restart(&mut self) {
        self.memory.rehearsal.interrupted();
        self.restart_stream();
        self.memory.bank.reset_networks();
    }

    fn sample(&mut self, number: u32, sample: &RawSample) {
        let Some(stream) = self.samples.stream else {
            return;
        };
        let scale = *self
            .samples
            .scale
            .get_or_insert_with(|| Scale::of(sample, &stream.lsb));
        let counts = scale.counts(sample);
        let missing = self.missing(number);
        if missing > 0 {
            self.go_across(missing, &counts);
        }
        self.take_sample(number, &counts);
    }

    fn block(&mut self, _: u32, block: &Block) {
        if self.samples.stream.is_some() {
            self.end_block(&block.sources);
        }
    }

    /// The numbers of the samples show what is missing. The next one begins a block.
    fn gap(&mut self) {
        self.fix_times.pending.gap();
    }

    fn silence(&mut self) {
        self.falls_silent();
    }

    fn fix(&mut self, number: u32, fix: &Fix) {
        let navigates = self
            .navigation
            .course
            .navigates()
            .then_some(self.samples.stream)
            .flatten();
        if !navigates.is_some_and(|stream| self.fix_times.pending.defers(number, fix, &stream)) {
            self.take_fix(number, fix);
        }
    }

    fn wheel_speed(&mut self, number: u32, speed: &WheelSpeed) {
        let _ = self.take_wheel_speed(number, speed); // `None`: it teaches nothing
    }

    fn align(&mut self, alignment: Alignment) {
        let navigates = self.navigation.course.navigates();
        match (&mut self.navigation.align, alignment) {
            (Some(align), Alignment::Started) if !navigates => align.restart(true),
            (Some(align), Alignment::Finished) => align.finish_command(),
            _ => {}
        }
    }

    fn heading(&mut self, heading: Heading) -> Result<(), Reason> {
        self.take_heading(heading)
    }

    fn winner(&mut self) -> Option<Winner> {
        self.in_force()
    }

    fn for_next_power_on(&mut self) -> Option<Winner> {
        self.of_unit()
    }

    fn rest(&self) -> Option<Resting> {
        self.resting()
    }

    fn remember(&mut self) -> usize {
        self.take_down()
    }

    fn next_drive(&mut self) {
        self.remember();
        self.begin_drive();
        self.restart();
    }

    fn write_memory(&self, start: usize, piece: &mut [u8]) {
        self.remembered.unit.write(start, piece);
    }

    fn recall(&mut self, memory: &[u8]) {
        self.remembered.unit.read(memory);
        self.begin_drive();
    }

    fn learnt(&mut self) -> (Nets, [State; 2]) {
        let (bank, running) = (&self.memory.bank, self.choice.running);
        let [gyro, accel] = bank.nets_of(running);
        let maps = bank.maps_of(running);
        (Nets { gyro, accel, maps }, bank.states_of(running))
    }

    fn solution(&self) -> Option<Solution> {
        self.solved()
    }

    fn trials(&self) -> Option<Trials> {
        Some(self.tried())
    }

    fn report(&self) -> Report {
        Report {
            estimate: split(self.memory.bank.estimate_of(self.choice.running)),
            fixes: self.tally.used,
            refused: self.tally.refused,
            late: self.tally.late,
            winner: self.choice.running as u8,
            promotions: self.tally.promotions,
            rollbacks: self.tally.rollbacks,
            navigates: self.navigation.course.navigates(),
            still_s: self.navigation.align.as_ref().map_or(0, Align::still),
            antenna: self.memory.antenna.estimate(),
            rests: self.motion.rests.number(),
            rest_s: self.rest_s(),
            equal_scales: self.has_equal_scales(),
            stored_harms: self.stored_harms(),
            withdraws: self.remembered.withdraws,
            ..self.aligned()
        }
    }
}
