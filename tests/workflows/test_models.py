"""The page of reduced and full models: at random points they agree, and the command writes the page."""

import re

import numpy as np
import pytest

pytest.importorskip("scipy")
import models


@pytest.mark.slow
def test_full_and_reduced_models_agree(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.argv", ["models", "-o", str(tmp_path), "--points", "40"])
    models.main()
    rows = re.findall(r"^\| `(\w+)` \|.*", (tmp_path / "models.md").read_text(), re.MULTILINE)
    assert rows == [check.__name__ for check in models.CHECKS] and len(rows) == 8
    for line in (tmp_path / "models.md").read_text().splitlines():
        if line.startswith("| `"):
            assert 0 < float(line.split("|")[6]) < 1e-10, line


def test_a_wrong_model_is_seen(monkeypatch):
    """Periods that are wrong by a thousandth are."""
    real = models.integrate
    monkeypatch.setattr(
        models, "integrate", lambda slope, y, span, steps: real(slope, y, 1.001 * span, steps)
    )
    row = models.satellite(40, np.random.default_rng(1))
    assert float(row[5]) > 1e-4
