#!/usr/bin/env python3
"""Run a campaign on the workers of a Dask cluster, or on workers of its own on this machine.

    dask_campaign.py --scheduler tcp://host:8786 --runs 1000 --json c.json -- --scenario nav
    dask_campaign.py --local-workers 4 --runs 100

What stands behind `--` is handed on to `host-sim campaign`. One task tunes the filters. Then each
shard is a task. A task whose worker dies is done again by another worker. The same command goes on
after it was stopped: finished runs stay in --out. At the end `host-sim campaign merge` writes the
files and prints the tables of an undivided campaign, byte for byte.
"""

import argparse
import logging
import os
import pickle
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import cloudpickle
import dask
from distributed import CancelledError, Client, Future, KilledWorker, LocalCluster

import on_worker
from on_worker import STAMP, TUNING, Outcome, Plan, Task

# What this program gives to host-sim itself, or a cluster cannot do.
OURS = [
    *["merge", "--shard", "--out", "--resume", "--jobs", "--runs", "--studies"],
    *["--json", "--ratios", "--parquet", "--results"],
]
FILES = ("json", "ratios", "parquet", "results")
# What a task gives back: see `Outcome`.
Answer = tuple[str, tuple[tuple[str, bytes], ...]]
# A file of another machine may need this long to be seen here, s.
SEEN_WITHIN_S = 10.0
SHARDS_A_WORKER = 4
PROGRESS_S = 5.0
LOOK_S = 0.1


class ProblemError(Exception):
    """What ended the campaign, and what helps."""

    def __init__(self, what: str, remedy: str = "") -> None:
        """Take what went wrong, and a remedy where `what` does not name it."""
        super().__init__(f"{what}; remedy: {remedy}" if remedy else what)


def at_least_one(text: str) -> int:
    """Read a count."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number}; remedy: at least 1")
    return number


def options() -> argparse.ArgumentParser:
    """Give the command line."""
    known = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    where = known.add_mutually_exclusive_group(required=True)
    where.add_argument("--scheduler", metavar="ADDRESS", help="scheduler, as tcp://host:8786")
    where.add_argument(
        "--local-workers", type=at_least_one, metavar="N", help="N processes of this machine"
    )
    add = known.add_argument
    add("--runs", type=at_least_one, default=100, help="number of runs (100)")
    add(
        "--shards",
        type=at_least_one,
        metavar="N",
        help=f"tasks into which the missing runs are divided ({SHARDS_A_WORKER} for each thread "
        "of the workers)",
    )
    add("--jobs", type=at_least_one, default=1, help="threads of a shard (1)")
    add("--out", type=Path, default=Path("out/campaign"), help="folder of results (out/campaign)")
    add(
        "--collect",
        action="store_true",
        help="workers do not share --out: finished shards are sent back",
    )
    add(
        "--host-sim",
        type=Path,
        default=Path(os.environ.get("HOST_SIM", "target/release/host-sim")),
        help="the program, at the same path on all machines (HOST_SIM or target/release/host-sim)",
    )
    add("--retries", type=int, default=3, help="further tries of a task that failed (3)")
    add("--patience", type=float, default=60.0, help="how long to wait for a first worker, s (60)")
    for name in FILES:
        add(f"--{name}", type=Path, metavar="FILE", help="as in `host-sim campaign`")
    add("campaign", nargs="*", metavar="-- ARGUMENT", help="arguments of `host-sim campaign`")
    return known


def plan_of(args: argparse.Namespace) -> Plan:
    """Check the arguments and give what all tasks have in common."""
    for word in args.campaign:
        if word.split("=")[0] in OURS:
            raise ProblemError(f"{word} behind --", "give it before --; studies run on one machine")
    program = args.host_sim.resolve()
    if not program.is_file():
        raise ProblemError(f"no program {program}", "cargo build --release, or --host-sim PATH")
    # Workers have other working folders than this process.
    words = (str(Path(w).resolve()) if w.endswith(".toml") else w for w in args.campaign)
    return Plan(
        host_sim=program,
        digest=on_worker.digest_of(program),
        out=args.out.resolve(),
        arguments=tuple(words),
        jobs=args.jobs,
        collect=args.collect,
    )


@contextmanager
def connected(args: argparse.Namespace) -> Iterator[Client]:
    """Connect to the scheduler, or start one with workers; wait for a first worker."""
    # What it would print beside our own messages are backtraces of lost connections.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    # A task is given up after so many of its workers have died.
    dask.config.set({"distributed.scheduler.allowed-failures": args.retries})
    dask.config.set({"distributed.comm.timeouts.connect": args.patience})
    if args.local_workers is not None:
        cluster = LocalCluster(
            n_workers=args.local_workers,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address=None,
        )
        with cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(args.scheduler)
    except (OSError, ValueError) as error:
        remedy = "start `dask scheduler` there, and name it as tcp://host:8786"
        raise ProblemError(f"no scheduler at {args.scheduler} ({error})", remedy) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=args.patience)
        except TimeoutError:
            remedy = f"on each machine: dask worker {args.scheduler}"
            raise ProblemError(f"{args.scheduler} has no worker", remedy) from None
        yield client


def finished(out: Path) -> set[int]:
    """Give the numbers of the runs in a campaign's folder."""
    return {int(path.stem) for path in (out / "runs").glob("*.json")}


