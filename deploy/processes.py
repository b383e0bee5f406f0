"""Schedulers, workers and clients as processes of this machine, for the test and the measurement.

HOST_SIM names the program.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import psutil

PROGRAM = Path(os.environ.get("HOST_SIM", "target/release/host-sim")).resolve()
HERE = Path(__file__).parent
FILES = ("json", "ratios", "parquet")
# For what takes seconds on a quiet machine.
AT_MOST_S = 120.0
T = TypeVar("T")


def until(condition: Callable[[], T | None]) -> T:
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
        self.held: list[psutil.Process] = []
        """Processes that a test has stopped, and that must not outlive it."""
        file = folder / "scheduler.json"
        listen = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file)]
        self.start("scheduler", *listen, "--no-dashboard")
        until(file.exists)
        self.address = until(lambda: dask_address(file))

    def start(self, kind: str, *words: str) -> subprocess.Popen[bytes]:
        """Start `dask KIND`."""
        command = [sys.executable, "-m", "dask", kind, *words]
        with (self.folder / f"{kind}-{len(self.processes)}.log").open("wb") as log:
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
        for held in self.held:
            with suppress(psutil.NoSuchProcess):
                held.kill()


def dask_address(file: Path) -> str:
    """Read the scheduler's address from its file."""
    words = file.read_text().split('"address": "')
    return words[1].split('"')[0] if len(words) > 1 else ""


def written(folder: Path) -> list[str]:
    """Give the options that write the compared files."""
    return [word for name in FILES for word in (f"--{name}", str(folder / name))]


class Client:
    """`dask_campaign.py` as a process, with its results in a folder."""

    def __init__(self, folder: Path, own: list[str], arguments: list[str]) -> None:
        """Start it."""
        self.folder = folder
        files = ["--host-sim", str(PROGRAM), "--out", str(folder / "out"), *written(folder)]
        words = [sys.executable, str(HERE / "dask_campaign.py"), *files, *own, "--", *arguments]
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
