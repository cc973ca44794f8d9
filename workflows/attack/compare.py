"""One batch of points solved and compared: the answer at each against a truth of higher accuracy.

A lie is a value farther from the truth than its error bar and the truth's own doubt together; a
wrong verdict one that the truth contradicts beyond its doubt. Silent is what the contract forbids
without a word: a value or bar that is not finite although the status is ok, a negative bar, a
status without a sentence, a verdict beside a status that is not ok.
"""

import time
import traceback
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr
from scipy.optimize import linear_sum_assignment

import survey
from survey import status
from survey.request import user_scene
from survey.scene import exists
from survey.truth import distance

COUNTS = (
    "points",
    "undecided",
    "missed",
    "refused",
    "unchecked",
    "lies",
    "wrong",
    "silent",
    "tracebacks",
    "slow",
)
FAULTS = ("lies", "wrong", "silent", "tracebacks")
SLOW, HALF = 5.0, 0.5  # seconds of a batch, and for each of its points
TINY = 1e-200
SHOWN = 6  # faults of a kind that are described for a batch


@dataclass
class Batch:
    """Points of one request: `given` holds arrays (N) of parameters, `options` the rest of the
    call.

    `truth(given, answer)` returns {output: (value, low, doubt)}, arrays that broadcast to the
    output, NaN where nothing is known, and may hold "wrong": {what: mask}. `how` is the source text
    of the scene where it is not a name.
    """

    name: str
    region: str
    given: dict
    truth: object
    scene: object = None
    options: dict = field(default_factory=dict)
    method: str = "auto"
    rtol: float = 1e-10
    how: str = ""
    cross: tuple = ()  # parameters that are axes of their own, not taken point by point
    chosen: object = None  # of a map: the points that are compared

    @property
    def size(self):
        return int(np.prod(shape(self))) if self.chosen is None else len(self.chosen)

    def each(self):
        """The parameters of each point that is compared."""
        grids = np.indices(shape(self)).reshape(1 + len(self.cross), -1)
        grids = grids if self.chosen is None else grids[:, self.chosen]
        return {key: values if not np.ndim(values) else
                np.asarray(values, float)[grids[1 + self.cross.index(key)] if key in self.cross else grids[0]]
                for key, values in self.given.items()}  # fmt: skip


def solve(batch, part=slice(None)):
    """The answer as a dataset; the points `part` of it."""
    given = {}
    for key, values in batch.given.items():
        if key in batch.cross:
            given[key] = np.asarray(values)
        elif np.ndim(values):
            given[key] = xr.DataArray(np.asarray(values, float)[part], dims="point")
        else:
            given[key] = values
    return survey.evaluate(
        batch.scene or batch.name, method=batch.method, rtol=batch.rtol, **given, **batch.options
    )


def line(batch, i):
    """One line of Python that solves point i alone."""
    words = [batch.how or repr(batch.scene or batch.name)]
    words += [
        f"{key}={float(values[i] if np.ndim(values) else values)!r}"
        for key, values in batch.each().items()
    ]
    words += [f"{key}={value!r}" for key, value in batch.options.items()]
    return f"survey.evaluate({', '.join(words)}, method={batch.method!r}, rtol={batch.rtol!r})"


def shape(batch):
    """(points taken together, each of the axes of their own)."""
    shared = max([np.size(v) for k, v in batch.given.items() if k not in batch.cross], default=1)
    return (shared, *(np.size(batch.given[k]) for k in batch.cross))


