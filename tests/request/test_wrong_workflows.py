"""Workflow files that are wrong in every way: each ends soon, in a plan or in one short line
without control codes.
"""

import copy
import datetime
import math
import random
import shutil
import signal
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
import tomli_w
import xarray as xr

import survey
from survey.errors import SurveyError
from survey.request import workflow
from survey.sweep import plan, solve

FOLDER = Path(__file__).parents[2] / "workflows"
LONGEST = 500  # characters of a message
SECONDS = 60  # for one file: on a busy machine, and with kernels of an own equation to compile
DEEP = []
for _ in range(200):
    DEEP = [DEEP]
NUMBERS = [
    0,
    -1,
    1,
    2,
    3,
    1000,
    10**12,
    10**30,
    10**400,
    -(10**400),
    2**63,
    1e308,
    -1e308,
    5e-324,
    -0.0,
    1e-300,
    0.5,
]
NUMBERS += [math.nan, math.inf, -math.inf, True, False]
TEXTS = [
    "",
    " ",
    "x",
    "auto",
    "log",
    "linear",
    "verdict",
    "results",
    ".",
    "..",
    "/",
    "~",
    "a/b/c.nc",
    "/proc/map.nc",
]
TEXTS += [
    "n" * 300 + ".nc",
    "n" * 240 + ".nc",
    "n" * 5000,
    "d/" * 3000 + "map.nc",
    "a\0.nc",
    "a\0.py",
    "n" * 5000 + ".py",
]
TEXTS += [
    "\x1b[31mred\x1b[0m",
    "\x1b]0;title\x07",
    "\x07\x08\x7f",
    "\u202egnp.exe",
    "\u0085\u2028",
    "é\u0301",
    "🛰" * 400,
    "\ud7ff",
]
TEXTS += [
    "k",
    "rho",
    "mu",
    "results/x.png",
    "results/map.nc/",
    "x.py",
    "meissner.py",
    "../meissner.py",
    "{0.__class__}%s%n",
]
DATES = [datetime.date(2026, 1, 1), datetime.datetime(1, 1, 1), datetime.time(1, 2, 3)]
TABLES = [
    [],
    [1],
    [1, "a"],
    [[1.0]],
    [2.0, 1.0],
    [0.1, 0.2],
    ["verdict"],
    [math.nan],
    DEEP,
    {},
    {"start": 0},
    {"values": []},
]
TABLES += [
    {"values": [1, 10**400]},
    {"start": 0.1, "stop": 0.2, "num": 3},
    {"start": 1e-320, "stop": 1e308, "num": 3, "spacing": "log"},
]
TABLES += [
    {"start": -1.7e308, "stop": 1.7e308, "num": 5},
    {"start": 0.1, "stop": 0.2, "num": 10**12},
    {"x" * 5000: 1},
    {"\x1b[1m": {"\n": 1}},
]
JUNK = [*NUMBERS, *TEXTS, *DATES, *TABLES]
KEYS = [
    "k",
    "rho",
    "axes",
    "scene",
    "options",
    "solver",
    "output",
    "path",
    "refine",
    "boundaries",
    "width",
    "axis",
    "num",
]
KEYS += [
    "start",
    "stop",
    "values",
    "spacing",
    "rtol",
    "method",
    "figures",
    "variables",
    "title",
    "style",
    "body",
    "t",
    "mu",
]
KEYS += ["x", "", "\x1b[31m", "n" * 5000, "é", "a.b", "\n"]
BYTES = [
    b"",
    b"\xff\xfe",
    b"\x00",
    b"\xef\xbb\xbf",
    b"\r",
    b"\x1b[2J",
    b"[",
    b"]" * 3,
    b"{" * 300,
    b"[" * 100_000,
    b"=",
    b'"',
    b"'''",
    b"#",
]
BYTES += [
    b"1" * 5000,
    b"1e400",
    b"1" * 400,
    b"\xc3",
    "é".encode(),
    b"\n",
    b"\nscene = 'x'\n",
    b"nan",
    b"0x" + b"f" * 600,
    b"1979-05-27",
]


def places(table, at=()):
    """Where the values of a tree stand."""
    entries = table.items() if isinstance(table, dict) else enumerate(table)
    for key, value in entries:
        yield (*at, key)
        if isinstance(value, dict) or (isinstance(value, list) and len(value) < 50):
            yield from places(value, (*at, key))


def inside(table, at):
    for key in at:
        table = table[key]
    return table


def mutate_table(draw, table):
    """A copy of the workflow with some values, keys or tables changed."""
    table = copy.deepcopy(table)
    for _ in range(draw.choice([1, 1, 1, 2, 4])):
        *at, key = draw.choice(list(places(table)) or [("x",)])
        holder = inside(table, at)
        what = draw.randrange(7)
        if what < 3:
            holder[key] = copy.deepcopy(draw.choice(JUNK))
        elif what == 3 and isinstance(holder, dict):
            holder[draw.choice(KEYS)] = (
                holder.pop(key) if draw.random() < 0.5 else copy.deepcopy(draw.choice(JUNK))
            )
        elif what == 4:
            del holder[key]
        elif what == 5 and isinstance(holder[key], (int, float)):
            factor = draw.choice([-1, 0, 2, 1e-3, 1e300, 1e6])
            holder[key] = (
                type(holder[key])(min(holder[key] * factor, 1e15))
                if holder[key] == holder[key]
                else 1
            )
        else:
            holder[key] = draw.choice([[holder[key]], {"values": holder[key]}, str(holder[key])])
    return table


