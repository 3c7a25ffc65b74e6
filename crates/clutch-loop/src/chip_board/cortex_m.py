"""The half of a chip's register model that is the same for all: the core of a Cortex-M on the Unicorn engine, its
exceptions and NVIC, virtual time, the exchange with the host, and the count of instructions. `stm32g474.py` and
`rp2040.py` have the registers of a chip each.

Here is what Unicorn leaves out. Code takes no time. Time goes on only while the core sleeps (WFI) with nothing to do,
or spins for ever. An interrupt is taken when the core sleeps, when a handler returns, and after an instruction that may
unmask it. Bytes that the serial line sends are gone at once; bytes for its receiver come when the host gives them.

Not modelled: pins, but for a board's button and lamp, and what is analogue; process stack (PSP), memory protection but
for regions that nobody may access, breakpoints. A register without a model is plain memory.

Protocol, little-endian. The host writes requests to standard input, and gets an answer to each on standard output:

    request   now_ns u64     time to which the chip is to go on, doing what falls due on the way
              counts i32     encoder's counts from now on
              faults u32     faults, and the button: see Fault
              length u16     and so many bytes for the receiver of the line
    answer    next_ns u64    time at which the chip wants to run next; all ones if it never does
              code u16       output of the converter
              flags u16      see Flag
              resets u32     resets since power-up
              length u16     and so many bytes that the line has sent

The first request powers the chip up, at its time. With `--count FILE` instructions are counted, and at the end FILE
gets the numbers as JSON: see Meter.
"""

from __future__ import annotations

import ctypes
import json
import struct
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol

from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn import arm_const as arm
from unicorn import unicorn_const as uc_const


class Fault:
    """Bits for the chip's faults; those from OVERRUN to UNEXPECTED, and from STACK_OVERFLOW on with ENCODER_SKIP,
    happen once, when their bit is set. The host asks a chip for those alone that it can have."""

    CONVERTER_STUCK = 1 << 0  # the converter's output does not follow its register
    CRYSTAL_DEAD = 1 << 1  # the crystal stops, or never starts
    OVERRUN = 1 << 2  # the next bytes come faster than they are read, and one is lost
    HANG = 1 << 3  # the core spins with interrupts off
    UNDEFINED = 1 << 4  # the core meets an undefined instruction
    NMI = 1 << 5
    UNEXPECTED = 1 << 6  # an interrupt that the program never enabled: number 0
    SUPPLY_LOW = 1 << 7  # the supply is below the monitor's threshold
    ENCODER_SKIP = 1 << 8  # both signals of the encoder change at once
    BROWN_OUT_LOW = 1 << 9  # the level of the supply below which the chip is in reset is as the maker delivers it
    AMPLIFIER = 1 << 10  # what is behind the converter gives 0 V
    STACK_OVERFLOW = 1 << 11  # a function calls itself without an end
    PANIC = 1 << 12  # the program comes to its panic handler
    PRESSED = 1 << 30  # no fault: the board's button is pressed
    METERED = 1 << 31  # no fault: the instructions of this request count


class Flag:
    """Bits for the state of the chip, or for what happened since the last answer."""

    SAMPLED = 1 << 0  # the encoder's count was read
    RESET = 1 << 1  # a reset
    WATCHDOG = 1 << 2  # of it the cause: the watchdog
    IN_FAULT = 1 << 3  # the core is in HardFault or NMI
    SPINNING = 1 << 4  # it does not sleep
    LOCKUP = 1 << 5  # a fault in a fault handler
    FLOATING = 1 << 6  # the converter decides nothing: what it leaves to the wiring does
    STOPPED = 1 << 7  # the core has no clock
    GUARDED = 1 << 8  # it is in HardFault because of memory that nobody may access
    LAMP = 1 << 9  # the board's lamp is lit


NEVER = (1 << 64) - 1
WORD = 0xFFFF_FFFF
PATIENCE_S = 0.1  # time of this machine after which code is suspected to spin; counting all would slow all of it
BUDGET = 2_000_000  # further instructions without sleep after which it does: 12 ms and more
AGAIN = 20_000  # instructions that a spinning core gets each time that something falls due
# Instructions for faults, in the chip's own ROM: `b .`, `udf`; `push {r0-r7, lr}` and a branch back to it.
FAULTY = b"\xfe\xe7\x00\xde\xff\xb5\xfd\xe7"
THREAD, HANDLER = 0xFFFF_FFF9, 0xFFFF_FFF1  # EXC_RETURN without floating-point state
HARD_FAULT, NMI, SVCALL, PENDSV = 3, 2, 11, 14
CALLEE = [arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12]
FRAME = [*CALLEE, arm.UC_ARM_REG_LR]
FLOATS = [arm.UC_ARM_REG_D0 + n for n in range(8)]

