//! The steps on the way to a correction: aligned, fixes, proof, stored, in force. Each says how far
//! it is and what it waits for.

use super::proof::Nearest;
use super::watch::Learner;
use firmware::configuration::Activation;
use firmware::control::Mode;
use firmware::wire::command::Progress;
use serde::Serialize;

/// The heading that a navigator begins with is known to this, deg (0.2 rad).
const HEADING_DEG: f64 = 11.459;
/// Share of a step that is not done, at most.
const NEARLY: f64 = 0.95;

/// A step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Its name.
    pub name: &'static str,
    /// How far it is, 0 to 1.
    pub share: f64,
    /// It is done.
    pub done: bool,
    /// How far it is, or what it waits for.
    pub says: String,
}

/// State that the steps depend on and that changes rarely.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settled {
    /// When corrections come into force; `None` without a configuration.
    pub activation: Option<Activation>,
    /// The board can store.
    pub stores: bool,
    /// The configuration in use is the stored one.
    pub stored: bool,
}

/// Time without a good fix that is reported, s.
const WITHOUT_FIX_S: f64 = 5.0;

/// The number of good fixes, and when it last changed, s.
#[derive(Debug, Default)]
pub struct LastFix(Option<(u32, f64)>);

impl LastFix {
    /// Notes the number. Returns the time since the last good fix, s, if it is long.
    pub fn note(&mut self, good: u32, time_s: f64) -> Option<u32> {
        let since = match self.0 {
            Some((before, since)) if before == good => since,
            _ => time_s,
        };
        self.0 = Some((good, since));
        let lasts = time_s - since;
        (good > 0 && lasts >= WITHOUT_FIX_S).then_some(lasts as u32)
    }
}

/// State of the device from which the steps follow.
#[derive(Debug)]
pub struct StepInputs<'a> {
    /// Mode in force.
    pub mode: Mode,
    /// The learner.
    pub learner: &'a Learner,
    /// Its progress; `None` on a board without one.
    pub progress: Option<Progress>,
    /// The hypothesis that is nearest to its proof, with its pace.
    pub nearest: Option<&'a Nearest>,
    /// Good fixes of the receiver since power-on.
    pub good_fixes: u32,
    /// Time since the last of them, s, where it is long.
    pub without_fix_s: Option<u32>,
    /// The sensor sends nothing.
    pub silent: bool,
    /// See [`Settled`].
    pub settled: Settled,
}

