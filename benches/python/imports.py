"""The cost of `import clutch` and the packages it imports, each time in a fresh interpreter."""

import statistics
import subprocess
import sys

HEAVY = ["numpy", "pandas", "matplotlib", "polars", "pyarrow", "xarray", "scipy", "tqdm"]


def python(code: str) -> str:
    # Isolated: neither this folder nor the user's own set-up takes part.
    return subprocess.run([sys.executable, "-I", "-c", code], check=True, capture_output=True, text=True).stdout


def seconds(rounds: int) -> dict[str, float]:
    """CPU seconds of the import alone, once with the first use of a name; medians of `rounds` interpreters."""
    code = "import time; t = time.process_time(); import {}; print(time.process_time() - t)"
    times = {name: [] for name in ("json", "clutch", "clutch; clutch.simulate", "numpy")}
    for _ in range(rounds):
        for name, found in times.items():
            found.append(float(python(code.format(name))))
    return {name: statistics.median(found) for name, found in times.items()}


def brought_along() -> list[str]:
    """The heavy packages that `import clutch` imports."""
    return python(f"import clutch, sys; print(*(m for m in {HEAVY} if m in sys.modules))").split()
