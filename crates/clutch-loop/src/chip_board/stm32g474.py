"""Register model of an STM32G474RE, on which an unmodified image runs in virtual time: `python3 stm32g474.py IMAGE`.

`cortex_m.py` has the core and the protocol, and says what no chip here models. Of this chip clock gates are modelled
for the peripherals that the image drives.
"""

from __future__ import annotations

import ctypes
import struct
from collections import OrderedDict
from functools import partial
from typing import ClassVar

from cortex_m import NEVER, NMI, WORD, Block, Chip, Fault, Meter, Page, segments, serve
from unicorn import Uc
from unicorn import arm_const as arm
from unicorn import unicorn_const as uc_const

HSI_HZ, HSE_HZ, LSI_HZ = 16_000_000, 24_000_000, 32_000
ROM = 0x1FFF_0000  # system memory
GPIOA, GPIOC = 0x4800_0000, 0x4800_0800


class Registers(Block):
    """A peripheral of this chip."""

    chip: Stm32g474


class Timer(Registers):
    """A timer that counts up: CR1, DIER, SR, EGR, CNT, PSC, ARR, CCR1 to CCR4."""

    CR1, DIER, SR, EGR, CNT, PSC, ARR, CCR1 = 0x00, 0x0C, 0x10, 0x14, 0x24, 0x28, 0x2C, 0x34
    initial: ClassVar = {ARR: 0xFFFF}

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
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


class Encoder(Registers):
    """TIM3 in its encoder mode: 16 bits of the counts, from where they were when the timer was reset."""

    CNT = 0x24

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        self.on(self.CNT, self.count, self.set_count)

    def reset(self) -> None:
        super().reset()
        self.zero = self.chip.counts

    def count(self) -> int:
        self.chip.sampled()
        return (self.chip.counts - self.zero) & 0xFFFF

    def set_count(self, value: int) -> None:
        self.zero = self.chip.counts - value


class Converter(Registers):
    """DAC1, channel 1 without trigger: what is written into a DHR register is in DOR1 with the next clock."""

    CR, DHR12R1, DHR12L1, DHR8R1, DOR1 = 0x00, 0x08, 0x0C, 0x10, 0x2C

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
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


class Adc(Registers):
    """ADC1, on the voltage behind the amplifier, divided by its gain. A conversion is done at once."""

    ISR, CR, DR = 0x00, 0x08, 0x40
    ADRDY, EOC = 1 << 0, 1 << 2
    ADEN, ADSTART, ADVREGEN, DEEPPWD, ADCAL = 1 << 0, 1 << 2, 1 << 28, 1 << 29, 1 << 31
    initial: ClassVar = {CR: DEEPPWD}

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        self.on(self.ISR, write=self.clear)
        self.on(self.CR, write=self.control)
        self.on(self.DR, self.result)

    def clear(self, value: int) -> None:
        self[self.ISR] &= ~value

    def control(self, value: int) -> None:
        awake = value & self.ADVREGEN and not value & self.DEEPPWD
        if awake and value & self.ADEN:
            self[self.ISR] |= self.ADRDY
        if awake and value & self.ADSTART and self[self.ISR] & self.ADRDY:
            self[self.DR] = 0 if self.chip.faults & Fault.AMPLIFIER else self.chip.code()
            self[self.ISR] |= self.EOC
        self[self.CR] = value & ~(self.ADCAL | self.ADSTART)

    def result(self) -> int:
        self[self.ISR] &= ~self.EOC
        return self[self.DR]


class Watchdog(Registers):
    """IWDG, on the clock LSI of 32 kHz: it runs whatever happens to the core's."""

    KR, PR, RLR = 0x00, 0x04, 0x08
    initial: ClassVar = {RLR: 0xFFF}

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
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


class Noise(Registers):
    """RNG: always ready, and the same numbers in each run."""

    CR, SR, DR = 0x00, 0x04, 0x08

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
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


