"""What the tests share: the repository, the built program, and the vectors of tests/vectors."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]


def bits(text: str) -> list[int]:
    """All hexadecimal numbers of a Rust source."""
    return [int(word, 16) for word in re.findall(r"0x([0-9a-f_]+)", text.replace("_", ""))]


@pytest.fixture(scope="session")
def expected() -> dict[str, int]:
    """The committed digests by their names."""
    text = (ROOT / "tests/vectors/src/expected.rs").read_text()
    pairs = re.findall(r"pub const (\w+): u64 = 0x([0-9a-f_]+);", text)
    return {name: int(value.replace("_", ""), 16) for name, value in pairs}


@pytest.fixture(scope="session")
def inputs() -> np.ndarray:
    """The committed vectors, (n, 3), float32."""
    text = (ROOT / "tests/vectors/src/inputs.rs").read_text()
    rows = re.findall(r"\[(0x[0-9a-f]{8}), (0x[0-9a-f]{8}), (0x[0-9a-f]{8})\]", text)
    return np.array([[int(x, 16) for x in row] for row in rows], np.uint32).view(np.float32)


@pytest.fixture(scope="session")
def host_sim():
    """Runs the desktop program with arguments; HOST_SIM names it."""
    program = os.environ.get("HOST_SIM", ROOT / "target/debug/host-sim")

    def run(*arguments: object) -> str:
        words = [str(program), *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def simulated(tmp_path_factory, host_sim) -> Path:
    """A short drive that the program wrote, with its scenario."""
    folder = tmp_path_factory.mktemp("simulated")
    (folder / "short.toml").write_text(SHORT)
    host_sim("simulate", "--scenario", folder / "short.toml", "--seed", 5, "--out", folder / "drive")
    return folder


SHORT = """
unit = "tactical"
[learn]
standstill_s = 120
drive_s = 240
[test]
standstill_s = 120
drive_s = 300
"""
