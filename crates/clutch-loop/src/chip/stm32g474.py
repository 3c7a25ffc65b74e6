"""Register model of an STM32G474RE, on which an unmodified image runs in virtual time: `python3 stm32g474.py IMAGE`.

The core is Unicorn's Cortex-M4F; what Unicorn leaves out is here: exceptions, NVIC, and the peripherals that the
image drives. Code takes no time. Time goes on only while the core sleeps (WFI) with nothing to do, or spins for ever.
An interrupt is taken when the core sleeps, when a handler returns, and after an instruction that may unmask it.
Bytes that the serial line sends are gone at once; bytes for its receiver come when the host gives them.

Not modelled: pins and what is analogue, clock gates of the peripherals, process stack (PSP), memory protection,
breakpoints. A register without a model is plain memory.

Protocol, little-endian. The host writes requests to standard input, and gets an answer to each on standard output:

    request   now_ns u64     time to which the chip is to go on, doing what falls due on the way
              counts i32     encoder's counts from now on
              faults u32     faults, see Fault
              length u16     and so many bytes for the receiver of LPUART1
    answer    next_ns u64    time at which the chip wants to run next; all ones if it never does
              code u16       output of DAC1, channel 1
              flags u16      see Flag
              resets u32     resets since power-up
              length u16     and so many bytes that LPUART1 has sent

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
from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn import arm_const as arm
from unicorn import unicorn_const as uc_const


class Fault:
    """Bits for the chip's faults; those from OVERRUN to UNEXPECTED happen once, when their bit is set."""

    CONVERTER_STUCK = 1 << 0  # DOR1 does not follow DHR
    CRYSTAL_DEAD = 1 << 1  # HSE stops, or never starts
    OVERRUN = 1 << 2  # the next bytes come faster than they are read: ORE, and the ninth is lost
    HANG = 1 << 3  # the core spins with interrupts off
    UNDEFINED = 1 << 4  # the core meets an undefined instruction
    NMI = 1 << 5
    UNEXPECTED = 1 << 6  # an interrupt that the program never enabled: WWDG
    SUPPLY_LOW = 1 << 7  # the supply is below the monitor's threshold: PVDO, while the monitor is on
    METERED = 1 << 31  # no fault: the instructions of this request count


class Flag:
    """Bits for the state of the chip, or for what happened since the last answer."""

    SAMPLED = 1 << 0  # the count of TIM3 was read
    RESET = 1 << 1  # a reset
    WATCHDOG = 1 << 2  # of it the cause: IWDG
    IN_FAULT = 1 << 3  # the core is in HardFault or NMI
    SPINNING = 1 << 4  # it does not sleep
    LOCKUP = 1 << 5  # a fault in a fault handler
    FLOATING = 1 << 6  # the converter is off, its pin floats
    STOPPED = 1 << 7  # the core has no clock


NEVER = (1 << 64) - 1
WORD = 0xFFFF_FFFF
HSI_HZ, HSE_HZ, LSI_HZ = 16_000_000, 24_000_000, 32_000
PATIENCE_S = 0.1  # time of this machine after which code is suspected to spin; counting all would slow all of it
BUDGET = 2_000_000  # further instructions without sleep after which it does: 12 ms and more at 170 MHz
AGAIN = 20_000  # instructions that a spinning core gets each time that something falls due
ROM = 0x1FFF_0000  # system memory, here with two instructions for faults: `b .` and `udf`
SPIN, UNDEFINED = ROM + 4, ROM + 6
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

    def __init__(self, chip: Chip, base: int) -> None:
        self.gates: dict[int, Callable[[], bool]] = {}  # by the KiB in the page
        self.words: dict[int, int] = {}
        self.reads: dict[int, Read] = {}
        self.writes: dict[int, Write] = {}
        chip.uc.mmio_map(base, 0x1000, self.read, None, self.write, None)

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


