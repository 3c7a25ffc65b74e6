"""The command `clutch`: the one that Rust builds, in the wheel."""

import signal
import sys
from pathlib import Path

from clutch import _clutch

# Of boards; a wheel of a release brings them, one that is built from source does not.
IMAGES = Path(__file__).with_name("images")


def main() -> int:
    """Run the command with this process's arguments; return its exit code."""
    # The verbs that need Ctrl-C catch it themselves; the others end at once, as the binary does.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _clutch.main(["clutch", *sys.argv[1:]], IMAGES)
