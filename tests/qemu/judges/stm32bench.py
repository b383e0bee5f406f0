"""The bench image (`tests/silicon`) on an STM32F4, F7 or H7: Unicorn's Cortex-M4 or M7 with the registers by which the image identifies chips, caches and
cycle counter, written from the reference manuals and stricter than they are.

What ends the run as an error: a peripheral the image has no business with, a bus fault that is not expected, the counter of a Cortex-M7 started while it is locked,
a cache turned on before every line of it was invalidated, FAULTMASK left set. There is no cache here; but what a data cache could hold back is blank in
the memory that is given out, since a probe reads behind the cache. The counter runs with the time of this machine: **its figures are nobody's cycles**.

Standard input, JSON: {"image": path, "chip": a key of CHIPS}. Standard output: "exit CODE" (semihosting's), "ram HEX" (128 KiB as a probe reads them).
"""
import json
import struct
import sys
import time

from unicorn import UC_ARCH_ARM, UC_HOOK_INTR, UC_HOOK_MEM_INVALID, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn import arm_const as arm

FLASH, SRAM = (0x0800_0000, 0x10_0000), (0x2000_0000, 0x2_0000)
SYSTEM, CORE = 0x4000_0000, 0xE000_0000
F4_F7, H7 = 0xE004_2000, 0x5C00_1000
RCC_FLASH = (0x4002_3800, 0x4002_4000)
TIMER_11 = (0x4001_4800, 0x4001_4C00)  # its input has no edges
M4, M7 = arm.UC_CPU_ARM_CORTEX_M4, arm.UC_CPU_ARM_CORTEX_M7
EXIT, STOPPED = 0x18, 0x20026

# processor, CPUID, content of the addresses of device ids, address and value of FLASH_ACR, KiB of DTCM, KiB of each cache
CHIPS = {
    "f405": (M4, 0x410F_C241, {F4_F7: 0x100F_6413}, (0x4002_3C00, 0), 0, 0),
    "f446": (M4, 0x410F_C241, {F4_F7: 0x1000_6421}, (0x4002_3C00, 0), 0, 0),
    "f722": (M7, 0x411F_C270, {F4_F7: 0x1000_0452}, (0x4002_3C00, 0), 64, 8),
    "f746": (M7, 0x410F_C271, {F4_F7: 0x1001_6449}, (0x4002_3C00, 0), 64, 4),
    "f767": (M7, 0x411F_C270, {F4_F7: 0x1001_6451}, (0x4002_3C00, 0), 128, 16),
    "h743": (M7, 0x411F_C271, {F4_F7: 0, H7: 0x2003_6450}, (0x5200_2000, 0x37), 128, 16),
    "h743-faults": (M7, 0x411F_C271, {H7: 0x2003_6450}, (0x5200_2000, 0x37), 128, 16),  # nothing answers at the other address
    "nobody": (M7, 0x411F_C271, {}, (0, 0), 128, 16),
}


