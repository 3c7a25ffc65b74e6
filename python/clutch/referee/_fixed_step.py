"""Common parts of adapters for engines with a fixed step."""

from __future__ import annotations

import importlib.metadata
import importlib.util
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from clutch._extras import install
from clutch.referee._case import Case, Mechanism

__all__ = ["Level", "OneLevel", "frame", "missing", "refuses_length", "substeps", "version"]

#: The step that a run takes where a case's samples are not nearer to each other, s.
STEP = 1e-3
#: The one of a case's two levels of friction that an engine has, and its words.
Level = Literal["mu_static", "mu_dynamic"]
_LEVELS: dict[Level, str] = {"mu_static": "that of rest", "mu_dynamic": "that of sliding"}


class OneLevel:
    """An engine whose dry friction has one level: that of rest unless told otherwise."""

    kind = ""

    def __init__(self, level: Level = "mu_static") -> None:
        self.level = level
        self.name = self.kind if level == "mu_static" else f"{self.kind}_sliding"

    def told(self) -> str:
        """Its level, in words."""
        return f"one coefficient: {_LEVELS[self.level]}"


def missing(*packages: str) -> str | None:
    """The first package that is not installed."""
    absent = [name for name in packages if importlib.util.find_spec(name) is None]
    return f"{absent[0]} is not installed: {install(absent[0])}" if absent else None


def version(package: str) -> str:
    """Version of a package, if it is installed."""
    return importlib.metadata.version(package) if missing(package) is None else "(not installed)"


def substeps(case: Case) -> int:
    """Steps from one sample of a case to the next."""
    return max(1, round(case.sample / STEP))


def refuses_length(case: Case, most: int) -> str | None:
    """Reason why a case is too long for so many steps."""
    if case.mechanism is None:
        return "a scenario has an encoder and a law"
    steps = case.samples * substeps(case)
    return f"would take {steps} steps of {1e3 * case.sample / substeps(case):g} ms" if steps > most else None


def frame(m: Mechanism) -> NDArray[np.float64] | None:
    """Velocities of the joints at which no row slips; None if there are none."""
    joints = np.array([row.joints for row in m.rows]).reshape(len(m.rows), len(m.load))
    base = np.array([row.base_velocity for row in m.rows])
    if not base.any():
        return np.zeros(len(m.load))
    rest = np.linalg.lstsq(joints, base)[0]
    return np.asarray(rest) if np.allclose(joints @ rest, base, rtol=1e-12, atol=0.0) else None