class Serial(Registers):
    """LPUART1: bytes by interrupt or by DMA. The transmitter is always empty, the line of the receiver idle once the
    bytes that came are read."""

    CR1, CR3, BRR, RQR, ISR, ICR, RDR, TDR = 0x00, 0x08, 0x0C, 0x18, 0x1C, 0x20, 0x24, 0x28
    BAUD = 921_600  # of the host
    ORE, IDLE, RXNE, TC, TXE = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
    FIFO = 8  # bytes
    REQUEST_RX, REQUEST_TX = 34, 35

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
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

    def in_step(self) -> bool:
        """True if the line has the host's rate, by 2 %: others make no bytes of it."""
        divider = self[self.BRR]
        return bool(divider) and abs(256 * self.chip.rcc.bus_hz / divider - self.BAUD) < 0.02 * self.BAUD

    def push(self, value: int) -> None:
        self.send(bytes([value & 0xFF]))
        self.chip.attend()

    def send(self, data: bytes) -> None:
        """Bytes leave over the line."""
        self.kept |= self.TC
        if self.in_step():
            self.sent += data

    def take(self, data: bytes) -> None:
        """Bytes come over the line."""
        if self[self.CR1] & 5 != 5 or not data or not self.in_step():  # the receiver is off, or hears noise
            return
        if self.chip.faults & Fault.OVERRUN and not self.chip.overrun:
            self.chip.overrun = True
            self.kept |= self.ORE
            data = data[: self.FIFO] + data[self.FIFO + 1 :]
        self.received += data
        self.chip.transfer()


class Dma(Registers):
    """DMA1 or DMA2: eight channels between memory and LPUART1, with half and complete interrupts, and circular."""

    ISR, IFCR, CCR, CNDTR, CPAR, CMAR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14
    EN, TCIE, HTIE, CIRC, MINC = 1 << 0, 1 << 1, 1 << 2, 1 << 5, 1 << 7

    def __init__(self, chip: Stm32g474, page: Page, base: int, first_mux: int, numbers: list[int]) -> None:
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


class WrongClock(Exception):
    """A clock that the maker does not allow: a chip may do anything there."""


class Clocks(Registers):
    """RCC: oscillators and PLL are ready at once, or never; the crystal can die.

    Above 80 MHz a chip comes from below with its core at half of that, or less, for a microsecond; and flash has wait
    states for the core's clock. Code takes no time here: instructions are counted instead, which take a clock or more.
    """

    CR, CFGR, PLLCFGR, CIFR, CICR, BDCR, CSR, CRRCR = 0x00, 0x08, 0x0C, 0x1C, 0x20, 0x90, 0x94, 0x98
    initial: ClassVar = {CR: 0x500, CFGR: 0x5, PLLCFGR: 0x1000}
    HSEON, CSSON, PLLON = 1 << 16, 1 << 19, 1 << 24
    CSSF = 1 << 8
    STEP_HZ = 80_000_000  # of the system's clock
    WAIT_STATE_HZ = 34_000_000  # another for each

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
        self.flags = 0x0C00_0000  # BORRSTF, PINRSTF: power-up
        self.counter: int | None = None  # the hook that counts instructions
        self.executed = 0  # since the system's clock has risen, at half of it for the core
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
        self.system_hz = self.source_hz(setting >> 2 & 3)
        self.core_hz = self.system_hz >> divided
        # A divided bus has timers at twice its clock.
        self.timer_hz = self.core_hz >> {5: 0, 6: 1, 7: 2}.get(setting >> 8 & 7, 0)
        self.bus_hz = self.core_hz >> {4: 1, 5: 2, 6: 3, 7: 4}.get(setting >> 8 & 7, 0)

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
        system_hz, core_hz = self.system_hz, self.core_hz
        self.change(self.CFGR, value & ~0xC | source << 2)
        self.judge(system_hz, core_hz)

    def judge(self, system_hz: int, core_hz: int) -> None:
        """Whether the core may have the clock that it has, after these."""
        mhz = self.core_hz / 1e6
        states = self.chip.uc.mem_read(0x4002_2000, 1)[0] & 15  # FLASH_ACR.LATENCY
        if self.core_hz > (states + 1) * self.WAIT_STATE_HZ:
            raise WrongClock(f"{mhz:g} MHz with {states} wait states of the flash")
        if self.core_hz < self.system_hz and self.counter is None:
            hook = uc_const.UC_HOOK_CODE
            self.counter = self.chip.uc.hook_add(
                hook, self.count, None, self.chip.FLASH.start, self.chip.FLASH.stop - 1
            )
        if system_hz <= self.STEP_HZ < self.system_hz:
            self.executed = 0
            if self.core_hz == self.system_hz:
                raise WrongClock(f"from {core_hz / 1e6:g} to {mhz:g} MHz in one step")
        elif self.system_hz > self.STEP_HZ and core_hz < self.core_hz == self.system_hz and self.counter is not None:
            if self.executed * 1_000_000 < core_hz:
                raise WrongClock(f"{mhz:g} MHz after {self.executed} instructions at {core_hz / 1e6:g} MHz")
            self.chip.uc.hook_del(self.counter)
            self.counter = None

    def count(self, _uc: Uc, _at: int, _size: int, _data: object) -> None:
        self.executed += 1

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


