#!/usr/bin/env python3
"""Measure the throughput of `dask_campaign.py` against workers; print Markdown, draw an SVG.

Workers are processes of this machine. They are measured twice: as they are, so that its cores
bound them, and each in a control group with a share of a core (Linux, root), so that several share
nothing, as on machines of their own. The filters are tuned before. HOST_SIM names the program.
"""

import argparse
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import matplotlib as mpl
from matplotlib import pyplot
from matplotlib.axes import Axes

from processes import PROGRAM, Client, Cluster, until

WORKERS = (1, 2, 4, 8)
RUNS = 24
ARGUMENTS = ["--models", "noise", "--schemes", "none", "--tuning-units", "1"]
SHARE = 1 / 8
PERIOD_US = 100_000
GROUPS = Path("/sys/fs/cgroup")
# host-sim/src/report/palette.rs: on white, on a dark screen
INK, SOFT, GRID = ("#1B1F24", "#E7EAEE"), ("#59616B", "#A4ADB8"), ("#E4E7EB", "#2C3138")
PAPER, LAW = ("#FFFFFF", "#15181C"), ("#9BA3AD", "#6C7580")
CURVE = ("#0072B2", "#56B4F2")


@dataclass
class Curve:
    """Campaigns with one kind of workers."""

    title: str
    share: float | None
    """Of a core, for each worker; None for all that the machine gives."""
    seconds: dict[int, list[float]] = field(default_factory=dict)
    """By workers: from the first shard to the last, one value a round."""

    def rate(self, workers: int) -> tuple[float, float, float]:
        """Give runs a minute: median, smallest, largest."""
        rates = [60 * RUNS / seconds for seconds in self.seconds[workers]]
        return statistics.median(rates), min(rates), max(rates)


def control_group(number: int, share: float) -> Path:
    """Make a control group with a share of a core (version 1 or 2 of the kernel's interface)."""
    quota = round(share * PERIOD_US)
    old = GROUPS / "cpu"
    group = (old if old.is_dir() else GROUPS) / f"campaign-{os.getpid()}-{number}"
    group.mkdir()
    if old.is_dir():
        (group / "cpu.cfs_period_us").write_text(str(PERIOD_US))
        (group / "cpu.cfs_quota_us").write_text(str(quota))
    else:
        (group / "cpu.max").write_text(f"{quota} {PERIOD_US}")
    return group


def is_empty(group: Path) -> bool:
    """Tell whether a control group has no process."""
    return not (group / "cgroup.procs").read_text()


def is_connected(log: Path) -> bool:
    """Tell whether a worker has found its scheduler."""
    return "Starting established connection" in log.read_text()


@contextmanager
def growing() -> Iterator[tuple[Cluster, list[Path]]]:
    """Give a scheduler to which workers are added, and their control groups."""
    with tempfile.TemporaryDirectory() as folder:
        cluster = Cluster(Path(folder))
        groups: list[Path] = []
        try:
            yield cluster, groups
        finally:
            cluster.stop()
            for group in groups:
                until(partial(is_empty, group))
                group.rmdir()


def grow(cluster: Cluster, groups: list[Path], share: float | None, workers: int) -> None:
    """Add workers until there are so many; they are throttled once they have started."""
    new = [cluster.worker() for _ in range(workers - len(cluster.workers()))]
    for process in new:
        log = Path(cluster.folder / f"worker-{cluster.processes.index(process)}.log")
        until(partial(is_connected, log))
        if share is not None:
            groups.append(control_group(len(groups), share))
            (groups[-1] / "cgroup.procs").write_text(str(process.pid))


