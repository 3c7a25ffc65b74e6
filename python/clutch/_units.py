"""The unit that a name ends with: keys of a scenario, metrics and columns have theirs."""

from clutch._metrics import FIGURES
from clutch._tables import UNITS


def split(name: str) -> tuple[str, str]:
    """A name without its unit's ending, and the unit; a plain number has none."""
    stem, unit = name, ""
    parts = name.split("_")
    for i in range(1, len(parts)):
        ending = UNITS.get("_".join(parts[i:]))
        if ending:
            stem, unit = "_".join(parts[:i]), ending
            break
    # A figure's row knows better: in an integral over time "_s" multiplies.
    figure = FIGURES.get(name)
    if figure is not None:
        unit = "" if figure.unit == "1" else figure.unit
    return stem, unit


def attributes(name: str) -> dict[str, str]:
    """Attributes by a column's name: xarray writes them on the axes of its plots, Arrow keeps them with the field."""
    _, unit = split(name)
    known = {"units": unit} if unit else {}
    figure = FIGURES.get(name)
    return known if figure is None else known | {"units": figure.unit, "long_name": figure.label}
