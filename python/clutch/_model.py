"""A scenario as objects: one frozen dataclass for each table of the scenario file, with the same keys.

The tables are in `_tables`, which follows from the declarations in Rust; a scenario, which is made of them, is here.
"""

import functools
import html
import os
import reprlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Self

from clutch import _clutch, _tables
from clutch._certificate import Certificate
from clutch._record import _Params, _plain, _Record, _slots, _Tree, _written

# Pickles, and code written by hand, look for every class of a scenario here.
from clutch._tables import *  # noqa: F403


@dataclass(frozen=True, kw_only=True, repr=False)
class Scenario(_tables._Scenario):
    __doc__ = _tables._Scenario.__doc__

    def __post_init__(self) -> None:
        self._tables()  # checks the parts' classes
        name = _plain(self.name)
        object.__setattr__(self, "name", self._title() if name == "" else name)
        _ = self._native  # checks that the parts go together

    @classmethod
    def _build(cls, table: _Tree) -> Self:
        self = super()._build(table)
        object.__setattr__(self, "name", self.name or self._title())
        return self

    def _title(self) -> str:
        law, path = (part._key.split(".")[-1].replace("_", " ") for part in (self.law, self.reference))
        first, *rest = law.split()
        return f"{' '.join([first.upper(), *rest])}, {path}"

    @functools.cached_property
    def _native(self) -> _clutch.Scenario:
        return _clutch.Scenario(self._tables())

    @classmethod
    def load(cls, path_or_name: str | os.PathLike[str], overrides: Mapping[str, object] | None = None) -> Self:
        """Read a scenario file, or the built-in scenario of that name if there is no such file.

        Parameters
        ----------
        path_or_name : str or os.PathLike
            A TOML file, or a name that `clutch.scenarios` lists.
        overrides : mapping of str to object, optional
            Dotted keys, as ``law.smc.kp_v``, and their values in the keys' units. They come before the rig
            is merged with its base.

        Returns
        -------
        Scenario
            The checked scenario, defaults filled in.

        Raises
        ------
        ParamError
            The first fault in it; `field` is the dotted key.
        OSError
            The file cannot be read; FileNotFoundError if there is none, and no built-in scenario either.

        Examples
        --------
        >>> import clutch
        >>> clutch.Scenario.load("smc_2", {"law.smc.kp_v": 4}).law
        Smc(kp_v=4.0, kd_v_s_rad=400.0, slope_1_s=70.0, boundary_rad_s=0.1)
        """
        name = os.fspath(path_or_name)
        return cls._build(_clutch.Scenario.load(name, _overrides(name, overrides or {})).tables())

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Read a scenario from the text of a scenario file.

        Parameters
        ----------
        text : str
            TOML, as docs/scenario.md describes it.

        Returns
        -------
        Scenario
            The checked scenario, defaults filled in.

        Raises
        ------
        ParamError
            The first fault in it; `field` is the dotted key.

        Examples
        --------
        >>> import clutch
        >>> text = '''
        ... name = "slow"
        ... rig.base = "paper"
        ... law.pd = {}
        ... reference.ramp.rate_deg_s = 2.0
        ... '''
        >>> clutch.Scenario.from_toml(text).reference
        Ramp(rate_deg_s=2.0)
        """
        return cls._build(_clutch.Scenario.parse("text", text, {}).tables())

    def to_toml(self) -> str:
        """Return the scenario as the text of a scenario file, every default filled in.

        Returns
        -------
        str
            TOML; `from_toml` gives the same scenario again.

        Examples
        --------
        >>> import clutch
        >>> scenario = clutch.Scenario.load("smc_2")
        >>> "[law.smc]" in scenario.to_toml()
        True
        >>> clutch.Scenario.from_toml(scenario.to_toml()) == scenario
        True
        """
        return self._native.to_toml()

    def override(self, overrides: Mapping[str, object]) -> Self:
        """Return a copy with other values at dotted keys, as ``clutch sim --set`` takes them.

        Parameters
        ----------
        overrides : mapping of str to object
            Dotted keys, as ``law.smc.kp_v``, and their values in the keys' units. To change an alternative
            set its table: ``{"law": {"pd": {}}}``, or an object of it: ``{"law": clutch.Pd()}``.
            ``rig.base`` takes that rig instead of the present one; other keys of the rig then change it.

        Returns
        -------
        Scenario
            The checked scenario.

        Raises
        ------
        ParamError
            An unknown key, or a value out of range; `field` is the dotted key.

        Examples
        --------
        >>> import clutch
        >>> scenario = clutch.Scenario.load("smc_2")
        >>> scenario.override({"reference.ramp.rate_deg_s": 6}).reference
        Ramp(rate_deg_s=6.0)
        >>> scenario.override({"law": {"pd": {}}}).law
        Pd(kp_v_rad=5000.0, kd_v_s_rad=50.0)
        >>> scenario.override({"law": clutch.Smc(kp_v=4)}).law.kp_v
        4.0
        """
        changes = _overrides(self.name, overrides)
        if "rig.base" in changes:
            # All other keys of the rig are written out, and would hide the base.
            changes = {"rig": {"base": changes.pop("rig.base")}, **changes}
        return self._build(_clutch.Scenario.parse(self.name, self.to_toml(), changes).tables())

    def certificate(
        self,
        *,
        sampled: bool = False,
        save: str | os.PathLike[str] | None = None,
        check: str | os.PathLike[str] | None = None,
    ) -> Certificate:
        """Check the gains against every plant within the bounds.

        Parameters
        ----------
        sampled
            Look for a proof that bounds the error of the sampled loop as well: seconds to minutes on one core. Ctrl-C
            returns at once; the search goes on in a thread of its own until it has ended, and is dropped.
        save
            Write that proof to this file, JSON, which `check`, ``clutch certify --check`` and
            ``clutch.loop(certificate=…)`` read. Nothing is written where nothing is proven.
        check
            Check the proof in this file, and that it is this scenario's, instead of looking for one: a moment.

        Returns
        -------
        Certificate
            The verdict, the gains that the bounds would need, and the farthest that the shaft strays; in its `sampled`
            the verdicts on the sampled loop.

        Raises
        ------
        ValueError
            `save` without `sampled`, `check` with it; a file whose proof is another scenario's or does not hold.
        OSError
            A file that cannot be read or written.

        Examples
        --------
        >>> import clutch
        >>> import math
        >>> unsure = clutch.Scenario.load("pd_2").override({"bounds.friction_percent": 5})
        >>> certificate = unsure.certificate(sampled=True)
        >>> if certificate:
        ...     print(f"|e| stays below {math.degrees(certificate.sampled.error_bound_rad):.4f} °")
        |e| stays below 0.0683 °

        >>> import clutch
        >>> certificate = clutch.Scenario.load("smc_2").override({"law.smc.kp_v": 2}).certificate()
        >>> if not certificate:
        ...     print(f"K_p must be {certificate.ahead.kp_required_v:.4f} V")
        K_p must be 2.2624 V
        """
        paths = (None if file is None else os.fspath(file) for file in (save, check))
        return Certificate._build(self._native.certificate(sampled, *paths))

    def path(self) -> _clutch.Path:
        """Return the planned path, a target for each sampling period.

        Returns
        -------
        Path
            ``path.at(tick)`` is the target of a sample; ``path.table()`` has all of the run.

        Examples
        --------
        >>> import clutch
        >>> path = clutch.Scenario.load("smc_2").path()
        >>> round(path.at(1000).velocity_rad_s, 6)
        0.034907
        """
        return self._native.path()

    def _repr_html_(self) -> str:
        rows = [("name", html.escape(self.name), "")]
        for slot in _slots(type(self))[1:]:
            part = getattr(self, slot.name)
            if part is not None:
                values = ", ".join(f"{key}&nbsp;=&nbsp;{html.escape(value)}" for key, value in _leaves(part))
                rows.append((slot.name, type(part).__name__, values))
        cells = "".join(f"<tr><th>{row[0]}</th><td>{row[1]}</td><td>{row[2]}</td></tr>" for row in rows)
        return f"<table>{cells}</table>"


def _below(cls: type[_Record]) -> Iterator[type[_Record]]:
    """Subclasses, and theirs."""
    for sub in cls.__subclasses__():
        yield sub
        yield from _below(sub)


def _as_table(key: str, value: object) -> Any:
    """A key's value as a file could hold it: Python numbers, lists and dicts, and a part of a scenario as its table."""
    if isinstance(value, _Params):
        table = value._tables()
        *_, name = key.split(".")
        *_, own = value._key.split(".")
        tables: tuple[type[_Record], ...] = (Scenario, *_below(_Params))
        homes = (slot for cls in tables for slot in _slots(cls) if slot.name == name)
        if name != own and not any(type(value) in slot.classes for slot in homes):
            raise TypeError(f"{key}: a {type(value).__name__} stands at {value._key}")
        _, *way = value._way(name)
        for step in reversed(way):
            table = {step: table}
        return table
    return _plain(value)


def _overrides(origin: str, given: Mapping[str, object]) -> _Tree:
    if not isinstance(given, Mapping):
        expected = "a mapping of dotted keys to values, as {'law.smc.kp_v': 4}"
        raise TypeError(f"overrides = {reprlib.repr(given)}: expected {expected}")
    return {key: _written(origin, key, _as_table(key, value)) for key, value in given.items()}


def _leaves(part: _Record, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Dotted names of an object's values, and the values as text."""
    for slot in _slots(type(part)):
        value = getattr(part, slot.name)
        if isinstance(value, _Record):
            yield from _leaves(value, f"{prefix}{slot.name}.")
        elif value is not None:
            yield f"{prefix}{slot.name}", repr(value)
