"""Units of keys and figures by their rows, and of columns that have none by their names."""

from clutch._metrics import FIGURES
from clutch._tables import KEYS, UNITS


def _unit(name: str) -> str:
    if name in KEYS:
        return KEYS[name]
    # A column that no row declares: its name ends with its unit.
    parts = name.split("_")
    endings = ("_".join(parts[i:]) for i in range(1, len(parts)))
    return next((UNITS[ending] for ending in endings if ending in UNITS), "")


def split(name: str) -> tuple[str, str]:
    """A key or column without its unit's ending, and the unit; a plain number has none."""
    unit = _unit(name)
    for ending, text in UNITS.items():
        if text == unit and name.endswith(f"_{ending}"):
            return name.removesuffix(f"_{ending}"), unit
    return name, unit


def attributes(name: str) -> dict[str, str]:
    """Attributes by a column's name: xarray writes them on the axes of its plots, Arrow keeps them with the field."""
    figure = FIGURES.get(name)
    if figure is not None:
        return {"units": figure.unit, "long_name": figure.label}
    unit = _unit(name)
    return {"units": unit} if unit else {}