impl StepInputs<'_> {
    /// The steps in their order.
    #[must_use]
    pub fn steps(&self) -> Vec<Step> {
        vec![
            self.aligned(),
            self.fixes(),
            self.proof(),
            self.stored(),
            self.in_force(),
        ]
    }

    /// Why nothing is learnt at all, if it is so.
    fn idle(&self) -> Option<&'static str> {
        let learns = matches!(self.mode, Mode::Learn | Mode::Shadow);
        match () {
            () if self.progress.is_none() => Some("this board has no learner"),
            () if self.settled.activation.is_none() => {
                Some("waits for a configuration: host-sim device configure FILE")
            }
            () if !learns && !self.learner.navigates => Some("waits for mode learn or shadow"),
            () => None,
        }
    }

    fn aligned(&self) -> Step {
        let Learner {
            navigates,
            way,
            heading_sigma_deg: sigma,
            ..
        } = self.learner;
        let (share, says) = match (self.idle(), sigma) {
            (Some(why), _) => (0.0, why.to_owned()),
            (None, Some(deg)) if *navigates => {
                (1.0, format!("heading by {way}, known to {deg:.1} deg"))
            }
            (None, None) if *navigates => (1.0, format!("heading by {way}")),
            (None, Some(deg)) => (
                HEADING_DEG / deg.max(HEADING_DEG),
                format!("heading by {way}, known to {deg:.0} deg so far; 11 deg are needed"),
            ),
            (None, None) if self.silent => {
                (0.0, "waits for samples: the sensor is silent".to_owned())
            }
            (None, None) if self.good_fixes == 0 => (
                0.0,
                "waits for the first fix, or a standstill of 100 s".to_owned(),
            ),
            (None, None) => (
                0.0,
                "waits for a standstill of 100 s, or turns and accelerations".to_owned(),
            ),
        };
        step("aligned", share, *navigates, says)
    }

    fn fixes(&self) -> Step {
        let Learner {
            used_fixes: used,
            refused_fixes: refused,
            ..
        } = *self.learner;
        let all = f64::from(used) + f64::from(refused);
        let says = match (used, self.good_fixes) {
            (0, 0) => "waits for a good fix of the receiver".to_owned(),
            (0, came) if refused == 0 => format!("{came} came; used once it is aligned"),
            _ => format!("{used} used, {refused} refused"),
        };
        let says = match self.without_fix_s {
            Some(s) => format!("{says}; none for the last {s} s"),
            None => says,
        };
        let share = if all > 0.0 {
            f64::from(used) / all
        } else {
            0.0
        };
        let done = used > 0 && used >= refused && self.without_fix_s.is_none();
        step("fixes", share, done, says)
    }

    fn proof(&self) -> Step {
        let Some(nearest) = self.nearest else {
            let says = "waits for rehearsals, which begin when it navigates".to_owned();
            return step("proof", 0.0, false, says);
        };
        let Nearest { name, proof, .. } = nearest;
        let says = match proof {
            100 => format!("100 of 100: \"{name}\" has proved itself"),
            _ if !self.learner.navigates => {
                format!("{proof} of 100 (\"{name}\"); waits until it navigates")
            }
            _ if self.without_fix_s.is_some() => {
                format!("{proof} of 100 (\"{name}\"); waits for fixes")
            }
            _ => format!("{proof} of 100 (\"{name}\"), {}", nearest.pace()),
        };
        step("proof", f64::from(*proof) / 100.0, *proof == 100, says)
    }

    /// Whether something has proved itself.
    fn proved(&self) -> bool {
        self.nearest.is_some_and(|of| of.proof == 100)
    }

    fn stored(&self) -> Step {
        let done = self.progress.is_some_and(|of| of.stored);
        let Settled {
            activation,
            stores,
            stored,
        } = self.settled;
        let says = match activation {
            _ if done => "the proved networks are stored",
            Some(Activation::NextPowerOn) | None if !stores => "this board cannot store",
            Some(Activation::NextPowerOn) if !stored => {
                "the configuration is not stored, so nothing is stored beside it: store it"
            }
            Some(Activation::NextPowerOn) if self.proved() && self.mode != Mode::Learn => {
                "waits for mode learn"
            }
            Some(Activation::NextPowerOn) if self.proved() => "waits for the next record",
            Some(Activation::NextPowerOn) | None => "waits for the proof",
            Some(_) => "not a step of this activation: what is proved acts live",
        };
        step("stored", 0.0, done, says.to_owned())
    }

    fn in_force(&self) -> Step {
        let done = self.progress.is_some_and(|of| of.in_force);
        let next = self.progress.is_some_and(|of| of.stored);
        let live = self.settled.activation != Some(Activation::NextPowerOn);
        let says = match self.mode {
            Mode::Learn if done && next => {
                "a correction acts; the proved networks replace it at the next power-on"
            }
            _ if done => "a correction acts now",
            Mode::Bypass => "mode bypass corrects nothing",
            Mode::Shadow => "mode shadow corrects nothing",
            Mode::Frozen => "the networks in use correct nothing",
            Mode::Learn if next => "acts from the next power-on",
            Mode::Learn if live && self.proved() => "waits for an alignment or a standstill",
            Mode::Learn if live => "no correction acts: waits for the proof",
            Mode::Learn => {
                "no correction acts: what is proved and stored acts from the next power-on"
            }
        };
        step("in force", 0.0, done, says.to_owned())
    }
}

