"""What is measured of the satellite: a row and a map of prolate librations, scattered points; 40-digit references."""

import importlib.util
import json
from importlib import resources

import numpy as np

ERROR = "discriminant"
_FAMILIES = {"PL": "prolate", "PR": "prolate", "OL": "oblate", "OR": "oblate"}


def references():
    """The reference cases (error of the JSON's own values below 1e-38)."""
    data = json.loads(resources.files("survey.reference").joinpath("satellite.json").read_text())
    cases = []
    for row in data["libration"] + data["nasty"] + data["rotation"]:
        point = {"k": float.fromhex(row["k_hex"]), "rho": float.fromhex(row["rho_hex"])}
        cases.append((point, {"body": _FAMILIES[row["fam"]]}, {ERROR: float(row["Delta"])}, int(row["stable"])))
    return cases


def works():
    """A row of 600 ratios, a map, and points that share nothing."""
    random = np.random.default_rng(1)
    rho = np.linspace(0.6, 4.0, 600)
    return {
        "row": ({"k": np.array([[0.5]]), "rho": rho[None, :]}, {}),
        "map 40x600": ({"k": np.linspace(0.0, 0.99, 40)[:, None], "rho": rho[None, :]}, {}),
        "scattered": ({"k": random.uniform(0.01, 0.99, 300), "rho": random.uniform(0.6, 4.0, 300)}, {}),
    }


def peers():
    """scipy's adaptive DOP853 over half a period, by symmetry, with sn, cn, dn as states."""
    return {"scipy": _scipy} if importlib.util.find_spec("scipy") else {}


def missing():
    """Peers that are not installed."""
    return [] if importlib.util.find_spec("scipy") else ["scipy"]


def _scipy(point, options, rtol):
    from scipy.integrate import solve_ivp
    from scipy.special import ellipkm1

    k, rho = (np.ravel(values) for values in np.broadcast_arrays(point["k"], point["rho"]))
    result = np.empty(k.size)
    for i in range(k.size):
        half = 2 * ellipkm1((1 - k[i]) * (1 + k[i])) if k[i] < 1 else ellipkm1((1 - 1 / k[i]) * (1 + 1 / k[i])) / k[i]
        start = [0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0]
        equations = _equations(k[i], rho[i], options.get("body", "prolate"))
        solved = solve_ivp(equations, (0.0, half), start, "DOP853", rtol=max(rtol, 3e-14), atol=rtol)
        y1, _, _, dy2 = solved.y[3:, -1]
        result[i] = 2 * (2 * y1 * dy2 - 1)
    return {ERROR: result}


def _equations(k, rho, body):
    """(sn, cn, dn, y1, y1', y2, y2')' for z = (w + rho)^2 + w^2 + c, w = k cn(u, k) or k dn(k u, 1/k)."""
    modulus, rate = (k, 1.0) if k < 1 else (1 / k, k)
    constant = 1 - k * k if body == "prolate" else -k * k

    def slope(_, state):
        sn, cn, dn, y1, dy1, y2, dy2 = state
        w = k * (cn if k < 1 else dn)
        z = (w + rho) ** 2 + w * w + constant
        return [rate * cn * dn, -rate * sn * dn, -rate * modulus**2 * sn * cn, dy1, -z * y1, dy2, -z * y2]

    return slope
