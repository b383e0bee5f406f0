"""Simulator, navigator, experiment, replay and Allan deviation: the bits of the program."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import lrnn_imu as li


def table(file: Path) -> np.ndarray:
    return np.loadtxt(file, delimiter=",", skiprows=1)


@pytest.fixture(scope="module")
def session(simulated) -> li.Session:
    return li.simulate(simulated / "short.toml", 5)


def test_a_simulated_drive_has_the_bytes_and_numbers_of_the_program(simulated, session, tmp_path):
    session.write(tmp_path)
    names = {file.name for file in (simulated / "drive").iterdir()}
    assert names == {file.name for file in tmp_path.iterdir()} and "imu.csv" in names
    for name in names:
        assert (tmp_path / name).read_bytes() == (simulated / "drive" / name).read_bytes(), name
    imu, truth = (table(simulated / "drive" / name) for name in ("imu.csv", "truth.csv"))
    assert_array_equal(imu, np.column_stack([session.time, session.dtheta, session.dv]))
    assert_array_equal(truth[:, 4:7], session.velocity)
    assert_array_equal(table(simulated / "drive/temperature.csv")[:, 1:4], session.temperature)
    fixes = table(simulated / "drive/gnss.csv")
    assert_array_equal(fixes[:, 0], session.fix_time)
    assert_array_equal(fixes[:, 4:], np.column_stack([session.fix_velocity, session.fix_sigma]))
    counts = session.dtheta_counts * session.gyro_lsb_rad
    assert_array_equal(counts, session.dtheta)


@pytest.fixture(scope="module")
def run_rows(simulated, host_sim) -> list[dict]:
    host_sim(
        "run", "--scenario", simulated / "short.toml", "--seed", 5,
        "--json", simulated / "run.json", "--out", simulated / "report",
    )  # fmt: skip
    return json.loads((simulated / "run.json").read_text())["rows"]


def test_an_experiment_has_the_json_of_the_program(simulated, run_rows):
    done = li.run_experiment(simulated / "short.toml", 5)
    assert done.json == (simulated / "run.json").read_text()
    assert done.rows == run_rows and done.verdict[0].startswith("Verdict: ")
    with pytest.raises(ValueError, match=r"'rnn' after 7 min; .*ls-3x3, rnn, .*after 5 min"):
        done.horizontal("rnn", 7)
    raw = next(row for row in run_rows if row["scheme"] == "raw")
    assert done.horizontal("raw", raw["t_s"] // 60) == raw["horizontal_m"]
    curves = done.curves()
    assert curves["error_over_time"]["raw"][1][raw["t_s"]] == raw["horizontal_m"]
    with pytest.raises(ValueError, match="no row of 'raw' after 7 min"):
        done.horizontal("raw", 7)
    for seed in (-1, 2**64):
        with pytest.raises(ValueError, match=f"seed: is {seed}; remedy: give a whole number from 0"):
            li.simulate("medium", seed)


def test_the_navigator_step_by_step_is_the_row_of_the_program(session, run_rows):
    """Alignment, navigation and height loop, as inertial/free_inertial.rs composes them."""
    still, n = session.standstill_s, round(1 / session.dt)
    dtheta, dv, truth = session.dtheta, session.dv, session.position
    q_bn = li.align(dtheta[: still * n], dv[: still * n], session.dt, truth[0])
    nav = li.Navigator(truth[still], session.velocity[still], q_bn)
    places, velocities = [], []
    for k in range(still, still + 300):
        piece = slice(k * n, (k + 1) * n)
        p, v, q = nav.run(dtheta[piece], dv[piece], session.dt, every=n)
        assert_array_equal(p[0], nav.position)
        assert q.shape == (1, 4)
        nav.damp_height(truth[k + 1, 2])
        places.append(nav.position)
        velocities.append(nav.velocity)
    errors = li.ned(np.array(places), truth[still + 1 : still + 301])
    row = next(row for row in run_rows if row["scheme"] == "raw" and row["t_s"] == 300)
    speed = velocities[-1] - session.velocity[still + 300]
    assert (errors[-1, 0], errors[-1, 1]) == (row["d_north_m"], row["d_east_m"])
    assert (speed[0], speed[1]) == (row["d_vn_mps"], row["d_ve_mps"])
    position, velocity = li.free_inertial(session)
    assert_array_equal(position[1:301], errors)
    assert_array_equal(velocity[300], speed)


def test_fit_and_compensator_are_the_row_rnn(simulated, session, run_rows):
    learnt = li.simulate(simulated / "short.toml", 5, learning=True).fit()
    compensator = learnt.compensator(session)
    a, b, blocks = compensator.run(session.dtheta_counts, session.dv_counts, session.temperature)
    assert blocks.shape == (len(session) * session.dt, 2, 3)
    scales = (session.gyro_lsb_rad, session.accel_lsb_mps)
    position, _ = li.free_inertial(session, a * scales[0], b * scales[1])
    row = next(row for row in run_rows if row["scheme"] == "rnn" and row["t_s"] == 300)
    assert tuple(position[300, :2]) == (row["d_north_m"], row["d_east_m"])


def test_the_compensators_blocks_do_not_depend_on_the_calls(session):
    learnt = li.learn_from_fixes(session)
    counts = (session.dtheta_counts, session.dv_counts)
    at_once = learnt.compensator(session).run(*counts)
    pieces = learnt.compensator(session)
    parts = [pieces.run(*(c[from_ : from_ + 777] for c in counts)) for from_ in range(0, 7770, 777)]
    for whole, part in zip(at_once, zip(*parts)):
        joined = np.concatenate(part)
        assert_array_equal(joined, whole[: len(joined)])
    assert learnt.evidence[0] == ("zero correction", 0.0)


def test_a_call_takes_a_temperature_for_each_block_that_begins_in_it(simulated, session):
    learnt = li.simulate(simulated / "short.toml", 5, learning=True).fit()
    assert learnt.running == "accelerometer network" and len(learnt.evidence) == 3
    assert "accelerometer" in learnt.note
    counts = (session.dtheta_counts, session.dv_counts)
    pieces, block = learnt.compensator(session), learnt.compensator(session).block_samples
    for first in range(0, 7770, 777):
        begin = range(-(-first // block), -(-(first + 777) // block))
        piece = [c[first : first + 777] for c in counts]
        rows = session.temperature[begin.start : begin.stop]
        with pytest.raises(ValueError, match=f"temperature: has {len(begin) - 1} rows where"):
            pieces.run(*piece, rows[1:])
        pieces.run(*piece, rows)
    part = [c[:10] for c in counts]
    pieces.run(*part, session.temperature[:0])  # within a block


@pytest.mark.parametrize("from_arrays", [False, True])
def test_a_replay_has_the_json_of_the_program(simulated, host_sim, from_arrays, tmp_path):
    header, file = simulated / "drive/header.toml", tmp_path / "replay.json"
    host_sim("replay", "csv", "--header", header, "--json", file, "--out", tmp_path / "report")
    recording = li.read_csv(header)
    if from_arrays:
        recording = li.Recording(
            recording.time,
            recording.gyro,
            recording.accel,
            kind=recording.kind,
            fix_time=recording.fix_time,
            fix_position=recording.fix_position,
            fix_velocity=recording.fix_velocity,
            fix_sigma=recording.fix_sigma,
            standstill_s=120,
        )
    done = li.replay(recording, simulated / "drive/unit.toml")
    (wanted,) = json.loads(file.read_text())
    found = json.loads(done.json)[0]
    if from_arrays:  # degrees to radians and back may change a last bit of the fixes
        assert [r["scheme"] for r in found["rows"]] == [r["scheme"] for r in wanted["rows"]]
        for a, b in zip(found["rows"], wanted["rows"]):
            assert abs(a["horizontal_m"] - b["horizontal_m"]) < 0.01 * (1 + b["horizontal_m"])
    else:
        assert found == wanted
    last = wanted["rows"][-1]
    assert done.verdict and last["scheme"] in done.schemes


def test_an_allan_deviation_has_the_json_of_the_program(simulated, host_sim, tmp_path):
    imu, file = simulated / "drive/imu.csv", tmp_path / "allan.json"
    host_sim("allan", imu, "--json", file)
    wanted = json.loads(file.read_text())["analyses"]
    found = li.allan_file(imu)
    assert [one.name for one in found] == [one["column"] for one in wanted]
    column = table(imu)[:, 1]
    alone = li.allan(np.ascontiguousarray(column), found[0].rate_hz, kind="gyro")
    for one, other in [*zip(found, wanted), (alone, wanted[0])]:
        for name, key in [("tau", "tau_s"), ("deviation",) * 2, ("low",) * 2, ("edf",) * 2]:
            assert_array_equal(getattr(one, name), [point[key] for point in other["curve"]])
        for c in other["coefficients"]:
            got = one.coefficients[c["symbol"]]
            assert [got[key] for key in ("value", "low", "high")] == [
                c[key] for key in ("value", "low", "high")
            ]


def test_kf_gins_files_are_read(tmp_path, session):
    n = round(1 / session.dt)
    np.savetxt(tmp_path / "imu.txt", np.column_stack([session.time, session.dtheta, session.dv]))
    place = session.fix_position.copy()
    place[:, :2] = np.degrees(place[:, :2])
    fixes = np.column_stack([session.fix_time, place, session.fix_sigma[:, :3]])
    np.savetxt(tmp_path / "gnss.txt", fixes[1:])
    read = li.read_kf_gins(tmp_path / "imu.txt", tmp_path / "gnss.txt", standstill_s=100)
    assert (read.rate_hz, len(read)) == (n, len(session))
    assert_array_equal(read.gyro, session.dtheta)
