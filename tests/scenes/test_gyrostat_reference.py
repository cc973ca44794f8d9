"""Every value of reference/gyrostat.json, by `survey.evaluate` and every method that serves it.

Within the error bar and to 11 digits, but for what the rounding of the inputs (decimals there) does
to the answer: the digits that the conditioning leaves.
"""

import json
import math
from importlib.resources import files

import gyrostat_elliptic as elliptic
import mpmath as mp
import numpy as np
import pytest
import xarray as xr

import survey
from survey.measures.cylinder import fate
from survey.methods import taylor

REFERENCE = json.loads((files("survey.reference") / "gyrostat.json").read_text())
NAMES = ("b12", "b31", "d", "c23", "s2", "s3")
METHODS = {"trajectory": ("auto", "taylor", "dop853", "rk4", "full", "closed")}
METHODS["abel"] = tuple(name for name in METHODS["trajectory"] if name != "full")
OK, NO_CONVERGENCE, TURNING, NO_FORM = 0, 3, 16, 19
each = pytest.mark.parametrize(
    "method", ["auto", "dop853", pytest.param("rk4", marks=pytest.mark.slow)]
)
DIGITS, ROUNDINGS = 1e-11, 4 * 2.0**-53  # roundings of an input that is worked out from several
STEP = 1e-7  # relative, of the inputs

# what each group holds: the values that are reproduced here, and what they are asked with
VALUES = {
    "abel_time": {
        "w",
        "t",
        "phi",
        "phi_star",
        "t_star",
        "saddle",
        "slope_at_saddle",
        "period",
        "multiplier",
    },
    "closed50": {"phi", "w", "tan_half"},
    "trig61": {"w_phi1", "t_phi1", "phi_t", "tan_half_t"},
    "elliptic": {"phi", "w", "tan_half", "n", "a", "g2", "g3", "G"},
    "multiple_root": {"phi", "w", "tan_half", "n", "phi1", "u1", "b", "c"},
    "sixd": {"phi", "w"},
    "classification": {
        "K",
        "L",
        "equilibria",
        "section",
        "rotation_plus",
        "rotation_minus",
        "libration",
    },
    "fate": {"fate", "detail", "turns"},
}
INPUTS = {
    "p",
    "phi0",
    "w0",
    "phi1",
    "t",
    "w",
    "section_phi",
    "mu",
    "n",
    "b12",
    "b31",
    "c23",
    "d",
    "s2",
    "s3",
}
INPUTS |= {"A", "B", "C", "A11", "B12", "B31", "theta0", "lambda1"}
WORDS = {"name", "form", "case", "note", "diff", "variant", "sign", "max_residual", "frame", "closing_error_DOP853",
         "word", "brute"}  # fmt: skip


def test_nothing_is_left_out():
    assert REFERENCE.keys() - {"meta"} == VALUES.keys()
    for group, values in VALUES.items():
        keys = set().union(*REFERENCE[group])
        assert values <= keys and keys <= values | INPUTS | WORDS, (
            group,
            keys - values - INPUTS - WORDS,
        )


def decimal(text):
    return 2.0 * math.pi if text == "2*pi" else float(text)


def row(case, **more):
    """The inputs of a case that names the six parameters by p."""
    inputs = dict(zip(NAMES, map(float, case["p"]), strict=True))
    return inputs | {name: decimal(case[name]) for name in ("phi0", "w0") if name in case} | more


