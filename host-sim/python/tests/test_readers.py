"""Recordings of every form, written by other people's writers or by hand from the format's own
description, and the classical filter."""

import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import lrnn_imu as li

ROOT = Path(__file__).resolve().parents[3]
# recorded data, where Rust tests look for it, too
DATA = Path(os.environ.get("LRNN_DATA", ROOT.parent / "shared/data"))
SECONDS, RATE = 40, 50
START = 1_700_000_000


class Drive:
    """Made-up samples and fixes: every column another number, forward-right-down."""

    time = np.arange(1, SECONDS * RATE + 1) / RATE
    gyro = np.column_stack([0.01 * np.sin(time), 0.02 * np.cos(time), 0.03 + 0 * time])
    accel = np.column_stack([0.5 * np.cos(time), -0.2 * np.sin(time), -9.8 + 0 * time])
    fix_time = np.arange(1.0, SECONDS)
    place = np.column_stack([47.0 + 1e-5 * fix_time, 8.5 - 2e-5 * fix_time, 400 + fix_time])
    velocity = np.column_stack([1.1 + 0 * fix_time, -1.5 + 0 * fix_time, -1.0 + 0 * fix_time])


def flu(rows: np.ndarray) -> np.ndarray:
    """Forward-left-up from forward-right-down, and back."""
    return rows * [1, -1, -1]


HEADER = "std_msgs/Header header\n"
STAMP = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
VECTOR = """
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
IMU = f"""{HEADER}geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
{VECTOR}{STAMP}"""
FIX = f"""{HEADER}sensor_msgs/NavSatStatus status
float64 latitude
float64 longitude
float64 altitude
float64[9] position_covariance
uint8 position_covariance_type

