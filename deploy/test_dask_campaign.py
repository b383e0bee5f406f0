"""A campaign on Dask workers whose processes are killed: the bytes of one undisturbed process.

`cargo xtask scale` runs it. HOST_SIM names the program.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import psutil
import pytest

import dask_campaign

PROGRAM = Path(os.environ.get("HOST_SIM", "target/release/host-sim")).resolve()
HERE = Path(__file__).parent
RUNS, SHARDS = 12, 3
ARGUMENTS = ["--models", "noise", "--schemes", "none,ekf6-tuned", "--tuning-units", "1"]
FILES = ("json", "ratios", "parquet")
# For what takes seconds on a quiet machine.
AT_MOST_S = 120.0

T = TypeVar("T")


def until(condition: Callable[[], T]) -> T:
    """Wait until something is true and give it."""
    end = time.monotonic() + AT_MOST_S
    while not (found := condition()):
        assert time.monotonic() < end, f"not within {AT_MOST_S} s"
        time.sleep(0.02)
    return found


class Cluster:
    """A scheduler and workers on 127.0.0.1, each a process of its own in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        """Start a scheduler without workers."""
        self.folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        file = folder / "scheduler.json"
        listen = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file)]
        self.start("scheduler", *listen, "--no-dashboard")
        until(file.exists)
        self.file = str(file)
        self.address = until(lambda: dask_address(file))

    def start(self, kind: str, *words: str) -> subprocess.Popen[bytes]:
        """Start `dask KIND`."""
        log = (self.folder / f"{kind}-{len(self.processes)}.log").open("wb")
        command = [sys.executable, "-m", "dask", kind, *words]
        process = subprocess.Popen(command, cwd=self.folder, stdout=log, stderr=log)
        self.processes.append(process)
        return process

    def worker(self) -> subprocess.Popen[bytes]:
        """Start a worker that nobody starts again."""
        own = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
        return self.start("worker", self.address, *own)

    def workers(self) -> list[subprocess.Popen[bytes]]:
        """Give the workers that live."""
        return [process for process in self.processes[1:] if process.poll() is None]

    def stop(self) -> None:
        """End all processes."""
        for process in self.processes:
            process.kill()
            process.wait()


def dask_address(file: Path) -> str:
    """Read the scheduler's address from its file."""
    words = file.read_text().split('"address": "')
    return words[1].split('"')[0] if len(words) > 1 else ""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """Two workers."""
    (tmp_path / "cluster").mkdir()
    cluster = Cluster(tmp_path / "cluster")
    try:
        cluster.worker()
        cluster.worker()
        yield cluster
    finally:
        cluster.stop()


def written(folder: Path) -> list[str]:
    """Give the options that write the compared files."""
    return [word for name in FILES for word in (f"--{name}", str(folder / name))]