Read = Callable[[], int]
Write = Callable[[int], None]


class Page:
    """4 KiB of registers: plain words, and those of which reading or writing does something.

    A peripheral without its clock reads as zeros, and what is written to it is lost.
    """

    SIZE = 0x1000

    def __init__(self, chip: Chip, base: int) -> None:
        self.gates: dict[int, Callable[[], bool]] = {}  # by the KiB in the page
        self.words: dict[int, int] = {}
        self.reads: dict[int, Read] = {}
        self.writes: dict[int, Write] = {}
        chip.uc.mmio_map(base, self.SIZE, self.read, None, self.write, None)

    def read(self, _uc: Uc, offset: int, size: int, _data: Any) -> int:
        at = offset & ~3
        gate = self.gates.get(offset >> 10)
        if gate and not gate():
            return 0
        read = self.reads.get(at)
        value = self.words.get(at, 0) if read is None else read()
        return value if size == 4 else (value >> 8 * (offset & 3)) & ((1 << 8 * size) - 1)

    def write(self, _uc: Uc, offset: int, size: int, value: int, _data: Any) -> None:
        at = offset & ~3
        gate = self.gates.get(offset >> 10)
        if gate and not gate():
            return
        if size < 4:
            shift, mask = 8 * (offset & 3), (1 << 8 * size) - 1
            value = self.words.get(at, 0) & ~(mask << shift) | (value & mask) << shift
        write = self.writes.get(at)
        if write is None:
            self.words[at] = value & WORD
        else:
            write(value & WORD)


class Block:
    """A peripheral at an offset within a page; `reset` gives its registers the values that they have after one."""

    initial: ClassVar[dict[int, int]] = {}

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        self.chip, self.page, self.base = chip, page, base
        self.reset()

    def reset(self) -> None:
        for at in [at for at in self.page.words if self.base <= at < self.base + 0x400]:
            del self.page.words[at]
        for at, value in self.initial.items():
            self[at] = value

    def __getitem__(self, at: int) -> int:
        return self.page.words.get(self.base + at, 0)

    def __setitem__(self, at: int, value: int) -> None:
        self.page.words[self.base + at] = value & WORD

    def on(self, at: int, read: Read | None = None, write: Write | None = None) -> None:
        if read is not None:
            self.page.reads[self.base + at] = read
        if write is not None:
            self.page.writes[self.base + at] = write