class Timer(Block):
    """A timer that counts up: CR1, DIER, SR, EGR, CNT, PSC, ARR, CCR1 to CCR4."""

    CR1, DIER, SR, EGR, CNT, PSC, ARR, CCR1 = 0x00, 0x0C, 0x10, 0x14, 0x24, 0x28, 0x2C, 0x34
    initial: ClassVar = {ARR: 0xFFFF}

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        self.on(self.CR1, write=self.set_control)
        self.on(self.SR, self.status, self.clear)
        self.on(self.EGR, write=self.generate)
        self.on(self.CNT, self.count, self.set_count)
        self.on(self.PSC, write=self.set_prescaler)
        for at in [self.DIER, self.ARR, *(self.CCR1 + 4 * n for n in range(4))]:
            self.on(at, write=partial(self.set_plain, at))

    def reset(self) -> None:
        super().reset()
        self.prescaler = 0  # in force; PSC itself takes effect with an update
        self.hold(0)

    def hold(self, ticks: int) -> None:
        """Counts from `ticks` on, from now on."""
        self.since_ns = self.seen_ns = self.chip.now_ns
        self.from_ticks = self.seen = ticks

    def period(self) -> int:
        return self[self.ARR] + 1

    def ticks(self) -> int:
        """Ticks since a count of 0, with all the turns since."""
        hz = self.chip.rcc.timer_hz if self[self.CR1] & 1 else 0
        return self.from_ticks + (self.chip.now_ns - self.since_ns) * hz // ((self.prescaler + 1) * 1_000_000_000)

    def rebase(self) -> None:
        """Before the clock changes: what has passed has passed."""
        self.status()
        self.hold(self.ticks() % self.period())

    def due(self, ticks: int, point: int) -> int:
        """The first tick after `ticks` with this count."""
        return ticks + 1 + (point - ticks - 1) % self.period()

    def points(self) -> list[int]:
        """Counts at which the flags UIF and CC1IF to CC4IF are set; none for a channel beyond the period."""
        return [0, *(self[self.CCR1 + 4 * n] for n in range(4))]

    def status(self) -> int:
        if self.chip.now_ns == self.seen_ns:
            return self[self.SR]
        self.seen_ns, now = self.chip.now_ns, self.ticks()
        if now > self.seen:
            for bit, point in enumerate(self.points()):
                if point < self.period() and self.due(self.seen, point) <= now:
                    self[self.SR] |= 1 << bit
            self.seen = now
        return self[self.SR]

    def lines(self) -> list[int]:
        return [16 + 50] if self.status() & self[self.DIER] & 0x1F else []

    def next_ns(self) -> int:
        hz = self.chip.rcc.timer_hz
        if not self[self.CR1] & 1 or not hz:
            return NEVER
        now, enabled = self.ticks(), self[self.DIER]
        points = enumerate(self.points())
        due = [self.due(now, point) for bit, point in points if enabled >> bit & 1 and point < self.period()]
        if not due:
            return NEVER
        ticks = min(due) - self.from_ticks
        return self.since_ns - -ticks * (self.prescaler + 1) * 1_000_000_000 // hz

    def set_control(self, value: int) -> None:
        self.rebase()
        self[self.CR1] = value

    def set_plain(self, at: int, value: int) -> None:
        self.status()
        self[at] = value
        self.chip.attend()

    def set_prescaler(self, value: int) -> None:
        self[self.PSC] = value

    def clear(self, value: int) -> None:
        self[self.SR] = self.status() & value
        self.chip.attend()

    def generate(self, value: int) -> None:
        if value & 1:
            self.rebase()
            self.prescaler = self[self.PSC]
            self.hold(0)
            if not self[self.CR1] & 4:  # URS: only an overflow tells
                self[self.SR] |= 1
        self.chip.attend()

    def count(self) -> int:
        return self.ticks() % self.period()

    def set_count(self, value: int) -> None:
        self.rebase()
        self.hold(value)


class Encoder(Block):
    """TIM3 in its encoder mode: 16 bits of the counts, from where they were when the timer was reset."""

    CNT = 0x24

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        self.on(self.CNT, self.count, self.set_count)

    def reset(self) -> None:
        super().reset()
        self.zero = self.chip.counts

    def count(self) -> int:
        self.chip.flags |= Flag.SAMPLED
        self.chip.sampled()
        return (self.chip.counts - self.zero) & 0xFFFF

    def set_count(self, value: int) -> None:
        self.zero = self.chip.counts - value


class Converter(Block):
    """DAC1, channel 1 without trigger: what is written into a DHR register is in DOR1 with the next clock."""

    CR, DHR12R1, DHR12L1, DHR8R1, DOR1 = 0x00, 0x08, 0x0C, 0x10, 0x2C

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        self.on(self.CR, write=self.set_control)
        self.on(self.DHR12R1, write=lambda value: self.hold(value & 0xFFF))
        self.on(self.DHR12L1, write=lambda value: self.hold(value >> 4 & 0xFFF))
        self.on(self.DHR8R1, write=lambda value: self.hold((value & 0xFF) << 4))

    def set_control(self, value: int) -> None:
        self[self.CR] = value
        self.follow()

    def hold(self, code: int) -> None:
        self[self.DHR12R1] = code
        self.follow()
        self.chip.put_out()

    def follow(self) -> None:
        if self[self.CR] & 1 and not self.chip.faults & Fault.CONVERTER_STUCK:
            self[self.DOR1] = self[self.DHR12R1]


class Watchdog(Block):
    """IWDG, on the clock LSI of 32 kHz: it runs whatever happens to the core's."""

    KR, PR, RLR = 0x00, 0x04, 0x08
    initial: ClassVar = {RLR: 0xFFF}

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        self.on(self.KR, write=self.key)

    def reset(self) -> None:
        super().reset()
        self.fires_ns = NEVER

    def key(self, value: int) -> None:
        # 0x5555 opens PR and RLR, which are open here.
        if value == 0xCCCC or (value == 0xAAAA and self.fires_ns != NEVER):
            clocks = (self[self.RLR] + 1) * (4 << self[self.PR])
            self.fires_ns = self.chip.now_ns + clocks * 1_000_000_000 // LSI_HZ