================================================================================
MSG: sensor_msgs/NavSatStatus
int8 status
uint16 service
{STAMP}"""


def write_mcap(file: Path) -> None:
    """By Foxglove's own writer, in chunks packed with zstd."""
    writer = pytest.importorskip("mcap_ros2.writer")
    with file.open("wb") as out:
        bag = writer.Writer(out)
        imu = bag.register_msgdef("sensor_msgs/msg/Imu", IMU)
        fix = bag.register_msgdef("sensor_msgs/msg/NavSatFix", FIX)

        def stamp(t: float) -> tuple[dict, int]:
            ns = START * 10**9 + round(t * 1e9)
            return {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": "i"}, ns

        def xyz(row: np.ndarray) -> dict:
            return dict(zip("xyz", row.tolist()))

        none = [0.0] * 9
        for t, w, f in zip(Drive.time, flu(Drive.gyro), flu(Drive.accel)):
            header, ns = stamp(t)
            message = {
                "header": header,
                "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
                "orientation_covariance": none,
                "angular_velocity": xyz(w),
                "angular_velocity_covariance": none,
                "linear_acceleration": xyz(f),
                "linear_acceleration_covariance": none,
            }
            bag.write_message("/imu", imu, message, ns, ns)
        for t, (lat, lon, h) in zip(Drive.fix_time, Drive.place):
            header, ns = stamp(t)
            message = {
                "header": header,
                "status": {"status": 0, "service": 1},
                "latitude": lat,
                "longitude": lon,
                "altitude": h,
                "position_covariance": [4.0, 0, 0, 0, 4.0, 0, 0, 0, 9.0],
                "position_covariance_type": 2,
            }
            bag.write_message("/fix", fix, message, ns, ns)
        bag.finish()


def write_ubx(file: Path) -> None:
    """By pyubx2. The receiver's clock ticks 25 600 times a second."""
    ubx = pytest.importorskip("pyubx2")
    kinds = (14, 13, 5, 16, 17, 18)
    counts = np.column_stack([flu(Drive.gyro) * 4096 / np.radians(1), flu(Drive.accel) * 1024])
    all_ = []
    for t, row in zip(Drive.time, counts.round().astype(int)):
        payload = bytes(4)
        for kind, value in zip(kinds, row.tolist()):
            payload += struct.pack("<II", kind << 24 | value & 0xFFFFFF, round(t * 25_600))
        all_.append((t, ubx.UBXMessage("ESF", "ESF-RAW", ubx.GET, payload=payload)))
    for t, (lat, lon, h), (n, e, d) in zip(Drive.fix_time, Drive.place, Drive.velocity):
        message = ubx.UBXMessage(
            "NAV", "NAV-PVT", ubx.GET, iTOW=round(t * 1000) + 10**8, fixType=3, gnssFixOk=1,
            numSV=12, lat=lat, lon=lon, height=round(h * 1000), hAcc=2000, vAcc=3000,
            velN=round(n * 1000), velE=round(e * 1000), velD=round(d * 1000), sAcc=100,
        )  # fmt: skip
        all_.append((t, message))
    all_.sort(key=lambda one: one[0])
    file.write_bytes(b"".join(message.serialize() for _, message in all_))


def write_ulog(file: Path) -> None:
    """By the description of ULog; pyulog must find in it what was meant."""
    pyulog = pytest.importorskip("pyulog")

    def message(kind: str, content: bytes) -> bytes:
        return struct.pack("<HB", len(content), ord(kind)) + content

    formats = {
        "vehicle_imu": "uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;"
        "float[3] delta_velocity;uint32_t delta_angle_dt;uint32_t delta_velocity_dt;",
        "vehicle_gps_position": "uint64_t timestamp;int32_t lat;int32_t lon;"
        "int32_t alt_ellipsoid;float s_variance_m_s;float eph;float epv;float vel_n_m_s;"
        "float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;bool vel_ned_valid;",
    }
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    out += message("B", bytes(40))
    out += b"".join(message("F", f"{name}:{f}".encode()) for name, f in formats.items())
    for number, name in enumerate(formats):
        out += message("A", struct.pack("<BH", 0, number) + name.encode())
    rows, dt = [], 1 / RATE
    for t, w, f in zip(Drive.time, Drive.gyro, Drive.accel):
        us = round(t * 1e6)
        body = struct.pack("<HQQ6f2I", 0, us, us, *w * dt, *f * dt, *[round(dt * 1e6)] * 2)
        rows.append((us, message("D", body)))
    for t, (lat, lon, h), v in zip(Drive.fix_time, Drive.place, Drive.velocity):
        us = round(t * 1e6)
        place = [round(lat * 1e7), round(lon * 1e7), round(h * 1e3)]
        body = struct.pack("<HQ3i6fBB", 1, us, *place, 0.1, 2.0, 3.0, *v, 3, 1)
        rows.append((us + 1, message("D", body)))
    file.write_bytes(out + b"".join(row for _, row in sorted(rows)))
    log = pyulog.ULog(str(file))
    logged = log.get_dataset("vehicle_gps_position").data
    assert_array_equal(logged["lat"], (Drive.place[:, 0] * 1e7).round())
    angles = log.get_dataset("vehicle_imu").data["delta_angle[2]"]
    assert_allclose(angles, Drive.gyro[:, 2] * dt, rtol=1e-6)


def write_euroc(folder: Path) -> None:
    """The text that the page of the data set describes, axes of the body as of the MAV."""
    imu = folder / "mav0/imu0"
    truth = folder / "mav0/state_groundtruth_estimate0"
    imu.mkdir(parents=True)
    truth.mkdir()
    unit = "T_BS:\n  cols: 4\n  rows: 4\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"
    (imu / "sensor.yaml").write_text(unit)
    (truth / "sensor.yaml").write_text(unit)
    ns = [START * 10**9 + round(t * 1e9) for t in Drive.time]
    # x up, y right, z forward
    turned = [rows[:, [2, 1, 0]] * [-1, 1, 1] for rows in (Drive.gyro, Drive.accel)]
    rows = [f"{t},{','.join(map(repr, row))}" for t, row in zip(ns, np.hstack(turned).tolist())]
    (imu / "data.csv").write_text("#timestamp [ns],w,w,w,a,a,a\n" + "\n".join(rows) + "\n")
    rows = [
        f"{START * 10**9 + k * 10**9},{k},{2 * k},0,1,0,0,0,1,2,0" for k in range(1, SECONDS)
    ]
    names = "#timestamp,px,py,pz,qw,qx,qy,qz,vx,vy,vz\n"
    (truth / "data.csv").write_text(names + "\n".join(rows) + "\n")


def samples_are_those_of_the_drive(read: li.Recording, exact: float) -> None:
    per = 1 / RATE if read.kind == "increment" else 1
    assert read.rate_hz == RATE and abs(len(read) - len(Drive.time)) < 3
    n = len(read)
    assert_allclose(read.gyro / per, Drive.gyro[-n:], atol=exact * 0.1)
    assert_allclose(read.accel / per, Drive.accel[-n:], atol=exact * 10)


def test_a_bag_is_read(tmp_path):
    write_mcap(tmp_path / "drive.mcap")
    read = li.read(tmp_path / "drive.mcap", standstill_s=100)
    assert read.kind == "rate"
    samples_are_those_of_the_drive(read, 1e-15)
    assert_allclose(np.degrees(read.fix_position[:, :2]), Drive.place[:, :2], atol=1e-12)
    assert_allclose(read.fix_sigma[:, :3], [[2.0, 2.0, 3.0]] * len(read.fix_time))
    assert np.isinf(read.fix_sigma[:, 3:]).all()
    with pytest.raises(ValueError, match="--imu-topic"):
        li.read(tmp_path / "drive.mcap", imu_topic="/no")
    turned = li.read(tmp_path / "drive.mcap", mounting="x y z")
    assert_array_equal(turned.gyro, flu(read.gyro))


def test_a_log_of_a_receiver_is_read(tmp_path):
    write_ubx(tmp_path / "drive.bin")
    read = li.read(tmp_path / "drive.bin", standstill_s=100)
    samples_are_those_of_the_drive(read, 1e-3)
    assert_allclose(np.degrees(read.fix_position[:, :2]), Drive.place[:, :2], atol=1e-7)
    assert_allclose(read.fix_velocity, Drive.velocity)
    assert_allclose(read.fix_sigma[:, 3:], 0.1 / 3**0.5, rtol=1e-4)  # sAcc is of three axes


def test_a_log_of_an_autopilot_is_read(tmp_path):
    write_ulog(tmp_path / "drive.ulg")
    read = li.read(tmp_path / "drive.ulg", fix_delay_s=0, standstill_s=100)
    assert read.kind == "increment"
    samples_are_those_of_the_drive(read, 1e-6)
    assert_allclose(np.degrees(read.fix_position[:, :2]), Drive.place[:, :2], atol=1e-7)
    assert_allclose(read.fix_velocity, Drive.velocity, atol=1e-6)
    later = li.read(tmp_path / "drive.ulg", fix_delay_s=0.25)
    assert_allclose(read.fix_time[0] - later.fix_time[0], 0.25, atol=1e-9)


def test_a_folder_of_euroc_is_read(tmp_path):
    write_euroc(tmp_path)
    read = li.read(tmp_path, origin=[47.0, 8.5, 400.0], fix_interval_s=2, fix_sigma=(0.1, 0.2))
    samples_are_those_of_the_drive(read, 1e-12)
    assert_allclose(np.diff(read.fix_time), 2.0)
    assert_allclose(read.fix_sigma, [[0.1] * 3 + [0.2] * 3] * len(read.fix_time))
    # x of the room is north and y west
    assert_allclose(read.fix_velocity[:, :2], [[1.0, -2.0]] * len(read.fix_time), atol=1e-9)


def test_what_has_a_header_or_two_files_is_read_as_by_its_own_reader(simulated, tmp_path):
    known = li.read_csv(simulated / "drive/header.toml")
    for path in (simulated / "drive/header.toml", simulated / "drive"):
        read = li.read(path)
        assert_array_equal(read.gyro, known.gyro)
        assert_array_equal(read.fix_position, known.fix_position)
    table = np.column_stack([known.time, known.gyro, known.accel])
    np.savetxt(tmp_path / "imu.txt", table)
    place = np.column_stack([np.degrees(known.fix_position[:, :2]), known.fix_position[:, 2]])
    np.savetxt(tmp_path / "gnss.txt", np.column_stack([known.fix_time, place, known.fix_sigma[:, :3]]))
    files = (tmp_path / "imu.txt", tmp_path / "gnss.txt")
    one, other = li.read(*files, standstill_s=100), li.read_kf_gins(*files, standstill_s=100)
    assert_array_equal(one.gyro, other.gyro)
    assert_array_equal(one.fix_position, other.fix_position)


def novatel(number: int, ms: int, body: bytes) -> bytes:
    """A message with the short header of NovAtel's manual and its CRC-32."""
    message = b"\xaa\x44\x13" + struct.pack("<BHHI", len(body), number, 2200, ms) + body
    return message + struct.pack("<I", zlib.crc32(message, 0xFFFFFFFF) ^ 0xFFFFFFFF)


def write_novatel(file: Path, session: li.Session) -> None:
    """RAWIMUSX of an IMU of type 58 (2^-33 rad, 2^-29 m/s), and INSPVAS each second."""
    whole = []
    gyro, accel = (session.dtheta * 2**33).round(), (session.dv * 2**29).round()
    for t, w, f in zip(session.time, gyro.astype(int).tolist(), accel.astype(int).tolist()):
        # right-forward-up, as z, -y, x
        values = [-f[2], -f[0], f[1], -w[2], -w[0], w[1]]
        body = struct.pack("<BBHdI6i", 0, 58, 2200, t + 1000, 0, *values)
        whole.append((t, novatel(1462, round((t + 1000) * 1000), body)))
    for t, p, v, (w, x, y, z) in zip(
        session.epoch_time, session.position, session.velocity, session.q_bn
    ):
        roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        pitch = np.arcsin(2 * (w * y - z * x))
        heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) % (2 * np.pi)
        angles = np.degrees([roll, pitch, heading])
        numbers = [*np.degrees(p[:2]), p[2], v[0], v[1], -v[2], *angles]
        body = struct.pack("<Id9dI", 2200, t + 1000, *numbers, 3)
        whole.append((t + 1e-6, novatel(508, round((t + 1000) * 1000), body)))
    file.write_bytes(b"".join(one for _, one in sorted(whole)))


