//! The memory table of the README.

use core::mem::size_of;

use lrnn_nostd::learn::{GaussNewton, Guarded, Learner, Paper, UdCovariance, Window};
use lrnn_nostd::{Net, Normalisation, Sensitivities, State, Weights};

#[test]
fn sizes_are_those_of_the_readme() {
    let sizes = [
        ("Weights", size_of::<Weights>(), 252),
        ("Normalisation", size_of::<Normalisation>(), 36),
        ("Net", size_of::<Net>(), 288),
        ("State", size_of::<State>(), 36),
        ("Sensitivities", size_of::<Sensitivities>(), 1512),
        ("learn::Window", size_of::<Window>(), 768),
        ("learn::Learner<Paper>", size_of::<Learner<Paper>>(), 3628),
        (
            "learn::Learner<Guarded>",
            size_of::<Learner<Guarded>>(),
            3644,
        ),
        (
            "learn::Learner<GaussNewton>",
            size_of::<Learner<GaussNewton>>(),
            20028,
        ),
        (
            "learn::UdCovariance<63, 1953>",
            size_of::<UdCovariance<63, 1953>>(),
            8064,
        ),
        (
            "learn::UdCovariance<45, 990>",
            size_of::<UdCovariance<45, 990>>(),
            4140,
        ),
    ];
    let readme = include_str!("../README.md");
    for (name, actual, stated) in sizes {
        assert_eq!(actual, stated, "{name}");
        let line = format!("| `{name}` | {stated} |");
        assert!(readme.contains(&line), "README lacks: {line}");
    }
}
