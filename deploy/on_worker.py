"""What a Dask worker does for `dask_campaign.py`: one shard of a campaign by host-sim.

The client sends this module with each task, so workers need nothing of this folder.
"""

import hashlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from distributed import get_worker
from distributed.core import Status

TUNING = "tuning.json"
STAMP = "campaign.txt"
# The exit code with which host-sim refuses its arguments. Another try would end the same way.
REFUSED = 2
LOOK_S = 0.2


@dataclass(frozen=True)
class Plan:
    """What all tasks of a campaign have in common."""

    host_sim: Path
    """The program, at the same path on all machines."""
    digest: str
    """Its SHA-256, hexadecimal: all machines must have the same one."""
    out: Path
    """The campaign's folder."""
    arguments: tuple[str, ...]
    """What is handed on to `host-sim campaign`."""
    jobs: int
    """Threads of a shard, >= 1."""
    collect: bool
    """Workers do not see `out`: files travel with the tasks."""


@dataclass(frozen=True)
class Task:
    """One call of host-sim: a shard, or the tuning alone."""

    runs: int
    shard: str
    """I/N, as host-sim takes it."""
    jobs: int | None
    """Threads; None for all cores of the machine, which the tuning takes."""


@dataclass(frozen=True)
class Outcome:
    """What a task gives back."""

    refused: str = ""
    """Why another try would end the same way; empty if the task is done."""
    files: tuple[tuple[str, bytes], ...] = ()
    """With `collect`: the new files, named relative to the campaign's folder."""


def tuning() -> Task:
    """Tune the filters and check the arguments: a shard of a single run that holds none."""
    return Task(runs=1, shard="1/2", jobs=None)


def digest_of(program: Path) -> str:
    """Give the SHA-256 of a file, hexadecimal."""
    with program.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def command(plan: Plan, task: Task) -> list[str]:
    """Give the command line of a task."""
    jobs = [] if task.jobs is None else ["--jobs", str(task.jobs)]
    own = ["--runs", str(task.runs), "--shard", task.shard, "--out", str(plan.out), "--resume"]
    return [str(plan.host_sim), "campaign", *own, *jobs, *plan.arguments]


def bound() -> list[str]:
    """Give a prefix with which a command dies with this process: util-linux, so on most Linux.

    Without it a `host-sim` ends its shard beside the worker that does it again: the same bytes.
    """
    words = ["setpriv", "--pdeathsig", "KILL"]
    if shutil.which(words[0]) is None:
        return []
    tried = subprocess.run([*words, "true"], capture_output=True, check=False)
    return words if tried.returncode == 0 else []


def supervised(words: list[str], wanted: Callable[[], bool]) -> tuple[int, str]:
    """Run a command and give its exit code and what it says on the standard error.

    It ends early when it is no longer wanted, and with the worker's process, even if that is
    killed: see `bound`.
    """
    words = [*bound(), *words]
    with tempfile.TemporaryFile() as complaint:
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=complaint)
        try:
            while True:
                try:
                    code = process.wait(timeout=LOOK_S)
                    break
                except subprocess.TimeoutExpired:
                    if not wanted():
                        raise RuntimeError("the task is no longer wanted") from None
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
        complaint.seek(0)
        return code, complaint.read().decode(errors="replace").strip()


def still_wanted() -> Callable[[], bool]:
    """Give a function that tells whether the scheduler still wants the task of this thread."""
    worker = get_worker()
    key = worker.get_current_task()
    leaving = (Status.closing, Status.closing_gracefully, Status.closed, Status.failed)

    def wanted() -> bool:
        state = worker.state.tasks.get(key)
        return state is not None and state.state != "cancelled" and worker.status not in leaving

    return wanted


def unfit(plan: Plan, task: Task) -> str:
    """Say why this machine cannot do the task, with the remedy; empty if it can."""
    here = f"worker {get_worker().address}"
    if not plan.host_sim.is_file():
        return (
            f"{here} has no {plan.host_sim}; remedy: put the program there on every machine, "
            "or name another place with --host-sim"
        )
    if digest_of(plan.host_sim) != plan.digest:
        return (
            f"{here} has another {plan.host_sim} than this machine; "
            "remedy: copy the same program to every machine"
        )
    seen = plan.out if task.jobs is None else plan.out / TUNING
    if not plan.collect and not seen.exists():
        return f"{here} does not see {seen}; remedy: an --out that all machines share, or --collect"
    return ""


def files_below(folder: Path) -> dict[str, Path]:
    """Give the files of a campaign that tasks write: its stamp, what was tuned, finished runs."""
    named = [folder / STAMP, folder / TUNING, *(folder / "runs").glob("*.json")]
    return {str(path.relative_to(folder)): path for path in named if path.is_file()}


def work(plan: Plan, task: Task, files: tuple[tuple[str, bytes], ...] = ()) -> Outcome:
    """Do a task on this worker.

    With `collect` it begins with these files in a folder of its own and gives back the new ones.
    A failure that another try may mend is an exception; Dask then tries again.
    """
    if reason := unfit(plan, task):
        return Outcome(refused=reason)
    if not plan.collect:
        return called(plan, task)
    with tempfile.TemporaryDirectory(prefix="campaign-") as name:
        folder = Path(name)
        (folder / "runs").mkdir()
        for file, content in files:
            (folder / file).write_bytes(content)
        if not files:
            (folder / "runs").rmdir()  # host-sim takes runs without a stamp for another program's
        outcome = called(replace(plan, out=folder), task)
        known = {file for file, _ in files}
        found = files_below(folder).items()
        new = tuple((file, path.read_bytes()) for file, path in found if file not in known)
        return replace(outcome, files=new)


def called(plan: Plan, task: Task) -> Outcome:
    """Call host-sim for a task."""
    code, complaint = supervised(command(plan, task), still_wanted())
    if code == 0:
        return Outcome()
    if code == REFUSED:
        return Outcome(refused=complaint)
    last = complaint.splitlines()[-1] if complaint else "without a word"
    raise RuntimeError(f"host-sim ended with {code} on {get_worker().address}: {last}")
