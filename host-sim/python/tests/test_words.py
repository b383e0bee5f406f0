"""Units and scenarios, errors in words, Ctrl-C, and the stub against the module."""

import ast
import inspect
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

import lrnn_imu as li
from lrnn_imu import _native


def test_a_unit_goes_through_text_and_file(tmp_path):
    for name in li.Unit.presets():
        unit = li.Unit(name)
        assert li.Unit.parse(unit.to_text()).to_dict() == unit.to_dict()
    file = tmp_path / "mine.toml"
    file.write_text(li.Unit.preset_text("mems"))
    assert li.Unit(file).to_dict() == li.Unit("mems").to_dict()
    assert li.Unit("mems").to_dict()["gyro"]
    assert li.Unit.schema()["type"] == "object"


def test_a_scenario_is_changed_by_keys_and_keeps_the_ranges():
    changed = li.Scenario("mems", network={"rule": "paper", "passes": 3}, vibration=0)
    assert (changed.network["rule"], changed.network["passes"]) == ("paper", 3)
    assert changed.unit.name == "mems" and li.Scenario().network["rule"] == "gauss-newton"
    one, other = (li.simulate(s, 3) for s in (changed, "mems"))
    assert len(one) == len(other) and not np.array_equal(one.dv, other.dv)


def arrays(**changes):
    n = 200
    given = {
        "time": np.arange(1.0, n + 1) / 10,
        "gyro": np.zeros((n, 3)),
        "accel": np.zeros((n, 3)),
        "kind": "rate",
        "fix_time": np.arange(1.0, 20),
        "fix_position": np.zeros((19, 3)),
        "fix_sigma": np.ones((19, 6)),
    }
    given.update(changes)
    return lambda: li.Recording(**given)


@pytest.mark.parametrize(
    ("act", "kind", "words"),
    [
        (lambda: li.Unit("memz"), ValueError, ["'memz'", "did you mean 'mems'"]),
        (lambda: li.Unit("no/such.toml"), FileNotFoundError, ["no/such.toml: no such file"]),
        (lambda: li.Unit.parse("name = 'x'\nfoo = 1"), ValueError, ["unit:2: 'foo' is not a key"]),
        (lambda: li.Network(np.zeros(62)), ValueError, ["weights: has shape (62,), not (63,)"]),
        (lambda: li.Network([0.1] * 3), ValueError, ["weights: is [0.1, 0.1, 0.1], not 63 numbers"]),
        (lambda: li.Unit.preset_text("x"), ValueError, ["there is no unit 'x'"]),
        (lambda: li.Scenario("medium", network={"rule": "x"}), ValueError, ["'network.rule' unknown"]),
        (lambda: li.Scenario("medium", network={"passes": 0}), ValueError, ["network.passes"]),
        (lambda: li.Scenario("a.toml", vibration=1), ValueError, ["'a.toml' cannot be changed"]),
        (lambda: li.run_experiment("medum"), ValueError, ["did you mean 'medium'"]),
        (lambda: li.simulate(vehicle="tank"), ValueError, ["tank", "remedy"]),
        (lambda: li.read_csv("nope.toml"), FileNotFoundError, ["nope.toml"]),
        (lambda: li.allan(np.zeros(200), 100, kind="gyro"), ValueError, ["hardly ever change"]),
        (lambda: li.allan(np.ones(50), 100, kind="gyro"), ValueError, ["50 samples"]),
        (lambda: li.allan(np.full(200, np.nan), 1, kind="gyro"), ValueError, ["number 0 is NaN"]),
        (lambda: li.allan(np.ones(200), 0, kind="gyro"), ValueError, ["rate_hz: is 0"]),
        (lambda: li.Navigator([9, 0, 0], [0, 0, 0], [1, 0, 0, 0]), ValueError, ["position", "rad"]),
        (lambda: li.Navigator([0, 0, 0], [0, 0, 0], [1, 1, 0, 0]), ValueError, ["q_bn: has norm"]),
        (arrays(kind="x"), ValueError, ["kind: is 'x'", "rate, increment"]),
        (arrays(time=np.zeros(200)), ValueError, ["time: does not rise"]),
        (arrays(time=np.arange(1, 201)), ValueError, ["time", "int64", "float64"]),
        (arrays(gyro=np.full((200, 3), np.inf)), ValueError, ["row 0 is not finite"]),
        (arrays(accel=np.zeros((199, 3))), ValueError, ["accel: has 199 rows, and time has 200"]),
        (arrays(fix_sigma=np.zeros((19, 6))), ValueError, ["fixes: row 0"]),
        (arrays(standstill_s=10), ValueError, ["standstill_s: is 10"]),
        (arrays(standstill_s=100, attitude_deg=[0, 0, 0]), ValueError, ["both are given"]),
    ],
)
def test_errors_say_what_is_wrong_and_the_remedy(act, kind, words):
    with pytest.raises(kind) as refused:
        act()
    text = str(refused.value)
    assert all(word in text for word in words) and "remedy: " in text, text


