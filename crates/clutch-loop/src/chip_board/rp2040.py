"""Register model of an RP2040, on which an unmodified image runs in virtual time: `python3 rp2040.py IMAGE`.

`cortex_m.py` has the core, which is an M0+ here, and the protocol, and says what no chip here models. Of this chip the
second core sleeps. Its own loader is not here, but does here what it does there: it checks the first 256 bytes of the
flash, and runs them. The machine that counts the encoder's edges executes its program, instruction by instruction,
ten clocks for each edge. A code is at the pin at once, and not only at the next turn of the PWM's counter.
"""

from __future__ import annotations

import binascii
import ctypes
import struct
from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from typing import ClassVar

from cortex_m import NEVER, WORD, Block, Chip, Fault, Meter, NotModelled, Page, segments, serve
from unicorn import Uc
from unicorn import arm_const as arm
from unicorn import unicorn_const as uc_const

RING_HZ, CRYSTAL_HZ = 6_500_000, 12_000_000
FLASH, LOADER = 0x1000_0000, 0x2004_1F00
PWM_WRAP, CLOCKS, UART0 = 16 + 4, 16 + 17, 16 + 20
CONVERTER, SWITCH = 16, 17  # pins


class Registers(Block):
    """A peripheral of this chip."""

    chip: Rp2040


class AtomicPage(Page):
    """A peripheral's page, and three more in which writing flips, sets, or clears bits."""

    SIZE = 0x4000

    def write(self, uc: Uc, offset: int, size: int, value: int, data: object) -> None:
        at, how = offset & 0xFFF, offset >> 12
        if how:
            before = self.words.get(at & ~3, 0)
            value = [value, before ^ value, before | value, before & ~value][how]
        super().write(uc, at, size, value, data)

    def read(self, uc: Uc, offset: int, size: int, data: object) -> int:
        return super().read(uc, offset & 0xFFF, size, data)


class Resets(Registers):
    """RESETS: a peripheral in reset reads as zeros and takes nothing."""

    RESET, DONE = 0x00, 0x08
    initial: ClassVar = {RESET: 0x1FF_FFFF}

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(self.RESET, write=self.change)
        self.on(self.DONE, lambda: ~self[self.RESET] & 0x1FF_FFFF)

    def change(self, value: int) -> None:
        before, self[self.RESET] = self[self.RESET], value
        for bit, block in self.chip.resettable.items():
            if value & ~before & 1 << bit:
                block.reset()
        self.chip.clocks.settle()


class Clocks(Registers):
    """Clocks, with the circuit that keeps a core going whose clock has stopped; oscillators and PLL are ready at once,
    or never."""

    REF, REF_SELECTED, SYS, SYS_SELECTED, RESUS, RESUSSED = 0x30, 0x38, 0x3C, 0x44, 0x78, 0x7C
    INTR, INTE, INTS = 0xB8, 0xBC, 0xC4

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(self.SYS, write=self.change)
        self.on(self.REF_SELECTED, lambda: 1)
        self.on(self.SYS_SELECTED, lambda: 1 << (self[self.SYS] & 1))
        self.on(self.RESUSSED, lambda: int(self.resussed))
        self.on(self.INTE, write=self.enable)
        self.on(self.INTS, lambda: int(bool(self.lines())))

    def reset(self) -> None:
        super().reset()
        self.resussed = False
        self.core_hz = RING_HZ

    def crystal(self) -> bool:
        return self.chip.xosc[0] >> 12 & 0xFFF == 0xFAB and not self.chip.faults & Fault.CRYSTAL_DEAD

    def pll_hz(self) -> int:
        pll = self.chip.pll
        if not self.crystal() or pll[4] & 0x29 or self.chip.gates[Resets.RESET] >> 12 & 1:
            return 0
        divided = (pll[0xC] >> 16 & 7) * (pll[0xC] >> 12 & 7)
        return CRYSTAL_HZ // (pll[0] & 63 or 1) * (pll[8] & 0xFFF) // (divided or 1)

    def locked(self) -> bool:
        return self.crystal() and not self.chip.pll[4] & 0x21 and bool(self.chip.pll[8])

    def change(self, value: int) -> None:
        self[self.SYS] = value
        self.settle()

    def settle(self) -> None:
        """The core's clock, Hz; 0 if it stands still."""
        aux = {0: self.pll_hz(), 4: RING_HZ, 5: CRYSTAL_HZ if self.crystal() else 0}.get(self[self.SYS] >> 5 & 7, 0)
        core_hz = aux if self[self.SYS] & 1 else RING_HZ
        if not core_hz and self[self.RESUS] & 0x100:
            self.resussed = True
            self.chip.attend()
        core_hz = RING_HZ if self.resussed else core_hz
        if core_hz != self.core_hz:
            for slice_ in self.chip.pwm:
                slice_.hold()
            self.core_hz = core_hz

    def enable(self, value: int) -> None:
        self[self.INTE] = value
        self.chip.attend()

    def lines(self) -> list[int]:
        return [CLOCKS] if self.resussed and self[self.INTE] & 1 else []


