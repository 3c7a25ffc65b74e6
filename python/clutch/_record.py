"""Base of a scenario's objects: built from a table, shown, compared, copied, checked by the native module."""

import re
import reprlib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from types import NoneType
from typing import Any, ClassVar, NamedTuple, Self, get_args

from clutch import _clutch
from clutch._errors import ParamError

_Tree = dict[str, Any]


class _Slot(NamedTuple):
    """A field of a class: the classes that may stand there, a plain value, or both."""

    name: str
    classes: tuple[type["_Record"], ...]
    plain: bool
    optional: bool
    default: Any


_SLOTS: dict[type["_Record"], tuple[_Slot, ...]] = {}


def _slots(cls: type["_Record"]) -> tuple[_Slot, ...]:
    if cls in _SLOTS:
        return _SLOTS[cls]
    slots = []
    for f in fields(cls):
        options = get_args(f.type) or (f.type,)
        classes = tuple(o for o in options if isinstance(o, type) and issubclass(o, _Record))
        optional = NoneType in options
        default = f.default if f.default_factory is MISSING else f.default_factory()
        slots.append(_Slot(f.name, classes, len(classes) + optional < len(options), optional, default))
    return _SLOTS.setdefault(cls, tuple(slots))


#: Lists in lists, and dicts in dicts, that a value may have; a list that holds itself has no end.
_DEEPEST = 32


def _plain(value: Any, depth: int = 0) -> Any:
    """NumPy's scalars and arrays as Python's numbers and lists, without importing NumPy."""
    if depth > _DEEPEST:
        raise ParamError(f"a value nested more than {_DEEPEST} deep")
    if isinstance(value, Mapping):
        return {k: _plain(v, depth + 1) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v, depth + 1) for v in value]
    return value.tolist() if hasattr(value, "tolist") and not isinstance(value, type) else value


def _can_be_written(value: Any) -> bool:
    """True if a file can hold a value: the native module takes no other."""
    if isinstance(value, dict):
        return all(isinstance(k, str) and _can_be_written(v) for k, v in value.items())
    if isinstance(value, list):
        return all(map(_can_be_written, value))
    if isinstance(value, str):
        return value.encode(errors="replace").decode() == value
    return isinstance(value, float) or (isinstance(value, int) and -(2**63) <= value < 2**63)


def _written(name: str, key: str, value: Any) -> Any:
    plain = _plain(value)
    if not _can_be_written(plain):
        expected = "a number, a text, true or false, or a list of them; whole numbers of 64 bits"
        raise ParamError(f"{name}: {key} = {reprlib.repr(value)}: expected {expected}", key, value)
    return plain


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list | tuple) else value


def _restore(cls: type["_Record"], values: _Tree) -> "_Record":
    return cls(**values)


@dataclass(frozen=True, kw_only=True, repr=False)
class _Record:
    """Base of all: the object's place in a file, and its construction from a table."""

    _key: ClassVar[str] = ""

    @classmethod
    def _way(cls, name: str) -> list[str]:
        """The tables from one with a field of that name to this: ``["drive", "weight"]`` for WeightDrive."""
        *_, outer, last = ["", *cls._key.split(".")]
        return [outer, last] if outer == name else [name]

    @classmethod
    def _build(cls, table: _Tree) -> Self:
        """An object from a table of the native module, which has checked it."""
        self = object.__new__(cls)
        for slot in _slots(cls):
            value = table.get(slot.name)
            for part in slot.classes:
                inner: Any = table
                for step in part._way(slot.name):
                    inner = inner.get(step) if isinstance(inner, dict) else None
                if inner is not None:
                    value = part._build(inner)
            object.__setattr__(self, slot.name, _frozen(value))
        return self

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, checked anew.

        Parameters
        ----------
        **changes
            New values of fields, in the fields' units.

        Returns
        -------
        Self
            An object of the same class.

        Raises
        ------
        ParamError
            A value out of range.

        Examples
        --------
        >>> import clutch
        >>> clutch.Pd().replace(kp_v_rad=4000)
        Pd(kp_v_rad=4000.0, kd_v_s_rad=50.0)
        """
        return replace(self, **changes)

    def __repr__(self) -> str:
        values = ((slot, getattr(self, slot.name)) for slot in _slots(type(self)))
        # Numbers are always shown; parts only where they differ, or a scenario would fill the screen.
        shown = (
            f"{slot.name}={value!r}"
            for slot, value in values
            if value != slot.default or not isinstance(value, _Record | NoneType)
        )
        return f"{type(self).__qualname__}({', '.join(shown)})"

    def __reduce__(self) -> tuple[Any, ...]:
        # By the constructor: values that an older version wrote are checked, and new fields get their defaults.
        return _restore, (type(self), {f.name: getattr(self, f.name) for f in fields(self)})


@dataclass(frozen=True, kw_only=True, repr=False)
class _Params(_Record):
    """Base of the objects that a user writes: checked when they are made."""

    def __post_init__(self) -> None:
        try:
            checked = _clutch.check(self._key, type(self).__name__, self._tables())
        except ParamError as error:
            # The whole field and the value as given, not a number or a key within it.
            error.field = re.split(r"[.\[]", error.field)[0]
            error.value = getattr(self, error.field, error.value)
            raise
        for slot in _slots(type(self)):
            if not isinstance(getattr(self, slot.name), (*slot.classes, NoneType)):
                object.__setattr__(self, slot.name, _frozen(checked[slot.name]))

    def _tables(self) -> _Tree:
        """The object as the file has it: nested tables, alternatives by their names."""
        table: _Tree = {}
        for slot in _slots(type(self)):
            value = getattr(self, slot.name)
            if isinstance(value, _Params) and isinstance(value, slot.classes):
                *way, last = value._way(slot.name)
                inner = table
                for step in way:
                    inner = inner.setdefault(step, {})
                inner[last] = value._tables()
            elif value is None and slot.optional:
                continue
            elif slot.plain and value is not None:
                table[slot.name] = _written(type(self).__name__, slot.name, value)
            else:
                wanted = " or ".join(c.__name__ for c in slot.classes) or "a value"
                message = f"{type(self).__name__}: {slot.name} = {reprlib.repr(value)}: expected {wanted}"
                raise ParamError(message, slot.name, value)
        return table
