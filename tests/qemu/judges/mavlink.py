"""pymavlink: a MAVLink stream on standard input, a line for each message on standard output."""

import sys

from pymavlink.dialects.v20 import common

FIELDS = ("time_usec", "xgyro", "ygyro", "zgyro", "xacc", "yacc", "zacc", "temperature", "fields_updated", "id")

decoder = common.MAVLink(None)
decoder.robust_parsing = True
for message in decoder.parse_buffer(sys.stdin.buffer.read()) or []:
    if isinstance(message, common.MAVLink_highres_imu_message):
        print("HIGHRES_IMU", message.get_header().seq, *(float(getattr(message, name)) for name in FIELDS))
    else:
        print(message.get_type())
