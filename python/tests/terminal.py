"""What a program draws on a terminal: its screen, as far as crossterm's sequences go, and that as a page."""

import codecs
import fcntl
import html
import os
import pty
import re
import select
import struct
import subprocess
import termios
import time

#: A control sequence with its parameters and its letter, another escape, or one character.
PART = re.compile(r"\x1b\[([0-9;?]*)([A-Za-z])|\x1b[^\[]|(.)", re.DOTALL)
#: No sequence is longer.
LONGEST = 32
#: The first sixteen of 256 colours: those of xterm.
SIXTEEN = ["#000000", "#cd0000", "#00cd00", "#cdcd00", "#5c8dff", "#cd00cd", "#00cdcd", "#e5e5e5"]
SIXTEEN += ["#7f7f7f", "#ff0000", "#00ff00", "#ffff00", "#7f9fff", "#ff00ff", "#00ffff", "#ffffff"]


class Screen:
    """Rows of cells, each a character with its colour, bold and dim."""

    def __init__(self, columns, rows):
        self.cells = [[(" ", None, False, False)] * columns for _ in range(rows)]
        self.row = self.column = 0
        self.colour, self.bold, self.dim = None, False, False

    def text(self):
        """Its characters alone."""
        return "\n".join("".join(cell[0] for cell in row) for row in self.cells)

    def take(self, text):
        """What the program writes next."""
        for parameters, letter, character in PART.findall(text):
            if character:
                self.put(character)
            elif letter == "H":
                row, _, column = parameters.partition(";")
                self.row, self.column = int(row or 1) - 1, int(column or 1) - 1
            elif letter == "J" and parameters in ("", "2"):
                self.__init__(len(self.cells[0]), len(self.cells))
            elif letter == "m":
                self.style([int(number or 0) for number in parameters.split(";")])

    def put(self, character):
        if character == "\n":
            self.row += 1
        elif character == "\r":
            self.column = 0
        elif self.row < len(self.cells) and self.column < len(self.cells[0]):
            self.cells[self.row][self.column] = (character, self.colour, self.bold, self.dim)
            self.column += 1

    def style(self, numbers):
        while numbers:
            match numbers:
                case [38, 5, colour, *rest]:
                    self.colour, numbers = SIXTEEN[colour % 16], rest
                case [0, *rest]:
                    (self.colour, self.bold, self.dim), numbers = (None, False, False), rest
                case [1, *rest]:
                    self.bold, numbers = True, rest
                case [2, *rest]:
                    self.dim, numbers = True, rest
                case [22, *rest]:
                    (self.bold, self.dim), numbers = (False, False), rest
                case [39, *rest]:
                    self.colour, numbers = None, rest
                case [_, *rest]:
                    numbers = rest


def when(shown, command, size, seconds=120):
    """The screen of a program as soon as its text is as wanted; the program is ended."""
    columns, rows = size
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    environment = {**os.environ, "TERM": "xterm-256color"}
    environment.pop("NO_COLOR", None)
    program = subprocess.Popen(command, stdin=theirs, stdout=subprocess.DEVNULL, stderr=theirs, env=environment)
    os.close(theirs)
    decoder, screen = codecs.getincrementaldecoder("utf-8")(), Screen(columns, rows)
    written, end = "", time.monotonic() + seconds
    try:
        while not shown(screen.text()):
            if not select.select([ours], [], [], max(0.0, end - time.monotonic()))[0]:
                raise TimeoutError(screen.text())
            written += decoder.decode(os.read(ours, 1 << 16))
            # A sequence whose end has not come waits for it.
            whole = written.rpartition("\x1b")
            cut = len(whole[0]) if whole[1] and len(whole[2]) < LONGEST else len(written)
            screen.take(written[:cut])
            written = written[cut:]
    finally:
        program.terminate()
        program.wait()
        os.close(ours)
    return screen


def page(screen):
    """The screen as HTML, each cell in its place, whatever font has its character."""
    lines = []
    for row in screen.cells:
        line = ""
        for character, colour, bold, dim in row:
            style = "".join(
                [
                    f"color:{colour};" if colour else "",
                    "font-weight:700;" if bold else "",
                    "opacity:0.7;" if dim else "",
                ]
            )
            line += f'<i style="{style}">{html.escape(character)}</i>'
        lines.append(line)
    css = """
    body { margin: 0; background: #15181c; }
    pre { display: inline-block; margin: 0; padding: 12px; color: #e4e7ea; font: 15px/19px "DejaVu Sans Mono"; }
    i { display: inline-block; width: 9px; height: 19px; overflow: hidden; font-style: normal; vertical-align: top; }
    """
    return f'<!DOCTYPE html><meta charset="utf-8"><style>{css}</style><pre>{"<br>".join(lines)}</pre>'
