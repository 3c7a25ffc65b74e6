"""Tables in the forms of other libraries, each imported only on request."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

from clutch._extras import needed

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa
    import xarray as xr

    from clutch._clutch import Table


def to_pandas(table: Table) -> pd.DataFrame:
    """Make a data frame; its numbers stay in the table's memory."""
    with needed("pandas", "to_pandas"):
        import pandas as pd

    return pd.DataFrame(table.to_dict(), copy=False)


def to_polars(table: Table) -> pl.DataFrame:
    """Make a data frame; its numbers stay in the table's memory."""
    with needed("polars", "to_polars"):
        import polars as pl

    return pl.DataFrame(table)


def to_arrow(table: Table) -> pa.Table:
    """Make an Arrow table; its numbers stay in the table's memory."""
    with needed("pyarrow", "to_arrow"):
        import pyarrow as pa

    return pa.table(table)


def to_xarray(table: Table, index: str | None = None) -> xr.Dataset:
    """Make a dataset of one dimension, the column `index` or the row's number; each column with its attributes."""
    import numpy as np

    with needed("xarray", "to_xarray"):
        import xarray as xr

    columns: dict[str, Any] = {name: np.asarray(values) for name, values in table.to_dict().items()}
    if index is not None and index not in columns:
        raise ValueError(f"index = {index!r}: expected one of the columns {', '.join(columns)}")

    def variable(name: str) -> tuple[str, Any, dict[str, str]]:
        return index or "row", columns[name], table.attributes(name)

    data = {name: variable(name) for name in columns if name != index}
    return xr.Dataset(data, coords={} if index is None else {index: variable(index)})


def table_html(table: Table, rows: int = 10) -> str:
    """Show the first rows in a notebook."""
    names = table.columns
    columns = [table[name] for name in names]

    def cell(value: Any) -> str:
        return html.escape(f"{value:.6g}" if isinstance(value, float) else str(value))

    shown = min(rows, len(table))
    head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
    body = "".join(
        "<tr>" + "".join(f"<td>{cell(column[i])}</td>" for column in columns) + "</tr>" for i in range(shown)
    )
    rest = f"<p>{shown} of {len(table)} rows</p>" if shown < len(table) else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{rest}"