class Noise(Block):
    """RNG: always ready, and the same numbers in each run."""

    CR, SR, DR = 0x00, 0x04, 0x08

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        self.state = 0x9E37_79B9
        super().__init__(chip, page, base)
        self.on(self.SR, lambda: self[self.CR] >> 2 & 1)
        self.on(self.DR, self.draw)

    def draw(self) -> int:
        # xorshift32; its state outlives a reset, so that each power-up has other numbers.
        x = self.state
        x ^= x << 13 & WORD
        x ^= x >> 17
        x ^= x << 5 & WORD
        self.state = x
        return x


class Serial(Block):
    """LPUART1: bytes by interrupt or by DMA. The transmitter is always empty, the line of the receiver idle once the
    bytes that came are read."""

    CR1, CR3, RQR, ISR, ICR, RDR, TDR = 0x00, 0x08, 0x18, 0x1C, 0x20, 0x24, 0x28
    ORE, IDLE, RXNE, TC, TXE = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
    FIFO = 8  # bytes
    REQUEST_RX, REQUEST_TX = 34, 35

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        self.on(self.CR1, write=partial(self.set_plain, self.CR1))
        self.on(self.CR3, write=partial(self.set_plain, self.CR3))
        self.on(self.RQR, write=self.ask)
        self.on(self.ISR, self.status)
        self.on(self.ICR, write=self.clear)
        self.on(self.RDR, self.pop)
        self.on(self.TDR, write=self.push)

    def reset(self) -> None:
        super().reset()
        self.received: bytearray = bytearray()
        self.sent: bytearray = bytearray()
        self.kept = 0  # of ORE, IDLE and TC
        self.kept |= self.TC

    def status(self) -> int:
        control = self[self.CR1]
        enabled = control & 1
        flags = self.kept | (self.RXNE if self.received else 0)
        if enabled and control & 8:
            flags |= self.TXE | 1 << 21 | 1 << 23  # TEACK, TXFE
        if enabled and control & 4:
            flags |= 1 << 22  # REACK
        return flags

    def lines(self) -> list[int]:
        flags, control = self.status(), self[self.CR1]
        # IDLEIE, RXNEIE, TCIE and TXEIE stand where their flags do.
        errors = flags & self.ORE and (control & self.RXNE or self[self.CR3] & 1)
        return [16 + 91] if flags & control & 0xF0 or errors else []

    def set_plain(self, at: int, value: int) -> None:
        self[at] = value
        self.chip.transfer()

    def ask(self, value: int) -> None:
        if value & 1 << 3:  # RXFRQ
            self.received.clear()

    def clear(self, value: int) -> None:
        self.kept &= ~(value & (self.ORE | self.IDLE | self.TC))
        self.chip.attend()

    def pop(self) -> int:
        if not self.received:
            return 0
        byte = self.received.pop(0)
        if not self.received:
            self.kept |= self.IDLE
        self.chip.attend()
        return byte

    def push(self, value: int) -> None:
        self.sent.append(value & 0xFF)
        self.kept |= self.TC
        self.chip.attend()

    def take(self, data: bytes) -> None:
        """Bytes come over the line."""
        if self[self.CR1] & 5 != 5 or not data:  # the receiver is off
            return
        if self.chip.faults & Fault.OVERRUN and not self.chip.overrun:
            self.chip.overrun = True
            self.kept |= self.ORE
            data = data[: self.FIFO] + data[self.FIFO + 1 :]
        self.received += data
        self.chip.transfer()


class Dma(Block):
    """DMA1 or DMA2: eight channels between memory and LPUART1, with half and complete interrupts, and circular."""

    ISR, IFCR, CCR, CNDTR, CPAR, CMAR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14
    EN, TCIE, HTIE, CIRC, MINC = 1 << 0, 1 << 1, 1 << 2, 1 << 5, 1 << 7

    def __init__(self, chip: Chip, page: Page, base: int, first_mux: int, numbers: list[int]) -> None:
        self.first_mux, self.numbers = first_mux, numbers
        super().__init__(chip, page, base)
        self.on(self.IFCR, write=self.clear)
        for n in range(8):
            self.on(self.CCR + 20 * n, write=partial(self.set_control, n))

    def reset(self) -> None:
        super().reset()
        self.total = [0] * 8

    def clear(self, value: int) -> None:
        for n in range(8):
            if value >> 4 * n & 1:
                value |= 0xE << 4 * n
        self[self.ISR] &= ~value
        self.chip.attend()

    def set_control(self, n: int, value: int) -> None:
        if value & ~self[self.CCR + 20 * n] & self.EN:
            self.total[n] = self[self.CNDTR + 20 * n]
        self[self.CCR + 20 * n] = value
        self.chip.transfer()

    def lines(self) -> list[int]:
        flags = self[self.ISR]
        if not flags:
            return []
        return [self.numbers[n] for n in range(8) if flags >> 4 * n & self[self.CCR + 20 * n] & 0xE]

    def serves(self, request: int) -> int | None:
        """The channel that is ready for a request of DMAMUX."""
        for n in range(8):
            ready = self[self.CCR + 20 * n] & self.EN and self[self.CNDTR + 20 * n]
            if ready and self.chip.mux[4 * (self.first_mux + n)] & 0x7F == request:
                return n
        return None

    def move(self, n: int, data: bytes | None) -> bytes:
        """Bytes into memory, or out of it: as many as fit before the end. Gives those that were moved."""
        at, control, left = 20 * n, self[self.CCR + 20 * n], self[self.CNDTR + 20 * n]
        where = self[self.CMAR + at] + (self.total[n] - left if control & self.MINC else 0)
        if data is None:
            moved = bytes(self.chip.uc.mem_read(where, left))
        else:
            moved = data[:left]
            self.chip.uc.mem_write(where, moved)
        half = self.total[n] // 2
        rest = left - len(moved)
        if left > half >= rest:
            self[self.ISR] |= 5 << 4 * n  # GIF, HTIF
        if rest == 0:
            self[self.ISR] |= 3 << 4 * n  # GIF, TCIF
            rest = self.total[n] if control & self.CIRC else 0
        self[self.CNDTR + at] = rest
        return moved