class System(Block):
    """SCS: NVIC and system control block."""

    ICSR, VTOR, AIRCR, CFSR, HFSR, BFAR, STIR = 0xD04, 0xD08, 0xD0C, 0xD28, 0xD2C, 0xD38, 0xF00
    MPU_TYPE, MPU_CTRL, RNR, RBAR, RASR = 0xD90, 0xD94, 0xD98, 0xD9C, 0xDA0
    initial: ClassVar = {AIRCR: 0xFA05_0000, 0xF34: 0xC000_0000, MPU_TYPE: 8 << 8}

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        self.regions: dict[int, range] = {}  # of the memory protection, by number
        self.protected: list[range] = []
        super().__init__(chip, page, base)
        self.on(self.MPU_CTRL, write=self.set_protection)
        self.on(self.RBAR, write=self.set_base)
        self.on(self.RASR, lambda: 0, self.set_region)
        for n in range(4):
            for begin in (0x100, 0x200):  # ISER, ICER; ISPR, ICPR
                read = partial(self.bits, begin, n)
                self.on(begin + 4 * n, read, partial(self.set, begin, n))
                self.on(begin + 0x80 + 4 * n, read, partial(self.unset, begin, n))
        self.on(self.ICSR, lambda: chip.active[-1] if chip.active else 0, self.set_icsr)
        self.on(self.AIRCR, write=self.restart)
        self.on(self.CFSR, write=partial(self.write_one, self.CFSR))
        self.on(self.HFSR, write=partial(self.write_one, self.HFSR))
        self.on(self.STIR, write=lambda value: self.set(0x200, 0, 1 << (value & 0xFF)))

    def reset(self) -> None:
        self.page.words.clear()
        super().reset()
        self[0xD00] = self.chip.CPUID
        self.regions.clear()
        self.protect()

    def set_base(self, value: int) -> None:
        if value & 0x10:  # VALID: of another region
            self[self.RNR] = value & 15
        self[self.RBAR] = value & ~0x1F

    def set_region(self, value: int) -> None:
        if value & 1 and value >> 8 & 0x7_00FF:
            raise NotModelled(f"memory protection other than of a region without access: MPU_RASR = {value:#010x}")
        begin = self[self.RBAR]
        self.regions[self[self.RNR]] = range(begin, begin + (2 << (value >> 1 & 31)) if value & 1 else begin)
        self.protect()

    def set_protection(self, value: int) -> None:
        self[self.MPU_CTRL] = value
        self.protect()

    def protect(self) -> None:
        """Memory that nobody may access now. HFNMIENA: a fault handler may, where it is not set."""
        on = self[self.MPU_CTRL] & 1 and (self[self.MPU_CTRL] & 2 or not self.chip.in_fault())
        wanted = [region for region in self.regions.values() if region] if on else []
        if wanted == self.protected:
            return
        for regions, rights in [(self.protected, uc_const.UC_PROT_ALL), (wanted, uc_const.UC_PROT_NONE)]:
            for region in regions:
                self.chip.uc.mem_protect(region.start, len(region), rights)
        self.protected = wanted

    def guards(self, at: int) -> bool:
        return any(at in region for region in self.protected)

    def numbers(self, begin: int) -> set[int]:
        return self.chip.enabled if begin == 0x100 else self.chip.pended

    def bits(self, begin: int, n: int) -> int:
        numbers = self.numbers(begin)
        return sum(1 << bit for bit in range(32) if 16 + 32 * n + bit in numbers)

    def set(self, begin: int, n: int, value: int) -> None:
        self.numbers(begin).update(16 + 32 * n + bit for bit in range(value.bit_length()) if value >> bit & 1)
        self.chip.attend()

    def unset(self, begin: int, n: int, value: int) -> None:
        self.numbers(begin).difference_update(16 + 32 * n + bit for bit in range(32) if value >> bit & 1)

    def set_icsr(self, value: int) -> None:
        for bit, number in [(31, NMI), (28, PENDSV)]:
            if value >> bit & 1:
                self.chip.pended.add(number)
        self.chip.attend()

    def restart(self, value: int) -> None:
        if value >> 16 == 0x5FA and value & 4:
            self.chip.reset_wanted = True
            self.chip.uc.emu_stop()  # that the engine would write again does not matter

    def write_one(self, at: int, value: int) -> None:
        self[at] &= ~value

    def priority(self, number: int) -> int:
        if number <= HARD_FAULT:
            return number - 4
        at = 0x400 + number - 16 if number >= 16 else 0xD14 + number
        return self[at & ~3] >> 8 * (at & 3) >> 4 & 15


class NotModelled(Exception):
    """A function of the chip that the model does not have."""


class Source(Protocol):
    """A source of interrupts."""

    def lines(self) -> list[int]:
        """The numbers of those that it raises now."""


class Expires(Protocol):
    """A watchdog."""

    fires_ns: int


class Line(Protocol):
    """The serial line."""

    sent: bytearray

    def take(self, data: bytes) -> None:
        """Bytes come over it."""