def collected():
    """(id, question, inputs, {output: text}) of the single solutions."""
    for i, case in enumerate(REFERENCE["abel_time"]):
        form, name = case["form"], f"abel_time-{i}"
        if form == "abel":
            yield (
                name,
                "abel",
                row(case, phi=decimal(case["phi1"])),
                {"w": case["w"], "t": case["t"]},
            )
        elif form == "time":
            yield (
                name,
                "trajectory",
                row(case, t=decimal(case["t"])),
                {"phi": case["phi"], "w": case["w"]},
            )
        elif form == "turning":
            yield (
                name,
                "abel",
                row(case, phi=6.0),
                {"phi_turning": case["phi_star"], "t_turning": case["t_star"]},
            )
        elif form == "cycle":  # one turn leads back to the same w
            start = {"phi0": float(case["section_phi"]), "w0": float(case["w"])}
            inputs = row(case, **start, phi=start["phi0"] + 2.0 * math.pi)
            yield name, "abel", inputs, {"w": case["w"], "t": case["period"]}
        else:
            assert form == "separatrix"
    for i, case in enumerate(REFERENCE["closed50"]):
        A11, B12, B31, theta, n, phi0, t = (
            float(case[k]) for k in ("A11", "B12", "B31", "theta0", "n", "phi0", "t")
        )
        b12, b31 = B12 * math.sin(theta) / A11, B31 * math.sin(theta) / A11
        w0 = b12 * math.sin(phi0) + b31 * math.cos(phi0) + n / A11
        inputs = dict.fromkeys(NAMES, 0.0) | {
            "b12": b12,
            "b31": b31,
            "phi0": phi0,
            "w0": w0,
            "t": t,
        }
        yield f"closed50-{i}", "trajectory", inputs, {"phi": case["phi"], "w": case["w"]}
    for i, case in enumerate(REFERENCE["trig61"]):
        mu, n, phi0 = (float(case[k]) for k in ("mu", "n", "phi0"))
        inputs = {name: float(case[name]) for name in NAMES}
        inputs |= {
            "phi0": phi0,
            "w0": mu * (inputs["b12"] * math.sin(phi0) + inputs["b31"] * math.cos(phi0)) + n,
        }
        yield f"trig61-{i}", "trajectory", inputs | {"t": float(case["t"])}, {"phi": case["phi_t"]}
        wanted = {"w": case["w_phi1"], "t": case["t_phi1"]}
        yield f"trig61-{i}-abel", "abel", inputs | {"phi": float(case["phi1"])}, wanted
    for group in ("elliptic", "multiple_root"):
        for i, case in enumerate(REFERENCE[group]):
            wanted = {"phi": case["phi"], "w": case["w"]}
            yield f"{group}-{i}", "trajectory", row(case, t=float(case["t"])), wanted
    for i, case in enumerate(REFERENCE["sixd"]):
        A, B, C = ({key: float(value) for key, value in case[name].items()} for name in "ABC")
        six = (
            B["B12"],
            B["B31"],
            C["C22"] - C["C33"],
            C["C23"],
            float(case["s2"]),
            float(case["s3"]),
        )
        inputs = dict(zip(NAMES, (value / A["A11"] for value in six), strict=True))
        inputs |= {name: float(case[name]) for name in ("phi0", "w0", "t")}
        yield f"sixd-{i}", "trajectory", inputs, {"phi": case["phi"], "w": case["w"]}


SOLUTIONS = {name: rest for name, *rest in collected()}


def answer(question, method, inputs):
    return survey.evaluate("gyrostat", question=question, method=method, rtol=1e-12, **inputs)


def conditioning(question, inputs, names):
    """What the rounding of the inputs does to the outputs: differences over inputs moved one by one."""
    keys, values = list(inputs), np.array(list(inputs.values()))
    moved = np.concatenate([values + sign * STEP * np.diag(values) for sign in (1, -1)])
    ds = answer(
        question,
        "taylor",
        {key: xr.DataArray(column, dims="row") for key, column in zip(keys, moved.T, strict=True)},
    )
    out = np.stack([ds[name].values for name in names], axis=-1).reshape(2, len(keys), len(names))
    return ROUNDINGS * np.abs(out[0] - out[1]).sum(axis=0) / (2.0 * STEP)