class Clocks(Block):
    """RCC: oscillators and PLL are ready at once, or never; the crystal can die."""

    CR, CFGR, PLLCFGR, CIFR, CICR, BDCR, CSR, CRRCR = 0x00, 0x08, 0x0C, 0x1C, 0x20, 0x90, 0x94, 0x98
    initial: ClassVar = {CR: 0x500, CFGR: 0x5, PLLCFGR: 0x1000}
    HSEON, CSSON, PLLON = 1 << 16, 1 << 19, 1 << 24
    CSSF = 1 << 8

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        self.flags = 0x0C00_0000  # BORRSTF, PINRSTF: power-up
        super().__init__(chip, page, base)
        self.on(self.CR, self.control, partial(self.change, self.CR))
        self.on(self.CFGR, write=self.configure)
        self.on(self.PLLCFGR, write=partial(self.change, self.PLLCFGR))
        self.on(self.CICR, write=self.clear)
        self.on(self.BDCR, lambda: self[self.BDCR] & ~2 | (self[self.BDCR] & 1) << 1)
        self.on(self.CRRCR, lambda: self[self.CRRCR] & ~2 | (self[self.CRRCR] & 1) << 1)
        self.on(self.CSR, self.causes, self.set_causes)
        for at in range(0x28, 0x44, 4):
            self.on(at, write=partial(self.chip.reset_blocks, at))

    def crystal(self) -> bool:
        return bool(self[self.CR] & self.HSEON) and not self.chip.faults & Fault.CRYSTAL_DEAD

    def pll_hz(self) -> int:
        setting = self[self.PLLCFGR]
        if not setting & 1 << 24:  # PLLREN
            return 0
        multiplied = self.pll_input_hz() * (setting >> 8 & 127) // ((setting >> 4 & 15) + 1)
        return multiplied // (2 * ((setting >> 25 & 3) + 1))

    def pll_input_hz(self) -> int:
        source = {2: HSI_HZ, 3: HSE_HZ if self.crystal() else 0}.get(self[self.PLLCFGR] & 3, 0)
        return source if self[self.CR] & self.PLLON else 0

    def source_hz(self, source: int) -> int:
        return {1: HSI_HZ, 2: HSE_HZ if self.crystal() else 0, 3: self.pll_hz()}.get(source, 0)

    def change(self, at: int, value: int) -> None:
        """A setting of the clocks changes; the timer's count so far is that of the clocks before."""
        self.chip.timer.rebase()
        self[at] = value
        self.settle()

    def settle(self) -> None:
        """The clocks of the core, and of the timers on APB1, Hz; 0 if one stands still."""
        setting = self[self.CFGR]
        divided = {8: 1, 9: 2, 10: 3, 11: 4, 12: 6, 13: 7, 14: 8, 15: 9}.get(setting >> 4 & 15, 0)
        self.core_hz = self.source_hz(setting >> 2 & 3) >> divided
        # A divided bus has timers at twice its clock.
        self.timer_hz = self.core_hz >> {5: 0, 6: 1, 7: 2}.get(setting >> 8 & 7, 0)

    def reset(self) -> None:
        super().reset()
        self.settle()

    def control(self) -> int:
        ready = 1 << 10 if self[self.CR] & 1 << 8 else 0
        ready |= 1 << 17 if self.crystal() else 0
        ready |= 1 << 25 if self.pll_input_hz() else 0
        return self[self.CR] & ~(1 << 10 | 1 << 17 | 1 << 25) | ready

    def configure(self, value: int) -> None:
        source = value & 3 if self.source_hz(value & 3) else self[self.CFGR] >> 2 & 3
        self.change(self.CFGR, value & ~0xC | source << 2)

    def clear(self, value: int) -> None:
        self[self.CIFR] &= ~value

    def causes(self) -> int:
        return self.flags | (self[self.CSR] & 1) * 3  # LSI is ready when it is on

    def set_causes(self, value: int) -> None:
        self[self.CSR] = value
        if value & 1 << 23:  # RMVF
            self.flags = 0

    def crystal_died(self) -> None:
        """Without the security system the clocks stop; with it the chip goes on with HSI, and there is an NMI."""
        if self[self.CR] & self.HSEON and self[self.CR] & self.CSSON:
            self[self.CR] &= ~(self.HSEON | self.PLLON)
            self[self.CFGR] = self[self.CFGR] & ~0xF | 0x5
            self[self.CIFR] |= self.CSSF
            self.chip.pended.add(NMI)
        self.settle()


