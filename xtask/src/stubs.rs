//! The type stub of the native module: generated from the Rust docs; this module fills in the types
//! that PyO3 cannot name.

use crate::python::{self, PROFILE, Wheel, optimised};
use crate::run::{Program, program, root};
use anyhow::{Context, Result, bail};
use std::path::Path;

const STUB: &str = "python/clutch/_clutch.pyi";

/// The generator's text, and its replacement. Each text must be found, so that a change in the
/// module shows.
const NAMED: &[(&str, &str)] = &[
    // Its imports: `CapsuleType` is in `types` from Python 3.13 on only.
    (
        "from _typeshed import Incomplete, SupportsGetItem\n",
        "from collections.abc import Callable, Iterator, Sequence\n",
    ),
    ("from types import CapsuleType\n", ""),
    (
        "from typing import Any, Final, SupportsFloat, SupportsIndex, final\n",
        "from typing import Any, Final, SupportsFloat, SupportsIndex, final\n\n\
         import numpy as np\nimport pandas as pd\nimport polars as pl\nimport pyarrow as pa\nimport xarray as xr\nfrom numpy.typing import ArrayLike, NDArray\n\
         from typing_extensions import CapsuleType\n\nfrom clutch import _model, _run\nfrom clutch._errors import ParamError\n",
    ),
    ("SupportsGetItem[int, str]", "Sequence[str]"),
    ("SupportsGetItem[int, SupportsIndex]", "Sequence[int]"),
    ("logs: SupportsGetItem[int, str | PathLike[str]]", "logs: Sequence[str | PathLike[str]]"),
    (
        "loaded: tuple[SupportsGetItem[int, str | PathLike[str]],",
        "loaded: tuple[Sequence[str | PathLike[str]],",
    ),
    ("rates_deg_s: SupportsGetItem[int, SupportsFloat | SupportsIndex]", "rates_deg_s: Sequence[float]"),
    (
        "scenario: Scenario | None = None, law: Any | None = None)",
        "scenario: Scenario | None = None, law: Callable[[Tick], float] | _run.SteppedLaw | None = None)",
    ),
    ("def __deepcopy__(self, /, _memo: Any)", "def __deepcopy__(self, /, _memo: object)"),
    (
        "SupportsGetItem[int, tuple[SupportsFloat | SupportsIndex, SupportsIndex, bool]]",
        "Sequence[tuple[float, int, bool]]",
    ),
    (
        "position: Incomplete, velocity: Incomplete, torque: Incomplete | None",
        "position: NDArray[np.float64], velocity: NDArray[np.float64], torque: NDArray[np.float64] | None",
    ),
    (
        "tuple[Incomplete, Incomplete, Incomplete | None,",
        "tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64] | None,",
    ),
    ("metrics: dict[str, SupportsFloat | SupportsIndex])", "metrics: dict[str, float])"),
    ("rows: list,", "rows: list[list[object]],"),
    (
        "-> tuple[Table, dict, list[tuple[int, Any]]]",
        "-> tuple[Table, dict[int, Table], list[tuple[int, ParamError]]]",
    ),
    (
        "def __new__(cls, /, scenario: Any, keys: Sequence[str]",
        "def __new__(cls, /, scenario: _model.Scenario | Scenario, keys: Sequence[str]",
    ),
    (
        "def __new__(cls, /, scenario: Any) -> Servo",
        "def __new__(cls, /, scenario: _model.Scenario | Scenario) -> Servo",
    ),
    (
        "def __new__(cls, /, scenario: Any) -> Plant",
        "def __new__(cls, /, scenario: _model.Scenario | Scenario) -> Plant",
    ),
    (
        "def __new__(cls, /, scenario: Any) -> StickSlip",
        "def __new__(cls, /, scenario: _model.Scenario | Scenario) -> StickSlip",
    ),
    ("def terms(self, /) -> dict:", "def terms(self, /) -> dict[str, float]:"),
    ("def channels(self, /) -> dict:", "def channels(self, /) -> dict[str, Table]:"),
    ("def metadata(self, /) -> dict:", "def metadata(self, /) -> dict[str, str]:"),
    ("def metrics(self, /) -> dict:", "def metrics(self, /) -> dict[str, Any]:"),
    ("def counts(self, /) -> Any:", "def counts(self, /) -> int | float:"),
    (
        "def step(self, /, voltage: SupportsFloat | SupportsIndex) -> Any:",
        "def step(self, /, voltage: SupportsFloat | SupportsIndex) -> int | float:",
    ),
    ("def told(self, /) -> Any:", "def told(self, /) -> dict[str, Any]:"),
    ("def claims(self, /) -> Any:", "def claims(self, /) -> list[dict[str, Any]]:"),
    ("def table3(self, /) -> Any:", "def table3(self, /) -> list[dict[str, float]]:"),
    (
        "check: str | PathLike[str] | None = None) -> Any:",
        "check: str | PathLike[str] | None = None) -> dict[str, Any]:",
    ),
    ("def __iter__(self, /) -> Any: ...", "def __iter__(self, /) -> Iterator[str]: ..."),
    ("columns: Mapping, meanings", "columns: Mapping[str, ArrayLike], meanings"),
    ("def to_dict(self, /) -> dict:", "def to_dict(self, /) -> dict[str, Any]:"),
    ("def to_pandas(self, /) -> Any:", "def to_pandas(self, /) -> pd.DataFrame:"),
    ("def to_polars(self, /) -> Any:", "def to_polars(self, /) -> pl.DataFrame:"),
    ("def to_arrow(self, /) -> Any:", "def to_arrow(self, /) -> pa.Table:"),
    ("index: str | None = None) -> Any:", "index: str | None = None) -> xr.Dataset:"),
    (
        "def __reduce__(self, /) -> tuple[Any, tuple[dict, dict[str, str]]]: ...",
        "def __reduce__(self, /) -> tuple[Any, tuple[dict[str, Any], dict[str, str]]]: ...",
    ),
    (
        "def reproduce(progress: Any | None = None)",
        "def reproduce(progress: Callable[[int, int], object] | None = None)",
    ),
    (
        "def simulate(scenario: Any, law: Any | None = None)",
        "def simulate(scenario: _model.Scenario | Scenario, law: Callable[[Tick], float] | _run.SteppedLaw | None = None)",
    ),
    (
        "def lowest_smooth_speed(scenario: Any, rates: SupportsGetItem[int, SupportsFloat | SupportsIndex] | None, discs: SupportsIndex) -> Any",
        "def lowest_smooth_speed(scenario: _model.Scenario | Scenario, rates: Sequence[float] | None, discs: SupportsIndex) -> dict[str, Any]",
    ),
    ("def as_identified(scenario: Any,", "def as_identified(scenario: _model.Scenario | Scenario,"),
    ("def identify(scenario: Any,", "def identify(scenario: _model.Scenario | Scenario,"),
    ("-> tuple[Any, str | None, str | None]", "-> tuple[dict[str, Any], str | None, str | None]"),
    ("def tune(scenario: Any,", "def tune(scenario: _model.Scenario | Scenario,"),
    (
        "-> tuple[Any, list[str | None], str, str | None]",
        "-> tuple[dict[str, Any], list[str | None], str, str | None]",
    ),
    ("def run_loop(scenario: Any,", "def run_loop(scenario: _model.Scenario | Scenario,"),
    ("-> tuple[Any, str, str, str | None]:", "-> tuple[dict[str, Any], str, str, str | None]:"),
    ("velocity: Incomplete) -> Incomplete", "velocity: NDArray[np.float64]) -> NDArray[np.float64]"),
    ("time: Incomplete, values: Incomplete)", "time: NDArray[np.float64], values: NDArray[np.float64])"),
    (
        "def __new__(cls, /, scenario: Any, seeds",
        "def __new__(cls, /, scenario: _model.Scenario | Scenario, seeds",
    ),
    ("index: SupportsIndex, seed: SupportsIndex)", "index: int, seed: int)"),
    ("def seen(self, /) -> Incomplete", "def seen(self, /) -> NDArray[np.float64]"),
    ("volts: Incomplete) -> Incomplete", "volts: NDArray[np.float64]) -> NDArray[np.float64]"),
    ("table: dict", "table: dict[str, Any]"),
    ("tables: dict,", "tables: dict[str, Any],"),
    ("overrides: dict |", "overrides: Mapping[str, object] |"),
    (") -> dict:", ") -> dict[str, Any]:"),
    (
        "def attributes(self, /, name: str) -> dict[str, Any]",
        "def attributes(self, /, name: str) -> dict[str, str]",
    ),
];