fn step(name: &'static str, share: f64, done: bool, says: String) -> Step {
    Step {
        name,
        share: if done { 1.0 } else { share.min(NEARLY) },
        done,
        says,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEARNER: Learner = Learner {
        navigates: false,
        winner: 0,
        used_fixes: 0,
        refused_fixes: 0,
        promotions: 0,
        rollbacks: 0,
        way: "none",
        heading_sigma_deg: None,
        residual: 0.0,
        refused_alignments: 0,
        rests: 0,
        rest_s: 0,
    };
    const SETTLED: Settled = Settled {
        activation: Some(Activation::NextPowerOn),
        stores: true,
        stored: true,
    };

    fn nearest(proof: u8) -> Nearest {
        Nearest {
            name: "biases",
            proof,
            takes_s: Some(330.0),
            paced_s: 100.0,
        }
    }

    /// The steps in words, with those that are done marked.
    fn says(inputs: &StepInputs<'_>) -> Vec<String> {
        let mark = |of: &Step| if of.done { "+" } else { "-" };
        let line = |of: Step| format!("{}{} {:.2}: {}", mark(&of), of.name, of.share, of.says);
        inputs.steps().into_iter().map(line).collect()
    }

    #[test]
    fn the_way_of_a_new_device_to_its_correction() {
        let mut inputs = StepInputs {
            mode: Mode::Learn,
            learner: &LEARNER,
            progress: Some(Progress::default()),
            nearest: None,
            good_fixes: 0,
            without_fix_s: None,
            silent: false,
            settled: SETTLED,
        };
        assert_eq!(
            says(&inputs),
            [
                "-aligned 0.00: waits for the first fix, or a standstill of 100 s",
                "-fixes 0.00: waits for a good fix of the receiver",
                "-proof 0.00: waits for rehearsals, which begin when it navigates",
                "-stored 0.00: waits for the proof",
                "-in force 0.00: no correction acts: what is proved and stored acts from the next \
                 power-on",
            ]
        );
        let aligning = Learner {
            way: "course",
            heading_sigma_deg: Some(45.836),
            ..LEARNER
        };
        (inputs.learner, inputs.good_fixes) = (&aligning, 7);
        let [aligned, fixes, ..] = &says(&inputs)[..] else {
            panic!("five steps");
        };
        assert_eq!(
            aligned,
            "-aligned 0.25: heading by course, known to 46 deg so far; 11 deg are needed"
        );
        assert_eq!(fixes, "-fixes 0.00: 7 came; used once it is aligned");
        let learns = Learner {
            navigates: true,
            used_fixes: 30,
            refused_fixes: 10,
            way: "course",
            heading_sigma_deg: Some(0.44),
            ..LEARNER
        };
        let (near, done) = (nearest(34), nearest(100));
        (inputs.learner, inputs.nearest) = (&learns, Some(&near));
        let [aligned, fixes, proof, ..] = &says(&inputs)[..] else {
            panic!("five steps");
        };
        assert_eq!(
            aligned,
            "+aligned 1.00: heading by course, known to 0.4 deg"
        );
        assert_eq!(fixes, "+fixes 1.00: 30 used, 10 refused");
        assert_eq!(
            proof,
            "-proof 0.34: 34 of 100 (\"biases\"), about 6 more minutes like the last"
        );
        inputs.without_fix_s = Some(20);
        let [_, fixes, proof, ..] = &says(&inputs)[..] else {
            panic!("five steps");
        };
        assert_eq!(
            fixes,
            "-fixes 0.75: 30 used, 10 refused; none for the last 20 s"
        );
        assert_eq!(
            proof,
            "-proof 0.34: 34 of 100 (\"biases\"); waits for fixes"
        );
        inputs.without_fix_s = None;
        inputs.nearest = Some(&done);
        assert!(says(&inputs)[3].ends_with("waits for the next record"));
        inputs.settled.stored = false;
        assert!(says(&inputs)[3].ends_with("beside it: store it"));
        inputs.progress = Some(Progress {
            stored: true,
            ..Progress::default()
        });
        let [.., stored, acts] = &says(&inputs)[..] else {
            panic!("five steps");
        };
        assert_eq!(stored, "+stored 1.00: the proved networks are stored");
        assert_eq!(acts, "-in force 0.00: acts from the next power-on");
        inputs.progress = Some(Progress {
            in_force: true,
            ..Progress::default()
        });
        assert_eq!(says(&inputs)[4], "+in force 1.00: a correction acts now");
    }

    #[test]
    fn fixes_that_stay_away_are_noticed() {
        let mut last = LastFix::default();
        assert_eq!([0.0, 60.0].map(|t| last.note(0, t)), [None; 2]);
        let noted = [61.0, 64.0, 66.0, 90.0].map(|t| last.note(1, t));
        assert_eq!(noted, [None, None, Some(5), Some(29)]);
        assert_eq!(last.note(2, 91.0), None);
    }

    #[test]
    fn what_prevents_learning_is_said() {
        let mut inputs = StepInputs {
            mode: Mode::Bypass,
            learner: &LEARNER,
            progress: Some(Progress::default()),
            nearest: None,
            good_fixes: 3,
            without_fix_s: None,
            silent: false,
            settled: SETTLED,
        };
        assert!(says(&inputs)[0].ends_with("waits for mode learn or shadow"));
        assert!(says(&inputs)[4].ends_with("mode bypass corrects nothing"));
        (inputs.mode, inputs.silent) = (Mode::Learn, true);
        assert!(says(&inputs)[0].ends_with("the sensor is silent"));
        inputs.settled.activation = None;
        assert!(says(&inputs)[0].contains("waits for a configuration"));
        inputs.progress = None;
        assert!(says(&inputs)[0].ends_with("this board has no learner"));
    }
}
