"""What is said of a user's f where no orbit is found, or where an entry of the scene is wrong."""

import math

import pytest

import survey


def pendulum(t, x, p, out):
    out[0], out[1] = x[1], -p[0] * math.sin(x[0])


def beam(t, x, p, out):
    out[0], out[1] = x[1], -x[0] - x[0] ** 3
    out[2], out[3] = x[3], -(p[0] + x[0] ** 2) * x[2]


def van_der_pol(t, x, p, out):
    out[0], out[1] = x[1], p[0] * (1 - x[0] ** 2) * x[1] - x[0]


def drifts(t, x, p, out):
    out[0], out[1] = p[0], 0.5 * math.cos(t)


@pytest.mark.parametrize(
    ("f", "given", "words"),
    [
        (pendulum, {"period": None, "start": (1.0, 0.0, 6.5)}, "give a better start, unless the "
         "system is conservative, as its orbits then form families, and reversed and held, which tell "
         "these apart, need an even number of states, four at least"),
        (beam, {"period": None, "start": (1.0, 0.0, 0.5, 0.0, 6.5), "states": tuple("xvzu")},
         "give a better start, or, if the system is conservative, so that its orbits form families, "
         "name reversed and held, which tell these apart"),
        (van_der_pol, {"period": 6.6, "start": (2.0, 0.0)},
         "f does not depend on t, so that the period of an orbit that moves is to be found: set "
         "period = None, and give start a guess of the period after the states"),
        (drifts, {"period": 2 * math.pi, "start": (0.0, 0.0)}, "give a better start"),
    ],
)  # fmt: skip
def test_a_point_without_an_orbit_says_what_suits_the_case(f, given, words):
    scene = survey.orbit(f, parameters="a", **({"states": ("x", "v")} | given))
    ds = survey.evaluate(scene, a=1.0)
    assert int(ds.status) == 16
    why = ds.survey.point().why
    assert why.startswith("no_orbit: Newton") and why.endswith(f"near where it ends: {words}")
    assert scene.STATUS["no_orbit"] == why.removeprefix("no_orbit: ")


def test_a_point_with_fewer_orbits_than_its_branch_says_so():
    def forced(t, x, p, out):
        out[0] = -x[0] + p[0] * math.cos(t)

    ds = survey.evaluate(
        survey.orbit(
            forced, states="x", parameters="a", period=2 * math.pi, start=0.0, continuation=("a", 0.5, 1.0)
        ),
        a=0.7, branch=2,
    )  # fmt: skip
    assert ds.survey.point().why.startswith(
        "no_orbit: the point has fewer orbits than `branch`, or Newton's method"
    )


def test_a_file_has_the_keys_in_capitals(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "STATES, PARAMETERS, PERIOD, START = ('x', 'v'), 'a', 6.6, (2.0, 0.0)\n"
        "def f(t, x, p, out):\n"
        "    out[0], out[1] = x[1], p[0] * (1 - x[0] ** 2) * x[1] - x[0]\n"
    )
    why = survey.evaluate(str(path), a=1.0).survey.point().why
    assert "set PERIOD = None, and give START a guess" in why


def unsure(t, x, p, out):
    raise ValueError("not yet")


def divided(t, x, p, out):
    out[0, 0] = 1 / 0


def undefined(t, x, p, out):
    out[0, 0] = math.nan


@pytest.mark.parametrize(
    ("jacobian", "words"),
    [
        (
            unsure,
            r"jacobian\(t, x, p, out\) fails at a = 1 \(ValueError: not yet\); correct it, or",
        ),
        (
            divided,
            r"jacobian\(t, x, p, out\) fails at a = 1 \(ZeroDivisionError: division by zero\)",
        ),
        (undefined, r"jacobian\(t, x, p, out\) fails at a = 1 \(it fills in inf or nan\)"),
    ],
)
def test_a_jacobian_that_fails_is_named_with_what_it_raises(jacobian, words):
    given = {"period": None, "start": (2.0, 0.0, 6.6), "states": ("x", "v"), "parameters": "a"}
    with pytest.raises(survey.BadInput, match=words) as refusal:
        survey.evaluate(survey.orbit(van_der_pol, jacobian=jacobian, **given), a=1.0)
    assert "\n" not in str(refusal.value)
