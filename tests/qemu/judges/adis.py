"""Frames around ADIS bursts on standard input, a line of numbers each on standard output.

Written from docs/ICD.md, section 2.1, alone: no package, and no code of this project. The values are counts.
"""

import struct
import sys
import zlib

data = sys.stdin.buffer.read()
at = 0
while at + 8 <= len(data):
    length, flags, time = struct.unpack_from("<BBI", data, at + 2)
    end = at + 8 + length
    whole = data[at : at + 2] == b"\xad\x15" and length in (20, 32, 40) and end + 4 <= len(data)
    if not whole or zlib.crc32(data[at:end]) != struct.unpack_from("<I", data, end)[0]:
        at += 1
        continue
    words = struct.unpack(f">{length // 2}H", data[at + 8 : end])
    if length == 40:
        first = next(n for n in range(1, 4) if words[n - 1] == 0xA5A5 and words[n] != 0xA5A5)
        diagnosis, temperature, *values, counter = words[first : first + 15]
        swapped = b"".join(struct.pack("<H", word) for word in words[first : first + 15])
        own = words[first + 15] | words[first + 16] << 16
        good = zlib.crc32(swapped) == own
    else:
        diagnosis, *values, temperature, counter, own = words
        good = sum(data[at + 8 : end - 2]) & 0xFFFF == own
    bits = 16
    if length != 20:
        values = [low | high << 16 for low, high in zip(values[::2], values[1::2])]
        bits = 32
    values = [value - (1 << bits) if value >> (bits - 1) else value for value in values]
    if good:
        print(flags, time, diagnosis, *values, temperature, counter)
    at = end + 4
