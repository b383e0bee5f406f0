//! The deferred work in parts against the same work done a whole step at a time.

use super::*;
use crate::learn::Settings;
use crate::learn::bank::{Gates, HYPOTHESES};

/// Plain repeatable numbers between -1 and 1.
struct Numbers(u32);

impl Numbers {
    fn next(&mut self, size: f32) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        size * ((self.0 >> 8) as f32 / 8_388_608.0 - 1.0)
    }

    fn block(&mut self) -> Transition<NAV, f32> {
        let mut block: Transition<NAV, f32> = Work::ZEROED.block;
        block.time = 1.0;
        for i in 0..3 {
            for j in 0..3 {
                block.gamma[i][j] = self.next(1.0);
                block.gamma[3 + i][3 + j] = self.next(1.0);
                block.phi[3 + i][j] = self.next(10.0);
            }
            block.phi[6 + i][3 + i] = 1.0;
            block.q[i][i] = 1e-12;
            block.q[3 + i][3 + i] = 1e-6;
        }
        (0..NAV).for_each(|i| block.phi[i][i] = 1.0);
        block
    }
}

fn same(a: &Bank, b: &Bank) {
    assert_eq!(a.leading(), b.leading());
    assert_eq!(a.error_state(), b.error_state());
    for h in 0..HYPOTHESES {
        assert_eq!(a.estimate_of(h), b.estimate_of(h), "{h}");
        assert_eq!(a.evidence(h).to_bits(), b.evidence(h).to_bits(), "{h}");
    }
    assert!(a.hypotheses == b.hypotheses);
}

/// The oracle: all hypotheses through a whole step at a time, in the order of the equations.
impl Bank {
    fn whole_interval(&mut self, block: &Transition<NAV, f32>, applied: &[f32; OUTPUTS]) {
        self.each(|h| {
            h.propagate_mean(block, applied);
            let mut workspace = Workspace::ZEROED;
            (0..COVARIANCE_PARTS).for_each(|k| h.propagate_covariance(k, block, &mut workspace));
        });
    }

    /// Gives the refused observations, one bit each.
    fn whole_fix(&mut self, z: &[f32; OBSERVATIONS], variance: &[f32; OBSERVATIONS]) -> u8 {
        let mut refused = 0;
        for k in 0..OBSERVATIONS {
            let (z, variance) = (z[k], variance[k]);
            if self.accepts(k, z, variance, true) {
                let i = index(k);
                self.each(|h| h.update(i, h.innovation(i, z, variance)));
            } else {
                refused |= 1 << k;
            }
        }
        self.each(|h| h.finish_update());
        self.choose();
        refused
    }

    fn whole_alignment(
        &mut self,
        by: &[[f32; OUTPUTS]; NAV],
        rest: &[[f32; NAV]; NAV],
        applied: &[f32; OUTPUTS],
    ) {
        let unmodelled = self.unmodelled(by, rest);
        for which in 0..HYPOTHESES {
            let rest = match which {
                ZERO_CORRECTION => &unmodelled,
                _ => rest,
            };
            self.some(1 << which, |h| {
                h.align_mean(by, applied);
                let mut workspace = Workspace::ZEROED;
                (0..COVARIANCE_PARTS).for_each(|k| h.align_covariance(k, by, rest, &mut workspace));
            });
        }
    }
}

/// In parts and at once, with outliers and fixes that are no numbers.
#[test]
fn parts_are_the_whole() {
    let sheet = Settings::MEDIUM.sheet;
    let new = || Bank::new(&sheet, 1.0, [1e-2; NAV], Gates::default());
    let (mut whole, mut parted) = (Box::new(new()), Box::new(new()));
    let mut work: Work = Work::ZEROED;
    let mut numbers = Numbers(7);
    for k in 0..60 {
        let block = numbers.block();
        let mut z = [1.0, 1.0, 1.0, 0.1, 0.1, 0.1].map(|size| numbers.next(size));
        let variance = [1.0, 1.0, 1.0, 0.01, 0.01, 0.01];
        let inputs = [0.2, 2.0].map(|size| [0; 3].map(|_| numbers.next(size)));
        match k {
            20 => z[1] = f32::NAN,
            30 => z[4] = 1e6,
            _ => {}
        }
        let applied = [1e-7; OUTPUTS];
        whole.whole_interval(&block, &applied);
        let refused = whole.whole_fix(&z, &variance);
        whole.each(|h| h.step(inputs));

        parted.propagate_mean(&block, &applied);
        work.clear();
        work.interval(&block);
        work.fix(z, variance);
        work.step(inputs);
        let parts = 1 + (0..).take_while(|_| parted.work(&mut work)).count();
        assert_eq!(parts, END);
        assert_eq!(work.refused, refused);
        assert_eq!(refused != 0, k == 20 || k == 30, "{k} {refused}");
        same(&whole, &parted);
    }
    // an alignment, an interval without a fix, and a step without an interval
    let (by, rest) = (numbers.block().gamma, numbers.block().q);
    whole.whole_alignment(&by, &rest, &[1e-7; OUTPUTS]);
    parted.align_means(&by, &[1e-7; OUTPUTS]);
    work.clear();
    (work.scratch().gamma, work.scratch().q) = (by, rest);
    work.alignment();
    while parted.work(&mut work) {}
    same(&whole, &parted);
    let (block, applied) = (numbers.block(), [0.0; OUTPUTS]);
    whole.whole_interval(&block, &applied);
    parted.propagate_mean(&block, &applied);
    work.clear();
    work.interval(&block);
    while parted.work(&mut work) {}
    same(&whole, &parted);
    whole.each(|h| h.step([[0.1; 3]; 2]));
    work.clear();
    work.step([[0.1; 3]; 2]);
    assert_eq!(
        1 + (0..).take_while(|_| parted.work(&mut work)).count(),
        HYPOTHESES
    );
    same(&whole, &parted);
}

/// A hypothesis that is not finite any more counts for nothing, however likely it was.
#[test]
fn what_is_not_healthy_has_no_evidence() {
    let sheet = Settings::MEDIUM.sheet;
    for sick in 0..HYPOTHESES {
        let mut bank = Box::new(Bank::new(&sheet, 1.0, [1e-2; NAV], Gates::default()));
        if !bank.takes_part(sick) {
            continue;
        }
        assert!(bank.score(sick).is_finite(), "{sick}");
        bank.hypotheses.each_of(1 << sick, |h| {
            h.believe(1000.0);
            h.inflate(&[f32::NAN; NAV]);
            h.update(3, h.innovation(3, 0.1, 0.01));
            h.finish_update();
        });
        assert!(!bank.is_healthy(sick), "{sick}");
        assert_eq!(bank.score(sick), f64::NEG_INFINITY, "{sick}");
        bank.choose();
        assert_ne!(bank.leading(), sick.max(1), "{sick}");
    }
}
