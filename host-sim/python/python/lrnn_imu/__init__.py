"""Tiny recurrent networks that learn the errors of inertial sensors.

The very code of the device and of the desktop program, so with their bits. All units are SI:
angles in rad, rates in rad/s, forces in m/s2, times in s; names say so where they differ. Body
axes are forward-right-down, navigation axes north-east-down.

Arrays come in as views: of the type and shape that the function names, contiguous in C order.
A few numbers may be any sequence, and are rounded to the type that is needed. Arrays go out as
memory that NumPy owns.
"""

from ._native import (
    Allan,
    Compensator,
    Experiment,
    Kalman,
    Learner,
    Learnt,
    Navigator,
    Network,
    Pass,
    Recording,
    Replay,
    Scenario,
    Session,
    Step,
    Unit,
    __version__,
    align,
    allan,
    allan_file,
    free_inertial,
    learn_from_fixes,
    ned,
    read,
    read_csv,
    read_kf_gins,
    replay,
    run_experiment,
    simulate,
)

__all__ = [
    "Allan",
    "Compensator",
    "Experiment",
    "Kalman",
    "Learner",
    "Learnt",
    "Navigator",
    "Network",
    "Pass",
    "Recording",
    "Replay",
    "Scenario",
    "Session",
    "Step",
    "Unit",
    "__version__",
    "align",
    "allan",
    "allan_file",
    "free_inertial",
    "learn_from_fixes",
    "ned",
    "read",
    "read_csv",
    "read_kf_gins",
    "replay",
    "run_experiment",
    "simulate",
]
