"""The command `clutch`: the one that Rust builds, in the wheel."""

import signal
import sys

from clutch import _clutch


def main() -> int:
    """Run the command with this process's arguments; return its exit code."""
    # The verbs that need Ctrl-C catch it themselves; the others end at once, as the binary does.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _clutch.main(["clutch", *sys.argv[1:]])
