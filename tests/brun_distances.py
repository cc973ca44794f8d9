"""Writes survey/reference/brun_distances.json: states at distances from a separatrix, a pole and a
double root.

    python tests/brun_distances.py

60 digits by `survey.truth.brun_digits` from the exact binary64 numbers of each state; 40 are kept.
`floors`: the changes of the outputs that half-ulp changes of the seven numbers add up to.
"""

import json
from pathlib import Path

import numpy as np
from mpmath import mp

from survey.truth.brun_digits import NAMES, OUTPUTS, truth

DISTANCES = 10.0 ** -np.arange(1.0, 13.0)
A, C, EPSILON = 2.0, 1.0, 0.6
K = EPSILON * A * (A - C)
META = {
    "problem": "brun: see survey/scenes/brun.md; state: " + ", ".join(NAMES) + " (exact binary64)",
    "origin": "tests/brun_distances.py, mpmath with 60 digits, (S5), (S6) by Carlson's R_J; 40 digits are kept",
    "separatrix": "from the saddle u = 0.2 with p_theta0 = sqrt(k distance): L lies about k distance above it",
    "pole": "p_psi = p_phi (1 + distance), a motion past u = 1",
    "precession": "from the regular precession at u = 0.4 with p_theta0 = sqrt(k) distance",
}


def beside(u, y, p_theta):
    """A state beside the regular precession at u with A psi' = y (S8)."""
    return [A, C, EPSILON, float(np.arccos(u)), p_theta, y - K * u * u / y, u * (y - K / y)]


def state(family, distance):
    if family == "separatrix":
        return beside(0.2, np.sqrt(0.5 * K * (1 - 3 * 0.2**2)), np.sqrt(K * distance))
    if family == "pole":
        return [A, C, EPSILON, 1.1, 0.5, 0.9 * (1.0 + distance), 0.9]
    return beside(0.4, 2.0 * np.sqrt(K), np.sqrt(K) * distance)


def row(family, distance):
    """One line of the file."""
    point = [float(x) for x in state(family, distance)]
    exact, floor = truth(point)
    return {
        "distance": float(distance),
        "state_hex": [x.hex() for x in point],
        "values": {name: mp.nstr(value, 40) for name, value in zip(OUTPUTS, exact, strict=True)},
        "floors": {name: mp.nstr(value, 3) for name, value in zip(OUTPUTS, floor, strict=True)},
    }


def main():
    with mp.workdps(60):
        families = {
            family: [row(family, distance) for distance in DISTANCES]
            for family in ("separatrix", "pole", "precession")
        }
    path = Path(__file__).parent.parent / "survey" / "reference" / "brun_distances.json"
    path.write_text(json.dumps({"meta": META} | families, indent=1) + "\n")


if __name__ == "__main__":
    main()
