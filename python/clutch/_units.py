"""The unit that a name ends with: keys of a scenario, metrics and columns have theirs."""

from clutch._tables import UNITS


def split(name: str) -> tuple[str, str]:
    """A name without its unit's ending, and the unit; a plain number has none."""
    if name == "iae_rad_s":  # an integral over time: the one name in which "_s" multiplies
        return "iae", "rad s"
    parts = name.split("_")
    for i in range(1, len(parts)):
        unit = UNITS.get("_".join(parts[i:]))
        if unit:
            return "_".join(parts[:i]), unit
    return name, ""


def attributes(name: str) -> dict[str, str]:
    """What xarray keeps beside a column, and writes on the axes of its plots."""
    _, unit = split(name)
    return {"units": unit} if unit else {}
