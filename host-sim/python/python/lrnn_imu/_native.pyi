from os import PathLike
from typing import Any, Sequence, Union, final

import numpy as np
from numpy.typing import NDArray

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]
_I32 = NDArray[np.int32]
_Path = Union[str, PathLike[str]]
_Few = Union[Sequence[float], _F32, _F64]

__version__: str
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

@final
class Step:
    """The result of one step of a network."""

    @property
    def output(self) -> _F32:
        """Output y_3 of the network, (3,), in network units."""
    @property
    def error(self) -> _F32:
        """Estimated sensor error, (3,), in units of output_scale: corrected = measured - error."""
    @property
    def fault(self) -> str | None:
        """None, "non-finite input" or "overflow" (the last output is repeated), or "sensitivity
        overflow" (the step is good)."""

@final
class Network:
    """A locally recurrent network: three inputs, three layers of three neurons, 63 weights.

    weights: (63,), for each layer W row by row, R row by row, b; by default 0.
    activation: of the hidden layers, "rational" (the device's), "tanh" or "cubic".
    feedback: "full" or "diagonal" (each neuron to itself).
    input_offset, input_scale, output_scale: (3,); u = (input - offset) * scale, and
    error = output * output_scale. It has a state, so one object belongs to one run.
    """

    def __new__(
        cls,
        weights: _Few | None = None,
        *,
        activation: str = "rational",
        feedback: str = "full",
        input_offset: _Few | None = None,
        input_scale: _Few | None = None,
        output_scale: _Few | None = None,
    ) -> Network: ...
    @staticmethod
    def from_bytes(image: bytes) -> Network:
        """The network of a weight image, as devices send and store it."""
    def to_bytes(self) -> bytes:
        """The weight image, as devices send and store it."""
    weights: _F32
    """The weights, (63,): a copy. Assign to change them; the state stays."""
    @property
    def activation(self) -> str:
        """Name of the activation of the hidden layers."""
    @property
    def feedback(self) -> str:
        """Name of the kind of feedback."""
    @property
    def input_offset(self) -> _F32:
        """Subtracted from the input, (3,)."""
    @property
    def input_scale(self) -> _F32:
        """Network units per unit of the input, (3,)."""
    @property
    def output_scale(self) -> _F32:
        """Units of the error per network unit, (3,)."""
    @property
    def state(self) -> _F32:
        """Outputs of the three layers in the last step, (3, 3)."""
    @property
    def sensitivities(self) -> _F32:
        """Exact dy_3/dweights of the last step with gradient, (3, 63), through all steps."""
    @property
    def faults(self) -> int:
        """Number of steps with a fault since the start or reset()."""
    def reset(self) -> None:
        """State and sensitivities as before the first step; the weights stay."""
    def copy(self) -> Network:
        """A network with the same weights and state."""
    def step(self, input: _Few) -> Step:
        """One step. input: (3,), in physical units (rad/s or m/s2)."""
    def step_gradient(self, input: _Few) -> Step:
        """One step, and the exact sensitivities. input: (3,)."""
    def step_descend(self, input: _Few, target: _Few, rate: float) -> Step:
        """One step, and a descent along the exact gradient.

        target: (3,), in network units. rate: step size for 1/2 |y_3 - target|^2.
        """
    def run(self, inputs: _F32) -> _F32:
        """Steps over all inputs, (n, 3). Gives the estimated errors, (n, 3)."""
    def descend(self, inputs: _F32, targets: _F32, rate: float) -> _F32:
        """step_descend over all inputs, (n, 3), and targets, (n, 3). Gives the outputs, (n, 3)."""

@final
class Pass:
    """The result of a pass of a learner."""

    @property
    def cost(self) -> float:
        """1/2 sum weight r^2 of the weights that this pass was made with; (network units s)^2 where
        all weights are 1."""
    @property
    def accepted(self) -> bool:
        """Whether the rule took these weights as its new starting point."""
    @property
    def windows(self) -> int:
        """Number of windows closed by a reference."""
    @property
    def faults(self) -> int:
        """Number of steps with a fault."""

