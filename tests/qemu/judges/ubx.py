"""pyubx2: UBX messages on standard input, a line of NAV-PVT fields each on standard output."""

import sys

from pyubx2 import UBXReader

reader = UBXReader(sys.stdin.buffer, quitonerror=2)
for _, message in reader:
    print(
        message.identity,
        message.iTOW,
        round(message.lat * 1e7),
        round(message.lon * 1e7),
        message.height,
        message.velN,
        message.velE,
        message.velD,
        message.fixType,
        message.numSV,
        message.hAcc,
    )
