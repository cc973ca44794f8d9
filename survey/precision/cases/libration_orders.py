"""The chart of the normal form at L4, orders 8 and 10, with effective stability; errors of order 8
by a twin.
"""

import json
from functools import cache
from importlib import resources

import numpy as np

from survey.measures.libration import higher

SCENE = "libration"
ERROR = "c8"
LABELS = higher.labels(8)
MOST = dict.fromkeys(("lie", "lie_double", "rational", "rational_double"), 64)
_NUMBER = 256


@cache
def references(work):
    """Coefficients of 24 digits at a few mu (`survey/reference/libration_order_8.json`)."""
    data = json.loads(
        resources.files("survey.reference")
        .joinpath("libration_order_8.json")
        .read_text(encoding="utf-8")
    )
    return [
        (
            {"mu": row["mu"]},
            {"order": work.split()[1]},
            {ERROR: np.array([float(row["c8"][k]) for k in LABELS])},
            None,
        )
        for row in data["points"]
    ]


@cache
def works():
    """Mass ratios that share nothing, by order."""
    mu = np.random.default_rng(1).uniform(1e-4, 0.0384, _NUMBER)
    return {f"order {order}": ({"mu": mu}, {"order": order}) for order in ("8", "10")}
