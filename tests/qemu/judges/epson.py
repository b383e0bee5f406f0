"""Epson's own Python driver: bursts on standard input, a line of scaled numbers each on standard output.

Arguments: model, BURST_CTRL1, BURST_CTRL2, range of the delta angle and of the delta velocity. The driver's port and its
registers are replaced; fields, their order, their width and their scale are the driver's. It does not look at the checksum,
so this file does: the sum of the 16-bit words between start mark and checksum.
"""

import importlib
import io
import struct
import sys
from types import SimpleNamespace

from esensorlib import imu_fn
from loguru import logger

logger.remove()  # else a line on standard error for each damaged burst

model, burst_ctrl1, burst_ctrl2, angle_range, velocity_range = (
    sys.argv[1],
    *(int(text, 0) for text in sys.argv[2:]),
)
definitions = importlib.import_module(f"esensorlib.model.m{model.lower()}")
data = io.BytesIO(sys.stdin.buffer.read())
size = len(data.getvalue())
registers = {
    definitions.Reg.BURST_CTRL1.ADDR: burst_ctrl1,
    definitions.Reg.BURST_CTRL2.ADDR: burst_ctrl2,
}
port = SimpleNamespace(
    in_waiting=lambda: size - data.tell(),
    read_bytes=data.read,
    reset_input_buffer=lambda: None,
    find_delimiter=lambda verbose: None,
)
driver = imu_fn.ImuFn(
    SimpleNamespace(get_reg=lambda window, address, verbose: registers[address], set_reg=lambda *_: None, port_io=port),
    definitions,
    {"prod_id": model.upper(), "version_id": None, "serial_id": None},
)
driver._get_burst_config()
driver._status.update(is_config=False, uart_auto=True, dlta_sf_range=angle_range, dltv_sf_range=velocity_range)
length = struct.calcsize(driver._b_struct)
while size - data.tell() >= length:
    start = data.tell()
    sample = driver.read_sample()
    burst = data.getvalue()[start : start + length]
    words = struct.unpack(f">{(length - 2) // 2}H", burst[1:-1])
    if sample and sum(words[:-1]) & 0xFFFF == words[-1]:
        print(*(f"{name}={value!r}" for name, value in zip(driver.burst_fields, sample)))
