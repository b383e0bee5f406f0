//! Surroundings of an IMU, and its history before power-on: the tables `[ambient]` and `[power]` of
//! a scenario.
//!
//! Without these tables the ambient is that of the unit's table `block` alone, and every start is
//! cold.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Solar time at which the air is warmest, h: about two hours after noon (1.9 h at a height of
/// 1.5 m: Parton and Logan, Agricultural Meteorology 23, 1981).
const WARMEST_H: f64 = 14.0;
/// A soak of this length and more is a cold start, s.
pub const LONG_SOAK_S: f64 = 2.0 * 86_400.0;
/// Random stream of the turn-on for the history.
const HISTORY: u64 = 9;
/// Ranges of the drawn soaks of warm starts and of hot ones, s: a meal to a parked afternoon, and a
/// refuelling (assumed).
const WARM_S: [f64; 2] = [900.0, 10_800.0];
const HOT_S: [f64; 2] = [5.0, 300.0];

/// Surroundings of the IMU, and its history.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct World {
    /// The air around the case.
    pub ambient: Ambient,
    /// The power-on.
    pub power: Power,
}

/// Temperature of the air around the case, as a difference from the calibration temperature.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ambient {
    /// Mean of the day at the height of the start, K, -80 to 60.
    pub offset_k: f64,
    /// Amplitude of the daily sinusoid, K, 0 to 30.
    pub day_k: f64,
    /// Solar time at power-on, h, 0 to 24. It is warmest at 14 h.
    pub hour: f64,
    /// Loss of temperature with height, K/km, -20 to 20. The standard atmosphere has 6.5
    /// (ISO 2533).
    pub lapse_kpkm: f64,
    /// Tunnels and garages: steps that add up.
    pub step: Vec<Step>,
}

/// A period in air of another temperature: a tunnel, or the garage that the vehicle comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Begin, s after power-on, -1e6 to 1e6. A garage begins before power-on.
    pub at_s: f64,
    /// Duration, s, 0 to 1e6.
    pub duration_s: f64,
    /// Change of the temperature, K, -80 to 80.
    pub change_k: f64,
}

impl Ambient {
    /// Temperature `t` s after power-on, `climbed` m above the start, K.
    #[must_use]
    pub fn at(&self, t: f64, climbed: f64) -> f64 {
        let phase = (self.hour - WARMEST_H) / 24.0 + t / 86_400.0;
        let inside = |s: &&Step| (s.at_s..s.at_s + s.duration_s).contains(&t);
        let steps: f64 = self.step.iter().filter(inside).map(|s| s.change_k).sum();
        self.offset_k + self.day_k * (std::f64::consts::TAU * phase).cos()
            - self.lapse_kpkm * 1e-3 * climbed
            + steps
    }
}

/// Temperature of the unit at power-on, by its history.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartName {
    /// As warm as the ambient.
    #[default]
    Cold,
    /// Off for 15 min to 3 h.
    Warm,
    /// Off for 5 s to 5 min.
    Hot,
    /// One of the three at each turn-on.
    Mixed,
}

impl std::fmt::Display for StartName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = Self::NAMES.iter().find(|(_, start)| start == self);
        f.pad(name.map_or("cold", |(name, _)| name))
    }
}

impl StartName {
    /// Names as they are written.
    pub const NAMES: [(&'static str, Self); 4] = [
        ("cold", Self::Cold),
        ("warm", Self::Warm),
        ("hot", Self::Hot),
        ("mixed", Self::Mixed),
    ];
}

/// The power-on and its history.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Power {
    /// Temperature of the unit at power-on, by its history.
    pub start: StartName,
    /// Time since the last power-off, s, 0 to 1e6. Without it, it is drawn as `start` says; a cold
    /// start with it is refused.
    pub soak_s: Option<f64>,
    /// Duration of the operation before that, s, 0 to 1e5.
    pub on_before_s: f64,
    /// Time since the calibration, days, 0 to 10000; for the errors that age.
    pub age_days: f64,
    /// Power-ons since the calibration, 0 to 10000; for the errors that step.
    pub power_ons: u32,
}

impl Default for Power {
    fn default() -> Self {
        Self {
            start: StartName::Cold,
            soak_s: None,
            on_before_s: 7200.0,
            age_days: 0.0,
            power_ons: 0,
        }
    }
}

impl Power {
    /// The history of the turn-on with this seed.
    #[must_use]
    pub fn history_of(&self, turn_on: u64) -> History {
        let mut rng = ChaCha8Rng::seed_from_u64(turn_on);
        rng.set_stream(HISTORY);
        self.history(&mut rng)
    }

