"""The engines against SciPy over single intervals: a small part of ``cargo xtask intervals``."""

import os

import numpy as np
import pytest

from intervals import ENGINES, KINDS, compare, draw, reference

PROGRAM = os.environ.get("CLUTCH_INTERVALS")
# The whole campaign's errors, with room: docs/theory.md, section 10.
MOST = {
    "exact_flow": {"motion": 1e-9, "break-away": 1e-9, "soft break-away": 1e-6},
    "dormand_prince": {"motion": 1e-6, "break-away": 1e-6, "soft break-away": 3e-2},
}


@pytest.fixture(scope="module", params=[False, True], ids=["moderate", "extreme"])
def drawn(request):
    rng = np.random.default_rng(7)
    cases = [draw(rng, request.param) for _ in range(150)]
    return request.param, cases, [reference(case) for case in cases]


@pytest.mark.skipif(PROGRAM is None, reason="CLUTCH_INTERVALS, the example `intervals` of clutch-sim, is not built")
@pytest.mark.parametrize("engine", ENGINES)
def test_an_engine_ends_where_scipy_does(engine, drawn):
    extreme, cases, truths = drawn
    found = compare(PROGRAM, engine, cases, truths)
    for kind in KINDS:
        row = found[kind]
        assert row["wrong"] == 0, kind
        # A stiff layer takes Dormand–Prince more steps than it allows itself: it says so.
        assert row["refused"] <= (4 if extreme and engine == "dormand_prince" else 0), kind
        assert np.all(np.array(row["errors"]) <= MOST[engine][kind]), kind
        assert len(row["errors"]) > 10, kind