@final
class Learner:
    """Learns the weights of a copy of a network in passes over a batch, by the exact gradient.

    rule: "paper" (equations 7 to 13 as printed), "guarded" (a pass that raises the cost is
    undone) or "gauss-newton".
    steps: of paper and guarded, one number or (feedback, feed-forward, bias); default 0.01.
    eps: of paper, likewise; default 0.1.
    ridge: of gauss-newton, one number or (63,); default 0.001. prior: (63,), what the ridge
    holds the weights to; default: those of the network.
    """

    def __new__(
        cls,
        network: Network,
        rule: str = "gauss-newton",
        *,
        steps: float | _Few | None = None,
        eps: float | _Few | None = None,
        ridge: float | _Few | None = None,
        prior: _Few | None = None,
    ) -> Learner: ...
    @property
    def rule(self) -> str:
        """Name of the rule."""
    def begin_pass(self) -> None:
        """Begins a pass: state, sensitivities and sums are 0."""
    def step(self, input: _Few, dt: float) -> bool:
        """One step; input: (3,), dt: s for which its output applies. False: it had a fault."""
    def reference(self, sum: _Few, weight: float = 1.0) -> None:
        """Closes a window. sum: (3,), the true error summed over it, in its unit times s."""
    def skip(self) -> None:
        """Drops the window since the last reference."""
    def end_pass(self) -> Pass:
        """Ends the pass; the next one runs with new weights."""
    def run_pass(
        self,
        inputs: _F32,
        sums: _F32,
        *,
        dt: float,
        window: int,
        weights: _F32 | None = None,
    ) -> Pass:
        """A whole pass. inputs: (n, 3); a reference after each window of so many inputs.

        sums: (n // window, 3), as of reference(). weights: (n // window,), by default 1.
        A window with a fault is dropped.
        """
    @property
    def proposal(self) -> _F32:
        """The weights learnt so far, (63,)."""
    @property
    def candidate(self) -> _F32:
        """The weights of the running or next pass, (63,)."""

@final
class Unit:
    """A sensor and its surroundings: the unit file.

    name: a preset, or a file (it ends in .toml or has a path separator).
    """

    def __new__(cls, name: _Path = ...) -> Unit: ...
    @staticmethod
    def parse(text: str) -> Unit:
        """The unit of a text in the form of a unit file. The error lists all that is wrong."""
    @staticmethod
    def presets() -> list[str]:
        """Names of the presets."""
    @staticmethod
    def preset_text(name: str) -> str:
        """Text of a preset, with its comments: where to start a file of one's own."""
    @staticmethod
    def schema() -> dict[str, Any]:
        """JSON Schema of the unit file."""
    @property
    def name(self) -> str:
        """Name of the unit."""
    @property
    def warnings(self) -> list[str]:
        """Values that can be used but are implausible, one sentence each."""
    def to_text(self) -> str:
        """Text of a unit file."""
    def to_dict(self) -> dict[str, Any]:
        """All values, by the keys of the unit file."""

@final
class Compensator:
    """The firmware's compensator: counts in, corrected counts out.

    gyro, accel: the two networks, of the device's kind. Lengths of a count in rad and m/s.
    block_samples: samples between steps of the networks. Limits: largest correction.
    """

    def __new__(
        cls,
        gyro: Network,
        accel: Network,
        *,
        gyro_lsb_rad: float,
        accel_lsb_mps: float,
        sample_period_s: float,
        block_samples: int,
        gyro_limit_radps: float,
        accel_limit_mps2: float,
    ) -> Compensator: ...
    def run(
        self, dtheta: _I32, dv: _I32, temperature: _F64 | None = None
    ) -> tuple[_I32, _I32, _F32]:
        """Corrects counts, (n, 3) each.

        temperature: readings of three thermometers, (blocks, 3), degrees C, a row for each block
        that begins in this call, for networks that temperature drives.

        Gives corrected counts, (n, 3) each, and the estimates at the end of each block,
        (blocks, 2, 3): rad/s and m/s2. The next call goes on where this one ended.
        """
    def read_temperature(self, celsius: float) -> None:
        """A reading of the sensor's thermometer, degrees C, in the block in progress."""
    def power_on(self) -> None:
        """State as at power-on."""
    @property
    def estimate(self) -> _F32:
        """The correction in force, (2, 3): rad/s and m/s2."""
    @property
    def block_samples(self) -> int:
        """Samples in a block."""
    @property
    def faults(self) -> int:
        """Blocks in which a network had a fault."""
    @property
    def clipped(self) -> int:
        """Blocks in which a correction was clipped."""

