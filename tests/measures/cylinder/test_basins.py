"""Fates by the side of curves against the fates of the same starts followed one by one."""

import numpy as np
import pytest

import survey
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder import returns as rt
from survey.measures.cylinder import basins, curves, equation, fate
from survey.measures.square import Square
from survey.methods import taylor
from survey.scene import Request

# an unstable cycle with the multiplier 1.006: windings beside it
SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)
WHOLE = basins.StartRange(60_000, 14.0)


def random_system(random, i):
    """Systems of three kinds: of order 1, with strong potential, with weak Barnett-London effect."""
    if i % 3 == 0:
        return random.normal(size=6) * [1, 1, 2, 2, 3, 3]
    if i % 3 == 1:
        return np.array([1.0, 0.0, *random.normal(size=4) * [2, 2, 8, 1]])
    return random.normal(size=6) * [0.3, 0.3, 1, 1, 1, 1]


def compared(six, starts):
    """(share of the starts that are told, how many are told otherwise than they end when they are
    followed).
    """
    s = fate.remembered(taylor, six)
    found = basins.found(taylor, s, 1e-10, WHOLE)
    if found is None:
        return 0.0, 0
    out, known = found.of(starts)
    followed = fate.followed(taylor, s, starts, 1e-10)
    decided = known & (followed[:, rc.VERDICT] != kf.UNDECIDED)
    differ = out[:, : rc.STATUS] != followed[:, : rc.STATUS]
    differ[:, rc.TURNINGS] &= followed[:, rc.TURNINGS] != kf.UNDETERMINED
    return known.mean(), int((differ.any(axis=1) & decided).sum())


@pytest.mark.slow
@pytest.mark.parametrize(
    "systems, starts, seed", [(4, 150, 11), (400, 300, 12)], ids=["few", "many"]
)
def test_no_start_is_classified_otherwise_than_it_ends(systems, starts, seed):
    """Verdict, limit, turning points and turns, of starts over two turns and at rest; 120,000 of
    them where slow.
    """
    random = np.random.default_rng(seed)
    shares = []
    for i in range(systems):
        states = np.stack(
            [random.uniform(-7.0, 7.0, starts), random.normal(size=starts) * 4.0], axis=1
        )
        states[: starts // 10, 1] = 0.0
        share, wrong = compared(random_system(random, i), states)
        assert wrong == 0
        shares.append(share)
    assert np.mean(np.array(shares) > 0.9) > 0.7


def test_an_unstable_libration_is_a_curve_between_basins_however_slow_the_system():
    """By S5, with velocities of 1e-6; its bar is an angle, and does not become less with them."""
    unit = 1e-6
    six = np.array([0.25, -0.341, -0.782, 0.152, -0.435, 0.731]) * [unit, unit, *[unit**2] * 4]
    s = fate.remembered(taylor, six)
    assert (s.librations[:, rt.BELOW] < 0.0).any()
    random = np.random.default_rng(3)
    states = np.stack(
        [random.uniform(-3.1, 3.1, 100), random.normal(size=100) * 2.0 * unit], axis=1
    )
    share, wrong = compared(six, states)
    assert wrong == 0 and share > 0.98


def test_starts_beside_a_stable_branch_are_followed_or_right():
    """States on the stable branch of a saddle, moved by less and less, are told by their side or followed."""
    ends = survey.evaluate(
        "gyrostat", question="abel", saddle=1.0, separatrix="stable", side="right", phi0=0.6, phi=0.6,
        **dict(zip(("b12", "b31", "d", "c23", "s2", "s3"), SIX, strict=True)),
    )  # fmt: skip
    w = float(ends.w_start)
    off = np.concatenate([sign * np.geomspace(1e-14, 1e-2, 60) for sign in (-1.0, 1.0)])
    _share, wrong = compared(SIX, np.stack([np.full(120, 0.6), w + off], axis=1))
    assert wrong == 0
    found = basins.found(taylor, fate.remembered(taylor, SIX), 1e-10, WHOLE)
    out, known = found.of(np.stack([np.full(120, 0.6), w + off], axis=1))
    assert known[np.abs(off) > 1e-4].all() and not known[np.abs(off) < 1e-13].any()
    assert len(np.unique(out[known][:, [rc.VERDICT, rc.TURNINGS]], axis=0)) == 2


def test_a_map_says_what_its_points_say():
    """A map large enough for basins, and the same points followed: names, codes and bits."""
    parameters = dict(zip(("b12", "b31", "d", "c23", "s2", "s3"), SIX, strict=True))
    phi0, w0 = np.linspace(-3.1, 3.1, 40), np.linspace(-3.0, 3.0, 30)
    asked = Request({"question": "fate"}, lines={"phi0": (40, -3.1, 3.1), "w0": (30, -3.0, 3.0)})
    assert basins.asked(asked, parameters) == basins.StartRange(1200, 3.0)
    assert basins.asked(Request({"question": "fate"}), parameters) is None
    whole = survey.evaluate("gyrostat", phi0=phi0, w0=w0, **parameters)
    for i in (3, 17, 36):
        row = survey.evaluate("gyrostat", phi0=phi0[i], w0=w0, **parameters)
        for name in row.data_vars:
            assert np.array_equal(whole[name].isel(phi0=i), row[name], equal_nan=True), name


def _damping(phi, p):
    return p[0] * np.cos(phi) - p[1] * np.sin(2.0 * phi)


def _torque(phi, p):
    return p[1] * np.sin(phi) + 0.6 * np.cos(phi) - 0.8 * np.sin(2.0 * phi)


@pytest.mark.slow
@pytest.mark.parametrize("point", [(0.5, -0.4), (0.3, 0.5)])
def test_own_flows_are_described_alike(point):
    """A user's f and g on the cylinder: the same door, the same fates as those followed."""
    (row,) = equation.flows(_damping, _torque, np.array([point]), True)
    random = np.random.default_rng(7)
    share, wrong = compared(
        row, np.stack([random.uniform(-7.0, 7.0, 60), random.normal(size=60) * 2.0], axis=1)
    )
    assert wrong == 0 and share > 0.8


@pytest.mark.slow
def test_curves_of_an_own_flow_on_a_map_of_states():
    """The junction's stable manifolds, over (phi0, w0), part the fates: at I = 0.5, a = 0.3 rest
    from rotation.
    """
    f, g = (lambda phi, p: -p[0]), (lambda phi, p: p[1] - np.sin(phi))
    junction = survey.abel(f, g, parameters=("a", "I"), period=2 * np.pi)
    square = Square(np.array([-3.0, -3.0]), np.array([3.0, 3.0]), np.array([False, False]))
    found = curves.searched(junction, square, ["phi0", "w0"], {"a": 0.3, "I": 0.5}, {})
    saddle = np.pi - np.arcsin(0.5)
    branches = np.repeat(found.kind, found.count) == curves.CLASSES["stable_manifold"]
    points = found.parameters[branches]
    assert len(points)
    away = np.abs(points - [saddle, 0.0]).sum(axis=1)
    assert away.min() < 1e-12
    i = int(np.argmin(np.abs(points[:, 0] - 1.0) + np.abs(points[:, 1] - 1.0)))
    verdicts = [
        int(
            survey.evaluate(
                junction, a=0.3, I=0.5, phi0=points[i, 0], w0=points[i, 1] + off, question="fate"
            ).verdict
        )
        for off in (-1e-6, 1e-6)
    ]
    assert verdicts[0] != verdicts[1]