class Backup(Registers):
    """TAMP: registers that outlive a reset, and take writes only when PWR_CR1.DBP is set."""

    def __init__(self, chip: Stm32g474, page: Page, base: int) -> None:
        super().__init__(chip, page, base)
        for at in range(0x100, 0x180, 4):
            self.on(at, write=partial(self.keep, at))

    def reset(self) -> None:
        pass

    def keep(self, at: int, value: int) -> None:
        if self.chip.uc.mem_read(0x4000_7001, 1)[0] & 1:  # PWR_CR1.DBP
            self[at] = value


class Stm32g474(Chip):
    """The chip."""

    CORE, CPUID = arm.UC_CPU_ARM_CORTEX_M4, 0x410F_C241
    FLASH, TABLE, ROM = range(0x0800_0000, 0x0808_0000), 0x0800_0000, ROM
    watchdog: Watchdog
    serial: Serial

    def map_memory(self, image: bytes) -> None:
        flash = self.share(0x8_0000, uc_const.UC_PROT_READ | uc_const.UC_PROT_EXEC, 0x0800_0000, 0)
        self.share(0x1_8000, uc_const.UC_PROT_ALL, 0x2000_0000)
        self.share(0x8000, uc_const.UC_PROT_ALL, 0x1000_0000, 0x2001_8000)  # CCM
        ctypes.memset(flash, 0xFF, len(flash))
        for at, _, data in segments(image):
            ctypes.memmove(ctypes.addressof(flash) + at - 0x0800_0000, data, len(data))
        self.uc.mem_map(ROM, 0x1_0000)
        self.uc.mem_write(0x1FFF_7590, b"clutch model")  # UID, 96 bits

    def map_registers(self) -> None:
        modelled = [
            0x4000_0000,
            0x4000_2000,
            0x4000_3000,
            0x4000_8000,
            0x4002_0000,
            0x4002_1000,
            0x5000_0000,
            0x5006_0000,
        ]
        pages = {at: Page(self, at) for at in [*modelled, 0xE000_1000]}
        self.plain((0x4000_0000, 0x4001_8000), (0x4002_0000, 0x4002_5000), (0x4800_0000, 0x4800_2000))
        self.plain((0x5000_0000, 0x5000_2000), (0x5006_0000, 0x5006_1000), (0xE000_0000, 0xE010_0000))
        self.rcc = Clocks(self, pages[0x4002_1000], 0)
        self.timer = Timer(self, pages[0x4000_0000], 0xC00)
        self.encoder = Encoder(self, pages[0x4000_0000], 0x400)
        self.backup = Backup(self, pages[0x4000_2000], 0x400)
        self.watchdog = Watchdog(self, pages[0x4000_3000], 0)
        self.serial = Serial(self, pages[0x4000_8000], 0)
        self.mux = Block(self, pages[0x4002_0000], 0x800)
        numbers = [[*range(27, 34), 112], [*range(72, 77), 113, 114, 115]]
        self.dma = [Dma(self, pages[0x4002_0000], 0x400 * n, 8 * n, numbers[n]) for n in range(2)]
        self.converter = Converter(self, pages[0x5000_0000], 0x800)
        self.adc = Adc(self, pages[0x5000_0000], 0)
        self.noise = Noise(self, pages[0x5006_0000], 0x800)
        self.trace = Block(self, pages[0xE000_1000], 0)
        self.trace.on(0x04, lambda: self.meter.executed & WORD if self.meter else 0)  # CYCCNT
        self.blocks += [self.rcc, self.timer, self.encoder, self.watchdog, self.serial, self.mux]
        self.blocks += [*self.dma, self.converter, self.adc, self.noise, self.trace]
        # Offset in RCC and bit of a peripheral's reset.
        self.resettable: dict[tuple[int, int], list[Block]] = {
            (0x28, 0): [self.dma[0]],
            (0x28, 1): [self.dma[1]],
            (0x28, 2): [self.mux],
            (0x2C, 13): [self.adc],
            (0x2C, 16): [self.converter],
            (0x38, 1): [self.encoder],
            (0x38, 3): [self.timer],
            (0x3C, 0): [self.serial],
        }
        self.backup.page.gates[1] = partial(self.clocked, 0x58, 10)
        for (offset, bit), blocks in self.resettable.items():
            for block in blocks:
                block.page.gates[block.base >> 10] = partial(self.clocked, offset + 0x20, bit)
        self.sources = [self.timer, self.serial, *self.dma]

    def clocked(self, at: int, bit: int) -> bool:
        return bool(self.rcc[at] >> bit & 1)

    def begin(self) -> None:
        for at in [0x4000_7000, 0x4002_2000, GPIOA, GPIOC]:
            self.uc.mem_write(at, bytes(0x400))
        self.uc.mem_write(GPIOA, struct.pack("<I", 0xABFF_FFFF))  # MODER: analogue, but for the debugger's pins
        self.uc.mem_write(GPIOC, struct.pack("<I", 0xFFFF_FFFF))
        self.set_button()
        self.uc.mem_write(0x4000_7080, b"\x00\x01")  # PWR_CR5.R1MODE
        self.load_options()
        stack, self.pc = struct.unpack("<II", self.uc.mem_read(0x0800_0000, 8))
        self.uc.reg_write(arm.UC_ARM_REG_SP, stack)

    def load_options(self) -> None:
        """FLASH_OPTR.BOR_LEV: 2.8 V, or as the maker delivers it."""
        level = 0 if self.faults & Fault.BROWN_OUT_LOW else 4
        self.uc.mem_write(0x4002_2020, struct.pack("<I", level << 8))

    def reset(self, watchdog: bool = False) -> None:
        super().reset(watchdog)
        self.rcc.flags |= 1 << 26 | (1 << 29 if watchdog else 1 << 28)  # PINRSTF comes with each

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
        super().set_faults(faults)
        self.load_options()
        self.set_button()
        if new & Fault.CRYSTAL_DEAD:
            self.rcc.crystal_died()

    def set_button(self) -> None:
        """GPIOC_IDR, bit 13, where the pin is an input."""
        moder, _, _, _, levels = struct.unpack("<5I", self.uc.mem_read(GPIOC, 20))
        pressed = self.faults & Fault.PRESSED and not moder >> 26 & 3
        self.uc.mem_write(GPIOC + 0x10, struct.pack("<I", levels & ~(1 << 13) | bool(pressed) << 13))

    def lamp(self) -> bool:
        """Bit 5 of GPIOA_ODR, where the pin is an output."""
        moder, _, _, _, _, levels = struct.unpack("<6I", self.uc.mem_read(GPIOA, 24))
        return bool(levels >> 5 & 1) and moder >> 10 & 3 == 1

    def core_hz(self) -> int:
        return self.rcc.core_hz

    def timers_ns(self) -> int:
        return self.timer.next_ns()

    def code(self) -> int:
        return self.converter[Converter.DOR1]

    def floats(self) -> bool:
        return not self.converter[Converter.CR] & 1

    def transfer(self) -> None:
        """DMA moves what it can between LPUART1 and memory."""
        serial = self.serial
        for dma in self.dma:
            while serial.received and serial[Serial.CR3] & 1 << 6 and (n := dma.serves(Serial.REQUEST_RX)) is not None:
                del serial.received[: len(dma.move(n, bytes(serial.received)))]
                if not serial.received:
                    serial.kept |= Serial.IDLE
            while serial[Serial.CR3] & 1 << 7 and (n := dma.serves(Serial.REQUEST_TX)) is not None:
                serial.send(dma.move(n, None))
                if not serial[Serial.CR3] & 1 << 7:
                    break
        self.attend()


