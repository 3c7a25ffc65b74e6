"""The wire protocol once more, written from docs/wire.md and sharing nothing with the Rust crate.

A second reading of the specification: where it is unclear or wrong, the two disagree about the
golden bytes (test_wire.py). No dependency but the standard library.
"""

import struct
import zlib
from dataclasses import dataclass

# Kind, name, fields; `struct` codes: B u8, H u16, I u32, Q u64, i i32. L: a list of u32 at the end, behind its number.
LAYOUTS = {
    0x01: ("Discover", "nonce:I version:B schema:Q"),
    0x02: (
        "Configure",
        "run:H config:Q period_us:I watchdog_us:I safe_kind:B hold_code:H release_code:H ramp_step:I hold_periods:I",
    ),
    0x03: ("Arm", "run:H config:Q boot:I"),
    0x04: ("Actuate", "run:H sequence:H code:H valid_us:H"),
    0x05: ("Stop", "run:H reason:B"),
    0x06: ("Ping", "run:H nonce:I"),
    0x07: ("Set", "run:H key:H value:Q"),
    0x81: (
        "Hello",
        "nonce:I version:B schema:Q board:I boot:I counts_per_rev:I dac_bits:B dac_lowest_mv:i"
        " dac_highest_mv:i period_min_us:I period_max_us:I watchdog_max_us:I"
        " boot_code:H started_by:B warnings:B state:B run:H config:Q",
    ),
    0x82: ("Configured", "run:H config:Q boot:I"),
    0x83: ("Armed", "run:H config:Q"),
    0x84: ("Sample", "run:H sequence:H time_us:I counts:i status:B"),
    0x85: ("Fault", "run:H sequence:H time_us:I cause:B value:I"),
    0x86: ("Stopped", "run:H reason:B code:H"),
    0x87: ("Pong", "run:H nonce:I time_us:I"),
    0x88: ("Refused", "request:B reason:B value:I"),
    0x89: (
        "ControllerHello",
        "nonce:I version:B schema:Q settings:Q board:I boot:I clock_hz:I knots:H state:B run:H config:Q",
    ),
    0x8A: ("Taken", "run:H key:H value:Q"),
    0x8B: (
        "Telemetry",
        "run:H number:H tick:I sequence:H time_us:I counts:i status:B flags:B arrival:B states:B cause:B value:I"
        " lateness_us:I error:I error_rate:I demand:I code:H cycles:I terms:L",
    ),
    0x8C: ("Ended", "run:H tick:I states:B cause:B value:I"),
    0x8D: (
        "Link",
        "run:H received:I lost:I late:I duplicated:I reordered:I bad_frames:I rejected:I deadline_misses:I dropped:I",
    ),
}


# Most numbers of a list.
MOST = 8


@dataclass(frozen=True)
class Layout:
    """The layout of one kind of body."""

    kind: int
    name: str
    fields: tuple[str, ...]
    form: struct.Struct
    has_list: bool

    @property
    def length(self):
        """Bytes of the body: kind, fields, CRC; without the numbers of a list."""
        return 1 + self.form.size + 4

    @property
    def longest(self):
        """The same with as many numbers as a list may have."""
        return self.length + (4 * MOST if self.has_list else 0)

    def length_of(self, content):
        """The same with as many numbers as the list of this content claims."""
        claimed = content[self.form.size] if self.has_list and len(content) > self.form.size else 0
        return self.length + 4 * claimed


def _layout(kind, name, fields):
    names, codes = zip(*(field.split(":") for field in fields.split()), strict=True)
    # A list begins with the number of its numbers.
    form = struct.Struct("<" + "".join(codes).replace("L", "B"))
    return Layout(kind, name, names, form, codes[-1] == "L")


BY_KIND = {kind: _layout(kind, *rest) for kind, rest in LAYOUTS.items()}
BY_NAME = {layout.name: layout for layout in BY_KIND.values()}
LONGEST_BODY = max(layout.longest for layout in BY_KIND.values())


class FrameError(Exception):
    """Reason why a frame was dropped: a name and numbers."""

    def __init__(self, name, **numbers):
        super().__init__(name, numbers)
        self.name, self.numbers = name, numbers


def stuff(body):
    """COBS and the delimiter, piece by piece."""
    return b"".join(bytes([len(piece) + 1]) + piece for piece in body.split(b"\0")) + b"\0"


def unstuff(data):
    """The body of a frame that came without its delimiter."""
    pieces, at = [], 0
    while at < len(data):
        code = data[at]
        piece = data[at + 1 : at + code]
        if len(piece) != code - 1:
            raise FrameError("Cobs")
        pieces.append(piece)
        at += code
    return b"\0".join(pieces)


def encode(name, **fields):
    """The frame of a message."""
    layout = BY_NAME[name]
    values, numbers = [fields[key] for key in layout.fields], ()
    if layout.has_list:
        numbers, values[-1] = values[-1], len(values[-1])
    content = bytes([layout.kind]) + layout.form.pack(*values) + struct.pack(f"<{len(numbers)}I", *numbers)
    return stuff(content + struct.pack("<I", zlib.crc32(content)))


def parse(data):
    """Name and fields of a frame that came without its delimiter."""
    body = unstuff(data)
    if len(body) < 5:
        raise FrameError("TooShort")
    content, (expected,) = body[:-4], struct.unpack("<I", body[-4:])
    computed = zlib.crc32(content)
    if computed != expected:
        raise FrameError("Crc", expected=expected, computed=computed)
    layout = BY_KIND.get(content[0])
    if layout is None:
        raise FrameError("UnknownKind", kind=content[0])
    length = layout.length_of(content)
    if len(body) != length:
        raise FrameError("Length", kind=layout.kind, expected=min(length, 255), got=len(body))
    values = list(layout.form.unpack_from(content, 1))
    if layout.has_list:
        values[-1] = struct.unpack_from(f"<{values[-1]}I", content, 1 + layout.form.size)
    return layout.name, dict(zip(layout.fields, values, strict=True))


def receive(stream):
    """The results of a receiver that has just started, for a stream: messages and errors in order."""
    said, kept, dropping = [], bytearray(), False
    for byte in stream:
        if byte != 0:
            if dropping:
                continue
            kept.append(byte)
            if len(kept) > LONGEST_BODY + 1:
                said.append(FrameError("TooLong"))
                dropping = True
            continue
        if kept and not dropping:
            try:
                said.append(parse(bytes(kept)))
            except FrameError as error:
                said.append(error)
        kept.clear()
        dropping = False
    return said
