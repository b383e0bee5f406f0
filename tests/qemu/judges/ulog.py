"""Logs of PX4 by pyulog, the tool of PX4.

Argument: the file to write. Standard input, a line a message: "imu END_US gx gy gz ax ay az LENGTH_US" (increments),
"gps US lat lon h speed_accuracy eph epv vn ve vd fix_type" or "attitude US w x y z". This file makes a log from the documentation of
the format, pyulog reads it, and what pyulog writes again is the result. Numbers are rounded to the types of PX4's messages.
Standard output: how many messages of each topic pyulog found.
"""

import struct
import sys
import tempfile

from pyulog import ULog

TOPICS = {
    "imu": (
        "vehicle_imu",
        "uint64_t timestamp;uint64_t timestamp_sample;uint32_t accel_device_id;float[3] delta_angle;float[3] delta_velocity;"
        "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;uint8_t delta_angle_clipping;uint8_t[7] _padding0;",
    ),
    "gps": (
        "vehicle_gps_position",
        "uint64_t timestamp;uint64_t timestamp_sample;double latitude_deg;double longitude_deg;double altitude_msl_m;"
        "double altitude_ellipsoid_m;float s_variance_m_s;float eph;float epv;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;"
        "uint8_t fix_type;bool vel_ned_valid;uint8_t[6] _padding0;",
    ),
    "attitude": ("vehicle_attitude", "uint64_t timestamp;float[4] q;"),
}


def message(kind, content):
    return struct.pack("<HB", len(content), ord(kind)) + content


def fields(kind, values):
    us = int(values[0])
    numbers = [float(value) for value in values[1:]]
    if kind == "imu":
        length = int(numbers[6])
        return struct.pack("<QQI6fIIB", us + 700, us, 1310988, *numbers[:6], length, length, 0)
    if kind == "gps":
        latitude, longitude, height, *floats, fix_type = numbers
        return struct.pack("<QQ4d6fBB", us, 0, latitude, longitude, height - 47.0, height, *floats, int(fix_type), 1)
    return struct.pack("<Q4f", us, *numbers)


out = bytes.fromhex("554c6f67011235") + struct.pack("<BQ", 1, 1000)
out += message("B", bytes(40))
key = b"float EKF2_GPS_DELAY"
out += message("P", bytes([len(key)]) + key + struct.pack("<f", 110.0))
for topic, declared in TOPICS.values():
    out += message("F", f"{topic}:{declared}".encode())
for number, (topic, _) in enumerate(TOPICS.values()):
    out += message("A", struct.pack("<BH", 0, number) + topic.encode())
numbers = {kind: number for number, kind in enumerate(TOPICS)}
for line in sys.stdin:
    kind, *values = line.split()
    out += message("D", struct.pack("<H", numbers[kind]) + fields(kind, values))
with tempfile.NamedTemporaryFile(suffix=".ulg") as file:
    file.write(out)
    file.flush()
    log = ULog(file.name)
assert not log.file_corruption
for data in log.data_list:
    print(data.name, len(data.data["timestamp"]))
log.write_ulog(sys.argv[1])