def test_a_replay_of_nothing_is_refused_in_words():
    with pytest.raises(ValueError, match="remedy: "):
        li.replay(arrays()())


def test_a_network_of_another_kind_is_no_devices():
    rest = {"gyro_lsb_rad": 1e-6, "accel_lsb_mps": 1e-6, "sample_period_s": 0.01}
    limits = {"gyro_limit_radps": 1.0, "accel_limit_mps2": 1.0}
    with pytest.raises(ValueError, match="gyro: is of another kind"):
        other = li.Network(activation="tanh")
        li.Compensator(other, li.Network(), block_samples=100, **rest, **limits)
    with pytest.raises(ValueError, match="block_samples: must be at least 1"):
        li.Compensator(li.Network(), li.Network(), block_samples=0, **rest, **limits)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent as on Unix")
def test_ctrl_c_is_noticed_in_long_work():
    """A thread sends it: it also runs, so the work lets other threads run."""
    text = textwrap.dedent(
        """
        import os, signal, threading, numpy, lrnn_imu
        rows = numpy.zeros((16_000_000, 3), numpy.float32)
        network = lrnn_imu.Network()
        def stop():
            os.kill(os.getpid(), signal.SIGINT)
        for work in (lambda: network.run(rows), lambda: lrnn_imu.run_experiment()):
            threading.Timer(0.3, stop).start()
            try:
                work()
                print("not noticed")
            except KeyboardInterrupt:
                print("noticed")
        os._exit(0)
        """
    )
    start = time.monotonic()
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=60)
    assert done.stdout.split("\n")[:2] == ["noticed", "noticed"], done
    assert signal.SIGINT and time.monotonic() - start < 50


def documented(body: list[ast.stmt]) -> dict[str, str]:
    """Documented items of a part of the stub."""
    found = {}
    for item, after in zip(body, [*body[1:], None]):
        if isinstance(item, (ast.FunctionDef, ast.ClassDef)) and ast.get_docstring(item):
            found[item.name] = ast.get_docstring(item)
        if isinstance(item, ast.AnnAssign) and isinstance(after, ast.Expr):
            found[item.target.id] = inspect.cleandoc(after.value.value)
    return found


def test_help_says_what_the_stub_says():
    stub = ast.parse((Path(li.__file__).parent / "_native.pyi").read_text())
    items = [(_native, documented(stub.body))]
    for part in stub.body:
        if isinstance(part, ast.ClassDef):
            items.append((getattr(_native, part.name), documented(part.body)))
    assert len(items) == 16
    for owner, names in items:
        for name, text in names.items():
            said = inspect.cleandoc(getattr(owner, name).__doc__ or "")
            assert said == text, f"{owner.__name__}.{name}"
    public = {name for name in dir(_native) if not name.startswith("_")}
    assert public == set(li.__all__) - {"__version__"}
    assert public == set(items[0][1])
