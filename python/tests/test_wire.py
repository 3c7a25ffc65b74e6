"""The golden bytes of the wire protocol, and the tables of its specification, against a decoder
that was written from the specification (wire_decoder.py)."""

import csv
import re
from pathlib import Path

import pytest

import wire_decoder as wire

ROOT = Path(__file__).resolve().parents[2]
DOCUMENT = (ROOT / "docs" / "wire.md").read_text(encoding="utf-8")
with (ROOT / "tests" / "wire" / "vectors.csv").open(encoding="utf-8", newline="") as file:
    VECTORS = list(csv.DictReader(file))

TYPES = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i32": "i", "[u32;8]": "B"}
SIZES = {"u8": 1, "u16": 2, "u32": 4, "u64": 8, "i32": 4, "[u32;8]": 1}


def shown(result):
    """A result as the file of golden bytes writes it."""
    if isinstance(result, wire.FrameError):
        name, numbers = f"!{result.name}", result.numbers
    else:
        name, numbers = result
    text = {key: f"[{' '.join(map(str, value))}]" if isinstance(value, tuple) else value for key, value in numbers.items()}
    return " ".join([name, *(f"{key}={value}" for key, value in text.items())])


def tables():
    """Kind, name, and (offset, field, type) of each message, as the specification prints them."""
    generated = DOCUMENT.split("<!-- table:begin -->")[1].split("<!-- table:end -->")[0]
    found = []
    for section in generated.split("\n### ")[1:]:
        head = re.match(r"`0x([0-9a-f]{2})` (\w+)\n", section)
        if head:
            rows = re.findall(r"^\| (\d+)(?: \+ 4 n)? \| (?:`(\w+)`|(CRC)) \| `([\w;\[\]]+)` \|", section, flags=re.M)
            fields = [(int(offset), name or crc, ty) for offset, name, crc, ty in rows]
            found.append((int(head[1], 16), head[2], fields))
    return found


@pytest.mark.parametrize("row", VECTORS, ids=lambda row: row["name"])
def test_golden_bytes_say_what_the_specification_says(row):
    data = bytes.fromhex(row["bytes"])
    results = wire.receive(data)
    assert "; ".join(map(shown, results)) == row["results"]
    if row["kind"] == "frame":
        [(name, fields)] = results
        assert wire.encode(name, **fields).hex() == row["bytes"]
    elif row["kind"] == "bad":
        assert [type(result) for result in results] == [wire.FrameError]
    else:
        assert row["kind"] == "stream"


def test_every_message_and_every_error_has_golden_bytes():
    heard = [result for row in VECTORS for result in wire.receive(bytes.fromhex(row["bytes"]))]
    text = {shown(result).split()[0] for result in heard}
    errors = {"!Cobs", "!TooLong", "!TooShort", "!Crc", "!UnknownKind", "!Length"}
    assert text == set(wire.BY_NAME) | errors


def test_tables_of_the_specification_have_the_layouts_of_the_decoder():
    found = tables()
    assert [kind for kind, _, _ in found] == list(wire.BY_KIND)
    for kind, name, fields in found:
        end = 1
        for offset, field, ty in fields:
            assert offset == end, f"{name}.{field}"
            end += SIZES[ty]
        *fields, crc = fields
        assert crc[1:] == ("CRC", "u32")
        layout = wire.BY_KIND[kind]
        assert (layout.name, layout.length) == (name, end)
        assert layout.fields == tuple(field for _, field, _ in fields)
        assert layout.form.format == "<" + "".join(TYPES[ty] for _, _, ty in fields)
        assert layout.has_list == (fields[-1][2] == "[u32;8]")


def test_the_schema_hash_is_that_of_the_printed_tables():
    text = ""
    for kind, name, fields in tables():
        words = [f"{field}:{ty}" for _, field, ty in fields if field != "CRC"]
        text += " ".join([f"{kind:02x}", name, *words]) + "\n"
    for line in DOCUMENT.split("Two of its lines:")[1].split("```text\n")[1].split("```")[0].splitlines():
        assert line + "\n" in text
    value = 0xCBF29CE484222325
    for byte in text.encode("ascii"):
        value = (value ^ byte) * 0x100000001B3 % 2**64
    assert f"schema `{value:#018x}`" in DOCUMENT
    hello = next(row for row in VECTORS if row["name"] == "Hello: board of the paper")
    [(_, fields)] = wire.receive(bytes.fromhex(hello["bytes"]))
    assert fields["schema"] == value


def test_worked_examples_are_golden():
    section = DOCUMENT.split("## A cycle, byte by byte")[1].split("\n## ")[0]
    frames = [bytes.fromhex(match) for match in re.findall(r"^frame +((?:[0-9a-f]{2} )+) ", section, flags=re.M)]
    golden = {row["bytes"]: row["results"] for row in VECTORS}
    assert [golden[frame.hex()] for frame in frames] == [
        "Sample run=1 sequence=256 time_us=256000 counts=-7 status=3",
        "Actuate run=1 sequence=256 code=2560 valid_us=2000",
    ]
    bodies = [
        bytes.fromhex("".join(re.findall(r"\b[0-9a-f]{2}\b", line.rsplit("  ", 1)[0])))
        for line in re.findall(r"^body .*$", section, flags=re.M)
    ]
    assert [wire.stuff(body) for body in bodies] == frames


def test_the_table_of_baud_rates_is_its_own_arithmetic():
    rows = re.findall(r"^\| ([\d ]+) \| ([\d.]+) ms \| ([\d.]+) ms \| ([\d.]+) ms \|$", DOCUMENT, flags=re.M)
    assert len(rows) == 5
    for baud, *times in rows:
        baud = int(baud.replace(" ", ""))
        sample, both = 20 * 10 / baud, (20 + 15) * 10 / baud
        exact = [1e3 * time for time in (sample, both, 1.25 * sample)]
        assert [float(time) for time in times] == pytest.approx(exact, rel=0, abs=0.00501)
