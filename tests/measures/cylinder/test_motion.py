"""The picture of a motion on the cylinder: its cycles close, its branches end at saddles and keep
the energy.
"""

import numpy as np
import pytest

import survey

TURN = 2 * np.pi


def lines(ds, kind):
    names = ds.line_kind.attrs["flag_meanings"].split()
    own = ds.line_kind.values == names.index(kind)
    return ds.phi_line.values[own], ds.w_line.values[own]


def motion(**point):
    return survey.evaluate("gyrostat", question="fate", **point).survey.trajectory(figure=False)


def test_cycles_close_and_are_those_of_the_portrait():
    point = {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2}
    ds = motion(**point, phi0=0.3, w0=0.2)
    phi, w = lines(ds, "unstable_cycle")
    assert (
        len(phi) == 1
        and abs(phi[0, 0] - phi[0, -1] - TURN) < 1e-9
        and abs(w[0, 0] - w[0, -1]) < 1e-9
    )
    known = survey.evaluate("gyrostat", question="portrait", **point)
    assert w[0, 0] == pytest.approx(float(known.cycle_w[0]), rel=1e-9)
    np.testing.assert_allclose(ds.equilibrium_phi, known.equilibrium_phi)
    assert (ds.equilibrium_saddle.values == (known.equilibrium_type == 1).values).all()
    assert [len(lines(ds, kind)[0]) for kind in ("unstable_branch", "stable_branch")] == [4, 4]


def test_branches_keep_the_energy_of_their_saddle():
    ds = motion(d=1.0, s3=0.3, phi0=0.5, w0=0.3)
    for kind in ("unstable_branch", "stable_branch"):
        phi, w = lines(ds, kind)
        energy = 0.5 * w**2 + 0.5 * np.sin(phi) ** 2 - 0.3 * np.cos(phi)
        assert np.nanmax(abs(energy - 0.545)) < 1e-9  # V(saddle) at cos phi = -0.3
        assert np.nanmax(abs(w)) > 0.5


def test_of_a_degenerate_system_only_the_equilibria_are_drawn():
    ds = motion(b12=0.7, b31=-0.4, d=1.0, c23=0.25, s2=0.25, s3=-1.0, phi0=1.0, w0=0.3)
    assert "line_kind" not in ds and ds.sizes["equilibrium"] >= 3