@final
class Scenario:
    """A simulated scenario: a built-in one or a file.

    changes: keys and values of a scenario file, as in
    Scenario("mems", network={"rule": "guarded"}, learn={"drive_s": 900}).
    """

    def __new__(cls, name: str = "medium", **changes: Any) -> Scenario: ...
    @staticmethod
    def parse(text: str) -> Scenario:
        """The scenario of a text in the form of a scenario file."""
    @staticmethod
    def names() -> list[str]:
        """Names of the built-in scenarios."""
    @property
    def name(self) -> str:
        """Name of the scenario."""
    @property
    def unit(self) -> Unit:
        """The unit that is simulated."""
    @property
    def network(self) -> dict[str, Any]:
        """How the networks are taught."""

@final
class Session:
    """One turn-on of one IMU: samples, fixes, truth. Epoch k is k seconds after power-on."""

    @property
    def dt(self) -> float:
        """Sample period, s."""
    @property
    def standstill_s(self) -> int:
        """Seconds at the start during which the vehicle stands."""
    @property
    def gyro_lsb_rad(self) -> float:
        """Angle of a count, rad."""
    @property
    def accel_lsb_mps(self) -> float:
        """Velocity of a count, m/s."""
    @property
    def unit(self) -> Unit:
        """The unit that measured."""
    @property
    def time(self) -> _F64:
        """End of each sample, (n,), s."""
    @property
    def dtheta(self) -> _F64:
        """Angle increments, (n, 3), rad, body axes."""
    @property
    def dv(self) -> _F64:
        """Velocity increments, (n, 3), m/s, body axes."""
    @property
    def dtheta_counts(self) -> _I32:
        """Angle increments, (n, 3), counts."""
    @property
    def dv_counts(self) -> _I32:
        """Velocity increments, (n, 3), counts."""
    @property
    def epoch_time(self) -> _F64:
        """Times of the epochs, (k,), s."""
    @property
    def position(self) -> _F64:
        """True latitude, longitude, height of the epochs, (k, 3): rad, rad, m."""
    @property
    def velocity(self) -> _F64:
        """True velocity of the epochs, (k, 3), m/s, north-east-down."""
    @property
    def q_bn(self) -> _F64:
        """True attitude of the epochs, (k, 4): quaternion w, x, y, z from body to navigation."""
    @property
    def gyro_error(self) -> _F64 | None:
        """True systematic error of the gyros in each second, (s, 3), rad/s."""
    @property
    def accel_error(self) -> _F64 | None:
        """True systematic error of the accelerometers in each second, (s, 3), m/s2."""
    @property
    def temperature(self) -> _F64 | None:
        """Readings of the thermometers of the axes in each second, (s, 3), degrees C."""
    @property
    def fix_time(self) -> _F64:
        """Times of validity of the fixes, (m,), s."""
    @property
    def fix_position(self) -> _F64:
        """Latitude, longitude, height of the fixes, (m, 3): rad, rad, m."""
    @property
    def fix_velocity(self) -> _F64:
        """Velocity of the fixes, (m, 3), m/s, north-east-down."""
    @property
    def fix_sigma(self) -> _F64:
        """Standard deviations of position, m, and velocity, m/s, (m, 6); inf: not measured."""
    def write(self, directory: _Path) -> None:
        """Writes the files that `host-sim simulate` writes, with the same bytes."""
    def fit(self, scenario: Scenario | None = None, *, unit: Unit | _Path | None = None) -> Learnt:
        """Networks of the desktop (`rnn`), learnt from the fixes of the whole session.

        scenario: how they are taught. unit: what is assumed of the sensor.
        """
    def __len__(self) -> int: ...