class Chip(ABC):
    """A chip, with an image in its flash."""

    # Parts of a kind of chip.
    CORE: ClassVar[int]
    CPUID: ClassVar[int]
    FLASH: ClassVar[range]
    TABLE: ClassVar[int]  # where its table of exceptions begins
    ROM: ClassVar[int]
    watchdog: Expires
    serial: Line

    def __init__(self, image: bytes) -> None:
        self.now_ns, self.counts, self.resets = 0, 0, 0
        self.faults = self.flags = 0
        self.uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(self.CORE)
        self.image = image
        self.memory: list[Any] = []
        self.vectors: dict[int, int] = {}  # those in flash, which stay
        self.meter: Meter | None = None
        self.map_memory(image)
        uc.mem_write(self.ROM + 4, FAULTY)
        self.system = System(self, Page(self, 0xE000_E000), 0)
        self.blocks: list[Block] = [self.system]
        self.sources: list[Source] = []
        self.map_registers()
        self.hooks(image)
        self.run, self.counted = 0, False  # number of the stretch of code that runs; its instructions have a limit
        threading.Thread(target=self.watch, daemon=True).start()
        self.clear()

    @abstractmethod
    def map_memory(self, image: bytes) -> None:
        """Maps flash with the image, memory, and the chip's own ROM."""

    @abstractmethod
    def map_registers(self) -> None:
        """Maps registers; fills `blocks`, `sources`, `watchdog` and `serial`."""

    @abstractmethod
    def begin(self) -> None:
        """After a reset: memory that is no block of registers, and the first instruction."""

    @abstractmethod
    def core_hz(self) -> int:
        """The core's clock, Hz; 0 if it stands still."""

    @abstractmethod
    def timers_ns(self) -> int:
        """Time at which a timer of the chip wants to run next."""

    @abstractmethod
    def code(self) -> int:
        """Output of the converter."""

    @abstractmethod
    def floats(self) -> bool:
        """True if the converter leaves its output to the wiring."""

    def lamp(self) -> bool:
        """True if the board's lamp is lit."""
        return False

    def share(self, size: int, rights: int, *where: int) -> Any:
        memory = (ctypes.c_char * size)()
        self.memory.append(memory)  # the engine keeps no reference
        for at in where:
            self.uc.mem_map_ptr(at, size, rights, memory)
        return memory

    def plain(self, *areas: tuple[int, int]) -> None:
        """Maps what has no page as plain memory."""
        taken = {at for begin, end, _ in self.uc.mem_regions() for at in range(begin, end, 0x1000)}
        for begin, end in areas:
            for at in range(begin, end, 0x1000):
                if at not in taken:
                    self.uc.mem_map(at, 0x1000, uc_const.UC_PROT_READ | uc_const.UC_PROT_WRITE)

    def hooks(self, image: bytes) -> None:
        self.uc.hook_add(uc_const.UC_HOOK_INTR, self.interrupted)
        self.has_base = False  # the image uses BASEPRI
        # An interrupt that waits is taken when its mask goes: after CPSIE, and MSR PRIMASK or BASEPRI.
        for _, at, data in segments(image):
            if at <= self.TABLE < at + len(data):
                words = struct.iter_unpack("<I", data[self.TABLE - at : len(data) & ~3])
                self.vectors = {self.TABLE + 4 * n: word for n, (word,) in enumerate(words)}
            for n in range(0, len(data) - 3, 2):
                first, second = struct.unpack_from("<HH", data, n)
                length = 2 if first == 0xB662 else 4 if first & 0xFFF0 == 0xF380 and second in MASKS else 0
                self.has_base |= length == 4 and second != MASKS[0]
                if length:
                    after = at + n + length
                    self.uc.hook_add(uc_const.UC_HOOK_CODE, self.unmasked, None, after, after)

    def deepest_stack(self, statics_end: int) -> int:
        """Bytes from the top of the stack down to the last one that was ever written; memory begins as zeros."""
        (top,) = struct.unpack("<I", self.uc.mem_read(self.TABLE, 4))
        free = bytes(self.uc.mem_read(statics_end, top - statics_end))
        return len(free.lstrip(b"\0"))

    # Power, reset, faults.

    def clear(self) -> None:
        """Everything as after a reset, but memory."""
        self.enabled: set[int] = set()
        self.pended: set[int] = set()
        self.active: list[int] = []
        self.returns: list[int] = []  # EXC_RETURN of each
        self.waiting = self.asleep = self.spinning = self.locked = self.reset_wanted = self.overrun = False
        self.returning = self.called = self.guarded = False
        for block in self.blocks:
            block.reset()
        self.uc.reg_write(arm.UC_ARM_REG_CONTROL, 0)
        self.uc.reg_write(arm.UC_ARM_REG_PRIMASK, 0)
        self.uc.reg_write(arm.UC_ARM_REG_BASEPRI, 0)
        self.uc.reg_write(arm.UC_ARM_REG_XPSR, 1 << 24)
        self.uc.reg_write(arm.UC_ARM_REG_LR, WORD)
        self.begin()

    def reset(self, watchdog: bool = False) -> None:
        sent = self.serial.sent
        self.clear()
        self.serial.sent = sent  # is on its way
        self.resets += 1
        self.flags |= Flag.RESET | (Flag.WATCHDOG if watchdog else 0)

    def set_faults(self, faults: int) -> None:
        new = faults & ~self.faults
        if self.faults & ~faults & Fault.OVERRUN:
            self.overrun = False
        self.faults = faults
        if new & Fault.HANG:
            self.uc.reg_write(arm.UC_ARM_REG_PRIMASK, 1)
            self.pc = self.ROM + 4
            self.asleep = False
        if new & Fault.UNDEFINED:
            self.pc = self.ROM + 6
            self.asleep = False
        if new & Fault.STACK_OVERFLOW:
            self.pc = self.ROM + 8
            self.asleep = False
        if new & Fault.PANIC:
            self.pc = self.panic_handler()
            self.asleep = False
        if new & Fault.NMI:
            self.pended.add(NMI)
        if new & Fault.UNEXPECTED:
            self.enabled.add(16)
            self.pended.add(16)

    def panic_handler(self) -> int:
        at = next((at for name, at in symbols(self.image) if b"rust_begin_unwind" in name), None)
        if at is None:
            raise NotModelled("the image names no panic handler: it has none, or was stripped of its symbols")
        return at & ~1

    # Exceptions.

    def in_fault(self) -> bool:
        """True in HardFault or NMI."""
        return any(number in (HARD_FAULT, NMI) for number in self.active)

    def level(self) -> int:
        """Priority of what runs."""
        return min((self.system.priority(number) for number in self.active), default=16)

    def best(self) -> int:
        """The pending exception that comes first, whatever masks it; 0 if none is."""
        numbers = [*self.pended]
        for source in self.sources:
            numbers += source.lines()
        enabled, active, priority = self.enabled, self.active, self.system.priority
        pending = [(priority(n), n) for n in numbers if (n < 16 or n in enabled) and n not in active]
        return min(pending)[1] if pending else 0

    def next_exception(self) -> int:
        """The exception to take now; 0 for none."""
        number = self.best()
        self.waiting = number > 0
        if not number:
            return 0
        priority, level = self.system.priority(number), self.level()
        if priority >= 0:
            if self.uc.reg_read(arm.UC_ARM_REG_PRIMASK) & 1:
                return 0
            mask = self.uc.reg_read(arm.UC_ARM_REG_BASEPRI) >> 4 & 15 if self.has_base else 0
            level = min(level, mask) if mask else level
        return number if priority < level else 0

    def attend(self) -> None:
        """A register was written that may let an exception begin.

        Stopped while it writes, the engine would write again: the exception begins where the core is looked at next.
        """
        self.waiting = True

    def unmasked(self, uc: Uc, _at: int, _size: int, _data: Any) -> None:
        if self.waiting and self.next_exception():
            uc.emu_stop()

    def interrupted(self, uc: Uc, number: int, _data: Any) -> None:
        if number == EXCEPTION_EXIT:
            self.returning = True
        elif number == SUPERVISOR_CALL:
            self.pended.add(SVCALL)
        else:
            self.called = True
        uc.emu_stop()

    def enter(self, number: int, tail: int = 0) -> None:
        """Begins a handler; `tail` is the EXC_RETURN of the one after which it follows at once."""
        uc = self.uc
        if not tail:
            tail = self.push()
            if number > HARD_FAULT and self.system.guards(uc.reg_read(arm.UC_ARM_REG_SP)):
                self.guarded, number = True, HARD_FAULT  # the frame cannot be put there; what came waits
                self.system[System.CFSR] |= 1 << 4  # MSTKERR
                self.system[System.HFSR] |= 1 << 30
        self.pended.discard(number)
        self.active.append(number)
        self.system.protect()
        self.asleep = self.spinning = False
        if self.meter:
            self.meter.wakes()
            self.meter.cycles += self.meter.ENTRY
        self.returns.append(tail)
        uc.reg_write(arm.UC_ARM_REG_LR, tail)
        uc.reg_write(arm.UC_ARM_REG_XPSR, 1 << 24 | number)
        vector = self.system[System.VTOR] + 4 * number
        self.pc = self.vectors.get(vector, 0) or int.from_bytes(uc.mem_read(vector, 4), "little")

    def push(self) -> int:
        """Puts the caller's registers on the stack; the EXC_RETURN that takes them from there."""
        uc = self.uc
        stack, status = uc.reg_read(arm.UC_ARM_REG_SP), uc.reg_read(arm.UC_ARM_REG_XPSR)
        registers = [*(uc.reg_read(name) for name in FRAME), self.pc & ~1]
        floats = uc.reg_read(arm.UC_ARM_REG_CONTROL) & 4
        align = stack & 4
        frame = struct.pack("<8I", *registers, status & ~0x200 | align << 7)
        if floats:
            numbers = [uc.reg_read(name) for name in FLOATS]
            frame += struct.pack("<8QII", *numbers, uc.reg_read(arm.UC_ARM_REG_FPSCR), 0)
            uc.reg_write(arm.UC_ARM_REG_CONTROL, 0)
            uc.reg_write(arm.UC_ARM_REG_FPSCR, 0)
        stack -= align + len(frame)
        try:
            uc.mem_write(stack, frame)
        except UcError:  # there is no memory: the handler cannot run, either
            self.locked = True
        uc.reg_write(arm.UC_ARM_REG_SP, stack)
        return (HANDLER if self.active else THREAD) & ~(0x10 if floats else 0)

    def leave(self) -> None:
        """A handler ends: the next one that waits follows, or what was interrupted goes on."""
        uc = self.uc
        value = self.returns.pop()
        self.active.pop()
        self.system.protect()
        number = self.next_exception()
        if number:
            self.enter(number, value)
            return
        if self.meter:
            self.meter.cycles += self.meter.EXIT
        stack = uc.reg_read(arm.UC_ARM_REG_SP)
        *registers, status = struct.unpack("<8I", uc.mem_read(stack, 32))
        if not value & 0x10:
            *numbers, fpscr, _ = struct.unpack("<8QII", uc.mem_read(stack + 32, 72))
            for name, number in zip(FLOATS, numbers, strict=True):
                uc.reg_write(name, number)
            uc.reg_write(arm.UC_ARM_REG_FPSCR, fpscr)
            stack += 72
        uc.reg_write(arm.UC_ARM_REG_CONTROL, 0 if value & 0x10 else 4)
        uc.reg_write(arm.UC_ARM_REG_SP, stack + 32 + (status >> 7 & 4))
        uc.reg_write(arm.UC_ARM_REG_XPSR, status & ~0x200)
        *registers, self.pc = registers
        for name, number in zip(FRAME, registers, strict=True):
            uc.reg_write(name, number)

    def hard_fault(self, error: UcError) -> None:
        undefined = error.errno == uc_const.UC_ERR_INSN_INVALID
        self.guarded = error.errno in (uc_const.UC_ERR_READ_PROT, uc_const.UC_ERR_WRITE_PROT)
        self.system[System.CFSR] |= 1 << (16 if undefined else 1 if self.guarded else 9)
        self.system[System.HFSR] |= 1 << 30  # FORCED
        if self.in_fault():
            self.locked = True
        else:
            self.enter(HARD_FAULT)

    # Running.

    def step(self) -> None:
        """Runs code until the core sleeps with nothing to do, or spins, or has no clock."""
        uc, entered, suspect = self.uc, False, False
        while self.core_hz() and not self.locked:
            if not entered and (number := self.next_exception()):
                self.enter(number)
            elif self.asleep and not self.waiting:
                return
            budget = AGAIN if self.spinning else BUDGET if suspect else 0
            self.asleep = entered = False
            if budget and not self.counted:
                uc.ctl_flush_tb()  # code that is translated already would not be counted
            self.counted = budget > 0
            self.run += 1
            try:
                uc.emu_start(self.pc | 1, WORD, count=budget)
            except UcError as error:
                self.pc = uc.reg_read(arm.UC_ARM_REG_PC)
                self.hard_fault(error)
                continue
            if self.returning:
                self.returning = False
                self.leave()
                entered = True  # or there is none to enter
                continue
            self.pc = uc.reg_read(arm.UC_ARM_REG_PC)
            if self.reset_wanted:
                self.reset()
            elif self.called:  # a breakpoint, and no debugger
                self.called = False
                self.hard_fault(UcError(uc_const.UC_ERR_OK))
            elif bytes(uc.mem_read(self.pc - 2, 2)) == b"\x30\xbf":
                self.asleep = True
                if self.meter:
                    self.meter.slept()
            elif not self.next_exception():
                if budget:
                    self.spinning = True
                    return
                suspect = True

    def watch(self) -> None:
        """Stops code that runs for long, on a thread of its own; whether it spins a number of instructions decides."""
        while True:
            run = self.run
            time.sleep(PATIENCE_S)
            if run == self.run and not self.counted:
                self.uc.emu_stop()

    def next_ns(self) -> int:
        # A core that has locked up looks at no interrupt.
        return self.watchdog.fires_ns if self.locked else min(self.timers_ns(), self.watchdog.fires_ns)

    def go_to(self, now_ns: int) -> None:
        """Time passes, and what falls due on the way is done."""
        while (due := self.next_ns()) <= now_ns:
            self.now_ns = max(due, self.now_ns)
            if self.watchdog.fires_ns <= self.now_ns:
                self.reset(watchdog=True)
            self.step()
        self.now_ns = max(now_ns, self.now_ns)

    def sampled(self) -> None:
        self.flags |= Flag.SAMPLED
        if self.meter:
            self.meter.sampled()

    def put_out(self) -> None:
        if self.meter:
            self.meter.put_out()

    def state(self) -> int:
        flags = self.flags
        self.flags = 0
        if self.in_fault():
            flags |= Flag.IN_FAULT | (Flag.GUARDED if self.guarded else 0)
        flags |= Flag.SPINNING if self.spinning else 0
        flags |= Flag.LOCKUP if self.locked else 0
        flags |= 0 if self.core_hz() else Flag.STOPPED
        flags |= Flag.FLOATING if self.floats() else 0
        flags |= Flag.LAMP if self.lamp() else 0
        return flags

    def answer(self, now_ns: int, counts: int, faults: int, data: bytes) -> tuple[int, int, int, int, bytes]:
        """One exchange with the host, see the head of this file."""
        self.counts = counts
        self.set_faults(faults)
        self.go_to(now_ns)
        self.step()
        if data:
            if self.meter:
                self.meter.received()
            self.serial.take(data)
            self.step()
        sent = bytes(self.serial.sent)
        self.serial.sent.clear()
        return self.next_ns(), self.code(), self.state(), self.resets, sent


