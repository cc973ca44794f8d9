"""The page and picture of effective stability: its resonances, its ellipses, and what it says for
few orders.
"""

import libration_effective as workflow
import libration_exact as exact
import lie_twin
import numpy as np
import pytest
from mpmath import mpf


def test_its_resonances_are_the_known_ones():
    found = workflow.resonances(8)
    known = {}  # two resonances at w1 = 4/5
    for row in exact.REFERENCE["resonances_order_le_8_k3_even"]:
        known.setdefault(round(float(row["mu"]), 14), []).append(np.array(row["k"]))
    assert len(found) == len(known)
    for (root, k), mu in zip(found, sorted(known), strict=True):
        assert root == pytest.approx(mu, rel=1e-11)
        assert any((k == other).all() or (k == -other).all() for other in known[mu])


def test_semi_axes_are_those_of_the_linear_motion():
    mu = 0.01
    _omega, columns = lie_twin.modes(mpf(mu))
    turns = np.exp(2j * np.pi * np.linspace(0, 1, 20_001))
    for axis, column in zip(workflow.semi_axes(mu), columns, strict=False):
        places = 2.0 * np.real(turns[:, None] * [complex(c) for c in column[:2]])
        assert axis == pytest.approx(np.linalg.norm(places, axis=1).max(), rel=1e-6)


def test_the_page_and_the_picture(tmp_path, monkeypatch):
    for name, value in {"ORDERS": (4, 6), "NUMBER": 20}.items():
        monkeypatch.setattr(workflow, name, value)
    monkeypatch.setattr("sys.argv", ["libration_effective.py", "-o", str(tmp_path)])
    workflow.main()
    page = (tmp_path / "libration_effective_stability.md").read_text()
    assert "| 0.024293897142 | (1, 2, 0) | 2 | 4.8e-13 |" in page and "| nan" not in page
    assert (tmp_path / "libration_effective_stability.png").stat().st_size > 10_000
