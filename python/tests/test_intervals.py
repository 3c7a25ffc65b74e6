"""The engines against SciPy over single intervals: a small part of ``cargo xtask intervals``."""

import os

import numpy as np
import pytest

from intervals import (
    BRISTLES,
    ENGINES,
    KINDS,
    beyond,
    compare,
    draw,
    on_bristles,
    reference,
    reference_on_bristles,
    with_exponent,
)

PROGRAM = os.environ.get("CLUTCH_INTERVALS")
built = pytest.mark.skipif(
    PROGRAM is None, reason="CLUTCH_INTERVALS, the example `intervals` of clutch-sim, is not built"
)


@pytest.fixture(scope="module", params=[False, True], ids=["moderate", "extreme"])
def drawn(request):
    rng = np.random.default_rng(7)
    cases = [draw(rng, request.param) for _ in range(150)]
    return request.param, cases, [reference(case) for case in cases]


@built
@pytest.mark.parametrize("engine", ENGINES)
def test_an_engine_ends_where_scipy_does(engine, drawn):
    extreme, cases, truths = drawn
    found = compare(PROGRAM, engine, cases, truths)
    assert set(found) == set(KINDS)
    for kind, row in found.items():
        assert beyond(engine, kind, row) is None
        # A stiff layer takes an explicit pair more steps than it allows itself: it says so.
        assert row["refused"] <= (4 if extreme and engine != "exact_flow" else 0), kind
        assert len(row["errors"]) > 10, kind


@built
@pytest.mark.parametrize("engine", ENGINES[1:])
def test_an_engine_ends_where_scipy_does_with_any_stribeck_exponent(engine):
    rng = np.random.default_rng(9)
    cases = [with_exponent(rng, draw(rng, extreme=False)) for _ in range(100)]
    found = compare(PROGRAM, engine, cases, [reference(case) for case in cases])
    assert set(found) == set(KINDS)
    for kind, row in found.items():
        assert beyond(f"{engine}, δ", kind, row) is None
        assert row["refused"] == 0, kind
        assert len(row["errors"]) > 10, kind


@built
@pytest.mark.parametrize("extreme", [False, True], ids=["moderate", "extreme"])
def test_bristles_end_where_scipy_says(extreme):
    rng = np.random.default_rng(7)
    cases = [on_bristles(rng, draw(rng, extreme)) for _ in range(100)]
    found = compare(PROGRAM, "bristle", cases, [reference_on_bristles(case) for case in cases])
    assert set(found) == (set(BRISTLES) if extreme else {BRISTLES[0]})
    for kind, row in found.items():
        assert beyond("bristle", kind, row) is None
        assert row["refused"] == 0, kind
        # SciPy takes too long over some of the extreme ones.
        assert row["without"] <= (4 if extreme else 0), kind
        assert len(row["errors"]) > 10, kind
