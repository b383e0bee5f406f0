"""Messages of satellite receivers, made and read by third-party libraries: pyubx2, pynmeagps, NovAtel's own encoder, pysbf2.

Standard output, a line a message: format, bytes in hexadecimal, and what the library reads in them: ms (of the day for NMEA, else of the week), lat, lon
(degrees), h (m above the ellipsoid), speed and course (m/s, degrees) or n, e, d (m/s), s0 to s5 (standard deviations), heading and hs (degrees).
"""

import io
import math
import random
import struct

from novatel_edie import ENCODE_FORMAT, oem
from pynmeagps import NMEAReader
from pysbf2 import SBFReader
from pyubx2 import GET, UBXMessage, UBXReader

draw = random.Random(13)


def report(name, data, **values):
    print(name, data.hex(), *(f"{key}={value!r}" for key, value in values.items() if value is not None))


def ubx():
    ms = draw.randrange(604_800_000)
    accuracy = {"hAcc": draw.randrange(8, 9000), "vAcc": draw.randrange(8, 9000), "sAcc": draw.randrange(8, 2000)}
    place = {"lat": draw.uniform(-90, 90), "lon": draw.uniform(-180, 180), "height": draw.randrange(-400_000, 9_000_000)}
    velocity = {axis: draw.randrange(-50_000, 50_000) for axis in ("velN", "velE", "velD")}
    data = UBXMessage("NAV", "NAV-PVT", GET, iTOW=ms, fixType=3, gnssFixOk=1, **place, **velocity, **accuracy).serialize()
    m = UBXReader.parse(data)
    h, v, s = m.hAcc / 1000 / math.sqrt(2), m.vAcc / 1000, m.sAcc / 1000 / math.sqrt(3)
    north, east, down = (getattr(m, axis) / 1000 for axis in velocity)
    report("Ubx", data, ms=m.iTOW, lat=m.lat, lon=m.lon, h=m.height / 1000, n=north, e=east, d=down, s0=h, s1=h, s2=v, s3=s, s4=s, s5=s)
    names = [f"{what}Cov{axes}" for what in ("pos", "vel") for axes in ("NN", "NE", "ND", "EE", "ED", "DD")]
    covariance = {name: draw.uniform(0.01, 9) for name in names}
    data = UBXMessage("NAV", "NAV-COV", GET, iTOW=ms, version=0, posCovValid=1, velCovValid=1, **covariance).serialize()
    m = UBXReader.parse(data)
    diagonal = (m.posCovNN, m.posCovEE, m.posCovDD, m.velCovNN, m.velCovEE, m.velCovDD)
    report("Ubx", data, ms=m.iTOW, **{f"s{k}": math.sqrt(variance) for k, variance in enumerate(diagonal)})
    flags = {"gnssFixOK": 1, "relPosValid": 1, "carrSoln": 2, "isMoving": 1, "relPosHeadingValid": 1}
    angles = {"relPosHeading": draw.uniform(0, 360), "accHeading": draw.uniform(0.1, 5)}
    data = UBXMessage("NAV", "NAV-RELPOSNED", GET, version=1, iTOW=ms, **angles, **flags).serialize()
    m = UBXReader.parse(data)
    report("Ubx", data, ms=m.iTOW, heading=m.relPosHeading, hs=m.accHeading)
    millimetres = {"hAcc": accuracy["hAcc"], "vAcc": accuracy["vAcc"]}
    data = UBXMessage("NAV", "NAV-POSLLH", GET, iTOW=ms, **place, **millimetres).serialize()
    m = UBXReader.parse(data)
    report("Ubx", data, ms=m.iTOW, lat=m.lat, lon=m.lon, h=m.height / 1000, s0=m.hAcc / 1000 / math.sqrt(2), s2=m.vAcc / 1000)
    data = UBXMessage("NAV", "NAV-VELNED", GET, iTOW=ms, sAcc=accuracy["sAcc"], **{axis: v // 10 for axis, v in velocity.items()}).serialize()
    m = UBXReader.parse(data)
    north, east, down = (getattr(m, axis) / 100 for axis in velocity)
    report("Ubx", data, ms=m.iTOW, n=north, e=east, d=down, s3=m.sAcc / 100 / math.sqrt(3))
    data = UBXMessage("NAV", "NAV-HPPOSLLH", GET, iTOW=ms, version=0, **place, **millimetres).serialize()
    m = UBXReader.parse(data)
    report("Ubx", data, ms=m.iTOW, lat=m.lat, lon=m.lon, h=m.height / 1000, s0=m.hAcc / 1000 / math.sqrt(2), s2=m.vAcc / 1000)


def sentence(text):
    total = 0
    for byte in text.encode():
        total ^= byte
    return f"${text}*{total:02X}\r\n".encode()


def nmea():
    time = f"{draw.randrange(24):02}{draw.randrange(60):02}{draw.randrange(60):02}.{draw.randrange(0, 100, 20):02}"
    place = f"{draw.randrange(90):02}{draw.uniform(0, 59.9):09.6f},{draw.choice('NS')},{draw.randrange(180):03}{draw.uniform(0, 59.9):09.6f},{draw.choice('EW')}"
    sea, geoid = f"{draw.uniform(-50, 4000):.3f}", f"{draw.uniform(-90, 90):.3f}"
    talker = draw.choice(["GP", "GN", "GL", "GA", "GB"])
    ms = lambda m: round(((m.time.hour * 60 + m.time.minute) * 60 + m.time.second) * 1000 + m.time.microsecond / 1000)
    gga = sentence(f"{talker}GGA,{time},{place},2,12,{draw.uniform(0.5, 3):.2f},{sea},M,{geoid},M,,0")
    m = NMEAReader.parse(gga)
    report("Nmea", gga, ms=ms(m), lat=m.lat, lon=m.lon, h=m.alt + m.sep, s0=1.9 * m.HDOP / math.sqrt(2), s2=3.8 * m.HDOP)
    gns = sentence(f"{talker}GNS,{time},{place},RNNN,12,{draw.uniform(0.5, 3):.2f},{sea},{geoid},,0,V")
    m = NMEAReader.parse(gns)
    report("Nmea", gns, ms=ms(m), lat=m.lat, lon=m.lon, h=m.alt + m.sep, s0=0.05 * m.HDOP / math.sqrt(2), s2=0.1 * m.HDOP)
    speed, course = f"{draw.uniform(0, 90):.3f}", f"{draw.uniform(0, 360):.2f}"
    rmc = sentence(f"{talker}RMC,{time},A,{place},{speed},{course},221126,,,D,V")
    m = NMEAReader.parse(rmc)
    report("Nmea", rmc, ms=ms(m), speed=m.spd * 1852 / 3600, course=m.cog)
    vtg = sentence(f"{talker}VTG,{course},T,,M,{speed},N,{float(speed) * 1.852:.3f},K,D")
    m = NMEAReader.parse(vtg)
    report("Nmea", vtg, speed=m.sogk / 3.6, course=m.cogt)
    gst = sentence(f"{talker}GST,{time},1.0,,,,{draw.uniform(0.01, 9):.3f},{draw.uniform(0.01, 9):.3f},{draw.uniform(0.01, 9):.3f}")
    m = NMEAReader.parse(gst)
    report("Nmea", gst, ms=ms(m), s0=m.stdLat, s1=m.stdLong, s2=m.stdAlt)
    ths = sentence(f"{talker}THS,{draw.uniform(0, 360):.2f},A")
    report("Nmea", ths, heading=NMEAReader.parse(ths).headt, hs=1.0)
    hdt = sentence(f"{talker}HDT,{draw.uniform(0, 360):.2f},T")
    report("Nmea", hdt, heading=NMEAReader.parse(hdt).headingT, hs=1.0)


def log(text):
    """An ASCII log with its checksum, as NovAtel's encoder writes it in binary and in text, and as its decoder reads that."""
    total = 0
    for byte in text.encode():
        total ^= byte
        for _ in range(8):
            total = total >> 1 ^ (0xEDB88320 if total & 1 else 0)
    parser = oem.Parser()
    parser.write(f"#{text}*{total:08x}\r\n".encode())
    message = next(iter(parser))
    binary, text = (bytes(message.encode(form).message) for form in (ENCODE_FORMAT.BINARY, ENCODE_FORMAT.ASCII))
    parser.write(binary)
    return (binary, text.rstrip()), next(iter(parser))


def novatel():
    ms = draw.randrange(604_800_000)
    header = f"COM1,0,90.5,FINESTEERING,2400,{ms / 1000:.3f},02000000,0000,32768;SOL_COMPUTED"
    sigmas = ",".join(f"{draw.uniform(0.01, 9):.4f}" for _ in range(3))
    place = f"{draw.uniform(-90, 90):.11f},{draw.uniform(-180, 180):.11f},{draw.uniform(-50, 4000):.4f},{draw.uniform(-90, 90):.4f}"
    name, kind = draw.choice(["BESTPOSA", "BESTGNSSPOSA"]), draw.choice(["SINGLE", "PSRDIFF", "NARROW_INT", "PPP"])
    both, m = log(f'{name},{header},{kind},{place},WGS84,{sigmas},"",0.000,0.000,19,19,19,19,00,06,00,33')
    f = m.to_dict()
    sigmas = {f"s{k}": f[f"{axis}_std_dev"] for k, axis in enumerate(("latitude", "longitude", "height"))}
    for data in both:
        report("Novatel", data, ms=ms, lat=f["latitude"], lon=f["longitude"], h=f["orthometric_height"] + f["undulation"], **sigmas)
    name = draw.choice(["BESTVELA", "BESTGNSSVELA"])
    speed = f"{draw.uniform(0, 40):.4f},{draw.uniform(0, 360):.6f},{draw.uniform(-5, 5):.4f}"
    both, m = log(f"{name},{header},DOPPLER_VELOCITY,0.000,0.000,{speed},0.0")
    f = m.to_dict()
    for data in both:
        report("Novatel", data, ms=ms, speed=f["horizontal_speed"], course=f["ground_track"], d=-f["z"], s3=0.05, s5=0.05)
    angles = f"{draw.uniform(0, 360):.6f},0.5,0.0,{draw.uniform(0.1, 5):.6f},0.25"
    both, m = log(f'HEADING2A,{header},NARROW_INT,1.5,{angles},"0001","0002",18,17,17,16,00,01,00,33')
    f = m.to_dict()
    for data in both:
        report("Novatel", data, ms=ms, heading=f["heading"], hs=f["heading_std_dev"])


def block(number, body):
    """An SBF block around its content, and as pysbf2 reads it."""
    body += bytes(-(len(body) + 8) % 4)
    rest = struct.pack("<HH", number, len(body) + 8) + body
    total = 0
    for byte in rest:
        total ^= byte << 8
        for _ in range(8):
            total = (total << 1 ^ 0x1021 if total & 0x8000 else total << 1) & 0xFFFF
    data = b"$@" + struct.pack("<H", total) + rest
    return data, SBFReader(io.BytesIO(data), quitonerror=2).read()[1]


def sbf():
    ms = draw.randrange(604_800_000)
    when = struct.pack("<IH", ms, 2400)
    mode = struct.pack("<BB", draw.choice([1, 2, 4, 5, 6, 10]), 0)
    place = struct.pack("<ddd", draw.uniform(-1.57, 1.57), draw.uniform(-3.14, 3.14), draw.uniform(-50, 4000))
    motion = struct.pack("<fffff", 48.0, draw.uniform(-40, 40), draw.uniform(-40, 40), draw.uniform(-5, 5), -2e10)
    accuracy = struct.pack("<HHHB", 200, draw.randrange(1, 900), draw.randrange(1, 900), 0)
    middle = struct.pack("<df4BHHIBBH", 0.1, 0.0, 0, 0, 20, 0, 1, 100, 3, 0, 1, 0)
    data, m = block(4007 | 2 << 13, when + mode + place + motion + middle + accuracy)
    lat, lon = math.degrees(m.Latitude), math.degrees(m.Longitude)
    h, v = m.HAccuracy / 2 / math.sqrt(2), m.VAccuracy / 2
    report("Sbf", data, ms=ms, lat=lat, lon=lon, h=m.Height, n=m.Vn, e=m.Ve, d=-m.Vu, s0=h, s1=h, s2=v, s3=0.05)
    lat, lon, h = struct.unpack("<ddd", place)
    square = 2 / 298.257223563 - 1 / 298.257223563**2
    radius = 6378137 / math.sqrt(1 - square * math.sin(lat) ** 2)
    across, along = (radius + h) * math.cos(lat), (radius * (1 - square) + h) * math.sin(lat)
    point = struct.pack("<ddd", across * math.cos(lon), across * math.sin(lon), along)
    data, m = block(4006 | 2 << 13, when + mode + point + motion + middle + accuracy)
    east = math.cos(lon) * m.Vy - math.sin(lon) * m.Vx
    out = math.cos(lon) * m.Vx + math.sin(lon) * m.Vy
    north, down = math.cos(lat) * m.Vz - math.sin(lat) * out, -math.cos(lat) * out - math.sin(lat) * m.Vz
    report("Sbf", data, ms=ms, lat=math.degrees(lat), lon=math.degrees(lon), h=h, n=north, e=east, d=down, s3=0.05)
    variances = struct.pack("<10f", *(draw.uniform(0.01, 9) for _ in range(10)))
    data, m = block(5906, when + mode + variances)
    report("Sbf", data, ms=ms, s0=math.sqrt(m.Cov_latlat), s1=math.sqrt(m.Cov_lonlon), s2=math.sqrt(m.Cov_hgthgt))
    data, m = block(5908, when + mode + variances)
    report("Sbf", data, ms=ms, s3=math.sqrt(m.Cov_VnVn), s4=math.sqrt(m.Cov_VeVe), s5=math.sqrt(m.Cov_VuVu))
    data, m = block(5938, when + struct.pack("<BBHH6f", 20, 0, 2, 0, draw.uniform(0, 360), *[-2e10] * 5))
    report("Sbf", data, ms=ms, heading=m.Heading, hs=0.5)


for _ in range(50):
    for make in (ubx, nmea, novatel, sbf):
        make()
