"""Builds the wheel: maturin's, and in it the native module once more for processors of the last decade.

A wheel for x86-64 must run on every such processor, and the compiler then leaves unused what most have. So on
x86-64 the module is compiled a second time, for the level x86-64-v3 (AVX2 and what came with it), and lies beside the
first; `clutch` takes the one that the processor can run when it is imported. Both give the same bits.

Everything but `build_wheel` is maturin's (PEP 517).
"""

import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import maturin
from maturin import (
    build_editable,
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

LEVEL = "x86-64-v3"


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """As maturin, and what packs the wheel anew."""
    return [*maturin.get_requires_for_build_wheel(config_settings), "wheel>=0.46"]


def wants_both() -> bool:
    """True if the build is for any x86-64, here: not for another machine, and not for one processor."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return False
    # The second goes before RUSTFLAGS, in which the level is asked for below.
    elsewhere = {"CARGO_BUILD_TARGET", "CARGO_ENCODED_RUSTFLAGS"} & os.environ.keys()
    return not elsewhere and "target-cpu" not in os.environ.get("RUSTFLAGS", "")


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    """The wheel's name; it lies in `wheel_directory`."""
    name = maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
    if not wants_both():
        return name
    before = dict(os.environ)
    # Flags of another build would make cargo compile everything of the first one anew.
    os.environ["CARGO_TARGET_DIR"] = str(Path(before.get("CARGO_TARGET_DIR", "target"), LEVEL).absolute())
    os.environ["RUSTFLAGS"] = f"{before.get('RUSTFLAGS', '')} -C target-cpu={LEVEL}".strip()
    try:
        with tempfile.TemporaryDirectory() as folder:
            second = maturin.build_wheel(folder, config_settings, metadata_directory)
            add(Path(wheel_directory, name), Path(folder, second))
    finally:
        os.environ.clear()
        os.environ.update(before)
    return name


def add(wheel: Path, second: Path) -> None:
    """Puts the native module of a second wheel beside that of the first."""
    pack = [sys.executable, "-m", "wheel"]
    with tempfile.TemporaryDirectory() as folder:
        here, there = Path(folder, "first"), Path(folder, "second")
        for file, to in [(wheel, here), (second, there)]:
            subprocess.run([*pack, "unpack", "--dest", to, file], check=True, stdout=subprocess.DEVNULL)
        (root,) = here.iterdir()
        (module,) = there.glob("*/clutch/_clutch.*.so")
        beside = root / "clutch" / LEVEL.replace("-", "_")
        beside.mkdir()
        module.rename(beside / module.name)
        subprocess.run([*pack, "pack", "--dest-dir", wheel.parent, root], check=True, stdout=subprocess.DEVNULL)