def test_a_novatel_log_is_replayed_as_by_the_program(host_sim, simulated, tmp_path):
    session = li.simulate(simulated / "short.toml", 5)
    log = tmp_path / "drive.gps"
    write_novatel(log, session)
    read = li.read(log)
    assert read.rate_hz == round(1 / session.dt) and read.kind == "increment"
    at = np.searchsorted(read.time, read.time[0] + 10)
    assert_allclose(read.gyro[at], session.dtheta[at], atol=2**-33)
    assert_allclose(read.accel[at], session.dv[at], atol=2**-29)
    host_sim("replay", "novatel", log, "--json", tmp_path / "n.json", "--out", tmp_path / "n")
    assert li.replay(read).json == (tmp_path / "n.json").read_text()


def test_a_recorded_novatel_log_without_raw_samples_is_named():
    log = DATA / "novatel-ins2.gps"
    if not log.is_file():
        pytest.skip(f"no recording at {log}")
    with pytest.raises(ValueError, match="'RAWIMUSX' is not among the messages"):
        li.read(log)


def test_what_cannot_be_read_is_named(tmp_path, simulated):
    odd = tmp_path / "odd.bin"
    odd.write_bytes(b"hello")
    for path, options, kind, words in [
        (odd, {}, ValueError, ["odd.bin", "no form that is known"]),
        (tmp_path / "none", {}, FileNotFoundError, ["none: no such file"]),
        (simulated / "drive/imu.csv", {}, ValueError, ["imu.csv", "allan_file"]),
        (simulated / "drive", {"imu_topic": "/imu"}, ValueError, ["--imu-topic", "replay csv"]),
        (simulated / "drive", {"learn_s": 100}, ValueError, ["--learn-s", "belongs to a replay"]),
        ("device:COM3", {}, ValueError, ["device:COM3"]),
    ]:
        with pytest.raises(kind) as raised:
            li.read(path, **options)
        assert all(word in str(raised.value) for word in words), raised.value


