//! How a learner's proofs go on: n of 100, the pace, and what interruptions of its navigation cost.
//! The same for the device at a link and for the device in a replay.

use firmware::learn::bank::{HYPOTHESES, NAMES};
use firmware::learn::rehearsal::{PROVED, of_100};
use serde::Serialize;
use std::collections::VecDeque;
use std::fmt;

/// The pace of a proof is taken over so long at most, s.
const PACE_S: f64 = 300.0;
/// It is known after so long, s.
const LEAST_S: f64 = 60.0;
/// Time between two points of it, s.
const EVERY_S: f64 = 10.0;

/// A hypothesis in the learner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// It takes part.
    pub enabled: bool,
    /// It has proved itself.
    pub proved: bool,
    /// Capital of the bets that it is worth its use, in stakes.
    pub capital: f32,
}

/// The candidates at one time, in the order of [`NAMES`].
pub type Candidates = [Candidate; HYPOTHESES];

/// The navigator was lost, and with it what its rehearsals had won beyond ten stakes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Interruption {
    /// When it was seen, s.
    pub t_s: f64,
    /// What explains it, in words; `None`: nothing that was seen.
    pub why: Option<String>,
    /// How near the proof was before, of 100.
    pub proof: u8,
    /// When it navigated again, s, and how near the proof was then.
    pub again: Option<(f64, u8)>,
}

impl fmt::Display for Interruption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.why {
            Some(why) => f.write_str(why)?,
            None => write!(f, "a loss of the navigation at {:.0} s", self.t_s)?,
        }
        match self.again {
            Some((again, proof)) => write!(
                f,
                " cost {:.0} s until it navigated again at {again:.0} s, and its proof went from \
                 {} to {proof} of 100",
                again - self.t_s,
                self.proof
            ),
            None => write!(f, " ended its navigation, with proof {} of 100", self.proof),
        }
    }
}

/// The hypothesis that is nearest to its proof.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Nearest {
    /// Its name.
    pub name: &'static str,
    /// How near, of 100; 100 is proved.
    pub proof: u8,
    /// How much longer it takes at the present pace, s; `None` where it does not come nearer.
    pub takes_s: Option<f64>,
    /// Time over which the pace is known, s.
    pub paced_s: f64,
}

impl Nearest {
    /// The pace, in words.
    #[must_use]
    pub fn pace(&self) -> String {
        match self.takes_s {
            _ if self.paced_s < LEAST_S => "at a pace that is not known yet".into(),
            Some(s) => match (s / 60.0).ceil() {
                m if m <= 1.0 => "about 1 more minute like the last".into(),
                m => format!("about {m:.0} more minutes like the last"),
            },
            None => "and it does not come nearer at present".into(),
        }
    }
}

impl fmt::Display for Nearest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, proof, .. } = self;
        match proof {
            100 => write!(f, "\"{name}\" has proved itself, 100 of 100"),
            _ => write!(
                f,
                "\"{name}\" is the nearest, proof {proof} of 100, {}",
                self.pace()
            ),
        }
    }
}

/// The course of the proofs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proofs {
    /// Interruptions of the navigation.
    pub interruptions: Vec<Interruption>,
    /// The candidates at the end.
    last: Option<Candidates>,
    /// It navigated at the last time.
    navigated: bool,
    /// Times and candidates, since the last interruption and over the length of the pace.
    points: VecDeque<(f64, Candidates)>,
}

impl Proofs {
    /// Notes the learner at `t_s`. `candidates`: `None` where it has none. `why` explains an
    /// interruption that is seen now.
    pub fn note(
        &mut self,
        t_s: f64,
        navigates: bool,
        candidates: Option<Candidates>,
        why: impl FnOnce() -> Option<String>,
    ) {
        match (self.navigated, navigates) {
            (true, false) => {
                self.interruptions.push(Interruption {
                    t_s,
                    why: why(),
                    proof: most(self.last.as_ref()),
                    again: None,
                });
                self.points.clear();
            }
            (false, true) => {
                if let Some(last) = self.interruptions.last_mut() {
                    last.again = Some((t_s, most(candidates.as_ref())));
                }
                self.points.clear();
            }
            _ => {}
        }
        self.navigated = navigates;
        let Some(candidates) = candidates else {
            return;
        };
        self.last = Some(candidates);
        let due = |(at, _): &(f64, Candidates)| t_s - at >= EVERY_S;
        if navigates && self.points.back().is_none_or(due) {
            self.points.push_back((t_s, candidates));
            while self.points.front().is_some_and(|of| t_s - of.0 > PACE_S) {
                self.points.pop_front();
            }
        }
    }

