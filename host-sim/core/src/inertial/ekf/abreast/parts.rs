//! The parameters of filters side by side, and the features that they share.

use crate::inertial::ekf::{Parameter, Regressor, Triad};

/// A parameter: its axis, and its factor.
pub(super) struct ParameterFactor {
    pub(super) triad: Triad,
    pub(super) axis: usize,
    pub(super) by: By,
}

/// Factor of a parameter.
pub(super) enum By {
    /// A feature, which hardly changes within a second.
    Slow(usize),
    /// The input of its triad along an axis.
    Input(usize),
}

/// Factor of slow parameters, stored once for all that share it.
pub(super) struct Feature {
    pub(super) of: Parameter,
    /// Whether it depends on the time alone, so that it is the same for all filters.
    pub(super) timed: bool,
}

/// The parameters, and the features that they share.
pub(super) fn parts(parameters: &[Parameter]) -> (Vec<ParameterFactor>, Vec<Feature>) {
    let mut features: Vec<Feature> = Vec::new();
    let mut parts = Vec::with_capacity(parameters.len());
    for p in parameters {
        let timed = matches!(
            p.regressor,
            Regressor::One | Regressor::Hours | Regressor::Decay(_)
        );
        let shared = |feature: &Feature| {
            feature.of.regressor == p.regressor && (timed || feature.of.axis == p.axis)
        };
        let by = match p.regressor {
            Regressor::Input(axis) => By::Input(axis),
            _ => By::Slow(features.iter().position(shared).unwrap_or_else(|| {
                features.push(Feature { of: *p, timed });
                features.len() - 1
            })),
        };
        let (triad, axis) = (p.triad, p.axis);
        parts.push(ParameterFactor { triad, axis, by });
    }
    (parts, features)
}

/// The slow parameters of an axis, or one that is not slow.
pub(super) struct Source {
    pub(super) triad: Triad,
    pub(super) axis: usize,
    pub(super) slow: bool,
    /// Indices of the parameters; at least one.
    pub(super) parameters: Vec<usize>,
}

/// The sources with a column of `Psi`: each axis with slow parameters, then each other parameter.
pub(super) fn sources(parts: &[ParameterFactor]) -> Vec<Source> {
    let mut sources: Vec<Source> = Vec::new();
    let slow = |p: &ParameterFactor| matches!(p.by, By::Slow(_));
    for triad in [Triad::Gyro, Triad::Accel] {
        for axis in 0..3 {
            let own = |p: &ParameterFactor| slow(p) && (p.triad, p.axis) == (triad, axis);
            let parameters: Vec<usize> = (0..parts.len()).filter(|&k| own(&parts[k])).collect();
            if !parameters.is_empty() {
                sources.push(Source {
                    triad,
                    axis,
                    slow: true,
                    parameters,
                });
            }
        }
    }
    let others = parts.iter().enumerate().filter(|(_, p)| !slow(p));
    sources.extend(others.map(|(k, p)| Source {
        triad: p.triad,
        axis: p.axis,
        slow: false,
        parameters: vec![k],
    }));
    sources
}
