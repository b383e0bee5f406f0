use super::*;

/// A receiver, a board and a sensor, each with its own clock.
struct World {
    /// Receiver's time at the beginning, s of the week.
    begins_s: u32,
    /// How much the board's clock is fast.
    fast: f64,
    /// True interval of the samples, s.
    interval: f64,
    /// Largest lateness of pulses and samples, microseconds.
    late_us: [f64; 2],
    /// How much of its lateness a sample has from the one before, 0 to 1.
    lasts: f64,
    late: f64,
    draws: u64,
    clock: Clock,
}

impl World {
    fn new(begins_s: u32, fast: f64, interval: f64, late_us: [f64; 2]) -> World {
        World {
            begins_s,
            fast,
            interval,
            late_us,
            lasts: 0.0,
            late: 0.5,
            draws: 1,
            clock: Clock::default(),
        }
    }

    /// 0 to 1.
    fn draw(&mut self) -> f64 {
        self.draws = self
            .draws
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.draws >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The board's time at a true time, s.
    fn board_us(&self, at_s: f64) -> u64 {
        ((3.0 + at_s) * (1.0 + self.fast) * 1e6) as u64
    }

    fn runs(&mut self, seconds: core::ops::Range<u32>, pulses: bool) {
        for second in seconds {
            if pulses {
                let late = self.draw() * self.late_us[0];
                let at_us = self.board_us(f64::from(second)) + late as u64;
                self.clock.pulse((self.begins_s + second) % WEEK_S, at_us);
            }
            // the last sample before the look, which comes somewhere in the second
            let look = f64::from(second) + 0.3 + 0.1 * self.draw();
            let number = (look / self.interval) as u32;
            // as far off its mean as without correlation
            let new = (1.0 - self.lasts * self.lasts).sqrt() * (self.draw() - 0.5);
            self.late = 0.5 + self.lasts * (self.late - 0.5) + new;
            let late = self.late * self.late_us[1];
            let at_us = self.board_us(f64::from(number) * self.interval) as f64 + late;
            let at_us = at_us as u64;
            self.clock.sample(number, at_us);
        }
    }

    fn times(&self, at_s: f64) -> Times {
        self.clock.times(self.board_us(at_s))
    }

    /// By how much the time of the sample is wrong, microseconds.
    fn error_us(&self, times: &Times) -> f64 {
        let true_us = f64::from(times.sample) * self.interval * 1e6;
        let began_us = f64::from(self.begins_s) * 1e6;
        let off = times.sample_us as f64 - (began_us + true_us) % WEEK_US as f64;
        // what is late on average is not an error of the relation
        off - (self.late_us[1] - self.late_us[0]) / 2.0
    }
}

#[test]
fn samples_have_the_receivers_time_whatever_the_clocks_are() {
    for (fast, interval, late_us) in [
        (0.0, 0.005, [0.0, 0.0]),
        (12.3e-6, 0.005_02, [2.0, 100.0]),
        (-80e-6, 0.000_501, [5.0, 40.0]),
        (9e-3, 0.0101, [5.0, 3000.0]),
    ] {
        // over the end of a week
        let mut world = World::new(WEEK_S - 60, fast, interval, late_us);
        assert_eq!(world.times(0.0), Times::default());
        world.runs(0..150, true);
        let times = world.times(150.0);
        assert_eq!((times.sync, times.holdover_s), (Sync::Locked, 0));
        let ppb = f64::from(times.board_ppb) - fast * 1e9;
        assert!(ppb.abs() < 20.0 + 60.0 * late_us[0], "{ppb}");
        let off = f64::from(times.interval_ns) * 1e-9 / interval - 1.0;
        assert!(off.abs() < 1e-7 + 1e-7 * late_us[1], "{off}");
        let error = world.error_us(&times);
        assert!(
            error.abs() < 2.0 + 4.0 * f64::from(times.error_us),
            "{error} {times:?}"
        );
        // late evenly between 0 and the most: a standard deviation of the twelfth's root
        for (found, most) in times.jitter_us.into_iter().zip(late_us) {
            let ratio = (f64::from(found) + 0.5) / (most / 12.0_f64.sqrt() + 0.5);
            assert!((0.6..1.6).contains(&ratio), "{found} of {most}");
        }
    }
}

/// The errors of many worlds are as large as is stated: not more, and where each sample is late by
/// itself not much less. `lasts`: an adapter that is late for a while.
#[test]
fn the_stated_error_covers() {
    for (lasts, least) in [(0.0, 0.5), (0.5, 0.3), (0.9, 0.2), (0.98, 0.4)] {
        let mut squares = [0.0; 2];
        for seed in 0..200 {
            let mut world = World::new(1000, 20e-6, 0.005, [20.0, 300.0]);
            (world.draws, world.lasts) = (seed, lasts);
            world.runs(0..90, true);
            let times = world.times(90.0);
            let normal = world.error_us(&times) / f64::from(times.error_us);
            squares[0] += normal * normal / 200.0;
            let ppb = f64::from(times.board_ppb) - 20e3;
            squares[1] += ppb * ppb / 200.0;
        }
        assert!((least..1.4).contains(&squares[0]), "{lasts} {squares:?}");
        assert!(squares[1].sqrt() < 100.0, "{squares:?}");
    }
}

#[test]
fn without_pulses_the_boards_clock_goes_on_for_a_while() {
    let mut world = World::new(0, 30e-6, 0.005, [2.0, 20.0]);
    world.runs(0..60, true);
    let locked = world.times(60.0);
    world.runs(60..660, false);
    let times = world.times(660.0);
    assert_eq!((times.sync, times.holdover_s), (Sync::Holdover, 601));
    assert!(times.sample > locked.sample + 119_000, "{times:?}");
    assert!(
        times.error_us > 300.0 && world.error_us(&times).abs() < 50.0,
        "{times:?}"
    );
    assert_eq!(world.times(12_000.0), Times::default(), "too long");
    world.runs(660..700, true);
    assert_eq!(world.times(700.0).sync, Sync::Locked);
}

/// In holdover the week ends as well.
#[test]
fn the_week_ends_without_a_pulse() {
    let mut world = World::new(WEEK_S - 60, 30e-6, 0.005, [2.0, 20.0]);
    world.runs(0..40, true);
    world.runs(40..100, false);
    let times = world.times(100.0);
    assert_eq!(times.sync, Sync::Holdover);
    assert!(times.sample_us < 41_000_000, "{times:?}");
    assert!(world.error_us(&times).abs() < 50.0, "{times:?}");
}

/// Another second, a gap in the numbers and a new beginning of the samples lead to no wrong time.
#[test]
fn what_jumps_begins_again() {
    let mut world = World::new(500, 0.0, 0.005, [0.0, 0.0]);
    world.runs(0..30, true);
    world.begins_s += 3;
    world.runs(30..32, true);
    assert_eq!(world.times(32.0), Times::default());
    world.runs(32..60, true);
    assert!(world.error_us(&world.times(60.0)).abs() < 2.0);
    world.clock.sample(u32::MAX, world.board_us(60.5));
    assert_eq!(world.times(60.5).sample_us, 0);
    world.clock.pulse(u32::MAX, u64::MAX);
    world.clock.sample(0, 0);
    let _ = world.clock.times(0);
}