@final
class Learnt:
    """Networks that were learnt from a session."""

    @property
    def gyro(self) -> Network:
        """The gyro network: rates in rad/s to rate errors."""
    @property
    def accel(self) -> Network:
        """The accelerometer network: specific forces in m/s2 to their errors."""
    @property
    def running(self) -> str:
        """Name of the hypothesis that has proved itself; of a fit: networks, gyro network,
        accelerometer network or zero correction."""
    def compensator(self, session: Session) -> Compensator:
        """The firmware's compensator with these networks, for the stream of a session."""
    @property
    def evidence(self) -> list[tuple[str, float]]:
        """Log-likelihood of each hypothesis, relative to that of the zero correction."""
    @property
    def note(self) -> str:
        """The verdict of the test on data that was not learnt from, or what the device did and waits
        for."""

@final
class Experiment:
    """The results of a run of the paper's experiment."""

    @property
    def json(self) -> str:
        """The results as `host-sim run --json` writes them."""
    @property
    def rows(self) -> list[dict[str, Any]]:
        """Rows of the table: t_s, scheme, errors in m and m/s."""
    @property
    def schemes(self) -> list[str]:
        """Names of the schemes."""
    def horizontal(self, scheme: str, minutes: int) -> float:
        """Horizontal error of a scheme, m, after 5, 10, 15, 20 or 22 minutes without fixes."""
    @property
    def verdict(self) -> list[str]:
        """Conclusions from the table, in sentences; harm included."""
    @property
    def notes(self) -> list[str]:
        """Notes for the reader, in sentences."""
    @property
    def set_up(self) -> list[tuple[str, str]]:
        """Description of the run, as pairs of a label and a value."""
    def curves(self) -> dict[str, Any]:
        """Curves: track, error_over_time, learning (each by name x and y), and traces."""

@final
class Recording:
    """Samples and fixes as their files hold them, or from arrays.

    time: (n,), s. gyro, accel: (n, 3), body axes; kind "rate": rad/s and m/s2, kind
    "increment": rad and m/s over the time up to theirs. fix_time: (m,), s, on the same clock.
    fix_position: (m, 3), rad, rad, m. fix_sigma: (m, 6), of position, m, and velocity, m/s;
    inf: not measured. fix_velocity: (m, 3), m/s, north-east-down.
    standstill_s: seconds for which the vehicle stands at the first fix, 90 or more; or
    attitude_deg: roll, pitch, heading at the first fix. Without both it is found in motion.
    lever_arm_m: from the IMU to the antenna, (3,), forward, right, down.
    """

    def __new__(
        cls,
        time: _F64,
        gyro: _F64,
        accel: _F64,
        *,
        kind: str,
        fix_time: _F64,
        fix_position: _F64,
        fix_sigma: _F64,
        fix_velocity: _F64 | None = None,
        standstill_s: int | None = None,
        attitude_deg: _Few | None = None,
        lever_arm_m: _Few | None = None,
    ) -> Recording: ...
    @property
    def rate_hz(self) -> int:
        """Samples per second, to the nearest whole number."""
    @property
    def kind(self) -> str:
        """Kind of the samples: "rate" or "increment"."""
    @property
    def time(self) -> _F64:
        """Times of the samples, (n,), s."""
    @property
    def gyro(self) -> _F64:
        """Gyro samples, (n, 3), rad/s or rad, body axes."""
    @property
    def accel(self) -> _F64:
        """Accelerometer samples, (n, 3), m/s2 or m/s, body axes."""
    @property
    def fix_time(self) -> _F64:
        """Times of validity of the fixes, (m,), s, on the clock of the IMU."""
    @property
    def fix_position(self) -> _F64:
        """Latitude, longitude, height of the fixes, (m, 3): rad, rad, m."""
    @property
    def fix_velocity(self) -> _F64:
        """Velocity of the fixes, (m, 3), m/s, north-east-down."""
    @property
    def fix_sigma(self) -> _F64:
        """Standard deviations of position, m, and velocity, m/s, (m, 6); inf: not measured."""
    def write(self, directory: _Path) -> None:
        """Writes imu.csv, gnss.csv and the header.toml that describes them."""
    def __len__(self) -> int: ...