MASKS = (0x8810, 0x8811, 0x8812)  # PRIMASK, BASEPRI, BASEPRI_MAX
SUPERVISOR_CALL, EXCEPTION_EXIT = 2, 8  # as Unicorn numbers them


def segments(image: bytes) -> list[tuple[int, int, bytes]]:
    """The contents that an ELF image loads: where they lie in flash, where they run, and bytes."""
    if image[:6] != b"\x7fELF\x01\x01":
        raise ValueError("not an ELF image of 32 bits, little-endian")
    table, size, count = (*struct.unpack_from("<I", image, 28), *struct.unpack_from("<HH", image, 42))
    headers = [struct.unpack_from("<5I", image, table + size * n) for n in range(count)]
    return [(lies, runs, image[at : at + n]) for kind, at, runs, lies, n in headers if kind == 1 and n]


def statics_end(image: bytes) -> int:
    """The first address in SRAM behind what an ELF image has there: as far as its stack may reach."""
    table, size, count = (*struct.unpack_from("<I", image, 28), *struct.unpack_from("<HH", image, 42))
    headers = [struct.unpack_from("<6I", image, table + size * n) for n in range(count)]
    return max([at + size for kind, _, at, _, _, size in headers if kind == 1 and at >> 28 == 2], default=0x2000_0000)