def compare(batch):
    """(counts, worst error over bar, faults as a list of dicts) of a batch."""
    counts, faults, began = Counter(points=batch.size), [], time.perf_counter()
    compiled = _compile_seconds()
    try:
        ds = solve(batch)
    except survey.BadInput as error:
        if "\n" in str(error) or len(str(error)) > 400:
            _report(batch, counts, faults, "silent", [0], "refusal of several lines", str(error))
        counts["refused"] += batch.size
        return counts, 0.0, faults
    except Exception:
        _report(
            batch, counts, faults, "tracebacks", [0], "traceback", traceback.format_exc(limit=-3)
        )
        return counts, 0.0, faults
    counts["seconds"] = seconds = time.perf_counter() - began - (_compile_seconds() - compiled)
    # again, as the first call loads what was compiled
    if seconds > SLOW + HALF * np.prod(shape(batch)):
        began = time.process_time()
        solve(batch)
        counts["seconds"] = seconds = time.process_time() - began
        if seconds > SLOW + HALF * np.prod(shape(batch)):
            _report(
                batch,
                counts,
                faults,
                "slow",
                [0],
                "seconds a point",
                f"{seconds / np.prod(shape(batch)):.3g}",
            )
    answer = {name: _flat(batch, ds[name]) for name in ds.data_vars}
    _, module = user_scene.find(batch.scene or batch.name)
    _silent(batch, module, answer, counts, faults)
    worst = _truth(batch, answer, counts, faults)
    if batch.size > 2 and batch.method in ("auto", "taylor16", "agm", "taylor"):
        _solved_again(batch, answer, counts, faults)
    return counts, worst, faults


def failed(batch):
    """The same where the comparison itself ended in an exception, which is being handled."""
    counts, faults = Counter(points=batch.size), []
    _report(
        batch,
        counts,
        faults,
        "tracebacks",
        [0],
        "in the comparison",
        traceback.format_exc(limit=-3),
    )
    return counts, 0.0, faults


def _compile_seconds():
    from survey import waiting

    return waiting.compile_seconds()


def _flat(batch, array):
    """The values with all dimensions of points made one, extra ones last."""
    dims = ["point", *batch.cross]
    here = [d for d in dims if d in array.dims]
    array = array.transpose(*here, ...)
    size = int(np.prod([array.sizes[d] for d in here]))
    values = array.values.reshape((size, *(array.sizes[d] for d in array.dims if d not in here)))
    return values if batch.chosen is None else values[batch.chosen]


def _silent(batch, module, answer, counts, faults):
    codes = {code for code, _ in status.table(module).values()}
    said = answer["status"]
    ok = said == status.OK
    lost = np.isin(said, list(status.UNANSWERED))
    counts["refused"] += int((~ok).sum())
    bad = ~np.isin(said, list(codes))
    missed = np.zeros(ok.shape, bool)
    options = dict(batch.options)
    for o in module.OUTPUTS:
        if o.name not in answer or not exists(o, options | _defaults(module, batch)):
            continue
        values = answer[o.name]
        if o.flags is not None:
            bad |= _any(~np.isin(values, list(o.flags.values())) & ~_as(lost, values))
            if o.name == "verdict":
                counts["undecided"] += int((ok & (values == -1)).sum())
                bad |= lost & (values != -1)
            continue
        if o.integer:
            continue
        bars = answer[f"{o.name}_error"]
        real = np.isfinite(values)
        with np.errstate(invalid="ignore"):
            wrong = np.isinf(values) | (real & ~(np.isfinite(bars) & (bars >= 0)))
            # the bar has underflowed
            wrong |= real & (bars == 0) & (values != 0) & (np.abs(values) < TINY)
            missed |= _any(real & (bars > batch.rtol * (1 + np.abs(values)))) & ok
        if not o.applies:
            wrong |= ~real & _as(ok, values)
        wrong |= real & _as(said == status.INVALID_PARAMETERS, values)
        if wrong.any():
            _report(
                batch,
                counts,
                faults,
                "silent",
                np.flatnonzero(_any(wrong)),
                f"{o.name} or its bar",
                "",
            )
    counts["missed"] += int(missed.sum())
    if bad.any():
        _report(batch, counts, faults, "silent", np.flatnonzero(bad), "status or flag", "")


def _defaults(module, batch):
    return {
        o.name: o.default for o in module.OPTIONS if not o.only_with and o.name not in batch.options
    }


def _any(mask):
    return mask.reshape(len(mask), -1).any(axis=1)


def _as(mask, like):
    return mask.reshape(mask.shape + (1,) * (like.ndim - 1))