@pytest.fixture(scope="session")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Give the files of the same campaign by one process."""
    folder = tmp_path_factory.mktemp("expected")
    own = ["--runs", str(RUNS), "--out", str(folder / "out"), *written(folder)]
    words = [str(PROGRAM), "campaign", *own, *ARGUMENTS]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return {name: (folder / name).read_bytes() for name in FILES}


class Client:
    """`dask_campaign.py` as a process, with its results in a folder."""

    def __init__(
        self, folder: Path, where: list[str], *more: str, arguments: list[str] = ARGUMENTS
    ) -> None:
        """Start it."""
        self.folder = folder
        own = ["--host-sim", str(PROGRAM), "--out", str(folder / "out"), *written(folder)]
        own += ["--runs", str(RUNS), "--shards", str(SHARDS), *where, *more]
        words = [sys.executable, str(HERE / "dask_campaign.py"), *own, "--", *arguments]
        self.process = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def runs(self) -> dict[int, int]:
        """Give the finished runs and when they were written, ns."""
        files = (self.folder / "out/runs").glob("*.json")
        return {int(file.stem): file.stat().st_mtime_ns for file in files}

    def ended(self) -> tuple[int, str]:
        """Wait for its end: exit code and what it said."""
        _, said = self.process.communicate(timeout=AT_MOST_S)
        return self.process.returncode, said

    def files(self) -> dict[str, bytes]:
        """Give what it has written."""
        return {name: (self.folder / name).read_bytes() for name in FILES}


def computing(worker: subprocess.Popen[bytes]) -> tuple[psutil.Process, int] | None:
    """Give the host-sim of a worker and the number of its shard, if it computes one."""
    try:
        for child in psutil.Process(worker.pid).children(recursive=True):
            words = child.cmdline()
            if f"{RUNS}" in words and "--shard" in words:
                return child, int(words[words.index("--shard") + 1].split("/")[0])
    except psutil.NoSuchProcess:
        pass
    return None


def in_the_middle(
    cluster: Cluster, client: Client, least: int
) -> tuple[subprocess.Popen[bytes], psutil.Process, int]:
    """Wait until a worker is in the middle of a shard, `least` of whose runs are finished."""

    def look() -> tuple[subprocess.Popen[bytes], psutil.Process, int] | None:
        assert client.process.poll() is None, client.ended()
        for worker in cluster.workers():
            if found := computing(worker):
                runs = sum(run % SHARDS == found[1] for run in client.runs())
                if least <= runs < RUNS // SHARDS:
                    return worker, *found
        return None

    return until(look)


@pytest.mark.parametrize("collect", [False, True])
def test_a_killed_worker_leaves_its_shard_to_another_one(
    cluster: Cluster, tmp_path: Path, expected: dict[str, bytes], collect: bool
) -> None:
    """Its shard is computed by the other worker and a new one; the bytes do not change."""
    more = ["--collect"] if collect else []
    client = Client(tmp_path, ["--scheduler", cluster.address], *more)
    worker, host_sim, shard = in_the_middle(cluster, client, 0 if collect else 1)
    worker.kill()
    worker.wait()
    gone = [run for run in range(RUNS) if run % SHARDS == shard and run not in client.runs()]
    assert gone, "the shard was finished before its worker was killed"
    until(lambda: not host_sim.is_running())
    cluster.worker()
    code, said = client.ended()
    assert code == 0, said
    assert set(gone) <= set(client.runs())
    assert client.files() == expected


def test_a_killed_client_goes_on_where_it_was(
    cluster: Cluster, tmp_path: Path, expected: dict[str, bytes]
) -> None:
    """Workers drop the work of a client that is gone; the next one keeps the finished runs."""
    client = Client(tmp_path, ["--scheduler", cluster.address])
    _, host_sim, _ = in_the_middle(cluster, client, 1)
    client.process.send_signal(signal.SIGKILL)
    client.ended()
    until(lambda: not host_sim.is_running())
    until(lambda: not any(computing(worker) for worker in cluster.workers()))
    kept = client.runs()
    assert 0 < len(kept) < RUNS
    again = Client(tmp_path, ["--scheduler", cluster.address])
    code, said = again.ended()
    assert code == 0, said
    assert f"{len(kept)} runs are there already" in said
    assert kept.items() <= again.runs().items()
    assert again.files() == expected


def test_what_is_wrong_is_said_with_a_remedy(tmp_path: Path) -> None:
    """Bad arguments, no scheduler and another campaign's folder end with code 1 and a sentence."""
    local = ["--local-workers", "1"]
    nobody = ["--scheduler", "tcp://127.0.0.1:9", "--patience", "1"]
    (tmp_path / "3/out/runs").mkdir(parents=True)
    (tmp_path / "3/out/runs/000000.json").write_text("[]")
    (tmp_path / "4/out/runs").mkdir(parents=True)
    (tmp_path / f"4/out/runs/{RUNS:06}.json").write_text("[]")
    cases: list[tuple[list[str], list[str], str]] = [
        (local, ["--schemes", "foo"], "there is no scheme 'foo'; remedy: one of none"),
        (local, ["--shard=0/2"], "--shard=0/2 behind --; remedy:"),
        (nobody, ARGUMENTS, "no scheduler at tcp://127.0.0.1:9"),
        (local, ARGUMENTS, "that is no campaign's; remedy:"),
        (local, ARGUMENTS, f"holds run {RUNS} of a longer campaign; remedy: --runs {RUNS + 1}"),
    ]
    for number, (where, words, reason) in enumerate(cases):
        client = Client(tmp_path / str(number), where, arguments=words)
        code, said = client.ended()
        assert code == 1
        assert reason in said
        assert "remedy" in said
        assert "Traceback" not in said


def test_runs_are_divided_without_loss_and_without_empty_shards() -> None:
    """Only shards that miss a run become tasks."""
    assert dask_campaign.divided({0, 3, 4, 9}, 3) == {0: 3, 1: 1}
    assert dask_campaign.divided(set(range(10)), 4) == {0: 3, 1: 3, 2: 2, 3: 2}
    assert dask_campaign.divided(set(), 4) == {}
