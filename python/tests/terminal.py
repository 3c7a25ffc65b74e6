"""The drawing of a program on a terminal: its screen, and that as a page."""

import codecs
import fcntl
import html
import os
import pty
import select
import struct
import subprocess
import termios
import time

import pyte

#: Colours as people see them on dark ground, by pyte's names; others are given as hexadecimal digits.
COLOURS = {
    "red": "cd0000",
    "green": "00cd00",
    "brown": "cdcd00",
    "blue": "5c8dff",
    "magenta": "cd00cd",
    "cyan": "00cdcd",
}


def when(shown, command, size, seconds=120):
    """The screen of a program as soon as its text is as wanted; the program is ended."""
    columns, rows = size
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    environment = {**os.environ, "TERM": "xterm-256color"}
    environment.pop("NO_COLOR", None)
    program = subprocess.Popen(command, stdin=theirs, stdout=subprocess.DEVNULL, stderr=theirs, env=environment)
    os.close(theirs)
    decoder, screen = codecs.getincrementaldecoder("utf-8")(), pyte.Screen(columns, rows)
    stream, end = pyte.Stream(screen), time.monotonic() + seconds
    try:
        while not shown("\n".join(screen.display)):
            if not select.select([ours], [], [], max(0.0, end - time.monotonic()))[0]:
                raise TimeoutError("\n".join(screen.display))
            stream.feed(decoder.decode(os.read(ours, 1 << 16)))
    finally:
        program.terminate()
        program.wait()
        os.close(ours)
    return screen


def page(screen):
    """The screen as HTML, each cell in its place, whatever font has its character."""
    lines = []
    for row in range(screen.lines):
        line = ""
        for column in range(screen.columns):
            cell = screen.buffer[row][column]
            colour = "" if cell.fg == "default" else f"color:#{COLOURS.get(cell.fg, cell.fg)};"
            weight = "font-weight:700;" if cell.bold else ""
            line += f'<i style="{colour}{weight}">{html.escape(cell.data)}</i>'
        lines.append(line)
    css = """
    body { margin: 0; background: #15181c; }
    pre { display: inline-block; margin: 0; padding: 12px; color: #e4e7ea; font: 15px/19px "DejaVu Sans Mono"; }
    i { display: inline-block; width: 9px; height: 19px; overflow: hidden; font-style: normal; vertical-align: top; }
    """
    return f'<!DOCTYPE html><meta charset="utf-8"><style>{css}</style><pre>{"<br>".join(lines)}</pre>'
