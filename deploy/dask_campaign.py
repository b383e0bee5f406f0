#!/usr/bin/env python3
"""Run a campaign on the workers of a Dask cluster, or on workers of its own on this machine.

    dask_campaign.py --scheduler tcp://host:8786 --runs 1000 --json c.json -- --scenario nav
    dask_campaign.py --local-workers 4 --runs 100

What stands behind `--` goes to `host-sim campaign`. One worker tunes the filters, then each shard
is a task. All machines share the folder --out. A task whose worker dies is done again by another
one. The same command goes on after it was stopped: finished runs stay. At the end
`host-sim campaign merge` writes the files of an undivided campaign, byte for byte.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import dask
from distributed import Client, KilledWorker, LocalCluster, as_completed

# What this program gives to host-sim itself, or a cluster cannot do.
OURS = ["merge", "--shard", "--out", "--resume", "--jobs", "--runs", "--studies"]
FILES = ("json", "ratios", "csv", "results", "report")
SHARDS_A_WORKER = 4
RETRIES = 3
# The exit code with which host-sim refuses its arguments. Another try would end the same way.
REFUSED = 2


def options() -> argparse.ArgumentParser:
    """Give the command line."""
    known = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    where = known.add_mutually_exclusive_group(required=True)
    where.add_argument("--scheduler", metavar="ADDRESS", help="scheduler, as tcp://host:8786")
    where.add_argument("--local-workers", type=int, metavar="N", help="N processes here")
    add = known.add_argument
    add("--runs", type=int, default=100, help="number of runs (100)")
    add("--shards", type=int, metavar="N", help=f"tasks ({SHARDS_A_WORKER} a worker)")
    add("--jobs", type=int, default=1, help="threads of a shard (1)")
    add("--out", type=Path, default=Path("out/campaign"), help="folder (out/campaign)")
    add("--host-sim", type=Path, default=Path("target/release/host-sim"), help="the program")
    add("--patience", type=float, default=60.0, help="wait so long for a first worker, s (60)")
    for name in FILES:
        add(f"--{name}", type=Path, metavar="FILE", help="as in `host-sim campaign`")
    add("campaign", nargs="*", metavar="-- ARGUMENT", help="arguments of `host-sim campaign`")
    return known


def shard(words: list[str]) -> str:
    """Compute a shard on a worker; give why another try would end the same way, or nothing.

    Dask tries again after an exception.
    """
    call = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
    complaint = call.stderr.decode(errors="replace").strip()
    if call.returncode not in (0, REFUSED):
        raise RuntimeError(f"host-sim ended with {call.returncode}: {complaint}")
    return complaint if call.returncode == REFUSED else ""


def connected(args: argparse.Namespace) -> Client:
    """Connect to the scheduler, or start one with workers; wait for a first worker."""
    # a task is given up after so many of its workers have died
    dask.config.set({"distributed.scheduler.allowed-failures": RETRIES})
    dask.config.set({"distributed.comm.timeouts.connect": args.patience})
    if args.local_workers is not None:
        return Client(
            LocalCluster(args.local_workers, threads_per_worker=1, dashboard_address=None)
        )
    try:
        client = Client(args.scheduler)
        client.wait_for_workers(1, timeout=args.patience)
    except (OSError, ValueError) as error:  # TimeoutError among them
        sys.exit(
            f"dask_campaign: no scheduler with workers at {args.scheduler} ({error}); remedy: "
            f"`dask scheduler` there, `dask worker {args.scheduler}` on each machine"
        )
    return client


def compute(client: Client, args: argparse.Namespace) -> None:
    """Let one worker tune the filters, which checks the arguments, too; hand out all shards."""
    workers = len(client.scheduler_info(n_workers=-1)["workers"])
    shards = min(args.runs, args.shards or SHARDS_A_WORKER * workers)
    program, out = str(args.host_sim.resolve()), str(args.out.resolve())
    # workers have other working folders than this process
    more = [str(Path(word).resolve()) if word.endswith(".toml") else word for word in args.campaign]

    def words(runs: int, part: str, *jobs: str) -> list[str]:
        own = ["--runs", str(runs), "--shard", part, "--out", out, "--resume"]
        return [program, "campaign", *own, *jobs, *more]

    tuning = [words(1, "1/2")]  # a shard of a single run that holds none
    jobs = ("--jobs", str(args.jobs))
    parts = [words(args.runs, f"{part}/{shards}", *jobs) for part in range(shards)]
    for stage, tasks in (("tuning the filters", tuning), ("shards", parts)):
        futures = client.map(shard, tasks, retries=RETRIES, pure=False)
        for done, future in enumerate(as_completed(futures)):
            if refused := future.result():
                sys.exit(f"dask_campaign: {refused}")
            print(f"{stage}: {done + 1} of {len(tasks)}", file=sys.stderr, flush=True)


def main() -> int:
    """Run the campaign and give the exit code."""
    args = options().parse_args()
    for word in args.campaign:
        if word.split("=")[0] in [*OURS, *(f"--{name}" for name in FILES)]:
            sys.exit(f"dask_campaign: {word} behind --; remedy: give it before --")
    if not args.host_sim.is_file():
        sys.exit(f"dask_campaign: no program {args.host_sim}; remedy: --host-sim PATH")
    args.out.mkdir(parents=True, exist_ok=True)
    try:
        with connected(args) as client:
            compute(client, args)
    except KilledWorker as error:
        sys.exit(
            f"dask_campaign: the workers of a task died ({error}); remedy: look at their logs "
            "(memory?), then give the same command again"
        )
    except KeyboardInterrupt:
        sys.exit("dask_campaign: stopped; the same command goes on")
    if args.csv is None:
        args.csv = args.out / "campaign.csv"
    given = [(name, getattr(args, name)) for name in FILES]
    files = [word for name, file in given if file is not None for word in (f"--{name}", str(file))]
    merge = [str(args.host_sim), "campaign", "merge", str(args.out), *files]
    return subprocess.run(merge, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