def kept(plan: Plan, runs: int) -> set[int]:
    """Give the finished runs of an earlier start, if the folder holds this campaign."""
    plan.out.mkdir(parents=True, exist_ok=True)
    found = finished(plan.out)
    if beyond := sorted(found - set(range(runs))):
        remedy = f"--runs {beyond[-1] + 1}, or another --out"
        raise ProblemError(f"{plan.out} holds run {beyond[-1]} of a longer campaign", remedy)
    if found or (plan.out / TUNING).exists():
        # What is tuned is not tuned again, so this takes no time. Another campaign is refused.
        words = on_worker.command(plan, on_worker.tuning())
        call = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
        if call.returncode != 0:
            raise ProblemError(call.stderr.decode(errors="replace").strip())
    return found


def workers_of(client: Client) -> list[int]:
    """Give the threads of each worker that is there."""
    return [
        worker["nthreads"] for worker in client.scheduler_info(n_workers=-1)["workers"].values()
    ]


def divided(missing: set[int], shards: int) -> dict[int, int]:
    """Give the shards that miss runs, and how many: shard I has the runs K % shards == I."""
    return dict(sorted(Counter(run % shards for run in missing).items()))


def files_for(plan: Plan, runs: Iterable[int]) -> tuple[tuple[str, bytes], ...]:
    """Give the files that a task needs where workers do not share the folder."""
    if not plan.collect:
        return ()
    there = on_worker.files_below(plan.out)
    names = [STAMP, TUNING, *(f"runs/{run:06}.json" for run in runs)]
    return tuple((name, there[name].read_bytes()) for name in names if name in there)


def keep(plan: Plan, outcome: Outcome) -> None:
    """Write the files that a task has sent back; each appears whole or not at all."""
    for name, content in outcome.files:
        path = plan.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        beside = path.with_name(f".dask-{os.getpid()}-{path.name}")
        beside.write_bytes(content)
        beside.replace(path)


def submit(client: Client, args: argparse.Namespace, plan: Plan, task: Task) -> Future[Answer]:
    """Hand a task to the scheduler."""
    at, of = (int(part) for part in task.shard.split("/"))
    own = () if task.jobs is None else (run for run in finished(plan.out) if run % of == at)
    # Workers need no copy of this folder: the module travels with the task.
    cloudpickle.register_pickle_by_value(on_worker)
    call = partial(on_worker.work, plan, task, files_for(plan, sorted(own)))
    return client.submit(
        unpacked,
        cloudpickle.dumps(call),
        retries=args.retries,
        pure=False,
        key=f"shard-{task.shard}-{time.time_ns()}",
    )


def unpacked(call: bytes) -> Answer:
    """Do a task on a worker, which knows none of the types of this program."""
    outcome = pickle.loads(call)()
    return outcome.refused, outcome.files


def outcome_of(future: Future[Answer]) -> Outcome:
    """Wait for a task and give what it gave back."""
    try:
        outcome = Outcome(*future.result())
    except KilledWorker as error:
        remedy = "look at the logs of the workers (memory?), then give the same command again"
        raise ProblemError(f"a task's workers died again and again ({error})", remedy) from None
    except CancelledError as error:
        remedy = "start it and its workers, then give the same command again"
        raise ProblemError(f"the scheduler has left ({error})", remedy) from None
    except Exception as error:  # of whatever kind a worker's is
        remedy = "give the same command again: finished runs are kept"
        raise ProblemError(f"a task failed too often: {error}", remedy) from None
    if outcome.refused:
        raise ProblemError(outcome.refused)
    return outcome


