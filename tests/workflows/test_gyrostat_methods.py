"""The workflow that maps where the gyrostat's methods fail, on coarse planes."""

from dataclasses import replace

import gyrostat_methods as workflow
import mpmath as mp
import numpy as np
import pytest

METHODS = ("closed", "taylor", "dop853", "auto")  # those that need no minutes to compile and run


@pytest.fixture(scope="module")
def maps():
    return workflow.planes(0.25)


@pytest.fixture(scope="module")
def true(maps):
    return {name: workflow.checked(plane) for name, plane in maps.items()}


def test_the_reference_has_the_digits_it_says(true):
    """Against 48 trajectories of 30 digits, and a turning point and its time in closed form."""
    assert max(workflow.held()) < 1e-28
    high, low, codes, _doubt = workflow.checked(
        replace_rows(workflow.phase_plane(4), [[0, 0, 0, 0, 0, 1.0, 0.0, 1.0]], [[1.0, 2.0]], over_phi=True)
    )
    with mp.workdps(40):
        wanted = mp.pi / 3, mp.ellipk(mp.mpf(1) / 4)
        found = [mp.mpf(high[0, 1, k]) + mp.mpf(low[0, 1, k]) for k in (0, 1)]
        assert codes.tolist() == [[workflow.OK, workflow.TURNING]]
        assert max(abs(a - b) for a, b in zip(found, wanted, strict=True)) < 1e-30
        w = mp.mpf(high[0, 0, 0]) + mp.mpf(low[0, 0, 0])
        assert abs(w - mp.sqrt(2 * mp.cos(1) - 1)) < 1e-29


def replace_rows(plane, rows, abscissae, **more):
    return replace(plane, rows=np.array(rows, float), abscissae=np.array(abscissae, float), **more)


@pytest.mark.parametrize("method", METHODS)
def test_every_error_lies_within_its_bar(maps, true, method):
    for name, plane in maps.items():
        j = workflow.compared(plane, method, true[name])
        assert not j.wrong.any() and j.ratio.max() < 1, name
        # the truth has about 30 digits; where `auto` solves in double-double its bars have nearly as many
        assert j.doubtful.max() < (1e-3 if method == "auto" else 1e-14), name
        assert (j.error[j.met] < workflow.RTOL).all() and (method != "auto" or j.met.all()), name
        some = j.ratio[j.met & (j.error > 0.0)]
        assert not some.size or np.median(some) > 1e-4, f"{name}: bars ten thousand times the errors"


def test_beside_turning_points_of_random_systems():
    """From 0.1 down to an ulp before and beyond: `ok` is certain, `turning` holds within its bar."""
    rows = np.random.default_rng(4).normal(size=(120, 8)) * [1, 1, 2, 2, 2, 2, 2, 3]
    rows[:, 7] = np.abs(rows[:, 7]) + 1e-3
    ends, _low, codes = workflow.truth(rows, rows[:, 6:7] + 30.0, True)
    some = codes[:, 0] == workflow.TURNING
    _axis, offsets = workflow.two_sided("", np.arange(-16.0, -0.5, 0.5))
    abscissae = np.sort(np.maximum(ends[some, :, 0] + offsets, rows[some, 6:7]), axis=1)
    across = workflow.plain("", offsets), workflow.plain("", np.arange(some.sum()))
    plane = workflow.Plane("", *across, rows[some], abscissae, "x", over_phi=True)
    true = workflow.checked(plane)
    for method in ("taylor", "dop853"):
        j = workflow.compared(plane, method, true)
        assert some.sum() > 50 and j.answered.all() and not j.wrong.any() and j.ratio.max() < 1


def test_a_wrong_answer_would_be_seen(maps, true):
    plane = maps["phase"]
    high, low, codes, doubt = true["phase"]
    j = workflow.compared(plane, "taylor", (high, low + 1e-9, codes, doubt))
    assert (j.ratio > 1).mean() > 0.9
    plane, (high, low, codes, doubt) = maps["turning"], true["turning"]
    j = workflow.compared(plane, "taylor", (high, low, workflow.TURNING - codes, doubt))
    assert j.wrong.mean() > 0.3


def test_the_rule_of_auto(maps, true):
    """What is read off the page: `auto` meets the accuracy wherever the closed form or the Taylor series does."""
    for name, plane in maps.items():
        closed, taylor, auto = (workflow.compared(plane, method, true[name]) for method in ("closed", "taylor", "auto"))
        assert not ((closed.met | taylor.met) & ~auto.met).any(), name
    phase = [workflow.compared(maps["phase"], method, true["phase"]) for method in ("closed", "taylor")]
    assert np.nanmedian(phase[0].error) < np.nanmedian(phase[1].error)


def test_the_page_and_the_picture(maps, true, tmp_path):
    results = {}
    for name, plane in maps.items():
        one = workflow.compared(plane, "taylor", true[name])
        results[name] = dict.fromkeys(workflow.METHODS, one) | {"full": None if plane.over_phi else one}
    text = workflow.page(maps, true, results)
    assert "## The rule of `auto`" in text and text.count("| taylor |") == len(maps) and "nan" not in text
    workflow.draw(maps, results, tmp_path / "out.png")
    assert (tmp_path / "out.png").stat().st_size > 50_000