class FlashMeter(Meter):
    """The Cortex-M4F at 170 MHz, and its flash.

    The estimate assumes: one cycle for an instruction, two for a load, more for what moves several registers,
    divides, or multiplies and adds in floating point, as the core's manual has them; two for a branch that is taken;
    12 and 10 for a handler's begin and end. Flash is read by 64 bits with four wait states, into an instruction
    cache of 1 KB and a data cache of 256 bytes, each by least recent use. The prefetch, where the image switches it on,
    is taken to read the next 64 bits while those before are executed, and to be held up by no load and no jump: a best
    case. The waits that it hides so are counted beside it: with them there is no prefetch, a worst case. Which of the
    two the chip is nearer to was not measured. No account is taken of how instructions overlap, nor of waits for the
    peripherals' buses.
    """

    BRANCH, CLOCK_MHZ, ENTRY, EXIT = 2, 170, 12, 10
    WAIT_STATES = 4
    CODE_WORDS, DATA_WORDS = 128, 32  # of 64 bits

    def __init__(self, chip: Chip) -> None:
        super().__init__(chip)
        self.word = -1
        self.ahead = 0  # cycles at which the next word will have been read
        self.code: OrderedDict[int, None] = OrderedDict()
        self.data: OrderedDict[int, None] = OrderedDict()

    def cycles_of(self, code: bytes) -> int:
        return cycles_of(code)

    def fetched(self, at: int) -> None:
        word = at >> 3
        if word == self.word:
            return
        follows = word == self.word + 1
        self.word = word
        if not self.cached(self.code, word, self.CODE_WORDS):
            waits = self.WAIT_STATES
            if follows and self.prefetches():
                waits = min(waits, max(0, self.ahead - self.cycles))
                self.hidden += self.WAIT_STATES - waits
            self.cycles += waits
        self.ahead = self.cycles + self.WAIT_STATES

    def loaded(self, at: int) -> None:
        if not self.cached(self.data, at >> 3, self.DATA_WORDS):
            self.cycles += self.WAIT_STATES

    def prefetches(self) -> bool:
        return bool(self.chip.uc.mem_read(0x4002_2001, 1)[0] & 1)  # FLASH_ACR.PRFTEN

    def cached(self, cache: OrderedDict[int, None], word: int, words: int) -> bool:
        """True if the word is there; from now on it is."""
        if word in cache:
            cache.move_to_end(word)
            return True
        cache[word] = None
        if len(cache) > words:
            cache.popitem(last=False)
        return False


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


if __name__ == "__main__":
    serve(Stm32g474, FlashMeter)