def _truth(batch, answer, counts, faults):
    truth = batch.truth(batch.each(), answer)
    worst = 0.0
    for what, mask in truth.pop("wrong", {}).items():
        mask = np.broadcast_to(mask, answer["status"].shape)
        if mask.any():
            verdicts = answer.get("verdict", answer["status"])
            _report(
                batch,
                counts,
                faults,
                "wrong",
                np.flatnonzero(mask),
                what,
                lambda i, v=verdicts: f"said {v[i]}",
            )
    checked = np.zeros(answer["status"].shape, bool) | truth.pop("checked", False)
    for name, (value, low, doubt) in truth.items():
        said, bar = answer[name], answer[f"{name}_error"].astype(float)
        with np.errstate(all="ignore"):
            off, known, over = distance(said, value, low, doubt)
            lie = known & (over > bar)
            ratio = np.where(over > 0, over / bar, 0.0)
        checked |= _any(known & ((doubt <= bar) | (off == 0)))  # a vaguer truth checks little
        if known.any():
            worst = max(worst, float(np.nanmax(np.where(known, ratio, 0.0))))
        if lie.any():
            true = np.broadcast_to(value, off.shape)

            def described(i, name=name, said=said, bar=bar, off=off, true=true, ratio=ratio):
                j = np.nanargmax(ratio[i]) if ratio[i].ndim else ()
                at = np.unravel_index(j, ratio[i].shape) if ratio[i].ndim else ()
                return (
                    f"{name} = {said[i][at]!r} +- {bar[i][at]:.3g}, truth {true[i][at]!r}: off by "
                    f"{off[i][at]:.3g}, {ratio[i][at]:.3g} bars"
                )

            _report(batch, counts, faults, "lies", np.flatnonzero(_any(lie)), name, described)
    counts["unchecked"] += int((~checked & (answer["status"] == status.OK)).sum())
    return worst


def _order(answer, own, part):
    """For each multiplier of the points `part` the nearest of their `own`: moduli that are nearly
    equal may be sorted one way or the other.
    """
    mine, theirs = (found["multiplier_re"] + 1j * found["multiplier_im"] for found in (answer, own))
    off = np.nan_to_num(abs(mine[part][:, :, None] - theirs[:, None, :]), nan=1.0)
    return np.array([linear_sum_assignment(each)[1] for each in off])


def _solved_again(batch, answer, counts, faults):
    """Some of the points in another order, alone, at another rtol: within the sum of both bars, no
    other verdict.
    """
    random = np.random.default_rng(int(batch.rtol * 1e16))
    part = random.permutation(batch.size)[:3]
    each = {
        key: values[part] if np.ndim(values) else values for key, values in batch.each().items()
    }
    other = replace(
        batch, given=each, cross=(), chosen=None, rtol=float(10.0 ** -random.uniform(6, 13))
    )
    ds = solve(other)
    ok = (answer["status"][part] == status.OK) & (ds["status"].values == status.OK)
    own = {name: _flat(other, ds[name]) for name in ds.data_vars}
    order = _order(answer, own, part) if "multiplier_re" in own else None
    for name in ds.data_vars:
        if f"{name}_error" not in ds:
            continue
        a, b, bar = answer[name][part], own[name], own[f"{name}_error"].astype(float)
        if name.startswith("multiplier_"):
            b, bar = (np.take_along_axis(values, order, axis=1) for values in (b, bar))
        with np.errstate(invalid="ignore"):
            apart = np.abs(a - b) > answer[f"{name}_error"][part] + bar
        apart = _any(apart) & ok
        if apart.any():
            _report(other, counts, faults, "lies", np.flatnonzero(apart), f"{name} alone or at another rtol",
                  lambda i, a=a, b=b: f"{a[i]!r} in its batch at rtol {batch.rtol!r}, {b[i]!r} alone")  # fmt: skip
    if "verdict" in ds:
        a, b = answer["verdict"][part], _flat(other, ds["verdict"])
        apart = (
            ok
            & (a >= 0)
            & (b >= 0)
            & (a != b)
            & ~((batch.name == "brun states") & (np.minimum(a, b) >= 1))
        )
        if apart.any():
            _report(other, counts, faults, "wrong", np.flatnonzero(apart), "verdict alone or at another rtol",
                  lambda i, a=a, b=b: f"{a[i]} in its batch at rtol {batch.rtol!r}, {b[i]} alone")  # fmt: skip


def _report(batch, counts, faults, kind, points, what, words):
    counts[kind] += len(points)
    for i in points[:SHOWN]:
        said = words(i) if callable(words) else words
        faults.append({"kind": kind, "scene": batch.name, "region": batch.region, "what": what, "said": said,
                       "line": line(batch, i)})  # fmt: skip