class Chip:
    def __init__(self, image, name):
        self.model, self.cpuid, self.ids, self.acr, self.dtcm, self.cache = CHIPS[name]
        self.clocks = name == "f405"
        self.cpu = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.cpu.ctl_set_cpu_model(self.model)
        self.cpu.mem_map(*FLASH)
        self.cpu.mem_map(*SRAM)
        self.cpu.mmio_map(SYSTEM, 0x2000_0000, self.reads(SYSTEM), None, self.writes(SYSTEM), None)
        self.cpu.mmio_map(CORE, 0x10_0000, self.reads(CORE), None, self.writes(CORE), None)
        self.cpu.hook_add(UC_HOOK_INTR, self.exception)
        self.cpu.hook_add(UC_HOOK_MEM_INVALID, self.invalid)
        self.registers = {self.acr[0]: self.acr[1]}
        self.unlocked = self.model == M4
        self.invalid_lines, self.instructions_invalid = set(), False
        self.cfsr = 0
        self.broken = self.code = None
        self.load(image)

    def load(self, path):
        elf = open(path, "rb").read()
        start, count = struct.unpack_from("<I", elf, 28)[0], struct.unpack_from("<H", elf, 44)[0]
        for n in range(count):
            kind, offset, _, physical, size = struct.unpack_from("<5I", elf, start + 32 * n)
            if kind == 1 and size:
                self.cpu.mem_write(physical, elf[offset : offset + size])

    def stop(self, why):
        self.broken = self.broken or f"{why} at {self.cpu.reg_read(arm.UC_ARM_REG_PC):#x}"
        self.cpu.emu_stop()

    def exception(self, cpu, number, _):
        r0, r1 = cpu.reg_read(arm.UC_ARM_REG_R0), cpu.reg_read(arm.UC_ARM_REG_R1)
        if r0 != EXIT:
            return self.stop(f"exception {number}")
        if cpu.reg_read(arm.UC_ARM_REG_FAULTMASK) or self.registers.get(0xE000_ED14, 0) & 1 << 8:
            return self.stop("FAULTMASK or BFHFNMIGN left set")
        self.code = int(r1 != STOPPED)
        cpu.emu_stop()

    def invalid(self, cpu, access, address, *_):
        self.stop(f"access {access} of {address:#x}")
        return False

    def fault(self, address):
        """A bus fault of a load: ignored at priority -1 with BFHFNMIGN."""
        ignored = self.cpu.reg_read(arm.UC_ARM_REG_FAULTMASK) and self.registers.get(0xE000_ED14, 0) & 1 << 8
        if not ignored:
            self.stop(f"bus fault: {address:#x}")
        self.cfsr |= 0x8200  # BFARVALID, PRECISERR
        return 0xDEAD_B413  # invalid; code that uses it takes the chip for an F405

    @staticmethod
    def is_board(address):
        return any(first <= address < end for first, end in (RCC_FLASH, TIMER_11))

    def reads(self, base):
        return lambda _, offset, size, __: self.read(base + offset)

    def writes(self, base):
        return lambda _, offset, size, value, __: self.write(base + offset, value)

    def read(self, address):
        if address in (F4_F7, H7):
            return self.ids[address] if address in self.ids else self.fault(address)
        if address == self.acr[0] or self.clocks and self.is_board(address):
            value = self.registers.get(address, 0)
            if address == 0x4002_3800:  # RCC_CR: oscillators and PLL are ready when they are on
                value |= 2 | (value >> 16 & 1) << 17 | (value >> 24 & 1) << 25
            if address == 0x4002_3808:  # RCC_CFGR
                value |= (value & 3) << 2
            return value
        if address < CORE:
            return self.fault(address)
        if address == 0xE000_1004:
            return self.count()
        if address == 0xE000_ED80:  # CCSIDR
            ways = 2 if self.registers.get(0xE000_ED84, 0) & 1 else 4
            return (self.cache * 1024 // 32 // ways - 1) << 13 | (ways - 1) << 3 | 1
        if address == 0xE000_EDF0:
            return 1  # a debugger is connected
        return {0xE000_ED00: self.cpuid, 0xE000_ED28: self.cfsr}.get(address, self.registers.get(address, 0))

    def count(self):
        runs = self.registers.get(0xE000_1000, 0) & 1 and self.registers.get(0xE000_EDFC, 0) >> 24 & 1
        return time.perf_counter_ns() * 4 & 0xFFFF_FFFF if runs else 0

    def write(self, address, value):
        if address < CORE:
            if not (self.clocks and self.is_board(address)):
                return self.stop(f"written: {address:#x}")
        elif address >> 8 == 0xE000_EF and address != 0xE000_EF34 or address in (0xE000_ED84, 0xE000_1FB0):
            return self.write_m7(address, value)
        elif address == 0xE000_ED28:
            self.cfsr &= ~value
            return
        elif address == 0xE000_ED14:
            self.turn_on(value)
        elif address == 0xE000_1000 and not self.unlocked:
            return self.stop("the counter is locked")
        self.registers[address] = value

    def write_m7(self, address, value):
        if self.model != M7:
            return self.stop(f"a Cortex-M4 has no {address:#x}")
        if address == 0xE000_1FB0:
            self.unlocked = value == 0xC5AC_CE55
        elif address == 0xE000_EF50:
            self.instructions_invalid = True
        elif address == 0xE000_EF60:
            self.invalid_lines.add(value)
        self.registers[address] = value

    def turn_on(self, value):
        new = value & ~self.registers.get(0xE000_ED14, 0)
        if new >> 17 & 1 and not self.instructions_invalid:
            self.stop("I-cache turned on as it was found")
        if new >> 16 & 1 and len(self.invalid_lines) != self.cache * 1024 // 32:
            self.stop(f"D-cache turned on with {len(self.invalid_lines)} lines invalidated")

    def run(self):
        stack, pc = struct.unpack("<II", self.cpu.mem_read(FLASH[0], 8))
        self.cpu.reg_write(arm.UC_ARM_REG_SP, stack)
        try:
            self.cpu.emu_start(pc | 1, 0xFFFF_FFF0)
        except UcError as error:
            self.stop(str(error))
        if self.broken:
            sys.exit(self.broken)

    def seen(self):
        """RAM as a probe reads it: without data that the cache may hold."""
        ram = bytearray(self.cpu.mem_read(*SRAM))
        if self.registers.get(0xE000_ED14, 0) >> 16 & 1:
            ram[self.dtcm * 1024 :] = b"\xff" * (len(ram) - self.dtcm * 1024)
        return bytes(ram)


def main():
    asked = json.load(sys.stdin)
    chip = Chip(asked["image"], asked["chip"])
    chip.run()
    print("exit", chip.code)
    print("ram", chip.seen().hex())


if __name__ == "__main__":
    main()