class Crystal(Registers):
    """XOSC."""

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(0x04, lambda: 1 << 31 | 1 << 12 if chip.clocks.crystal() else 0)


class Pll(Registers):
    """PLL_SYS."""

    CS = 0x00
    initial: ClassVar = {CS: 1, 0x04: 0x2D, 0x0C: 0x7_7000}

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(self.CS, lambda: self[self.CS] | int(chip.clocks.locked()) << 31)
        for at in (0x04, 0x08, 0x0C):
            self.on(at, write=partial(self.change, at))

    def change(self, at: int, value: int) -> None:
        self[at] = value
        self.chip.clocks.settle()


class Slice(Registers):
    """A slice of the PWM: it counts up; a new TOP is in force from its next turn on."""

    CSR, DIV, CTR, CC, TOP = 0x00, 0x04, 0x08, 0x0C, 0x10

    def __init__(self, chip: Rp2040, page: Page, number: int) -> None:
        self.number = number
        super().__init__(chip, page, 0x14 * number)
        self.on(self.CSR, write=partial(self.set, self.CSR))
        self.on(self.DIV, write=partial(self.set, self.DIV))
        self.on(self.TOP, write=partial(self.set, self.TOP))
        self.on(self.CTR, self.count, self.set_count)

    def reset(self) -> None:
        for at, value in [(self.CSR, 0), (self.DIV, 0x10), (self.CTR, 0), (self.CC, 0), (self.TOP, 0xFFFF)]:
            self[at] = value
        self.top, self.from_count, self.since_ns = 0xFFFF, 0, self.chip.now_ns

    def clocks_hz(self) -> tuple[int, int]:
        """Counts a second, as numerator and denominator; 0 if it stands still."""
        return (self.chip.clocks.core_hz * 16 if self[self.CSR] & 1 else 0), self[self.DIV] & 0xFFF or 0x1000

    def settle(self) -> bool:
        """Counts up to now; true if a turn has begun."""
        over, under = self.clocks_hz()
        passed = (self.chip.now_ns - self.since_ns) * over // (under * 1_000_000_000)
        left = self.top + 1 - self.from_count
        if passed < left:
            return False
        self.from_count, self.since_ns = 0, self.since_ns + -(-left * under * 1_000_000_000 // (over or 1))
        self.top = self[self.TOP]
        turns, self.from_count = divmod(passed - left, self.top + 1)
        counts = turns * (self.top + 1) + self.from_count
        self.since_ns += counts * under * 1_000_000_000 // over
        return True

    def turned(self) -> None:
        if self.settle():
            self.chip.wrapped |= 1 << self.number

    def count(self) -> int:
        self.turned()
        over, under = self.clocks_hz()
        return self.from_count + (self.chip.now_ns - self.since_ns) * over // (under * 1_000_000_000)

    def hold(self) -> None:
        """Before its clock changes: what has passed has passed."""
        self.from_count, self.since_ns = self.count(), self.chip.now_ns

    def set(self, at: int, value: int) -> None:
        self.hold()
        self[at] = value
        if not self[self.CSR] & 1:
            self.top = self[self.TOP]

    def set_count(self, value: int) -> None:
        self.hold()
        self.from_count = value & 0xFFFF

    def next_ns(self) -> int:
        over, under = self.clocks_hz()
        if not over:
            return NEVER
        left = self.top + 1 - self.from_count
        return self.since_ns - -left * under * 1_000_000_000 // over


class Pwm(Registers):
    """The part that the slices of the PWM have in common: their interrupt."""

    INTR, INTE, INTS = 0xA4, 0xA8, 0xB0

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(self.INTR, self.flags, self.clear)
        self.on(self.INTE, write=self.enable)
        self.on(self.INTS, lambda: self.flags() & self[self.INTE])
        for n in range(8):
            code = partial(self.put_out, 0x14 * n + Slice.CC)
            self.on(0x14 * n + Slice.CC, write=code)

    def reset(self) -> None:
        super().reset()
        self.chip.wrapped = 0
        for slice_ in self.chip.pwm:
            slice_.reset()

    def put_out(self, at: int, value: int) -> None:
        if at != Slice.CC or not self.chip.faults & Fault.CONVERTER_STUCK:
            self[at] = value
        if at == Slice.CC:
            self.chip.put_out()

    def flags(self) -> int:
        for slice_ in self.chip.pwm:
            slice_.turned()
        return self.chip.wrapped

    def clear(self, value: int) -> None:
        self.chip.wrapped = self.flags() & ~value
        self.chip.attend()

    def enable(self, value: int) -> None:
        self[self.INTE] = value
        self.chip.attend()

    def lines(self) -> list[int]:
        return [PWM_WRAP] if self[self.INTE] and self.flags() & self[self.INTE] else []

    def next_ns(self) -> int:
        enabled = [slice_ for slice_ in self.chip.pwm if self[self.INTE] >> slice_.number & 1]
        return min((slice_.next_ns() for slice_ in enabled), default=NEVER)


class Machine(Registers):
    """PIO0 with its first state machine, which executes the instructions that a counter of edges needs."""

    CTRL, FSTAT, FLEVEL, RXF, IRQ, PROGRAM = 0x00, 0x04, 0x0C, 0x20, 0x30, 0x48
    EXECCTRL, SHIFTCTRL, ADDR, INSTR, PINCTRL = 0xCC, 0xD0, 0xD4, 0xD8, 0xDC
    FIFO = 4  # words
    LOOK = 10  # clocks for each edge: as long as the image's program may take to see it
    STATES = (0b00, 0b01, 0b11, 0b10)  # B and A, in the order of rising counts
    initial: ClassVar = {EXECCTRL: 31 << 12, SHIFTCTRL: 3 << 18}

    def __init__(self, chip: Rp2040, page: Page) -> None:
        self.encoder, self.pins = 0, 0
        super().__init__(chip, page, 0)
        self.on(self.CTRL, write=self.enable)
        self.on(self.FSTAT, self.status)
        self.on(self.FLEVEL, self.level)
        self.on(self.RXF, self.pop)
        self.on(self.IRQ, lambda: self.irq, self.clear)
        self.on(self.INSTR, write=lambda value: self.execute(value & 0xFFFF))
        self.on(self.ADDR, lambda: self.pc)

    def reset(self) -> None:
        super().reset()
        self.x = self.y = self.isr = self.osr = self.pc = self.irq = 0
        self.fifo: list[int] = []

    def enable(self, value: int) -> None:
        self[self.CTRL] = value & 1

    def status(self) -> int:
        self.run(self.LOOK)
        full = len(self.fifo) == self.FIFO
        return 0x0F0E_0E00 | int(not self.fifo) << 8 | int(full)

    def level(self) -> int:
        self.run(self.LOOK)
        return len(self.fifo) << 4

    def pop(self) -> int:
        self.chip.sampled()
        return self.fifo.pop(0) if self.fifo else 0

    def clear(self, value: int) -> None:
        self.irq &= ~value

    def turn(self, counts: int) -> None:
        """The encoder's shaft turns: edge by edge, as fast as the machine can follow."""
        step = 1 if counts > self.encoder else -1
        while self.encoder != counts:
            self.encoder += step
            self.show(self.STATES[self.encoder & 3])

    def spike(self) -> None:
        """Both signals change for a moment."""
        self.show(self.pins ^ 3)
        self.show(self.pins ^ 3)

    def show(self, pins: int) -> None:
        self.pins = pins
        self.run(self.LOOK)

    def run(self, clocks: int) -> None:
        if not self[self.CTRL] & 1:
            return
        setting = self[self.EXECCTRL]
        top, bottom = setting >> 12 & 31, setting >> 7 & 31
        for _ in range(clocks):
            at = self.pc
            self.pc = bottom if at == top else at + 1 & 31
            self.execute(self[self.PROGRAM + 4 * at] & 0xFFFF)

    def execute(self, instruction: int) -> None:
        kind, argument, low = instruction >> 13, instruction >> 5 & 7, instruction & 31
        if instruction >> 8 & 31:
            raise NotModelled(f"PIO: instruction {instruction:#06x} with a delay or side-set")
        if kind == 0 and argument in (0, 2, 4):  # JMP: always, X--, Y--
            jumps = True
            if argument == 2:
                jumps, self.x = self.x != 0, self.x - 1 & WORD
            elif argument == 4:
                jumps, self.y = self.y != 0, self.y - 1 & WORD
            self.pc = low if jumps else self.pc
        elif kind == 2:  # IN
            bits = low or 32
            value = self.source(argument) & ((1 << bits) - 1)
            if self[self.SHIFTCTRL] >> 18 & 1:  # to the right
                self.isr = (self.isr >> bits | value << 32 - bits) & WORD
            else:
                self.isr = (self.isr << bits | value) & WORD
        elif instruction == 0x8000:  # PUSH NOBLOCK
            if len(self.fifo) < self.FIFO:
                self.fifo.append(self.isr)
            self.isr = 0
        elif kind == 5 and not low >> 3:  # MOV
            self.move(argument, self.source(low & 7))
        elif kind == 6 and instruction & 0xFFF8 == 0xC000:  # IRQ
            self.irq |= 1 << (low & 7)
        else:
            raise NotModelled(f"PIO: instruction {instruction:#06x}")

    def source(self, number: int) -> int:
        base = self[self.PINCTRL] >> 15 & 31
        pins = self.pins << self.chip.ENCODER
        sources: dict[int, Callable[[], int]] = {
            0: lambda: (pins >> base | pins << 32 - base) & WORD,
            1: lambda: self.x,
            2: lambda: self.y,
            3: lambda: 0,
            6: lambda: self.isr,
            7: lambda: self.osr,
        }
        if number not in sources:
            raise NotModelled(f"PIO: source {number}")
        return sources[number]()

    def move(self, to: int, value: int) -> None:
        if to == 5:
            self.pc = value & 31
        elif to in (1, 2, 6, 7):
            setattr(self, {1: "x", 2: "y", 6: "isr", 7: "osr"}[to], value)
        else:
            raise NotModelled(f"PIO: MOV to {to}")


class Watchdog(Registers):
    """WATCHDOG, on ticks of the reference clock, which is the ring oscillator: it runs whatever happens to the core's.
    Its counter falls by two for each tick: erratum E1."""

    CTRL, LOAD, REASON, SCRATCH, TICK = 0x00, 0x04, 0x08, 0x0C, 0x2C

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(self.CTRL, write=self.enable)
        self.on(self.LOAD, write=self.load)

    def reset(self) -> None:
        kept = [self[self.SCRATCH + 4 * n] for n in range(8)]
        super().reset()
        for n, value in enumerate(kept):
            self[self.SCRATCH + 4 * n] = value
        self.fires_ns = NEVER
        self.left = 0

    def enable(self, value: int) -> None:
        self[self.CTRL] = value
        self.start()

    def load(self, value: int) -> None:
        self.left = value & 0xFF_FFFF
        self.start()

    def start(self) -> None:
        clocks = (self.left + 1) // 2 * (self[self.TICK] & 0x1FF)
        running = self[self.CTRL] >> 30 & 1 and self[self.TICK] >> 9 & 1 and self.chip.psm[0x08]
        self.fires_ns = self.chip.now_ns + clocks * 1_000_000_000 // RING_HZ if running else NEVER


class Regulator(Registers):
    """VREG_AND_CHIP_RESET: the cause of the last reset of the chip as a whole, here of its power-up."""

    initial: ClassVar = {0x08: 1 << 8}  # CHIP_RESET.HAD_POR


class Noise(Registers):
    """ROSC: its bits of noise repeat from run to run; they go on through a reset, so that each power-up has others."""

    def __init__(self, chip: Rp2040, page: Page) -> None:
        self.state = 0x9E37_79B9
        super().__init__(chip, page, 0)
        self.on(0x1C, self.draw)

    def draw(self) -> int:
        x = self.state  # xorshift32
        x ^= x << 13 & WORD
        x ^= x >> 17
        x ^= x << 5 & WORD
        self.state = x
        return x & 1


class Serial(Registers):
    """UART0: the transmitter is always empty; a pause follows the bytes that came, so that few interrupt, too."""

    DR, FR, CR, IMSC, RIS, MIS, ICR, DMACR = 0x00, 0x18, 0x30, 0x38, 0x3C, 0x40, 0x44, 0x48
    RX, RT, OE = 1 << 4, 1 << 6, 1 << 10
    REQUEST_TX = 20

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(self.DR, self.pop, self.push)
        self.on(self.FR, lambda: 1 << 7 | (0 if self.received else 1 << 4))
        self.on(self.IMSC, write=self.mask)
        self.on(self.RIS, self.status)
        self.on(self.MIS, lambda: self.status() & self[self.IMSC])
        self.on(self.ICR, write=self.clear)

    def reset(self) -> None:
        super().reset()
        self.received: bytearray = bytearray()
        self.sent: bytearray = bytearray()
        self.overrun = 0

    def status(self) -> int:
        return self.overrun | (self.RX | self.RT if self.received else 0)

    def lines(self) -> list[int]:
        return [UART0] if self.status() & self[self.IMSC] else []

    def mask(self, value: int) -> None:
        self[self.IMSC] = value
        self.chip.attend()

    def clear(self, value: int) -> None:
        self.overrun &= ~value

    def pop(self) -> int:
        byte = self.received.pop(0) if self.received else 0
        self.chip.attend()
        return byte

    def push(self, value: int) -> None:
        self.sent.append(value & 0xFF)

    def take(self, data: bytes) -> None:
        """Bytes come over the line."""
        if self[self.CR] & 0x201 != 0x201 or not data:  # the receiver is off
            return
        if self.chip.faults & Fault.OVERRUN and not self.chip.overrun:
            self.chip.overrun = True
            self.overrun = self.OE
            at = len(data) // 2  # one that found the FIFO full
            data = data[:at] + data[at + 1 :]
        self.received += data
        self.chip.attend()


class Dma(Registers):
    """DMA: channels from memory to UART0, done as soon as they begin."""

    READ, COUNT, CTRL = 0x00, 0x08, 0x0C

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        for n in range(12):
            self.on(0x40 * n + self.CTRL, write=partial(self.begin, 0x40 * n))

    def begin(self, at: int, value: int) -> None:
        self[at + self.CTRL] = value & 0x1F_FFFF
        serial = self.chip.serial
        if not value & 1:
            return
        # One byte at a time, the next address, at the pace of UART0, which asks for it.
        if value >> 15 & 63 != Serial.REQUEST_TX or value & 0x3C != 0x10 or not serial[Serial.DMACR] & 2:
            raise NotModelled(f"DMA: a transfer with CTRL = {value:#010x}")
        serial.sent += self.chip.uc.mem_read(self[at + self.READ], self[at + self.COUNT])
        self[at + self.READ] += self[at + self.COUNT]
        self[at + self.COUNT] = 0


class Sio(Registers):
    """SIO: the outputs of the pins."""

    OUT, OE = 0x10, 0x20

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        for at in (self.OUT, self.OE):
            self.on(at + 4, write=partial(self.put, at, lambda before, value: before | value))
            self.on(at + 8, write=partial(self.put, at, lambda before, value: before & ~value))
            self.on(at + 12, write=partial(self.put, at, lambda before, value: before ^ value))

    def put(self, at: int, how: Callable[[int, int], int], value: int) -> None:
        self[at] = how(self[at], value)


class Flash(Registers):
    """SSI: the flash's answer to the loader that sets it up: it is ready, and takes four bits at a time."""

    def __init__(self, chip: Rp2040, page: Page) -> None:
        super().__init__(chip, page, 0)
        self.on(0x28, lambda: 0x0E)  # SR: room to send, something received, not busy
        self.on(0x60, lambda: 0x02)  # DR0


class Rp2040(Chip):
    """The chip."""

    CORE, CPUID = arm.UC_CPU_ARM_CORTEX_M0, 0x410C_C601
    FLASH, TABLE, ROM = range(FLASH, FLASH + 0x20_0000), FLASH + 0x100, 0
    ENCODER = 2  # the pin of A; B's is the next
    watchdog: Watchdog
    serial: Serial

    def map_memory(self, image: bytes) -> None:
        flash = self.share(0x20_0000, uc_const.UC_PROT_READ | uc_const.UC_PROT_EXEC, FLASH)
        ctypes.memset(flash, 0xFF, len(flash))
        for at, _, data in segments(image):
            ctypes.memmove(ctypes.addressof(flash) + at - FLASH, data, len(data))
        self.share(0x4_2000, uc_const.UC_PROT_ALL, 0x2000_0000)
        self.uc.mem_map(self.ROM, 0x4000)

    def map_registers(self) -> None:
        def page(at: int) -> Page:
            return AtomicPage(self, at)

        self.wrapped = 0
        self.pwm: list[Slice] = []
        self.gates = Resets(self, page(0x4000_C000))
        self.xosc = Crystal(self, page(0x4002_4000))
        self.pll = Pll(self, page(0x4002_8000))
        self.clocks = Clocks(self, page(0x4000_8000))
        pwm = page(0x4005_0000)
        self.slices = Pwm(self, pwm)
        self.pwm = [Slice(self, pwm, n) for n in range(8)]
        self.psm = Block(self, page(0x4001_0000), 0)
        self.regulator = Regulator(self, page(0x4006_4000), 0)
        self.watchdog = Watchdog(self, page(0x4005_8000))
        self.noise = Noise(self, page(0x4006_0000))
        self.serial = Serial(self, page(0x4003_4000))
        self.dma = Dma(self, page(0x5000_0000))
        self.machine = Machine(self, page(0x5020_0000))
        self.pins = Block(self, page(0x4001_4000), 0)
        self.pads = Block(self, page(0x4001_C000), 0)
        self.sio = Sio(self, Page(self, 0xD000_0000))
        self.flash = Flash(self, Page(self, 0x1800_0000))
        # Bit of a peripheral's reset.
        self.resettable: dict[int, Block] = {2: self.dma, 5: self.pins, 8: self.pads, 10: self.machine}
        self.resettable |= {12: self.pll, 14: self.slices, 22: self.serial}
        for bit, block in self.resettable.items():
            for kib in range(4):
                block.page.gates[kib] = partial(self.running, bit)
        self.blocks += [
            self.gates,
            self.xosc,
            self.clocks,
            self.psm,
            self.watchdog,
            self.noise,
            self.sio,
            self.flash,
        ]
        self.blocks += self.resettable.values()
        self.sources = [self.slices, self.serial, self.clocks]
        self.plain((0x1400_0000, 0x1400_1000), (0x4000_0000, 0x4007_0000), (0xE000_0000, 0xE010_0000))

    def running(self, bit: int) -> bool:
        return not self.gates[Resets.RESET] >> bit & 1

    def begin(self) -> None:
        """The chip's own loader: the beginning of the flash it copies and runs, if its sum is right."""
        loader = bytes(self.uc.mem_read(FLASH, 256))
        (told,) = struct.unpack("<I", loader[252:])
        # Without the reflections of the usual CRC-32, and without its inversion at the end.
        mirrored = bytes(int(f"{byte:08b}"[::-1], 2) for byte in loader[:252])
        summed = int(f"{binascii.crc32(mirrored) ^ WORD:032b}"[::-1], 2)
        if summed != told:
            raise ValueError("the first 256 bytes of the flash have a wrong checksum: the chip would not run them")
        self.uc.mem_write(LOADER, loader)
        self.pc = LOADER
        self.uc.reg_write(arm.UC_ARM_REG_SP, LOADER)
        self.uc.reg_write(arm.UC_ARM_REG_LR, 0)

    def reset(self, watchdog: bool = False) -> None:
        crystal = self.xosc[0]
        super().reset(watchdog)
        self.xosc[0] = crystal  # the watchdog leaves the oscillators alone
        self.watchdog[Watchdog.REASON] = int(watchdog)

    def set_faults(self, faults: int) -> None:
        new = faults & ~self.faults
        super().set_faults(faults)
        if new & Fault.CRYSTAL_DEAD:
            self.clocks.settle()
        if new & Fault.ENCODER_SKIP:
            self.machine.spike()

    def go_to(self, now_ns: int) -> None:
        self.machine.turn(self.counts)
        super().go_to(now_ns)

    def core_hz(self) -> int:
        return self.clocks.core_hz

    def timers_ns(self) -> int:
        return self.slices.next_ns()

    def code(self) -> int:
        on = self.pwm[0][Slice.CSR] & 1 and self.function(CONVERTER) == 4
        return min(self.pwm[0][Slice.CC] & 0xFFFF, 0xFFF) if on else 0

    def floats(self) -> bool:
        """True if the switch behind the filter rests on the voltage of its own."""
        driven = self.sio[Sio.OUT] & self.sio[Sio.OE] & 1 << SWITCH and self.function(SWITCH) == 5
        return not driven

    def function(self, pin: int) -> int:
        return self.pins[8 * pin + 4] & 31


class FlashMeter(Meter):
    """The Cortex-M0+ at 125 MHz, and its flash.

    The estimate assumes: one cycle for an instruction, two for a load or a store, one more for each register that
    several move; one more for a branch that is taken, and two for one that calls; 15 for a handler's begin and for its
    end, as the core's manual has them. Flash is read through a cache of 16 KiB, two ways of lines of eight bytes; a
    line that is not there takes 60 cycles: 8 clocks of the flash for its address, 4 to wait, 16 for the data, each two
    of the core, and a few more. No account is taken of waits for the buses.
    """

    CLOCK_MHZ, BRANCH, ENTRY, EXIT = 125, 1, 15, 15
    MISS, SETS, WAYS = 60, 1024, 2

    def __init__(self, chip: Chip) -> None:
        super().__init__(chip)
        self.line = -1
        self.cache: list[OrderedDict[int, None]] = [OrderedDict() for _ in range(self.SETS)]

    def cycles_of(self, code: bytes) -> int:
        first = int.from_bytes(code[:2], "little")
        if len(code) == 4:
            return 2 if first & 0xF800 == 0xF000 and code[3] & 0xD0 == 0xD0 else 3  # BL; MSR, MRS, barriers
        if first >> 12 in (0b0101, 0b0110, 0b0111, 0b1000, 0b1001) or first >> 11 == 0b01001:
            return 2
        if first & 0xF600 == 0xB400:  # PUSH, POP
            return 1 + (first & 0x1FF).bit_count() + (1 if first & 0x900 == 0x900 else 0)
        return 1 + (first & 0xFF).bit_count() if first >> 12 == 0b1100 else 1

    def fetched(self, at: int) -> None:
        if at >> 3 != self.line:
            self.line = at >> 3
            self.fetch(at)

    def loaded(self, at: int) -> None:
        self.fetch(at)

    def fetch(self, at: int) -> None:
        if at >> 24 != FLASH >> 24:
            return
        line = at >> 3
        ways = self.cache[line % self.SETS]
        if line in ways:
            ways.move_to_end(line)
            return
        self.cycles += self.MISS
        ways[line] = None
        if len(ways) > self.WAYS:
            ways.popitem(last=False)


if __name__ == "__main__":
    serve(Rp2040, FlashMeter)