@pytest.mark.parametrize("name", SOLUTIONS)
def test_single_solutions(name):
    question, inputs, wanted = SOLUTIONS[name]
    slack = dict(zip(wanted, conditioning(question, inputs, wanted), strict=True))
    status = TURNING if "phi_turning" in wanted else OK
    # where closed forms may lose their digits
    multiple = "multiple" in name or name == "elliptic-2"
    for method in METHODS[question]:
        ds = answer(question, method, inputs)
        if method == "closed" and (
            ds.status == NO_FORM or (multiple and ds.status == NO_CONVERGENCE)
        ):
            continue
        assert ds.status == status, method
        for output, text in wanted.items():
            value, bar = float(ds[output]), float(ds[f"{output}_error"])
            error = abs(float(mp.mpf(value) - mp.mpf(text)))
            assert error <= bar + slack[output], (method, output, error, bar, slack[output])
            if method == "closed" and multiple:  # `auto` does not take it here
                continue
            assert error <= DIGITS * abs(value) + slack[output], (
                method,
                output,
                error,
                slack[output],
            )
            assert bar <= 1e-9 * (1.0 + abs(value)), (method, output, bar)


def test_closed_forms_serve_what_they_should():
    for name, (question, inputs, _wanted) in SOLUTIONS.items():
        status = int(answer(question, "closed", inputs).status)
        none = name.startswith(("abel_time", "sixd"))
        # on a separatrix, or beside it
        lost = name in ("elliptic-2", "multiple_root-0", "multiple_root-1")
        assert status in ((NO_FORM,) if none else (OK, NO_CONVERGENCE) if lost else (OK,)), name


HALVES = {"closed50": ("phi", "tan_half"), "trig61": ("phi_t", "tan_half_t"), "elliptic": ("phi", "tan_half"),
          "multiple_root": ("phi", "tan_half")}  # fmt: skip


@pytest.mark.parametrize("group", HALVES)
def test_half_angles(group):
    """tan(phi/2) of the angle that is tested above."""
    key, half = HALVES[group]
    with mp.workdps(30):
        for case in REFERENCE[group]:
            assert abs(mp.tan(mp.mpf(case[key]) / 2) / mp.mpf(case[half]) - 1) < 1e-25


@pytest.mark.slow
def test_the_separatrix():
    """N1: above the threshold the saddle is passed, below it the solution turns; the branch's slope
    at the saddle.
    """
    (case,) = (case for case in REFERENCE["abel_time"] if case["form"] == "separatrix")
    six, w = row(case), float(case["w"])
    for method, gap in {"auto": DIGITS, "taylor": DIGITS, "dop853": DIGITS, "rk4": 1e-6}.items():
        ds = answer(
            "abel", method, six | {"phi0": float(case["phi"]), "w0": [w - gap, w + gap], "phi": 5.0}
        )
        assert ds.status.values.tolist() == [TURNING, OK], method
    saddles = survey.evaluate("gyrostat", question="portrait", **six)
    where = np.abs(saddles.equilibrium_phi.values - float(case["saddle"])).argmin()
    x, bar = float(saddles.equilibrium_phi[where]), float(saddles.equilibrium_phi_error[where])
    assert abs(x - float(case["saddle"])) <= bar + 1e-15 and bar < DIGITS
    assert float(slope(six, x)) == pytest.approx(float(case["slope_at_saddle"]), rel=DIGITS)


def forces(six, x):
    """f and g' at x."""
    b12, b31, d, c23, s2, s3 = (six[name] for name in NAMES)
    s, c = math.sin(x), math.cos(x)
    return b12 * c - b31 * s, -d * math.cos(2 * x) + 2 * c23 * math.sin(2 * x) - s2 * s - s3 * c


def slope(six, x):
    """dw/dphi of the stable branch at the saddle x."""
    f, dg = forces(six, x)
    return 0.5 * (f - math.sqrt(f * f + 4 * dg))


