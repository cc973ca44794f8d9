"""A checked workflow -> a model: panels of Chebyshev series in two parameters, halved until they
are known to `rtol`.

The error bound of a panel is that of `survey.kernels.math.chebyshev`: the tails of the series, the
bounds at the nodes times the Lebesgue constants, and rounding; and what the kept terms leave out.
At points that are no nodes it is tried.
"""

import hashlib
import json
import platform
import zipfile
from collections import deque
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

import survey
from survey.errors import BadInput
from survey.file.disk import check_folder, write_atomically
from survey.kernels.math import chebyshev
from survey.kernels.math.roundoff import ROUNDOFF
from survey.model import functions
from survey.model.reader import FORMAT, SERIES, TABLE

NODES = 24  # of a panel, along each side
SMALLEST = 2.0**-10  # of a side of the map: smaller panels are left out, as around a singularity
BUDGET = 2_000_000  # points that are solved
MOST = 0.9  # the share of the nodes answered to the requested accuracy from which on a panel serves
DROPPED = 0.1  # of a panel's bound: what the terms that are left out may add to it
UNEVEN = 4.0  # a panel whose bounds at the nodes differ by more may gain from being halved
EVEN_OUT = 7  # halvings that are spent on that
FLOOR = 4.0
PARTS = 1000  # of the map, in which progress is counted
TRIED = np.array([-0.934, -0.551, 0.137, 0.862])  # points that are no nodes


@dataclass(frozen=True)
class ModelPanel:
    """`series` (F, n, n): coefficients of T_j in x by T_k in y, within `bars` (F)."""

    low: tuple[float, float]
    high: tuple[float, float]
    series: np.ndarray
    bars: np.ndarray


def model(workflow, path, proof=None, progress=None):
    """Write the model of a checked workflow to `path`; returns the number of bytes. Raises BadInput."""
    check_folder(path, ".model")
    content = packed(workflow, proof, progress=progress)
    write_atomically(Path(path), content)
    return len(content)


def packed(workflow, proof=None, budget=BUDGET, most=None, progress=None):
    """The model file of a checked workflow, as bytes; `proof`: what is proved of the map (see
    `proved`).

    At most about `budget` points are solved; `progress`: as `solved` calls it. Where there would be
    more than `most` bytes, the smallest panels are left out.
    """
    axes, fixed = _axes(workflow)
    names = [p.name for p in axes]
    sides = [tuple(float(end) for end in (own.min(), own.max()))
             for _, own in (workflow.grid.parameters[name] for name in names)]  # fmt: skip
    source = functions.of(workflow, names, fixed)
    panels = solved(source, sides, workflow.request.rtol, budget, progress)
    if not panels:
        raise BadInput(
            "model: no series converges on this map; choose axes where every point has an answer"
        )
    content = _file(workflow, source, axes, sides, fixed, panels, proof)
    while most is not None and len(content) > most and len(panels) > 1:
        largest = sorted(panels, key=lambda own: -np.prod(np.subtract(own.high, own.low)))
        panels = sorted(
            largest[: max(1, int(0.9 * len(panels) * most / len(content)))], key=lambda own: own.low
        )
        content = _file(workflow, source, axes, sides, fixed, panels, proof)
    return content


def _axes(workflow):
    """The two parameters that vary, and the values of the others."""
    used = {p.name: p for p in workflow.scene.PARAMETERS}
    values = {name: np.asarray(own) for name, (_, own) in workflow.grid.parameters.items()}
    axes = [used[name] for name, own in values.items() if own.size > 1]
    if len(axes) != 2:
        raise BadInput(
            f"model: {len(axes)} of the workflow's parameters vary; a model needs exactly two: "
            "make the others single numbers"
        )
    return axes, {name: float(own.reshape(-1)[0]) for name, own in values.items() if own.size == 1}


def solved(source, sides, rtol, budget=BUDGET, progress=None):
    """The Panels that serve the rectangle `sides`, each halved where its series is too short.

    `progress(done, total, 0, what)` is called with the part of the rectangle that is served or
    given up.
    """
    left = deque([(tuple(sides), (0, 0))])
    found = []
    spent = 0
    settled = 0.0
    while left and spent < budget:
        if progress is not None:
            progress(max(int(PARTS * settled), min(spent, 1)), PARTS, 0, "parts of the map")
        own, depth = left.popleft()
        panel, cut = _panel(source, own, rtol, depth)
        spent += NODES * NODES + TRIED.size**2
        if panel is None and 0.5 ** depth[cut] > SMALLEST:
            low, high = own[cut]
            deeper = (depth[0] + (cut == 0), depth[1] + (cut == 1))
            for half in ((low, 0.5 * (low + high)), (0.5 * (low + high), high)):
                left.append(((half, own[1]) if cut == 0 else (own[0], half), deeper))
            continue
        settled += 0.5 ** sum(depth)
        if panel is not None:
            found.append(panel)
    return sorted(found, key=lambda panel: panel.low)


