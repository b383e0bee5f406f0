//! What a fix that is wrong in one component leads to.

use super::*;
use crate::learn::Settings;
use crate::learn::bank::Gates;

const VARIANCE: [f32; OBSERVATIONS] = [1.0, 1.0, 1.0, 0.01, 0.01, 0.01];

/// A second of navigation without motion.
fn second() -> Scratch {
    let mut scratch = Scratch::ZEROED;
    let block = &mut scratch.block;
    block.time = 1.0;
    for i in 0..3 {
        (block.gamma[i][i], block.gamma[3 + i][3 + i]) = (1.0, 1.0);
        block.phi[6 + i][3 + i] = 1.0;
        (block.q[i][i], block.q[3 + i][3 + i]) = (1e-12, 1e-6);
    }
    (0..NAV).for_each(|i| block.phi[i][i] = 1.0);
    scratch
}

/// A component that is an outlier, or no number, is refused, and it alone. One that is not
/// measured is not refused, whatever it is.
#[test]
fn the_wrong_component_is_refused() {
    let sheet = Settings::MEDIUM.sheet;
    let mut bank = Box::new(Bank::new(&sheet, 1.0, [1e-2; NAV], Gates::default()));
    let mut scratch = Box::new(second());
    let mut second = |z: [f32; OBSERVATIONS], variance: [f32; OBSERVATIONS]| {
        bank.propagate_mean(&scratch.block, &Correction::NONE);
        bank.propagate_covariance(&mut scratch);
        let refused = bank.fix(&z, &variance, true);
        bank.step([[0.1; 3]; TRIADS]);
        assert!((0..HYPOTHESES).all(|h| bank.is_healthy(h)));
        refused
    };
    for _ in 0..10 {
        assert_eq!(second([0.1; OBSERVATIONS], VARIANCE), 0);
    }
    for (k, wrong) in [(1, f32::NAN), (4, 1e6), (0, f32::NEG_INFINITY)] {
        let mut z = [0.0; OBSERVATIONS];
        z[k] = wrong;
        assert_eq!(second(z, VARIANCE), 1 << k, "{k}");
        let mut variance = VARIANCE;
        variance[k] = f32::INFINITY;
        assert_eq!(second(z, variance), 0, "{k}");
    }
}

/// A hypothesis whose covariance is not finite has no evidence, however much it had.
#[test]
fn what_is_not_healthy_has_no_evidence() {
    let sheet = Settings::MEDIUM.sheet;
    for sick in 0..HYPOTHESES {
        let mut bank = Box::new(Bank::new(&sheet, 1.0, [1e-2; NAV], Gates::default()));
        if !bank.takes_part(sick) {
            continue;
        }
        bank.hypotheses.each_of(1 << sick, |h| {
            h.believe(1000.0);
            h.inflate(&[f32::NAN; NAV]);
            h.update(3, h.innovation(3, 0.1, 0.01));
            h.finish_update();
        });
        assert!(!bank.is_healthy(sick), "{sick}");
        assert_eq!(bank.score(sick), f64::NEG_INFINITY, "{sick}");
    }
}