@final
class Replay:
    """Result of a replay: learnt from one part of a recording, judged on another."""

    @property
    def json(self) -> str:
        """The results as `host-sim replay --json` writes them."""
    @property
    def rows(self) -> list[dict[str, Any]]:
        """Rows of the table: t_s, scheme, errors in m and m/s."""
    @property
    def case(self) -> str:
        """The part that was learnt from and the part that was judged."""
    @property
    def schemes(self) -> list[str]:
        """Names of the schemes."""
    def horizontal(self, scheme: str, seconds: int) -> float:
        """Horizontal error of a scheme, m, so many seconds into navigation without fixes."""
    @property
    def verdict(self) -> list[str]:
        """Conclusions from the table, in sentences; harm included."""
    @property
    def notes(self) -> list[str]:
        """Notes for the reader, in sentences."""
    @property
    def warnings(self) -> list[str]:
        """Contradictions between the samples and their description, with remedies."""
    def curves(self) -> dict[str, Any]:
        """Curves: track, error_over_time, learning (each by name x and y), and traces."""

@final
class Navigator:
    """A strapdown navigator on the WGS-84 ellipsoid, in double precision.

    position: latitude, longitude, height: rad, rad, m. velocity: (3,), m/s, north-east-down.
    q_bn: quaternion w, x, y, z from body to navigation axes.
    samples: 1, 2 or 3 increments for coning and sculling.
    """

    def __new__(
        cls, position: _Few, velocity: _Few, q_bn: _Few, *, samples: int = 3
    ) -> Navigator: ...
    def run(
        self, dtheta: _F64, dv: _F64, dt: float, *, every: int = 1
    ) -> tuple[_F64, _F64, _F64]:
        """Navigates over increments, (n, 3) each, rad and m/s, of dt seconds.

        Gives positions, (k, 3), velocities, (k, 3), and attitudes, (k, 4), after each
        `every` samples. The next call goes on where this one ended.
        """
    def damp_height(self, height: float, dt: float = 1.0, *, time_s: float = 30.0) -> None:
        """Damps the vertical channel by a barometric height, m, dt seconds after the last one."""
    @property
    def position(self) -> _F64:
        """Latitude, longitude, height: rad, rad, m."""
    @property
    def velocity(self) -> _F64:
        """Velocity, (3,), m/s, north-east-down."""
    @property
    def q_bn(self) -> _F64:
        """Attitude: quaternion w, x, y, z from body to navigation axes."""
    @property
    def near_pole(self) -> bool:
        """Whether it has come too near to a pole; then its solution must not be used."""