def tune(client: Client, args: argparse.Namespace, plan: Plan) -> None:
    """Let one worker tune the filters, which also checks the arguments."""
    if (plan.out / TUNING).exists():
        return
    say("tuning the filters on one worker")
    keep(plan, outcome_of(submit(client, args, plan, on_worker.tuning())))
    seen(plan, (plan.out / TUNING).exists)


def seen(plan: Plan, condition: Callable[[], bool]) -> None:
    """Wait until what a worker wrote is seen here."""
    until = time.monotonic() + SEEN_WITHIN_S
    while not condition():
        if time.monotonic() > until:
            problem = f"what the workers wrote is not in {plan.out}"
            raise ProblemError(problem, "an --out that all machines share, or --collect")
        time.sleep(0.2)


def say(text: str) -> None:
    """Tell the user how far it is."""
    print(text, file=sys.stderr, flush=True)


def progress(client: Client, runs: tuple[int, int, int], shards: int, began: float) -> str:
    """Give a line: finished runs now, at the start, and in the end; shards that are left."""
    now, then, end = runs
    here = len(workers_of(client))
    rate = (now - then) / (time.monotonic() - began)
    left = f"{(end - now) / rate:.0f} s left" if rate > 0 else "-"
    waiting = "" if here else "; no worker is there, the campaign waits for one"
    return (
        f"{now} of {end} runs, {shards} shards to do, {60 * rate:.1f} runs a minute, {left}, "
        f"workers: {here}{waiting}"
    )


def compute(client: Client, args: argparse.Namespace, plan: Plan, missing: set[int]) -> None:
    """Hand out the shards and wait for all of them."""
    threads = max(1, sum(workers_of(client)))
    shards = min(args.runs, args.shards or SHARDS_A_WORKER * threads)
    tasks = [Task(args.runs, f"{i}/{shards}", plan.jobs) for i in divided(missing, shards)]
    began, told = time.monotonic(), 0.0
    pending = {submit(client, args, plan, task) for task in tasks}
    while pending:
        time.sleep(LOOK_S)
        done = {future for future in pending if future.done()}
        for future in done:
            keep(plan, outcome_of(future))
        pending -= done
        if time.monotonic() - told > PROGRESS_S and pending:
            told = time.monotonic()
            runs = (len(finished(plan.out)), args.runs - len(missing), args.runs)
            say(progress(client, runs, len(pending), began))
    seen(plan, lambda: len(finished(plan.out)) == args.runs)
    took = time.monotonic() - began
    rate = 60 * len(missing) / took
    say(f"{len(missing)} runs in {took:.1f} s, {rate:.1f} runs a minute")


def merge(args: argparse.Namespace, plan: Plan) -> None:
    """Write the files and print the tables of all runs."""
    if args.parquet is None:
        args.parquet = plan.out / "campaign.parquet"
    words = [str(plan.host_sim), "campaign", "merge", str(plan.out)]
    for name in FILES:
        if (file := getattr(args, name)) is not None:
            words += [f"--{name}", str(file)]
    call = subprocess.run(words, stderr=subprocess.PIPE, check=False)
    if call.returncode != 0:
        raise ProblemError(call.stderr.decode(errors="replace").strip())


def campaign(args: argparse.Namespace) -> None:
    """Run what is missing, then merge."""
    plan = plan_of(args)
    missing = set(range(args.runs)) - kept(plan, args.runs)
    if missing:
        if len(missing) < args.runs:
            say(f"{args.runs - len(missing)} runs are there already")
        with connected(args) as client:
            tune(client, args, plan)
            compute(client, args, plan, missing)
    merge(args, plan)


def main() -> int:
    """Run the campaign and give the exit code."""
    try:
        campaign(options().parse_args())
    except ProblemError as problem:
        say(f"dask_campaign: {problem}")
        return 1
    except KeyboardInterrupt:
        say("dask_campaign: stopped; the same command goes on")
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