@pytest.fixture(scope="module")
def session(simulated) -> li.Session:
    return li.simulate(simulated / "short.toml", 5, learning=True)


@pytest.mark.parametrize(("errors", "count"), [("none", 0), ("biases", 6), ("matrices", 24)])
def test_the_filter_step_by_step_is_that_of_the_campaign(session, errors, count):
    """`aid` is what the campaign's rivals run; `run` and `fix` are the filter alone."""
    whole = li.Kalman.aligned(session, errors=errors)
    steps = li.Kalman.aligned(session, errors=errors)
    assert len(whole.names) == count == len(whole.estimate)
    assert whole.covariance.shape == (9 + count, 9 + count)
    first, until, n = whole.epoch, whole.epoch + 120, round(1 / session.dt)
    score = whole.aid(session, until)
    fixes = dict(zip(session.fix_time.round().astype(int).tolist(), range(len(session.fix_time))))
    alone = 0.0
    for epoch in range(first, until):
        piece = slice(epoch * n, (epoch + 1) * n)
        steps.run(session.dtheta[piece], session.dv[piece], session.dt)
        k = fixes[epoch + 1]
        velocity, sigma = session.fix_velocity[k], session.fix_sigma[k].copy()
        if epoch + 1 < session.standstill_s:  # it is known to stand
            velocity, sigma[3:] = np.zeros(3), 0.01
        alone += steps.fix(session.fix_position[k], velocity, sigma)
    assert_array_equal(steps.position, whole.position)
    assert_array_equal(steps.q_bn, whole.q_bn)
    assert_array_equal(steps.estimate, whole.estimate)
    assert_array_equal(steps.covariance, whole.covariance)
    assert alone == score