    /// A history. The soak is uniform in its logarithm.
    #[must_use]
    fn history(&self, turn_on: &mut ChaCha8Rng) -> History {
        let kind = match self.start {
            StartName::Mixed => {
                [StartName::Cold, StartName::Warm, StartName::Hot][turn_on.random_range(0..3)]
            }
            kind => kind,
        };
        let range = match kind {
            StartName::Warm => WARM_S,
            StartName::Hot => HOT_S,
            StartName::Cold | StartName::Mixed => return History::COLD,
        };
        let drawn = turn_on.random_range(range[0].ln()..range[1].ln()).exp();
        History {
            start: kind,
            on_s: self.on_before_s,
            soak_s: self.soak_s.unwrap_or(drawn),
        }
    }
}

/// History before a power-on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct History {
    /// Kind of the start; never [`StartName::Mixed`].
    pub start: StartName,
    /// Duration of the operation after a cold state, s.
    pub on_s: f64,
    /// Time since the power-off, s.
    pub soak_s: f64,
}

impl History {
    /// The unit has been off for long.
    pub const COLD: Self = Self {
        start: StartName::Cold,
        on_s: 0.0,
        soak_s: f64::INFINITY,
    };

    /// On for so long, then off for so long, s.
    #[must_use]
    pub fn warm(on_s: f64, soak_s: f64) -> Self {
        Self {
            start: StartName::Warm,
            on_s,
            soak_s,
        }
    }

    /// Whether the unit is as warm as the ambient.
    #[must_use]
    pub fn is_cold(&self) -> bool {
        self.soak_s >= LONG_SOAK_S || self.on_s <= 0.0
    }

    /// Value at power-on of a quantity that approaches 1 with the time constant `time_s` while the
    /// unit is on, and 0 while it is off: `(1 - exp(-on / tau)) exp(-soak / tau)`.
    #[must_use]
    pub fn left(&self, time_s: f64) -> f64 {
        match self.is_cold() {
            true => 0.0,
            false => -(-self.on_s / time_s).exp_m1() * (-self.soak_s / time_s).exp(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ambient_is_the_sum_of_its_parts() {
        let day = Ambient {
            offset_k: 3.0,
            day_k: 8.0,
            hour: 8.0,
            ..Ambient::default()
        };
        // warmest at 14 h, mean at 8 h and 20 h, coldest at 2 h
        for (hours, want) in [
            (0.0, 3.0),
            (6.0, 11.0),
            (12.0, 3.0),
            (18.0, -5.0),
            (30.0, 11.0),
        ] {
            assert!(
                (day.at(hours * 3600.0, 0.0) - want).abs() < 1e-9,
                "{hours} h"
            );
        }
        let tunnel = Ambient {
            lapse_kpkm: 6.5,
            step: vec![
                Step {
                    at_s: -7200.0,
                    duration_s: 7260.0,
                    change_k: 12.0,
                },
                Step {
                    at_s: 600.0,
                    duration_s: 120.0,
                    change_k: -9.0,
                },
            ],
            ..Ambient::default()
        };
        let at = |t| tunnel.at(t, 0.0);
        assert_eq!([at(-8000.0), at(0.0), at(60.0)], [0.0, 12.0, 0.0]);
        assert_eq!(
            [at(599.0), at(600.0), at(719.0), at(720.0)],
            [0.0, -9.0, -9.0, 0.0]
        );
        // 11 km of the standard atmosphere: from 15 to -56.5 degrees
        assert!((tunnel.at(900.0, 11_000.0) + 71.5).abs() < 1e-9);
        assert_eq!(Ambient::default().at(1e4, 5000.0), 0.0);
    }

    #[test]
    fn soaks_are_drawn_in_their_ranges_and_a_given_one_is_used() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut draw = |start, soak_s| {
            let power = Power {
                start,
                soak_s,
                ..Power::default()
            };
            power.history(&mut rng)
        };
        assert!(draw(StartName::Cold, None).is_cold());
        let mut kinds = [0; 3];
        for _ in 0..3000 {
            let (warm, hot) = (draw(StartName::Warm, None), draw(StartName::Hot, None));
            assert!((WARM_S[0]..=WARM_S[1]).contains(&warm.soak_s) && warm.on_s == 7200.0);
            assert!((HOT_S[0]..=HOT_S[1]).contains(&hot.soak_s));
            let soak = draw(StartName::Mixed, None).soak_s;
            kinds[usize::from(soak > HOT_S[1]) + usize::from(soak > WARM_S[1])] += 1;
        }
        assert!(kinds.iter().all(|n| (850..1150).contains(n)), "{kinds:?}");
        assert_eq!(draw(StartName::Hot, Some(77.0)).soak_s, 77.0);
    }

    #[test]
    fn what_is_left_follows_both_exponentials() {
        let history = History::warm(900.0, 1800.0);
        let want = (1.0 - (-1.0f64).exp()) * (-2.0f64).exp();
        assert!((history.left(900.0) - want).abs() < 1e-12);
        assert_eq!(History::COLD.left(900.0), 0.0);
        let just_off = History::warm(1e6, 0.0);
        assert_eq!(just_off.left(900.0), 1.0);
    }
}
