//! Several cases at once, and cases that end ten minutes before the fixes do.

/// The names of these cases.
pub(super) const NAMES: &[&str] = &[
    "late-0.5+lever-arm-2+coloured",
    "coloured+gaps+noise-3",
    "traffic+coloured+optimistic",
    "holes-unseen+late-0.15+creep",
    "unmeasured+late-0.5+lever-arm-5",
    "sheet-10+optimistic+bias-step",
    "city+spoof-accelerated",
    "train+velocity-lag+jitter-0.3",
    "rate-1+late-0.15",
    "late-0.5:ended",
    "coloured:ended",
    "optimistic:ended",
    "spoof-accelerated:ended",
    "jump:ended",
    "frozen:ended",
    "silent-receiver:ended",
    "other-vehicle:ended",
    "holes-unseen:ended",
    "stuck-gyro:ended",
    "spikes:ended",
];
