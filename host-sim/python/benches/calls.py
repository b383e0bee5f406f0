"""What a call costs: one step, a run over 10^6 samples, and a drive navigated. docs/PYTHON.md has figures."""

import sys
import time

import numpy as np

import lrnn_imu as li


def least(work, times: int) -> float:
    """The least time of several, s."""
    found = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return min(found)


def main() -> None:
    rng = np.random.default_rng(1)
    network = li.Network(rng.normal(0, 0.2, 63))
    samples = 1_000_000
    rows = rng.normal(size=(samples, 3)).astype(np.float32)
    few = list(rows[:10_000])

    def steps() -> None:
        step = network.step
        for row in few:
            step(row)

    def nothing() -> None:
        step = network.reset
        for _ in few:
            step()

    run = least(lambda: network.run(rows), 7)
    one = least(steps, 7) / len(few)
    empty = least(nothing, 7) / len(few)
    drive = li.simulate("medium")
    increments = drive.dtheta, drive.dv
    start = drive.position[0], drive.velocity[0], drive.q_bn[0]
    n = len(drive)
    sins = least(lambda: li.Navigator(*start).run(*increments, drive.dt, every=n), 5)
    print(f"Python {sys.version.split()[0]}, numpy {np.__version__}")
    print(f"step of one sample        {1e9 * one:7.0f} ns a call (a call of nothing: {1e9 * empty:.0f})")
    print(f"run over 10^6 samples     {1e9 * run / samples:7.1f} ns a sample, {1e3 * run:.1f} ms in all")
    print(f"navigator over {n:,} samples {1e9 * sins / n:7.1f} ns a sample")


if __name__ == "__main__":
    main()
