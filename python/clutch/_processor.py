"""The choice of the wheel's native module that the processor can run."""

import os
import sys
from pathlib import Path

#: The level of x86-64 that the second module is compiled for: its folder, and the features that it needs.
LEVEL = "x86-64-v3"
NEEDS = frozenset(("avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"))

#: The environment variable that chooses, and its possible values.
VARIABLE = "CLUTCH_PROCESSOR"
CHOICES = ("x86-64", LEVEL)


def has_level(cpuinfo: Path = Path("/proc/cpuinfo")) -> bool:
    """True if Linux reports that the processor has the features of the level, and lets programs use them."""
    try:
        with cpuinfo.open("rb") as file:
            first = file.read(8192)  # the first processor: they are alike
    except OSError:
        return False
    for line in first.splitlines():
        if line.startswith(b"flags"):
            return NEEDS.issubset(line.decode("ascii", "replace").split())
    return False


def folder(package: Path) -> Path | None:
    """Folder of the module for processors of that level, if it is the one to take.

    It is if the wheel has it, the processor can run it, and the variable does not say otherwise.
    """
    wanted = os.environ.get(VARIABLE)
    if wanted is not None and wanted not in CHOICES:
        raise ImportError(
            f"{VARIABLE} = {wanted}: expected {' or '.join(CHOICES)}, or nothing: the faster that runs here"
        )
    beside = package / LEVEL.replace("-", "_")
    if wanted == CHOICES[0] or not (wanted or beside.is_dir()):
        return None
    if beside.is_dir() and has_level():
        return beside
    if wanted is None:
        return None
    why = "this processor cannot run it" if beside.is_dir() else "this build has no module for it"
    raise ImportError(f"{VARIABLE} = {wanted}: {why}; expected {CHOICES[0]}")


# Done by the import: the native module must not have been imported before.
_package = sys.modules["clutch"].__path__
_folder = folder(Path(_package[0]))
if _folder is not None:
    _package.insert(0, str(_folder))