class System(Block):
    """SCS: NVIC and system control block."""

    ICSR, VTOR, AIRCR, CFSR, HFSR, BFAR, STIR = 0xD04, 0xD08, 0xD0C, 0xD28, 0xD2C, 0xD38, 0xF00
    initial: ClassVar = {0xD00: 0x410F_C241, AIRCR: 0xFA05_0000, 0xF34: 0xC000_0000}

    def __init__(self, chip: Chip, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
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


class Chip:
    """The chip, with an image in its flash."""

    def __init__(self, image: bytes, metered: bool = False) -> None:
        self.now_ns, self.counts, self.resets = 0, 0, 0
        self.faults = self.flags = 0
        self.uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        self.memory: list[Any] = []
        self.vectors: dict[int, int] = {}  # those in flash, which stay
        flash = self.share(0x8_0000, uc_const.UC_PROT_READ | uc_const.UC_PROT_EXEC, 0x0800_0000, 0)
        self.share(0x1_8000, uc_const.UC_PROT_ALL, 0x2000_0000)
        self.share(0x8000, uc_const.UC_PROT_ALL, 0x1000_0000, 0x2001_8000)  # CCM
        ctypes.memset(flash, 0xFF, len(flash))
        for at, data in segments(image):
            ctypes.memmove(ctypes.addressof(flash) + at - 0x0800_0000, data, len(data))
        uc.mem_map(ROM, 0x1_0000)
        uc.mem_write(SPIN, b"\xfe\xe7\x00\xde")
        uc.mem_write(0x1FFF_7590, b"clutch model")  # UID, 96 bits
        self.map_registers()
        self.hooks(image)
        self.run = 0  # number of the stretch of code that runs
        threading.Thread(target=self.watch, daemon=True).start()
        self.meter = Meter(self) if metered else None
        self.clear()

    def share(self, size: int, rights: int, *where: int) -> Any:
        memory = (ctypes.c_char * size)()
        self.memory.append(memory)  # the engine keeps no reference
        for at in where:
            self.uc.mem_map_ptr(at, size, rights, memory)
        return memory

    def map_registers(self) -> None:
        uc = self.uc
        modelled = [0x4000_0000, 0x4000_3000, 0x4000_8000, 0x4002_0000, 0x4002_1000, 0x5000_0000, 0x5006_0000]
        modelled += [0xE000_1000, 0xE000_E000]
        pages = {at: Page(self, at) for at in modelled}
        plain = [(0x4000_0000, 0x4001_8000), (0x4002_0000, 0x4002_5000), (0x4800_0000, 0x4800_2000)]
        plain += [(0x5000_0000, 0x5000_2000), (0x5006_0000, 0x5006_1000), (0xE000_0000, 0xE010_0000)]
        for begin, end in plain:
            for at in range(begin, end, 0x1000):
                if at not in pages:
                    uc.mem_map(at, 0x1000, uc_const.UC_PROT_READ | uc_const.UC_PROT_WRITE)
        self.system = System(self, pages[0xE000_E000], 0)
        self.rcc = Clocks(self, pages[0x4002_1000], 0)
        self.timer = Timer(self, pages[0x4000_0000], 0xC00)
        self.encoder = Encoder(self, pages[0x4000_0000], 0x400)
        self.watchdog = Watchdog(self, pages[0x4000_3000], 0)
        self.serial = Serial(self, pages[0x4000_8000], 0)
        self.mux = Block(self, pages[0x4002_0000], 0x800)
        numbers = [[*range(27, 34), 112], [*range(72, 77), 113, 114, 115]]
        self.dma = [Dma(self, pages[0x4002_0000], 0x400 * n, 8 * n, numbers[n]) for n in range(2)]
        self.converter = Converter(self, pages[0x5000_0000], 0x800)
        self.noise = Noise(self, pages[0x5006_0000], 0x800)
        self.trace = Block(self, pages[0xE000_1000], 0)
        self.trace.on(0x04, lambda: self.meter.executed & WORD if self.meter else 0)  # CYCCNT
        self.blocks = [self.system, self.rcc, self.timer, self.encoder, self.watchdog, self.serial, self.mux]
        self.blocks += [*self.dma, self.converter, self.noise, self.trace]
        # Offset in RCC and bit of a peripheral's reset.
        self.resettable: dict[tuple[int, int], list[Block]] = {
            (0x28, 0): [self.dma[0]],
            (0x28, 1): [self.dma[1]],
            (0x28, 2): [self.mux],
            (0x2C, 16): [self.converter],
            (0x38, 1): [self.encoder],
            (0x38, 3): [self.timer],
            (0x3C, 0): [self.serial],
        }
        for (offset, bit), blocks in self.resettable.items():
            for block in blocks:
                block.page.gates[block.base >> 10] = partial(self.clocked, offset + 0x20, bit)
        self.sources: list[Timer | Serial | Dma] = [self.timer, self.serial, *self.dma]

    def clocked(self, at: int, bit: int) -> bool:
        return bool(self.rcc[at] >> bit & 1)

    def hooks(self, image: bytes) -> None:
        self.uc.hook_add(uc_const.UC_HOOK_INTR, self.interrupted)
        self.has_base = False  # the image uses BASEPRI
        # An interrupt that waits is taken when its mask goes: after CPSIE, and MSR PRIMASK or BASEPRI.
        for at, data in segments(image):
            if not 0x0800_0000 <= at < 0x0808_0000:
                continue
            if at == 0x0800_0000:
                words = struct.iter_unpack("<I", data[: len(data) & ~3])
                self.vectors = {at + 4 * n: word for n, (word,) in enumerate(words)}
            for n in range(0, len(data) - 3, 2):
                first, second = struct.unpack_from("<HH", data, n)
                length = 2 if first == 0xB662 else 4 if first & 0xFFF0 == 0xF380 and second in MASKS else 0
                self.has_base |= length == 4 and second != MASKS[0]
                if length:
                    after = at + n + length
                    self.uc.hook_add(uc_const.UC_HOOK_CODE, self.unmasked, None, after, after)

    def deepest_stack(self, statics_end: int) -> int:
        """Bytes from the top of the stack down to the last one that was ever written; memory begins as zeros."""
        (top,) = struct.unpack("<I", self.uc.mem_read(0x0800_0000, 4))
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
        self.returning = self.called = False
        for block in self.blocks:
            block.reset()
        for at in [0x4000_7000, 0x4002_2000]:
            self.uc.mem_write(at, bytes(0x400))
        self.uc.mem_write(0x4000_7080, b"\x00\x01")  # PWR_CR5.R1MODE
        self.uc.reg_write(arm.UC_ARM_REG_CONTROL, 0)
        self.uc.reg_write(arm.UC_ARM_REG_PRIMASK, 0)
        self.uc.reg_write(arm.UC_ARM_REG_BASEPRI, 0)
        self.uc.reg_write(arm.UC_ARM_REG_XPSR, 1 << 24)
        self.uc.reg_write(arm.UC_ARM_REG_LR, WORD)
        stack, self.pc = struct.unpack("<II", self.uc.mem_read(0x0800_0000, 8))
        self.uc.reg_write(arm.UC_ARM_REG_SP, stack)

    def reset(self, cause: int) -> None:
        sent = self.serial.sent
        self.clear()
        self.serial.sent = sent  # is on its way
        self.resets += 1
        self.rcc.flags |= cause
        self.flags |= Flag.RESET | (Flag.WATCHDOG if cause == 1 << 29 else 0)

    def reset_blocks(self, at: int, value: int) -> None:
        for (offset, bit), blocks in self.resettable.items():
            if offset == at and value >> bit & 1:
                for block in blocks:
                    block.reset()

    def set_faults(self, faults: int) -> None:
        new = faults & ~self.faults
        if (faults | self.faults) & Fault.SUPPLY_LOW:
            watched = self.uc.mem_read(0x4000_7004, 1)[0] & 1  # PWR_CR2.PVDE
            low = bool(faults & Fault.SUPPLY_LOW and watched)
            self.uc.mem_write(0x4000_7014, struct.pack("<I", low << 11))  # PWR_SR2.PVDO
        if new & Fault.CRYSTAL_DEAD:
            self.timer.rebase()
        if self.faults & ~faults & Fault.OVERRUN:
            self.overrun = False
        self.faults = faults
        if new & Fault.CRYSTAL_DEAD:
            self.rcc.crystal_died()
        if new & Fault.HANG:
            self.uc.reg_write(arm.UC_ARM_REG_PRIMASK, 1)
            self.pc = SPIN
            self.asleep = False
        if new & Fault.UNDEFINED:
            self.pc = UNDEFINED
            self.asleep = False
        if new & Fault.NMI:
            self.pended.add(NMI)
        if new & Fault.UNEXPECTED:
            self.enabled.add(16)
            self.pended.add(16)

    # Exceptions.

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
        self.pended.discard(number)
        self.active.append(number)
        self.asleep = self.spinning = False
        if self.meter:
            self.meter.wakes()
            self.meter.cycles += 12
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
        uc.mem_write(stack, frame)
        uc.reg_write(arm.UC_ARM_REG_SP, stack)
        return (HANDLER if self.active else THREAD) & ~(0x10 if floats else 0)

    def leave(self) -> None:
        """A handler ends: the next one that waits follows, or what was interrupted goes on."""
        uc = self.uc
        value = self.returns.pop()
        self.active.pop()
        number = self.next_exception()
        if number:
            self.enter(number, value)
            return
        if self.meter:
            self.meter.cycles += 10
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
        self.system[System.CFSR] |= 1 << 16 if undefined else 1 << 9
        self.system[System.HFSR] |= 1 << 30  # FORCED
        if any(number in (HARD_FAULT, NMI) for number in self.active):
            self.locked = True
        else:
            self.enter(HARD_FAULT)

    # Running.

    def step(self) -> None:
        """Runs code until the core sleeps with nothing to do, or spins, or has no clock."""
        uc, entered, suspect = self.uc, False, False
        while self.rcc.core_hz and not self.locked:
            if not entered and (number := self.next_exception()):
                self.enter(number)
            elif self.asleep and not self.waiting:
                return
            budget = AGAIN if self.spinning else BUDGET if suspect else 0
            self.asleep = entered = False
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
                self.reset(1 << 28)
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
            if run == self.run:
                self.uc.emu_stop()

    def next_ns(self) -> int:
        return min(self.timer.next_ns(), self.watchdog.fires_ns)

    def go_to(self, now_ns: int) -> None:
        """Time passes, and what falls due on the way is done."""
        while (due := self.next_ns()) <= now_ns:
            self.now_ns = max(due, self.now_ns)
            if self.watchdog.fires_ns <= self.now_ns:
                self.reset(1 << 29)
            self.step()
        self.now_ns = max(now_ns, self.now_ns)

    def transfer(self) -> None:
        """DMA moves what it can between LPUART1 and memory."""
        serial = self.serial
        for dma in self.dma:
            while serial.received and serial[Serial.CR3] & 1 << 6 and (n := dma.serves(Serial.REQUEST_RX)) is not None:
                del serial.received[: len(dma.move(n, bytes(serial.received)))]
                if not serial.received:
                    serial.kept |= Serial.IDLE
            while serial[Serial.CR3] & 1 << 7 and (n := dma.serves(Serial.REQUEST_TX)) is not None:
                serial.sent += dma.move(n, None)
                serial.kept |= Serial.TC
                if not serial[Serial.CR3] & 1 << 7:
                    break
        self.attend()

    def sampled(self) -> None:
        if self.meter:
            self.meter.sampled()

    def put_out(self) -> None:
        if self.meter:
            self.meter.put_out()

    def state(self) -> int:
        flags = self.flags
        self.flags = 0
        if any(number in (HARD_FAULT, NMI) for number in self.active):
            flags |= Flag.IN_FAULT
        flags |= Flag.SPINNING if self.spinning else 0
        flags |= Flag.LOCKUP if self.locked else 0
        flags |= 0 if self.rcc.core_hz else Flag.STOPPED
        flags |= 0 if self.converter[Converter.CR] & 1 else Flag.FLOATING
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
        return self.next_ns(), self.converter[Converter.DOR1], self.state(), self.resets, sent


MASKS = (0x8810, 0x8811, 0x8812)  # PRIMASK, BASEPRI, BASEPRI_MAX
SUPERVISOR_CALL, EXCEPTION_EXIT = 2, 8  # as Unicorn numbers them


def segments(image: bytes) -> list[tuple[int, bytes]]:
    """The contents that an ELF image loads: physical addresses, and bytes."""
    if image[:6] != b"\x7fELF\x01\x01":
        raise ValueError("not an ELF image of 32 bits, little-endian")
    table, size, count = (*struct.unpack_from("<I", image, 28), *struct.unpack_from("<HH", image, 42))
    headers = [struct.unpack_from("<5I", image, table + size * n) for n in range(count)]
    return [(where, image[at : at + length]) for kind, at, _, where, length in headers if kind == 1 and length]


def statics_end(image: bytes) -> int:
    """The first address in SRAM behind what an ELF image has there: as far as its stack may reach."""
    table, size, count = (*struct.unpack_from("<I", image, 28), *struct.unpack_from("<HH", image, 42))
    headers = [struct.unpack_from("<6I", image, table + size * n) for n in range(count)]
    return max([at + size for kind, _, at, _, _, size in headers if kind == 1 and at >> 28 == 2], default=0x2000_0000)


class Meter:
    """Counts instructions, and estimates their cycles.

    The estimate assumes: 170 MHz; one cycle for an instruction, two for a load, more for what moves several registers,
    divides, or multiplies and adds in floating point, as the core's manual has them; two for a branch that is taken;
    12 and 10 for a handler's begin and end. Flash is read by 64 bits with four wait states, into an instruction
    cache of 1 KB and a data cache of 256 bytes, each by least recent use. No account is taken of the prefetch, which
    the image switches on, of how instructions overlap, nor of waits for the peripherals' buses.
    """

    WAIT_STATES, BRANCH, CLOCK_MHZ = 4, 2, 170
    CODE_WORDS, DATA_WORDS = 128, 32  # of 64 bits

    def __init__(self, chip: Chip) -> None:
        self.chip, self.executed, self.cycles = chip, 0, 0
        self.cost: dict[int, int] = {}
        self.next, self.word = 0, -1
        self.code: OrderedDict[int, None] = OrderedDict()
        self.data: OrderedDict[int, None] = OrderedDict()
        self.woke: tuple[int, int] | None = None
        self.sample: tuple[int, int] | None = None
        self.bytes: tuple[int, int] | None = None
        self.out: tuple[int, int] | None = None
        self.kind = "other"
        self.counted: dict[str, list[tuple[int, int]]] = {}
        chip.uc.hook_add(uc_const.UC_HOOK_CODE, self.instruction)
        flash = (0x0800_0000, 0x0808_0000)
        chip.uc.hook_add(uc_const.UC_HOOK_MEM_READ, self.load, None, *flash)

    def instruction(self, uc: Uc, at: int, size: int, _data: Any) -> None:
        self.executed += 1
        cost = self.cost.get(at)
        if cost is None:
            cost = self.cost[at] = cycles_of(bytes(uc.mem_read(at, size)))
        self.cycles += cost + (self.BRANCH if at != self.next else 0)
        self.next = at + size
        if at >> 3 != self.word:
            self.word = at >> 3
            self.fetch(self.code, self.word, self.CODE_WORDS)

    def load(self, _uc: Uc, _kind: int, at: int, _size: int, _value: int, _data: Any) -> None:
        self.fetch(self.data, at >> 3, self.DATA_WORDS)

    def fetch(self, cache: OrderedDict[int, None], word: int, words: int) -> None:
        if word in cache:
            cache.move_to_end(word)
            return
        self.cycles += self.WAIT_STATES
        cache[word] = None
        if len(cache) > words:
            cache.popitem(last=False)

    def now(self) -> tuple[int, int]:
        return self.executed, self.cycles

    def since(self, name: str, begin: tuple[int, int], end: tuple[int, int]) -> None:
        if self.chip.faults & Fault.METERED:
            self.counted.setdefault(name, []).append((end[0] - begin[0], end[1] - begin[1]))

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
        """Lowest, mean and highest number of instructions, and of estimated microseconds, by what they were for."""

        def figures(numbers: list[float]) -> dict[str, float]:
            return {"lowest": min(numbers), "mean": sum(numbers) / len(numbers), "highest": max(numbers)}

        return {
            name: {
                "count": len(pairs),
                "instructions": figures([float(executed) for executed, _ in pairs]),
                "estimated_us": figures([cycles / self.CLOCK_MHZ for _, cycles in pairs]),
            }
            for name, pairs in self.counted.items()
        }


def cycles_of(code: bytes) -> int:
    """Cycles of a Thumb instruction without waits, as the manual of the Cortex-M4 has them."""
    first = int.from_bytes(code[:2], "little")
    if len(code) == 2:
        if first >> 12 == 0b0101:
            return 2 if first >> 9 & 7 >= 3 else 1
        if first >> 12 in (0b0110, 0b0111, 0b1000, 0b1001):
            return 2 if first & 0x800 else 1
        if first >> 11 == 0b01001:  # literal
            return 2
        if first & 0xF600 == 0xB400:  # PUSH, POP
            return 1 + (first & 0x1FF).bit_count()
        return 1 + (first & 0xFF).bit_count() if first >> 12 == 0b1100 else 1
    second = int.from_bytes(code[2:], "little")
    if first & 0xFE40 == 0xE800:  # LDM, STM
        return 1 + second.bit_count()
    if first & 0xFE40 == 0xE840:  # LDRD, STRD, exclusive
        return 3
    if first & 0xFE00 == 0xF800:
        return 2 if first & 0x10 else 1
    if first & 0xFFD0 == 0xFB90:  # SDIV, UDIV: 2 to 12
        return 7
    if first & 0xFE00 == 0xEC00:  # VLDR, VSTR, VLDM, VSTM
        several = not first & 0x100 or first & 0x20
        return 1 + (second & 0xFF if several else 1)
    if first & 0xFF00 == 0xEE00 and second & 0xE00 == 0xA00 and not second & 0x10:
        if first & 0xB0 == 0x80 or (first & 0xBF == 0xB1 and second & 0xC0 == 0xC0):  # VDIV, VSQRT
            return 14
        return 3 if first & 0xB0 in (0x00, 0x10, 0xA0, 0x90) else 1  # VMLA, VNMLA, VFMA, VFNMA
    return 1


def main() -> None:
    image, *rest = sys.argv[1:]
    chip = Chip(Path(image).read_bytes(), metered=rest[:1] == ["--count"])
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


if __name__ == "__main__":
    main()