    /// The hypothesis that is nearest to its proof, but not the zero correction; `None` without
    /// candidates.
    #[must_use]
    pub fn nearest(&self) -> Option<Nearest> {
        let each = self.last.iter().flatten().enumerate();
        let (index, nearest) = tried(each).max_by(|(_, a), (_, b)| {
            let capitals = a.capital.total_cmp(&b.capital);
            a.proved.cmp(&b.proved).then(capitals)
        })?;
        let (takes_s, paced_s) = self.pace(index);
        Some(Nearest {
            name: NAMES[index],
            proof: of_100(nearest.capital, nearest.proved),
            takes_s,
            paced_s,
        })
    }

    /// How much longer the proof of a candidate takes at its pace, s, where it comes nearer, and
    /// the time over which the pace is known, s.
    fn pace(&self, candidate: usize) -> (Option<f64>, f64) {
        let (Some(first), Some(last)) = (self.points.front(), self.points.back()) else {
            return (None, 0.0);
        };
        let paced_s = last.0 - first.0;
        let [from, to] = [first, last].map(|(_, each)| {
            let capital = f64::from(each[candidate].capital);
            capital.max(1.0).ln()
        });
        let pace = (to - from) / paced_s;
        let takes_s = (pace > 0.0).then(|| (f64::from(PROVED).ln() - to).max(0.0) / pace);
        (takes_s, paced_s)
    }
}

/// The candidates that take part, without the zero correction.
fn tried<'c>(
    each: impl Iterator<Item = (usize, &'c Candidate)>,
) -> impl Iterator<Item = (usize, &'c Candidate)> {
    each.skip(1).filter(|(_, of)| of.enabled)
}

/// How near the nearest proof is by its capital, of 100.
fn most(of: Option<&Candidates>) -> u8 {
    let each = of.into_iter().flatten().enumerate();
    let capital = tried(each).fold(0.0_f32, |most, (_, of)| most.max(of.capital));
    of_100(capital, false)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Candidate 1 with this capital; the others have none.
    fn one(capital: f32) -> Option<Candidates> {
        let mut each = [Candidate {
            enabled: true,
            proved: false,
            capital: 0.0,
        }; HYPOTHESES];
        each[1].capital = capital;
        Some(each)
    }

    /// A capital that doubles every 30 s reaches the proof in as many half minutes as are missing.
    #[test]
    fn a_steady_pace_gives_the_time_left() {
        let mut proofs = Proofs::default();
        for t in 0..=50 {
            proofs.note(f64::from(t), true, one(2f32.powi(t / 30)), || None);
        }
        let nearest = proofs.nearest().unwrap();
        assert!(nearest.to_string().contains("not known yet"), "{nearest}");
        for t in 51..=120 {
            proofs.note(f64::from(t), true, one(2f32.powi(t / 30)), || None);
        }
        let nearest = proofs.nearest().unwrap();
        let due = (f64::from(PROVED) / 16.0).log2() * 30.0;
        assert_eq!((nearest.name, nearest.paced_s), (NAMES[1], 120.0));
        assert!((nearest.takes_s.unwrap() - due).abs() < 1e-3, "{nearest:?}");
        for t in 121..=500 {
            proofs.note(f64::from(t), true, one(16.0), || None);
        }
        let nearest = proofs.nearest().unwrap();
        assert_eq!((nearest.takes_s, nearest.paced_s), (None, 300.0));
        assert!(nearest.to_string().ends_with("at present"), "{nearest}");
    }

    /// What was there before an interruption counts neither as pace nor as present proof.
    #[test]
    fn an_interruption_has_its_cost() {
        let mut proofs = Proofs::default();
        proofs.note(0.0, false, None, || unreachable!("nothing was there"));
        for t in 1..=100 {
            proofs.note(f64::from(t), true, one(t as f32), || None);
        }
        let before = of_100(100.0, false);
        proofs.note(101.0, false, None, || Some("a gap".into()));
        let [of] = &proofs.interruptions[..] else {
            panic!("{proofs:?}");
        };
        let says = format!("a gap ended its navigation, with proof {before} of 100");
        assert_eq!(of.to_string(), says);
        proofs.note(150.0, true, one(10.0), || None);
        let says = proofs.interruptions[0].to_string();
        let again = of_100(10.0, false);
        let cost = format!(
            "a gap cost 49 s until it navigated again at 150 s, and its proof went from {before} \
             to {again} of 100"
        );
        assert_eq!(says, cost);
        assert_eq!(proofs.nearest().unwrap().paced_s, 0.0);
    }
}
