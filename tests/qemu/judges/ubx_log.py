"""pyubx2 writes a log of a u-blox receiver with an IMU.

Argument: the file to write. Standard input, a line a message: "raw TAG gx gy gz ax ay az" (counts), "meas MS gx gy gz ax ay az" (counts) or
"pvt ITOW lat lon height hacc vacc vn ve vd sacc" (units of the message).
"""

import struct
import sys

from pyubx2 import GET, UBXMessage, UBXReader

KINDS = (14, 13, 5, 16, 17, 18)


def data(kind, value):
    return struct.pack("<I", kind << 24 | value & 0xFFFFFF)


def checked(name, payload, **expected):
    """The message, if pyubx2 finds the expected fields in it."""
    message = UBXMessage("ESF", name, GET, payload=payload)
    found = UBXReader.parse(message.serialize())
    for field, value in expected.items():
        assert getattr(found, field) == value, (field, value, str(found))
    return message


def raw(tag, *values):
    groups = [data(kind, value) for kind, value in zip(KINDS, values)]
    groups.append(data(12, 3150))  # temperature
    stamp = struct.pack("<I", tag)
    expected = {f"data_{n:02}": group for n, group in enumerate(groups, 1)}
    expected |= {f"sTag_{n:02}": stamp for n in range(1, 8)}
    return [checked("ESF-RAW", bytes(4) + b"".join(group + stamp for group in groups), **expected)]


def meas(ms, *values):
    out = []
    for axes in (range(3), range(3, 6)):
        payload = struct.pack("<IHH", ms, 3 << 11, 0) + b"".join(data(KINDS[axis], values[axis]) for axis in axes)
        expected = {"timeTag": ms, "numMeas": 3}
        expected |= {f"dataType_{n:02}": KINDS[axis] for n, axis in enumerate(axes, 1)}
        expected |= {f"dataField_{n:02}": values[axis] & 0xFFFFFF for n, axis in enumerate(axes, 1)}
        out.append(checked("ESF-MEAS", payload, **expected))
    return out


def pvt(itow, lat, lon, height, h_acc, v_acc, north, east, down, s_acc):
    fields = dict(iTOW=itow, year=2025, month=6, day=1, hour=12, min=0, second=itow // 1000 % 60, validDate=1, validTime=1, fullyResolved=1)
    fields |= dict(fixType=4, gnssFixOk=1, numSV=20, lat=lat / 1e7, lon=lon / 1e7, height=height, hAcc=h_acc, vAcc=v_acc)
    fields |= dict(velN=north, velE=east, velD=down, sAcc=s_acc)
    return [UBXMessage("NAV", "NAV-PVT", GET, **fields)]


with open(sys.argv[1], "wb") as file:
    for line in sys.stdin:
        kind, *values = line.split()
        for message in {"raw": raw, "meas": meas, "pvt": pvt}[kind](*map(int, values)):
            file.write(message.serialize())
