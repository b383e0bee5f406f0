"""NovAtel's own decoder: binary logs on standard input, a line of numbers each on standard output."""

import sys

from novatel_edie import oem

FIELDS = ("gps_week", "gps_seconds", "imu_status", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")

parser = oem.Parser()
data = sys.stdin.buffer.read()
for start in range(0, len(data), 8192):
    parser.write(data[start : start + 8192])
    for message in parser:
        if not hasattr(message, "to_dict"):
            continue  # bytes that are no message
        fields = message.to_dict()
        print(message.name, *(repr(fields[name]) for name in FIELDS))
