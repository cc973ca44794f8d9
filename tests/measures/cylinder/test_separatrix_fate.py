"""Fates of exact starts on separatrices, against long integration with SciPy and against the
branches themselves.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import survey

SYSTEMS = [
    {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2},
    {"b12": 0.7, "b31": -0.4, "d": 2.0, "c23": 0.3, "s2": 1.5, "s3": -0.2},
    {"b12": -0.6, "b31": 0.5, "d": 1.4, "c23": -0.3, "s2": 0.4, "s3": 0.9},
]
UNSTABLE, STABLE = ({"separatrix": name} for name in ("unstable", "stable"))


def starts(system, **options):
    """The fates next to every saddle, to both sides: (dataset, phi0)."""
    portrait = survey.evaluate("gyrostat", question="portrait", **system)
    angles = portrait.equilibrium_phi.values[portrait.equilibrium_type.values == 1]
    for number, angle in enumerate(angles, 1):
        for side, sign in (("right", 1.0), ("left", -1.0)):
            for turn in (0, -2):
                phi0 = angle + sign * 0.05 + 2 * np.pi * turn
                given = {"phi0": phi0, "saddle": number, "side": side, **options, **system}
                yield survey.evaluate("gyrostat", question="fate", **given), given


def rates(_t, y, b12, b31, d, c23, s2, s3):
    phi, w = y
    s, c = np.sin(phi), np.cos(phi)
    return [w, (b12 * c - b31 * s) * w - d * s * c - c23 * (c * c - s * s) + s2 * c - s3 * s]


@pytest.mark.slow
@pytest.mark.parametrize("system", SYSTEMS)
def test_an_unstable_branch_ends_where_long_integration_does(system):
    verdicts = set()
    for ds, given in starts(system, **UNSTABLE):
        assert ds.status == 0
        end = int(ds.verdict)
        verdicts.add(end)
        found = solve_ivp(rates, (0.0, 400.0), [given["phi0"], float(ds.w_start)], "DOP853", rtol=1e-12, atol=1e-13,
                          args=tuple(system.values()), dense_output=True)  # fmt: skip
        phi, w = found.y
        if end == 0:
            assert abs(w[-1]) < 1e-3
            assert abs(np.sin(0.5 * (phi[-1] - float(ds.limit_phi)))) < 1e-3
            assert int(np.trunc((phi[-1] - given["phi0"]) / (2 * np.pi))) == int(ds.net_turns)
            if ds.turnings >= 0:
                assert np.count_nonzero(np.diff(np.sign(w[abs(w) > 1e-9])) != 0) == int(ds.turnings)
        elif end in (2, 3):
            assert (np.sign(w[-200:]) == (1 if end == 2 else -1)).all()
            assert float(ds.multiplier) < 1.0
        elif end == 4:
            late = found.sol(np.linspace(300.0, 400.0, 4001))
            assert late[1].max() > 1e-2 > -1e-2 > late[1].min()
            assert abs(np.sin(0.5 * (late[0].max() - float(ds.limit_phi)))) < 1e-2
        else:
            assert end in (5, 6)
            assert (w[-1] > 5.0) if end == 5 else (w[-1] < -5.0)
    assert verdicts - {-1}


@pytest.mark.parametrize("system", [SYSTEMS[0], SYSTEMS[2] | {"b12": 0.0, "b31": 0.0}])
def test_a_stable_branch_ends_in_its_saddle(system):
    for ds, given in starts(system, **STABLE):
        assert (ds.status, ds.verdict, ds.turnings, ds.net_turns) == (0, 1, 0, 0)
        assert abs(float(ds.limit_phi - ds.phi_saddle)) <= float(ds.limit_phi_error)
        late = survey.evaluate("gyrostat", question="trajectory", t=60.0, **given)
        assert abs(np.sin(0.5 * float(late.phi - ds.limit_phi))) < 1e-6


def test_without_friction_a_branch_comes_back_to_a_saddle():
    """The pendulum g = -sin phi: from one saddle to its next copy; with a second well: back after
    one turning.
    """
    pendulum = {"b12": 0.0, "b31": 0.0, "d": 0.0, "c23": 0.0, "s2": 0.0, "s3": 1.0}
    for ds, _ in starts(pendulum, **UNSTABLE):
        assert (ds.status, ds.verdict, ds.turnings, ds.net_turns) == (0, 1, 0, 0)
        assert abs(float(ds.limit_phi) - np.pi) <= float(ds.limit_phi_error) < 1e-14
    wells = pendulum | {"d": -3.0, "s3": 0.5}  # saddles at 0 and pi of different energy
    turned = [int(ds.turnings) for ds, _ in starts(wells, **UNSTABLE) if int(ds.verdict) == 1]
    assert sorted(set(turned)) == [0, 1]
    for ds, given in starts(wells, **UNSTABLE):
        late = survey.evaluate("gyrostat", question="trajectory", t=40.0, **given)
        assert abs(np.sin(0.5 * float(late.phi - ds.limit_phi))) < 1e-6
        assert int(late.turnings) == int(ds.turnings)


def test_starts_beside_the_branch_are_refused():
    ds = survey.evaluate(
        "gyrostat",
        question="fate",
        phi0=0.1,
        saddle=4,
        separatrix="stable",
        side="right",
        **SYSTEMS[0],
    )
    assert (
        ds.status.attrs["flag_meanings"].split()[int(ds.status)] == "invalid_parameters"
        or int(ds.verdict) == -1
    )
