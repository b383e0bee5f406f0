"""AllanTools' side of `cargo xtask beside`: overlapping Allan deviations of increments that a file
holds as bare numbers (f64, little endian), for averages of M samples. Prints one line of JSON.

    python allan.py INCREMENTS.f64 HZ M...
"""

import json
import sys
import time
from importlib.metadata import version

import allantools
import numpy

name, rate, ms = sys.argv[1], float(sys.argv[2]), [int(m) for m in sys.argv[3:]]
increments = numpy.fromfile(name, dtype="<f8")
clock, processor = time.perf_counter(), time.process_time()
phase = numpy.concatenate([[0.0], numpy.cumsum(increments - increments.mean())])
taus, deviations, _, _ = allantools.oadev(
    phase, rate=rate, data_type="phase", taus=[m / rate for m in ms]
)
seconds = [time.perf_counter() - clock, time.process_time() - processor]
curve = [(float(tau), float(deviation)) for tau, deviation in zip(taus, deviations)]
print(json.dumps({"version": version("allantools"), "seconds": seconds, "curve": curve}))
