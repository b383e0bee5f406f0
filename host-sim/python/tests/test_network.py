"""Network and learners give the committed digests; wrong arguments are refused in words."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import lrnn_imu as li


class Digest:
    """FNV-1a over the bits of numbers, as in tests/vectors/src/digest.rs."""

    def __init__(self) -> None:
        self.value = 0xCBF2_9CE4_8422_2325

    def bytes(self, data: bytes) -> None:
        for byte in data:
            self.value = ((self.value ^ byte) * 0x100_0000_01B3) % 2**64

    def numbers(self, values) -> None:
        all32 = np.array(values, np.float32).ravel()
        numbers = np.where(np.isnan(all32), np.float32("nan"), all32).astype("<f4")
        assert np.float32("nan").view(np.uint32) == 0x7FC0_0000
        self.bytes(numbers.tobytes())

    def step(self, step: li.Step) -> None:
        self.numbers(step.output)
        self.numbers(step.error)
        faults = [None, "non-finite input", "overflow", "sensitivity overflow"]
        self.bytes(bytes([faults.index(step.fault)]))


def net(activation: str) -> li.Network:
    """The fixed network of tests/vectors/src/network.rs."""
    weights = [((k * 37 + 11) % 129) / 128 - 0.5 for k in range(63)]
    scales = {"input_scale": [0.5] * 3, "output_scale": [2.0**-18] * 3}
    return li.Network(weights, activation=activation, **scales)


ACTIVATIONS = ["rational", "tanh"]


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_steps_have_the_committed_digest(activation, inputs, expected):
    digest, network = Digest(), net(activation)
    for row in inputs:
        digest.step(network.step(row))
    assert digest.value == expected[f"STEP_{activation.upper()}"]


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_gradients_have_the_committed_digest(activation, inputs, expected):
    digest, network = Digest(), net(activation)
    for row in inputs:
        digest.step(network.step_gradient(row))
        digest.numbers(network.sensitivities)
    assert digest.value == expected[f"GRADIENT_{activation.upper()}"]


def learners(network: li.Network) -> list[li.Learner]:
    return [
        li.Learner(network, "paper", steps=1 / 16, eps=0.125),
        li.Learner(network, "guarded", steps=1 / 16),
        li.Learner(network, "gauss-newton", ridge=1 / 1024),
    ]


def sensor_error(rates: np.ndarray) -> np.ndarray:
    return np.float32(2.0**-19) + np.float32(2.0**-20) * rates


@pytest.mark.parametrize("at_once", [False, True])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_learners_have_the_committed_digest(activation, at_once, inputs, expected):
    rows, dt, window = inputs[:220], np.float32(1 / 128), 4
    digest = Digest()
    with np.errstate(all="ignore"):
        sums = np.zeros((len(rows) // window, 3), np.float32)
        for k in range(window):
            sums += sensor_error(rows[k::window]) * dt
    for learner in learners(net(activation)):
        for _ in range(4):
            if at_once:
                done = learner.run_pass(rows, sums, dt=dt, window=window)
            else:
                learner.begin_pass()
                for k, total in enumerate(sums):
                    steps = [learner.step(row, dt) for row in rows[k * window : (k + 1) * window]]
                    learner.reference(total) if all(steps) else learner.skip()
                done = learner.end_pass()
            digest.numbers(done.cost)
            digest.bytes(bytes([done.accepted]))
            digest.numbers([done.windows, done.faults])
            digest.numbers(learner.candidate)
    assert digest.value == expected[f"LEARNERS_{activation.upper()}"]


@pytest.mark.parametrize("activation", ["rational", "tanh", "cubic"])
@pytest.mark.parametrize("feedback", ["full", "diagonal"])
def test_a_run_is_its_steps_and_an_image_is_the_network(activation, feedback):
    rng = np.random.default_rng(1)
    weights = rng.normal(0, 0.3, 63).astype(np.float32)
    one = li.Network(weights, activation=activation, feedback=feedback)
    rows = rng.normal(size=(70_000, 3)).astype(np.float32)  # more than a piece
    run = one.copy().run(rows)
    assert_array_equal(run[:500], [one.step(row).error for row in rows[:500]])
    fork = li.Network.from_bytes(one.to_bytes())
    assert (fork.activation, fork.feedback) == (activation, feedback)
    assert_array_equal(fork.run(rows), run)


def test_the_exact_gradient_is_the_slope_of_the_output():
    rng = np.random.default_rng(2)
    weights = rng.normal(0, 0.3, 63).astype(np.float32)
    rows = rng.normal(size=(20, 3)).astype(np.float32)
    network = li.Network(weights)
    for row in rows:
        network.step_gradient(row)
    slopes = np.zeros((3, 63))
    for k in range(63):
        ends = []
        for by in (-1e-2, 1e-2):
            moved = weights.copy()
            moved[k] += by
            ends.append(li.Network(moved).run(rows)[-1].astype(float))
        slopes[:, k] = (ends[1] - ends[0]) / 2e-2
    assert np.abs(slopes - network.sensitivities).max() < 2e-4


def test_descent_learns():
    rng = np.random.default_rng(3)
    network = li.Network(rng.normal(0, 0.2, 63))
    rows = rng.normal(size=(4000, 3)).astype(np.float32)
    outputs = network.descend(rows, 0.3 * np.tanh(rows), 0.05)
    wrong = np.abs(outputs - 0.3 * np.tanh(rows)).mean(axis=1)
    assert wrong[-500:].mean() < 0.5 * wrong[:100].mean()


def test_a_fault_is_told_and_counted():
    network = net("rational")
    assert network.step([np.nan, 0, 0]).fault == "non-finite input"
    network.run(np.full((5, 3), np.inf, np.float32))
    assert network.faults == 6
    network.reset()
    assert network.faults == 0 and not network.state.any()


ROWS = np.zeros((4, 3), np.float32)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda n: n.run(ROWS.astype(float)), ["inputs", "(4, 3)", "float64", "float32", "ascont"]),
        (lambda n: n.run(np.zeros((3, 4), np.float32).T), ["(4, 3)", "not contiguous"]),
        (lambda n: n.run(np.zeros((4, 2), np.float32)), ["(4, 2)", "(n, 3)"]),
        (lambda n: n.run([[1.0, 2.0, 3.0]]), ["inputs: is a list"]),
        (lambda n: n.descend(ROWS, ROWS[:2], 0.1), ["targets", "2 rows", "4"]),
        (lambda n: n.step([1, 2]), ["input: is [1, 2], not 3 numbers"]),
        (lambda n: setattr(n, "weights", [0.0] * 62), ["weights", "not 63 numbers"]),
        (lambda n: li.Network(activation="relu"), ["activation: is 'relu'", "rational, tanh"]),
        (lambda n: li.Learner(n, "adam"), ["rule: is 'adam'", "paper, guarded, gauss-newton"]),
        (lambda n: li.Learner(n, "paper", ridge=1.0), ["ridge: is of no use to rule 'paper'"]),
        (lambda n: li.Network.from_bytes(b"x"), ["image", "remedy"]),
        (lambda n: li.Learner(n).run_pass(ROWS, ROWS, dt=1, window=0), ["window: is 0"]),
        (lambda n: li.Learner(n).run_pass(ROWS, ROWS, dt=np.nan, window=1), ["dt: is NaN"]),
        (lambda n: li.Learner(n, ridge=-1), ["ridge: is -1", "0 or more"]),
        (lambda n: li.Learner(n, "guarded", steps=np.nan), ["steps: is NaN"]),
        (lambda n: li.Navigator([1.575, 0, 0], [0, 0, 0], [1, 0, 0, 0]), ["position: is (1.575"]),
    ],
)
def test_wrong_arguments_are_refused_in_words(act, words):
    with pytest.raises(ValueError) as refused:
        act(net("rational"))
    text = str(refused.value)
    assert all(word in text for word in words) and "remedy: " in text, text


def test_arrays_that_come_out_own_their_memory():
    run = net("rational").run(np.ones((10, 3), np.float32))
    owner = run if run.base is None else run.base
    assert run.flags.c_contiguous and run.flags.writeable and owner.nbytes == run.nbytes
