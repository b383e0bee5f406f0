"""A campaign on Dask workers whose processes are killed: the bytes of one undisturbed process.

`cargo xtask scale` runs it.
"""

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

import dask_campaign
from processes import FILES, PROGRAM, Client, Cluster, until, written

RUNS, SHARDS = 12, 2
ARGUMENTS = ["--models", "noise", "--schemes", "none,ekf6-tuned", "--tuning-units", "1"]


def client_of(folder: Path, where: list[str], arguments: list[str] = ARGUMENTS) -> Client:
    """Start a campaign."""
    own = ["--runs", str(RUNS), "--shards", str(SHARDS), *where]
    return Client(folder, own, arguments)


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


@pytest.fixture(scope="session")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Give the files of the same campaign by one process."""
    folder = tmp_path_factory.mktemp("expected")
    own = ["--runs", str(RUNS), "--out", str(folder / "out"), *written(folder)]
    words = [str(PROGRAM), "campaign", *own, *ARGUMENTS]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return {name: (folder / name).read_bytes() for name in FILES}


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
    """Wait until a worker is in the middle of a shard, `least` of whose runs are finished.

    Its host-sim is held there: it cannot end before it is killed.
    """

    def look() -> tuple[subprocess.Popen[bytes], psutil.Process, int] | None:
        assert client.process.poll() is None, client.ended()
        for worker in cluster.workers():
            if found := computing(worker):
                host_sim, shard = found
                runs = sum(run % SHARDS == shard for run in client.runs())
                if least <= runs <= RUNS // SHARDS // 2:
                    host_sim.suspend()
                    cluster.held.append(host_sim)
                    return worker, host_sim, shard
        return None

    return until(look)


@pytest.mark.parametrize("collect", [False, True])
def test_a_killed_worker_leaves_its_shard_to_another_one(
    cluster: Cluster, tmp_path: Path, expected: dict[str, bytes], collect: bool
) -> None:
    """Its shard is computed by the other worker and a new one; the bytes do not change."""
    more = ["--collect"] if collect else []
    client = client_of(tmp_path, ["--scheduler", cluster.address, *more])
    worker, host_sim, shard = in_the_middle(cluster, client, 0 if collect else 1)
    worker.kill()
    worker.wait()
    gone = [run for run in range(RUNS) if run % SHARDS == shard and run not in client.runs()]
    assert gone, "the shard was finished before its worker was killed"
    # otherwise it would go on without its worker, beside the one that has its shard now
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
    client = client_of(tmp_path, ["--scheduler", cluster.address])
    _, host_sim, shard = in_the_middle(cluster, client, 1)
    client.process.send_signal(signal.SIGKILL)
    client.ended()
    until(lambda: not host_sim.is_running())
    until(lambda: not any(computing(worker) for worker in cluster.workers()))
    kept = client.runs()
    assert 0 < sum(run % SHARDS == shard for run in kept) < RUNS // SHARDS
    again = client_of(tmp_path, ["--scheduler", cluster.address])
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
        (local, ARGUMENTS, "that is no campaign's and is not overwritten; remedy:"),
        (local, ARGUMENTS, f"holds run {RUNS} of a longer campaign; remedy: --runs {RUNS + 1}"),
    ]
    for number, (where, words, reason) in enumerate(cases):
        client = client_of(tmp_path / str(number), where, words)
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