def campaign(cluster: Cluster, tuned: Path) -> float:
    """Run a campaign and give its time from the first shard to the last, s."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(tuned, folder / "out")
        where = ["--scheduler", cluster.address, "--runs", str(RUNS), "--shards", str(RUNS)]
        code, said = Client(folder, where, ARGUMENTS).ended()
        found = re.search(rf"{RUNS} runs in ([0-9.]+) s", said)
        if code != 0 or found is None:
            sys.exit(f"dask_campaign.py ended with {code}: {said}")
        return float(found[1])


def measure(curves: list[Curve], rounds: int, tuned: Path) -> None:
    """Measure all in turn, round after round, so that other load meets all of them."""
    for number in range(rounds):
        for curve in curves:
            with growing() as (cluster, groups):
                for workers in WORKERS:
                    grow(cluster, groups, curve.share, workers)
                    seconds = campaign(cluster, tuned)
                    curve.seconds.setdefault(workers, []).append(seconds)
                    text = f"round {number + 1}, {curve.title}, {workers} workers: {seconds:.1f} s"
                    print(text, file=sys.stderr, flush=True)


def markdown(curves: list[Curve], rounds: int) -> str:
    """Give the table."""
    words = " ".join(ARGUMENTS)
    lines = [
        f"**Workers**: {RUNS} runs in {RUNS} shards by `deploy/dask_campaign.py` with `{words}`, "
        "filters tuned before; from the first shard to the last. Runs a minute: medians, smallest "
        f"and largest of {rounds} rounds in turn.",
        "",
        "| workers | " + " | ".join(f"{curve.title} | times one" for curve in curves) + " |",
        "|---|" + "---|---|" * len(curves),
    ]
    for workers in WORKERS:
        cells = []
        for curve in curves:
            median, least, most = curve.rate(workers)
            cells.append(f"{median:.1f} ({least:.1f} .. {most:.1f})")
            cells.append(f"{median / curve.rate(WORKERS[0])[0]:.2f}")
        lines.append(f"| {workers} | " + " | ".join(cells) + " |")
    lines += ["", "![throughput of a campaign against workers](scale.svg)", ""]
    return "\n".join(lines)


def panel(axes: Axes, curve: Curve) -> None:
    """Draw one kind of workers: medians with their range, beside n times one worker."""
    medians = [curve.rate(workers) for workers in WORKERS]
    rates = [median for median, _, _ in medians]
    below = [median - least for median, least, _ in medians]
    above = [most - median for median, _, most in medians]
    ideal = [rates[0] * workers for workers in WORKERS]
    axes.plot(WORKERS, ideal, color=LAW[0], dashes=(5, 3), label="n times one worker")
    axes.errorbar(
        WORKERS,
        rates,
        yerr=[below, above],
        label="measured",
        color=CURVE[0],
        linewidth=2,
        marker="o",
        capsize=3,
    )
    axes.set_title(curve.title, loc="left", fontsize=11)
    axes.set_xscale("log", base=2)
    axes.set_yscale("log", base=2)
    axes.set_xticks(WORKERS, [str(workers) for workers in WORKERS])
    low, high = min(rates), max(ideal)
    ticks = [2**k for k in range(12) if low / 2 <= 2**k <= 2 * high]
    axes.set_yticks(ticks, [str(n) for n in ticks])
    axes.minorticks_off()
    axes.set_xlabel("workers")
    axes.set_ylabel("runs a minute")
    axes.grid(color=GRID[0])
    axes.legend(frameon=False, loc="upper left")


def draw(curves: list[Curve], path: Path) -> None:
    """Write the picture; on a dark screen its colours change, as those of the other pictures."""
    mpl.use("svg")
    mpl.rcParams.update(
        {
            "svg.fonttype": "none",
            "svg.hashsalt": "scale",
            "font.family": "sans-serif",
            "text.color": INK[0],
            "axes.labelcolor": INK[0],
            "axes.titlecolor": INK[0],
            "axes.edgecolor": INK[0],
            "xtick.color": SOFT[0],
            "ytick.color": SOFT[0],
        }
    )
    figure, panels = pyplot.subplots(
        1, len(curves), figsize=(4.4 * len(curves), 3.6), layout="constrained", squeeze=False
    )
    for axes, curve in zip(panels[0], curves, strict=True):
        panel(axes, curve)
    figure.savefig(path, metadata={"Date": None, "Title": "Throughput against workers"})
    svg = path.read_text()
    rules = "".join(
        f'[style*="{kind}: {light.lower()}"]{{{kind}:{dark} !important}}'
        for light, dark in (INK, SOFT, GRID, PAPER, LAW, CURVE)
        for kind in ("fill", "stroke")
    )
    style = f"<style>@media (prefers-color-scheme:dark){{{rules}}}</style>"
    path.write_text(re.sub(r"(<defs>)", style + r"\n\1", svg, count=1))


def main() -> None:
    """Measure, draw, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--svg", type=Path, required=True, help="where the picture goes")
    parser.add_argument("--rounds", type=int, default=3, help="campaigns of each kind (3)")
    args = parser.parse_args()
    curves = [
        Curve(f"workers of 1/{round(1 / SHARE)} core each", SHARE),
        Curve(f"workers on {os.cpu_count()} cores", None),
    ]
    with tempfile.TemporaryDirectory() as tuned:
        own = ["--runs", "1", "--shard", "1/2", "--out", tuned]
        words = [str(PROGRAM), "campaign", *own, *ARGUMENTS]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        measure(curves, args.rounds, Path(tuned))
    draw(curves, args.svg)
    print(markdown(curves, args.rounds), end="")


if __name__ == "__main__":
    main()
