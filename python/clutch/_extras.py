"""Packages that are imported only where a function needs them, and the extra that brings each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

#: The modules of each extra, as ``pyproject.toml`` lists their packages.
EXTRAS = {
    "plot": ("matplotlib",),
    "pandas": ("pandas", "pyarrow"),
    "polars": ("polars",),
    "xarray": ("xarray",),
    "sweep": ("tqdm", "scipy"),
    "dask": ("distributed",),
    "ray": ("ray",),
    "gym": ("gymnasium",),
    "control": ("control",),
}


def install(module: str) -> str:
    """The command that brings a module."""
    extra = next((extra for extra, modules in EXTRAS.items() if module in modules), None)
    return f"pip install {module}" if extra is None else f"pip install 'clutch-control[{extra}]'"


@contextmanager
def needed(module: str, by: str) -> Iterator[None]:
    """Turn the absence of a module, imported within, into an error that says how it comes here.

    Parameters
    ----------
    module
        Name of the module.
    by
        The function that needs it, as a user calls it.

    Raises
    ------
    ModuleNotFoundError
        It is not installed. One that is there and does not work gives its own error.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != module:
            raise
        raise ModuleNotFoundError(f"{by} needs {module}: {install(module)}", name=module) from error
