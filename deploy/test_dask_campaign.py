"""A campaign on Dask workers that are killed: the bytes of one undisturbed process.

`cargo xtask scale` runs it. HOST_SIM names the program.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import psutil
import pytest

PROGRAM = Path(os.environ.get("HOST_SIM", "target/release/host-sim")).resolve()
RUNNER = Path(__file__).with_name("dask_campaign.py")
FILES = ("json", "ratios", "csv")
RUNS = 12
ARGUMENTS = ["--models", "noise", "--schemes", "uncorrected,ekf6-tuned", "--tuning-units", "1"]
# For what takes seconds on a quiet machine.
AT_MOST_S = 300.0
T = TypeVar("T")


def until(condition: Callable[[], T | None]) -> T:
    """Wait until something is true and give it."""
    end = time.monotonic() + AT_MOST_S
    while not (found := condition()):
        assert time.monotonic() < end, f"not within {AT_MOST_S} s"
        time.sleep(0.02)
    return found


def written(folder: Path) -> list[str]:
    """Give the options that write the compared files."""
    return [word for name in FILES for word in (f"--{name}", str(folder / name))]


def files(folder: Path) -> dict[str, bytes]:
    """Give what was written."""
    return {name: (folder / name).read_bytes() for name in FILES}


def runs(folder: Path) -> dict[str, int]:
    """Give the finished runs and when they were written, ns."""
    return {file.name: file.stat().st_mtime_ns for file in (folder / "out/runs").glob("*.json")}


def campaign(folder: Path, where: list[str], more: list[str] = ARGUMENTS) -> subprocess.Popen[str]:
    """Start the runner."""
    own = ["--host-sim", str(PROGRAM), "--out", str(folder / "out"), "--runs", str(RUNS)]
    words = [sys.executable, str(RUNNER), *own, *written(folder), *where, "--", *more]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def ended(client: subprocess.Popen[str]) -> tuple[int, str]:
    """Wait for its end: exit code and what it said."""
    _, said = client.communicate(timeout=AT_MOST_S)
    return client.returncode, said


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Give the address of a scheduler, and two workers."""
    file = tmp_path / "scheduler.json"
    dask, here = [sys.executable, "-m", "dask"], ["--host", "127.0.0.1", "--no-dashboard"]
    own = ["--port", "0", "--scheduler-file", str(file)]
    processes = [subprocess.Popen([*dask, "scheduler", *here, *own], cwd=tmp_path)]
    try:
        said = until(lambda: file.exists() and file.read_text().split('"address": "')[1:])
        address = said[0].split('"')[0]
        worker = [*dask, "worker", address, "--nthreads", "1", "--no-nanny", *here]
        processes += [subprocess.Popen(worker, cwd=tmp_path) for _ in range(2)]
        yield address, processes[1:]
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.fixture(scope="session")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Give the files of the same campaign by one process."""
    folder = tmp_path_factory.mktemp("expected")
    own = ["--runs", str(RUNS), "--out", str(folder / "out"), *written(folder)]
    words = [str(PROGRAM), "campaign", *own, *ARGUMENTS]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return files(folder)


def computing(worker: subprocess.Popen[bytes]) -> psutil.Process | None:
    """Give the host-sim of a worker if it computes a shard, and hold it there."""
    for child in psutil.Process(worker.pid).children():
        try:
            words = child.cmdline()
            if words[words.index("--runs") + 1] == str(RUNS):
                child.suspend()
                return child
        except (psutil.NoSuchProcess, ValueError):
            pass
    return None


def test_what_a_killed_worker_and_a_killed_client_leave_is_done(
    cluster: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path, expected: dict[str, bytes]
) -> None:
    """A worker dies in its shard, then the client; the same command ends with the same bytes."""
    address, workers = cluster
    client = campaign(tmp_path, ["--scheduler", address, "--shards", "2"])
    held = until(lambda: computing(workers[0]))
    workers[0].kill()
    workers[0].wait()
    held.kill()
    until(lambda: runs(tmp_path))
    client.kill()
    ended(client)
    kept = runs(tmp_path)
    assert 0 < len(kept) < RUNS
    code, said = ended(campaign(tmp_path, ["--scheduler", address, "--shards", "3"]))
    assert code == 0, said
    assert kept.keys() < runs(tmp_path).keys()
    assert files(tmp_path) == expected


def test_local_workers_write_the_files_of_one_process(
    tmp_path: Path, expected: dict[str, bytes]
) -> None:
    """Workers of its own do the same."""
    code, said = ended(campaign(tmp_path, ["--local-workers", "2"]))
    assert code == 0, said
    assert files(tmp_path) == expected


@pytest.mark.parametrize(
    ("where", "more", "reason"),
    [
        (["--local-workers", "1"], ["--schemes", "foo"], "there is no scheme 'foo'"),
        (["--local-workers", "1"], ["--shard=0/2"], "--shard=0/2 behind --"),
        (["--scheduler", "tcp://127.0.0.1:9", "--patience", "1"], ARGUMENTS, "tcp://127.0.0.1:9"),
    ],
)
def test_what_is_wrong_is_said_with_a_remedy(
    tmp_path: Path, where: list[str], more: list[str], reason: str
) -> None:
    """Bad arguments and no scheduler end with code 1 and a sentence."""
    code, said = ended(campaign(tmp_path, where, more))
    assert code == 1
    assert reason in said
    assert "remedy" in said
