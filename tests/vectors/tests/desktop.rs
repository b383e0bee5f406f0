//! The desktop's half of "host equals target, bit for bit"; the other half is the board image in
//! QEMU.

use lrnn_nostd::Rational;
use lrnn_nostd::learn::{Pass, Rule};
use vectors::work::{LearnWork, NetworkWork, Portable, plausible};
use vectors::{CHECKS, INPUTS, compare, generate, learners};

#[test]
fn desktop_digests_equal_the_committed_constants() {
    let mut text = String::new();
    assert!(
        compare(&CHECKS, &mut text),
        "after an intended change of the arithmetic: cargo xtask vectors\n{text}"
    );
}

/// On the desktop the kernel is the portable network; on the target the same digest comes out of
/// the assembly.
#[test]
fn the_kernel_is_the_portable_network() {
    use vectors::kernel::{digest_m4, digest_m7, digest_portable};
    assert_eq!(digest_portable(4), digest_m4());
    assert_eq!(digest_portable(7), digest_m7());
}

/// Its networks and inputs cause every fault, and good steps too.
#[test]
fn the_kernel_meets_every_fault() {
    use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
    static MET: [AtomicU32; 4] = [const { AtomicU32::new(0) }; 4];
    vectors::kernel::digest(
        4,
        |net, state, input| net.step(state, input),
        |net, state, sens, input| net.step_gradient(state, sens, input),
        |net, state, sens, input, target, rate| {
            let step = net.step_descend(state, sens, input, target, rate);
            let index = step.fault.map_or(0, |fault| 1 + fault as usize);
            MET[index].fetch_add(1, Relaxed);
            step
        },
    );
    let met = MET.each_ref().map(|count| count.load(Relaxed));
    println!("good, input, overflow, sensitivities: {met:?}");
    assert!(met.iter().all(|&count| count > 5), "{met:?}");
}

#[test]
fn a_wrong_constant_is_found() {
    for wrong in 0..CHECKS.len() {
        let mut checks = CHECKS;
        checks[wrong].expected ^= 1;
        let mut text = String::new();
        assert!(!compare(&checks, &mut text));
        assert!(
            text.lines()
                .nth(wrong)
                .expect("one line a check")
                .ends_with("DIFFERENT"),
            "{text}"
        );
    }
}

#[test]
fn committed_vectors_are_the_generated_ones() {
    assert_eq!(INPUTS.len(), generate::VECTORS);
    for (index, &committed) in INPUTS.iter().enumerate() {
        assert_eq!(
            committed,
            generate::vector(index),
            "vector {index}; cargo xtask vectors"
        );
    }
}

#[test]
fn vectors_cover_the_range() {
    let numbers = || {
        INPUTS
            .as_flattened()
            .iter()
            .map(|&bits| f32::from_bits(bits))
    };
    let rates = || numbers().filter(|rate| rate.abs() < 10.0);
    let greatest = rates().fold(0.0, f32::max);
    let least = rates().fold(0.0, f32::min);
    assert!(
        (1.8..2.1).contains(&greatest) && (-2.1..-1.8).contains(&least),
        "{least} to {greatest} rad/s"
    );
    assert_eq!(numbers().filter(|rate| !rate.is_finite()).count(), 4);
}

#[test]
fn each_check_computes_something_else() {
    let mut expected = CHECKS.map(|check| check.expected);
    expected.sort_unstable();
    assert!(
        expected.windows(2).all(|pair| pair[0] != pair[1]),
        "{expected:x?}"
    );
}

#[test]
fn learners_learn_on_the_vectors() {
    assert_learns(learners::paper());
    assert_learns(learners::guarded());
    assert_learns(learners::gauss_newton::<Rational>());
}

/// The digest would prove little if all passes were void or rejected.
fn assert_learns(rule: impl Rule<f32>) {
    let mut passes = Vec::new();
    learners::teach::<Rational, _>(rule, &mut |pass, _| passes.push(pass));
    assert!(
        passes
            .iter()
            .all(|pass| pass.faults == 4 && pass.windows > 40),
        "{passes:?}"
    );
    // A guarded rule may reject its last passes; one accepted pass must be better than the start.
    let better = |pass: &&Pass| pass.accepted && pass.cost < 0.99 * passes[0].cost;
    assert!(
        passes[0].accepted && passes[1..].iter().any(|pass| better(&pass)),
        "{passes:?}"
    );
}

#[test]
fn measured_work_stays_good_however_often_it_is_repeated() {
    let (mut step, mut gradient, mut learn) = (
        NetworkWork::<Portable<Rational>>::new(),
        NetworkWork::<Portable<Rational>>::new(),
        LearnWork::<Rational>::new(),
    );
    for repetition in 0..200_000 {
        let input = plausible(repetition);
        assert!(
            step.step(input).1 && gradient.gradient(input).1 && learn.run(input).1,
            "repetition {repetition}"
        );
    }
    assert!(
        !step.step([f32::NAN; 3]).1
            && !gradient.gradient([f32::NAN; 3]).1
            && !learn.run([f32::NAN; 3]).1
    );
}