@final
class Kalman:
    """The classical filter: a navigator aided by fixes, which estimates errors of the sensors.

    position, velocity, q_bn: as of Navigator. unit: what is assumed of the sensors. errors:
    "none", "biases" (6), "scale" (12: with scale factors) or "matrices" (24: with
    misalignments, too). sigma: of tilt and heading, rad, velocity, m/s, and position, m.
    walk_per_hour: of the biases, as a share of their prior; default: what the unit says.
    """

    def __new__(
        cls,
        position: _Few,
        velocity: _Few,
        q_bn: _Few,
        unit: Unit | _Path,
        *,
        errors: str = "matrices",
        sigma: _Few,
        walk_per_hour: float | None = None,
        samples: int = 3,
    ) -> Kalman: ...
    @property
    def epoch(self) -> int:
        """Epoch of the session that it has reached: whole seconds since power-on."""
    @staticmethod
    def aligned(
        session: Session,
        *,
        errors: str = "matrices",
        unit: Unit | _Path | None = None,
        walk_per_hour: float | None = None,
    ) -> Kalman:
        """A filter that has aligned itself on the standstill of a session, with the correlations
        between attitude and biases that this gives. `epoch` says where it stands then.
        """
    def run(self, dtheta: _F64, dv: _F64, dt: float) -> None:
        """Navigates over increments, (n, 3) each, rad and m/s, of dt seconds, less the errors that
        are estimated.
        """
    def fix(self, position: _Few, velocity: _Few, sigma: _Few) -> float:
        """Takes a fix that is valid now, at the IMU. position: rad, rad, m; velocity: (3,), m/s,
        north-east-down. sigma: (6,), of position, m, and velocity, m/s; inf: not measured.

        Gives the logarithm of the probability density of the fix, given all before it.
        """
    def aid(self, session: Session, until: int | None = None) -> float:
        """Goes on through the samples and fixes of a session up to an epoch; default: its end. While
        the vehicle is known to stand its velocity counts as measured. Gives the logarithm of the
        probability density of all these fixes, each before it was learnt from.
        """
    def free_inertial(self, session: Session) -> tuple[_F64, _F64]:
        """Navigates without fixes from here to the end of a session, less the errors as they are
        estimated now. This filter stays as it is.

        Gives the errors of position, m, and velocity, m/s, north-east-down, (k, 3) each, one a
        second from here on.
        """
    @property
    def names(self) -> list[str]:
        """Names of the estimated errors."""
    @property
    def estimate(self) -> _F64:
        """Estimated errors of the sensors, (n,): biases in rad/s and m/s2, scale factors as
        fractions, misalignments in rad.
        """
    @property
    def sigma(self) -> _F64:
        """Their standard deviations, (n,)."""
    @property
    def covariance(self) -> _F64:
        """Covariance of attitude, rad, velocity, m/s, position, m (north-east-down each), and the
        estimated errors, (9 + n, 9 + n).
        """
    @property
    def position(self) -> _F64:
        """Latitude, longitude, height: rad, rad, m."""
    @property
    def velocity(self) -> _F64:
        """Velocity, (3,), m/s, north-east-down."""
    @property
    def q_bn(self) -> _F64:
        """Attitude: quaternion w, x, y, z from body to navigation axes."""

@final
class Allan:
    """Allan deviation of one axis, with intervals of 95 % and fitted noises (IEEE 952)."""

    @property
    def name(self) -> str:
        """Name of the axis."""
    @property
    def unit(self) -> str:
        """Unit of the deviations: deg/h or ug."""
    @property
    def rate_hz(self) -> float:
        """Samples per second."""
    @property
    def duration_s(self) -> float:
        """Length, s."""
    @property
    def misfit(self) -> float:
        """How far the curve departs from the sum of the noises; 0.1 is 10 %."""
    @property
    def outliers(self) -> int:
        """Number of single samples far from their neighbours; up to one in a thousand are left out."""
    @property
    def fitted_from_s(self) -> float:
        """Shortest averaging time that is fitted, s."""
    @property
    def tau(self) -> _F64:
        """Averaging times, (k,), s."""
    @property
    def deviation(self) -> _F64:
        """Allan deviations, (k,)."""
    @property
    def low(self) -> _F64:
        """Lower ends of their intervals, (k,)."""
    @property
    def high(self) -> _F64:
        """Upper ends of their intervals, (k,)."""
    @property
    def edf(self) -> _F64:
        """Equivalent degrees of freedom, (k,)."""
    @property
    def fitted(self) -> _F64:
        """Allan deviations of the sum of the fitted noises, (k,)."""
    @property
    def coefficients(self) -> dict[str, dict[str, Any]]:
        """Q, N, B, K, R: name, unit, value, low, high, seen (the interval excludes 0)."""