def _panel(source, sides, rtol, depth):
    """(the ModelPanel, None), or (None, the side to be halved)."""
    middle = [0.5 * (low + high) for low, high in sides]
    radius = [0.5 * (high - low) for low, high in sides]
    longer = int(depth[1] < depth[0])
    nodes = chebyshev.symmetric_nodes(NODES)
    values, bars = source.at(*(m + r * nodes for m, r in zip(middle, radius, strict=True)))
    if not np.isfinite(values).all() or not np.isfinite(bars).all():
        return None, _away(values, longer)
    ulps = [(4 + abs(m) + r) / r for m, r in zip(middle, radius, strict=True)]
    series, tails, rest = expanded(values, ulps)
    noise = chebyshev.lebesgue(NODES) ** 2 * bars.max(axis=(1, 2))
    total = tails.sum(axis=0) + noise + rest
    served = (total[:, None, None] <= rtol * (1 + abs(values))).mean(axis=(1, 2))
    # nothing but rounding is left in the last coefficients
    sharp = tails.sum(axis=0) <= FLOOR * (noise + rest)
    uneven = bars.max(axis=(1, 2), keepdims=True) > UNEVEN * bars
    gains = (uneven.mean(axis=(1, 2)) > 1 - MOST) & (noise > rest)
    if ((served < MOST) & (~sharp | (gains & (sum(depth) < EVEN_OUT)))).any():
        worst = int(np.argmax(tails.sum(axis=0) / (noise + rest)))
        return None, int(tails[1, worst] > tails[0, worst]) if (~sharp).any() else _growth(
            values, longer
        )
    kept, dropped = _shortened(series, DROPPED * total)
    panel = ModelPanel(
        tuple(s[0] for s in sides), tuple(s[1] for s in sides), kept, 1.001 * (total + dropped)
    )
    held = _holds(source, panel, middle, radius)
    return (panel, None) if held else (None, longer)


def expanded(values, ulps):
    """(coefficients (F, n, n) of values (F, n, n) at the nodes; tails (2, F) along x and y; rounding (F))."""
    matrix = chebyshev.by_columns(values.shape[1])
    series = np.einsum("ij,fik->fjk", matrix, values)
    series = np.einsum("kl,fjk->fjl", matrix, series)
    sizes, k = abs(series), np.arange(values.shape[1])
    tails = np.array([chebyshev.tail(sizes.sum(axis=2)), chebyshev.tail(sizes.sum(axis=1))])
    # the transforms, the sums, and the arguments, where T_k' <= k^2
    weights = (
        16.0 + 2.0 * (k[:, None] + k) + (0.5 + ulps[0]) * k[:, None] ** 2 + (0.5 + ulps[1]) * k**2
    )
    return series, tails, ROUNDOFF * (sizes * weights).sum(axis=(1, 2))


def _away(values, longer):
    """The side along which the unknown values lie at one end."""
    known = np.isfinite(values).all(axis=0)
    spread = [np.ptp(known.mean(axis=1 - side)) for side in range(2)]
    return longer if spread[0] == spread[1] else int(spread[1] > spread[0])


def _growth(values, longer):
    """The side along which the values grow most."""
    size = np.log(1e-300 + abs(values).max(axis=0))
    spread = [np.ptp(size, axis=side).max() for side in range(2)]
    return longer if abs(spread[0] - spread[1]) < 0.1 * max(spread) else int(spread[1] > spread[0])


def _shortened(series, most):
    """The series without terms that add up to `most` (F), the smallest first; and what they add up to (F)."""
    out, dropped = series.copy(), np.zeros(len(series))
    for f, own in enumerate(out):
        order = np.argsort(abs(own), axis=None)
        sums = np.cumsum(abs(own).reshape(-1)[order])
        few = int(np.searchsorted(sums, most[f], side="right"))
        own.reshape(-1)[order[:few]] = 0.0
        dropped[f] = sums[few - 1] if few else 0.0
    return out, dropped


def _holds(source, panel, middle, radius):
    """Is the panel within its bounds where points were solved on their own?"""
    values, bars = source.at(*(m + r * TRIED for m, r in zip(middle, radius, strict=True)))
    table = np.polynomial.chebyshev.chebvander(TRIED, NODES - 1)
    series = np.einsum("fjk,aj,bk->fab", panel.series, table, table)
    return bool((abs(series - values) <= panel.bars[:, None, None] + bars).all())


def _file(workflow, source, axes, sides, fixed, panels, proof):
    """The bytes of the file (the format: workflows/docs/model.md)."""
    entries = []
    numbers = []
    first = 0
    for panel in panels:
        terms = []
        for own in panel.series:
            counts = _counts(own)
            terms.append(counts)
            numbers += [own[j, :count] for j, count in enumerate(counts)]
        entries.append({"low": panel.low, "high": panel.high, "bars": [float(bar) for bar in panel.bars],
                       "first": first, "terms": terms})  # fmt: skip
        first = sum(map(len, numbers))
    series = np.concatenate(numbers).astype("<f8").tobytes()
    options = ", ".join(f"{key}={value}" for key, value in workflow.request.options.items())
    table = {
        "format": FORMAT, "title": workflow.title, "scene": workflow.name, "options": options, "rule": source.rule,
        "parameters": [
            {"name": p.name, "long_name": p.long_name, "symbol": p.symbol, "units": p.units, "low": low, "high": high}
            for p, (low, high) in zip(axes, sides, strict=True)
        ],
        "fixed": fixed,
        "functions": [{"name": name, "long_name": words}
                      for name, words in zip(source.names, source.long_names, strict=True)],
        "rtol": workflow.request.rtol, "panels": entries, "sha256": hashlib.sha256(series).hexdigest(),
        "workflow": workflow.text, "references": list(workflow.scene.REFERENCES),
        "versions": {"survey": survey.__version__, "numpy": np.__version__, "python": platform.python_version()},
        "proof": proof,
    }  # fmt: skip
    out = BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, content in (
            (TABLE, json.dumps(table, indent=0, allow_nan=False).encode()),
            (SERIES, series),
        ):
            # a fixed date: the same map has the same bytes
            member = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            member.compress_type, member.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(member, content)
    return out.getvalue()


def _counts(series):
    """The number of terms in y that are kept for each degree in x, up to the last that has any."""
    kept = series != 0.0
    counts = np.where(kept.any(axis=1), series.shape[1] - kept[:, ::-1].argmax(axis=1), 0).tolist()
    while counts and counts[-1] == 0:
        counts.pop()
    return counts