def test_the_filter_finds_what_was_simulated_and_navigates_with_it(simulated):
    session = li.simulate(simulated / "short.toml", 5)
    filter_ = li.Kalman.aligned(session, errors="scale")
    assert filter_.names[:2] == ["gyro bias x", "gyro bias y"]
    assert filter_.names[6] == "gyro scale x" and len(filter_.names) == 12
    filter_.aid(session, 300)
    off = filter_.estimate[2] - session.gyro_error[299, 2]
    assert abs(off) < 4 * filter_.sigma[2] + 1e-5
    position, velocity = filter_.free_inertial(session)
    raw, _ = li.free_inertial(session)
    assert len(position) == len(velocity)
    left = len(position) - 1
    assert np.hypot(*position[left, :2]) < 0.5 * np.hypot(*raw[-1, :2])
    for act, words in [
        (lambda: filter_.aid(session, 10), "until: is 10"),
        (lambda: li.Kalman.aligned(session, errors="all"), "'all'"),
        (lambda: li.Kalman.aligned(session, walk_per_hour=-1), "walk_per_hour: is -1"),
        (lambda: filter_.fix([0, 0, 0], [0, 0, 0], [1] * 5), "sigma"),
        (lambda: li.Kalman([0, 0, 0], [0, 0, 0], [1, 0, 0, 0], "mems", sigma=[0] * 4), "sigma"),
    ]:
        with pytest.raises(ValueError, match=words):
            act()
