//! A memory that fixes have refuted.

use super::*;
use crate::learn::bank::STORED;
use crate::learn::fixes::drive::{Drive, Receiver, Road, mems};

const ERRORS: [[f64; 3]; 2] = [[6e-3, -9e-3, 4e-3], [0.1, -0.06, 0.08]];

/// It is on trial, and a drive that shows it right ends that.
#[test]
fn a_refuted_memory_that_is_right_is_refuted_no_longer() {
    for refuted in [false, true] {
        let mut memory = memory();
        let mut drive = Drive::new(&mut memory, mems(), Road::TOWN, Receiver::GOOD, ERRORS, 4);
        drive.seconds(300);
        drive.learner.next_drive();
        assert!(!drive.learner.remembered.before.head.refuted);
        drive.learner.remembered.before.head.refuted = refuted;
        drive.begin_unaligned();
        assert_eq!(drive.learner.bank().takes_part(STORED), refuted);
        drive.seconds(300);
        assert!(drive.learner.report().navigates);
        let on_trial = drive.learner.bank().estimate_of(STORED).map(f64::from);
        if refuted {
            let right = ERRORS.as_flattened().iter().zip(on_trial);
            for ((error, is), sheet) in right.zip([8.7e-3, 8.7e-3, 8.7e-3, 0.1, 0.1, 0.1]) {
                assert!((error - is).abs() < 0.3 * sheet, "{on_trial:?}");
            }
        }
        assert!(drive.learner.remember() > 0);
        assert!(!drive.learner.remembered.unit.head.refuted);
    }
}
