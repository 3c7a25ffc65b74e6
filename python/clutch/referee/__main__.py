"""`python -m clutch.referee`: the table of all engines."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from clutch.referee import Case, about, cases, compare, others, own, table


def main() -> int:
    """Run cases on engines and print what they made of them; 1 if one of this package missed, or none took a case."""
    engines = [*own(), *others()]
    names = [engine.name for engine in engines]
    parser = argparse.ArgumentParser(
        prog="python -m clutch.referee",
        description="Holds engines against cases whose answer is known from elsewhere.",
    )
    parser.add_argument("cases", nargs="*", metavar="CASE", help="names of cases, or case files; all if none is given")
    parser.add_argument("--engine", action="append", metavar="NAME", help=f"only this one: {', '.join(names)}")
    asked = parser.parse_args()
    for name in asked.engine or []:
        if name not in names:
            parser.error(f"--engine {name}: expected one of {', '.join(names)}")
    known = cases()
    chosen = []
    for name in asked.cases or known:
        if Path(name).is_file():
            try:
                chosen.append(Case(Path(name).read_text(encoding="utf-8"), name))
            except (OSError, ValueError) as e:
                parser.error(str(e) if str(e).startswith(name) else f"{name}: {e}")
        elif name in known:
            chosen.append(known[name])
        else:
            parser.error(f"{name}: no such file, and no built-in case; `clutch referee --list` shows those")
    engines = [engine for engine in engines if not asked.engine or engine.name in asked.engine]
    try:
        results = compare(chosen, engines)
    except ValueError as e:
        parser.error(str(e))
    print(f"{table(chosen, results)}\n\n{about(engines)}")
    ours = {engine.name for engine in own()}
    missed = [r for r in results if r.engine in ours and (r.failed or r.held < len(r.figures))]
    # A comparison without a figure shows nothing.
    return 1 if missed or not any(r.figures for r in results) else 0


if __name__ == "__main__":
    sys.exit(main())