def test_the_cycle():
    (case,) = (case for case in REFERENCE["abel_time"] if case["form"] == "cycle")
    ds = survey.evaluate("gyrostat", question="portrait", **row(case))
    some = ds.cycle_kind.values == 1
    for output, key in (("multiplier", "multiplier"), ("period", "period")):
        values, bars = (ds[f"cycle_{output}{end}"].values[some] for end in ("", "_error"))
        error = np.abs(values - float(case[key]))
        i = error.argmin()
        assert error[i] <= bars[i] + 1e-15 and error[i] < DIGITS * values[i]


@pytest.mark.parametrize("group", ["elliptic", "multiple_root"])
def test_the_constants_of_the_elliptic_case(group):
    """n of (62), a0..a4 (65), g2, g3 (67), G, and where there is a double root u1 what is left of P4 (66)."""
    with mp.workdps(40):
        for case in REFERENCE[group]:
            _b12, _b31, d, c23, s2, s3 = map(mp.mpf, case["p"])
            phi0, w0 = mp.mpf(case["phi0"]), mp.mpf(case["w0"])
            n = (
                w0**2
                - d / 2 * mp.cos(2 * phi0)
                + c23 * mp.sin(2 * phi0)
                - 2 * (s2 * mp.sin(phi0) + s3 * mp.cos(phi0))
            )
            a = elliptic.coefficients(d, c23, s2, s3, n)
            g2, g3 = elliptic.invariants(a)
            pairs = [(n, case["n"])]
            if group == "elliptic":
                pairs += zip(
                    (*a, g2, g3, g2**3 - 27 * g3**2),
                    (*case["a"], case["g2"], case["g3"], case["G"]),
                    strict=True,
                )
            elif "phi1" in case:
                u1 = mp.tan(mp.mpf(case["phi1"]) / 2)
                pairs += zip(
                    (u1, *elliptic.shortened(a[:3], u1)),
                    (case["u1"], case["b"], case["c"]),
                    strict=True,
                )
                assert abs(elliptic.quartic(a, u1)) < 1e-22 * sum(map(abs, a)) * (1 + abs(u1)) ** 4
            for value, text in pairs:
                assert abs(value - mp.mpf(text)) <= 1e-20 * (1 + abs(value)), (case["note"], text)


@pytest.mark.parametrize(
    "case", [case for case in REFERENCE["multiple_root"] if "phi1" in case], ids=lambda c: c["note"]
)
def test_where_the_double_roots_are(case):
    """phi1 is an equilibrium of the system: a saddle for c > 0."""
    ds = survey.evaluate(
        "gyrostat", question="portrait", **{k: v for k, v in row(case).items() if k in NAMES}
    )
    error = np.abs(ds.equilibrium_phi.values - float(case["phi1"]))
    i = int(error.argmin())
    slack = 4e-16 * 10 / abs(forces(row(case), float(case["phi1"]))[1])
    assert float(error[i]) <= float(ds.equilibrium_phi_error[i]) + slack < DIGITS
    assert (int(ds.equilibrium_type[i]) == 1) == (float(case["c"]) > 0)


TYPES = {"S": ("saddle",), "n-": ("attracting_node",), "n+": ("repelling_node",), "f-": ("attracting_focus",),
         "f+": ("repelling_focus",)}  # fmt: skip