/// Writes the stub, from this tree.
pub(crate) fn generate(python: &Path) -> Result<()> {
    let text = text(program(python::beside(python, "maturin")).args(["generate-stubs"]))?;
    Ok(std::fs::write(root().join(STUB), text)?)
}

/// True if the stub is the one of the wheel's module, whose build serves here.
pub(crate) fn hold(python: &Path, wheel: &Wheel) -> Result<bool> {
    let maturin = program(python::beside(python, "maturin")).args(["generate-stubs", "--profile", PROFILE]);
    let made = text(optimised(wheel.built(maturin, python)?))?;
    let holds = std::fs::read_to_string(root().join(STUB)).is_ok_and(|kept| kept == made);
    if !holds {
        println!("{STUB} differs from the module: run `cargo xtask stubs`");
    }
    Ok(holds)
}

fn text(maturin: Program) -> Result<String> {
    let out = root().join("target/stubs");
    maturin.args(["--quiet", "--out"]).arg(&out).run()?;
    let made = out.join("clutch/_clutch.pyi");
    let mut text = std::fs::read_to_string(&made).with_context(|| made.display().to_string())?;
    for (found, named) in NAMED {
        if !text.contains(found) {
            bail!(
                "the generated stub has no longer:\n{found}\nxtask/src/stubs.rs names it; see {}",
                made.display()
            );
        }
        text = text.replace(found, named);
    }
    Ok(text)
}