def align(
    dtheta: _F64, dv: _F64, dt: float, position: _Few, *, samples: int = 3
) -> _F64:
    """Attitude at the end of a standstill: quaternion w, x, y, z from body to navigation axes.

    dtheta, dv: (n, 3), rad and m/s, of dt seconds each. position: rad, rad, m.
    """

def free_inertial(
    session: Session, dtheta: _F64 | None = None, dv: _F64 | None = None
) -> tuple[_F64, _F64]:
    """Self-alignment on the standstill, then navigation without fixes to the end.

    dtheta, dv: corrected samples, (n, 3); by default those of the session.
    Gives the errors of position, m, and velocity, m/s, north-east-down, (k, 3) each, one a
    second from the end of the standstill on.
    """

def ned(position: _F64, origin: _Few | _F64) -> _F64:
    """Metres north, east, down of positions, (n, 3), from an origin, (3,), or from (n, 3)."""

def simulate(
    scenario: Scenario | _Path = ...,
    seed: int = 1,
    *,
    unit: Unit | _Path | None = None,
    vehicle: str | None = None,
    learning: bool = False,
) -> Session:
    """A simulated drive, as `host-sim simulate` makes it.

    vehicle: road, city, traffic, train, ship, aircraft, hand-held or standing.
    learning: the drive to learn from instead of the one to judge on.
    """

def run_experiment(
    scenario: Scenario | _Path = ...,
    seed: int = 1,
    *,
    unit: Unit | _Path | None = None,
    in_sample: bool = False,
) -> Experiment:
    """The paper's experiment: learn on one drive, navigate without fixes on another.

    in_sample: judge on the drive that was learnt from, as the paper did.
    """

def learn_from_fixes(session: Session, *, unit: Unit | _Path | None = None) -> Learnt:
    """The device, the firmware's own application, on a session and its fixes: from power-on to
    power-off. The networks are those that act from the next power-on on."""

def read(path: _Path, second: _Path | None = None, **options: Any) -> Recording:
    """Reads a recording of any form that `host-sim replay` takes, and recognises the form as
    `host-sim report` does: an MCAP file or the folder of a bag, a ULog, a UBX or NovAtel log, the
    folder of an EuRoC recording, the header.toml of CSV files or its folder, and IMU and fixes of
    KF-GINS as path and second.

    options: what the file does not contain, by the names of the options of `host-sim replay FORM`
    with `_` for `-`, such as standstill_s=120, mounting="y x -z", imu_topic="/imu". True: an
    option without a value; a list: values that the program takes with commas.
    """

def read_csv(
    header: _Path, files: Sequence[_Path] = ..., *, truth: _Path | None = None
) -> Recording:
    """Reads CSV files, plain or gzipped, with a TOML header that says what the columns mean."""

def read_kf_gins(
    imu: _Path, gnss: _Path, *, standstill_s: int | None = None, attitude_deg: _Few | None = None
) -> Recording:
    """Reads the text form of KF-GINS."""

def replay(
    recording: Recording,
    unit: Unit | _Path | None = None,
    *,
    learn_s: int | None = None,
    estimate_time_offset: bool = False,
    attitude_sigma_deg: tuple[float, float] = ...,
    own_start: bool = ...,
) -> Replay:
    """Learns from the first part of a recording and judges all schemes on the rest.

    unit: by default the one that the recording names, else "medium". learn_s: seconds to
    learn from, standstill included. attitude_sigma_deg: of a given attitude, tilt and
    heading; default (0.1, 0.5). own_start: navigation starts from each scheme's own aided
    state, and not from one state for all.
    """

def allan(increments: _F64, rate_hz: float, *, kind: str, name: str = "axis") -> Allan:
    """Allan deviation of one axis at rest.

    increments: (n,), rad (kind "gyro") or m/s (kind "accel") per sample.
    """

def allan_file(
    file: _Path, *, columns: Sequence[str] = ..., rate_hz: float | None = None
) -> list[Allan]:
    """Allan deviations of the columns of a CSV file, plain or gzipped, as `host-sim allan`."""
