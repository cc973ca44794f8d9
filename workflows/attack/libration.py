"""Points of the circular problem's normal form, held against 60 digits of the closed forms."""

import numpy as np

from attack.compare import Batch
from attack.hill import accuracy, beside
from survey.truth.libration import truth

METHODS = ("auto", "auto", "rational", "rational_double", "lie", "lie_double")
CRITICAL = (0.0385208965045513970786520697274, 0.0242938971420523216662227326885, 0.0135160160224525267555750091159,
            0.0109136676772006628897436975729, 0.0163767553558164932157833667016, 0.00278347576233486111776847984938,
            0.0285954792089683170661037585968)  # fmt: skip


def chunk(random, size):
    used = 0
    while used < size:
        method, rtol = str(random.choice(METHODS)), accuracy(random)
        number = int(random.choice([1, 64]))
        kind = str(random.choice(["generic", "critical", "to 0", "to 1/2", "special", "beside"]))
        mu = random.uniform(0, 0.0386, number)
        if kind == "critical":
            mu = np.array([beside(random, random.choice(CRITICAL), 1)[0] for _ in range(number)])
        elif kind == "beside":
            mu = random.choice(CRITICAL, number) * (
                1 + random.choice([-1, 1], number) * 10 ** -random.uniform(1, 15.5, number)
            )
        elif kind == "to 0":
            mu = 10 ** -random.uniform(2, 99, number)
        elif kind == "to 1/2":
            mu = 0.5 - 10 ** -random.uniform(0.4, 16, number)
        elif kind == "special":
            mu = random.choice(
                [1e-100, 0.5, 0.25, 2.0**-10, 2.0**-53, 0.01, 0.0385, 0.03852089650455140], number
            )
        yield Batch(
            "libration", kind, {"mu": np.clip(mu, 1e-100, 0.5)}, truth, None, {}, method, rtol
        )
        used += number