def mutate_text(draw, text):
    """The bytes of a workflow with some of them cut, doubled or put in."""
    for _ in range(draw.choice([1, 1, 2, 5])):
        first, last = sorted(draw.randrange(len(text) + 1) for _ in range(2))
        lines = text.splitlines(keepends=True) or [b""]
        text = draw.choice(
            [
                text[:first] + draw.choice(BYTES) + text[first:],
                text[:first] + draw.choice(BYTES) + text[min(last, first + draw.randrange(8)) :],
                text[:first] + text[min(last, first + draw.randrange(40)) :],
                text[:last],
                text + draw.choice(lines),
                b"".join(draw.sample(lines, len(lines))),
                text[:first] + bytes(draw.randrange(256) for _ in range(3)) + text[first:],
            ]
        )
    return text


def override(draw, table):
    """KEY=VALUE as `--set` takes it."""
    key = ".".join(str(part) for part in draw.choice(list(places(table))))
    key = draw.choice(
        [
            key,
            key,
            key,
            draw.choice(KEYS),
            f"{key}.{draw.choice(KEYS)}",
            f"axes.{draw.choice(KEYS)}",
        ]
    )
    value = draw.choice(
        [
            str(draw.choice(NUMBERS[:8])),
            draw.choice(TEXTS),
            repr(draw.choice(TEXTS)),
            "[" * 2000,
            "[1,",
            "1" * 5000,
        ]
    )
    return draw.choice([f"{key}={value}", f"{key}={value}", f"{key}={value}", key, f"={value}", ""])


def mutated(draw, path):
    """(bytes of a file, overrides)"""
    text = path.read_bytes()
    table = tomllib.loads(text.decode())
    what = draw.random()
    if what < 0.6:
        try:
            return tomli_w.dumps(mutate_table(draw, table)).encode(), []
        # what cannot be written
        except (ValueError, TypeError, AttributeError, OverflowError, RecursionError):
            return mutate_text(draw, text), []
    if what < 0.85:
        return mutate_text(draw, text), []
    return text, [override(draw, table) for _ in range(draw.choice([1, 1, 3]))]


def refused(call):
    """The message of a call that is refused; None if it is not. Whatever else it raises is a fault."""
    try:
        call()
    except SurveyError as error:
        message = str(error)
        assert message.isprintable() and 10 < len(message) <= LONGEST, message
        return message
    return None


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with what the workflows name, as the current one; what takes too long ends."""
    for file in FOLDER.glob("*.py"):
        shutil.copy(file, tmp_path)
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)

    def late(*_):
        raise AssertionError(f"this has not ended within {SECONDS} s")

    before = signal.signal(signal.SIGALRM, late)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield tmp_path
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def attack(folder, number, seed):
    """So many mutated workflows; returns how many were refused."""
    draw, paths, file = random.Random(seed), sorted(FOLDER.glob("*.toml")), folder / "mutated.toml"
    refusals = 0
    for count in range(number):
        content, overrides = mutated(draw, draw.choice(paths))
        file.write_bytes(content)
        signal.setitimer(signal.ITIMER_REAL, SECONDS)
        try:
            refusals += (
                refused(lambda sets=overrides: plan.plan(workflow.read(file, sets))) is not None
            )
        except BaseException as error:
            raise AssertionError(
                f"mutation {count} of seed {seed}: {content[:2000]!r} {overrides!r}"[:3000]
            ) from error
    return refusals


@pytest.mark.parametrize("number", [150, pytest.param(800, marks=pytest.mark.slow)])
def test_mutated_workflows_are_planned_or_refused_in_one_line(folder, number):
    assert number / 2 < attack(folder, number, seed=17) < number


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_ten_thousand_mutated_workflows_each(folder, seed):
    assert 5000 < attack(folder, 10_000, seed) < 10_000


class Hostile:
    """An object whose words fail, and look like a terminal's."""

    def __repr__(self):
        raise ValueError("no words")


LOOP = {}
LOOP["axes"] = LOOP
OBJECTS = [
    *JUNK,
    None,
    b"bytes",
    1j,
    {1, 2},
    object(),
    Hostile(),
    len,
    10**5000,
    np.nan,
    np.array([[1.0]]),
    np.array(["a"]),
]
OBJECTS += [
    np.array([1j]),
    np.array([None]),
    xr.DataArray([1.0], dims="verdict"),
    np.datetime64("2026"),
    [Hostile()],
    LOOP,
]
OBJECTS += [
    np.float32(0.5),
    np.int8(1),
    (0.1, 0.2),
    range(3),
    "\ud800",
    np.empty(0),
    np.ma.masked,
    float,
]


def test_objects_of_any_kind_are_refused_by_check_in_one_line(folder):
    good = tomllib.loads((FOLDER / "satellite_prolate.toml").read_text())
    for thing in OBJECTS:
        signal.setitimer(signal.ITIMER_REAL, SECONDS)
        refused(lambda thing=thing: workflow.check(thing))
        for at in places(good):
            table = copy.deepcopy(good)
            inside(table, at[:-1])[at[-1]] = thing
            refused(lambda table=table: plan.plan(workflow.check(table)))


def test_objects_of_any_kind_are_refused_by_evaluate_in_one_line(folder, monkeypatch):
    class Reached(SurveyError):
        pass

    def compute(*_, **__):
        raise Reached("this is where points are solved")

    monkeypatch.setattr(solve, "compute", compute)
    good = {
        "scene": "satellite",
        "k": 0.5,
        "rho": 1.0,
        "body": "prolate",
        "method": "auto",
        "rtol": 1e-10,
        "variables": None,
    }
    assert refused(lambda: survey.evaluate(**good)).startswith("this is where")
    for thing in OBJECTS:
        signal.setitimer(signal.ITIMER_REAL, SECONDS)
        for key in [*good, "one_minus_k", "x", "\x1b[31m", "n" * 5000]:
            refused(lambda key=key, thing=thing: survey.evaluate(**(good | {key: thing})))