@each
@pytest.mark.parametrize("case", REFERENCE["classification"], ids=lambda case: case["name"][:20])
def test_classification(case, method):
    """Printed to 10 digits, in double precision, there."""
    six = dict(zip(NAMES, case["p"], strict=True))
    ds = survey.evaluate("gyrostat", question="portrait", method=method, **six)
    for name in ("K", "L"):
        assert float(ds[name]) == pytest.approx(case[name], rel=1e-9)
    assert int(ds.equilibria) == len(case["equilibria"])
    names = ds.equilibrium_type.attrs["flag_meanings"].split()
    for i, wanted in enumerate(case["equilibria"]):
        x = float(ds.equilibrium_phi[i])
        assert (
            x == pytest.approx(wanted["phi"], abs=1e-9)
            and names[int(ds.equilibrium_type[i])] in TYPES[wanted["type"]]
        )
        assert forces(six, x) == pytest.approx((wanted["f"], wanted["gprime"]), rel=1e-8)
    cycles = [
        *case["rotation_plus"]["cycles"],
        *case["rotation_minus"]["cycles"],
        *case["libration"],
    ]
    counts = [int(ds[name]) for name in ("rotations_plus", "rotations_minus", "librations")]
    assert counts == [
        len(case["rotation_plus"]["cycles"]),
        len(case["rotation_minus"]["cycles"]),
        len(case["libration"]),
    ]
    for i, wanted in enumerate(cycles):
        for name, key in (("w", "w"), ("multiplier", "multiplier"), ("period", "period")):
            value, bar = float(ds[f"cycle_{name}"][i]), float(ds[f"cycle_{name}_error"][i])
            if key in wanted:  # printed w is good to 9 digits
                assert abs(value - wanted[key]) <= bar + 1e-8 * abs(value), name
        stable = float(ds.cycle_multiplier[i]) < 1
        assert stable == (wanted["stability"] == "stable")


@pytest.mark.parametrize("case", REFERENCE["classification"], ids=lambda case: case["name"][:20])
def test_what_a_portrait_does_not_print(case):
    """Section, thresholds w_c, w_d of the rotation maps, turning points of librations: the skeleton
    behind it.
    """
    s = fate.skeleton(taylor, case["p"])
    assert s.section % (2 * math.pi) == pytest.approx(case["section"], abs=1e-9)
    for (w_c, w_d), name in zip(s.thresholds, ("rotation_plus", "rotation_minus"), strict=True):
        wanted = case[name]
        side = 1 if name == "rotation_plus" else -1
        if wanted["w_c"] > 0:  # on the saddle's own stable branch, from which a turn ends at w = 0
            assert w_c == pytest.approx(wanted["w_c"], abs=1e-9) and max(w_d, wanted["w_d"]) < 0.01
        else:  # every turn is completed: w_d is the end of that of the unstable branch
            six = dict(zip(NAMES, case["p"], strict=True))
            start = {"phi0": s.section, "w0": side * 1e-11, "phi": s.section + side * 2 * math.pi}
            ds = survey.evaluate("gyrostat", question="abel", **six, **start)
            assert abs(float(ds.w)) == pytest.approx(wanted["w_d"], abs=1e-9)
    for found, wanted in zip(s.librations, case["libration"], strict=True):
        places = found[fate.rt.CYCLE_X], found[fate.rt.CYCLE_LEFT]
        assert places == pytest.approx((wanted["phi_right"], wanted["phi_left"]), abs=1e-8)
        assert found[fate.rt.CYCLE_CLASS] == wanted["equilibria_inside"]


@each
@pytest.mark.parametrize(
    "case", REFERENCE["fate"], ids=lambda case: f"{case['fate']}-{case['phi0']}"
)
def test_fates(case, method):
    start = {"phi0": float(case["phi0"]), "w0": float(case["w0"])}
    ds = survey.evaluate(
        "gyrostat", method=method, **dict(zip(NAMES, case["p"], strict=True)), **start
    )
    side = np.sign(case["detail"][0])
    verdict = {"E": 0, "U": 5 if side > 0 else 6, "R": 2 if side > 0 else 3, "L": 4}[case["fate"]]
    assert int(ds.verdict) == verdict and int(ds.turnings) == (
        -1 if case["turns"] == "inf" else case["turns"]
    )
    if case["fate"] in "EL":
        assert float(ds.limit_phi) == pytest.approx(
            case["detail"][0], abs=1e-4 if case["fate"] == "E" else 1e-7
        )
    if case["fate"] == "R":
        assert float(ds.limit_w) == pytest.approx(case["detail"][0] * case["detail"][1], rel=1e-7)