def symbols(image: bytes) -> list[tuple[bytes, int]]:
    """Names and values of an ELF image's symbols."""
    table, size, count = (*struct.unpack_from("<I", image, 32), *struct.unpack_from("<HH", image, 46))
    sections = [struct.unpack_from("<10I", image, table + size * n) for n in range(count)]
    found = []
    for _, kind, _, _, at, length, names, *_ in sections:
        if kind == 2:
            begin = sections[names][4]
            for name, value in struct.iter_unpack("<II8x", image[at : at + length]):
                found.append((image[begin + name : image.index(0, begin + name)], value))
    return found


class Counts(NamedTuple):
    """Instructions so far, their cycles at the lower estimate, and those that come on top without a prefetch."""

    executed: int
    cycles: int
    hidden: int


class Meter(ABC):
    """Counts instructions, and estimates their cycles. The cost of an instruction, and of a wait for the flash, is the
    chip's own."""

    CLOCK_MHZ: ClassVar[int]
    BRANCH: ClassVar[int]  # further cycles of a branch that is taken
    ENTRY: ClassVar[int]  # and those of a handler's begin and end
    EXIT: ClassVar[int]

    def __init__(self, chip: Chip) -> None:
        self.chip, self.executed, self.cycles = chip, 0, 0
        self.hidden = 0  # cycles that a prefetch saves at best, and may not
        self.cost: dict[int, int] = {}
        self.next = 0
        self.woke: Counts | None = None
        self.sample: Counts | None = None
        self.bytes: Counts | None = None
        self.out: Counts | None = None
        self.kind = "other"
        self.counted: dict[str, list[Counts]] = {}
        # The servo, where an image has one, and what was counted before it was called last, from where.
        self.servo = next((at & ~1 for name, at in symbols(chip.image) if b"servo" in name and b"step" in name), -1)
        self.asked: Counts | None = None
        self.asked_from = -1
        chip.uc.hook_add(uc_const.UC_HOOK_CODE, self.instruction)
        chip.uc.hook_add(uc_const.UC_HOOK_MEM_READ, self.load, None, chip.FLASH.start, chip.FLASH.stop - 1)

    @abstractmethod
    def cycles_of(self, code: bytes) -> int:
        """Cycles of an instruction without waits."""

    @abstractmethod
    def fetched(self, at: int) -> None:
        """An instruction is fetched."""

    @abstractmethod
    def loaded(self, at: int) -> None:
        """A datum in flash is loaded."""

    def instruction(self, uc: Uc, at: int, size: int, _data: Any) -> None:
        if at == self.servo:
            self.asked, self.asked_from = self.now(), uc.reg_read(arm.UC_ARM_REG_LR) & ~1
        elif at == self.asked_from and self.asked:
            self.since("servo", self.asked, self.now())
            self.asked = None
        self.executed += 1
        cost = self.cost.get(at)
        if cost is None:
            cost = self.cost[at] = self.cycles_of(bytes(uc.mem_read(at, size)))
        self.cycles += cost + (self.BRANCH if at != self.next else 0)
        self.next = at + size
        self.fetched(at)

    def load(self, _uc: Uc, _kind: int, at: int, _size: int, _value: int, _data: Any) -> None:
        self.loaded(at)

    def now(self) -> Counts:
        return Counts(self.executed, self.cycles, self.hidden)

    def since(self, name: str, begin: Counts, end: Counts) -> None:
        if self.chip.faults & Fault.METERED:
            self.counted.setdefault(name, []).append(Counts(*(e - b for b, e in zip(begin, end, strict=True))))

    def wakes(self) -> None:
        if not self.woke:
            self.woke, self.kind = self.now(), "other"

    def sampled(self) -> None:
        self.sample, self.kind = self.now(), "period"

    def received(self) -> None:
        self.bytes = self.woke = self.now()
        self.kind = "bytes"

    def put_out(self) -> None:
        """A code goes to the converter: the last one after a sample, or after bytes came, is the answer to them."""
        self.out = self.now()

    def slept(self) -> None:
        if self.woke:
            self.since(self.kind, self.woke, self.now())
        if self.out and (begun := self.sample or self.bytes):
            self.since("sample_to_converter" if self.sample else "bytes_to_converter", begun, self.out)
        self.woke = self.sample = self.bytes = self.out = None

    def report(self) -> dict[str, Any]:
        """Lowest, mean and highest number of instructions, and of estimated microseconds, by what they were for: with
        the best that a prefetch can do, if the image switches one on, and without any."""

        def figures(numbers: list[float]) -> dict[str, float]:
            return {"lowest": min(numbers), "mean": sum(numbers) / len(numbers), "highest": max(numbers)}

        return {
            name: {
                "count": len(many),
                "instructions": figures([float(one.executed) for one in many]),
                "estimated_us": figures([one.cycles / self.CLOCK_MHZ for one in many]),
                "estimated_us_without_prefetch": figures([(one.cycles + one.hidden) / self.CLOCK_MHZ for one in many]),
            }
            for name, many in self.counted.items()
        }


def serve(kind: type[Chip], meter: type[Meter]) -> None:
    """A chip with the image of the command line, until the host has no more requests."""
    image, *rest = sys.argv[1:]
    chip = kind(Path(image).read_bytes())
    if rest[:1] == ["--count"]:
        chip.meter = meter(chip)
    requests, answers = sys.stdin.buffer, sys.stdout.buffer
    head = struct.Struct("<QiIH")
    while len(request := requests.read(head.size)) == head.size:
        now_ns, counts, faults, length = head.unpack(request)
        next_ns, code, flags, resets, sent = chip.answer(now_ns, counts, faults, requests.read(length))
        answers.write(struct.pack("<QHHIH", next_ns, code, flags, resets, len(sent)) + sent)
        answers.flush()
    if chip.meter:
        report = chip.meter.report() | {"stack_bytes": chip.deepest_stack(statics_end(Path(image).read_bytes()))}
        Path(rest[1]).write_text(json.dumps(report))
